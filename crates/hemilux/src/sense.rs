//! Readings of sensors with an interval: irradiance at a point, or radiance along a direction.
//!
//! A reading is the mean of independent groups, each with random numbers of its own (and, over zones, a zonal solution of
//! its own). The half-width is Student's at 95 % over the groups, widened where gathers are skewed (`sense/moments.rs`). Work comes in stages (`sense/stopping.rs`): pilots decide how
//! much the target needs, fresh numbers make the answer, and only the last stage is reported, so what decided to stop hardly
//! shapes value and interval (C. Stein 1945; D. Kirk and J. Arvo 1991). Where mirrors or glass may hide small bright images that
//! too few rays have met, the half-width also holds what those could add: by the rule of three where nothing leads rays to them, and where
//! light particles do by what fresh ones say of what is hardly looked for ([`crate::zones::witness`]), in the mean over the light of the
//! scene. The image of a sun could hide so well that the former never ends; then scouts ([`crate::zones::scouts`]) look for it: what they have found elsewhere is searched
//! for at the sensor, what they have not found is bounded by its flux. Over zones the value is **biased by the zones**
//! (averaged over as many independent solutions as there are groups), and the reading estimates that bias beside its noise;
//! continued as paths, or with residuals, it is unbiased.

use crate::gather::{GatherPlan, Strategy};
use crate::residual::{PAIR_SHARE, Pair, Study};
use crate::sampler::Sampler;
use crate::sensor::irradiance;
use crate::transport::{Arrival, Residual, Start, Tally, Walker};
use crate::world::World;
use crate::zones::Zones;
use crate::zones::scouts::Scouts;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::points::Key;
use hemiquad::student_975;
use moments::Moments;
use rayon::prelude::*;
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use stopping::{Aim, PILOT, Spread, Stage};

mod moments;
mod stopping;

/// Independent groups behind every interval.
pub const GROUPS: usize = 16;
/// Student's 95 % quantile on one side for 15 degrees of freedom.
const ONE_SIDED_15: f64 = 1.7531;
/// The work of one gather.
const PLAN: GatherPlan = GatherPlan { rays: 64, shadow_rays: 16, strategy: Strategy::Adaptive };
/// Hits on virtual luminaires from which on their spread is trusted.
const ENOUGH_HITS: u64 = 16;
/// Images this many times dimmer than the brightest luminaire are not watched for.
const DIM: f64 = 16.0;
/// What single-precision arithmetic may be off by, relative to the value, where there is no noise to show it.
const ROUNDING: f64 = 2e-6;
/// Pairs per group behind an estimated bias, at most.
const MOST_PAIRS: u32 = 64;
/// Gathers per group behind a surprise, at most.
const MOST_LOOKED: u32 = 128;
/// Share of the gather rays of such a pair that carry a residual.
const BIAS_SHARE: f32 = 0.5;

/// Scouts are sent where an unseen image could hold this many times what a pilot has read.
const HOPELESS: f64 = 100.0;
/// Scouts.
const SCOUTS: u64 = 1 << 20;
/// What they leave unsaid is to be below this part of the target.
const SAID: f64 = 0.1;
/// Rays that look for each image that scouts have found, at least, and for all of them together, at most.
const LOOK: [f64; 2] = [1e3, 4e6];
/// Images that are looked for one by one; where there are more, nothing is concluded.
const MOST_IMAGES: usize = 256;
/// A sensor that nobody has chosen for it gets more than this many times its share of some flux with a probability below 5 %
/// (Markov's inequality).
const SHARES: f64 = 20.0;

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receiver {
    /// Irradiance on the side of the normal (W·m⁻²).
    Irradiance,
    /// Radiance that arrives from the direction of the "normal" (W·sr⁻¹·m⁻²).
    Radiance,
}

/// When a reading is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// 95 % half-width relative to the value.
    RelativeError(f64),
    /// This many gathers in all (rounded up to whole groups).
    Gathers(u64),
    /// This long.
    Time(Duration),
}

/// How sensors are read.
#[derive(Clone, Copy, Debug)]
pub struct SenseOptions {
    /// What is measured.
    pub receiver: Receiver,
    /// When to stop.
    pub goal: Goal,
    /// Most time for one sensor.
    pub limit: Duration,
    /// Seed.
    pub seed: u64,
    /// Weights of the bands in the scalar that the interval is about (lux: efficacy times luminance weights).
    pub weights: [f64; 3],
}

/// One reading.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Value per band (W·m⁻² or W·sr⁻¹·m⁻²).
    pub value: Rgb,
    /// The weighted scalar.
    pub scalar: f64,
    /// 95 % half-width of the scalar: Student over [`GROUPS`] groups, widened where gathers are skewed, and by `unseen`.
    pub half_width: f64,
    /// The part of `half_width` for virtual luminaires that too few rays have met to judge by spread.
    pub unseen: f64,
    /// Gathers behind the value (pilots not counted).
    pub gathers: u64,
    /// Rays traced, pilots included.
    pub rays: u64,
    /// Share of the luminance gathered at the sensor that came as surprise ([`Tally::surprise`]), by gathers whose rays end on zones
    /// where there are any: what paths meet by chance behind the first ray is noise, and says nothing of the strata at the sensor.
    /// `None` where nothing was gathered: in the dark, or where one ray is followed ([`Receiver::Radiance`]).
    pub surprise: Option<f64>,
    /// Whether the goal was met.
    pub met: bool,
    /// What the zones get wrong (over zones without residuals): not part of `half_width`.
    pub bias: Option<Bias>,
}

/// An estimate of what zones add to a reading: zonal less true.
#[derive(Clone, Copy, Debug)]
pub struct Bias {
    /// The weighted scalar.
    pub scalar: f64,
    /// 95 % half-width of it: Student over [`GROUPS`] groups.
    pub half_width: f64,
}

/// Reads sensors of one world.
pub struct Sense<'a> {
    world: &'a World,
    zones: &'a [Zones],
    options: SenseOptions,
    /// What one unseen hit may be worth (0 where nothing can cast a virtual luminaire).
    caution: f64,
    /// Hits on luminaires at least this bright count: a large dim image must not vouch for a small bright one.
    bright: f32,
    /// Whether residuals take the zones' bias away.
    corrected: bool,
    /// Whether anything scatters diffusely.
    scatters: bool,
    /// What steers gathers that do not end on zones.
    steer: Option<&'a Zones>,
    /// What scouts found, once they were needed; `None` where they cannot tell.
    scouts: OnceLock<Option<Scouts>>,
}

/// What scouts say of virtual luminaires seen from one sensor.
#[derive(Clone, Copy, PartialEq)]
enum Verdict {
    /// They were not asked, or cannot tell.
    None,
    /// Where they have seen images elsewhere, there is one here.
    There,
    /// There is hardly any: a bound on what they bring, in the scalar.
    Below(f64),
}

/// What came to a sensor by a diffuse scattering.
#[derive(Clone, Copy)]
struct Scattered {
    /// Share of the gather rays that go on after one, and may meet virtual luminaires there by chance.
    share: f64,
    /// Part of the reading.
    part: f64,
}

/// Sums of one group: per band, and what it cost and found.
#[derive(Clone, Default)]
struct Group {
    sum: [f64; 3],
    /// Of the scalar, by gathers.
    moments: Moments,
    tally: Tally,
}

/// Half-width of an interval of 95 % around a reading of half-width `student` that lacks up to so much: where it lacks far more than
/// its noise only one side counts.
fn with_lack(student: f64, lacking: f64) -> f64 {
    let both = student_975((GROUPS - 1) as f64);
    let one = ONE_SIDED_15 / both;
    one * student + lacking.hypot((1.0 - one) * student)
}

/// Share of what was gathered that came as surprise; `None` where nothing was.
fn surprise<'t>(tallies: impl Iterator<Item = &'t Tally>) -> Option<f64> {
    let [all, part] = tallies.fold([0.0, 0.0], |s, t| [s[0] + t.gathered, s[1] + t.surprise]);
    (all > 0.0).then(|| part / all)
}

impl<'a> Sense<'a> {
    /// Read over zonal solutions, one per group ([`GROUPS`] of them), or with none: by paths, unbiased.
    pub fn new(world: &'a World, zones: &'a [Zones], options: SenseOptions) -> Sense<'a> {
        let brightest = world.luminaires.brightest(&world.scene, options.weights);
        let each = match options.receiver {
            Receiver::Irradiance => std::f64::consts::PI * brightest,
            Receiver::Radiance => brightest,
        };
        let caution = if world.has_casters() { each } else { 0.0 };
        let luminance = world.luminaires.brightest(&world.scene, [0.2126, 0.7152, 0.0722]);
        Sense {
            world,
            zones,
            options,
            caution,
            bright: (luminance / DIM) as f32,
            corrected: false,
            scatters: world.has_diffuse(),
            steer: None,
            scouts: OnceLock::new(),
        }
    }

    /// The same over zones, with residuals that take their bias away: unbiased, so that one solution serves all groups.
    /// How many gather rays carry one is decided for each sensor by pairs of gathers that are then thrown away.
    pub fn corrected(world: &'a World, zones: &'a [Zones], options: SenseOptions) -> Sense<'a> {
        Sense { corrected: true, ..Sense::new(world, zones, options) }
    }

    /// The same, steered by what the particles of `zones` have found; no value depends on it but by its noise.
    pub fn steered(self, zones: &'a Zones) -> Sense<'a> {
        Sense { steer: Some(zones), ..self }
    }

    /// Share of residuals that pays at a sensor.
    fn residual(&self, index: u64, p: Vec3, n: Vec3) -> Residual {
        if !self.corrected {
            return Residual::NONE;
        }
        let one = |group: usize, gather: u32, residual: Residual| {
            let zones = self.zones.first();
            let walker = Walker { zones, residual, steer: self.steer, ..Walker::path(self.world) };
            let pixel = (index << 16) ^ (0xffu64 << 8) ^ group as u64;
            let mut tally = Tally::default();
            let value = self.estimate(&walker, pixel, gather, p, n, &mut tally).luminance() as f64;
            (if value.is_finite() { value } else { 0.0 }, tally.rays)
        };
        let pairs: Vec<Vec<Pair>> = (0..GROUPS * PILOT as usize)
            .into_par_iter()
            .map(|i| {
                let (group, gather) = (i / PILOT as usize, 2 * (i % PILOT as usize) as u32);
                let (a, zonal_rays) = one(group, gather, Residual::NONE);
                let (b, _) = one(group, gather + 1, Residual::NONE);
                let (corrected, corrected_rays) = one(group, gather, Residual::new(PAIR_SHARE));
                vec![Pair { zonal: [a, b], corrected, zonal_rays, corrected_rays }]
            })
            .collect();
        Residual::new(Study::of(&pairs).share)
    }

    /// The reading of sensor number `index` at `p` (m) facing unit `n`; over zones without residuals, with an estimate of
    /// their bias.
    pub fn read(&self, index: u64, p: Vec3, n: Vec3) -> Reading {
        let reading = self.reading(index, p, n);
        let per_group = reading.gathers / GROUPS as u64;
        if self.zones.is_empty() || self.corrected {
            let Some(zones) = self.steer.or(self.zones.first()) else { return reading };
            let per_group = (per_group / 8).clamp(PILOT as u64, MOST_LOOKED as u64) as u32;
            let (surprise, rays) = self.surprise(zones, index, p, n, per_group);
            return Reading { surprise, rays: reading.rays + rays, ..reading };
        }
        let per_group = (per_group / 4).clamp(PILOT as u64, MOST_PAIRS as u64) as u32;
        let (bias, rays) = self.bias(index, p, n, per_group);
        Reading { bias: Some(bias), rays: reading.rays + rays, ..reading }
    }

    /// How surprised gathers at a sensor are that end on `zones`, by `per_group` of them in each group, thrown away but for that;
    /// and the rays it took.
    fn surprise(&self, zones: &Zones, index: u64, p: Vec3, n: Vec3, per_group: u32) -> (Option<f64>, u64) {
        if self.options.receiver == Receiver::Radiance {
            return (None, 0);
        }
        let walker = Walker { steer: self.steer, ..Walker::zonal(self.world, zones) };
        let one = |group: usize| {
            let pixel = (index << 16) ^ (0xfd << 8) ^ group as u64;
            let mut tally = Tally::default();
            for i in 0..per_group {
                self.estimate(&walker, pixel, i, p, n, &mut tally);
            }
            tally
        };
        let groups: Vec<Tally> = (0..GROUPS).into_par_iter().map(one).collect();
        (surprise(groups.iter()), groups.iter().map(|t| t.rays).sum())
    }

    /// What the zones get wrong at a sensor, by `per_group` pairs of gathers in each group, without and with residuals and else
    /// of the same random numbers; and the rays it took.
    fn bias(&self, index: u64, p: Vec3, n: Vec3, per_group: u32) -> (Bias, u64) {
        let one = |group: usize| {
            let zones = Some(&self.zones[group % self.zones.len()]);
            let zonal = Walker { zones, steer: self.steer, ..Walker::path(self.world) };
            let corrected = Walker { residual: Residual::new(BIAS_SHARE), ..zonal };
            let pixel = (index << 16) ^ (0xfe << 8) ^ group as u64;
            let (mut tally, mut sum) = (Tally::default(), 0.0);
            for i in 0..per_group {
                let mut of = |walker: &Walker| {
                    let value = self.estimate(walker, pixel, i, p, n, &mut tally);
                    let weighted = |c: usize| self.options.weights[c] * value[c] as f64;
                    if value.is_finite() { (0..3).map(weighted).sum() } else { 0.0 }
                };
                sum += of(&zonal) - of(&corrected);
            }
            (sum / per_group as f64, tally.rays)
        };
        let groups: Vec<(f64, u64)> = (0..GROUPS).into_par_iter().map(one).collect();
        let count = GROUPS as f64;
        let scalar = groups.iter().map(|g| g.0).sum::<f64>() / count;
        let squares = groups.iter().map(|g| (g.0 - scalar).powi(2)).sum::<f64>();
        let half_width = student_975(count - 1.0) * (squares / (count - 1.0) / count).sqrt();
        (Bias { scalar, half_width }, groups.iter().map(|g| g.1).sum())
    }

    fn reading(&self, index: u64, p: Vec3, n: Vec3) -> Reading {
        let begin = Instant::now();
        let (limit, mut stage) = match self.options.goal {
            Goal::Gathers(n) => {
                let per_group = n.div_ceil(GROUPS as u64).clamp(1, u32::MAX as u64);
                (self.options.limit, Stage::only(per_group as u32))
            }
            Goal::Time(t) => (t.min(self.options.limit), Stage::pilot()),
            Goal::RelativeError(_) => (self.options.limit, Stage::pilot()),
        };
        let residual = self.residual(index, p, n);
        let (mut rays, mut verdict, mut groups) =
            (0, Verdict::None, std::array::from_fn(|_| Group::default()));
        loop {
            let stage_begin = Instant::now();
            if stage.from == 0 {
                rays += groups.iter().map(|g| g.tally.rays).sum::<u64>();
                groups = std::array::from_fn(|_| Group::default());
            }
            let go_on = |(g, group): (usize, &mut Group)| self.group(index, stage, g, p, n, residual, group);
            groups.par_iter_mut().enumerate().for_each(go_on);
            let took = stage_begin.elapsed();
            let mut reading = self.judge(&groups, stage.to, residual, verdict);
            if stage.number == 0 {
                let hits = groups.iter().map(|g| g.tally.chain_hits).sum();
                if self.unseen_first(PILOT, hits) > HOPELESS * reading.scalar.abs() {
                    verdict = self.verdict(index, p, n, reading.scalar.abs());
                    reading = self.judge(&groups, stage.to, residual, verdict);
                }
            }
            let aim = match self.options.goal {
                Goal::Gathers(_) => Aim::HalfWidth(f64::INFINITY),
                Goal::RelativeError(target) => Aim::HalfWidth(self.wanted(target, reading.scalar)),
                Goal::Time(_) => Aim::Time,
            };
            let left = limit.saturating_sub(begin.elapsed()).as_secs_f64();
            let affordable = left / took.as_secs_f64().max(1e-6) * (stage.to - stage.from) as f64;
            let spread = Spread { student: reading.half_width - reading.unseen, unseen: reading.unseen };
            match stage.next(aim, spread, affordable) {
                Some(next) => stage = next,
                None => {
                    let met = !matches!(aim, Aim::HalfWidth(h) if reading.half_width > h);
                    return Reading { met, rays: rays + reading.rays, ..reading };
                }
            }
        }
    }

    /// The half-width that a relative error asks for. Darkness that every gather of two stages agrees on is an answer, as good as
    /// the scene is bright.
    fn wanted(&self, relative: f64, scalar: f64) -> f64 {
        relative * if scalar == 0.0 { self.level() } else { scalar.abs() }
    }

    /// What groups of so many gathers say.
    fn judge(
        &self,
        groups: &[Group; GROUPS],
        per_group: u32,
        residual: Residual,
        verdict: Verdict,
    ) -> Reading {
        let mut mean = [0f64; 3];
        let mut scalars = [0f64; GROUPS];
        for (g, scalar) in groups.iter().zip(&mut scalars) {
            for ((mean, sum), weight) in mean.iter_mut().zip(g.sum).zip(self.options.weights) {
                let part = sum / per_group as f64;
                *mean += part / GROUPS as f64;
                *scalar += weight * part;
            }
        }
        let scalar = scalars.iter().sum::<f64>() / GROUPS as f64;
        let variance = scalars.iter().map(|s| (s - scalar).powi(2)).sum::<f64>() / (GROUPS - 1) as f64;
        let degrees = (GROUPS - 1) as f64;
        let skewed = groups.iter().fold(Moments::default(), |all, g| all.join(&g.moments)).widening();
        let student = skewed * student_975(degrees) * (variance / GROUPS as f64).sqrt();
        let hits = |of: fn(&Tally) -> u64| groups.iter().map(|g| of(&g.tally)).sum();
        let (first, later) = (hits(|t| t.chain_hits), hits(|t| t.later_hits));
        let scattered = self.scattered(residual, groups);
        let lacking = self.lacking(per_group, [first, later], scattered, scalar.abs(), verdict);
        let unseen = with_lack(student, lacking) - student;
        Reading {
            value: Rgb(mean.map(|v| v as f32)),
            scalar,
            half_width: student + unseen + ROUNDING * scalar.abs(),
            gathers: per_group as u64 * GROUPS as u64,
            unseen,
            rays: groups.iter().map(|g| g.tally.rays).sum(),
            surprise: surprise(groups.iter().map(|g| &g.tally)),
            met: false,
            bias: None,
        }
    }

    /// Gather rays of a stage, and by the rule of three how many hits are compatible with `hits` (fewer than a handful: none is
    /// compatible with a mean of 3; Poisson, 95 %). Infinitely few where their spread says enough.
    fn compatible(&self, per_group: u32, hits: u64) -> f64 {
        let rays = match self.options.receiver {
            Receiver::Irradiance => PLAN.rays as f64,
            Receiver::Radiance => 1.0,
        };
        let k = hits as f64;
        let mean = if hits >= ENOUGH_HITS { 0.0 } else { 3.0 + 2.0 * k.sqrt() };
        mean / (rays * per_group as f64 * GROUPS as f64)
    }

    /// What a sensor that reads about `scalar` may lack of virtual luminaires that were met too seldom, where `hits` on them were met at
    /// the end of the gather rays and behind a diffuse scattering.
    fn lacking(
        &self,
        per_group: u32,
        [hits, later_hits]: [u64; 2],
        scattered: Scattered,
        scalar: f64,
        verdict: Verdict,
    ) -> f64 {
        let mut first = self.unseen_first(per_group, hits);
        if let Verdict::Below(bound) = verdict {
            first = first.min(bound);
        }
        let later = self.unseen_later(per_group, later_hits, scattered.share);
        let steer = self.steer.or(self.zones.first()).filter(|_| self.caution > 0.0);
        let Some(zones) = steer.filter(|_| self.options.receiver == Receiver::Irradiance) else {
            return first + later;
        };
        if first <= 0.0 && scattered.part <= 0.0 {
            return 0.0;
        }
        let witnesses = zones.witnesses(self.world);
        let rays = PLAN.rays as f64 * per_group as f64 * GROUPS as f64;
        // Of light that is read without a share f of it, f / (1 - f) is lacking.
        let of = |light: f64, f: f64| if f < 1.0 { light * f / (1.0 - f) } else { f64::INFINITY };
        let light = if scalar > 0.0 { scalar } else { self.level() };
        // What no witness has seen may be anywhere, in the shade of all other light too.
        let unknown = witnesses.unknown() * self.level();
        if verdict != Verdict::There {
            first = first.min(of(light, witnesses.unseen(rays)) + unknown);
        }
        if scattered.share <= 0.0 {
            return first;
        }
        let by_witnesses =
            of(scattered.part * light, witnesses.unseen_later(rays * scattered.share)) + unknown;
        // Hits on some of what paths meet behind a scattering vouch for nothing: the rest may be met a hundred times as seldom.
        let most = if later > 0.0 { later } else { self.unseen_later(per_group, 0, scattered.share) };
        first + by_witnesses.min(most)
    }

    /// What came by a scattering to gathers of these groups.
    fn scattered(&self, residual: Residual, groups: &[Group; GROUPS]) -> Scattered {
        let sum = |of: fn(&Tally) -> f64| groups.iter().map(|g| of(&g.tally)).sum::<f64>();
        let all = sum(|t| t.gathered);
        let part = if all > 0.0 { (sum(|t| t.scattered) / all).clamp(0.0, 1.0) } else { 1.0 };
        let part = if part > ROUNDING { part } else { 0.0 };
        Scattered { share: self.later(residual).min(1.0), part }
    }

    /// A bound on what virtual luminaires seen from the sensor may add: hits that might have been, each worth up to π times the
    /// brightest radiance.
    fn unseen_first(&self, per_group: u32, hits: u64) -> f64 {
        self.caution * self.compatible(per_group, hits)
    }

    /// The same of virtual luminaires that are seen from elsewhere, by `share` of the gather rays.
    fn unseen_later(&self, per_group: u32, hits: u64, share: f64) -> f64 {
        if share > 0.0 { self.caution * self.compatible(per_group, hits) / share } else { 0.0 }
    }

    /// What scouts say about a sensor that reads about `scalar`.
    fn verdict(&self, index: u64, p: Vec3, n: Vec3, scalar: f64) -> Verdict {
        if self.options.receiver != Receiver::Irradiance || self.steer.is_none() {
            return Verdict::None;
        }
        let seed = self.options.seed;
        let send = || Scouts::send(self.world, SCOUTS, seed, self.bright);
        let Some(scouts) = self.scouts.get_or_init(send).as_ref().filter(|s| s.images.len() <= MOST_IMAGES)
        else {
            return Verdict::None;
        };
        // Irradiance (in the scalar) of an image that fills all of its cone; no luminaire is brighter than this.
        let whole = |part: f64| self.caution * part;
        let seen = scouts.images.iter().filter_map(|i| scouts.part(i, p, n)).collect::<Vec<_>>();
        let largest = seen.iter().map(|s| whole(s.0)).fold(0.0, f64::max);
        let wanted = match self.options.goal {
            Goal::RelativeError(target) => SAID * target * scalar,
            _ => SAID * 0.01 * scalar,
        };
        let most = (LOOK[1] / seen.len().max(1) as f64).max(LOOK[0]);
        let rays = if wanted > 0.0 { (3.0 * largest / wanted).clamp(LOOK[0], most) } else { most } as u64;
        let key = Key::new(seed).with(0x5ee4).with(index);
        for (i, (_, axis, sin2)) in seen.iter().enumerate() {
            // What is there must be met by gather rays, too.
            if scouts.hits(self.world, [p, n], *axis, *sin2, rays, key.with(i as u64)) > 0 {
                return Verdict::There;
            }
        }
        // Of several images none was met: the sum of what they show is what the rule of three leaves one.
        let searched = 3.0 * largest / rays as f64;
        let per_luminance = self.caution / (std::f64::consts::PI * DIM * self.bright as f64);
        let unknown = SHARES * scouts.unsure * per_luminance / scouts.area.max(f64::MIN_POSITIVE);
        Verdict::Below(searched + unknown)
    }

    /// Mean irradiance on the scene's surfaces (in the scalar, or as radiance), as light particles found it; 0 if there were none.
    fn level(&self) -> f64 {
        let Some(zones) = self.steer.or(self.zones.first()) else { return 0.0 };
        let area: f64 = zones.map().areas().iter().map(|a| *a as f64).sum();
        let flux: f64 = zones.ledger.incident.iter().zip(self.options.weights).map(|(f, w)| f * w).sum();
        let per = match self.options.receiver {
            Receiver::Irradiance => 1.0,
            Receiver::Radiance => std::f64::consts::FRAC_1_PI,
        };
        if area > 0.0 { per * flux / area } else { 0.0 }
    }

    /// See [`Scattered::share`]; 0 where zones hold what paths would find or nothing scatters diffusely.
    fn later(&self, residual: Residual) -> f64 {
        match (self.zones.is_empty(), self.corrected) {
            _ if !self.scatters => 0.0,
            (true, _) => 1.0,
            (false, true) => residual.share as f64,
            (false, false) => 0.0,
        }
    }

    /// The gathers of a stage in group `g`.
    #[allow(clippy::too_many_arguments)]
    fn group(
        &self,
        index: u64,
        stage: Stage,
        g: usize,
        p: Vec3,
        n: Vec3,
        residual: Residual,
        group: &mut Group,
    ) {
        let zones = if self.zones.is_empty() { None } else { Some(&self.zones[g % self.zones.len()]) };
        let walker = Walker { zones, residual, steer: self.steer, ..Walker::path(self.world) };
        // Sobol' points continue over the gathers of a group: one long, well-spread set per group.
        let pixel = (index << 16) ^ ((stage.number as u64) << 8) ^ g as u64;
        group.tally.bright = self.bright;
        for i in stage.from..stage.to {
            let value = self.estimate(&walker, pixel, i, p, n, &mut group.tally);
            let value = if value.is_finite() { value.0.map(|v| v as f64) } else { [0.0; 3] };
            (0..3).for_each(|c| group.sum[c] += value[c]);
            group.moments.add((0..3).map(|c| self.options.weights[c] * value[c]).sum());
        }
    }

    /// One gather.
    fn estimate(&self, walker: &Walker, pixel: u64, gather: u32, p: Vec3, n: Vec3, tally: &mut Tally) -> Rgb {
        let mut sampler = Sampler::new(self.options.seed ^ 0x5e_75e0, pixel, gather);
        match self.options.receiver {
            Receiver::Irradiance => irradiance(walker, p, n, &PLAN, &mut sampler, tally),
            Receiver::Radiance => {
                let start = Start { origin: p, dir: n, arrival: Arrival::Full, depth: 0, worth: 0.0 };
                walker.field_radiance(start, &mut sampler, tally)
            }
        }
    }
}
