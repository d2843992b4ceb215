//! `hemilux render`: a scene in, pictures out.

use crate::args::{RenderArgs, name_of};
use crate::checkpoint::{self, Keeper};
use crate::failure::{Failure, Kind};
use crate::interrupt::Interrupt;
use crate::output::{self, Header};
use crate::plan::{Plan, seconds};
use crate::progress::{Look, Progress, percent};
use crate::prologue::{Work, line};
use crate::talk::Talk;
use crate::values::Size;
use crate::{hints, load, machine, pilot, radiance, report};
use hemilux::checkpoint::{FilmFile, FilmFileError, Origin, Source};
use hemilux::film::Film;
use hemilux::picture;
use hemilux::prologue::{SURPRISED, Seen};
use hemilux::render::{DEFAULT_SHARE, Mode, Renderer};
use hemilux::residual::Study;
use hemilux::strategies;
use hemilux::transport::Residual;
use hemilux::world::World;
use hemilux::zones::Zones;
use hemilux_scene::hints::Hints;
use serde_json::json;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Render.
pub fn run(args: RenderArgs, begin: Instant) -> Result<(), Failure> {
    let talk = args.talk;
    let interrupt = Interrupt::listen();
    let mut progress = Progress::new(args.progress, &talk, begin);
    set_threads(args.threads)?;
    // What can be refused without the scene is refused before it is read.
    output::targets(&args.outputs, &args.scene.scenes, None)?;
    let kept_at = args.checkpoint.clone().or(args.resume.clone());
    kept_at.as_deref().map(checkpoint::check_path).transpose()?;
    args.report.as_deref().map(output::check_writable).transpose()?;
    let resumed = args.resume.as_deref().map(Resumed::read).transpose()?;

    progress.stage("load");
    let (mut scene, given) = hints::scene(&args.scene, &args.hints, &talk)?;
    if let Some(path) = &args.view {
        scene.camera = load::camera(path, &args.scene.defines, &talk)?;
    }
    let targets = output::targets(&args.outputs, &args.scene.scenes, Some(&scene))?;
    let mut plan = Plan::resolve(&args, &scene)?;
    let Size(width, height) = plan.size;
    // Where neither the user nor the film says it, pairs will decide.
    let share = args.residuals.map(|s| s.0 as f32).or(resumed.as_ref().map(|r| r.file.origin.residual));
    let mut origin =
        plan.origin(&scene, share.filter(|_| plan.options.mode == Mode::Corrected).unwrap_or(0.0));
    if let Some(resumed) = &resumed {
        resumed.check(&origin, &plan, &args, &hints::fingerprint(given.as_ref()))?;
    }
    let writing = plan.writing_time(&targets, &args.screen, kept_at.is_some());

    progress.stage("prepare");
    let world = hints::world(scene, given.as_ref());
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
    if plan.options.mode != Mode::Corrected && args.residuals.is_some() {
        talk.warning("--residuals is only used in mode corrected");
    }

    if matches!(plan.options.mode, Mode::Zonal | Mode::Corrected) && strategies::is_biased(args.strategy) {
        talk.warning(&format!(
            "strategy {} is biased: errors do not all average out",
            strategies::name(args.strategy)
        ));
    }

    interrupt.arm();
    let mut seen = Vec::new();
    let zones = match plan.options.mode.needs_zones() {
        false => None,
        true => {
            let work = Work { args: &args, plan: &plan, world: &world, begin, writing };
            let resumed = resumed.as_ref().map(|r| (r.path.as_path(), &r.source.zones));
            let made = work.zonal_solution(resumed, &interrupt, &mut progress)?;
            seen = made.seen;
            Some(made.zones)
        }
    };
    let deadline = plan.budget.time.map(|t| begin + t.saturating_sub(writing));
    let late = deadline.is_some_and(|d| Instant::now() >= d);
    let mut renderer = Renderer::new(&world, zones.as_ref(), width, height, plan.options);

    let wanted = match plan.options.mode {
        Mode::Corrected => share.is_none(),
        Mode::Zonal => args.report.is_some(),
        _ => false,
    };
    let study = (wanted && !late).then(|| {
        progress.stage("pairs");
        let study = study(&renderer, plan.region, deadline);
        progress.remark(study_in_words(&study));
        study
    });
    if plan.options.mode == Mode::Corrected {
        let share = share.or(study.map(|s| s.share)).unwrap_or(DEFAULT_SHARE);
        renderer = renderer.with_residual(Residual::new(share));
        origin.residual = share;
    }
    let mut pilot_rays = study.map_or(0, |s| s.rays);
    if let Some(target) = plan.budget.error {
        progress.stage("pilot");
        // With a limit of time, a quarter of what is left is for finding out.
        let until = deadline.map(|d| Instant::now() + d.saturating_duration_since(Instant::now()) / 4);
        let limit = plan.budget.spp;
        match pilot::pilot(&renderer, plan.region, plan.options.seed, target, limit, until, interrupt.flag())
        {
            Some(found) => {
                progress.remark(format!(
                    "{} samples per pixel, thrown away, say that {} are needed",
                    found.spent, found.passes
                ));
                pilot_rays += found.rays;
                plan.budget.spp = Some(plan.budget.spp.map_or(found.passes, |n| n.min(found.passes)));
            }
            None => progress.remark("no time to find out how many samples are needed".into()),
        }
    }

    if args.adaptive {
        progress.stage("rates");
        let until = deadline.map(|d| Instant::now() + d.saturating_duration_since(Instant::now()) / 10);
        let (seed, spp) = (plan.options.seed, plan.budget.spp);
        match pilot::rates(&renderer, plan.region, seed, spp, until, interrupt.flag()) {
            Some((rates, rays)) => {
                pilot_rays += rays;
                renderer = renderer.with_rates(rates);
            }
            None => progress.remark("no time to find out where samples are needed".into()),
        }
    }

    progress.stage("render");
    let source = Source {
        seed: plan.options.seed,
        // What a film says of its solution holds on, whatever this run would have planned.
        zones: resumed.as_ref().map_or_else(
            || checkpoint::zone_source(zones.as_ref(), args.zones.is_some(), &plan.solution),
            |r| r.source.zones,
        ),
        prologue: hints::fingerprint(given.as_ref()),
    };
    let mut run = Run {
        args: &args,
        plan: &plan,
        world: &world,
        zones: zones.as_ref(),
        given: given.as_ref(),
        study,
        seen: &seen,
        residual: origin.residual,
        samples: Samples::default(),
        rays: 0,
        error: None,
        surprise: None,
        time: Duration::ZERO,
        stopped: None,
    };
    let mut keeper = Keeper::new(kept_at, args.checkpoint_every, talk, origin, run.notes(), source);
    let mut film = resumed.map_or_else(|| Film::new(width, height, plan.region), |r| r.file.film);
    progress.budget(plan.budget.describe());
    let outcome =
        renderer.run_range(&mut film, plan.budget.passes(), deadline, interrupt.flag(), |film, p| {
            let pass = Some((p.passes, plan.budget.spp));
            progress.look(Look { done: p.done as f64, pass, rays: p.rays, error: p.error });
            keeper.look(film);
        });
    let rays = outcome.rays;
    let (least, most) = film.samples();
    let samples = Samples { least, most };
    let error = film.relative_error();
    progress.remark(format!(
        "{} (budget: {}), {} rays",
        samples,
        plan.budget.describe(),
        machine::count(rays as f64)
    ));

    progress.stage("write");
    keeper.keep(&film);
    let kept = keeper.path().map(|p| p.display().to_string());
    if least == 0 {
        keeper.end()?;
        let what = kept.map_or("nothing is written".into(), |k| format!("no picture is written, only {k}"));
        return Err(Interrupt::failure(&format!("before the first pass; {what}")));
    }
    let short = stopped_short(&plan, samples, outcome.complete, late, error);
    (run.samples, run.rays, run.error, run.time) = (samples, rays, error, begin.elapsed());
    run.surprise = renderer.surprise();
    run.stopped = if interrupt.asked() { Some("interrupted".to_owned()) } else { short.clone() };
    let header = run.header();
    let image = picture::image(&film, &[]);
    let mut written = Vec::new();
    for target in &targets {
        let said = target.write(&image, &header, &args.screen)?;
        written.push(said.map_or(target.name(), |s| format!("{} (exposure {s})", target.name())));
    }
    written.extend(kept);
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
    summary.extend(zones.as_ref().and_then(|z| line(&seen, z.particles, plan.budget.time.is_some())));
    summary.extend(hints::lines(&world));
    let progress_times = progress.times();
    progress.end(
        &summary,
        json!({
            "files": targets.iter().map(output::Target::name).collect::<Vec<_>>(), "spp": least,
            "rays": rays, "err": error, "rejected": rejected, "time_s": time.as_secs_f64(),
        }),
    );
    warn_rejected(&talk, rejected);
    if let Some(u) = run.surprise.filter(|u| *u > SURPRISED) {
        talk.warning(&format!(
"{:.1} % of the picture's luminance came by rays that nothing had led there: noise is larger than need be, and --time or --particles help",
            u * 100.0
        ));
    }
    if let Some(path) = &args.report {
        let report = run.report(&film, &progress_times, pilot_rays, begin.elapsed(), short.as_deref());
        report::write(path, &report)?;
    }
    if outcome.cancelled {
        keeper.end()?;
        return Err(Interrupt::failure(&format!("{samples} are written")));
    }
    keeper.end()?;
    match short {
        Some(why) => Err(Failure::new(Kind::Short, why)),
        None => Ok(()),
    }
}

/// A film to go on from.
struct Resumed {
    path: PathBuf,
    file: FilmFile,
    source: Source,
}

impl Resumed {
    fn read(path: &Path) -> Result<Resumed, Failure> {
        let file = checkpoint::read(path)?;
        let source = checkpoint::single_source(path, &file)?;
        Ok(Resumed { path: path.to_owned(), file, source })
    }

    /// That this run would make the same samples.
    fn check(&self, origin: &Origin, plan: &Plan, args: &RenderArgs, hints: &[u8]) -> Result<(), Failure> {
        self.file.origin.check(origin).map_err(|e| checkpoint::refused(&self.path, &e))?;
        if self.file.film.region() != plan.region {
            let text = |r: [u32; 4]| format!("{},{},{},{}", r[0], r[1], r[2], r[3]);
            let (theirs, ours) = (text(self.file.film.region()), text(plan.region));
            let error = FilmFileError::Differs { what: "crop (pixels x0,x1,y0,y1)", theirs, ours };
            return Err(checkpoint::refused(&self.path, &error));
        }
        if self.source.prologue != hints {
            let text = |b: &[u8]| match b {
                [] => "none".to_owned(),
                b => b.iter().rev().map(|b| format!("{b:02x}")).collect(),
            };
            let (theirs, ours) = (text(&self.source.prologue), text(hints));
            return Err(checkpoint::refused(
                &self.path,
                &FilmFileError::Differs { what: "file of hints", theirs, ours },
            ));
        }
        checkpoint::check_source(&self.path, &self.source, plan.options.seed, &args.solution)
    }
}

/// Pairs for the share of residuals and the zones' bias; with a limit of time, ...
const PAIRS: usize = 8192;
/// ... at least so many, ...
const FEWEST_PAIRS: usize = 256;
/// ... and as many as this part of what is left allows.
const PAIR_SHARE: f64 = 0.03;

/// Study the zones' bias within reason.
fn study(renderer: &Renderer, region: [u32; 4], deadline: Option<Instant>) -> Study {
    let Some(deadline) = deadline else { return renderer.study(region, PAIRS) };
    let begin = Instant::now();
    let few = renderer.study(region, FEWEST_PAIRS);
    let each = begin.elapsed().as_secs_f64() / FEWEST_PAIRS as f64;
    let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
    match (PAIR_SHARE * left / each.max(1e-9)) as usize {
        n if n > FEWEST_PAIRS => renderer.study(region, n.min(PAIRS)),
        _ => few,
    }
}

fn study_in_words(s: &Study) -> String {
    format!(
        "zonal bias {:+.2} % with standard error {:.2} %, share of residuals {:.3}",
        100.0 * s.bias,
        100.0 * s.bias_error,
        s.share
    )
}

/// One thread per core unless said otherwise.
pub fn set_threads(threads: Option<u16>) -> Result<(), Failure> {
    let Some(n) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n as usize).build_global();
    pool.map_err(|e| Failure::io(format!("cannot start {n} threads: {e}")))
}

/// Samples per pixel: fewest and most.
#[derive(Clone, Copy, Default)]
struct Samples {
    least: u32,
    most: u32,
}

impl Samples {
    fn count(&self) -> String {
        if self.most > self.least {
            format!("{} to {}", self.least, self.most)
        } else {
            self.least.to_string()
        }
    }
}

impl fmt::Display for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.most > self.least || self.least != 1 { "s" } else { "" };
        write!(f, "{} sample{plural} per pixel", self.count())
    }
}

fn warn_rejected(talk: &Talk, rejected: u64) {
    if rejected > 0 {
        talk.warning(&format!("{rejected} samples were not finite and count as black"));
    }
}

/// Why the target was not reached, if it was not.
fn stopped_short(
    plan: &Plan,
    samples: Samples,
    complete: bool,
    late: bool,
    error: Option<f32>,
) -> Option<String> {
    if let Some(target) = plan.budget.error
        && error.is_none_or(|e| e as f64 > target)
    {
        let reached = error.map_or("an unknown error".into(), percent);
        return Some(format!(
            "the typical error of a pixel is {reached} after {samples}, not the {} asked for",
            percent(target as f32)
        ));
    }
    match (plan.budget.spp, plan.budget.time) {
        (Some(spp), Some(time)) if !complete => Some(format!(
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

/// What there is to know about a finished render.
struct Run<'a> {
    args: &'a RenderArgs,
    plan: &'a Plan,
    world: &'a World,
    zones: Option<&'a Zones>,
    given: Option<&'a Hints>,
    study: Option<Study>,
    /// What pilots of the particles saw.
    seen: &'a [Seen],
    residual: f32,
    samples: Samples,
    rays: u64,
    error: Option<f32>,
    /// Share of the gathered luminance that no stratum expected.
    surprise: Option<f64>,
    time: Duration,
    stopped: Option<String>,
}

impl Run<'_> {
    fn is_unbiased(&self) -> bool {
        let options = &self.plan.options;
        match options.mode {
            Mode::Path => true,
            Mode::Corrected => !strategies::is_biased(options.plan.strategy),
            Mode::Zonal | Mode::Zones => false,
        }
    }

    /// What a film file says of itself: what does not depend on how far the run is.
    fn notes(&self) -> Vec<(String, String)> {
        const OF_THE_RUN: [&str; 6] =
            ["samples_per_pixel", "rays", "render_time", "seed", "stopped", "surprise"];
        let header = self.header();
        let entries = header.entries.into_iter().filter(|(k, _)| !OF_THE_RUN.contains(&k.as_str()));
        entries.chain(header.radiance.into_iter().map(|(k, v)| (format!("radiance.{k}"), v))).collect()
    }

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
        if let (Some(path), Some(given)) = (&self.args.hints.hints, self.given) {
            put("hints", format!("{} ({:016x})", path.display(), given.hash));
        }
        put(
            "mode",
            match options.mode {
                Mode::Zonal => "zonal (biased by the zones)",
                Mode::Corrected => "corrected (unbiased)",
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
        if options.mode == Mode::Corrected {
            put("residual_share", self.residual.to_string());
        }
        if let Some(study) = self.study.filter(|_| options.mode == Mode::Zonal) {
            put("zonal_bias", format!("{:.5} with standard error {:.5}", study.bias, study.bias_error));
        }
        if matches!(options.mode, Mode::Zonal | Mode::Corrected) {
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
        if let Some(u) = self.surprise {
            put("surprise", format!("{u:.5}"));
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

    /// What `--report` writes.
    fn report(
        &self,
        film: &Film,
        times: &[(&'static str, Duration)],
        pilot_rays: u64,
        total: Duration,
        short: Option<&str>,
    ) -> serde_json::Value {
        let (options, budget) = (&self.plan.options, &self.plan.budget);
        let zones = self.zones.map(|z| {
            let (median, high) = z.relative_errors();
            json!({
                "count": z.map().len(), "particles": z.particles, "rays": z.ledger.rays,
                "relative_error_median": median, "relative_error_95": high,
                "pilots": self.seen.iter().map(|s| json!({"particles": s.particles, "surprise": s.surprise})).collect::<Vec<_>>(),
            })
        });
        let bias = self.study.map(|s| {
            json!({
                "relative": s.bias, "standard_error": s.bias_error, "pairs": s.pairs,
                "in_the_picture": options.mode == Mode::Zonal,
            })
        });
        let overrun = budget.time.is_some_and(|t| total > t.mul_f64(1.05));
        let mut stages: serde_json::Map<String, serde_json::Value> =
            times.iter().map(|(name, t)| ((*name).to_owned(), json!(t.as_secs_f64()))).collect();
        stages.insert("total".into(), json!(total.as_secs_f64()));
        json!({
            "software": format!("hemilux {}", env!("CARGO_PKG_VERSION")),
            "command": command_line(),
            "scene": self.args.scene.scenes.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
            "scene_hash": format!("{:016x}", self.world.scene.content_hash),
            "mode": name_of(&Mode::ALL, options.mode), "unbiased": self.is_unbiased(),
            "seed": options.seed,
            "noise": report::noise(film),
            "zones": zones, "zonal_bias": bias,
            "residual_share": (options.mode == Mode::Corrected).then_some(self.residual),
            "surprise": self.surprise,
            "hints": self.given.map(|g| hints::report(self.world, g)),
            "rays": {"picture": self.rays, "pilot": pilot_rays},
            "seconds": stages,
            "budget": {
                "spp": budget.spp, "seconds": budget.time.map(|t| t.as_secs_f64()), "error": budget.error,
                "met": short.is_none() && self.stopped.is_none() && !overrun, "why_not": short.or(self.stopped.as_deref()),
            },
        })
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
