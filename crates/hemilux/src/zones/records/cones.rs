//! The cones of the virtual luminaires expected at one point: a mixture of directions.
//!
//! Each candidate gives one cone: around the image, or the part of it that a patch of its chain lets through, or by
//! regression, whichever is tightest. Its share of the samples is the irradiance it is expected to bring; an image whose
//! ray passes beside a patch is left out. Small parts of the shares follow the flux of nearby records and nothing at all,
//! since expectations err. What is expected is worked out once per [`Spot`], as balls in space, and only pointed at a gather.
//!
//! Invariants: [`Cones::sample`] has exactly [`Cones::density`]; both depend on the point and the records alone, never on what
//! a thread remembers.

use super::model::{Linear, Signature};
use super::{Candidate, Identity, NONE, Records};
use hemilux_scene::geom::{Frame, Vec3};
use std::cell::RefCell;

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
/// An image that is seen from elsewhere in the spot only counts this much.
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
        let Some(spot) = Spot::of(records, x, n) else { return };
        REMEMBERED.with_borrow_mut(|all| {
            let expected = &mut all[spot.slot()];
            if expected.spot != Some(spot) {
                expected.fill(records, spot);
            }
            self.aim(expected, &records.linears, x);
        });
    }

    /// Point what is expected around here at `x`.
    fn aim(&mut self, expected: &Expected, linears: &[Linear], x: Vec3) {
        let count = expected.share.len();
        self.count = count;
        self.effective = expected.effective;
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
            height[k] = height_of(radius2[k] * scale * scale);
            density[k] = share[k] / height[k];
        }
        for &(k, linear) in &expected.linears {
            let (k, linear) = (k as usize, &linears[linear as usize]);
            let axis = linear.dir(x);
            (ax[k], ay[k], az[k]) = (axis.x, axis.y, axis.z);
            height[k] = height_of(linear.sin2);
            density[k] = share[k] / height[k];
        }
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
        direction_in_cone(axis, self.height[k], u)
    }
}

/// A direction even over the cone around unit `axis`, `height` = 1 − cos of its half-angle, by `u` in [0, 1)².
pub(crate) fn direction_in_cone(axis: Vec3, height: f32, u: [f32; 2]) -> Vec3 {
    let x = u[0] * height;
    let sin = (x * (2.0 - x)).max(0.0).sqrt();
    let (s, c) = (2.0 * std::f32::consts::PI * u[1]).sin_cos();
    Frame::from_normal(axis).to_world(Vec3::new(sin * c, sin * s, 1.0 - x)).normalize()
}

/// 1 − cos of a half-angle from its squared sine.
#[inline]
pub(super) fn height_of(sin2: f32) -> f32 {
    let sin2 = sin2.min(1.0);
    (0.5 * sin2 * (1.0 + 0.25 * sin2)).clamp(1e-12, WIDEST)
}

/// A small neighbourhood in which the same is expected: what it is named by. Its expectations are those at its middle, so
/// they depend on nothing but it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    records: Identity,
    cell: u32,
    /// Which cube of the cell's grain.
    at: [i32; 3],
    /// Normal in sixteenths.
    n: [i8; 3],
}

impl Spot {
    fn of(records: &Records, x: Vec3, n: Vec3) -> Option<Spot> {
        let cell = records.kd.leaf(x, n)?;
        let grain = records.grains[cell];
        let at = (x / grain).floor().to_array().map(|v| v as i32);
        let n = n.to_array().map(|v| (v * 16.0).round() as i8);
        Some(Spot { records: records.identity, cell: cell as u32, at, n })
    }

    /// Where it is remembered.
    fn slot(&self) -> usize {
        let [x, y, z] = self.at.map(|v| v as u32);
        let hash = x.wrapping_mul(0x9e37_79b1)
            ^ y.wrapping_mul(0x85eb_ca77)
            ^ z.wrapping_mul(0xc2b2_ae3d)
            ^ self.cell;
        (hash.wrapping_mul(0x9e37_79b1) >> (32 - SLOTS.trailing_zeros())) as usize
    }
}

/// Spots that a thread remembers.
const SLOTS: usize = 64;

thread_local! {
    static REMEMBERED: RefCell<Vec<Expected>> =
        RefCell::new((0..SLOTS).map(|_| Expected::default()).collect());
}

/// What is expected in a spot: balls in space, and their shares of the samples.
#[derive(Default)]
struct Expected {
    spot: Option<Spot>,
    /// m; where a regression leads, nothing.
    centre: [Vec<f32>; 3],
    /// m².
    radius2: Vec<f32>,
    /// Over 2π.
    share: Vec<f32>,
    cumulative: Vec<f32>,
    /// Those that follow a regression.
    linears: Vec<(u32, u32)>,
    effective: f32,
    /// Scratch.
    found: Vec<Ball>,
}

/// One of them: a ball, what it is expected to bring, its kind of source, its share of the neighbourhood's flux, its regression.
struct Ball {
    centre: Vec3,
    radius2: f32,
    bring: f32,
    kind: u8,
    share: f32,
    linear: u32,
}

impl Expected {
    fn fill(&mut self, records: &Records, spot: Spot) {
        self.spot = Some(spot);
        self.centre
            .iter_mut()
            .chain([&mut self.radius2, &mut self.share, &mut self.cumulative])
            .for_each(Vec::clear);
        self.linears.clear();
        self.found.clear();
        let grain = records.grains[spot.cell as usize];
        let x = Vec3::from_array(spot.at.map(|v| (v as f32 + 0.5) * grain));
        let n = Vec3::from_array(spot.n.map(|v| v as f32)).normalize_or(Vec3::Z);
        // Per kind of source, luminaires and zones: what is expected of them here, and their flux nearby. Expectations of
        // one kind can be compared, those of two less well: there the records know better.
        let (mut sum, mut flux) = ([0.0; 2], [0.0; 2]);
        for c in records.in_cell(spot.cell as usize) {
            let Some(View { centre, radius2, seen }) = records.view(c, x, 0.87 * grain) else { continue };
            let to = centre - x;
            let distance2 = to.length_squared().max(f32::MIN_POSITIVE);
            let (cos, sin2) = (to.dot(n) / distance2.sqrt(), (radius2 / distance2).min(1.0));
            // All of it behind the surface, wherever in the spot.
            let sin = sin2.sqrt() + 2.0 * grain / distance2.sqrt() + 0.1;
            if cos <= -sin {
                continue;
            }
            let signature = &records.signatures[c.signature as usize];
            // Where nobody knows what limits the image, its size says nothing.
            let known = c.linear != NONE || signature.is_known();
            let bring = signature.strength * height_of(sin2) * seen * cos.max(0.5 * sin2.sqrt());
            let kind = signature.kind & 1;
            let bring = if known { bring } else { 0.0 };
            self.found.push(Ball { centre, radius2, bring, kind, share: c.share, linear: c.linear });
        }
        if self.found.len() > MOST {
            let mut brings: Vec<f32> = self.found.iter().map(|f| f.bring).collect();
            let least = *brings.select_nth_unstable_by(MOST - 1, |a, b| b.total_cmp(a)).1;
            self.found.retain(|f| f.bring >= least);
            self.found.truncate(MOST);
        }
        for (k, found) in self.found.iter().enumerate() {
            sum[found.kind as usize] += found.bring;
            flux[found.kind as usize] += found.share;
            if found.linear != NONE {
                self.linears.push((k as u32, found.linear));
            }
            for (all, v) in self.centre.iter_mut().zip(found.centre.to_array()) {
                all.push(v);
            }
            self.radius2.push(found.radius2);
        }
        self.shares(sum, flux);
    }

    /// Shares from what is expected, by flux, and evenly.
    fn shares(&mut self, sum: [f32; 2], flux: [f32; 2]) {
        let all_flux = (flux[0] + flux[1]).max(f32::MIN_POSITIVE);
        let promising = (0..2).map(|g| if sum[g] > 0.0 { flux[g] } else { 0.0 }).sum::<f32>();
        let by_flux = BY_FLUX / all_flux;
        let by_expectation = [0, 1].map(|g| match promising > 0.0 && sum[g] > 0.0 {
            true => (1.0 - BY_FLUX - EVENLY) * flux[g] / (promising * sum[g]),
            false => 0.0,
        });
        let even = (if promising > 0.0 { EVENLY } else { 1.0 - BY_FLUX }) / self.found.len().max(1) as f32;
        let (mut cumulative, mut squares) = (0.0, 0.0);
        for found in &self.found {
            let share = by_expectation[found.kind as usize] * found.bring + by_flux * found.share + even;
            cumulative += share;
            squares += share * share;
            self.share.push(share);
            self.cumulative.push(cumulative);
        }
        // Rounding must not leave the last cone short, nor the densities too high.
        self.cumulative.iter_mut().for_each(|c| *c /= cumulative);
        self.share.iter_mut().for_each(|s| *s /= 2.0 * std::f32::consts::PI * cumulative);
        self.effective = if squares > 0.0 { cumulative * cumulative / squares } else { 0.0 };
    }
}

/// How a candidate is seen: through which ball, and how much of that is expected to show the image, 0 to 1.
pub(super) struct View {
    pub centre: Vec3,
    pub radius2: f32,
    pub seen: f32,
}

impl Records {
    /// The view of a candidate from within `radius` of `x`; none if a patch is known to be beside every ray to its image.
    pub(super) fn view(&self, c: &Candidate, x: Vec3, radius: f32) -> Option<View> {
        if c.linear != NONE {
            let linear = &self.linears[c.linear as usize];
            return Some(View { centre: x + linear.dir(x), radius2: linear.sin2, seen: 1.0 });
        }
        let Signature { places, windows, .. } = &self.signatures[c.signature as usize];
        let ball = |k: usize| (places[k].centre, places[k].radius * places[k].radius);
        let sin2 = |centre: Vec3, radius2: f32| {
            (radius2 / (centre - x).length_squared().max(f32::MIN_POSITIVE)).min(1.0)
        };
        let (centre, radius2) = ball(c.best as usize);
        if c.gates == 0 {
            return Some(View { centre, radius2, seen: 1.0 });
        }
        let (image, image_radius2) = ball(0);
        let distance = (image - x).length();
        let axis = (image - x) / distance;
        let angle = sin2(image, image_radius2).sqrt();
        let mut tightest = View { centre, radius2, seen: 1.0 };
        for k in 1..3 {
            if (c.gates | 1 << c.best) >> k & 1 == 0 {
                continue;
            }
            let to = places[k].centre - x;
            let along = to.dot(axis);
            // How far the ray to the image moves at the patch as `x` does.
            let slack = radius * (1.0 - along / distance).abs();
            match windows[k - 1] {
                Some(window) => {
                    let (part, wide) = (window.part(x, axis, angle, 0.0), window.part(x, axis, angle, slack));
                    let wide = wide?;
                    // The image is round, not square.
                    let area = std::f32::consts::FRAC_PI_4 * part.map_or(BESIDE * wide.area, |p| p.area)
                        / (wide.distance * wide.distance);
                    let (centre, radius2) =
                        if wide.clipped { wide.ball(axis) } else { (image, image_radius2) };
                    let sin2 = sin2(centre, radius2);
                    if sin2 <= sin2_of(&tightest, x) {
                        tightest =
                            View { centre, radius2, seen: (area / (std::f32::consts::PI * sin2)).min(1.0) };
                    }
                }
                // Both balls must lie on one ray.
                None => {
                    let offset = axis * along - to;
                    if offset.length() > places[k].radius + angle * along.abs() + slack {
                        return None;
                    }
                }
            }
        }
        Some(tightest)
    }
}

fn sin2_of(view: &View, x: Vec3) -> f32 {
    (view.radius2 / (view.centre - x).length_squared().max(f32::MIN_POSITIVE)).min(1.0)
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
