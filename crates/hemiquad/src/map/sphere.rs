//! The full sphere: P. Clarberg, "Fast equal-area mapping of the (hemi)sphere using SIMD", 2008. The inner diamond of the
//! square is the upper hemisphere (the report's map turned by 45°), the four corners fold down to the lower one.

use super::{Dir, Map, Uv};
use crate::real::Real;

/// The square to the whole sphere, equal area: dω = 4π du dv. Adjacent inside the square; the edges are glued along the lower
/// hemisphere, so a feature there may be cut in two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sphere;

impl<T: Real> Map<T> for Sphere {
    #[inline(always)]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let a = at.u + at.u - T::ONE;
        let b = at.v + at.v - T::ONE;
        let (p, q) = (a.abs(), b.abs());
        let d = T::ONE - (p + q);
        let r = T::ONE - d.abs();
        // φ = (π/4)((q - p)/r + 1) lies in the first quadrant; half a quadrant is taken out so that the polynomials apply.
        let t = if r > T::ZERO { ((q - p) / r).max(-T::ONE).min(T::ONE) } else { T::ZERO };
        let (s, c) = T::sin_cos_octant(t);
        let root_half = T::of(std::f64::consts::FRAC_1_SQRT_2);
        let (cos, sin) = ((c - s) * root_half, (c + s) * root_half);
        let r2 = r * r;
        let w = r * (T::of(2.0) - r2).sqrt();
        Dir { x: (w * cos).copysign(a), y: (w * sin).copysign(b), z: (T::ONE - r2).copysign(d) }
    }

    #[inline(always)]
    fn uv(&self, d: Dir<T>) -> Option<Uv<T>> {
        let (x, y) = (d.x.abs(), d.y.abs());
        let r = ((x * x + y * y) / (T::ONE + d.z.abs())).sqrt().min(T::ONE);
        // In the first quadrant q = r (2/π) φ and p = r - q; below the horizon both are mirrored in the diamond's edge.
        let t = if x > T::ZERO || y > T::ZERO { y.atan2(x) * T::of(2.0) / T::PI } else { T::ZERO };
        let (mut q, mut p) = (r * t, r - r * t);
        if d.z < T::ZERO {
            (p, q) = (T::ONE - q, T::ONE - p);
        }
        let half = T::of(0.5);
        Some(Uv::new(
            (p.copysign(d.x) * half + half).min(T::BELOW_ONE),
            (q.copysign(d.y) * half + half).min(T::BELOW_ONE),
        ))
    }

    #[inline(always)]
    fn pdf_solid_angle(&self, _: Dir<T>) -> T {
        T::of(0.25) / T::PI
    }
}
