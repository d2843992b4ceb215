//! What importance is worth, and what noise the zones leave in a picture.
//!
//! `cargo run --release -p hemilux --example importance -- [PASSES] SCENE...`
//!
//! A scene of several files is FILE+FILE. For every scene, particles are aimed at what the camera sees (`camera`) or at everything (`all`), the same number of
//! them. Two solutions A and B are each rendered twice with numbers of their own; mean squares over pixels of A₁ − A₂ give
//! the variance that gathers make, products (A₁ − B₁)(A₂ − B₂) that of the zones, both relative to
//! mean² + 1 % of the picture's mean². Fixed seeds.

use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer, Stop};
use hemilux::world::World;
use hemilux::zones::sight::Sight;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::{LoadOptions, load};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

const WIDTH: u32 = 80;
const HEIGHT: u32 = 60;

fn main() {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let passes = words.first().and_then(|w| w.parse().ok()).inspect(|_| drop(words.remove(0))).unwrap_or(16);
    println!("| scene | zones' area seen | aimed at | particles | gathers, per pass | zones | surprise |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for scene in &words {
        let files: Vec<PathBuf> = scene.split('+').map(PathBuf::from).collect();
        let loaded = load(&files, &LoadOptions { lenient: true, ..LoadOptions::default() });
        let Ok(loaded) = loaded else {
            eprintln!("{scene}: cannot be read");
            continue;
        };
        let world = World::new(loaded.scene);
        for (name, aimed, particles) in
            [("camera", true, 1 << 19), ("all", false, 1 << 19), ("camera", true, 1 << 22)]
        {
            let row = measure(&world, aimed, particles, passes);
            println!("| {scene} | {:.1} % | {name} | {particles} | {row}", 100.0 * seen(&world));
        }
    }
}

/// Share of the zones' area, both sides, that the camera sees directly or after two scatterings.
fn seen(world: &World) -> f64 {
    let sight = Sight::of_camera(world);
    let zones = hemilux::zones::ZoneMap::new(world, 60_000);
    let (mut all, mut seen) = (0.0, 0.0);
    zones.for_each_cell(world, |corners, _| {
        let n = corners.len() as f32;
        let centre = corners.iter().copied().sum::<hemilux_scene::geom::Vec3>() / n;
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let area = 0.5 * normal.length() as f64 * if corners.len() == 4 { 2.0 } else { 1.0 };
        let Some(n) = normal.try_normalize() else { return };
        // Closed rooms have a side that nobody sees: a zone counts as seen from either.
        all += area;
        seen += if sight.sees(centre, n) || sight.sees(centre, -n) { area } else { 0.0 };
    });
    seen / all
}

fn measure(world: &World, aimed: bool, particles: u64, passes: u32) -> String {
    let render = |zones: &Zones, seed: u64| {
        let plan = GatherPlan { rays: 16, shadow_rays: 8, strategy: Strategy::Adaptive };
        let options = RenderOptions { mode: Mode::Zonal, plan, seed, max_depth: u32::MAX };
        let mut film = Film::new(WIDTH, HEIGHT, [0, WIDTH, 0, HEIGHT]);
        let renderer = Renderer::new(world, Some(zones), WIDTH, HEIGHT, options);
        renderer.run(&mut film, Stop { passes, deadline: None }, &AtomicBool::new(false), |_| ());
        let mut values = Vec::new();
        film.for_each(|_, _, p| values.push(p.mean().luminance() as f64));
        (values, renderer.surprise().unwrap_or(0.0))
    };
    let solve = |seed| {
        let sight = aimed.then(|| Sight::of_camera(world));
        Zones::solve_seen(world, &ZoneOptions { budget: 60_000, particles, seed }, sight, |_| false)
    };
    let (a, b) = (solve(1), solve(2));
    let ((a1, surprise), (a2, _)) = (render(&a, 11), render(&a, 12));
    let ((b1, _), (b2, _)) = (render(&b, 21), render(&b, 22));
    let mean = a1.iter().sum::<f64>() / a1.len() as f64;
    let (mut gathers, mut zones, mut used) = (Vec::new(), Vec::new(), 0.0);
    for i in 0..a1.len() {
        let middle = 0.25 * (a1[i] + a2[i] + b1[i] + b2[i]);
        let scale = 1.0 / (middle * middle + 0.01 * mean * mean);
        gathers.push(0.25 * ((a1[i] - a2[i]).powi(2) + (b1[i] - b2[i]).powi(2)) * scale * passes as f64);
        zones.push(0.5 * (a1[i] - b1[i]) * (a2[i] - b2[i]) * scale);
        used += 1.0;
    }
    // Without the thousandth of the pixels that differs most: fireflies say nothing of zones.
    let mut order: Vec<usize> = (0..gathers.len()).collect();
    order.sort_by(|x, y| gathers[*x].total_cmp(&gathers[*y]));
    let kept = &order[..order.len() - order.len().div_ceil(1000)];
    let sum = |v: &[f64]| kept.iter().map(|i| v[*i]).sum::<f64>() / used;
    format!("{:.2e} | {:.1e} | {:.2} % |", sum(&gathers), sum(&zones), 100.0 * surprise)
}
