//! Records of specular chains, and where they say virtual luminaires are: the predictor of the gather.
//!
//! A light particle that reaches a surface straight from a luminaire through mirrors and glass leaves a [`Record`]:
//! where, from which direction, how far the chain's patches and the luminaire are along it, and the chain's *signature*
//! (luminaire, smooth patches met, reflected or refracted). All records of a signature together tell where its image and
//! the patches it is seen through lie; those near a point tell which signatures matter there, and how their direction
//! changes with position where no fixed place explains them ([`model`]). A gather turns them into [`Cones`]. H. W. Jensen
//! 1995 (importance from photons); P. Shirley and K. Chiu 1994, section 6 ("a good predictor").
//!
//! Records only steer: gathers weigh their samples by density, so a bad cone costs noise and never bias.

mod cones;
mod model;

pub use cones::{Cones, MOST};

use super::kd::{Cuts, Group, Kd, Placed, morton};
use super::file::ZoneFileError;
use super::wire::{Wire, wire};
use hemilux_scene::geom::Vec3;
use hemiquad::map::{Dir, Map, Sphere, Uv};
use model::{Linear, Signature};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// One arrival through a specular chain.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// Where (m).
    pub p: Vec3,
    /// Normal on the side of arrival, unit.
    pub n: Vec3,
    /// Unit direction back along the last segment.
    pub dir: Vec3,
    /// Distance along the chain to the patch met last and to the one before it (or the luminaire), m.
    pub reach: [f32; 2],
    /// Length of the chain (m).
    pub length: f32,
    /// Luminaire and smooth patches of the chain, hashed.
    pub signature: u32,
    /// Luminaire and shapes of the chain, hashed: signatures of one class have patches of like size.
    pub class: u32,
    /// Radius of the luminaire (m).
    pub radius: f32,
    /// Luminance of the flux.
    pub flux: f32,
    /// Radiance of the luminaire times what the chain leaves of it (luminance, W·sr⁻¹·m⁻²).
    pub strength: f32,
    /// Whether it comes from a bright zone, not from a luminaire.
    pub of_zone: bool,
}

/// A signature that matters in a neighbourhood.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Index into the signatures.
    signature: u32,
    /// Index of a regression where that is tightest, or [`NONE`].
    linear: u32,
    /// Which place is tightest around the leaf.
    best: u8,
    /// Which other places tell whether the image is seen: bit k for place k.
    gates: u8,
    /// Share of the neighbourhood's flux.
    share: f32,
}

const NONE: u32 = u32::MAX;

/// All candidates, found by place and facing.
pub struct Records {
    kd: Kd,
    /// First candidate of each leaf, and one past the last.
    first: Vec<u32>,
    candidates: Vec<Candidate>,
    /// How far apart points of each leaf may lie to expect the same (m).
    grains: Vec<f32>,
    signatures: Vec<Signature>,
    linears: Vec<Linear>,
    records: u64,
    /// No two live ones are alike.
    identity: Identity,
}

impl std::fmt::Debug for Records {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Records({} of {} signatures, {} candidates)",
            self.records,
            self.signatures.len(),
            self.candidates.len()
        )
    }
}

/// Records in a leaf at most.
const LEAF: usize = 128;
/// Larger leaves, up to this, stay whole where they hold fewer than so many records of each signature: where many images
/// are seen at once, a small leaf would know only some of them.
const LARGEST: usize = 4096;
const PER_SIGNATURE: usize = 4;
/// A leaf learns from a box this much of its size larger on every side.
const DILATE: f32 = 0.5;
/// Halvings of a signature's records in search of several images.
const IMAGES: u32 = 2;
/// A record outside the leaf's own box counts this much.
const OUTSIDE: f32 = 0.3;
/// Luminaires that look wider than this along the chain (half-angle, radians) are left to the broad strata.
pub const LARGE: f32 = 0.15;
/// Leaves with fewer candidates than this are filled up with signatures that must be visible from them.
const ROOM: usize = MOST;
/// Lists are cut shorter, and filled up, while all of them together hold about this many candidates (16 bytes each).
const CANDIDATES: usize = 1 << 22;
/// A list this short is not worth cutting.
const FEW: usize = 32;
/// A leaf is cut if the lists of its cells, on the mean, become shorter than this part of its own.
const WORTH_A_CUT: f32 = 0.8;
/// Signatures that are expected to be seen from a leaf without a record of it there count as if they had this share of the
/// mean signature's flux.
const UNRECORDED: f32 = 0.25;

wire!(Candidate { signature, linear, best, gates, share });
wire!(Records { kd, first, candidates, grains, signatures, linears, records, identity });

impl Default for Records {
    fn default() -> Self {
        Records {
            kd: Kd::default(),
            first: vec![0],
            candidates: Vec::new(),
            grains: Vec::new(),
            signatures: Vec::new(),
            linears: Vec::new(),
            records: 0,
            identity: Identity::default(),
        }
    }
}

/// Number of signatures among records.
fn distinct(records: &[Record]) -> usize {
    let mut names: Vec<u32> = records.iter().map(|r| r.signature).collect();
    names.sort_unstable();
    names.dedup();
    names.len()
}

/// What was found in a leaf: candidates, and their regressions.
type Found = Vec<(Candidate, Option<Linear>)>;

/// A list of candidates, and how far apart points may lie to expect the same of them (m).
struct Cell {
    list: Vec<Candidate>,
    grain: f32,
}

/// A number that no other solution of this process has. It is not stored, and nothing but sameness depends on it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Identity(u64);

impl Default for Identity {
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Identity(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

impl Wire for Identity {
    fn put(&self, _: &mut Vec<u8>) {}

    fn take(_: &mut &[u8]) -> Result<Self, ZoneFileError> {
        Ok(Identity::default())
    }
}

/// A finished leaf, cut into cells: the candidates of each, which name regressions by their place in `linears`.
struct Leaf {
    cuts: Cuts,
    cells: Vec<Cell>,
    linears: Vec<Linear>,
}

impl Records {
    /// Group the records. The result depends on `records` and their order alone.
    pub fn new(mut records: Vec<Record>) -> Records {
        let mut all = Records { records: records.len() as u64, ..Records::default() };
        all.name_signatures(&mut records);
        let small = |here: &[Record]| {
            here.len() <= LEAF || here.len() <= LARGEST && here.len() < PER_SIGNATURE * distinct(here)
        };
        let (kd, groups) = Kd::new(&mut records, small);
        all.kd = kd;
        let this = &all;
        let leaves: Vec<Leaf> = (0..groups.len())
            .into_par_iter()
            .map_init(Vec::new, |near, i| this.cells(&groups, i, near))
            .collect();
        let mut cuts = Vec::with_capacity(leaves.len());
        for mut leaf in leaves {
            let before = all.linears.len() as u32;
            for cell in &mut leaf.cells {
                cell.list.iter_mut().filter(|c| c.linear != NONE).for_each(|c| c.linear += before);
                all.candidates.append(&mut cell.list);
                all.grains.push(cell.grain);
                all.first.push(all.candidates.len() as u32);
            }
            all.linears.append(&mut leaf.linears);
            cuts.push(leaf.cuts);
        }
        all.kd = all.kd.refined(&cuts);
        all
    }

    /// Leaf `i`, cut into cells as long as their lists grow shorter by it.
    fn cells(&self, groups: &[Group<Record>], i: usize, near: &mut Vec<(u32, u32, u32)>) -> Leaf {
        let room = CANDIDATES / groups.len();
        let mut leaf = Leaf { cuts: Cuts::Whole, cells: Vec::new(), linears: Vec::new() };
        let found = self.leaf(groups, i, room.clamp(FEW, ROOM), near);
        let mut list = Vec::with_capacity(found.len());
        for (mut candidate, linear) in found {
            if let Some(linear) = linear {
                candidate.linear = leaf.linears.len() as u32;
                leaf.linears.push(linear);
            }
            list.push(candidate);
        }
        let Group { low, high, .. } = groups[i];
        leaf.cuts = self.cut(list, (low, high), room, &mut leaf.cells);
        leaf
    }

    /// Cut the box of a list in half, again and again, and leave out of each half what is known not to be seen from it: while
    /// that brings something, and while the lists stay within `room` in all.
    fn cut(
        &self,
        list: Vec<Candidate>,
        (low, high): (Vec3, Vec3),
        room: usize,
        cells: &mut Vec<Cell>,
    ) -> Cuts {
        let before = cells.len();
        let size = high - low;
        let axis = size.max_position();
        if list.len() > FEW && list.len() < room && size[axis] > 0.0 {
            let at = low[axis] + 0.5 * size[axis];
            let (mut below, mut above) = (high, low);
            (below[axis], above[axis]) = (at, at);
            let halves = [(low, below), (above, high)].map(|(low, high)| {
                let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
                let part = list.iter().filter(|c| !self.is_missed(c, centre, radius)).copied().collect();
                self.cut(part, (low, high), room / 2, cells)
            });
            let total: usize = cells[before..].iter().map(|c| c.list.len()).sum();
            if (total as f32) < WORTH_A_CUT * (list.len() * (cells.len() - before)) as f32 {
                return Cuts::Across { axis: axis as u8, at, halves: Box::new(halves) };
            }
            cells.truncate(before);
        }
        let list = keep_most(list);
        let grain = self.grain(&list, low, high);
        cells.push(Cell { list, grain });
        Cuts::Whole
    }

    /// How far apart points in a box may lie to expect the same of all but a quarter of `list`.
    fn grain(&self, list: &[Candidate], low: Vec3, high: Vec3) -> f32 {
        let whole = 0.5 * (high - low).length();
        let x = 0.5 * (low + high);
        let mut grains: Vec<f32> = list
            .iter()
            .filter(|c| c.linear == NONE)
            .map(|c| self.signatures[c.signature as usize].grain(x))
            .filter(|g| g.is_finite())
            .collect();
        let quarter = grains.len() / 4;
        let grain = match grains.is_empty() {
            true => whole,
            false => *grains.select_nth_unstable_by(quarter, f32::total_cmp).1,
        };
        // Coordinates over the grain must stay within what an i32 tells apart.
        grain.min(whole).max(1e-6 * low.abs().max(high.abs()).max_element()).max(f32::MIN_POSITIVE)
    }

    /// Whether a candidate is known not to be seen from anywhere within `radius` of `x`.
    fn is_missed(&self, c: &Candidate, x: Vec3, radius: f32) -> bool {
        c.linear == NONE && self.signatures[c.signature as usize].is_missed_from(x, radius)
    }

    /// Replace each record's signature by its index, and fit what each signature's records have in common.
    fn name_signatures(&mut self, records: &mut [Record]) {
        records.par_sort_by_key(|r| r.signature);
        let groups: Vec<&mut [Record]> = records.chunk_by_mut(|a, b| a.signature == b.signature).collect();
        self.signatures = groups.par_iter().map(|g| Signature::fit(g)).collect();
        model::fit_classes(&mut self.signatures, &groups);
        groups
            .into_par_iter()
            .enumerate()
            .for_each(|(i, g)| g.iter_mut().for_each(|r| r.signature = i as u32));
    }

    /// What matters in leaf `i`: every signature recorded in it or around it, and those that must be visible from it.
    /// `near` is scratch space.
    fn leaf(
        &self,
        groups: &[Group<Record>],
        i: usize,
        room: usize,
        near: &mut Vec<(u32, u32, u32)>,
    ) -> Found {
        let Group { members, low, high } = groups[i];
        let (wide_low, wide_high) = groups[i].dilated(DILATE);
        let within = |p: Vec3, low: Vec3, high: Vec3| p.cmpge(low).all() && p.cmple(high).all();
        near.clear();
        self.kd.visit(members[0].n, wide_low, wide_high, &mut |leaf| {
            for (k, r) in groups[leaf as usize].members.iter().enumerate() {
                if within(r.p, wide_low, wide_high) {
                    near.push((r.signature, leaf, k as u32));
                }
            }
        });
        near.sort_unstable();
        let record = |at: &(u32, u32, u32)| &groups[at.1 as usize].members[at.2 as usize];
        let centre = (low + high) * 0.5;
        let mut found: Found = Vec::new();
        let mut group: Vec<Record> = Vec::new();
        for names in near.chunk_by(|a, b| a.0 == b.0) {
            let weight = |r: &Record| r.flux * if within(r.p, low, high) { 1.0 } else { OUTSIDE };
            let share: f32 = names.iter().map(|at| weight(record(at))).sum();
            let mut candidate = self.candidate(names[0].0, share, centre);
            let place = self.signatures[names[0].0 as usize].places[candidate.best as usize].sin2(centre);
            let first = record(&names[0]);
            let seen = first.radius / first.length;
            // No regression where a fixed place says as much.
            if place <= 2.5 * seen * seen {
                found.push((candidate, None));
                continue;
            }
            group.clear();
            group.extend(names.iter().map(record));
            let mut rest = group.len();
            let images = Linear::fit_images(&mut group, IMAGES);
            for (linear, count) in images {
                let part = count as f32 / group.len() as f32;
                let linear = linear.filter(|l| l.sin2 < 0.7 * place);
                // What no regression explains is left to the places, once.
                if linear.is_some() || rest == group.len() {
                    candidate.gates = if linear.is_some() { 0 } else { candidate.gates };
                    found.push((Candidate { share: share * part, ..candidate }, linear));
                }
                rest -= count;
            }
        }
        let radius = 0.5 * (high - low).length();
        // What was recorded nearby may still be known not to be seen from here.
        found.retain(|f| f.1.is_some() || !self.is_missed(&f.0, centre, radius));
        self.unrecorded(&mut found, centre, radius, members[0].n, room);
        let key = |f: &(Candidate, Option<Linear>)| (f.0.share, f.0.signature);
        found.sort_by(|a, b| key(b).0.total_cmp(&key(a).0).then(key(a).1.cmp(&key(b).1)));
        found.truncate(2 * MOST);
        let total: f32 = found.iter().map(|f| f.0.share).sum();
        found.iter_mut().for_each(|f| f.0.share /= total.max(f32::MIN_POSITIVE));
        // Neighbours in direction are neighbours in the list: cones are tested by blocks and sampled systematically.
        found.sort_by_cached_key(|f| (self.direction_code(f, centre), f.0.signature));
        found
    }

    /// A signature as seen from a leaf around `centre`.
    fn candidate(&self, signature: u32, share: f32, centre: Vec3) -> Candidate {
        let places = &self.signatures[signature as usize].places;
        let sin2 = places.map(|p| p.sin2(centre));
        let best = (0..3).fold(0, |b, k| if sin2[k] < sin2[b] { k } else { b });
        // The ray must pass all that is known; from within a place or close by, it says nothing.
        let tells = |k: usize| (k != best && sin2[k] < 0.5) as u8;
        let gates = (0..3).fold(0, |g, k| g | tells(k) << k);
        Candidate { signature, linear: NONE, best: best as u8, gates, share }
    }

    /// Add the signatures that the places of their images and patches make visible from around `centre`, those that promise
    /// most first, as far as there is room.
    fn unrecorded(&self, found: &mut Found, centre: Vec3, radius: f32, n: Vec3, room: usize) {
        let room = room.saturating_sub(found.len());
        if room == 0 {
            return;
        }
        let share = UNRECORDED * found.iter().map(|f| f.0.share).sum::<f32>() / found.len().max(1) as f32;
        let promise = |c: &Candidate| {
            let signature = &self.signatures[c.signature as usize];
            signature.strength * signature.places[c.best as usize].sin2(centre)
        };
        let mut more: Vec<Candidate> = Vec::new();
        for (name, signature) in self.signatures.iter().enumerate() {
            let name = name as u32;
            if signature.is_visible_from(centre, radius, n)
                && !signature.is_missed_from(centre, radius)
                && found.binary_search_by_key(&name, |f| f.0.signature).is_err()
            {
                more.push(self.candidate(name, share, centre));
            }
        }
        more.sort_by(|a, b| promise(b).total_cmp(&promise(a)).then(a.signature.cmp(&b.signature)));
        found.extend(more.into_iter().take(room).map(|c| (c, None)));
    }

    /// Where along a Morton curve of directions (the sphere's square) a candidate is seen from `x`.
    fn direction_code(&self, f: &(Candidate, Option<Linear>), x: Vec3) -> u32 {
        let d = match &f.1 {
            Some(linear) => linear.dir(x),
            None => {
                let place = self.signatures[f.0.signature as usize].places[f.0.best as usize];
                (place.centre - x).normalize_or(Vec3::Z)
            }
        };
        let uv: Uv<f32> = Sphere.uv(Dir::from_unit(d.x, d.y, d.z)).unwrap_or_default();
        let q = |v: f32| (v * 65536.0).clamp(0.0, 65535.0) as u32;
        morton(q(uv.u), q(uv.v))
    }

    /// Whether every look-up ends and stays within its lists.
    pub(super) fn is_sound(&self) -> bool {
        let known = |c: &Candidate| {
            (c.signature as usize) < self.signatures.len()
                && (c.linear == NONE || (c.linear as usize) < self.linears.len())
                && c.best < 3
                && c.gates < 8
        };
        !self.first.is_empty()
            && self.kd.is_sound(self.first.len() - 1)
            && self.first.is_sorted()
            && self.grains.len() + 1 == self.first.len()
            && self.grains.iter().all(|g| *g > 0.0)
            && self.first.last().is_some_and(|l| *l as usize == self.candidates.len())
            && self.candidates.iter().all(known)
    }

    /// Number of records behind the candidates.
    pub fn len(&self) -> u64 {
        self.records
    }

    /// Whether there is nothing to find.
    pub fn is_empty(&self) -> bool {
        self.candidates.is_empty()
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        self.kd.memory_bytes()
            + self.candidates.len() * size_of::<Candidate>()
            + self.signatures.len() * size_of::<Signature>()
            + self.linears.len() * size_of::<Linear>()
    }

    /// The candidates of a leaf.
    fn in_cell(&self, leaf: usize) -> &[Candidate] {
        &self.candidates[self.first[leaf] as usize..self.first[leaf + 1] as usize]
    }
}

/// The [`MOST`] candidates with the largest shares, in the order given.
fn keep_most(mut list: Vec<Candidate>) -> Vec<Candidate> {
    if list.len() > MOST {
        let mut shares: Vec<f32> = list.iter().map(|c| c.share).collect();
        let (_, least, _) = shares.select_nth_unstable_by(MOST - 1, |a, b| b.total_cmp(a));
        let least = *least;
        list.retain(|c| c.share >= least);
        list.truncate(MOST);
    }
    list
}

impl Placed for Record {
    fn place(&self) -> Vec3 {
        self.p
    }

    fn normal(&self) -> Vec3 {
        self.n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::{Key, sobol};

    /// Records on the floor of a luminaire's image, as a flat mirror throws them.
    fn flat(image: Vec3, spread: f32, n: u32) -> Vec<Record> {
        (0..n)
            .map(|i| {
                let u = sobol(i, Key::new(4));
                let p = Vec3::new((u.u - 0.5) * spread, (u.v - 0.5) * spread, 0.0);
                let to = image - p;
                Record {
                    p,
                    n: Vec3::Z,
                    dir: to.normalize(),
                    reach: [0.5 * to.length(), to.length()],
                    length: to.length(),
                    signature: 7,
                    class: 7,
                    radius: 0.002,
                    flux: 1.0,
                    strength: 1.0,
                    of_zone: false,
                }
            })
            .collect()
    }

    #[test]
    fn the_image_of_a_flat_mirror_is_found_from_anywhere_near() {
        let image = Vec3::new(1.0, 0.4, 2.0);
        for n in [1, 3, 20, 200] {
            let records = Records::new(flat(image, 0.2, n));
            for x in [Vec3::ZERO, Vec3::new(0.08, -0.05, 0.0)] {
                let cones = Cones::new(&records, x, Vec3::Z);
                let to = (image - x).normalize();
                assert!(cones.len() == 1 && cones.density(to) > 0.0, "{n} records at {x}");
                let w = cones.sample(0.5, [0.3, 0.8]);
                assert!((w - to).length() < 2.0 * 0.002 / image.length(), "tight: {w} against {to}");
            }
        }
    }
}
