//! What residuals cost and how noisy they are, by pairs of camera samples with and without ([`hemilux::residual`]).
//!
//!     cargo run --release -p hemilux --example residual_noise -- SCENE.pbrt [option=value]...
//!
//! Options: `particles=1048576`, `pairs=8192`, `gather=16`, `shadow=8`, `seed=0`, `budget=60000`. Prints, relative to each pixel's
//! own brightness (with a floor of a tenth of the mean): V, the variance of a zonal sample; M, the second moment of residuals
//! at a share of 1, of all pairs and without the worst 0.1 %, 1 %; and rays and time of either.

use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer};
use hemilux::residual::{PAIR_SHARE, Pair};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::import::{LoadOptions, load};
use std::path::PathBuf;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let option = |key: &str, default: &str| -> String {
        let prefix = format!("{key}=");
        args.iter().find_map(|o| o.strip_prefix(&prefix)).unwrap_or(default).to_string()
    };
    let mut paths = vec![PathBuf::from(args.first().ok_or("usage: residual_noise SCENE [option=value]...")?)];
    let view = paths[0].with_extension("vf");
    if paths[0].extension().is_some_and(|e| e == "rad") && view.exists() {
        paths.push(view);
    }
    let scene = load(&paths, &LoadOptions::default())?.scene;
    let (width, height) = (scene.film.width, scene.film.height);
    let world = World::new(scene);
    let options = ZoneOptions {
        budget: option("budget", "60000").parse()?,
        particles: option("particles", "1048576").parse()?,
        seed: 0,
    };
    let zones = Zones::solve(&world, &options);
    println!("{:?}", zones.records());
    let plan = GatherPlan {
        rays: option("gather", "16").parse()?,
        shadow_rays: option("shadow", "8").parse()?,
        strategy: Strategy::Adaptive,
    };
    let options = RenderOptions {
        mode: Mode::Corrected,
        plan,
        seed: option("seed", "0").parse()?,
        max_depth: u32::MAX,
    };
    let renderer = Renderer::new(&world, Some(&zones), width, height, options);
    let since = Instant::now();
    let pairs = renderer.pairs([0, width, 0, height], option("pairs", "8192").parse()?);
    let time = since.elapsed();
    let n = pairs.len() as f64;
    let each = |p: &Pair| 0.5 * (p.zonal[0] + p.zonal[1]);
    let mean = pairs.iter().map(each).sum::<f64>() / n;
    let weight = |p: &Pair| 1.0 / (each(p).powi(2) + 0.01 * mean * mean);
    let sorted = |f: &dyn Fn(&Pair) -> f64| {
        let mut v: Vec<f64> = pairs.iter().map(|p| weight(p) * f(p)).collect();
        v.sort_by(f64::total_cmp);
        v
    };
    let report = |name: &str, v: &[f64]| {
        let without = |part: f64| v[..v.len() - (part * n) as usize].iter().sum::<f64>() / n;
        println!(
            "{name}: {:.4e}, without 0.1 % {:.4e}, 1 % {:.4e}, 10 % {:.4e}; largest {:.2e}",
            without(0.0),
            without(0.001),
            without(0.01),
            without(0.1),
            v[v.len() - 1]
        );
    };
    report("V", &sorted(&|p| 0.5 * (p.zonal[0] - p.zonal[1]).powi(2)));
    report("M", &sorted(&|p| PAIR_SHARE as f64 * (p.corrected - p.zonal[0]).powi(2)));
    let (zonal, corrected) = (
        pairs.iter().map(|p| p.zonal_rays).sum::<u64>(),
        pairs.iter().map(|p| p.corrected_rays).sum::<u64>(),
    );
    let residual = (corrected as f64 - zonal as f64) / n / PAIR_SHARE as f64;
    println!(
        "rays: zonal {:.1}, residuals at a share of 1 {residual:.1}; {time:.2?} for all pairs",
        zonal as f64 / n
    );
    println!("{:?}", renderer.study([0, width, 0, height], pairs.len()));
    Ok(())
}
