//! Statistical machinery: convergence slopes, detection, coverage of intervals, agreement of modes, determinism.

use super::scenes::{cuboid, diffuse, emission, empty, material, quad as board};
use super::*;
use crate::film::Film;
use crate::gather::{GatherPlan, Strategy};
use crate::render::{Mode, RenderOptions, Renderer};
use hemilux_scene::{ConductorFresnel, FloatParam, MaterialKind, Rgb, RgbParam, Roughness, Scene};
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
    page.at_most("slope, cells trained on the edge of a disk", slope, -1.2);
}

/// How often 10 × 10 jittered points miss a disk of radius R, in cells.
pub(super) fn detection(page: &mut Page) {
    for (radius, truth, trials) in
        [(0.5, 0.359, 40_000), (0.707, 0.079, 40_000), (1.0, 5e-4, 400_000), (1.118, 8e-6, 2_000_000)]
    {
        let mut missed = 0u32;
        for trial in 0..trials {
            let key = Key::new(5).with(trial as u64);
            let r = radius / 10.0;
            let centre = [0, 1].map(|d| 0.2 + 0.6 * key.with(1).uniform64(d));
            let hit = |i: u32| {
                let p = jittered_f64(i, 10, 10, key);
                (p.u - centre[0]).hypot(p.v - centre[1]) < r
            };
            // Cells farther away than two have no points in reach.
            let [x, y] = centre.map(|c| (c * 10.0) as u32 - 2);
            missed += !(0..25).any(|i| hit((y + i / 5) * 10 + x + i % 5)) as u32;
        }
        let share = missed as f64 / trials as f64;
        let error = (truth * (1.0 - truth) / trials as f64).sqrt();
        // The references are given to three digits, or to one.
        let e =
            Estimate { mean: share, error: error.max(2e-3 * truth + if truth > 1e-5 { 2e-5 } else { 0.0 }) };
        e.check(page, &format!("jittered points miss a disk of {radius} cells"), truth, 1.5 * truth + 2e-5);
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

/// A room with a block in it and a lamp near the ceiling.
fn room(albedo: f32, more: fn(&mut Scene)) -> Scene {
    let mut scene = empty();
    let (wall, dark) = (diffuse(&mut scene, albedo), diffuse(&mut scene, 0.3));
    cuboid(&mut scene, [-2.0, -1.5, -0.3], [2.0, 1.5, 4.0], true, wall);
    cuboid(&mut scene, [-0.6, 0.6, 1.5], [0.4, 1.5, 2.5], false, dark);
    board(&mut scene, [-0.6, -1.4, 1.4], [1.2, 0.0, 0.0], [0.0, 0.0, -1.0], wall, emission(5.0));
    more(&mut scene);
    scene
}

fn smooth() -> Roughness {
    Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false }
}

fn with_mirror(scene: &mut Scene) {
    let reflectance = ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::splat(0.9)));
    let mirror = material(scene, MaterialKind::Conductor { fresnel: reflectance, roughness: smooth() });
    board(scene, [-1.99, -1.0, 0.5], [0.0, 2.0, 0.0], [0.0, 0.0, 2.5], mirror, None);
}

fn with_varnish(scene: &mut Scene) {
    let reflectance = RgbParam::Constant(Rgb::splat(0.6));
    let kind = MaterialKind::CoatedDiffuse { reflectance, eta: 1.5, roughness: smooth() };
    let varnish = material(scene, kind);
    board(scene, [-1.9, 1.4, 3.9], [3.8, 0.0, 0.0], [0.0, 0.0, -3.8], varnish, None);
}

const SIDE: u32 = 12;
const PIXELS: usize = (SIDE * SIDE) as usize;
const PICTURES: u64 = 32;
const PLAN: GatherPlan = GatherPlan { rays: 8, shadow_rays: 2, strategy: Strategy::Jittered };

/// Luminances of independent pictures.
fn pictures(world: &World, zones: &Zones, mode: Mode) -> Vec<Vec<f64>> {
    let picture = |seed| {
        let options = RenderOptions { mode, plan: PLAN, seed, max_depth: u32::MAX };
        let renderer = Renderer::new(world, Some(zones), SIDE, SIDE, options);
        let mut film = Film::new(SIDE, SIDE, [0, SIDE, 0, SIDE]);
        renderer.passes(&mut film, 0..if mode == Mode::Path { 48 } else { 8 }, &AtomicU64::new(0));
        let mut pixels = Vec::with_capacity(PIXELS);
        film.for_each(|_, _, p| pixels.push(p.mean().luminance() as f64));
        pixels
    };
    (0..PICTURES).map(picture).collect()
}

/// Of one number for every picture.
fn estimate(pictures: &[Vec<f64>], number: impl Fn(&[f64]) -> f64) -> Estimate {
    let values: Vec<f64> = pictures.iter().map(|p| number(p)).collect();
    estimators::estimate(&values)
}

/// Share of the pixels that agree within 4.3 standard errors (Student, 62 degrees of freedom: false alarm 0.01 over all pixels).
fn agreeing(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let agrees = |i: &usize| {
        let [a, b] = [a, b].map(|all| estimate(all, |p| p[*i]));
        (a.mean - b.mean).abs() <= 4.3 * a.error.hypot(b.error)
    };
    (0..PIXELS).filter(agrees).count() as f64 / PIXELS as f64
}

/// Mode corrected is mode path, over zones that are too dark: in the mean and pixel by pixel. Mode zonal is what must be rejected.
pub(super) fn corrected_is_path(page: &mut Page) {
    type Change = fn(&mut Scene);
    let rooms: [(&str, Change); 3] = [
        ("a room", |_| ()),
        ("a room with a mirror", with_mirror),
        ("a room with a varnished table", with_varnish),
    ];
    for (what, more) in rooms {
        let world = World::new(room(0.7, more));
        // The zones of a darker room of the same shape.
        let zones = solved(&World::new(room(0.5, more)), 600, 1 << 14, 2);
        let [path, corrected, zonal] =
            [Mode::Path, Mode::Corrected, Mode::Zonal].map(|mode| pictures(&world, &zones, mode));
        let mean = |pictures| estimate(pictures, |p| p.iter().sum::<f64>() / PIXELS as f64);
        let (p, c) = (mean(&path), mean(&corrected));
        let e = Estimate { mean: c.mean, error: c.error.hypot(p.error) };
        e.check(
            page,
            &format!("mean of {what}: corrected is path (and zonal is not)"),
            p.mean,
            mean(&zonal).mean,
        );
        page.form(agreeing(&zonal, &path) < 0.9975, "zonal pixels that disagree are found out");
        page.at_least(
            &format!("pixels of {what} where corrected is path"),
            agreeing(&corrected, &path),
            0.9975,
        );
    }
}

/// The same bits with one thread and with two.
pub(super) fn determinism(page: &mut Page) {
    let world = World::new(room(0.7, |_| ()));
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
