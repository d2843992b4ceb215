//! Statistical machinery: convergence slopes, detection, coverage of intervals, agreement of modes, determinism.

use super::scenes::{cuboid, diffuse, emission, empty, quad as board};
use super::*;
use crate::film::Film;
use crate::gather::{GatherPlan, Strategy};
use crate::render::{Mode, RenderOptions, Renderer};
use hemilux_scene::Scene;
use hemiquad::points::{Key, jittered_f64, sobol_f64};
use std::sync::atomic::AtomicU64;

/// Points of a set of `side` × `side`.
type Set = fn(u32, u32, Key) -> [f64; 2];

fn independent(i: u32, _: u32, key: Key) -> [f64; 2] {
    [key.uniform64(2 * i), key.uniform64(2 * i + 1)]
}

fn in_cells(i: u32, side: u32, key: Key) -> [f64; 2] {
    let p = jittered_f64(i, side, side, key);
    [p.u, p.v]
}

fn owen(i: u32, _: u32, key: Key) -> [f64; 2] {
    let p = sobol_f64(i, key);
    [p.u, p.v]
}

fn rmse(set: Set, side: u32, f: &dyn Fn([f64; 2]) -> f64, truth: f64) -> f64 {
    const RUNS: u64 = 200;
    let n = side * side;
    let squares: f64 = (0..RUNS)
        .map(|run| {
            let key = Key::new(77).with(run).with(n as u64);
            let mean = (0..n).map(|i| f(set(i, side, key))).sum::<f64>() / n as f64;
            (mean - truth).powi(2)
        })
        .sum();
    (squares / RUNS as f64).sqrt()
}

/// Log-log slopes of the RMSE over 64 to 4096 points: -0.5 at random, -1 jittered on smooth functions, -1.5 (with a
/// logarithm) for scrambled Sobol' points, -0.75 jittered on the indicator of a disk.
pub(super) fn slopes(page: &mut Page) {
    let smooth = |p: [f64; 2]| (p[0] + p[1]).exp();
    let disk = |p: [f64; 2]| if (p[0] - 0.43).hypot(p[1] - 0.56) < 0.31 { 1.0 } else { 0.0 };
    let volume = (std::f64::consts::E - 1.0).powi(2);
    let area = std::f64::consts::PI * 0.31 * 0.31;
    for (case, set, f, exact, truth, tolerance) in [
        (
            "slope, independent points",
            independent as Set,
            &smooth as &dyn Fn([f64; 2]) -> f64,
            volume,
            -0.5,
            0.08,
        ),
        ("slope, jittered points, smooth", in_cells, &smooth, volume, -1.0, 0.08),
        ("slope, scrambled Sobol' points, smooth", owen, &smooth, volume, -1.5, 0.12),
        ("slope, jittered points, disk", in_cells, &disk, area, -0.75, 0.1),
    ] {
        let errors =
            [8u32, 16, 32, 64].map(|side| (((side * side) as f64).ln(), rmse(set, side, f, exact).ln()));
        let (mx, my) =
            (errors.iter().map(|e| e.0).sum::<f64>() / 4.0, errors.iter().map(|e| e.1).sum::<f64>() / 4.0);
        let xy: f64 = errors.iter().map(|e| (e.0 - mx) * (e.1 - my)).sum();
        let xx: f64 = errors.iter().map(|e| (e.0 - mx).powi(2)).sum();
        page.exact(case, xy / xx, truth, tolerance);
    }
    edge_following(page);
}

/// Cells trained on other samples follow the edge of a disk: -1.2 or steeper.
fn edge_following(page: &mut Page) {
    use hemiquad::method::{Predicted, Trained};
    use hemiquad::{Method, Probe, Workspace};
    let disk = |p: &Probe| if (p.uv.u - 0.43).hypot(p.uv.v - 0.56) < 0.31 { 1.0 } else { 0.0 };
    let exact = std::f64::consts::PI * 0.31 * 0.31;
    let mut work = Workspace::new();
    let errors = [64u32, 256, 1024, 4096].map(|n| {
        let squares: f64 = (0..40u64)
            .map(|run| {
                let key = Key::new(31).with(run);
                let mut trained = Trained::new();
                trained.start(2);
                for round in 0..4 {
                    trained.learn(&mut |p: &Probe| disk(p), n, 2 * n, key.with(round), Default::default());
                }
                let method = Predicted::from_partition(&trained);
                (method.integrate(&mut |p: &Probe| disk(p), n, key, &mut work).value - exact).powi(2)
            })
            .sum();
        ((n as f64).ln(), (squares / 40.0).sqrt().ln())
    });
    let slope = (errors[3].1 - errors[0].1) / (errors[3].0 - errors[0].0);
    page.exact("slope, cells trained on the edge of a disk (-1.2 or steeper)", slope.min(-1.2), slope, 1e-9);
}

/// How often 10 × 10 jittered points miss a disk of radius R, in cells.
pub(super) fn detection(page: &mut Page) {
    const TRIALS: u32 = 40_000;
    for (radius, truth) in [(0.5, 0.359), (0.707, 0.079), (1.0, 5e-4)] {
        let mut missed = 0u32;
        for trial in 0..TRIALS {
            let key = Key::new(5).with(trial as u64);
            let r = radius / 10.0;
            let centre = [0, 1].map(|d| 0.2 + 0.6 * key.with(1).uniform64(d));
            let hit = |i: u32| {
                let p = jittered_f64(i, 10, 10, key);
                (p.u - centre[0]).hypot(p.v - centre[1]) < r
            };
            missed += !(0..100).any(hit) as u32;
        }
        let share = missed as f64 / TRIALS as f64;
        let error = (truth * (1.0 - truth) / TRIALS as f64).sqrt();
        // The references are given to three digits.
        let e = Estimate { mean: share, error: error.max(1e-4 + 2e-3 * truth) };
        e.check(page, &format!("jittered points miss a disk of {radius} cells"), truth, 1.5 * truth + 1e-3);
    }
}

/// Readings cover the truth as often as they say: 95 %, within the binomial's 99.99 %.
pub(super) fn coverage(page: &mut Page) {
    let world = rad(&format!(
        "void light l 0 0 3 1 1 1\n{}",
        quad("l", [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0])
    ));
    let runs = 1000u32;
    let covered = (0..runs)
        .filter(|seed| {
            let o = SenseOptions { seed: 1000 + *seed as u64, ..options(&world, Receiver::Irradiance, 16) };
            let r = Sense::new(&world, &[], o).read(0, Vec3::ZERO, Vec3::Z);
            (r.scalar - 1.740839503).abs() <= r.half_width
        })
        .count() as f64
        / runs as f64;
    let e = Estimate { mean: covered, error: (0.95 * 0.05 / runs as f64).sqrt() };
    e.check(page, "coverage of 95 % intervals, a square overhead", 0.95, 0.9);
}

fn room(albedo: f32) -> Scene {
    let mut scene = empty();
    let (wall, dark) = (diffuse(&mut scene, albedo), diffuse(&mut scene, 0.3));
    cuboid(&mut scene, [-2.0, -1.5, -0.3], [2.0, 1.5, 4.0], true, wall);
    cuboid(&mut scene, [-0.6, 0.6, 1.5], [0.4, 1.5, 2.5], false, dark);
    board(&mut scene, [-0.6, -1.4, 1.4], [1.2, 0.0, 0.0], [0.0, 0.0, -1.0], wall, emission(5.0));
    scene
}

const SIDE: u32 = 12;
const PLAN: GatherPlan = GatherPlan { rays: 8, shadow_rays: 2, strategy: Strategy::Jittered };

/// Mean luminance of the picture by independent replicates.
fn mean_of(world: &World, zones: &Zones, mode: Mode) -> Estimate {
    let values: Vec<f64> = (0..32u64)
        .map(|seed| {
            let options = RenderOptions { mode, plan: PLAN, seed, max_depth: u32::MAX };
            let renderer = Renderer::new(world, Some(zones), SIDE, SIDE, options);
            let mut film = Film::new(SIDE, SIDE, [0, SIDE, 0, SIDE]);
            renderer.passes(&mut film, 0..if mode == Mode::Path { 48 } else { 8 }, &AtomicU64::new(0));
            let mut sum = 0.0;
            film.for_each(|_, _, p| sum += p.mean().luminance() as f64);
            sum / (SIDE * SIDE) as f64
        })
        .collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
    Estimate { mean, error: variance.sqrt() }
}

/// Mode corrected is mode path, over zones that are too dark; mode zonal is what must be rejected.
pub(super) fn corrected_is_path(page: &mut Page) {
    let world = World::new(room(0.7));
    // The zones of a darker room of the same shape.
    let zones = solved(&World::new(room(0.5)), 600, 1 << 14, 2);
    let [path, corrected, zonal] =
        [Mode::Path, Mode::Corrected, Mode::Zonal].map(|mode| mean_of(&world, &zones, mode));
    let e = Estimate { mean: corrected.mean, error: corrected.error.hypot(path.error) };
    e.check(page, "mean of a room: corrected is path (and zonal is not)", path.mean, zonal.mean);
}

/// The same bits with one thread and with two.
pub(super) fn determinism(page: &mut Page) {
    let world = World::new(room(0.7));
    let render = |threads: usize| {
        let work = || {
            let zones = solved(&world, 600, 1 << 14, 2);
            let options = RenderOptions { mode: Mode::Corrected, plan: PLAN, seed: 1, max_depth: u32::MAX };
            let mut film = Film::new(40, 40, [0, 40, 0, 40]);
            let renderer = Renderer::new(&world, Some(&zones), 40, 40, options);
            renderer.passes(&mut film, 0..4, &AtomicU64::new(0));
            film
        };
        match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool.install(work),
            Err(_) => work(),
        }
    };
    let same = render(1) == render(2);
    page.exact("the same bits with one thread and with two (1: yes)", same as u32 as f64, 1.0, 0.0);
}
