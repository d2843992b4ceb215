//! Flat pieces of space as strata of directions, eight at a time.
//!
//! A piece (triangle or parallelogram) is sampled evenly by its area. From x, direction w meets its plane at distance 1/(N·w),
//! and A·w / N·w and B·w / N·w are the coordinates along its sides (a homography): whether w meets it is three products, and
//! its density per steradian is constant over (N·w)³.
//!
//! Lanes are plain arrays, so that compilers see what goes together.

use super::cones::LANES;
use crate::world::outline::Outline;
use hemilux_scene::geom::Vec3;

type Lanes = [f32; LANES];

/// From within this sine of its plane a piece is not sampled.
const GRAZING: f32 = 1e-3;

#[inline(always)]
fn lanes(f: impl FnMut(usize) -> f32) -> Lanes {
    std::array::from_fn(f)
}

#[inline(always)]
fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    lanes(|i| a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i])
}

/// Pieces in space; lanes without one have no normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pieces {
    corner: [Lanes; 3],
    /// Unit.
    normal: [Lanes; 3],
    /// What a vector has to be multiplied by for its coordinates along the sides (1/m).
    along: [[Lanes; 3]; 2],
    /// Over the area (1/m²): share of the samples.
    share: Lanes,
    /// What coordinates along both sides may sum to: 1 in a triangle, 2 in a parallelogram.
    limit: Lanes,
}

impl Pieces {
    pub const NONE: Pieces = Pieces {
        corner: [[0.0; LANES]; 3],
        normal: [[0.0; LANES]; 3],
        along: [[[0.0; LANES]; 3]; 2],
        share: [0.0; LANES],
        limit: [0.0; LANES],
    };

    /// Put a piece with its share of the samples into a lane; one too thin for numbers stays out.
    pub fn put(&mut self, lane: usize, outline: &Outline, share: f32) {
        let [u, v] = outline.sides;
        let cross = u.cross(v);
        let scale = cross.length_squared().recip();
        let along = [v.cross(cross) * scale, cross.cross(u) * scale];
        let Some(normal) = cross.try_normalize().filter(|_| along.iter().all(|a| a.is_finite())) else {
            return;
        };
        let set = |lanes: &mut [Lanes; 3], v: Vec3| (0..3).for_each(|k| lanes[k][lane] = v[k]);
        set(&mut self.corner, outline.corner);
        set(&mut self.normal, normal);
        (0..2).for_each(|k| set(&mut self.along[k], along[k]));
        self.share[lane] = share / outline.area();
        self.limit[lane] = if outline.triangle { 1.0 } else { 2.0 };
    }

    /// Multiply all shares.
    pub fn scale(&mut self, factor: f32) {
        self.share.iter_mut().for_each(|s| *s *= factor);
    }

    /// As seen from `x`.
    #[inline]
    pub fn aimed(&self, x: Vec3, into: &mut Flats) {
        let c: [Lanes; 3] = [0, 1, 2].map(|k| lanes(|i| self.corner[k][i] - x[k]));
        let off = dot(&c, &self.normal);
        let distance2 = dot(&c, &c);
        // Nothing where the plane is seen edge on.
        let inverse = lanes(|i| {
            let seen = off[i] * off[i] > GRAZING * GRAZING * distance2[i];
            if seen { 1.0 / off[i] } else { 0.0 }
        });
        let n: [Lanes; 3] = [0, 1, 2].map(|k| lanes(|i| self.normal[k][i] * inverse[i]));
        for side in 0..2 {
            let along = &self.along[side];
            let at = dot(&c, along);
            for k in 0..3 {
                into.rows[3 * side + k] =
                    lanes(|i| if inverse[i] != 0.0 { along[k][i] - n[k][i] * at[i] } else { 0.0 });
            }
        }
        into.rows[6..9].copy_from_slice(&n);
        into.density = lanes(|i| self.share[i] * inverse[i].abs());
        into.limit = self.limit;
    }
}

/// Pieces as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flats {
    /// Rows of the homography: A, B, N.
    rows: [Lanes; 9],
    /// Share over area and distance from the plane; 0 where nothing is sampled.
    density: Lanes,
    limit: Lanes,
}

impl Flats {
    pub const NONE: Flats = Flats { rows: [[0.0; LANES]; 9], density: [0.0; LANES], limit: [0.0; LANES] };

    /// Density per steradian at unit `w`, of all together.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        let [a, b, n] = [0, 3, 6].map(|r| {
            let [x, y, z] = [&self.rows[r], &self.rows[r + 1], &self.rows[r + 2]];
            lanes(|i| w.x * x[i] + w.y * y[i] + w.z * z[i])
        });
        let less = |a: f32, b: f32| if a < b { a } else { b };
        // How far within the tightest side.
        let within = lanes(|i| {
            let sides = less(less(a[i], b[i]), less(n[i] - a[i], n[i] - b[i]));
            less(sides, self.limit[i] * n[i] - (a[i] + b[i]))
        });
        let all = lanes(|i| {
            let met = (within[i] >= 0.0) & (n[i] > 0.0);
            let cube = n[i] * n[i] * n[i];
            if met { self.density[i] / cube } else { 0.0 }
        });
        (all[0] + all[4]) + (all[1] + all[5]) + ((all[2] + all[6]) + (all[3] + all[7]))
    }

    /// A direction evenly over the piece in a lane by `u` in [0, 1)², and the density per steradian there if
    /// [`Flats::density`] misses the piece by rounding. `None` where it is seen edge on.
    pub fn sample(&self, lane: usize, u: [f32; 2]) -> Option<(Vec3, f32)> {
        if self.density[lane] <= 0.0 {
            return None;
        }
        let row = |r: usize| Vec3::new(self.rows[r][lane], self.rows[r + 1][lane], self.rows[r + 2][lane]);
        let (a, b, n) = (row(0), row(3), row(6));
        let limit = self.limit[lane];
        let [s, t] = match limit < 1.5 {
            true => {
                let root = (1.0 - u[0]).sqrt();
                [1.0 - root, u[1] * root]
            }
            false => u,
        };
        // The inverse of the homography, but for its determinant.
        let w = (b.cross(n) * s + n.cross(a) * t + a.cross(b)).try_normalize()?;
        let w = if n.dot(w) < 0.0 { -w } else { w };
        let (s, t, n) = (a.dot(w), b.dot(w), n.dot(w));
        let inside = s >= 0.0 && t >= 0.0 && s <= n && t <= n && s + t <= limit * n;
        Some((w, if inside { 0.0 } else { self.density[lane] / (n * n * n) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::{Key, sobol};

    /// Irradiance of a Lambertian piece straight above by its samples, against a fine sum over its area.
    #[test]
    fn samples_have_their_density_and_fill_the_piece() {
        for triangle in [false, true] {
            let outline = Outline {
                corner: Vec3::new(0.3, -0.2, 1.0),
                sides: [Vec3::new(0.5, 0.1, 0.3), Vec3::new(-0.2, 0.7, 0.1)],
                triangle,
            };
            let x = Vec3::new(0.1, 0.05, -0.3);
            let mut pieces = Pieces::NONE;
            pieces.put(3, &outline, 1.0);
            let mut flats = Flats::NONE;
            pieces.aimed(x, &mut flats);
            let (mut inside, mut sum) = (0, 0.0);
            let n = 4096u32;
            for i in 0..n {
                let u = sobol(i, Key::new(5));
                let (w, missed) = flats.sample(3, [u.u, u.v]).unwrap();
                let density = flats.density(w) + missed;
                inside += (missed == 0.0) as u32;
                sum += 1.0 / density as f64;
            }
            assert!(inside > n - 8, "{inside}");
            let (mut exact, cells) = (0.0, 400);
            for i in 0..cells * cells {
                let (s, t) = ((i % cells) as f32 + 0.5, (i / cells) as f32 + 0.5);
                let (s, t) = (s / cells as f32, t / cells as f32);
                if triangle && s + t > 1.0 {
                    continue;
                }
                let to = outline.corner + outline.sides[0] * s + outline.sides[1] * t - x;
                let across = outline.sides[0].cross(outline.sides[1]).dot(to).abs();
                exact += (across / to.length().powi(3)) as f64 / (cells * cells) as f64;
            }
            let solid_angle = sum / n as f64;
            assert!((solid_angle / exact - 1.0).abs() < 4e-3, "{triangle}: {solid_angle} against {exact}");
            // Beside it there is nothing.
            let beside = outline.corner - outline.sides[0] * 0.01 + outline.sides[1] * 0.3 - x;
            assert_eq!(flats.density(beside.normalize()), 0.0);
            // Edge on there is nothing to sample.
            pieces.aimed(outline.corner + outline.sides[0] * 2.0, &mut flats);
            assert!(flats.sample(3, [0.5, 0.5]).is_none());
        }
    }
}
