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
mod exact;
mod expected;
mod flat;
mod model;
mod outlook;
mod pick;
mod view;

pub(crate) use cones::direction_in_cone;
pub use cones::{Cones, Lent, MOST};
pub use exact::{Exact, Turns};
pub(crate) use pick::{Around, Picked};

use super::file::ZoneFileError;
use super::kd::{Group, Kd, Placed, morton};
use super::wire::{Wire, wire};
use hemilux_scene::geom::Vec3;
use hemiquad::map::{Dir, Map, Sphere, Uv};
use model::{Linear, Signature};
use outlook::Outlook;
use pick::Picks;
use rayon::prelude::*;
use std::collections::HashMap;
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
    /// How far away along the last segment what it comes from seems (m): length of the chain, refracted where that is known.
    pub length: f32,
    /// From there to the middle of the image (m), where all surfaces of the chain are flat.
    pub aside: Option<Vec3>,
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

impl Record {
    /// Where what it comes from seems to be: the middle of the image if that is known, a point of it if not (m).
    pub(super) fn image(&self) -> Vec3 {
        self.p + self.dir * self.length + self.aside.unwrap_or(Vec3::ZERO)
    }
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

impl Candidate {
    /// Whether its image is somewhere within its place, and smaller.
    fn is_loose(&self) -> bool {
        self.gates & LOOSE != 0
    }
}

const NONE: u32 = u32::MAX;
/// Among the gates of a candidate: [`Candidate::is_loose`].
const LOOSE: u8 = 8;

/// All candidates, found by place and facing.
pub struct Records {
    kd: Kd,
    /// First candidate of each leaf, and one past the last.
    first: Vec<u32>,
    candidates: Vec<Candidate>,
    /// How far apart points of each leaf may lie to expect the same (m).
    grains: Vec<f32>,
    signatures: Vec<Signature>,
    /// The hash that each signature is known by, in ascending order.
    names: Vec<u32>,
    linears: Vec<Linear>,
    records: u64,
    /// What single images are picked by; made from the rest.
    picks: Picks,
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
/// Candidates that a leaf lists at most: those with the largest shares. Where fewer are recorded, signatures that must be visible
/// are added.
const LISTED: usize = 4096;
/// Signatures that are expected to be seen from a leaf without a record of it there count as if they had this share of the
/// mean signature's flux.
const UNRECORDED: f32 = 0.25;

wire!(Candidate { signature, linear, best, gates, share });

impl Wire for Records {
    fn put(&self, out: &mut Vec<u8>) {
        self.kd.put(out);
        self.first.put(out);
        self.candidates.put(out);
        self.grains.put(out);
        self.signatures.put(out);
        self.names.put(out);
        self.linears.put(out);
        self.records.put(out);
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        let mut all = Records {
            kd: Wire::take(at)?,
            first: Wire::take(at)?,
            candidates: Wire::take(at)?,
            grains: Wire::take(at)?,
            signatures: Wire::take(at)?,
            names: Wire::take(at)?,
            linears: Wire::take(at)?,
            records: Wire::take(at)?,
            ..Records::default()
        };
        if !all.is_sound() {
            return Err(ZoneFileError::Damaged("its records contradict themselves"));
        }
        all.picks = Picks::new(all.grains.len());
        Ok(all)
    }
}

impl Default for Records {
    fn default() -> Self {
        Records {
            kd: Kd::default(),
            first: vec![0],
            candidates: Vec::new(),
            grains: Vec::new(),
            signatures: Vec::new(),
            names: Vec::new(),
            linears: Vec::new(),
            records: 0,
            picks: Picks::default(),
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

/// A number that no other solution of this process has. It is not stored, and nothing but sameness depends on it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Identity(u64);

impl Default for Identity {
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Identity(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

impl Records {
    /// Group the records; `exact`: what surfaces say of their signatures. The result depends on these and on the order of the
    /// records alone.
    pub fn new(mut records: Vec<Record>, exact: &HashMap<u32, Exact>) -> Records {
        let mut all = Records { records: records.len() as u64, ..Records::default() };
        all.name_signatures(&mut records, exact);
        let small = |here: &[Record]| {
            here.len() <= LEAF || here.len() <= LARGEST && here.len() < PER_SIGNATURE * distinct(here)
        };
        let (kd, groups) = Kd::new(&mut records, small);
        all.kd = kd;
        let this = &all;
        let outlook = Outlook::new(&all.signatures);
        let found: Vec<(Found, f32)> = (0..groups.len())
            .into_par_iter()
            .map_init(|| Nearby::new(this.signatures.len()), |near, i| this.leaf(&groups, i, &outlook, near))
            .collect();
        for (leaf, grain) in found {
            for (mut candidate, linear) in leaf {
                if let Some(linear) = linear {
                    candidate.linear = all.linears.len() as u32;
                    all.linears.push(linear);
                }
                all.candidates.push(candidate);
            }
            all.first.push(all.candidates.len() as u32);
            all.grains.push(grain);
        }
        all.picks = Picks::new(all.grains.len());
        all
    }

    /// How far apart points in a box may lie to expect the same of all but a quarter of `list`.
    fn grain(&self, list: &Found, low: Vec3, high: Vec3) -> f32 {
        let whole = 0.5 * (high - low).length();
        let x = 0.5 * (low + high);
        let mut grains: Vec<f32> = list
            .iter()
            .filter(|f| f.1.is_none())
            .map(|f| self.signatures[f.0.signature as usize].grain(x))
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

    /// Replace each record's signature by its index, and fit what each signature's records have in common.
    fn name_signatures(&mut self, records: &mut [Record], exact: &HashMap<u32, Exact>) {
        records.par_sort_by_key(|r| r.signature);
        let groups: Vec<&mut [Record]> = records.chunk_by_mut(|a, b| a.signature == b.signature).collect();
        let known = |g: &[Record]| exact.get(&g[0].signature).copied().unwrap_or_default();
        self.signatures = groups.par_iter().map(|g| Signature::fit(g, &known(g))).collect();
        self.names = groups.iter().map(|g| g[0].signature).collect();
        model::fit_classes(&mut self.signatures, &groups);
        groups
            .into_par_iter()
            .enumerate()
            .for_each(|(i, g)| g.iter_mut().for_each(|r| r.signature = i as u32));
    }

    /// What matters in leaf `i`: every signature recorded in it or around it, and those that must be visible from it; and its
    /// grain.
    fn leaf(&self, groups: &[Group<Record>], i: usize, outlook: &Outlook, near: &mut Nearby) -> (Found, f32) {
        let Group { members, low, high } = groups[i];
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        near.collect(&self.kd, groups, i);
        let mut found: Found = Vec::new();
        near.curved.clear();
        for &name in &near.names {
            let candidate = self.candidate(name, near.shares[name as usize], centre);
            let signature = &self.signatures[name as usize];
            let place = signature.places[candidate.best as usize].sin2(centre);
            let (leaf, k) = near.first[name as usize];
            let first = &groups[leaf as usize].members[k as usize];
            let seen = first.radius / first.length;
            // No regression where a fixed place says as much, or where one image explains all records: regressed on few of them a
            // luminaire seen aslant looks smaller than it is.
            if signature.scattered != 0 && place > 2.5 * seen * seen {
                near.curved.push(name);
            } else if !signature.is_missed_from(centre, radius) {
                found.push((candidate, None));
            }
        }
        self.regressions(&mut found, groups, i, near);
        let mut names: Vec<u32> = found.iter().map(|f| f.0.signature).collect();
        names.sort_unstable();
        self.unrecorded(outlook, &mut found, &names, centre, radius, members[0].n);
        let key = |f: &(Candidate, Option<Linear>)| (f.0.share, f.0.signature);
        found.sort_by(|a, b| key(b).0.total_cmp(&key(a).0).then(key(a).1.cmp(&key(b).1)));
        found.truncate(LISTED);
        let total: f32 = found.iter().map(|f| f.0.share).sum();
        found.iter_mut().for_each(|f| f.0.share /= total.max(f32::MIN_POSITIVE));
        // Neighbours in direction are neighbours in the list: cones are tested by blocks and sampled systematically.
        found.sort_by_cached_key(|f| (self.direction_code(f, centre), f.0.signature));
        let grain = self.grain(&found, low, high);
        (found, grain)
    }

    /// The candidates of the signatures around leaf `i` that no fixed place explains.
    fn regressions(&self, found: &mut Found, groups: &[Group<Record>], i: usize, near: &Nearby) {
        let Group { low, high, .. } = groups[i];
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        for (name, mut group) in near.curved_records(&self.kd, groups, i) {
            let share = near.shares[name as usize];
            let candidate = self.candidate(name, share, centre);
            let signature = &self.signatures[name as usize];
            let place = signature.places[candidate.best as usize].sin2(centre);
            let mut rest = group.len();
            let images = Linear::fit_images(&mut group, IMAGES);
            for (linear, count) in images {
                let part = count as f32 / group.len() as f32;
                let linear = linear.filter(|l| l.sin2 < 0.7 * place);
                // What no regression explains is left to the places, once.
                if linear.is_some() || rest == group.len() && !signature.is_missed_from(centre, radius) {
                    let gates = if linear.is_some() { 0 } else { candidate.gates | LOOSE };
                    found.push((Candidate { share: share * part, gates, ..candidate }, linear));
                }
                rest -= count;
            }
        }
    }

    /// A signature as seen from a leaf around `centre`.
    fn candidate(&self, signature: u32, share: f32, centre: Vec3) -> Candidate {
        let Signature { places, windows, .. } = &self.signatures[signature as usize];
        let mut sin2 = places.map(|p| p.sin2(centre));
        // Behind a chain of one patch lies the luminaire itself: its image again, known less well, unless it is flat.
        let flat = windows[1].is_some_and(|w| w.outline.is_some());
        if !flat && (places[2].centre - places[0].centre).length() <= 2.0 * places[0].radius {
            sin2[2] = 1.0;
        }
        let best = (0..3).fold(0, |b, k| if sin2[k] < sin2[b] { k } else { b });
        // The ray must pass all that is known; from within a place or close by, it says nothing.
        let tells = |k: usize| (k != best && sin2[k] < 0.5) as u8;
        let gates = (0..3).fold(0, |g, k| g | tells(k) << k);
        Candidate { signature, linear: NONE, best: best as u8, gates, share }
    }

    /// Add the signatures that the places of their images and patches make visible from around `centre`, those that promise
    /// most first, as far as there is room.
    fn unrecorded(
        &self,
        outlook: &Outlook,
        found: &mut Found,
        known: &[u32],
        centre: Vec3,
        radius: f32,
        n: Vec3,
    ) {
        let room = LISTED.saturating_sub(found.len());
        if room == 0 {
            return;
        }
        let share = UNRECORDED * found.iter().map(|f| f.0.share).sum::<f32>() / found.len().max(1) as f32;
        // The variance that missing one costs: a ray that meets it by chance brings the more the brighter it is.
        let promise = |c: &Candidate| {
            let signature = &self.signatures[c.signature as usize];
            signature.strength * signature.strength * signature.places[c.best as usize].sin2(centre)
        };
        let mut more: Vec<Candidate> = Vec::new();
        for name in outlook.visible_from(centre, radius, n) {
            let name = name as u32;
            if known.binary_search(&name).is_err()
                && !self.signatures[name as usize].is_missed_from(centre, radius)
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
                && c.gates < 2 * LOOSE
        };
        !self.first.is_empty()
            && self.kd.is_sound(self.first.len() - 1)
            && self.first.is_sorted()
            && self.grains.len() + 1 == self.first.len()
            && self.grains.iter().all(|g| *g > 0.0)
            && self.names.len() == self.signatures.len()
            && self.names.is_sorted()
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
            + self.picks.memory_bytes()
    }

    /// How many images are listed around `p` on a surface that faces unit `n`.
    pub fn listed(&self, p: Vec3, n: Vec3) -> usize {
        self.kd.leaf(p, n).map_or(0, |leaf| self.in_cell(leaf).len())
    }

    /// The candidates of a leaf.
    fn in_cell(&self, leaf: usize) -> &[Candidate] {
        &self.candidates[self.first[leaf] as usize..self.first[leaf + 1] as usize]
    }
}

/// The signatures recorded around a leaf; scratch space of one thread.
struct Nearby {
    /// Flux of each signature, weighted; 0 where it is not near.
    shares: Vec<f32>,
    /// A record of each, by leaf and number.
    first: Vec<(u32, u32)>,
    /// Those that are near, in order.
    names: Vec<u32>,
    /// Those of them that no fixed place explains, in order.
    curved: Vec<u32>,
}

fn within(p: Vec3, low: Vec3, high: Vec3) -> bool {
    p.cmpge(low).all() && p.cmple(high).all()
}

impl Nearby {
    fn new(signatures: usize) -> Nearby {
        Nearby {
            shares: vec![0.0; signatures],
            first: vec![(0, 0); signatures],
            names: Vec::new(),
            curved: Vec::new(),
        }
    }

    /// Call `f` with every record around leaf `i`, its leaf and its number, in an order of their own.
    fn visit(kd: &Kd, groups: &[Group<Record>], i: usize, f: &mut impl FnMut(&Record, u32, u32)) {
        let (low, high) = groups[i].dilated(DILATE);
        kd.visit(groups[i].members[0].n, low, high, &mut |leaf| {
            for (k, r) in groups[leaf as usize].members.iter().enumerate() {
                if within(r.p, low, high) {
                    f(r, leaf, k as u32);
                }
            }
        });
    }

    fn collect(&mut self, kd: &Kd, groups: &[Group<Record>], i: usize) {
        for name in self.names.drain(..) {
            self.shares[name as usize] = 0.0;
        }
        let Group { low, high, .. } = groups[i];
        Nearby::visit(kd, groups, i, &mut |r, leaf, k| {
            let share = &mut self.shares[r.signature as usize];
            if *share == 0.0 {
                self.names.push(r.signature);
                self.first[r.signature as usize] = (leaf, k);
            }
            // Never nothing: a record without flux still says where.
            let weight = if within(r.p, low, high) { 1.0 } else { OUTSIDE };
            *share += (r.flux * weight).max(f32::MIN_POSITIVE);
        });
        self.names.sort_unstable();
    }

    /// The records of each signature in `curved`.
    fn curved_records(&self, kd: &Kd, groups: &[Group<Record>], i: usize) -> Vec<(u32, Vec<Record>)> {
        let mut all: Vec<(u32, Vec<Record>)> = self.curved.iter().map(|name| (*name, Vec::new())).collect();
        if !all.is_empty() {
            Nearby::visit(kd, groups, i, &mut |r, _, _| {
                if let Ok(at) = self.curved.binary_search(&r.signature) {
                    all[at].1.push(*r);
                }
            });
        }
        all
    }
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
                    aside: None,
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
            let records = Records::new(flat(image, 0.2, n), &HashMap::new());
            for x in [Vec3::ZERO, Vec3::new(0.08, -0.05, 0.0)] {
                let cones = Cones::new(&records, x, Vec3::Z);
                let to = (image - x).normalize();
                assert!(cones.len() == 1 && cones.density(to) > 0.0, "{n} records at {x}");
                let (w, _) = cones.sample(0.5, [0.3, 0.8]).unwrap();
                assert!((w - to).length() < 2.0 * 0.002 / image.length(), "tight: {w} against {to}");
            }
        }
    }

    /// Images of a lamp in the narrow side of a table top: from over the top, close by, no ray leads there, though
    /// the top lies within the ball around the side.
    #[test]
    fn what_a_patch_close_by_does_not_show_is_not_expected() {
        use crate::world::outline::Outline;
        let image = Vec3::new(0.0, -0.3, 1.9);
        let side = Outline {
            corner: Vec3::new(-0.8, 0.55, 0.71),
            sides: [Vec3::X * 1.6, Vec3::Z * 0.04],
            triangle: false,
        };
        let below = Vec3::new(0.0, 1.1, 0.0);
        let mut all = flat(image, 0.02, 20);
        for r in &mut all {
            r.p += below;
            (r.dir, r.length) = ((image - r.p).normalize(), (image - r.p).length());
            r.reach = [0.4 * r.length, r.length];
        }
        let seen = |x: Vec3| {
            let exact = Exact { outlines: [Some(side), None], ..Exact::of(Some(image), None, 1.0) };
            let records = Records::new(all.clone(), &HashMap::from([(7, exact)]));
            Cones::new(&records, x, Vec3::Z).len()
        };
        let above = Vec3::new(0.0, 0.2, 0.75);
        assert_eq!([seen(below), seen(above)], [1, 0]);
    }

    /// A lamp in a mirror, seen from just over the mirror: the middle of a spot may lie behind it, from where nothing is seen.
    #[test]
    fn what_a_mirror_shows_is_expected_right_before_it() {
        use crate::world::outline::Outline;
        let missed = |height: f32| {
            let image = Vec3::new(0.3, -0.4, height - 1.0);
            let corner = Vec3::new(-1.0, -1.0, height);
            let mirror = Outline { corner, sides: [Vec3::X * 2.0, Vec3::Y * 2.0], triangle: false };
            let mut all = flat(image, 0.0, 64);
            for (i, r) in all.iter_mut().enumerate() {
                let (u, v) = (sobol(i as u32, Key::new(5)), sobol(i as u32, Key::new(6)));
                r.p = Vec3::new(0.1 * u.u, 0.1 * u.v, height + 0.001 + 0.2 * v.u * v.u);
                r.n = -Vec3::Z;
                (r.dir, r.length) = ((image - r.p).normalize(), (image - r.p).length());
                r.reach = [(r.p.z - height) / -r.dir.z, r.length];
            }
            let exact = Exact { outlines: [Some(mirror), None], ..Exact::of(Some(image), None, 1.0) };
            let records = Records::new(all.clone(), &HashMap::from([(7, exact)]));
            let is_missed = |r: &&Record| Cones::new(&records, r.p, -Vec3::Z).density(r.dir) <= 0.0;
            all.iter().filter(is_missed).count()
        };
        // At some of these heights the plane lies in the upper half of the spots.
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(|k| missed(0.5 + 0.00137 * k as f32)), [0; 8]);
    }

    /// A luminaire so faint that what it brings can't be divided by: 6e-45 once made the number of cone rays none at all.
    #[test]
    fn what_is_nearly_dark_is_a_number_of_rays_too() {
        for strength in [0.0, 1e-45, 1e-42, 1e-39, 1e-37, 1e-30, 1.0] {
            let mut all = flat(Vec3::new(1.0, 0.4, 2.0), 0.2, 20);
            all.iter_mut().for_each(|r| r.strength = strength);
            let records = Records::new(all, &HashMap::new());
            let cones = Cones::new(&records, Vec3::ZERO, Vec3::Z);
            let shares: f32 = cones.iter().map(|c| c.2).sum();
            assert!((1.0..=4.0).contains(&cones.need()), "{strength}: {}", cones.need());
            assert!(cones.effective() >= 0.99 && (shares - 1.0).abs() < 1e-5, "{strength}: {shares}");
        }
    }

    /// One image that is known, and as much flux from all over a lens: the lens is not taken for a luminaire as large as it looks.
    #[test]
    fn what_no_image_explains_leaves_room_for_one_that_is_known() {
        let image = Vec3::new(1.0, 0.4, 2.0);
        let mut all = flat(image, 0.2, 64);
        let all_over = flat(Vec3::Z, 0.2, 64).into_iter().enumerate().map(|(i, r)| {
            let u = sobol(i as u32, Key::new(9));
            let dir = Vec3::new(u.u - 0.5, u.v - 0.5, 1.0).normalize();
            Record { dir, reach: [0.3, 0.5], length: 1.0, signature: 8, class: 8, radius: 0.02, ..r }
        });
        all.extend(all_over);
        let records = Records::new(all, &HashMap::new());
        let cones = Cones::new(&records, Vec3::ZERO, Vec3::Z);
        let known = cones.iter().filter(|c| (c.0 - image.normalize()).length() < 0.01).map(|c| c.2);
        let share: f32 = known.sum();
        assert!(share > 0.6, "{share}");
    }
}
