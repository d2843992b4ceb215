//! Packs of triangles and their watertight test.
//!
//! S. Woop, C. Benthin, I. Wald, *Watertight Ray/Triangle Intersection*, JCGT 2013: vertices are sheared into a plane
//! across the ray (the same rounded image for every triangle that shares the vertex) and the signs of three 2D cross
//! products decide. In `f32` such a sign is right or zero, because rounding is monotone; a zero is settled in `f64`,
//! where the products are exact. So the decision is that of exact planar geometry and leaves no gaps.
//!
//! The distance is then computed in `f64` from the triangle's plane, since its error decides whether a ray hits the
//! triangle it starts from.

use glam::{DVec3, Vec3};

use crate::lanes::Lanes;
use crate::ray::LocalRay;

/// Triangles per pack and so per leaf.
pub(crate) const LANES: usize = 8;

/// Up to [`LANES`] triangles in structure-of-arrays order; missing ones are NaN, which fails every test.
#[repr(C, align(32))]
pub(crate) struct TrianglePack {
    /// Vertex, axis, lane.
    pub vertex: [[[f32; LANES]; 3]; 3],
    pub prim: [u32; LANES],
}

/// True when the triangle can be hit: finite, and not of zero area in exact arithmetic on its coordinates (`f64`
/// differences and products of `f32` are exact unless the coordinates are spread over more than 2²⁴).
pub(crate) fn is_proper(v: &[Vec3; 3]) -> bool {
    let [a, b, c] = v.map(Vec3::as_dvec3);
    let n = (b - a).cross(c - a);
    v.iter().all(|p| p.is_finite()) && n != DVec3::ZERO
}

impl TrianglePack {
    pub fn new(prims: &[u32], vertices: impl Fn(u32) -> [Vec3; 3]) -> TrianglePack {
        let mut pack = TrianglePack { vertex: [[[f32::NAN; LANES]; 3]; 3], prim: [0; LANES] };
        for (lane, &prim) in prims.iter().enumerate().take(LANES) {
            for (k, p) in vertices(prim).iter().enumerate() {
                for axis in 0..3 {
                    pack.vertex[k][axis][lane] = p[axis];
                }
            }
            pack.prim[lane] = prim;
        }
        pack
    }

    /// The lanes whose triangle the line of the ray meets.
    #[inline(always)]
    pub fn candidates<L: Lanes>(&self, ray: &LocalRay) -> u32 {
        let [kx, ky, kz] = ray.axes;
        let origin = [L::splat(ray.origin[kx]), L::splat(ray.origin[ky]), L::splat(ray.origin[kz])];
        let shear = [L::splat(ray.shear[0]), L::splat(ray.shear[1])];
        let mut x = [origin[0]; 3];
        let mut y = [origin[1]; 3];
        for k in 0..3 {
            let v = &self.vertex[k];
            let z = L::load(&v[kz]).sub(origin[2]);
            x[k] = L::load(&v[kx]).sub(origin[0]).sub(shear[0].mul(z));
            y[k] = L::load(&v[ky]).sub(origin[1]).sub(shear[1].mul(z));
        }
        let e = [
            x[2].mul(y[1]).sub(y[2].mul(x[1])),
            x[0].mul(y[2]).sub(y[0].mul(x[2])),
            x[1].mul(y[0]).sub(y[1].mul(x[0])),
        ];
        let (mut inside, zero) = L::one_sign(e);
        if zero != 0 {
            inside |= settle(
                [x[0].store(), x[1].store(), x[2].store()],
                [y[0].store(), y[1].store(), y[2].store()],
                zero,
            );
        }
        inside
    }

    /// The distance to the plane of a candidate, kept between the distances of its vertices: where the ray grazes the
    /// plane, or lies in it, the candidate is still hit and its neighbours need not cover it.
    #[inline(always)]
    pub fn distance(&self, lane: usize, ray: &LocalRay) -> f32 {
        let [a, b, c] = self.vertices(lane);
        let n = (b - a).cross(c - a);
        let t = n.dot(a - ray.origin64) / n.dot(ray.dir64);
        let kz = ray.axes[2];
        let [za, zb, zc] = [a, b, c].map(|p| (p[kz] - ray.origin64[kz]) * ray.inv64);
        let (low, high) = (least(za, least(zb, zc)), -least(-za, least(-zb, -zc)));
        // In this order NaN becomes `low`.
        least(-least(-t, -low), high) as f32
    }

    /// Barycentric coordinates of vertices 1 and 2.
    pub fn barycentric(&self, lane: usize, ray: &LocalRay) -> (f32, f32) {
        let [a, b, c] = self.vertices(lane);
        let (e1, e2, s) = (b - a, c - a, ray.origin64 - a);
        let p = ray.dir64.cross(e2);
        let inv = e1.dot(p).recip();
        let u = (s.dot(p) * inv).clamp(0.0, 1.0);
        let v = (ray.dir64.dot(s.cross(e1)) * inv).clamp(0.0, 1.0 - u);
        (u as f32, v as f32)
    }

    #[inline(always)]
    fn vertices(&self, lane: usize) -> [DVec3; 3] {
        let lane = lane & (LANES - 1);
        self.vertex.map(|v| DVec3::new(f64::from(v[0][lane]), f64::from(v[1][lane]), f64::from(v[2][lane])))
    }
}

/// The smaller; `b` if either is NaN. One instruction, where `f64::min` needs four.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The lanes of `mask` that are inside when edge signs are exact; an edge belongs to both its triangles.
#[cold]
#[inline(never)]
fn settle(x: [[f32; LANES]; 3], y: [[f32; LANES]; 3], mask: u32) -> u32 {
    let mut inside = 0;
    for i in (0..LANES).filter(|i| mask >> i & 1 == 1) {
        let [x, y] = [x, y].map(|c| [f64::from(c[0][i]), f64::from(c[1][i]), f64::from(c[2][i])]);
        let e = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]];
        let closed = e.iter().all(|&e| e >= 0.0) || e.iter().all(|&e| e <= 0.0);
        // All zero: the triangle is seen edge-on, and its neighbours cover it.
        inside |= u32::from(closed && e.iter().any(|&e| e != 0.0)) << i;
    }
    inside
}
