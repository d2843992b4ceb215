//! Watertight ray tracing of triangles, analytic quadrics and instances.
//!
//! ```text
//! GroupBuilder ── add_mesh, add_quadric ──► Group ──┐
//!                                                    ├─► SceneBuilder ──► Accel ── closest, occluded
//! instances (group, to_world) ───────────────────────┘
//! ```
//!
//! | module | room |
//! |---|---|
//! | [`ray`](Ray) | rays and hits, what a traversal precomputes per ray |
//! | `bounds`, `build`, `wide`, `traverse` | boxes; binned-SAH tree; 8-wide tree; its traversal |
//! | `lanes` | eight floats, portable or AVX2 |
//! | `triangle` | packs of triangles and their watertight test |
//! | `quadric` | spheres, disks, cylinders: intersection and parametrisation |
//! | `robust` | rounding-error bounds, spawning rays without an epsilon |
//! | `group`, `scene` | geometry in one space; the world with its instances |
//!
//! # What is promised
//!
//! - **Watertight**: a ray that meets the inside of a closed mesh hits it, also exactly at an edge or a vertex
//!   (S. Woop, C. Benthin, I. Wald, *Watertight Ray/Triangle Intersection*, JCGT 2013; the sign of each edge test
//!   is exact). Coordinates up to about 1e18. A zero-area triangle, or one with a coordinate that is not finite, is
//!   never hit.
//! - **Same bits** from the AVX2 path and the portable one (no fused multiply-add), and from any number of threads.
//! - **Total**: no input of finite or non-finite numbers makes a build or a query panic or hang. A ray with a
//!   component that is not finite, or with a zero direction, hits nothing.
//! - Lengths are in the unit of the scene; there is no epsilon anywhere: rounding is bounded, see [`offset_origin`].

mod bounds;
mod build;
mod group;
mod lanes;
mod quadric;
mod ray;
mod robust;
mod scene;
mod traverse;
mod triangle;
mod wide;

pub use bounds::Bounds;
pub use group::{Group, GroupBuilder};
pub use quadric::{Quadric, SurfacePoint};
pub use ray::{Hit, NO_INSTANCE, Ray};
pub use robust::{offset_origin, rounding_error, transform_error, triangle_normal, triangle_point};
pub use scene::{Accel, SceneBuilder};
