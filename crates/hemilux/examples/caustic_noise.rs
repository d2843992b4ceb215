//! Noise of one gather at visible points, for the radiance that arrives by mirrors and glass alone: relative variance × rays.
//!
//!     cargo run --release -p hemilux --example caustic_noise -- SCENE [option=value]...
//!
//! Options: `points=3000`, `gathers=16` (at every point), `rays=16,64` (of a plan), `particles=1048576`, `seed=0`,
//! `jittered=100` (gathers at a point with 16 × 16 jittered rays and nothing that leads them; 0: left out).
//!
//! Points are what camera rays meet first, spread over the picture, where surfaces scatter diffusely, no luminaire is seen directly, and something arrives.
//! Every surface is blackened, so that all that arrives comes from luminaires by specular chains; records and predicted
//! field radiance come from the scene as it is. Rays are gather rays, each with its whole chain. *mean* is the mean over points of a
//! point's variance over its squared mean, *pooled* the sum of variances over the sum of squared means.
//! Means come from other, finer gathers; lines are over all points above 1, 10 and 50 % of the average point.

use hemilux::gather::{GatherPlan, Strategy};
use hemilux::sampler::Sampler;
use hemilux::sensor::irradiance;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::world::camera::Lens;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::import::{LoadOptions, load};
use hemilux_scene::*;
use rayon::prelude::*;
use std::path::PathBuf;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, options @ ..] = args.as_slice() else {
        return Err("usage: caustic_noise SCENE [option=value]...".into());
    };
    let option = |key: &str, default: &str| -> String {
        let prefix = format!("{key}=");
        options.iter().find_map(|o| o.strip_prefix(&prefix)).unwrap_or(default).to_string()
    };
    let scene = || load(&[PathBuf::from(path)], &LoadOptions::default()).map(|l| l.scene);
    let whole = World::new(scene()?);
    let only_chains = World::new(blackened(scene()?, false));
    let no_chains = World::new(blackened(scene()?, true));
    let particles: u64 = option("particles", "1048576").parse()?;
    let seed: u64 = option("seed", "0").parse()?;
    let zones = Zones::solve(&whole, &ZoneOptions { particles, seed, ..ZoneOptions::default() });
    let records = zones.records();
    println!(
        "{path}: {} particles, {} records, {:.1} MB of them kept",
        zones.particles,
        records.len(),
        records.memory_bytes() as f64 / 1e6
    );
    let points = visible_points(&whole, &no_chains, option("points", "3000").parse()?);
    let walker = Walker { steer: Some(&zones), ..Walker::path(&only_chains) };
    let gathers: u32 = option("gathers", "16").parse()?;
    println!(
        "strata | points | rays | relative variance: mean, pooled, median, 90 % | variance x rays: mean, pooled"
    );
    let finest = GatherPlan { rays: 64, shadow_rays: 0, strategy: Strategy::Adaptive };
    let means: Vec<f64> = measure(&walker, &points, &finest, 2 * gathers).iter().map(|f| f.mean).collect();
    for rays in option("rays", "16,64").split(',') {
        let plan = GatherPlan { rays: rays.parse()?, shadow_rays: 0, strategy: Strategy::Adaptive };
        let found = measure(&walker, &points, &plan, gathers);
        print(&format!("adaptive, plan of {rays}"), &found, &means);
    }
    let jittered: u32 = option("jittered", "100").parse()?;
    if jittered > 0 {
        let plan = GatherPlan { rays: 256, shadow_rays: 0, strategy: Strategy::Jittered };
        // Only where there is something to be met: these are many rays.
        let average = means.iter().sum::<f64>() / means.len() as f64;
        let lit = |i: &usize| means[*i] > DIM[1] * average;
        let (points, means): (Vec<_>, Vec<_>) =
            (0..points.len()).filter(lit).map(|i| (points[i], means[i])).unzip();
        print("jittered", &measure(&Walker::path(&only_chains), &points, &plan, jittered), &means);
    }
    Ok(())
}

/// Without scattering; `casters` too, or left as they are.
fn blackened(mut scene: Scene, casters: bool) -> Scene {
    let black = RgbParam::Constant(Rgb::BLACK);
    for material in &mut scene.materials {
        match &mut material.kind {
            MaterialKind::Diffuse { reflectance } | MaterialKind::CoatedDiffuse { reflectance, .. } => {
                *reflectance = black;
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, .. } => {
                (*reflectance, *transmittance) = (black, black);
            }
            MaterialKind::Mix { .. } => {}
            other if casters => *other = MaterialKind::Diffuse { reflectance: black },
            _ => {}
        }
    }
    scene
}

/// What camera rays meet first where it scatters diffusely and sees no luminaire directly: place and normal.
fn visible_points(world: &World, no_chains: &World, wanted: u32) -> Vec<(Vec3, Vec3)> {
    let size = 512;
    let lens = Lens::new(&world.scene, size, size);
    let (mut points, mut lit) = (Vec::new(), 0);
    for i in 0..20 * wanted {
        let u = hemiquad::points::sobol(i, hemiquad::points::Key::new(7));
        let (x, y) = ((u.u * size as f32) as u32, (u.v * size as f32) as u32);
        let ray = lens.ray(x.min(size - 1), y.min(size - 1), [0.5, 0.5], [0.5, 0.5]);
        let Some(s) = world.closest(ray.origin, ray.dir, f32::INFINITY) else { continue };
        if !world.bsdf(&s).has_diffuse() {
            continue;
        }
        let n = s.facing();
        let p = s.leave(n);
        let plan = GatherPlan { rays: 1, shadow_rays: 64, strategy: Strategy::Sobol };
        let mut sampler = Sampler::new(3, i as u64, 0);
        let direct = irradiance(&Walker::path(no_chains), p, n, &plan, &mut sampler, &mut Tally::default());
        if direct.is_black() {
            points.push((p, n))
        } else {
            lit += 1
        }
        if points.len() as u32 == wanted {
            break;
        }
    }
    println!("{} points; {lit} more see a luminaire and are left out", points.len());
    points
}

/// Gathers at one point: their mean and second moment about 0 (luminance), and rays per gather.
struct Found {
    mean: f64,
    square: f64,
    gathers: f64,
    rays: f64,
}

fn measure(walker: &Walker, points: &[(Vec3, Vec3)], plan: &GatherPlan, gathers: u32) -> Vec<Found> {
    let one = |(i, (p, n)): (usize, &(Vec3, Vec3))| {
        let (mut sum, mut squares, mut tally) = (0.0, 0.0, Tally::default());
        for g in 0..gathers {
            let mut sampler = Sampler::new(plan.rays as u64 + gathers as u64, (i as u64) << 32 | g as u64, 0);
            let e = irradiance(walker, *p, *n, plan, &mut sampler, &mut tally).luminance() as f64;
            sum += e;
            squares += e * e;
        }
        let k = gathers as f64;
        Found { mean: sum / k, square: squares / k, gathers: k, rays: tally.samples as f64 / k }
    };
    points.par_iter().enumerate().map(one).collect()
}

/// Points dimmer than this part of the mean are left out of a line.
const DIM: [f64; 3] = [0.01, 0.1, 0.5];

/// Relative to the squares of `means`.
fn print(name: &str, found: &[Found], means: &[f64]) {
    let average = means.iter().sum::<f64>() / means.len() as f64;
    for dim in DIM {
        let (mut relative, mut variances, mut squares, mut rays) = (Vec::new(), 0.0, 0.0, 0.0);
        for (f, mean) in found.iter().zip(means).filter(|(_, mean)| **mean > dim * average) {
            let variance = (f.square - f.mean * f.mean) * f.gathers / (f.gathers - 1.0);
            relative.push(variance / (mean * mean));
            variances += variance;
            squares += mean * mean;
            rays += f.rays;
        }
        let n = relative.len() as f64;
        relative.sort_by(f64::total_cmp);
        let at = |share: f64| relative.get((share * n) as usize).copied().unwrap_or(f64::NAN);
        let (mean, pooled, rays) = (relative.iter().sum::<f64>() / n, variances / squares, rays / n);
        println!(
            "{name} | {n} above {dim} | {rays:.1} | {mean:.4} {pooled:.4} {:.4} {:.4} | {:.1} {:.1}",
            at(0.5),
            at(0.9),
            mean * rays,
            pooled * rays
        );
    }
}
