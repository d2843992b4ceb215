//! `hemilux render`: a scene in, pictures out.

use crate::args::RenderArgs;
use crate::failure::{Failure, Kind};
use crate::finish;
use crate::interrupt::Interrupt;
use crate::output::{self, Header};
use crate::plan::{Plan, seconds};
use crate::progress::{Look, Progress, percent};
use crate::talk::Talk;
use crate::values::Size;
use crate::{load, machine, radiance};
use hemilux::film::Film;
use hemilux::picture;
use hemilux::render::{Mode, Renderer, Stop};
use hemilux::strategies;
use hemilux::world::World;
use hemilux::zones::Zones;
use serde_json::json;
use std::fmt;
use std::path::Path;
use std::time::{Duration, Instant};

/// Render.
pub fn run(args: RenderArgs, begin: Instant) -> Result<(), Failure> {
    let talk = args.talk;
    let interrupt = Interrupt::listen();
    let mut progress = Progress::new(args.progress, &talk, begin);
    set_threads(args.threads)?;
    // What can be refused without the scene is refused before it is read.
    output::targets(&args.outputs, &args.scene.scenes, None)?;

    progress.stage("load");
    let mut scene = load::scene(&args.scene.scenes, &args.scene.defines, args.scene.lenient, &talk)?;
    if let Some(path) = &args.view {
        scene.camera = load::camera(path, &args.scene.defines, &talk)?;
    }
    let targets = output::targets(&args.outputs, &args.scene.scenes, Some(&scene))?;
    let plan = Plan::resolve(&args, &scene)?;
    let Size(width, height) = plan.size;
    let mut film = Film::new(width, height, plan.region);
    let [x0, x1, y0, y1] = plan.region;
    let writing = match plan.budget.time {
        Some(_) => output::writing_time(&targets, (x1 - x0) as u64 * (y1 - y0) as u64, &args.screen),
        None => Duration::ZERO,
    };

    progress.stage("prepare");
    let world = World::new(scene);
    progress.remark(format!("{} primitives", machine::count(world.primitives() as f64)));
    // The importer has warned where a scene has no luminaire at all.
    if world.luminaires.is_empty() && !world.scene.environments.is_empty() {
        talk.warning("the luminaires have no power: the picture will be black");
    }

    if plan.options.mode == Mode::Path && args.zones.is_some() {
        talk.warning("--zones is not used in mode path");
    }
    if plan.options.mode != Mode::Path && args.max_depth.is_some() {
        talk.warning("--max-depth is only used in mode path");
    }

    if plan.options.mode == Mode::Zonal && strategies::is_biased(args.strategy) {
        talk.warning(&format!(
            "strategy {} is biased: errors do not all average out",
            strategies::name(args.strategy)
        ));
    }

    interrupt.arm();
    let zones = match plan.options.mode {
        Mode::Path => None,
        Mode::Zonal | Mode::Zones => {
            Some(zonal_solution(&args, &plan, &world, begin, writing, &interrupt, &mut progress)?)
        }
    };

    progress.stage("render");
    let renderer = Renderer::new(&world, zones.as_ref(), width, height, plan.options);
    let deadline = plan.budget.time.map(|t| begin + t.saturating_sub(writing));
    let stop = Stop { passes: plan.budget.spp.unwrap_or(u32::MAX), deadline };
    let late = deadline.is_some_and(|d| Instant::now() >= d);
    progress.budget(plan.budget.describe());
    let since = Instant::now();
    let outcome = renderer.run(&mut film, stop, interrupt.flag(), |p| {
        let pass = Some((p.passes, plan.budget.spp));
        progress.look(Look { done: p.done as f64, pass, rays: p.rays, error: p.error });
    });
    if outcome.passes == 0 {
        return Err(Interrupt::failure("before the first pass; nothing is written"));
    }
    let mut rays = outcome.rays;
    let more = match deadline {
        Some(d) if plan.budget.spp.is_none_or(|n| outcome.passes < n) => {
            let per_pass = since.elapsed() / outcome.passes;
            finish::rows(&renderer, &mut film, outcome.passes, per_pass, d, interrupt.flag())
        }
        _ => None,
    };
    rays += more.unwrap_or(0);
    let samples = Samples { least: outcome.passes, more: more.is_some() };
    let error = film.relative_error();
    progress.remark(format!(
        "{} (budget: {}), {} rays",
        samples,
        plan.budget.describe(),
        machine::count(rays as f64)
    ));

    progress.stage("write");
    let short = stopped_short(&plan, samples, late);
    let stopped = if interrupt.asked() { Some("interrupted".to_owned()) } else { short.clone() };
    let run = Run {
        args: &args,
        plan: &plan,
        world: &world,
        zones: zones.as_ref(),
        samples,
        rays,
        error,
        time: begin.elapsed(),
        stopped,
    };
    let header = run.header();
    let image = picture::image(&film, &[]);
    let mut written = Vec::new();
    for target in &targets {
        let said = target.write(&image, &header, &args.screen)?;
        written.push(said.map_or(target.name(), |s| format!("{} (exposure {s})", target.name())));
    }
    let rejected = film.rejected();
    let time = begin.elapsed();
    let mut summary = vec![format!("wrote {}", written.join(", "))];
    summary.push(format!(
        "{} in {}, {} rays{}",
        samples,
        seconds(time),
        machine::count(rays as f64),
        error.map_or(String::new(), |e| format!(", typical error of a pixel {}", percent(e)))
    ));
    progress.end(
        &summary,
        json!({
            "files": targets.iter().map(output::Target::name).collect::<Vec<_>>(), "spp": outcome.passes,
            "rays": rays, "err": error, "rejected": rejected, "time_s": time.as_secs_f64(),
        }),
    );
    warn_rejected(&talk, rejected);
    if outcome.cancelled {
        return Err(Interrupt::failure(&format!("{samples} are written")));
    }
    match short {
        Some(why) => Err(Failure::new(Kind::Short, why)),
        None => Ok(()),
    }
}

/// One thread per core unless said otherwise.
pub fn set_threads(threads: Option<u16>) -> Result<(), Failure> {
    let Some(n) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n as usize).build_global();
    pool.map_err(|e| Failure::io(format!("cannot start {n} threads: {e}")))
}

/// Samples per pixel: everywhere at least `least`, and one more in some rows.
#[derive(Clone, Copy)]
struct Samples {
    least: u32,
    more: bool,
}

impl Samples {
    fn count(&self) -> String {
        if self.more { format!("{} to {}", self.least, self.least + 1) } else { self.least.to_string() }
    }
}

impl fmt::Display for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.more || self.least != 1 { "s" } else { "" };
        write!(f, "{} sample{plural} per pixel", self.count())
    }
}

fn warn_rejected(talk: &Talk, rejected: u64) {
    if rejected > 0 {
        talk.warning(&format!("{rejected} samples were not finite and count as black"));
    }
}

/// Why the target was not reached, if it was not.
fn stopped_short(plan: &Plan, samples: Samples, late: bool) -> Option<String> {
    match (plan.budget.spp, plan.budget.time) {
        (Some(spp), Some(time)) if samples.least < spp => Some(format!(
            "stopped by --time {} at {} of {spp} samples per pixel",
            seconds(time),
            samples.count()
        )),
        (_, Some(time)) if late => {
            Some(format!("--time {} was over before the first pass; {samples} written", seconds(time)))
        }
        _ => None,
    }
}

fn zonal_solution(
    args: &RenderArgs,
    plan: &Plan,
    world: &World,
    begin: Instant,
    writing: Duration,
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Result<Zones, Failure> {
    progress.stage("zones");
    let zones = match &args.zones {
        Some(path) => read_zones(path, world)?,
        None => {
            let deadline = plan.budget.particle_deadline(begin.elapsed(), writing).map(|d| begin + d);
            solve(world, &plan.solution, deadline, interrupt, progress)
        }
    };
    let (median, _) = zones.relative_errors();
    progress.remark(format!(
        "{} zones, {} particles, median error {}",
        machine::count(zones.map().len() as f64),
        machine::count(zones.particles as f64),
        percent(median)
    ));
    Ok(zones)
}

/// Solve until the particles, the time or the user's patience end.
pub fn solve(
    world: &World,
    options: &hemilux::zones::ZoneOptions,
    deadline: Option<Instant>,
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Zones {
    let since = Instant::now();
    Zones::solve_until(world, options, |particles| {
        let by_count = particles as f64 / options.particles as f64;
        let by_time = deadline.map_or(0.0, |d| {
            let all = d.saturating_duration_since(since).as_secs_f64();
            if all > 0.0 { since.elapsed().as_secs_f64() / all } else { 1.0 }
        });
        progress.look(Look { done: by_count.max(by_time).min(1.0), rays: particles, ..Look::default() });
        // A solution without any particle would be a black one.
        interrupt.asked() || (by_time >= 1.0 && particles > 0)
    })
}

fn read_zones(path: &Path, world: &World) -> Result<Zones, Failure> {
    let failed = |what: String| Failure::input(format!("{}: {what}", path.display()));
    let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    Zones::read(world, &bytes).map_err(|e| failed(e.to_string()))
}

/// What there is to know about a finished render.
struct Run<'a> {
    args: &'a RenderArgs,
    plan: &'a Plan,
    world: &'a World,
    zones: Option<&'a Zones>,
    samples: Samples,
    rays: u64,
    error: Option<f32>,
    time: Duration,
    stopped: Option<String>,
}

impl Run<'_> {
    fn header(&self) -> Header {
        let mut entries: Vec<(String, String)> = Vec::new();
        let mut put = |key: &str, value: String| entries.push((key.to_owned(), value));
        let (options, scene) = (&self.plan.options, &self.world.scene);
        put("software", format!("hemilux {}", env!("CARGO_PKG_VERSION")));
        put("command", command_line());
        put(
            "scene",
            self.args.scene.scenes.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" "),
        );
        put("scene_hash", format!("{:016x}", scene.content_hash));
        put(
            "mode",
            match options.mode {
                Mode::Zonal => "zonal (biased by the zones)",
                Mode::Path => "path (unbiased)",
                Mode::Zones => "zones (the zonal solution, not a picture of the scene)",
            }
            .into(),
        );
        put("seed", options.seed.to_string());
        put("samples_per_pixel", self.samples.count());
        if options.mode == Mode::Path {
            let limit = options.max_depth;
            put("max_depth", if limit == u32::MAX { "none".into() } else { limit.to_string() });
        }
        if options.mode == Mode::Zonal {
            let strategy = options.plan.strategy;
            let biased = if strategies::is_biased(strategy) { " (biased)" } else { "" };
            put("strategy", format!("{}{biased}", strategies::name(strategy)));
            put("gather_rays", options.plan.rays.to_string());
            put("shadow_rays", options.plan.shadow_rays.to_string());
        }
        if let Some(zones) = self.zones {
            put("zones", zones.map().len().to_string());
            put("particles", zones.particles.to_string());
            put("zone_median_error", format!("{:.5}", zones.relative_errors().0));
        }
        if let Some(e) = self.error {
            put("relative_error", format!("{e:.5}"));
        }
        put("rays", self.rays.to_string());
        put("render_time", format!("{:.3} s", self.time.as_secs_f64()));
        if let Some(why) = &self.stopped {
            put("stopped", why.clone());
        }
        Header { entries, radiance: self.radiance() }
    }

    fn radiance(&self) -> Vec<(String, String)> {
        let mut lines = Vec::new();
        let mut put = |key: &str, value: &str| lines.push((key.to_owned(), value.to_owned()));
        let Size(w, h) = self.plan.size;
        if let Some(view) = radiance::view(&self.world.scene.camera, [w, h], self.plan.region) {
            put("VIEW", &view.text);
            if view.mirrored {
                put("VIEW_SPACE", "the scene with x negated, as its camera is left-handed");
            }
        }
        put("EXPOSURE", "1");
        put("PRIMARIES", "0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329");
        lines
    }
}

/// The command line as one could type it again.
pub fn command_line() -> String {
    let quoted = |word: String| {
        let plain = |c: char| c.is_alphanumeric() || "-_./=,:+%@".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    let mut words = std::env::args_os().map(|w| w.to_string_lossy().into_owned());
    let program = words.next().unwrap_or_default();
    let program =
        Path::new(&program).file_name().map_or("hemilux".into(), |n| n.to_string_lossy().into_owned());
    std::iter::once(program).chain(words).map(quoted).collect::<Vec<_>>().join(" ")
}
