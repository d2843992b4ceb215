//! Quadrature on the unit square and the hemisphere that is honest about its errors.
//!
//! ```
//! use hemiquad::{Key, Method, Probe, Workspace, method::TwoStage};
//! let mut inside = |p: &Probe| if p.uv.u.hypot(p.uv.v) < 0.7 { 1.0 } else { 0.0 };
//! let found = TwoStage::blind().integrate(&mut inside, 1024, Key::new(7), &mut Workspace::new());
//! let half = found.half_width_95().expect("this method knows its error");
//! assert!((found.value - std::f64::consts::PI * 0.7 * 0.7 / 4.0).abs() < 2.0 * half && half < 0.005);
//! ```
//!
//! Every [`Estimate`] says what it is worth: value, standard error (where the method has one), evaluations spent on the pilot and
//! on the estimate, the largest disk that may have gone unseen, and whether the method is biased. Nothing ever returns "0 ± 0".
//!
//! # Where to begin
//!
//! * Smooth integrand: [`method::Interlaced`], or [`method::GenzMalik`] when it is smooth and needs many digits.
//! * Edges, nothing known: [`method::TwoStage::blind`].
//! * Small bright features that the integrand can enlarge on request ([`Size`]): [`method::TwoStage`].
//! * A guess where the features are: [`method::Predicted`].
//! * An integral that is asked again and again in similar places: train a [`method::Trained`] partition on the samples of one and
//!   give it to [`method::Predicted`] for the next.
//!
//! # Over directions
//!
//! [`map`] carries the square to the hemisphere, the sphere, a cone or the visible normals of a rough surface, and back;
//! [`over_directions`] makes an integrand of a function of directions:
//!
//! ```
//! use hemiquad::{Dir, Key, Method, Workspace, map::Cosine, method::Sobol, over_directions};
//! // The irradiance from a uniform sky of radiance 1 is π.
//! let mut sky = over_directions(Cosine, |d: Dir<f64>| d.z);
//! let e = Sobol.integrate(&mut sky, 256, Key::new(1), &mut Workspace::new());
//! assert!((e.value - std::f64::consts::PI).abs() < 1e-9);
//! ```
//!
//! # The report
//!
//! The crate is built around P. Shirley and K. Chiu, "Notes on Adaptive Quadrature on the Hemisphere" (Indiana University,
//! technical report 411, 1994): its map ([`map::Concentric`]), its partitions ([`partition`]), its criteria ([`criterion`]) and every
//! method that it names ([`method`]), biased ones included and labelled so, beside unbiased ones that came after.

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
pub use estimate::{Estimate, Evaluations, SURPRISE, student_975};
pub use integrand::{Batch, Integrand, Probe, Size, Stage, over_directions};
pub use map::{Dir, Map, Uv};
pub use method::{Method, Region, Workspace};
pub use points::Key;
pub use real::Real;
pub use shape::{Shape, turn};
pub use value::{Loudest, Value};
