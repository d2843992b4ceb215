//! What a render command means: every default resolved against the scene.

use crate::args::{RenderArgs, ScreenArgs};
use crate::failure::Failure;
use crate::machine;
use crate::output::{self, Target};
use crate::values::{Depth, Size};
use hemilux::checkpoint::{Origin, view_hash};
use hemilux::film::Film;
use hemilux::gather::GatherPlan;
use hemilux::render::{Mode, RenderOptions};
use hemilux::zones::ZoneOptions;
use hemilux_scene::Scene;
use std::time::Duration;

/// Particles in time mode end by time; this only keeps their sums within their integers.
const MOST_PARTICLES: u64 = 1 << 32;
/// Share of the physical memory that a film may take.
const FILM_SHARE: f64 = 0.6;
/// Share of the time after loading that goes to particles, and with those that surprise asks for.
const PARTICLE_SHARES: [f64; 2] = [0.1, 0.14];
/// Particles are doubled so often at most where surprise asks for it.
const MOST_DOUBLINGS: u32 = 2;
/// Limit of time (s) up to which the default number of zones is meant; longer ones have more, as the root of the time, for noise falls as
/// fast as their bias then (in proportion to the time, bulb and skylight had more error at 60 s), ...
const ZONES_FOR: f64 = 60.0;
/// ... up to this many times as many.
const MOST_ZONES: f64 = 8.0;

/// When a render ends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Budget {
    /// The first sample of every pixel.
    pub first: u32,
    /// Samples per pixel, if they limit.
    pub spp: Option<u32>,
    /// From the start of the program to the written file, if that limits.
    pub time: Option<Duration>,
    /// Typical relative error of a pixel to reach.
    pub error: Option<f64>,
    /// Whether nobody asked for it.
    pub is_default: bool,
}

impl Budget {
    fn resolve(args: &RenderArgs) -> Budget {
        let (spp, time) = (args.passes.map(|p| p.1 - p.0).or(args.spp), args.time);
        let first = args.passes.map_or(0, |p| p.0);
        let error = args.target_error.map(|e| e.0);
        match (spp, time) {
            (None, None) if args.target_error.is_none() => {
                let spp = match args.mode {
                    Mode::Zonal | Mode::Corrected => 32,
                    Mode::Path => 128,
                    Mode::Zones => 4,
                };
                Budget { first, spp: Some(spp), time, error, is_default: true }
            }
            _ => Budget { first, spp, time, error, is_default: false },
        }
    }

    /// The passes of the whole run.
    pub fn passes(&self) -> std::ops::Range<u32> {
        self.first..self.spp.map_or(u32::MAX, |n| self.first.saturating_add(n))
    }

    /// In words.
    pub fn describe(&self) -> String {
        let spp = self.spp.map(|n| format!("{n} sample{} per pixel", if n == 1 { "" } else { "s" }));
        let time = self.time.map(|t| format!("{} in all", seconds(t)));
        let error = self.error.map(|e| format!("an error of {}", crate::progress::percent(e as f32)));
        let words: Vec<String> = error.into_iter().chain(spp).chain(time).collect();
        let hint = if self.is_default { " by default, see --spp and --time" } else { "" };
        format!("{}{hint}", words.join(" or "))
    }

    /// When the particles end that began at `from` (all since the start of the program), and when those that surprise asks for do;
    /// writing is kept free.
    pub fn particle_deadlines(&self, from: Duration, writing: Duration) -> Option<[Duration; 2]> {
        let left = self.time?.saturating_sub(writing).saturating_sub(from);
        Some(PARTICLE_SHARES.map(|share| from + left.mul_f64(share)))
    }
}

/// A time for people.
pub fn seconds(t: Duration) -> String {
    let s = t.as_secs_f64();
    match s {
        s if s < 0.9995 => format!("{:.0} ms", s * 1e3),
        s if s < 99.95 => format!("{s:.1} s"),
        s if s < 5999.5 => format!("{}m {:02}s", (s / 60.0) as u64, s as u64 % 60),
        s => format!("{}h {:02}m", (s / 3600.0) as u64, (s / 60.0) as u64 % 60),
    }
}

/// Everything that is decided before the world is built.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Pixels across and down of the whole picture.
    pub size: Size,
    /// Part to render, pixels: x0, x1, y0, y1.
    pub region: [u32; 4],
    /// What shapes the samples.
    pub options: RenderOptions,
    /// What shapes the zonal solution.
    pub solution: ZoneOptions,
    /// Particles, however much surprise asks for; `None`: their number was given.
    pub most_particles: Option<u64>,
    /// When to end.
    pub budget: Budget,
}

impl Plan {
    /// Resolve `args` for `scene`.
    pub fn resolve(args: &RenderArgs, scene: &Scene) -> Result<Plan, Failure> {
        let size = args.size.unwrap_or(Size(scene.film.width, scene.film.height));
        let crop = args.crop.map_or(scene.film.crop, |c| c.0);
        let region = region(crop, size);
        if region[0] >= region[1] || region[2] >= region[3] {
            return Err(Failure::usage(format!("no pixel of {}x{} lies in the crop window", size.0, size.1)));
        }
        film_fits(region)?;
        let max_depth = match args.max_depth {
            None => u32::MAX,
            Some(Depth::Limit(n)) => n,
            Some(Depth::File) => scene.max_depth.ok_or_else(|| {
                Failure::usage("--max-depth file: the scene's Integrator says no maxdepth; give a number")
            })?,
        };
        let plan =
            GatherPlan { rays: args.gather_rays, shadow_rays: args.shadow_rays, strategy: args.strategy };
        let options = RenderOptions { mode: args.mode, plan, seed: args.seed, max_depth };
        let budget = Budget::resolve(args);
        let asked = args.solution;
        let mut solution = solution(asked.zone_budget, asked.particles, args.seed, budget.time.is_some())?;
        if let (None, Some(time)) = (asked.zone_budget, budget.time) {
            solution.budget = zones_for(time);
        }
        let most = ZoneOptions::default().particles << MOST_DOUBLINGS;
        let most_particles = asked.particles.is_none().then_some(most);
        Ok(Plan { size, region, options, solution, most_particles, budget })
    }
}

impl Plan {
    /// What the samples of this run depend on.
    pub fn origin(&self, scene: &Scene, residual: f32) -> Origin {
        let Size(width, height) = self.size;
        let (view, size) = (view_hash(scene), [width, height]);
        Origin { scene: scene.content_hash, view, size, options: self.options, residual }
    }

    /// What a time budget keeps free for writing.
    pub fn writing_time(&self, targets: &[Target], screen: &ScreenArgs, film: bool) -> Duration {
        if self.budget.time.is_none() {
            return Duration::ZERO;
        }
        let [x0, x1, y0, y1] = self.region;
        let pixels = (x1 - x0) as u64 * (y1 - y0) as u64;
        let film = if film { crate::checkpoint::writing_time(pixels) } else { Duration::ZERO };
        output::writing_time(targets, pixels, screen) + film
    }
}

/// Zones for a picture of so much time: where noise falls as one over its square root, so should the width of zones.
fn zones_for(time: Duration) -> u32 {
    let times = (time.as_secs_f64() / ZONES_FOR).sqrt().clamp(1.0, MOST_ZONES);
    (ZoneOptions::default().budget as f64 * times) as u32
}

/// The options of a zonal solution; a time limit instead of a count lets particles run on.
pub fn solution(
    budget: Option<u64>,
    particles: Option<u64>,
    seed: u64,
    timed: bool,
) -> Result<ZoneOptions, Failure> {
    let default = ZoneOptions::default();
    let budget = match budget {
        None => default.budget,
        Some(n) => u32::try_from(n)
            .ok()
            .filter(|n| *n <= 1 << 28)
            .ok_or_else(|| Failure::usage(format!("--zone-budget {n} is more than {}", 1 << 28)))?,
    };
    let most = if timed { MOST_PARTICLES } else { default.particles };
    Ok(ZoneOptions { budget, particles: particles.unwrap_or(most).min(MOST_PARTICLES), seed })
}

/// Pixels of a crop window, as pbrt rounds them.
fn region(crop: [f32; 4], size: Size) -> [u32; 4] {
    let at = |v: f32, n: u32| ((v as f64 * n as f64).ceil() as u32).min(n);
    [at(crop[0], size.0), at(crop[1], size.0), at(crop[2], size.1), at(crop[3], size.1)]
}

fn film_fits(region: [u32; 4]) -> Result<(), Failure> {
    let (w, h) = ((region[1] - region[0]) as u64, (region[3] - region[2]) as u64);
    let need = Film::bytes(w, h);
    let Some(memory) = machine::physical_memory() else { return Ok(()) };
    if need as f64 > FILM_SHARE * memory as f64 {
        return Err(Failure::io(format!(
            "a film of {w}x{h} pixels needs {}, more than {:.0} % of this machine's {}; render it in parts with --crop",
            machine::bytes(need),
            FILM_SHARE * 100.0,
            machine::bytes(memory)
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crop_windows_that_share_an_edge_share_no_pixel() {
        let size = Size(101, 7);
        let (left, right) = (region([0.0, 0.37, 0.0, 1.0], size), region([0.37, 1.0, 0.0, 1.0], size));
        assert_eq!(left[1], right[0]);
        assert_eq!((left[0], right[1], right[3]), (0, 101, 7));
    }

    #[test]
    fn particles_get_their_share_of_what_is_left() {
        let budget = Budget {
            first: 0,
            spp: None,
            error: None,
            time: Some(Duration::from_secs(10)),
            is_default: false,
        };
        let s = Duration::from_secs;
        let end = budget.particle_deadlines(s(2), s(1)).unwrap();
        assert!((end[0].as_secs_f64() - (2.0 + 0.1 * 7.0)).abs() < 1e-9);
        assert!((end[1].as_secs_f64() - (2.0 + 0.14 * 7.0)).abs() < 1e-9);
        assert_eq!(budget.particle_deadlines(s(11), s(1)), Some([s(11); 2]));
    }

    #[test]
    fn zones_grow_with_the_time_within_bounds() {
        let n = |t: u64| zones_for(Duration::from_secs(t));
        assert_eq!([n(1), n(60), n(240), n(3840), n(100_000)], [60_000, 60_000, 120_000, 480_000, 480_000]);
    }

    #[test]
    fn times_for_people() {
        let t = |s: f64| seconds(Duration::from_secs_f64(s));
        assert_eq!([t(0.25), t(12.34), t(125.0), t(7300.0)], ["250 ms", "12.3 s", "2m 05s", "2h 01m"]);
    }
}
