//! Rays, hits, and what a traversal precomputes per ray.

use glam::{DVec3, Vec3};

use crate::bounds::Bounds;

/// The [`Hit::instance`] of geometry that belongs to the world itself.
pub const NO_INSTANCE: u32 = u32::MAX;

/// A half-open segment: the points `origin + t dir` with `t_min < t < t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in world space.
    pub origin: Vec3,
    /// Unit direction, so that `t` is a length. (Nothing here relies on it: with another length, `t` is in units of it.)
    pub dir: Vec3,
    /// Hits at or before this distance are ignored; 0 for rays spawned by [`offset_origin`](crate::offset_origin).
    pub t_min: f32,
    /// Hits at or beyond this distance are ignored; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// The ray from `origin` along the unit vector `dir`, for `0 < t < ∞`.
    pub fn new(origin: Vec3, dir: Vec3) -> Ray {
        Ray { origin, dir, t_min: 0.0, t_max: f32::INFINITY }
    }
}

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the world ray, in units of its direction's length.
    pub t: f32,
    /// Triangle: barycentric coordinate of vertex 1. Quadric: see [`Quadric::eval`](crate::Quadric::eval). In 0..=1.
    pub u: f32,
    /// Triangle: barycentric coordinate of vertex 2, `u + v <= 1` up to rounding. Quadric: as `u`. In 0..=1.
    pub v: f32,
    /// The primitive's number within its group.
    pub prim: u32,
    /// The instance's number, or [`NO_INSTANCE`].
    pub instance: u32,
}

/// A ray in the space of one group, and how its coordinates are permuted and sheared for the triangle test.
pub(crate) struct LocalRay {
    pub origin64: DVec3,
    pub dir64: DVec3,
    pub origin: [f32; 3],
    /// Axes, the last one that of the largest direction component.
    pub axes: [usize; 3],
    /// `dir[axes[0]] / dir[axes[2]]` and the same for axis 1: both within -1..=1.
    pub shear: [f32; 2],
    /// Reciprocal of the largest direction component.
    pub inv64: f64,
    dir: Vec3,
}

impl LocalRay {
    /// `None` when the ray has a component that is not finite in `f32`, or no direction.
    #[inline(always)]
    pub fn new(origin64: DVec3, dir64: DVec3) -> Option<LocalRay> {
        LocalRay::from_parts(origin64, dir64, origin64.as_vec3(), dir64.as_vec3())
    }

    #[inline(always)]
    pub fn from_world(ray: &Ray) -> Option<LocalRay> {
        LocalRay::from_parts(ray.origin.as_dvec3(), ray.dir.as_dvec3(), ray.origin, ray.dir)
    }

    #[inline(always)]
    fn from_parts(origin64: DVec3, dir64: DVec3, origin: Vec3, dir: Vec3) -> Option<LocalRay> {
        if !(origin.is_finite() && dir.is_finite() && dir != Vec3::ZERO) {
            return None;
        }
        let size = dir.abs();
        let axes = if size.x >= size.y && size.x >= size.z {
            [1, 2, 0]
        } else if size.y >= size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let d = dir.to_array();
        let shear = [d[axes[0]] / d[axes[2]], d[axes[1]] / d[axes[2]]];
        Some(LocalRay {
            origin64,
            dir64,
            origin: origin.to_array(),
            axes,
            shear,
            inv64: dir64[axes[2]].recip(),
            dir,
        })
    }

    /// The conservative slab test against boxes inside `bounds`.
    ///
    /// Let u = 2⁻²⁴ and M the largest distance along an axis from the origin to `bounds`. A sheared vertex of
    /// `triangle` is off by at most 6uM, a slab's plane by 3uM (difference, reciprocal, product). Moving the planes
    /// outwards by 16uM therefore never culls a box whose triangle the watertight test accepts. (T. Ize, *Robust BVH
    /// Ray Traversal*, JCGT 2013, bounds only the slab's share, relative to the distance of the plane; the share of
    /// far vertices of a large triangle needs M.)
    #[inline(always)]
    pub fn slab(&self, bounds: &Bounds) -> Slab {
        let pad = bounds.reach(Vec3::from_array(self.origin)) * (8.0 * f32::EPSILON);
        let mut slab = Slab { near: [0.0; 3], far: [0.0; 3], inv: [0.0; 3], side: [0; 3] };
        for (k, dir) in self.dir.to_array().into_iter().enumerate() {
            let (above, below) = ((self.origin[k] + pad).next_up(), (self.origin[k] - pad).next_down());
            let negative = dir.is_sign_negative();
            slab.side[k] = usize::from(negative);
            (slab.near[k], slab.far[k]) = if negative { (below, above) } else { (above, below) };
            slab.inv[k] = dir.recip();
        }
        slab
    }
}

/// A ray prepared for the slab test: `(plane - near) * inv` for entry planes, `(plane - far) * inv` for exit planes.
pub(crate) struct Slab {
    pub near: [f32; 3],
    pub far: [f32; 3],
    pub inv: [f32; 3],
    /// Which plane of an axis is the entry: 0 the lower, 1 the upper.
    pub side: [usize; 3],
}
