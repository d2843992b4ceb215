//! Error against time, of several modes on one scene with a reference, in one run.
//!
//!     cargo run --release -p hemilux --example equal_time -- SCENE.pbrt REFERENCE.exr [option=value]...
//!
//! Options: `seconds=10` (render time per mode, zones included), `modes=path,zonal`, `depth=file|N|none`, `gather=32`,
//! `shadow=8`, `strategy=adaptive|jittered|sobol`, `budget=` (zones; 60000 for 60 s and less), `particles=` (most), `share=0.1`
//! (of the time, for particles), `grown=0.14` (the same where pilots are surprised; 0: no pilots),
//! `residuals=` (their share in mode corrected, instead of the one that a study finds), `seed=0`, `size=WxH`, `spp=` (instead of seconds), `save=PREFIX` (EXR and PNG of each mode). The view beside
//! a `.rad` scene is read too. Beside a file called
//! `reference.exr`, its halves and mask are used.

use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::prologue::{self, Limits};
use hemilux::render::{Mode, RenderOptions, Renderer, Stop};
use hemilux::transport::Residual;
use hemilux::world::World;
use hemilux::zones::ZoneOptions;
use hemilux_image::metrics::{Reference, compare, fireflies};
use hemilux_image::{Image, tone};
use hemilux_scene::import::{LoadOptions, load};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scene_path, reference_path, options @ ..] = args.as_slice() else {
        return Err("usage: equal_time SCENE REFERENCE [option=value]...".into());
    };
    let option = |key: &str, default: &str| -> String {
        let prefix = format!("{key}=");
        options.iter().find_map(|o| o.strip_prefix(&prefix)).unwrap_or(default).to_string()
    };
    let begin = Instant::now();
    let mut paths = vec![PathBuf::from(scene_path)];
    let view = paths[0].with_extension("vf");
    if paths[0].extension().is_some_and(|e| e == "rad") && view.exists() {
        paths.push(view);
    }
    let loaded = load(&paths, &LoadOptions::default())?;
    let (mut width, mut height) = (loaded.scene.film.width, loaded.scene.film.height);
    if let Some((w, h)) = option("size", "").split_once('x') {
        (width, height) = (w.parse()?, h.parse()?);
    }
    let max_depth = match option("depth", "none").as_str() {
        "file" => loaded.scene.max_depth.unwrap_or(u32::MAX),
        "none" => u32::MAX,
        n => n.parse()?,
    };
    let read = begin.elapsed();
    let world = World::new(loaded.scene);
    let (build, primitives) = (begin.elapsed() - read, world.primitives());
    println!(
        "{scene_path}: {width}x{height}, {primitives} primitives; read {read:.2?}, prepared {build:.2?}"
    );
    let references = References::open(Path::new(reference_path))?;
    let seconds: f64 = option("seconds", "10").parse()?;
    let share: f64 = option("share", "0.1").parse()?;
    let grown: f64 = option("grown", "0.14").parse()?;
    let default_budget = (60_000.0 * (seconds / 60.0).sqrt().clamp(1.0, 8.0)) as u32;
    let passes: u32 = option("spp", "4294967295").parse()?;
    let strategy = option("strategy", "adaptive");
    let strategy = Strategy::ALL.iter().find(|s| s.0 == strategy).ok_or("unknown strategy")?.1;
    let plan = GatherPlan {
        rays: option("gather", "48").parse()?,
        shadow_rays: option("shadow", "12").parse()?,
        strategy,
    };
    println!("mode   | render s | zones s | spp | relMSE | trimmed | plain | mean ratio R G B | Mray/s");
    for name in option("modes", "path,zonal").split(',') {
        let mode = Mode::ALL.iter().find(|m| m.0 == name).ok_or("unknown mode")?.1;
        let start = Instant::now();
        let deadline = (passes == u32::MAX).then(|| start + Duration::from_secs_f64(seconds));
        let zone_options = ZoneOptions {
            budget: option("budget", &default_budget.to_string()).parse()?,
            particles: option("particles", "100000000").parse()?,
            seed: 0,
        };
        let options = RenderOptions { mode, plan, seed: option("seed", "0").parse()?, max_depth };
        let deadlines = [share, grown].map(|share| start + Duration::from_secs_f64(seconds * share));
        let most = (grown > share).then_some(1 << 23);
        let limits = Limits { most, deadlines: Some(deadlines) };
        let picture = (options, [width, height]);
        let prologue =
            (mode != Mode::Path).then(|| prologue::solve(&world, &zone_options, picture, &limits, |_| false));
        let zones = prologue.as_ref().map(|p| &p.zones);
        let zone_time = start.elapsed();
        let mut renderer = Renderer::new(&world, zones, width, height, options);
        if mode == Mode::Corrected {
            // As the command does; the time counts.
            let study = renderer.study([0, width, 0, height], 8192);
            let share = option("residuals", &study.share.to_string()).parse()?;
            renderer = renderer.with_residual(Residual::new(share));
            println!("       | {study:?}");
        }
        let mut film = Film::new(width, height, [0, width, 0, height]);
        let never = AtomicBool::new(false);
        let outcome = renderer.run(&mut film, Stop { passes, deadline }, &never, |_| ());
        let time = start.elapsed().as_secs_f64();
        let image = hemilux::picture::image(&film, &[]);
        let c = references.compare(&image)?;
        println!(
            "{name:6} | {time:6.2} | {:5.2} | {:5} | {:.3e} | {:.3e} | {:.3e} | {:.4} {:.4} {:.4} | {:.2}",
            zone_time.as_secs_f64(),
            outcome.passes,
            c.relmse,
            c.relmse_trimmed,
            c.relmse_plain,
            c.mean_ratio[0],
            c.mean_ratio[1],
            c.mean_ratio[2],
            outcome.rays as f64 / 1e6 / (time - zone_time.as_secs_f64()),
        );
        if let Some(z) = zones {
            let (median, high) = z.relative_errors();
            println!(
                "       | {} zones, target {:.4} m, {} particles, zone error median {median:.3}, 95 % {high:.3}",
                z.map().len(),
                z.map().target(),
                z.particles
            );
        }
        let mut n = 0f64;
        let (mut sum, mut squares) = (0f64, 0f64);
        film.for_each(|_, _, p| {
            n += 1.0;
            sum += p.mean()[1] as f64;
            squares += (p.standard_error()[1] as f64).powi(2);
        });
        println!(
            "       | picture mean (G) {:.6} ± {:.6}, as if pixels erred by themselves",
            sum / n,
            squares.sqrt() / n
        );
        if let Some(u) = renderer.surprise() {
            let seen = prologue.as_ref().map_or(&[][..], |p| &p.seen);
            println!("       | surprise {u:.4}, of pilots {seen:?}");
        }
        let flies = fireflies(&image, &references.whole, 20.0)?;
        let (flies, unsure): (Vec<_>, Vec<_>) = flies.into_iter().partition(|at| references.counts(*at));
        println!(
            "       | fireflies (above 20 x their 5 x 5 median) {} {:?}; where the reference does not count {:?}",
            flies.len(),
            &flies[..flies.len().min(6)],
            &unsure[..unsure.len().min(6)]
        );
        let prefix = option("save", "");
        if !prefix.is_empty() {
            hemilux_image::write(format!("{prefix}-{name}.exr"), &image)?;
            let exposure = tone::Exposure::Percentile { percent: 95.0, target: 0.8 };
            let map = tone::ToneMap { exposure, ..tone::ToneMap::default() };
            let mut png = Vec::new();
            hemilux_image::png::encode_rgb8(&map.apply(&image)?, &[], &mut png)?;
            std::fs::write(format!("{prefix}-{name}.png"), png)?;
        }
    }
    Ok(())
}

/// A reference and, if they lie beside it, its halves and mask.
struct References {
    whole: Image,
    halves: Option<[Image; 2]>,
    mask: Option<Image>,
}

impl References {
    fn open(path: &Path) -> Result<References, Failure> {
        let beside = |name: &str| path.with_file_name(name);
        let named = path.file_name().is_some_and(|n| n == "reference.exr");
        let halves = match named && beside("reference_a.exr").exists() {
            true => Some([
                hemilux_image::read(beside("reference_a.exr"))?,
                hemilux_image::read(beside("reference_b.exr"))?,
            ]),
            false => None,
        };
        let mask = match named && beside("valid.png").exists() {
            true => Some(hemilux_image::read(beside("valid.png"))?),
            false => None,
        };
        Ok(References { whole: hemilux_image::read(path)?, halves, mask })
    }

    /// Whether the mask has this pixel.
    fn counts(&self, [x, y]: [usize; 2]) -> bool {
        let value = self.mask.as_ref().and_then(|mask| mask.rgb_at(x, y));
        value.is_none_or(|rgb| rgb[0] > 0.5)
    }

    fn compare(&self, image: &Image) -> Result<hemilux_image::metrics::Comparison, Failure> {
        let halves = self.halves.as_ref().map(|[a, b]| [a, b]);
        Ok(compare(image, &Reference { image: &self.whole, halves, mask: self.mask.as_ref() })?)
    }
}
