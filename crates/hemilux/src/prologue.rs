//! The prologue of a picture: particles, and more of them where gathers are surprised.
//!
//! What particles have not found, gathers find by chance, and say so (*surprise*: [`Renderer::surprise`]). A pilot of gathers all over the
//! picture measures it; beyond [`SURPRISED`] the particles are doubled, emission is aimed anew, and the pilot repeated, as long
//! as that helps and the limits allow. Pilots are thrown away: what they decide shapes no value.
//!
//! Invariants: without a limit of time all this is a function of scene, size of the picture, options and seed, whatever part of
//! the picture is rendered; in any case the solution is that of [`Zones::solve`] with the same plan, traced to the same number of
//! particles, so a film that names this number can be gone on with.

use crate::gather::Strategy;
use crate::render::{Mode, RenderOptions, Renderer};
use crate::transport::Residual;
use crate::world::World;
use crate::zones::sight::Sight;
use crate::zones::{Making, ZoneOptions, Zones};
use std::time::Instant;

/// Surprise beyond this share is too much.
pub const SURPRISED: f64 = 0.03;
/// Camera samples of a pilot.
pub const PILOT: usize = 2048;
/// Particles are not doubled again where the last doubling left more than this of the surprise.
const HELPED: f64 = 0.9;
/// With a limit of time the pilot comes after this part of the particles' time: a solution of few particles is made fast, ...
const EARLY: f64 = 1.0 / 3.0;
/// ... but not before there are so many.
const FEWEST: u64 = 1 << 17;

/// How far particles may grow.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Particles, where surprise asks for more; `None`: nobody asks.
    pub most: Option<u64>,
    /// When they end, and when they do where surprise asks for more.
    pub deadlines: Option<[Instant; 2]>,
}

/// Particles on the way, for those who watch and may stop them.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    /// So many there are, ...
    pub particles: u64,
    /// ... so many are to be.
    pub total: u64,
    /// When they began and have to end.
    pub time: Option<[Instant; 2]>,
}

/// What a pilot saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// With so many particles ...
    pub particles: u64,
    /// ... this share of the luminance was not expected.
    pub surprise: f64,
}

/// A solution and how it came about.
pub struct Prologue {
    /// The solution.
    pub zones: Zones,
    /// What pilots saw, in order.
    pub seen: Vec<Seen>,
}

/// Whether gathers of these options are led by particles, so that more of them can help.
pub fn is_led(options: &RenderOptions) -> bool {
    matches!(options.mode, Mode::Zonal | Mode::Corrected) && options.plan.strategy == Strategy::Adaptive
}

/// Solve for a picture of `size` with `options`. `stop` is asked between batches of particles.
pub fn solve(
    world: &World,
    zones: &ZoneOptions,
    (options, size): (RenderOptions, [u32; 2]),
    limits: &Limits,
    stop: impl FnMut(&Leg) -> bool,
) -> Prologue {
    let making = Making::new(world, zones, Some(Sight::of_camera(world)));
    let most = limits.most.filter(|_| is_led(&options));
    let mut work = Work { world, options, size, making, seen: Vec::new(), stop };
    match (limits.deadlines, most) {
        (None, None) => {
            work.trace(zones.particles, None, |_| false);
            work.end()
        }
        (Some(ends), None) => {
            work.trace(zones.particles, Some(ends[0]), |_| false);
            work.end()
        }
        (None, Some(most)) => work.doubled(zones.particles, most),
        (Some(ends), Some(most)) => work.timed(zones.particles, most, ends),
    }
}

/// A prologue under way.
struct Work<'a, Stop> {
    world: &'a World,
    options: RenderOptions,
    size: [u32; 2],
    making: Making<'a>,
    seen: Vec<Seen>,
    stop: Stop,
}

impl<Stop: FnMut(&Leg) -> bool> Work<'_, Stop> {
    /// Trace until there are `total` particles, time is over or there are `enough`; says whether the user stopped it.
    fn trace(&mut self, total: u64, end: Option<Instant>, enough: impl Fn(u64) -> bool) -> bool {
        let time = end.map(|end| [Instant::now(), end]);
        let (stop, mut stopped) = (&mut self.stop, false);
        self.making.trace(total, |particles| {
            stopped |= stop(&Leg { particles, total, time });
            // A solution without any particle would be a black one.
            let late = particles > 0 && end.is_some_and(|end| Instant::now() >= end);
            stopped || late || enough(particles)
        });
        stopped
    }

    /// The solution so far, and how much of a pilot it did not expect.
    fn look(&mut self) -> (Zones, f64) {
        let zones = self.making.solution();
        let [width, height] = self.size;
        let pilot = Renderer::new(self.world, Some(&zones), width, height, self.options);
        let surprise = pilot.with_residual(Residual::NONE).pilot_surprise(PILOT);
        self.seen.push(Seen { particles: self.making.particles(), surprise });
        (zones, surprise)
    }

    fn end(self) -> Prologue {
        Prologue { zones: self.making.finish(), seen: self.seen }
    }

    /// `planned` particles, doubled while that helps and there are fewer than `most`.
    fn doubled(mut self, planned: u64, most: u64) -> Prologue {
        if self.trace(planned, None, |_| false) || planned >= most {
            return self.end();
        }
        loop {
            let before = self.seen.last().map(|s| s.surprise);
            let (zones, surprise) = self.look();
            let helped = before.is_none_or(|b| surprise < HELPED * b);
            let traced = self.making.particles();
            if surprise <= SURPRISED || !helped || traced >= most {
                return Prologue { zones, seen: self.seen };
            }
            drop(zones);
            if self.trace(traced.saturating_mul(2).min(most), None, |_| false) {
                return self.end();
            }
        }
    }

    /// Particles until the first of `ends`, or where a pilot on the way was surprised until the second or until there are `most`,
    /// whichever comes first.
    fn timed(mut self, planned: u64, most: u64, ends: [Instant; 2]) -> Prologue {
        let now = Instant::now();
        let early = now + ends[0].saturating_duration_since(now).mul_f64(EARLY);
        let enough = |n: u64| n >= FEWEST && Instant::now() >= early;
        let stopped = self.trace(planned, Some(ends[0]), enough);
        if stopped || Instant::now() >= ends[0] || self.making.particles() >= planned {
            return self.end();
        }
        let (_, surprise) = self.look();
        if surprise <= SURPRISED {
            self.trace(planned, Some(ends[0]), |_| false);
        } else {
            self.trace(planned, Some(ends[1]), |n| n >= most && Instant::now() >= ends[0]);
        }
        self.end()
    }
}
