//! Whether the intervals of `sense --ci --mode corrected` hold the truth as often as they say.
//!
//!     cargo run --release -p hemilux --example coverage -- [option=value]... SCENE...
//!
//! Options: `sensors=5` (per scene), `seeds=200`, `gathers=64` (a reading), `truth=150` (times as many for the truth), `particles=524288`, `budget=1000` (zones),
//! `solutions=4` (zonal solutions that the seeds take turns on), `mode=corrected|path`, `family=` (sensors that the band is for, where a series is run in parts; those of this run).
//!
//! Sensors lie where camera rays, spread over the picture, first meet something diffuse; they face away from it. The truth of
//! a sensor is one long reading with other random numbers; how small its half-width is beside that of a reading is printed. A sensor's count is
//! held against its binomial band (95 % of the seeds, false-alarm rate 1e-3 over all sensors, Šidák). Negative control: intervals of half
//! the width.

use hemilux::sense::{Goal, Receiver, Sense, SenseOptions};
use hemilux::world::World;
use hemilux::world::camera::Lens;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::import::{LoadOptions, load};
use std::path::PathBuf;
use std::time::Duration;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (options, scenes): (Vec<&String>, Vec<&String>) = args.iter().partition(|a| a.contains('='));
    let option = |key: &str, default: &str| -> String {
        let prefix = format!("{key}=");
        options.iter().find_map(|o| o.strip_prefix(&prefix)).unwrap_or(default).to_string()
    };
    let (sensors, seeds): (usize, u64) = (option("sensors", "5").parse()?, option("seeds", "200").parse()?);
    let (gathers, times): (u64, u64) = (option("gathers", "64").parse()?, option("truth", "150").parse()?);
    let (particles, solutions) = (option("particles", "524288").parse()?, option("solutions", "4").parse()?);
    let budget = option("budget", "1000").parse()?;
    let by_paths = option("mode", "corrected") == "path";
    let family: f64 = option("family", &(sensors * scenes.len()).max(1).to_string()).parse()?;
    let band = band(seeds, 1.0 - 0.999f64.powf(1.0 / family));
    println!("{seeds} seeds of {gathers} gathers; a sensor may cover {} to {}", band[0], band[1]);
    println!(
        "scene | sensor | truth ± half-width | readings / truth - 1 ± error | half-width / truth | truth's / reading's | covers | half the width"
    );
    let (mut pooled, mut control, mut outside, mut count) = (0, 0, 0, 0);
    for name in &scenes {
        let mut paths = vec![PathBuf::from(name)];
        let view = paths[0].with_extension("vf");
        if paths[0].extension().is_some_and(|e| e == "rad") && view.exists() {
            paths.push(view);
        }
        let world = World::new(load(&paths, &LoadOptions::default())?.scene);
        let zones: Vec<Zones> = (0..solutions)
            .map(|seed| {
                let options = ZoneOptions { particles, seed, budget };
                Zones::solve_seen(&world, &options, None, |_| false)
            })
            .collect();
        let read = |seed: u64, gathers: u64, index: usize, (p, n): (Vec3, Vec3)| {
            let options = SenseOptions {
                receiver: Receiver::Irradiance,
                goal: Goal::Gathers(gathers),
                limit: Duration::MAX,
                seed,
                weights: [0.2126, 0.7152, 0.0722],
            };
            let solution = &zones[(seed % solutions) as usize..][..1];
            let sense = match by_paths {
                true => Sense::new(&world, &[], options).steered(&solution[0]),
                false => Sense::corrected(&world, solution, options),
            };
            sense.read(index as u64, p, n)
        };
        for (index, sensor) in points(&world, sensors).into_iter().enumerate() {
            let truth = read(1 << 40, gathers * times, index, sensor);
            let (mut hit, mut half_hit, mut half, mut sum, mut squares) = (0, 0, 0.0, 0.0, 0.0);
            for seed in 0..seeds {
                let r = read(seed, gathers, index, sensor);
                let off = (r.scalar - truth.scalar).abs();
                hit += (off <= r.half_width) as u64;
                half_hit += (off <= 0.5 * r.half_width) as u64;
                half += r.half_width / seeds as f64;
                sum += r.scalar;
                squares += r.scalar * r.scalar;
            }
            let n = seeds as f64;
            let error = ((squares / n - (sum / n).powi(2)) / (n - 1.0)).max(0.0).sqrt();
            let is_outside = hit < band[0] || hit > band[1];
            println!(
                "{name} | {index} | {:.6} ± {:.6} | {:+.4} ± {:.4} | {:.4} | {:.3} | {hit}{} | {half_hit}",
                truth.scalar,
                truth.half_width,
                sum / n / truth.scalar - 1.0,
                error / truth.scalar,
                half / truth.scalar,
                truth.half_width / half,
                if is_outside { " outside" } else { "" },
            );
            (pooled, control, outside) = (pooled + hit, control + half_hit, outside + is_outside as u32);
            count += seeds;
        }
    }
    let percent = |hits: u64| 100.0 * hits as f64 / count as f64;
    println!(
        "pooled {:.2} % of {count}; {outside} sensors outside; half the width: {:.1} %",
        percent(pooled),
        percent(control)
    );
    Ok(())
}

/// What camera rays meet first, where it scatters diffusely: just above it, facing as it does.
fn points(world: &World, wanted: usize) -> Vec<(Vec3, Vec3)> {
    let size = 512u32;
    let lens = Lens::new(&world.scene, size, size);
    let met = (0..1000).filter_map(|i| {
        let u = hemiquad::points::sobol(i, hemiquad::points::Key::new(17));
        let (x, y) = ((u.u * size as f32) as u32, (u.v * size as f32) as u32);
        let ray = lens.ray(x.min(size - 1), y.min(size - 1), [0.5, 0.5], [0.5, 0.5]);
        let s = world.closest(ray.origin, ray.dir, f32::INFINITY)?;
        let n = s.facing();
        world.bsdf(&s).has_diffuse().then(|| (s.leave(n) + n * 1e-4, n))
    });
    met.take(wanted).collect()
}

/// Fewest and most hits of `n` at 95 % each that a sensor may have, so that it is outside by chance with probability `alarm`.
fn band(n: u64, alarm: f64) -> [u64; 2] {
    let mut terms = vec![0.05f64.powi(n as i32)];
    for k in 1..=n {
        terms.push(terms[k as usize - 1] * (n - k + 1) as f64 / k as f64 * 0.95 / 0.05);
    }
    let least = |terms: &mut dyn Iterator<Item = &f64>| {
        let mut sum = 0.0;
        terms
            .take_while(|t| {
                sum += **t;
                sum <= 0.5 * alarm
            })
            .count() as u64
    };
    [least(&mut terms.iter()), n - least(&mut terms.iter().rev())]
}
