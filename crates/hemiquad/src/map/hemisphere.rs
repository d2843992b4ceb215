//! The hemisphere: the report's equal-area map, its cosine-weighted sibling, and (θ, φ) for comparison.

use super::{Dir, Map, Uv, concentric, concentric_inverse};
use crate::real::Real;

/// The report's map of the square to the upper hemisphere (section 5 and appendix) without its eight branches: preserves
/// adjacency and area, aspect ratio between 1.27 and 3.00, largest stretch 4.34 rad per unit of the square.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Concentric;

impl Concentric {
    /// The largest stretch, anywhere: how many radians a unit of the square can become.
    pub const LARGEST_STRETCH: f64 = 4.3407;

    /// The half-angle, in radians, of the largest cap of directions that n × n jittered samples can miss: every larger one
    /// contains a whole cell, and so a sample, in every outcome. About 4.16/n; 23.8° for n = 10. (On the square itself it is the
    /// disk of radius √2/n: report, section 4, as corrected.)
    pub fn guaranteed_cap(n: u32) -> f64 {
        let h = 1.0 / n.max(1) as f64;
        let near = |x: f64| Map::<f64>::dir(&Concentric, Uv::new(x, 0.0));
        // 1 - cos of the angle from a centre to the farthest point of a cell (found on the cell's edges).
        let farthest = |centre: Dir<f64>, x: i64, y: i64| {
            let mut least: f64 = 1.0;
            for k in 0..=8 {
                let t = k as f64 / 8.0;
                for (a, b) in [(t, 0.0), (t, 1.0), (0.0, t), (1.0, t)] {
                    let p: Dir<f64> = Concentric.dir(Uv::new((x as f64 + a) * h, (y as f64 + b) * h));
                    least = least.min(p.dot(centre));
                }
            }
            least
        };
        // The worst centres lie on the horizon near the middle of a side of the square; which of them depends on the grid's phase.
        let n = n.max(1) as i64;
        let middle = n / 2;
        let mut worst: f64 = 1.0;
        for k in -16..=16 {
            let centre = near((middle as f64 + k as f64 / 16.0) * h);
            let mut best: f64 = -1.0;
            for x in (middle - 4).max(0)..=(middle + 4).min(n - 1) {
                for y in 0..n.min(3) {
                    best = best.max(farthest(centre, x, y));
                }
            }
            worst = worst.min(best);
        }
        worst.clamp(-1.0, 1.0).acos()
    }
}

impl<T: Real> Map<T> for Concentric {
    #[inline(always)]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let (c, s, r) = concentric(at);
        // cos θ = 1 - r², and sin θ from the same product: acos(1 - r²) loses the pole in single precision.
        let r2 = r * r;
        let sin = r * (T::of(2.0) - r2).sqrt();
        Dir { x: sin * c, y: sin * s, z: T::ONE - r2 }
    }

    #[inline(always)]
    fn uv(&self, d: Dir<T>) -> Option<Uv<T>> {
        if d.z < -T::SLACK {
            return None;
        }
        // r = √(1 - z) written without the cancellation at the pole.
        let z = d.z.max(T::ZERO);
        let r = ((d.x * d.x + d.y * d.y) / (T::ONE + z)).sqrt();
        Some(concentric_inverse(d.x, d.y, r))
    }

    #[inline(always)]
    fn pdf_solid_angle(&self, d: Dir<T>) -> T {
        if d.z < -T::SLACK { T::ZERO } else { T::of(0.5) / T::PI }
    }
}

/// The cosine-weighted hemisphere: the concentric disk lifted to the sphere (Nusselt's analogue). cos θ dω = π du dv.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cosine;

impl<T: Real> Map<T> for Cosine {
    #[inline(always)]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let (c, s, r) = concentric(at);
        // (1 - r)(1 + r) keeps its digits near the horizon.
        let r1 = r.abs();
        let z = ((T::ONE - r1) * (T::ONE + r1)).max(T::ZERO).sqrt();
        Dir { x: r * c, y: r * s, z }
    }

    #[inline(always)]
    fn uv(&self, d: Dir<T>) -> Option<Uv<T>> {
        if d.z < -T::SLACK {
            return None;
        }
        Some(concentric_inverse(d.x, d.y, (d.x * d.x + d.y * d.y).sqrt()))
    }

    #[inline(always)]
    fn pdf_solid_angle(&self, d: Dir<T>) -> T {
        d.z.max(T::ZERO) / T::PI
    }
}

/// Naive spherical coordinates, θ = (π/2)u and φ = 2πv: what section 5 of the report warns of. The edge u = 0 is one point,
/// φ = 0 is a cut, the aspect ratio is 4 sin θ, and the density 1/(π² sin θ) has no bound at the pole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polar;

impl<T: Real> Map<T> for Polar {
    #[inline(always)]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let (st, ct) = (at.u * T::PI * T::of(0.5)).sin_cos();
        let (sp, cp) = (at.v * T::PI * T::of(2.0)).sin_cos();
        Dir { x: st * cp, y: st * sp, z: ct }
    }

    #[inline(always)]
    fn uv(&self, d: Dir<T>) -> Option<Uv<T>> {
        if d.z < -T::SLACK {
            return None;
        }
        let h = (d.x * d.x + d.y * d.y).sqrt();
        let u = h.atan2(d.z.max(T::ZERO)) * T::of(2.0) / T::PI;
        let turn = d.y.atan2(d.x) * T::of(0.5) / T::PI;
        let v = if turn < T::ZERO { turn + T::ONE } else { turn };
        Some(Uv::new(u.min(T::BELOW_ONE), v.min(T::BELOW_ONE)))
    }

    #[inline(always)]
    fn pdf_solid_angle(&self, d: Dir<T>) -> T {
        if d.z < -T::SLACK {
            return T::ZERO;
        }
        let h = (d.x * d.x + d.y * d.y).sqrt();
        T::ONE / (T::PI * T::PI * h)
    }
}
