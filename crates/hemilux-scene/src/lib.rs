//! Scene descriptions for hemilux: what a file says, with the place where it says it.
//!
//! A [`Scene`] is plain, owned data without behaviour: shapes, materials, textures, luminaires, camera and film as
//! their file describes them, in metres and W·sr⁻¹·m⁻². Importers make it ([`load`]); the renderer prepares it for use.
//! Nothing here knows of rays or integrators.
//!
//! Invariants of a [`Scene`] that [`load`] returns: every index points into its arena, every number is finite, every
//! transform is invertible, every mesh index is in range, radii are positive.

pub mod diagnostic;
pub mod geom;
pub mod hints;
pub mod import;
pub mod scene;
pub mod spectrum;

pub use diagnostic::{Diagnostic, Severity, SourceFile, SourceMap, Span};
pub use import::{LoadError, LoadOptions, Loaded, load, load_pbrt_str, load_radiance_str};
pub use scene::*;
pub use spectrum::Rgb;
