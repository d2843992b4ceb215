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
//! ```
//! use glam::{DAffine3, DVec3, Vec3, vec3};
//! use hemilux_accel::{GroupBuilder, NO_INSTANCE, Quadric, Ray, SceneBuilder};
//!
//! let mut world = GroupBuilder::new();
//! let floor = [vec3(-5.0, -5.0, 0.0), vec3(5.0, -5.0, 0.0), vec3(0.0, 5.0, 0.0)];
//! world.add_mesh(&floor, &[[0, 1, 2]]);
//! let mut lamp = GroupBuilder::new();
//! let bulb = Quadric::Sphere { radius: 0.1, z_min: -0.1, z_max: 0.1, phi_max: std::f64::consts::TAU };
//! lamp.add_quadric(bulb, DAffine3::IDENTITY);
//!
//! let mut scene = SceneBuilder::new(world.build());
//! let lamp = scene.add_group(lamp.build());
//! scene.add_instance(lamp, DAffine3::from_translation(DVec3::new(0.0, 0.0, 2.0)));
//! let accel = scene.build();
//!
//! let up = accel.closest(&Ray::new(vec3(0.0, 0.0, 1.0), Vec3::Z)).unwrap();
//! assert_eq!((up.instance, up.prim), (0, 0));
//! assert!((up.t - 0.9).abs() < 1e-6);
//! let down = accel.closest(&Ray::new(vec3(0.0, 0.0, 1.0), -Vec3::Z)).unwrap();
//! assert_eq!((down.instance, down.t), (NO_INSTANCE, 1.0));
//! ```
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

// Threads share one scene.
const _: fn() = || {
    fn shared<T: Send + Sync>() {}
    shared::<Accel>();
};
