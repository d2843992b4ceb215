//! Before the first pass: the zonal solution, read, repeated or made, with more particles where gathers are surprised.

use crate::args::RenderArgs;
use crate::checkpoint;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::machine;
use crate::plan::Plan;
use crate::progress::{Look, Progress, percent};
use crate::values::Size;
use hemilux::checkpoint::ZoneSource;
use hemilux::prologue::{self, Leg, Limits, SURPRISED, Seen};
use hemilux::world::World;
use hemilux::zones::sight::Sight;
use hemilux::zones::{Making, ZoneOptions, Zones};
use std::path::Path;
use std::time::{Duration, Instant};

/// What the stages of a render share.
pub struct Work<'a> {
    /// As typed.
    pub args: &'a RenderArgs,
    /// As meant.
    pub plan: &'a Plan,
    /// The scene.
    pub world: &'a World,
    /// When the program started.
    pub begin: Instant,
    /// What is kept free for writing.
    pub writing: Duration,
}

impl Work<'_> {
    /// The solution, and what pilots of it saw. `resumed`: a film to go on from, and how its solution came about.
    pub fn zonal_solution(
        &self,
        resumed: Option<(&Path, &ZoneSource)>,
        interrupt: &Interrupt,
        progress: &mut Progress,
    ) -> Result<prologue::Prologue, Failure> {
        progress.stage("zones");
        let plain = |zones| prologue::Prologue { zones, seen: Vec::new() };
        let made = match (&self.args.zones, resumed.map(|r| *r.1)) {
            (Some(path), _) => plain(read_zones(path, self.world)?),
            // The very particles of the run before, whatever ended them then.
            (None, Some(ZoneSource::Solved { budget, planned, particles, seed, .. })) => {
                let options = ZoneOptions { budget, particles: planned, seed };
                plain(solve(self.world, &options, None, Some(particles), interrupt, progress))
            }
            _ => self.make(interrupt, progress),
        };
        if let Some((path, source)) = resumed {
            if interrupt.asked() {
                return Err(Interrupt::failure("before the zones were there; nothing is written"));
            }
            source.check(Some(&made.zones)).map_err(|e| checkpoint::refused(path, &e))?;
        }
        let (zones, (median, _)) = (&made.zones, made.zones.relative_errors());
        progress.remark(format!(
            "{} zones, {} particles, median error {}",
            machine::count(zones.map().len() as f64),
            machine::count(zones.particles as f64),
            percent(median)
        ));
        Ok(made)
    }

    fn make(&self, interrupt: &Interrupt, progress: &mut Progress) -> prologue::Prologue {
        let Size(width, height) = self.plan.size;
        let deadlines = self.plan.budget.particle_deadlines(self.begin.elapsed(), self.writing);
        let deadlines = deadlines.map(|d| d.map(|d| self.begin + d));
        let limits = Limits { most: self.plan.most_particles, deadlines };
        let picture = (self.plan.options, [width, height]);
        prologue::solve(self.world, &self.plan.solution, picture, &limits, |leg| {
            watch(leg, progress);
            interrupt.asked()
        })
    }
}

/// What to say where surprise has asked for more particles; `timed`: there was a limit of time.
pub fn line(seen: &[Seen], traced: u64, timed: bool) -> Option<String> {
    let (first, last) = (seen.first()?, seen.last()?);
    if first.surprise <= SURPRISED || traced <= first.particles {
        return None;
    }
    let share = |s: &Seen| percent(s.surprise as f32);
    let count = |n: u64| machine::count(n as f64);
    let what = format!("{} of a pilot's luminance came by rays that nothing had led there", share(first));
    let [first, all] = [count(first.particles), count(traced)];
    Some(match timed {
        true => format!("{what} ({first} particles): more time for particles, {all} in all"),
        false if last.particles == traced => {
            format!("{what}: {all} particles instead of {first}, then {}", share(last))
        }
        false => format!("{what}: {all} particles instead of {first}"),
    })
}

fn watch(leg: &Leg, progress: &mut Progress) {
    let by_count = leg.particles as f64 / leg.total.max(1) as f64;
    let by_time = leg.time.map_or(0.0, |[since, end]| {
        let all = end.saturating_duration_since(since).as_secs_f64();
        if all > 0.0 { since.elapsed().as_secs_f64() / all } else { 1.0 }
    });
    progress.look(Look { done: by_count.max(by_time).min(1.0), rays: leg.particles, ..Look::default() });
}

/// Solve until the particles, the time or the user's patience end; with `traced`, until so many particles, which is where
/// an earlier run ended.
pub fn solve(
    world: &World,
    options: &ZoneOptions,
    deadline: Option<Instant>,
    traced: Option<u64>,
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Zones {
    let time = deadline.map(|end| [Instant::now(), end]);
    let total = traced.unwrap_or(options.particles);
    let mut making = Making::new(world, options, Some(Sight::of_camera(world)));
    making.trace(total, |particles| {
        watch(&Leg { particles, total, time }, progress);
        // A solution without any particle would be a black one.
        interrupt.asked() || particles > 0 && deadline.is_some_and(|end| Instant::now() >= end)
    });
    making.finish()
}

fn read_zones(path: &Path, world: &World) -> Result<Zones, Failure> {
    let failed = |what: String| Failure::input(format!("{}: {what}", path.display()));
    let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    Zones::read(world, &bytes).map_err(|e| failed(e.to_string()))
}
