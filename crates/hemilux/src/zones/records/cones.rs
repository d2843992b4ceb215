//! The cones of the virtual luminaires expected at one point: a mixture of directions.
//!
//! Each candidate gives one shape: a cone around the image, or by regression; or the flat piece of a patch that lets the image
//! through, a triangle or a parallelogram in space; whichever is tightest. Its share of the samples is the irradiance it is
//! expected to bring; an image whose ray passes beside a patch is left out. Small parts of the shares follow the flux of nearby
//! records and nothing at all, since expectations err. What is expected is worked out once per [`Spot`], in space, and only
//! pointed at a gather.
//!
//! Invariants: [`Cones::sample`] has exactly [`Cones::density`]; both depend on the point and the records alone, never on what
//! a thread remembers.

use super::Records;
use super::expected::{Expected, with_expected};
use super::flat::Flats;
use super::model::Linear;
use super::view::height_of;
use hemilux_scene::geom::{Frame, Vec3};
use std::cell::RefCell;

/// Shapes at most; the candidates with least flux are left out.
pub const MOST: usize = 1024;
/// Shapes tested at once: a block.
pub(super) const LANES: usize = 8;
const BLOCKS: usize = MOST / LANES;

/// A mixture of cones and flat pieces: round ones first, then, from a block of their own, the flat ones.
#[derive(Clone, Debug)]
pub struct Cones {
    /// Of a cone around each shape.
    axis: [[f32; MOST]; 3],
    /// 1 − cos of its half-angle.
    height: [f32; MOST],
    /// Share over solid angle, of the round ones.
    density: [f32; MOST],
    /// The flat ones.
    flats: [Flats; BLOCKS],
    /// Cumulative share.
    cumulative: [f32; MOST],
    /// Per block: centre of a ball around its cones on the unit sphere, and squared radius.
    block: [[f32; BLOCKS]; 4],
    /// First of the flat ones, a multiple of [`LANES`], and how many round ones are before it.
    flat: usize,
    round: usize,
    /// One past the last.
    count: usize,
    /// How many shapes of equal share would be as uneven.
    effective: f32,
    /// How many times as many rays as usual they take.
    need: f32,
}

static NO_CONES: Cones = Cones::none();

thread_local! {
    /// Room for cones, used again: they are large, and gathers many.
    static SPARE: RefCell<Vec<Box<Cones>>> = const { RefCell::new(Vec::new()) };
}

/// The cones of one gather in room that is used again.
#[derive(Debug)]
pub struct Lent(Option<Box<Cones>>);

impl Lent {
    /// No cone at all.
    pub fn none() -> Lent {
        Lent(None)
    }

    /// The cones at `x` on a surface that faces unit `n`.
    pub fn new(records: &Records, x: Vec3, n: Vec3) -> Lent {
        let mut room = SPARE.with_borrow_mut(Vec::pop).unwrap_or_default();
        room.fill(records, x, n);
        Lent(Some(room))
    }
}

impl std::ops::Deref for Lent {
    type Target = Cones;

    #[inline]
    fn deref(&self) -> &Cones {
        self.0.as_deref().unwrap_or(&NO_CONES)
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        if let Some(room) = self.0.take() {
            SPARE.with_borrow_mut(|spare| spare.push(room));
        }
    }
}

impl Default for Cones {
    fn default() -> Self {
        Cones::none()
    }
}

impl Cones {
    /// No cone at all.
    pub const fn none() -> Cones {
        Cones {
            axis: [[0.0; MOST]; 3],
            height: [-1.0; MOST],
            density: [0.0; MOST],
            flats: [Flats::NONE; BLOCKS],
            cumulative: [0.0; MOST],
            block: [[0.0; BLOCKS]; 4],
            flat: 0,
            round: 0,
            count: 0,
            effective: 0.0,
            need: 1.0,
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
        (self.count, self.flat, self.round) = (0, 0, 0);
        self.effective = 0.0;
        with_expected(records, x, n, |expected| self.aim(expected, &records.linears, x));
    }

    /// Point what is expected around here at `x`.
    fn aim(&mut self, expected: &Expected, linears: &[Linear], x: Vec3) {
        let count = expected.share.len();
        (self.count, self.flat, self.round) = (count, expected.flat, expected.round);
        self.effective = expected.effective;
        self.need = expected.need;
        self.cumulative[..count].copy_from_slice(&expected.cumulative);
        let Expected { centre: [cx, cy, cz], radius2, share, .. } = expected;
        let [ax, ay, az] = &mut self.axis;
        let (ax, ay, az) = (&mut ax[..count], &mut ay[..count], &mut az[..count]);
        let (height, density) = (&mut self.height[..count], &mut self.density[..count]);
        let (cx, cy, cz) = (&cx[..count], &cy[..count], &cz[..count]);
        let (radius2, share) = (&radius2[..count], &share[..count]);
        for k in 0..count {
            let (dx, dy, dz) = (cx[k] - x.x, cy[k] - x.y, cz[k] - x.z);
            let scale = (dx * dx + dy * dy + dz * dz).max(f32::MIN_POSITIVE).sqrt().recip();
            (ax[k], ay[k], az[k]) = (dx * scale, dy * scale, dz * scale);
            let sin2 = radius2[k] * scale * scale;
            if k < expected.flat {
                height[k] = height_of(sin2);
                density[k] = share[k] / height[k];
            } else {
                // All round from within.
                height[k] = if sin2 < 0.5 { sin2 } else { 2.0 };
            }
        }
        for &(k, linear) in &expected.linears {
            let (k, linear) = (k as usize, &linears[linear as usize]);
            let axis = linear.dir(x);
            (ax[k], ay[k], az[k]) = (axis.x, axis.y, axis.z);
            height[k] = height_of(linear.sin2);
            density[k] = share[k] / height[k];
        }
        for (pieces, flats) in expected.pieces.iter().zip(&mut self.flats) {
            pieces.aimed(x, flats);
        }
        // Pieces that follow a regression are put where that says, a block at a time.
        for of_block in expected.long.chunk_by(|a, b| a.0 as usize / LANES == b.0 as usize / LANES) {
            let block = (of_block[0].0 as usize - expected.flat) / LANES;
            let mut pieces = expected.pieces[block];
            for &(k, linear) in of_block {
                let (k, linear) = (k as usize, &linears[linear as usize]);
                let Some(outline) = linear.rectangle(x) else { continue };
                pieces.put(k % LANES, &outline, share[k] * 2.0 * std::f32::consts::PI);
                let axis = linear.dir(x);
                (ax[k], ay[k], az[k]) = (axis.x, axis.y, axis.z);
                let [a, b] = outline.sides;
                height[k] = 0.25 * (a.length_squared() + b.length_squared());
            }
            pieces.aimed(x, &mut self.flats[block]);
        }
        self.bound_blocks();
    }

    /// Fill up the last block of each kind, and bound each block.
    fn bound_blocks(&mut self) {
        let blocks = self.count.div_ceil(LANES);
        for k in (self.round..self.flat).chain(self.count..blocks * LANES) {
            (self.height[k], self.density[k]) = (-1.0, 0.0);
        }
        for b in 0..blocks {
            let end = if b * LANES < self.flat { self.round } else { self.count };
            let members = b * LANES..((b + 1) * LANES).min(end);
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

    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.round + self.count - self.flat
    }

    /// Each shape, by the cone around it: unit axis, 1 − cos of the half-angle, share of the samples.
    pub fn iter(&self) -> impl Iterator<Item = (Vec3, f32, f32)> + '_ {
        (0..self.round).chain(self.flat..self.count).map(|k| {
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

    /// How many times as many rays as usual it takes to meet the luminaires among them: 1 to 4.
    pub fn need(&self) -> f32 {
        self.need
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
                let block = at + met.trailing_zeros() as usize;
                sum += match block * LANES < self.flat {
                    true => self.round_density(block, w),
                    false => self.flats[block - self.flat / LANES].density(w),
                };
                met &= met - 1;
            }
            at += LANES;
        }
        sum
    }

    #[inline]
    fn round_density(&self, block: usize, w: Vec3) -> f32 {
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

    /// A direction of the mixture: the shape by `pick`, where in it by `u`, all in [0, 1). With it the density per steradian
    /// there, where [`Cones::density`] would miss the shape at its edge by rounding. `None` where the shape is seen edge on.
    pub fn sample(&self, pick: f32, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let k = self.cumulative[..self.count].partition_point(|&c| c <= pick).min(self.count - 1);
        if k < self.flat {
            let axis = Vec3::new(self.axis[0][k], self.axis[1][k], self.axis[2][k]);
            let w = direction_in_cone(axis, self.height[k], u);
            let inside = 0.5 * (w - axis).length_squared() <= self.height[k];
            return Some((w, if inside { 0.0 } else { self.density[k] }));
        }
        let at = k - self.flat;
        self.flats[at / LANES].sample(at % LANES, u)
    }
}

/// A direction even over the cone around unit `axis`, `height` = 1 − cos of its half-angle, by `u` in [0, 1)².
pub(crate) fn direction_in_cone(axis: Vec3, height: f32, u: [f32; 2]) -> Vec3 {
    let x = u[0] * height;
    let sin = (x * (2.0 - x)).max(0.0).sqrt();
    let (s, c) = (2.0 * std::f32::consts::PI * u[1]).sin_cos();
    Frame::from_normal(axis).to_world(Vec3::new(sin * c, sin * s, 1.0 - x)).normalize()
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
            aside: None,
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
        let records = Records::new(all, &std::collections::HashMap::new());
        let cones = Cones::new(&records, Vec3::ZERO, Vec3::Z);
        assert_eq!(cones.len(), 3);
        // E[1 / density] over samples is the solid angle of the union.
        let n = 20_000;
        let mean: f64 = (0..n)
            .map(|i| {
                let (a, b) = (sobol(i, Key::new(1)), sobol(i, Key::new(2)));
                let (w, missed) = cones.sample(a.u, [b.u, b.v]).unwrap();
                let d = cones.density(w) + missed;
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
