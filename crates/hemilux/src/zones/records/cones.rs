//! The cones of the virtual luminaires expected at one point: a mixture of directions.
//!
//! Each candidate gives one cone: around the image, or around the patch that limits it, or by regression, whichever is
//! tightest. Its share of the samples is the irradiance it is expected to bring if it is seen at all; an image whose ray
//! would pass beside a patch of its chain is expected not to be seen. Small parts of the shares follow the flux of nearby
//! records and nothing at all, since expectations err.
//!
//! Invariant: [`Cones::sample`] has exactly [`Cones::density`].

use super::model::Signature;
use super::{Candidate, NONE, Records};
use hemilux_scene::geom::{Frame, Vec3};

/// Cones at most; the candidates with least flux are left out.
pub const MOST: usize = 1024;
/// Cones tested at once: a block.
const LANES: usize = 8;
const BLOCKS: usize = MOST / LANES;
/// No cone is wider than this (1 − cos): there an image is only guessed at.
const WIDEST: f32 = 0.15;
/// Share of the samples by flux of nearby records, and without regard to anything.
const BY_FLUX: f32 = 0.25;
const EVENLY: f32 = 0.1;
/// An image seen past a patch of its chain counts this much.
const BESIDE: f32 = 0.05;

/// A mixture of cones of directions.
#[derive(Clone, Debug)]
pub struct Cones {
    axis: [[f32; MOST]; 3],
    /// 1 − cos of the half-angle.
    height: [f32; MOST],
    /// Share over solid angle.
    density: [f32; MOST],
    /// Cumulative share.
    cumulative: [f32; MOST],
    /// Per block: centre of a ball around its cones on the unit sphere, and squared radius.
    block: [[f32; BLOCKS]; 4],
    count: usize,
    /// How many cones of equal share would be as uneven.
    effective: f32,
}

impl Default for Cones {
    fn default() -> Self {
        Cones::none()
    }
}

impl Cones {
    /// No cone at all.
    pub fn none() -> Cones {
        Cones {
            axis: [[0.0; MOST]; 3],
            height: [-1.0; MOST],
            density: [0.0; MOST],
            cumulative: [0.0; MOST],
            block: [[0.0; BLOCKS]; 4],
            count: 0,
            effective: 0.0,
        }
    }

    /// The cones at `x` on a surface that faces unit `n`.
    pub fn new(records: &Records, x: Vec3, n: Vec3) -> Cones {
        let mut all = Cones::none();
        all.fill(records, x, n);
        all
    }

    /// The same, in place.
    pub fn fill(&mut self, records: &Records, x: Vec3, n: Vec3) {
        self.count = 0;
        self.effective = 0.0;
        let mut expected = [0f32; MOST];
        // Per kind of source, luminaires and zones: what is expected of them here, and their flux nearby. Expectations of
        // one kind can be compared, those of two less well: there the records know better.
        let (mut sum, mut flux, mut kind) = ([0.0; 2], [0.0; 2], [0u8; MOST]);
        for c in records.near(x, n) {
            let (axis, sin2, seen) = records.cone(c, x);
            let cos = axis.dot(n);
            if cos <= 0.0 && sin2 < cos * cos {
                continue;
            }
            let height = (0.5 * sin2 * (1.0 + 0.25 * sin2)).clamp(1e-12, WIDEST);
            let k = self.count;
            (self.axis[0][k], self.axis[1][k], self.axis[2][k]) = (axis.x, axis.y, axis.z);
            self.height[k] = height;
            // What is not expected to be seen hardly counts by its records either: they lie elsewhere.
            self.cumulative[k] = c.share * if seen == BESIDE { BESIDE } else { 1.0 };
            let signature = &records.signatures[c.signature as usize];
            // Where nobody knows what limits the image, its size says nothing.
            let known = c.linear != NONE || signature.is_known();
            let cos = cos.max(0.5 * sin2.sqrt());
            expected[k] = if known { signature.strength * height * seen * cos } else { 0.0 };
            kind[k] = signature.kind & 1;
            sum[kind[k] as usize] += expected[k];
            flux[kind[k] as usize] += self.cumulative[k];
            self.count += 1;
            if self.count == MOST {
                break;
            }
        }
        if self.count == 0 {
            return;
        }
        let all_flux = (flux[0] + flux[1]).max(f32::MIN_POSITIVE);
        let promising = (0..2).map(|g| if sum[g] > 0.0 { flux[g] } else { 0.0 }).sum::<f32>();
        let by_flux = BY_FLUX / all_flux;
        let by_expectation = [0, 1].map(|g| match promising > 0.0 && sum[g] > 0.0 {
            true => (1.0 - BY_FLUX - EVENLY) * flux[g] / (promising * sum[g]),
            false => 0.0,
        });
        let even = (if promising > 0.0 { EVENLY } else { 1.0 - BY_FLUX }) / self.count as f32;
        let (mut cumulative, mut squares) = (0.0, 0.0);
        for (k, expected) in expected[..self.count].iter().enumerate() {
            let share = by_expectation[kind[k] as usize] * expected + by_flux * self.cumulative[k] + even;
            cumulative += share;
            squares += share * share;
            self.cumulative[k] = cumulative;
            self.density[k] = share / (2.0 * std::f32::consts::PI * self.height[k]);
        }
        // Rounding must not leave the last cone short, nor the densities too high.
        for k in 0..self.count {
            self.cumulative[k] /= cumulative;
            self.density[k] /= cumulative;
        }
        self.effective = cumulative * cumulative / squares;
        self.bound_blocks();
    }

    /// Fill up the last block, and bound each.
    fn bound_blocks(&mut self) {
        let blocks = self.count.div_ceil(LANES);
        for k in self.count..blocks * LANES {
            (self.height[k], self.density[k]) = (-1.0, 0.0);
        }
        for b in 0..blocks {
            let members = b * LANES..((b + 1) * LANES).min(self.count);
            let axis = |k: usize| Vec3::new(self.axis[0][k], self.axis[1][k], self.axis[2][k]);
            let centre = members.clone().map(axis).sum::<Vec3>() / members.len() as f32;
            // 1 − cos = chord² / 2.
            let reach = |k: usize| (axis(k) - centre).length() + (2.0 * self.height[k]).sqrt();
            let radius = members.map(reach).fold(0.0, f32::max) * 1.0001;
            (self.block[0][b], self.block[1][b], self.block[2][b]) = (centre.x, centre.y, centre.z);
            self.block[3][b] = radius * radius;
        }
        for b in blocks..blocks.next_multiple_of(LANES) {
            self.block[3][b] = -1.0;
        }
    }

    /// Number of cones.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Each cone: unit axis, 1 − cos of the half-angle, share of the samples.
    pub fn iter(&self) -> impl Iterator<Item = (Vec3, f32, f32)> + '_ {
        (0..self.count).map(|k| {
            let axis = Vec3::new(self.axis[0][k], self.axis[1][k], self.axis[2][k]);
            let before = if k == 0 { 0.0 } else { self.cumulative[k - 1] };
            (axis, self.height[k], self.cumulative[k] - before)
        })
    }

    /// Whether nothing is expected.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// How many cones of equal share would be as uneven as these.
    pub fn effective(&self) -> f32 {
        self.effective
    }

    /// Density per steradian of the mixture at unit `w`.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        let mut sum = 0.0;
        let blocks = self.count.div_ceil(LANES);
        let mut at = 0;
        while at < blocks {
            let mut met = 0u32;
            for lane in 0..LANES {
                let b = at + lane;
                let (x, y, z) = (w.x - self.block[0][b], w.y - self.block[1][b], w.z - self.block[2][b]);
                met |= ((x * x + y * y + z * z <= self.block[3][b]) as u32) << lane;
            }
            while met != 0 {
                sum += self.block_density(at + met.trailing_zeros() as usize, w);
                met &= met - 1;
            }
            at += LANES;
        }
        sum
    }

    #[inline]
    fn block_density(&self, block: usize, w: Vec3) -> f32 {
        let mut sums = [0f32; LANES];
        for (lane, sum) in sums.iter_mut().enumerate() {
            let k = block * LANES + lane;
            // 1 − cos by the chord, which keeps its digits for small angles.
            let (x, y, z) = (w.x - self.axis[0][k], w.y - self.axis[1][k], w.z - self.axis[2][k]);
            let inside = 0.5 * (x * x + y * y + z * z) <= self.height[k];
            *sum = if inside { self.density[k] } else { 0.0 };
        }
        sums.iter().sum()
    }

    /// A direction of the mixture: the cone by `pick`, where in it by `u`, all in [0, 1).
    pub fn sample(&self, pick: f32, u: [f32; 2]) -> Vec3 {
        let k = self.cumulative[..self.count].partition_point(|&c| c <= pick).min(self.count - 1);
        let axis = Vec3::new(self.axis[0][k], self.axis[1][k], self.axis[2][k]);
        let x = u[0] * self.height[k];
        let sin = (x * (2.0 - x)).max(0.0).sqrt();
        let (s, c) = (2.0 * std::f32::consts::PI * u[1]).sin_cos();
        Frame::from_normal(axis).to_world(Vec3::new(sin * c, sin * s, 1.0 - x)).normalize()
    }
}

impl Records {
    /// The cone of a candidate at `x`: axis, squared sine of the half-angle; and how much of it is expected to show the
    /// image, 0 to 1.
    #[inline]
    fn cone(&self, c: &Candidate, x: Vec3) -> (Vec3, f32, f32) {
        if c.linear != NONE {
            let linear = &self.linears[c.linear as usize];
            return (linear.dir(x), linear.sin2, 1.0);
        }
        let Signature { places, windows, .. } = &self.signatures[c.signature as usize];
        let towards = |k: usize| {
            let to = places[k].centre - x;
            let distance2 = to.length_squared().max(f32::MIN_POSITIVE);
            (to * distance2.sqrt().recip(), (places[k].radius * places[k].radius / distance2).min(1.0))
        };
        let (axis, sin2) = towards(c.best as usize);
        if c.gates == 0 {
            return (axis, sin2, 1.0);
        }
        let (to_image, image_sin2) = if c.best == 0 { (axis, sin2) } else { towards(0) };
        let angle = image_sin2.sqrt();
        let mut tightest = (axis, sin2, 1.0);
        for k in 1..3 {
            if (c.gates | 1 << c.best) >> k & 1 == 0 {
                continue;
            }
            match windows[k - 1] {
                Some(window) => {
                    let Some(part) = window.part(x, to_image, angle, 0.0) else {
                        return (axis, sin2, BESIDE);
                    };
                    let (axis, sin2) = if part.clipped { part.cone(x) } else { (to_image, image_sin2) };
                    // The image is round, not square.
                    let area = std::f32::consts::FRAC_PI_4 * part.area / (part.distance * part.distance);
                    if sin2 <= tightest.1 {
                        tightest = (axis, sin2, (area / (std::f32::consts::PI * sin2)).min(1.0));
                    }
                }
                // Both balls must lie on one ray.
                None => {
                    let to = places[k].centre - x;
                    let along = to.dot(to_image);
                    let offset = to_image * along - to;
                    if offset.length_squared() > (places[k].radius + angle * along.abs()).powi(2) {
                        return (axis, sin2, BESIDE);
                    }
                }
            }
        }
        tightest
    }
}

#[cfg(test)]
mod tests {
    use super::super::Record;
    use super::*;
    use hemiquad::points::{Key, sobol};

    #[test]
    fn samples_lie_within_and_densities_integrate_to_one() {
        let record = |i: u32, to: Vec3, radius: f32| Record {
            p: Vec3::ZERO,
            n: Vec3::Z,
            dir: to.normalize(),
            reach: [1.0, 1.0],
            length: to.length(),
            signature: i,
            class: i,
            radius,
            flux: 1.0 + i as f32,
            strength: 1.0,
            of_zone: false,
        };
        let all = vec![
            record(0, Vec3::new(0.0, 0.0, 2.0), 0.3),
            record(1, Vec3::new(0.1, 0.0, 2.0), 0.3),
            record(2, Vec3::new(2.0, 0.0, 2.0), 0.01),
        ];
        let records = Records::new(all);
        let cones = Cones::new(&records, Vec3::ZERO, Vec3::Z);
        assert_eq!(cones.len(), 3);
        // E[1 / density] over samples is the solid angle of the union.
        let n = 20_000;
        let mean: f64 = (0..n)
            .map(|i| {
                let (a, b) = (sobol(i, Key::new(1)), sobol(i, Key::new(2)));
                let w = cones.sample(a.u, [b.u, b.v]);
                let d = cones.density(w);
                assert!(d > 0.0, "{w} lies in no cone");
                1.0 / d as f64
            })
            .sum::<f64>()
            / n as f64;
        let uniform = 400_000;
        let union: f64 = (0..uniform)
            .map(|i| {
                let u = sobol(i, Key::new(9));
                let d: hemiquad::map::Dir<f32> =
                    hemiquad::map::Map::dir(&hemiquad::map::Concentric, hemiquad::map::Uv::new(u.u, u.v));
                (cones.density(Vec3::new(d.x, d.y, d.z)) > 0.0) as u32 as f64 * std::f64::consts::TAU
            })
            .sum::<f64>()
            / uniform as f64;
        assert!((mean / union - 1.0).abs() < 0.03, "{mean} against {union}");
    }
}
