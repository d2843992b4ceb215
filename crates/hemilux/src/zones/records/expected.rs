//! What is expected around a point, worked out once for a small neighbourhood and remembered.
//!
//! The candidates of a leaf are narrowed down twice: to those that can be seen from a [`District`], and for a [`Spot`] in it to
//! shapes in space and their shares of the samples. A share is by the irradiance that is expected, with small parts by the
//! flux of nearby records and by nothing at all.
//!
//! Invariant: what is expected at a point depends on the point and the records alone, never on what a thread remembers.

use super::cones::{LANES, MOST};
use super::flat::Pieces;
use super::view::{Shape, View};
use super::{Identity, NONE, Records};
use crate::world::outline::Outline;
use hemilux_scene::geom::Vec3;
use std::cell::RefCell;

/// Share of the samples by flux of nearby records, and without regard to anything.
const BY_FLUX: f32 = 0.25;
const EVENLY: f32 = 0.1;

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

    /// The district that it is part of, as the spot at its place.
    fn district(&self) -> Spot {
        Spot { at: self.at.map(|v| v.div_euclid(SPOTS)), n: [0; 3], ..*self }
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

/// Spots and districts that a thread remembers.
const SLOTS: usize = 64;

thread_local! {
    static REMEMBERED: RefCell<(Vec<Expected>, Vec<District>)> = RefCell::new((
        (0..SLOTS).map(|_| Expected::default()).collect(),
        (0..SLOTS).map(|_| District::default()).collect(),
    ));
}

/// Call `f` with what is expected around `x` on a surface that faces unit `n`, if anything is known there.
pub(super) fn with_expected(records: &Records, x: Vec3, n: Vec3, f: impl FnOnce(&Expected)) {
    let Some(spot) = Spot::of(records, x, n) else { return };
    REMEMBERED.with_borrow_mut(|(spots, districts)| {
        let expected = &mut spots[spot.slot()];
        if expected.spot != Some(spot) {
            let around = spot.district();
            let district = &mut districts[around.slot()];
            if district.spot != Some(around) {
                district.fill(records, around);
            }
            expected.fill(records, spot, &district.promising);
        }
        f(expected);
    });
}

/// Spots along an edge of a district.
const SPOTS: i32 = 4;
/// Of a cube, over its edge.
const HALF_DIAGONAL: f32 = 0.87;
/// A district looks this much farther than to its corners.
const FARTHER: f32 = 1.25;

/// A cube of spots of any facing, and which candidates of its leaf can be seen from there: what lies between is asked once.
#[derive(Default)]
struct District {
    spot: Option<Spot>,
    promising: Vec<u32>,
}

impl District {
    fn fill(&mut self, records: &Records, spot: Spot) {
        self.spot = Some(spot);
        let size = records.grains[spot.cell as usize] * SPOTS as f32;
        let x = Vec3::from_array(spot.at.map(|v| (v as f32 + 0.5) * size));
        let listed = records.in_cell(spot.cell as usize).iter().enumerate();
        let radius = FARTHER * HALF_DIAGONAL * size;
        self.promising.clear();
        self.promising.extend(listed.filter(|(_, c)| records.sees(c, x, radius)).map(|(i, _)| i as u32));
    }
}

/// What is expected in a spot: shapes in space, and their shares of the samples. Round ones first, then, from a multiple of
/// [`LANES`] on, the flat ones.
#[derive(Default)]
pub(super) struct Expected {
    spot: Option<Spot>,
    /// Of a ball around each shape (m); where a regression leads, nothing.
    pub centre: [Vec<f32>; 3],
    /// m².
    pub radius2: Vec<f32>,
    /// Over 2π.
    pub share: Vec<f32>,
    pub cumulative: Vec<f32>,
    pub flat: usize,
    pub round: usize,
    /// The flat ones.
    pub pieces: Vec<Pieces>,
    /// Those that follow a regression, round and flat.
    pub linears: Vec<(u32, u32)>,
    pub long: Vec<(u32, u32)>,
    pub effective: f32,
    /// How many times as many rays as usual it takes to meet the luminaires among them.
    pub need: f32,
    /// Scratch.
    found: Vec<Found>,
}

/// One of them: its shape, what it is expected to bring, its kind of source, its share of the neighbourhood's flux, its
/// regression.
struct Found {
    shape: Shape,
    bring: f32,
    seen: f32,
    kind: u8,
    share: f32,
    linear: u32,
    /// Its rectangle here, if that follows a regression.
    long: Option<Outline>,
}

impl Expected {
    /// `promising`: the candidates that can be seen from there.
    fn fill(&mut self, records: &Records, spot: Spot, promising: &[u32]) {
        self.spot = Some(spot);
        self.centre
            .iter_mut()
            .chain([&mut self.radius2, &mut self.share, &mut self.cumulative])
            .for_each(Vec::clear);
        self.linears.clear();
        self.long.clear();
        self.pieces.clear();
        self.found.clear();
        let grain = records.grains[spot.cell as usize];
        let x = Vec3::from_array(spot.at.map(|v| (v as f32 + 0.5) * grain));
        let n = Vec3::from_array(spot.n.map(|v| v as f32)).normalize_or(Vec3::Z);
        let listed = records.in_cell(spot.cell as usize);
        for c in promising.iter().map(|i| &listed[*i as usize]) {
            let Some(View { shape, seen }) = records.view(c, x, HALF_DIAGONAL * grain) else { continue };
            let (centre, radius2) = shape.ball();
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
            let known = c.linear != NONE || signature.is_known() && !c.is_loose();
            let seen = seen * signature.fill;
            let bring = signature.strength * shape.extent(x) * seen * cos.max(0.5 * sin2.sqrt());
            let kind = signature.kind & 1;
            let bring = if known { bring } else { 0.0 };
            let linear = records.linears.get(c.linear as usize);
            let long = linear.and_then(|l| l.rectangle(x));
            // A rectangle has less room beside the image than the cone.
            let seen = match long {
                Some(outline) => {
                    (seen * shape.extent(x) / Shape::Flat(outline).extent(x).max(f32::MIN_POSITIVE)).min(1.0)
                }
                None => seen,
            };
            self.found.push(Found { shape, bring, seen, kind, share: c.share, linear: c.linear, long });
        }
        // One block may be left half empty.
        const ROOM: usize = MOST - LANES;
        if self.found.len() > ROOM {
            let mut brings: Vec<f32> = self.found.iter().map(|f| f.bring).collect();
            let least = *brings.select_nth_unstable_by(ROOM - 1, |a, b| b.total_cmp(a)).1;
            self.found.retain(|f| f.bring >= least);
            self.found.truncate(ROOM);
        }
        self.shares();
    }

    /// Shares from what is expected, by flux, and evenly; and everything in its order.
    fn shares(&mut self) {
        // Per kind of source, luminaires and zones: what is expected of them here, and their flux nearby. Expectations of
        // one kind can be compared, those of two less well: there the records know better.
        let (mut sum, mut flux) = ([0.0; 2], [0.0; 2]);
        for found in &self.found {
            sum[found.kind as usize] += found.bring;
            flux[found.kind as usize] += found.share;
        }
        let all_flux = (flux[0] + flux[1]).max(f32::MIN_POSITIVE);
        let promising = (0..2).map(|g| if sum[g] > 0.0 { flux[g] } else { 0.0 }).sum::<f32>();
        let by_flux = BY_FLUX / all_flux;
        // Sums so small that they can't be divided by promise nothing.
        let promising = if promising * sum[0].max(sum[1]) >= f32::MIN_POSITIVE { promising } else { 0.0 };
        let by_expectation = [0, 1].map(|g| match promising * sum[g] >= f32::MIN_POSITIVE {
            true => (1.0 - BY_FLUX - EVENLY) * flux[g] / (promising * sum[g]),
            false => 0.0,
        });
        let even = (if promising > 0.0 { EVENLY } else { 1.0 - BY_FLUX }) / self.found.len().max(1) as f32;
        let share = |f: &Found| by_expectation[f.kind as usize] * f.bring + by_flux * f.share + even;
        self.need = need(&self.found, share);
        let found = std::mem::take(&mut self.found);
        let (mut cumulative, mut squares) = (0.0, 0.0);
        let mut put = |this: &mut Expected, ball: (Vec3, f32), share: f32| {
            cumulative += share;
            squares += share * share;
            this.share.push(share);
            this.cumulative.push(cumulative);
            this.radius2.push(ball.1);
            for (all, v) in this.centre.iter_mut().zip(ball.0.to_array()) {
                all.push(v);
            }
        };
        let piece = |f: &Found| match (&f.shape, f.long) {
            (Shape::Flat(outline), _) => Some(*outline),
            (_, long) => long,
        };
        for f in found.iter().filter(|f| piece(f).is_none()) {
            if f.linear != NONE {
                self.linears.push((self.share.len() as u32, f.linear));
            }
            put(self, f.shape.ball(), share(f));
        }
        self.round = self.share.len();
        if found.iter().any(|f| piece(f).is_some()) {
            while !self.share.len().is_multiple_of(LANES) {
                put(self, (Vec3::ZERO, 0.0), 0.0);
            }
        }
        self.flat = self.share.len();
        for f in &found {
            if let Some(outline) = &piece(f) {
                if f.long.is_some() {
                    self.long.push((self.share.len() as u32, f.linear));
                }
                let lane = (self.share.len() - self.flat) % LANES;
                if lane == 0 {
                    self.pieces.push(Pieces::NONE);
                }
                put(self, f.shape.ball(), share(f));
                if let Some(last) = self.pieces.last_mut() {
                    last.put(lane, outline, share(f));
                }
            }
        }
        self.found = found;
        // Rounding must not leave the last one short, nor the densities too high.
        let cumulative = cumulative.max(f32::MIN_POSITIVE);
        self.cumulative.iter_mut().for_each(|c| *c /= cumulative);
        self.share.iter_mut().for_each(|s| *s /= 2.0 * std::f32::consts::PI * cumulative);
        self.pieces.iter_mut().for_each(|p| p.scale(1.0 / cumulative));
        self.effective = if squares > 0.0 { cumulative * cumulative / squares } else { 0.0 };
    }
}

/// Where this much of a shape shows its luminaire, rays are as many as usual, ...
const OFTEN: f32 = 0.5;
/// ... and never more than so many times as many.
const MOST_NEED: f32 = 4.0;

/// How many times as many rays as usual it takes, by shares: more where shapes hardly show their luminaire.
fn need(found: &[Found], share: impl Fn(&Found) -> f32) -> f32 {
    let of = |f: &Found| if f.kind == 0 { (OFTEN / f.seen.max(1e-3)).clamp(1.0, MOST_NEED) } else { 1.0 };
    let (need, all) = found.iter().fold((0.0, 0.0), |s, f| (s.0 + share(f) * of(f), s.1 + share(f)));
    if all > 0.0 { need / all } else { 1.0 }
}
