//! Quadrature on the unit square and the hemisphere that is honest about its errors.
//!
//! Built around P. Shirley and K. Chiu, "Notes on Adaptive Quadrature on the Hemisphere" (Indiana University, TR 411).

pub mod allocation;
pub mod criterion;
pub mod curve;
mod estimate;
pub mod gap;
mod integrand;
pub mod map;
pub mod method;
pub mod partition;
pub mod points;
mod real;
mod shape;
pub mod suite;
mod value;

pub use criterion::{CellView, Criterion, Weighted};
pub use estimate::{Estimate, Evaluations, student_975};
pub use integrand::{Batch, Integrand, Probe, Size, Stage, over_directions};
pub use map::{Dir, Map, Uv};
pub use method::{Method, Region, Workspace};
pub use points::Key;
pub use real::Real;
pub use shape::{Shape, turn};
pub use value::{Loudest, Value};
