//! Light particles: the report's zonal solution computed by ray tracing.
//!
//! Particles leave the luminaires in proportion to power, follow specular chains, deposit their flux in the zone of
//! every surface that scatters otherwise (collision estimator), and survive by Russian roulette on the luminance of
//! what is scattered. Deposits fall in three bins: *direct* (straight from the luminaire), *caustic* (from the luminaire
//! through mirrors and glass only) and *indirect* (the rest).
//!
//! Deposits are summed in integers, so the result does not depend on the number of threads. The books balance: what
//! was emitted equals what was absorbed plus what escaped ([`Ledger`]).

use super::aim::{Aim, Start, Trial};
use super::apparent::Apparent;
use super::bright::{Bright, BrightSource};
use super::field::Incidence;
use super::map::{ZoneMap, ZonePlace};
use super::records::{Exact, LARGE, Record};
use super::sight::Sight;
use crate::bsdf::{Bsdf, BsdfSample, Transport as Quantity};
use crate::world::emission::EmittedParticle;
use crate::world::{Surface, World};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::points::{Key, sobol};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// What scatters at a bright zone survives at least this probably.
const BRIGHT_SURVIVE: f32 = 0.5;
/// Particles that are traced as one unit of work.
const CHUNK: u64 = 2048;
/// Longest life of a particle, in scatterings.
const LONGEST_LIFE: u32 = 2000;

/// What kind of arrival a deposit was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bin {
    /// Straight from a luminaire.
    Direct = 0,
    /// From a luminaire through specular reflections and refractions only.
    Caustic = 1,
    /// After at least one other scattering.
    Indirect = 2,
}

/// Where the flux went (W per band, divided by nothing: sums over particles).
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    /// Left luminaires.
    pub emitted: [f64; 3],
    /// Lost at surfaces (net of roulette: negative contributions occur).
    pub absorbed: [f64; 3],
    /// Left the scene.
    pub escaped: [f64; 3],
    /// Arrived at surfaces that scatter other than specularly.
    pub incident: [f64; 3],
    /// Cut off at the longest life.
    pub truncated: [f64; 3],
    /// Segments traced.
    pub rays: u64,
}

impl Ledger {
    fn add(mut self, o: &Ledger) -> Ledger {
        for c in 0..3 {
            self.emitted[c] += o.emitted[c];
            self.absorbed[c] += o.absorbed[c];
            self.escaped[c] += o.escaped[c];
            self.incident[c] += o.incident[c];
            self.truncated[c] += o.truncated[c];
        }
        self.rays += o.rays;
        self
    }
}

/// Running sums of deposits per zone side: integers, so any order of addition gives the same.
pub struct Deposits {
    /// Per zone side and bin, three bands.
    flux: Vec<AtomicU64>,
    /// Per zone side: sum of squared luminance of deposits.
    squares: Vec<AtomicU64>,
    /// Per zone side, three bands: what came from bright zones by mirrors and glass, after `bright_from` particles.
    glints: Vec<AtomicU64>,
    bright_from: u64,
    unit: f64,
    square_unit: f64,
    /// Totals so far.
    pub ledger: Ledger,
    /// Particles so far.
    pub particles: u64,
    /// What was found on the way, in the order of particles.
    pub finds: Finds,
    /// The zones that outshine the scene; known after the first of [`BRIGHT_AT`] particles.
    bright: Bright,
    aim: Aim,
    /// The particles that `aim` will next learn from.
    trials: Vec<Trial>,
    /// What matters; `None`: everything.
    sight: Option<Sight>,
}

/// Particles after which emission is aimed anew, each time by the particles since the last, ...
const AIMED_AT: [u64; 5] = [1 << 15, 1 << 17, 1 << 19, 1 << 21, 1 << 23];
/// ... at most so many.
const MOST_TRIALS: u64 = 1 << 19;
/// What an arrival through mirrors and glass is worth, against one straight from a luminaire.
const CHAIN_USE: f32 = 4.0;
/// What an arrival is worth where it does not matter.
const UNSEEN_USE: f32 = 0.02;

/// What particles find that steers gathers.
#[derive(Clone, Debug, Default)]
pub struct Finds {
    /// Arrivals from luminaires through specular chains; [`most`] at most.
    pub records: Vec<Record>,
    /// Arrivals from bright zones, straight or through specular chains; as many at most.
    pub zone_records: Vec<Record>,
    /// Arrivals other than straight from a luminaire; as many at most.
    pub incidences: Vec<Incidence>,
    /// What is known exactly of the signatures.
    pub exact: HashMap<u32, Exact>,
}

impl Finds {
    /// Take what `more` has, up to `most` of each kind.
    fn append(&mut self, more: Finds, most: usize) {
        if self.records.len() < most || self.zone_records.len() < most {
            for (signature, exact) in more.exact {
                self.exact.entry(signature).or_insert(exact);
            }
        }
        let room = |held: usize| most.saturating_sub(held);
        let n = room(self.records.len());
        self.records.extend(more.records.into_iter().take(n));
        let n = room(self.zone_records.len());
        self.zone_records.extend(more.zone_records.into_iter().take(n));
        let n = room(self.incidences.len());
        self.incidences.extend(more.incidences.into_iter().take(n));
    }
}

/// Finds of each kind that are kept of so many particles: 2²⁰ to 2²¹. They are the first ones, so that they do not depend on
/// how many particles follow.
pub fn most(particles: u64) -> usize {
    (particles / 2).clamp(1 << 20, 1 << 21) as usize
}

/// What a recorded arrival weighs there where its signature is recorded often: cones look for the same, so broad strata need to mind it
/// less. ...
pub(super) const RECORDED: f32 = 0.25;
/// ... Where that is recorded seldom, others like it are not recorded at all.
const SELDOM: u32 = 8;
/// What an arrival through mirrors and glass weighs that is not recorded, for its source is large (a panel, a sky): beside every
/// direction that leads to the source are others that do not (other facets, the other branch), so rays there bring much or nothing,
/// and the best density goes by the root of the mean square. 8 gains 5 % more where 4 gains 20.
const SPOTTED: f32 = 4.0;

/// Particles after which it is decided which zones are bright, and again, for good. A run that time ends between the two
/// must not do without.
const BRIGHT_AT: [u64; 2] = [1 << 15, 1 << 17];

impl Deposits {
    /// Nothing deposited yet, for a map of `zones` zones and luminaires of `power` W.
    pub fn new(zones: usize, power: f64, sight: Option<Sight>) -> Deposits {
        let power = if power > 0.0 { power } else { 1.0 };
        let zeros = |n: usize| (0..n).map(|_| AtomicU64::new(0)).collect();
        Deposits {
            flux: zeros(zones * 2 * 9),
            squares: zeros(zones * 2),
            glints: zeros(zones * 2 * 3),
            bright_from: 0,
            // A particle carries about `power`: 26 bits of it, and room for 2³⁸ such deposits.
            unit: (1u64 << 26) as f64 / power,
            square_unit: (1u64 << 20) as f64 / (power * power),
            ledger: Ledger::default(),
            particles: 0,
            finds: Finds::default(),
            bright: Bright::default(),
            aim: Aim::default(),
            trials: Vec::new(),
            sight,
        }
    }

    #[inline]
    fn deposit(&self, side: usize, bin: Bin, flux: Rgb) {
        for c in 0..3 {
            let v = (flux[c] as f64 * self.unit + 0.5) as u64;
            self.flux[side * 9 + bin as usize * 3 + c].fetch_add(v, Ordering::Relaxed);
        }
        let y = flux.luminance() as f64;
        self.squares[side].fetch_add((y * y * self.square_unit + 0.5) as u64, Ordering::Relaxed);
    }

    /// Summed flux of a zone side in a bin (W × particles).
    pub fn flux(&self, side: usize, bin: Bin) -> [f64; 3] {
        [0, 1, 2]
            .map(|c| self.flux[side * 9 + bin as usize * 3 + c].load(Ordering::Relaxed) as f64 / self.unit)
    }

    /// Note `flux` that came to a zone side from a bright zone by mirrors and glass; it is deposited besides.
    #[inline]
    fn glint(&self, side: usize, flux: Rgb) {
        for c in 0..3 {
            let v = (flux[c] as f64 * self.unit + 0.5) as u64;
            self.glints[side * 3 + c].fetch_add(v, Ordering::Relaxed);
        }
    }

    /// Flux that came to a zone side from bright zones by mirrors and glass (W), a part of [`Bin::Indirect`].
    pub fn glints(&self, side: usize) -> [f64; 3] {
        let scale = 1.0 / (self.unit * (self.particles - self.bright_from).max(1) as f64);
        [0, 1, 2].map(|c| self.glints[side * 3 + c].load(Ordering::Relaxed) as f64 * scale)
    }

    /// Summed squared luminance of deposits of a zone side (W² × particles).
    pub fn squares(&self, side: usize) -> f64 {
        self.squares[side].load(Ordering::Relaxed) as f64 / self.square_unit
    }

    /// Trace particles `self.particles ..` up to `total`, stopping early when `stop` says so (asked between batches). `planned`
    /// is how many were meant to be traced at first. Whether they come in one call or in several does not show.
    pub fn trace(
        &mut self,
        world: &World,
        map: &ZoneMap,
        [seed, planned]: [u64; 2],
        total: u64,
        mut stop: impl FnMut(u64) -> bool,
    ) {
        let key = Key::new(seed).with(0x9a_47_1c_1e);
        const BATCH: u64 = 64 * CHUNK;
        while self.particles < total && !stop(self.particles) {
            if AIMED_AT.contains(&self.particles) {
                self.aim = Aim::learn(std::mem::take(&mut self.trials));
            }
            let [first, again] = BRIGHT_AT;
            let due = if self.bright.is_known() { again } else { first.min(planned / 2) };
            if self.particles >= due && (!self.bright.is_known() || self.bright_from < again) {
                self.decide_bright(world, map);
            }
            // A batch ends where something is decided.
            let next = AIMED_AT.into_iter().find(|n| *n > self.particles);
            let end = (self.particles + BATCH).min(total).min(next.unwrap_or(u64::MAX));
            let learns = next.is_some_and(|n| end + MOST_TRIALS > n);
            let starts: Vec<u64> = (self.particles..end).step_by(CHUNK as usize).collect();
            let this = &*self;
            // Collected in order, then summed in order: the same bits for any number of threads.
            let chunks: Vec<(Ledger, Finds, Vec<Trial>)> = starts
                .par_iter()
                .map(|&start| {
                    let (mut ledger, mut finds) = (Ledger::default(), Finds::default());
                    let mut trials = Vec::new();
                    for i in start..(start + CHUNK).min(end) {
                        let trial = this.particle(world, map, key, i, &mut ledger, &mut finds);
                        if learns {
                            trials.push(trial);
                        }
                    }
                    (ledger, finds, trials)
                })
                .collect();
            for (ledger, finds, trials) in chunks {
                self.ledger = self.ledger.add(&ledger);
                self.finds.append(finds, most(end));
                self.trials.extend(trials);
            }
            self.particles = end;
        }
        if !self.bright.is_known() && self.particles >= BRIGHT_AT[0].min(planned / 2) {
            self.decide_bright(world, map);
        }
    }

    /// Decide which zones are bright by what has come so far, and forget what was found by an earlier decision.
    fn decide_bright(&mut self, world: &World, map: &ZoneMap) {
        self.bright = Bright::new(world, map, &self.irradiances(map));
        self.bright_from = self.particles;
        self.glints.iter_mut().for_each(|g| *g.get_mut() = 0);
        for record in self.finds.zone_records.drain(..) {
            self.finds.exact.remove(&record.signature);
        }
    }

    /// What an arrival counts when emission is aimed.
    fn worth(&self, s: &Surface, bin: Bin) -> f32 {
        let n = s.facing();
        let seen = self.sight.as_ref().is_none_or(|sight| sight.sees(s.p, n));
        let worth = if seen { 1.0 } else { UNSEEN_USE };
        if bin == Bin::Caustic { CHAIN_USE * worth } else { worth }
    }

    /// What a particle that scatters at a zone comes from for the records: nothing unless the zone is bright.
    fn zone_source(&self, map: &ZoneMap, place: &ZonePlace, b: &BsdfSample, kept: f32, from: Vec3) -> Source {
        let Some(source) = self.bright.of(place.zone * 2 + place.side) else { return Source::none() };
        let area = map.areas()[place.zone as usize] * b.wi.z.abs();
        Source::of_bright(source, Some(area), b.transmitted, kept, from)
    }

    /// The zones that outshine the scene.
    pub(super) fn bright(&self) -> &Bright {
        &self.bright
    }

    /// The irradiance of every zone side so far (luminance, W/m²).
    fn irradiances(&self, map: &ZoneMap) -> Vec<f64> {
        let n = self.particles.max(1) as f64;
        let of = |side: usize| {
            let bins = [Bin::Direct, Bin::Caustic, Bin::Indirect].map(|b| self.flux(side, b));
            let flux = (0..3).map(|c| [0.2126, 0.7152, 0.0722][c] * bins.iter().map(|b| b[c]).sum::<f64>());
            let area = map.areas()[side / 2] as f64;
            if area > 0.0 { flux.sum::<f64>() / (n * area) } else { 0.0 }
        };
        (0..map.len() * 2).map(of).collect()
    }

    fn particle(
        &self,
        world: &World,
        map: &ZoneMap,
        key: Key,
        i: u64,
        ledger: &mut Ledger,
        finds: &mut Finds,
    ) -> Trial {
        let which = || key.with(4).with(i).uniform(0);
        let (start, density, sender) = world.hints.start(&self.aim, starting_numbers(key, i), which);
        let [pick, p0, p1, d0, d1] = start;
        let mut trial = Trial { start, use_: 0.0 };
        let Some(e) = world.luminaires.emit(&world.scene, pick, [p0, p1], [d0, d1]) else { return trial };
        let plain = e.flux.luminance();
        let e = EmittedParticle { flux: e.flux * (1.0 / density), ..e };
        add(&mut ledger.emitted, e.flux);
        let numbers = key.with(3).with(i);
        let mut dimension = 0;
        let mut next = |n: u32| {
            dimension += n;
            dimension - n
        };
        let (mut origin, mut dir, mut flux) = (e.origin, e.dir, e.flux);
        // Whether it last scattered at a bright zone.
        let (mut bounce, mut chain, mut shone) = (0u32, false, false);
        let mut source = Source::of_luminaire(world, e.luminaire, e.origin);
        for _ in 0..LONGEST_LIFE {
            if flux.is_black() {
                return trial;
            }
            ledger.rays += 1;
            let hit = world.closest(origin, dir, f32::INFINITY);
            if bounce == 0 && !chain && world.hints.counts_particles() {
                world.hints.note_particle(sender, hit.as_ref().map(|s| (s.group, s.shape)));
            }
            let Some(s) = hit else {
                add(&mut ledger.escaped, flux);
                return trial;
            };
            let bsdf = world.bsdf(&s);
            let wo = s.frame.to_local(s.wo);
            let mut here = None;
            if bsdf.has_non_delta() || bsdf.is_black() {
                let bin = match (bounce, chain) {
                    (0, false) => Bin::Direct,
                    (0, true) => Bin::Caustic,
                    _ => Bin::Indirect,
                };
                let place = map.locate(world, &s, [0.5, 0.5]);
                let side = (place.zone * 2 + place.side) as usize;
                self.deposit(side, bin, flux);
                if chain && shone {
                    self.glint(side, flux);
                }
                add(&mut ledger.incident, flux);
                trial.use_ += self.worth(&s, bin) * flux.luminance() * density / plain.max(f32::MIN_POSITIVE);
                if bin != Bin::Direct {
                    finds.arrival(&s, &source, bounce, flux.luminance());
                }
                here = Some(place);
            }
            let (u_lobe, u) = (numbers.uniform(next(1)), numbers.uniform2(next(1)));
            let sampled = bsdf.sample(wo, u_lobe, [u.u, u.v], Quantity::Flux);
            let Some(b) = sampled else {
                add(&mut ledger.absorbed, flux);
                return trial;
            };
            let wi = s.frame.to_world(b.wi).normalize();
            if s.is_front(wi) != (b.wi.z > 0.0) {
                add(&mut ledger.absorbed, flux);
                return trial;
            }
            // Shading normals are not symmetric: Veach's factor for adjoint scattering (1997, eq. 5.19).
            let (gi, go) = (s.ng.dot(wi).abs(), s.ng.dot(s.wo).abs());
            let correction = match b.delta || s.ng == s.frame.n {
                true => 1.0,
                false => ((wo.z.abs() * gi) / (b.wi.z.abs() * go).max(1e-9)).min(100.0),
            };
            let scattered = flux * b.weight * correction;
            let before = flux.luminance().max(1e-30);
            // Bright zones are sources however little they reflect: without records their images are met by chance only.
            let left = (scattered.luminance() / before).min(1.0);
            let shines = || here.is_some_and(|place| self.bright.of(place.zone * 2 + place.side).is_some());
            let survive = if !b.delta && left > 0.0 && shines() { left.max(BRIGHT_SURVIVE) } else { left };
            if survive < 1.0 && numbers.uniform(next(1)) >= survive {
                add(&mut ledger.absorbed, flux);
                return trial;
            }
            let kept = scattered * (1.0 / survive.max(1e-30));
            add(&mut ledger.absorbed, flux - kept);
            flux = kept;
            if b.delta {
                chain = true;
                source.pass(world, &s, &bsdf, wi, &b);
            } else {
                bounce += 1;
                chain = false;
                shone = here.is_some_and(|place| self.bright.has(place.zone));
                source = match here {
                    Some(place) => self.zone_source(map, &place, &b, left, s.p),
                    None => Source::none(),
                };
            }
            origin = s.leave(wi);
            dir = wi;
        }
        add(&mut ledger.truncated, flux);
        trial
    }
}

/// The numbers that particle `i` starts from, before they are aimed: well spread over any prefix of the particles.
pub(super) fn starting_numbers(key: Key, i: u64) -> Start {
    // Golden-ratio steps stratify the pick.
    let pick = (key.uniform64(0) + i as f64 * 0.618_033_988_749_894_9).fract() as f32;
    let (index, block) = (i as u32, key.with(i >> 32));
    let (p, d) = (sobol(index, block.with(1)), sobol(index, block.with(2)));
    [pick.min(1.0 - f32::EPSILON / 2.0), p.u, p.v, d.u, d.v]
}

/// Where a particle last came from other than through mirrors and glass, and its chain since.
pub(super) struct Source {
    /// Whether records of it are wanted.
    known: bool,
    signature: Key,
    class: Key,
    /// m.
    radius: f32,
    /// Radiance (luminance) times what the chain has left of it.
    strength: f32,
    /// Length of the chain (m) and of its last segment.
    length: f32,
    previous: f32,
    /// What its flat surfaces say.
    exact: Exact,
    /// Where the middle of the source is known and all surfaces so far were flat.
    apparent: Option<Apparent>,
}

impl Source {
    fn none() -> Source {
        Source {
            exact: Exact::default(),
            apparent: None,
            known: false,
            signature: Key::new(0),
            class: Key::new(0),
            radius: 0.0,
            strength: 0.0,
            length: 0.0,
            previous: 0.0,
        }
    }

    /// A bright zone that scatters `kept` of what it receives. `area`: of the zone as seen from where the way leads, for those that no
    /// outline says how large they are seen: against the ball around it.
    pub(super) fn of_bright(
        bright: &BrightSource,
        area: Option<f32>,
        through: bool,
        kept: f32,
        from: Vec3,
    ) -> Source {
        let ball = std::f32::consts::PI * bright.radius * bright.radius;
        let filled = match area.filter(|_| bright.outline.is_none()) {
            Some(area) => (area / ball.max(f32::MIN_POSITIVE)).min(1.0),
            None => 1.0,
        };
        Source {
            known: true,
            exact: Exact::of(bright.outline.map(|_| bright.centre), bright.outline, 1.0),
            apparent: bright.outline.map(|_| Apparent { distance: 0.0, aside: bright.centre - from }),
            signature: Key::new(1 << 40 | (bright.name as u64) << 1 | through as u64),
            radius: bright.radius,
            strength: bright.radiance * kept * filled,
            ..Source::none()
        }
    }

    /// Of `luminaire`, from the point `from` of it.
    pub(super) fn of_luminaire(world: &World, luminaire: u32, from: Vec3) -> Source {
        match world.luminaires.identity(&world.scene, luminaire) {
            Some((name, radius, distance)) => Source {
                apparent: world
                    .luminaires
                    .place(luminaire)
                    .map(|at| Apparent { distance: 0.0, aside: at.centre - from }),
                known: true,
                signature: Key::new(name as u64),
                class: Key::new(name as u64),
                radius,
                strength: world.luminaires.mean_radiance(&world.scene, luminaire),
                length: distance,
                previous: distance,
                exact: match world.luminaires.place(luminaire) {
                    Some(at) => Exact::of(Some(at.centre), at.outline, at.fill),
                    None => Exact::default(),
                },
            },
            None => Source::none(),
        }
    }

    /// Go by the specular interface at `s` and on along unit `on`, as `next` says.
    pub(super) fn pass(&mut self, world: &World, s: &Surface, bsdf: &Bsdf, on: Vec3, next: &BsdfSample) {
        if self.known {
            let (wo, transmitted) = (s.frame.to_local(s.wo), next.transmitted);
            self.length += s.t;
            let flat = world.flat_outline(s).is_some();
            self.apparent = self.apparent.filter(|_| flat).map(|before| before.pass(s, on, next));
            self.previous = if self.apparent.is_some() && transmitted { s.t * next.eta } else { s.t };
            self.exact.pass(world.outline(s), s.p, s.ng, transmitted);
            self.strength *= kept_by(bsdf, wo, transmitted);
            self.signature = self.signature.with(world.patch(s)).with(transmitted as u64);
            let shape = (s.group as u64) << 32 | s.shape as u64;
            self.class = self.class.with(shape).with(transmitted as u64);
        }
    }

    /// A record of the chain where it has come `t` m beyond its last interface, to `p`; `back`: unit, the way it came.
    pub(super) fn record(&self, p: Vec3, back: Vec3, t: f32, flux: f32) -> Record {
        Record {
            p,
            n: back,
            dir: back,
            reach: [t, t + self.previous],
            length: t + self.apparent.map_or(self.length, |a| a.distance),
            aside: self.apparent.map(|a| a.aside),
            signature: self.signature.bits(0),
            class: self.class.bits(0),
            radius: self.radius,
            flux,
            strength: self.strength,
            of_zone: false,
        }
    }
}

impl Finds {
    /// Weigh the recorded arrivals by how often their signatures are recorded.
    pub(super) fn weigh(&mut self) {
        let mut counts: HashMap<u32, u32> = HashMap::new();
        for r in &self.records {
            *counts.entry(r.signature).or_default() += 1;
        }
        for i in &mut self.incidences {
            if let Some(signature) = i.recorded {
                let often = counts.get(&signature).is_some_and(|n| *n >= SELDOM);
                i.flux *= if often { RECORDED } else { 1.0 };
            }
        }
    }

    /// An arrival at `s` of `flux` (luminance) from `source` after `bounce` scatterings.
    fn arrival(&mut self, s: &Surface, source: &Source, bounce: u32, flux: f32) {
        let n = s.facing();
        let recorded = self.record(s, source, bounce > 0, flux).then(|| source.signature.bits(0));
        let weight = match recorded {
            Some(_) => 1.0,
            None if source.known && source.length > 0.0 => SPOTTED,
            None => 1.0,
        };
        self.incidences.push(Incidence { p: s.p, n, dir: s.wo, flux: weight * flux, recorded });
    }

    /// A record of it alone, of a bright zone or of a luminaire; not where the source is unknown or looks large.
    pub(super) fn record(&mut self, s: &Surface, source: &Source, of_zone: bool, flux: f32) -> bool {
        let recorded = source.known && source.radius < LARGE * (s.t + source.length);
        if recorded {
            let record = Record { n: s.facing(), of_zone, ..source.record(s.p, s.wo, s.t, flux) };
            self.exact.entry(record.signature).or_insert(source.exact);
            let to = if of_zone { &mut self.zone_records } else { &mut self.records };
            to.push(record);
        }
        recorded
    }
}

/// Part of the radiance that a specular interface sends the way a particle took.
fn kept_by(bsdf: &Bsdf, wo: Vec3, transmitted: bool) -> f32 {
    bsdf.branches(wo, Quantity::Flux)
        .filter(|b| (b.wi.z * wo.z < 0.0) == transmitted)
        .map(|b| b.weight.luminance())
        .sum::<f32>()
        .min(1.0)
}

#[inline]
fn add(sum: &mut [f64; 3], v: Rgb) {
    (0..3).for_each(|c| sum[c] += v[c] as f64);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrivals_weigh_less_where_their_signature_is_recorded_often() {
        let record = |signature: u32| Record {
            p: Vec3::ZERO,
            n: Vec3::Z,
            dir: Vec3::Z,
            reach: [1.0; 2],
            length: 1.0,
            aside: None,
            signature,
            class: 0,
            radius: 0.01,
            flux: 1.0,
            strength: 1.0,
            of_zone: false,
        };
        let incidence = |recorded| Incidence { p: Vec3::ZERO, n: Vec3::Z, dir: Vec3::Z, flux: 2.0, recorded };
        let mut finds = Finds {
            records: (0..SELDOM).map(|_| record(5)).chain([record(6)]).collect(),
            incidences: vec![incidence(Some(5)), incidence(Some(6)), incidence(None)],
            ..Finds::default()
        };
        finds.weigh();
        let fluxes: Vec<f32> = finds.incidences.iter().map(|i| i.flux).collect();
        assert_eq!(fluxes, [2.0 * RECORDED, 2.0, 2.0]);
    }
}
