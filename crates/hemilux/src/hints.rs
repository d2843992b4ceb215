//! Hints at work: what a user knows of a scene as strata and shares ([`hemilux_scene::hints`] reads them).
//!
//! - Casters, regions and cones give every gather strata of their own ([`Looks`]) in its balance heuristic.
//! - Casters and luminaires give light particles starting numbers of their own ([`Hints::start`]), a mixture with those that
//!   nobody hinted at. Towards a caster they are learnt by the emission alone, without tracing: the ball around the caster
//!   is first enlarged so that random starts find it, and shrinks while the tree of starts follows (the shrinking luminaires
//!   of P. Shirley and K. Chiu 1994, section 4, in the space of starting numbers).
//! - Luminaires take a share of the shadow rays ([`crate::world::luminaire`]).
//! - Windows of the image take more camera samples per pass.
//! - A criterion replaces that of strategies that have one.
//!
//! Invariants: all of it is sampling by known densities, weighted by the mixture, so no mean depends on a hint; shares of
//! particles and shadow rays are at most [`MOST_SHARE`] in all, so no hint can starve the rest.

use crate::world::luminaire::Receiver;
use crate::world::{World, emitter_points::shape_ball};
use crate::zones::aim::{Aim, Start, Trial};
use crate::zones::records::direction_in_cone;
use hemilux_scene::geom::{DAffine3, Vec3};
use hemilux_scene::hints as given;
pub use hemilux_scene::hints::{Ball, CriterionHint};
use hemiquad::points::Key;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest share of the particles, or of the shadow rays, that all hints take together; larger ones are scaled down.
pub const MOST_SHARE: f32 = 0.5;
/// Strata that hints give to one gather at most; those that come later in the file are left out.
pub const MOST_LOOKS: usize = 16;
/// Balls that stand for one caster in gathers; more shapes than that are one ball.
const MOST_BALLS: usize = 4;
/// A ball that fills more of the sky than this (sine of the half-angle) is no place to look.
const WIDEST: f32 = 0.95;

/// Where a stratum of gathers looks.
#[derive(Clone, Copy, Debug)]
enum Aimed {
    /// Towards a ball.
    At(Ball),
    /// Along a direction: unit axis and 1 − cos of the half-angle, from points in a ball (or anywhere).
    Along(Vec3, f32, Option<Ball>),
}

/// A stratum of gathers.
#[derive(Clone, Copy, Debug)]
struct Look {
    aimed: Aimed,
    /// Rays as a share of the gather's.
    rays: f32,
    /// Whose.
    hint: u16,
}

/// Where particles of a hint start.
#[derive(Clone, Debug)]
enum Starts {
    /// In boxes that lead to a caster.
    Boxes(Aim),
    /// With picks in these intervals.
    Picks(Vec<[f64; 2]>),
}

/// A share of the particles.
#[derive(Clone, Debug)]
struct Aimers {
    share: f32,
    starts: Starts,
    hint: u16,
}

/// What became of a hint.
#[derive(Debug, Default)]
struct Use {
    /// Gather rays, and the luminance that they brought.
    rays: AtomicU64,
    brought: AtomicU64,
    /// Particles that it sent, and those of them that met the caster first.
    sent: AtomicU64,
    met: AtomicU64,
    /// Particles that it did not send and that met it all the same.
    met_anyway: AtomicU64,
}

/// What kind of hint it is.
#[derive(Clone, Debug, PartialEq)]
pub enum HintKind {
    /// A caster of this name.
    Caster(String),
    /// A luminaire of this name.
    Luminaire(String),
    /// A region.
    Region,
    /// A cone.
    Cone,
}

#[derive(Debug)]
struct Hint {
    kind: HintKind,
    /// Shapes of a caster: group and number.
    shapes: Vec<(u32, u32)>,
    /// Share of the shadow rays of a luminaire, as scaled down.
    shadow_share: f32,
    used: Use,
}

/// What one hint changed so far.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which.
    pub kind: HintKind,
    /// Gather rays that it asked for.
    pub rays: u64,
    /// Part that they brought of the luminance of all gathers that had strata of hints.
    pub brought: f64,
    /// Share of the particles, as scaled down.
    pub particle_share: f32,
    /// Share of the shadow rays, as scaled down.
    pub shadow_share: f32,
    /// Particles that it sent.
    pub sent: u64,
    /// Those of them that met the caster first.
    pub met: u64,
    /// Particles that met the caster first without having been sent.
    pub met_anyway: u64,
    /// Particles that it did not send.
    pub others: u64,
}

/// All hints about a world.
#[derive(Debug, Default)]
pub struct Hints {
    looks: Vec<Look>,
    aimers: Vec<Aimers>,
    list: Vec<Hint>,
    windows: Vec<given::ImageHint>,
    criterion: Option<CriterionHint>,
    hash: Option<u64>,
    /// Luminance of the gathers that had strata of hints, and its unit.
    gathered: AtomicU64,
    unit: f64,
    particles: AtomicU64,
}

impl Hints {
    /// Prepare hints about `world`.
    pub fn new(world: &World, given: &given::Hints) -> Hints {
        let power = world.luminaires.power();
        let mut all = Hints {
            criterion: given.criterion,
            windows: given.image.clone(),
            hash: Some(given.hash),
            unit: if power > 0.0 { (1u64 << 30) as f64 / power } else { 1.0 },
            ..Hints::default()
        };
        let shares =
            given.casters.iter().map(|c| c.particles).chain(given.luminaires.iter().map(|l| l.particles));
        let scale = (MOST_SHARE / shares.sum::<f32>()).min(1.0);
        for (i, caster) in given.casters.iter().enumerate() {
            let balls = balls(world, &caster.shapes);
            let shapes = caster.shapes.iter().map(|s| (s.object.map_or(0, |o| o + 1), s.shape)).collect();
            let hint = all.push(HintKind::Caster(caster.name.clone()), shapes);
            let key = Key::new(0x41_17_5e_ed).with(i as u64);
            let share = scale * caster.particles;
            if share > 0.0
                && let Some(aim) = aim_at(world, &balls, key)
            {
                all.aimers.push(Aimers { share, starts: Starts::Boxes(aim), hint });
            }
            let looked_at = if balls.len() > MOST_BALLS { vec![around(&balls)] } else { balls };
            let rays = caster.rays / looked_at.len().max(1) as f32;
            all.looks.extend(looked_at.into_iter().map(|b| Look { aimed: Aimed::At(b), rays, hint }));
        }
        let asked: f32 = given.luminaires.iter().map(|l| l.shadow_rays).sum();
        for luminaire in &given.luminaires {
            let hint = all.push(HintKind::Luminaire(luminaire.name.clone()), Vec::new());
            all.list[hint as usize].shadow_share = (MOST_SHARE / asked).min(1.0) * luminaire.shadow_rays;
            let picks = world.luminaires.intervals(world, &luminaire.shapes, &luminaire.environments);
            let share = scale * luminaire.particles;
            if share > 0.0 && !picks.is_empty() {
                all.aimers.push(Aimers { share, starts: Starts::Picks(picks), hint });
            }
        }
        for region in &given.regions {
            let hint = all.push(HintKind::Region, Vec::new());
            all.looks.push(Look { aimed: Aimed::At(region.ball), rays: region.rays, hint });
        }
        for cone in &given.cones {
            let hint = all.push(HintKind::Cone, Vec::new());
            let height = 2.0 * (0.5 * cone.half_angle).sin().powi(2);
            let aimed = Aimed::Along(cone.axis, height.max(1e-12), cone.within);
            all.looks.push(Look { aimed, rays: cone.rays, hint });
        }
        all.looks.retain(|l| l.rays > 0.0);
        all
    }

    fn push(&mut self, kind: HintKind, shapes: Vec<(u32, u32)>) -> u16 {
        self.list.push(Hint { kind, shapes, shadow_share: 0.0, used: Use::default() });
        (self.list.len() - 1) as u16
    }

    /// Hash of the file they came from; `None` without hints.
    pub fn hash(&self) -> Option<u64> {
        self.hash
    }

    /// The criterion of strategies that have one.
    pub fn criterion(&self) -> Option<CriterionHint> {
        self.criterion
    }

    /// Camera samples per pass of a pixel at (x, y), whose centre decides, of a picture of `size`.
    pub fn samples(&self, x: u32, y: u32, size: [u32; 2]) -> u32 {
        let at = |v: u32, n: u32| (v as f32 + 0.5) / n as f32;
        let (x, y) = (at(x, size[0]), at(y, size[1]));
        let inside = |w: &&given::ImageHint| {
            let [x0, x1, y0, y1] = w.window;
            x0 <= x && x < x1 && y0 <= y && y < y1
        };
        self.windows.iter().filter(inside).map(|w| w.samples).max().unwrap_or(1)
    }

    /// Where a particle starts that the numbers `u` and `which` were drawn for, the density there over that of even
    /// numbers, and which hint sent it. `plain` is what particles do without hints.
    pub fn start(&self, plain: &Aim, u: Start, which: impl FnOnce() -> f32) -> (Start, f32, Option<u16>) {
        if self.aimers.is_empty() {
            let (start, density) = plain.start(u);
            return (start, density, None);
        }
        let mut left = which();
        let chosen = self.aimers.iter().find(|a| {
            left -= a.share;
            left < 0.0
        });
        let start = chosen.map_or_else(|| plain.start(u).0, |a| a.starts.start(u));
        let shared: f32 = self.aimers.iter().map(|a| a.share).sum();
        let hinted: f32 = self.aimers.iter().map(|a| a.share * a.starts.density(&start)).sum();
        (start, (1.0 - shared) * plain.density(&start) + hinted, chosen.map(|a| a.hint))
    }

    /// Whether [`Hints::note_particle`] wants to know.
    pub fn counts_particles(&self) -> bool {
        !self.aimers.is_empty()
    }

    /// A particle that `sender` sent first met a shape of a group.
    pub fn note_particle(&self, sender: Option<u16>, met: Option<(u32, u32)>) {
        let add = |counter: &AtomicU64| {
            counter.fetch_add(1, Ordering::Relaxed);
        };
        add(&self.particles);
        for (i, hint) in self.list.iter().enumerate() {
            let mine = sender == Some(i as u16);
            let hit = met.is_some_and(|m| hint.shapes.contains(&m));
            if mine {
                add(&hint.used.sent);
            }
            if hit {
                add(if mine { &hint.used.met } else { &hint.used.met_anyway });
            }
        }
    }

    /// A gather of `whole` luminance is over.
    pub fn note_gather(&self, whole: f32) {
        self.gathered.fetch_add((whole.max(0.0) as f64 * self.unit) as u64, Ordering::Relaxed);
    }

    /// `rays` rays of a stratum brought `luminance`.
    pub fn note_look(&self, cone: &LookCone, rays: u32, luminance: f32) {
        let used = &self.list[cone.hint as usize].used;
        used.rays.fetch_add(rays as u64, Ordering::Relaxed);
        used.brought.fetch_add((luminance.max(0.0) as f64 * self.unit) as u64, Ordering::Relaxed);
    }

    /// What each hint changed so far, in the order casters, luminaires, regions, cones.
    pub fn outcomes(&self) -> Vec<Outcome> {
        let get = |c: &AtomicU64| c.load(Ordering::Relaxed);
        let gathered = get(&self.gathered).max(1) as f64;
        let outcome = |(i, hint): (usize, &Hint)| {
            let sent = get(&hint.used.sent);
            Outcome {
                kind: hint.kind.clone(),
                rays: get(&hint.used.rays),
                brought: get(&hint.used.brought) as f64 / gathered,
                particle_share: self.aimers.iter().find(|a| a.hint == i as u16).map_or(0.0, |a| a.share),
                shadow_share: hint.shadow_share,
                sent,
                met: get(&hint.used.met),
                met_anyway: get(&hint.used.met_anyway),
                others: get(&self.particles) - sent,
            }
        };
        self.list.iter().enumerate().map(outcome).collect()
    }

    /// The strata at a point that receives as `at`, for a gather of `rays` rays.
    #[inline]
    pub fn looks(&self, at: &Receiver, rays: u32) -> Looks {
        let mut looks = Looks::default();
        for look in &self.looks {
            if looks.count == MOST_LOOKS {
                break;
            }
            if let Some((axis, height)) = look.cone(at) {
                let rays = ((look.rays * rays as f32).round() as u32).max(1);
                looks.cones[looks.count] = LookCone { axis, height, rays, hint: look.hint };
                looks.count += 1;
            }
        }
        looks
    }
}

impl Look {
    /// The cone at a point: axis, 1 − cos of the half-angle.
    fn cone(&self, at: &Receiver) -> Option<(Vec3, f32)> {
        match self.aimed {
            Aimed::Along(axis, height, within) => {
                let inside = within.is_none_or(|b| (at.p - b.centre).length_squared() <= b.radius * b.radius);
                inside.then_some((axis, height))
            }
            Aimed::At(ball) => {
                let to = ball.centre - at.p;
                let distance = to.length();
                let sin = ball.radius / distance;
                if sin.is_nan() || sin >= WIDEST || (at.is_one_sided() && to.dot(at.n) <= -ball.radius) {
                    return None;
                }
                let height = sin * sin / (1.0 + (1.0 - sin * sin).sqrt());
                // A little wider, for rounding.
                Some((to / distance, (height * 1.0001).max(1e-12)))
            }
        }
    }
}

/// One stratum of one gather.
#[derive(Clone, Copy, Debug, Default)]
pub struct LookCone {
    axis: Vec3,
    height: f32,
    /// Gather rays in it.
    pub rays: u32,
    hint: u16,
}

impl LookCone {
    /// A direction, even over the cone.
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        direction_in_cone(self.axis, self.height, u)
    }

    /// Unit axis and 1 − cos of the half-angle.
    pub fn shape(&self) -> (Vec3, f32) {
        (self.axis, self.height)
    }
}

/// The strata of one gather.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    cones: [LookCone; MOST_LOOKS],
    count: usize,
}

impl Looks {
    /// The strata.
    pub fn cones(&self) -> &[LookCone] {
        &self.cones[..self.count]
    }

    /// Rays times density per steradian at unit `w`, over all strata.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        self.cones()
            .iter()
            // 1 − cos by the chord, which keeps its digits for small angles.
            .filter(|c| 0.5 * (w - c.axis).length_squared() <= c.height * 1.000_01)
            .map(|c| c.rays as f32 / (2.0 * PI * c.height))
            .sum()
    }
}

impl Starts {
    fn start(&self, u: Start) -> Start {
        match self {
            Starts::Boxes(aim) => aim.start(u).0,
            Starts::Picks(intervals) => {
                let all: f64 = intervals.iter().map(|i| i[1] - i[0]).sum();
                let mut left = u[0] as f64 * all;
                for [low, high] in intervals {
                    if left < high - low {
                        return [(low + left) as f32, u[1], u[2], u[3], u[4]];
                    }
                    left -= high - low;
                }
                let last = intervals.last().map_or(u[0] as f64, |i| i[0]);
                [last as f32, u[1], u[2], u[3], u[4]]
            }
        }
    }

    fn density(&self, start: &Start) -> f32 {
        match self {
            Starts::Boxes(aim) => aim.density(start),
            Starts::Picks(intervals) => {
                let all: f64 = intervals.iter().map(|i| i[1] - i[0]).sum();
                let u = start[0] as f64;
                let inside = intervals.iter().any(|[low, high]| *low <= u && u < *high);
                if inside { (1.0 / all) as f32 } else { 0.0 }
            }
        }
    }
}

/// Balls around shapes, instances one by one.
fn balls(world: &World, shapes: &[given::ShapeRef]) -> Vec<Ball> {
    let mut found = Vec::new();
    let mut add = |group: u32, shape: u32, to_world: &DAffine3| {
        let geometry = &world.groups[group as usize].shapes[shape as usize].geometry;
        let (centre, radius) = shape_ball(world, geometry, to_world);
        if radius > 0.0 {
            found.push(Ball { centre: centre.as_vec3(), radius });
        }
    };
    for s in shapes {
        match s.object {
            None => add(0, s.shape, &DAffine3::IDENTITY),
            Some(o) => {
                let placed = world.placements.iter().filter(|p| p.group == o + 1);
                placed.for_each(|p| add(o + 1, s.shape, &p.to_world));
            }
        }
    }
    found
}

/// A ball around balls.
fn around(balls: &[Ball]) -> Ball {
    let low = balls.iter().fold(Vec3::INFINITY, |m, b| m.min(b.centre - b.radius));
    let high = balls.iter().fold(Vec3::NEG_INFINITY, |m, b| m.max(b.centre + b.radius));
    let centre = (low + high) * 0.5;
    let radius = balls.iter().map(|b| (b.centre - centre).length() + b.radius).fold(0.0, f32::max);
    Ball { centre, radius }
}

/// Starting numbers that are tried in each round.
const TRIALS: u64 = 1 << 15;
/// Cuts of the tree of starts: small casters far away are small boxes.
const DEEPEST: u32 = 48;
/// What is left of the enlargement from round to round.
const SHRINK: f32 = 0.3;
/// Rounds at the true size.
const LAST_ROUNDS: u32 = 3;
/// Balls beyond this number are one.
const MOST_TARGETS: usize = 64;

/// Starting numbers whose particles fly towards the balls; `None` where no luminaire shines there.
fn aim_at(world: &World, balls: &[Ball], key: Key) -> Option<Aim> {
    if balls.is_empty() || world.luminaires.is_empty() {
        return None;
    }
    let one = [around(balls)];
    let balls = if balls.len() > MOST_TARGETS { &one } else { balls };
    let smallest = balls.iter().map(|b| b.radius).fold(f32::INFINITY, f32::min);
    let mut larger = 0.25 * world.bound().1;
    let mut aim = Aim::default();
    let mut last = LAST_ROUNDS;
    for round in 0..64u64 {
        larger = if larger > 0.3 * smallest { larger } else { 0.0 };
        let trial = |i: u64| {
            let numbers = key.with(round).with(i);
            let u = [0, 1, 2, 3, 4].map(|d| numbers.uniform(d));
            let (start, _) = aim.start(u);
            let [pick, p0, p1, d0, d1] = start;
            let emitted = world.luminaires.emit(&world.scene, pick, [p0, p1], [d0, d1]);
            let hits = emitted.is_some_and(|e| {
                !e.flux.is_black()
                    && balls.iter().any(|b| meets(e.origin, e.dir, b.centre, b.radius + larger))
            });
            Trial { start, use_: hits as u32 as f32 }
        };
        let trials: Vec<Trial> = (0..TRIALS).into_par_iter().map(trial).collect();
        if !trials.iter().any(|t| t.use_ > 0.0) {
            return None;
        }
        aim = aim.refined(trials, DEEPEST);
        last -= (larger == 0.0) as u32;
        if last == 0 {
            break;
        }
        larger *= SHRINK;
    }
    Some(aim)
}

/// Whether a ray meets a ball, whatever stands between.
fn meets(origin: Vec3, dir: Vec3, centre: Vec3, radius: f32) -> bool {
    let to = centre - origin;
    let along = to.dot(dir);
    (along > 0.0 && (to - dir * along).length_squared() <= radius * radius)
        || to.length_squared() <= radius * radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_sample_their_cones_evenly() {
        let look = |height| LookCone { axis: Vec3::new(0.6, 0.0, 0.8), height, rays: 3, hint: 0 };
        for height in [1e-8, 0.01, 1.0, 2.0] {
            let mut looks = Looks::default();
            (looks.cones[0], looks.count) = (look(height), 1);
            let key = Key::new(1);
            for i in 0..1000 {
                let u = key.uniform2(i);
                // Not at the very rim, where single precision decides.
                let w = looks.cones()[0].sample([0.998 * u.u, u.v]);
                assert!((looks.density(w) * 2.0 * PI * height / 3.0 - 1.0).abs() < 1e-5, "{height}: {w}");
            }
        }
        assert_eq!(Looks::default().density(Vec3::X), 0.0);
    }

    #[test]
    fn picks_start_within_their_intervals() {
        let starts = Starts::Picks(vec![[0.125, 0.25], [0.5, 0.875]]);
        let key = Key::new(2);
        let mut first = 0;
        for i in 0..4000 {
            let u = [0, 1, 2, 3, 4].map(|d| key.with(i).uniform(d));
            let start = starts.start(u);
            assert_eq!(starts.density(&start), 2.0);
            first += (start[0] < 0.25) as u32;
        }
        assert!((first as f64 - 1000.0).abs() < 130.0, "{first}");
        assert_eq!(starts.density(&[0.3, 0.0, 0.0, 0.0, 0.0]), 0.0);
    }
}
