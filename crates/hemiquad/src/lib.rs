//! Quadrature on the unit square and the hemisphere that is honest about its errors.
//!
//! Built around P. Shirley and K. Chiu, "Notes on Adaptive Quadrature on the Hemisphere" (Indiana University, TR 411).

pub mod map;
pub mod points;
mod real;

pub use map::{Dir, Map, Uv};
pub use points::Key;
pub use real::Real;
