//! Hints change the noise and not the mean: absurd ones against none, for gathers, light particles and paths, with controls
//! that must be found out; and a good one finds what nothing else finds.

mod common;
use common::*;
use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy, gather};
use hemilux::render::{Mode, RenderOptions, Renderer};
use hemilux::sampler::Sampler;
use hemilux::sensor::sensor_surface;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3, Vec3};
use hemilux_scene::hints::parse_hints;
use hemilux_scene::*;
use std::path::Path;
use std::sync::atomic::AtomicU64;

/// A room with two lamps, a wall mirror and a glass ball, all named; `matt`: neither mirrors nor refracts.
fn furnished(matt: bool) -> Scene {
    let mut scene = empty();
    let white = diffuse(&mut scene, 0.6);
    let shiny = if matt { white } else { mirror(&mut scene, 0.9) };
    let black = diffuse(&mut scene, 0.0);
    let roughness = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
    let glass = match matt {
        true => white,
        false => material(&mut scene, MaterialKind::Dielectric { eta: 1.5, roughness }),
    };
    sphere(&mut scene, [1.0, 0.4, 2.2], 0.12, false, black, emission(50.0));
    quad(&mut scene, [-1.5, -1.5, 2.9], [0.0, 0.3, 0.0], [0.3, 0.0, 0.0], black, emission(8.0));
    sphere(&mut scene, [-0.4, 0.6, 0.45], 0.4, false, glass, None);
    quad(&mut scene, [2.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0], shiny, None);
    quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], white, None);
    quad(&mut scene, [-2.0, -2.0, 0.0], [0.0, 0.0, 3.0], [0.0, 4.0, 0.0], white, None);
    quad(&mut scene, [-2.0, -2.0, 3.0], [0.0, 4.0, 0.0], [4.0, 0.0, 0.0], white, None);
    let names = ["bulb", "panel", "ball", "mirror", "floor", "wall", "ceiling"];
    scene.shapes.iter_mut().zip(names).for_each(|(s, n)| s.name = n.into());
    scene
}

fn room() -> Scene {
    furnished(false)
}

/// The scene prepared with hints.
fn hinted(scene: Scene, hints: &str) -> World {
    let text = format!("{{\"hemilux-hints\": 1, {hints}}}");
    let read = parse_hints(&text, Path::new("test"), &scene, &SourceMap::default()).unwrap();
    let mut world = World::new(scene);
    world.hint(&read.hints);
    world
}

/// Away from everything; at everything; against one another.
const ABSURD: [(&str, &str); 3] = [
    (
        "away",
        r#""casters": [ { "object": "floor", "particles": 0.4, "rays": 1 } ],
           "luminaires": [ { "object": "panel", "particles": 0.5, "shadow-rays": 1 } ],
           "regions": [ { "centre": [90, 0, -90], "radius": 1, "rays": 1 } ],
           "cones": [ { "axis": [0, 0.3, -1], "half-angle": 3, "rays": 1 } ]"#,
    ),
    (
        "everything",
        r#""casters": [ { "object": "mirror", "particles": 1 }, { "object": "ball", "particles": 1 } ],
           "luminaires": [ { "object": "bulb", "shadow-rays": 1 }, { "object": "panel", "shadow-rays": 1 } ],
           "regions": [ { "centre": [0, 0, 0], "radius": 1000 }, { "low": [-2, -2, 0], "high": [2, 2, 0.1] } ],
           "cones": [ { "axis": [1, 0, 0], "half-angle": 180, "rays": 1 } ]"#,
    ),
    (
        "against",
        r#""casters": [ { "object": "ball", "particles": 1 }, { "object": "wall", "particles": 1 } ],
           "luminaires": [ { "object": "panel", "particles": 1, "shadow-rays": 1 } ],
           "regions": [ { "centre": [1, 0.4, 2.2], "radius": 0.2 }, { "centre": [1, 0.4, 2.2], "radius": 0.01, "rays": 1 } ],
           "cones": [ { "axis": [0, 0, 1], "half-angle": 20 }, { "axis": [0, 0, -1], "half-angle": 20 },
                      { "axis": [1, 0, 0.5], "half-angle": 60, "within": { "centre": [0, 0, 0], "radius": 1 } } ],
           "criterion": "value""#,
    ),
];

const POINTS: [([f32; 3], [f32; 3]); 5] = [
    ([0.0, -0.5, 0.0], [0.0, 0.0, 1.0]),
    ([-0.9, 0.5, 0.0], [0.0, 0.0, 1.0]),
    ([-2.0, 0.3, 0.8], [1.0, 0.0, 0.0]),
    ([-2.0, 1.5, 2.0], [1.0, 0.0, 0.0]),
    ([0.5, 0.5, 3.0], [0.0, 0.0, -1.0]),
];

/// Mean irradiance (green) of `n` gathers with its standard error, and the rays they took.
fn estimate(walker: &Walker, at: usize, strategy: Strategy, n: u32) -> ((f64, f64), u64) {
    let (p, normal) = POINTS[at];
    let surface = sensor_surface(Vec3::from(p) + Vec3::from(normal) * 1e-5, Vec3::from(normal));
    let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy };
    let white = hemilux::bsdf::Bsdf::diffuse(Rgb::WHITE);
    let mut tally = Tally::default();
    let mean = statistics(n, |i| {
        let mut sampler = Sampler::new(31 + at as u64, i as u64, 0);
        std::f64::consts::PI * gather(walker, &surface, &white, &plan, &mut sampler, &mut tally)[1] as f64
    });
    (mean, tally.rays)
}

/// 30 comparisons at a false-alarm rate of 1e-4 in all: |z| < 4.65.
const LIMIT: f64 = 4.65;

#[test]
fn absurd_hints_leave_the_mean_of_gathers() {
    let plain = World::new(room());
    let options = ZoneOptions { budget: 800, particles: 1 << 16, seed: 5 };
    // One solution for both, so that gathers alone differ.
    let zones = Zones::solve(&plain, &options);
    let walker = Walker::zonal(&plain, &zones);
    let truth: Vec<(f64, f64)> =
        (0..POINTS.len()).map(|at| estimate(&walker, at, Strategy::Adaptive, 6000).0).collect();
    let mut control = 0.0f64;
    for (name, hints) in ABSURD {
        let world = hinted(room(), hints);
        let walker = Walker::zonal(&world, &zones);
        for strategy in [Strategy::Adaptive, Strategy::Sobol] {
            for (at, truth) in truth.iter().enumerate() {
                let n = if strategy == Strategy::Adaptive { 3000 } else { 6000 };
                let (found, _) = estimate(&walker, at, strategy, n);
                let z = (found.0 - truth.0) / found.1.hypot(truth.1);
                println!("{name} {strategy:?} {at}: {found:?} hinted, {truth:?} plain, z = {z:.2}");
                assert!(z.abs() < LIMIT, "{name}, point {at}: z = {z}");
                // Were a stratum left out of the densities, or counted twice, means would be off by much more.
                control = control.max((1.03 * found.0 - truth.0).abs() / found.1.hypot(truth.1));
            }
        }
        let outcomes = world.hints.outcomes();
        println!("{outcomes:?}");
        assert!(outcomes.iter().any(|o| o.rays > 0), "{name}: no hint was at work");
    }
    assert!(control > LIMIT, "the test is too blunt to see 3 % ({control})");
}

#[test]
fn absurd_hints_leave_the_mean_of_particles() {
    let options = |seed| ZoneOptions { budget: 60, particles: 1 << 17, seed };
    let plain = Zones::solve(&World::new(room()), &options(1));
    let sides = plain.map().len() as u32 * 2;
    // Šidák over some 300 sides: 1e-4 in all is |z| < 5.1.
    let limit = 5.1;
    let mut control = 0.0f64;
    for (k, (name, hints)) in ABSURD.iter().enumerate() {
        let world = hinted(room(), hints);
        let zones = Zones::solve(&world, &options(2 + k as u64));
        let (mut compared, mut worst) = (0, 0.0f64);
        for side in 0..sides {
            let at = |z: &Zones| {
                (
                    z.irradiance(side / 2, side % 2).luminance() as f64,
                    z.standard_error(side / 2, side % 2) as f64,
                )
            };
            let ((a, ea), (b, eb)) = (at(&plain), at(&zones));
            let error = ea.hypot(eb);
            // Sides that a handful of particles met have no standard error to speak of.
            if error > 0.0 && error < 0.1 * a {
                compared += 1;
                worst = worst.max((a - b).abs() / error);
                control = control.max((a - 1.1 * b).abs() / error);
            }
        }
        let l = &zones.ledger;
        let lost = (0..3).map(|c| l.emitted[c] - l.absorbed[c] - l.escaped[c] - l.truncated[c]);
        println!("{name}: {compared} sides, worst z {worst:.2}; {:?}", world.hints.outcomes());
        assert!(compared > 20 && worst < limit, "{name}: {worst} over {compared} sides");
        assert!(
            lost.map(f64::abs).fold(0.0, f64::max) < 1e-6 * l.emitted[1],
            "{name}: the books do not balance"
        );
    }
    assert!(control > limit, "the test is too blunt to see 10 % ({control})");
}

#[test]
fn absurd_hints_leave_the_mean_of_paths() {
    // No zones at all: favoured luminaires at every vertex, hinted strata at the first. Nothing casts, so that paths are
    // quiet enough to tell.
    let plain = World::new(furnished(true));
    let mut control = 0.0f64;
    for (name, hints) in &ABSURD {
        let world = hinted(furnished(true), hints);
        for at in 0..2 {
            let (truth, _) = estimate(&Walker::path(&plain), at, Strategy::Sobol, 6000);
            let (found, _) = estimate(&Walker::path(&world), at, Strategy::Sobol, 6000);
            let error = found.1.hypot(truth.1);
            let z = (found.0 - truth.0) / error;
            println!("{name} {at}: {found:?} hinted, {truth:?} plain, z = {z:.2}");
            assert!(z.abs() < LIMIT, "{name}, point {at}: z = {z}");
            control = control.max((1.05 * found.0 - truth.0).abs() / error);
        }
    }
    assert!(control > LIMIT, "the test is too blunt to see 5 % ({control})");
}

/// An LED, and a sequin that throws its light to a sensor in the shade; everything else is black.
fn sequin() -> Scene {
    let mut scene = empty();
    let black = diffuse(&mut scene, 0.0);
    let shiny = mirror(&mut scene, 0.9);
    cuboid(&mut scene, [-3.0, -3.0, 0.0], [3.0, 3.0, 3.2], true, black);
    quad(&mut scene, [1.5, -0.5, 1.45], [0.0, 0.7, 0.0], [0.0, 0.0, 0.7], black, None);
    sphere(&mut scene, LED, 0.0015, false, black, emission(2e5));
    let (place, half) = (DVec3::from(SEQUIN), halfway());
    let placed = DAffine3::from_translation(place) * turned(half);
    let disk =
        Quadric::Disk { height: 0.0, radius: 0.0025, inner_radius: 0.0, phi_max: std::f64::consts::TAU };
    shape(&mut scene, Geometry::Quadric(disk, placed), shiny, None);
    scene.shapes.last_mut().unwrap().name = "sequin".into();
    scene
}

const LED: [f64; 3] = [0.0, 0.0, 2.4];
const SEQUIN: [f64; 3] = [1.1, 1.6, 0.02];
const SENSOR: [f64; 3] = [2.999, -0.3, 1.2];

/// The rotation about the horizontal that carries z to unit `n`.
fn turned(n: DVec3) -> DAffine3 {
    DAffine3::from_axis_angle(DVec3::Z.cross(n).normalize(), n.z.acos())
}

fn halfway() -> DVec3 {
    let to = |p: [f64; 3]| (DVec3::from(p) - DVec3::from(SEQUIN)).normalize();
    (to(LED) + to(SENSOR)).normalize()
}

#[test]
fn a_good_hint_finds_the_sequin() {
    // The whole LED is seen in the sequin: E = ρ L π (r / d)² cos θ.
    let (d1, d2) = (DVec3::from(LED) - DVec3::from(SEQUIN), DVec3::from(SENSOR) - DVec3::from(SEQUIN));
    let d = d1.length() + d2.length();
    let truth = 0.9 * 2e5 * std::f64::consts::PI * (0.0015 / d).powi(2) * d2.normalize().x;
    let runs = 12;
    let surface = sensor_surface(DVec3::from(SENSOR).as_vec3(), Vec3::NEG_X);
    let white = hemilux::bsdf::Bsdf::diffuse(Rgb::WHITE);
    // Root mean square error of runs of 64 gathers over solutions of their own, times the root of the rays of a gather.
    let error = |hints: Option<&str>| {
        let world = hints.map_or_else(|| World::new(sequin()), |h| hinted(sequin(), h));
        let (mut squares, mut sum, mut rays) = (0.0, 0.0, 0);
        for seed in 0..runs {
            let options = ZoneOptions { budget: 500, particles: 1 << 16, seed };
            let zones = Zones::solve_seen(&world, &options, None, |_| false);
            let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::Adaptive };
            let mut tally = Tally::default();
            let (mean, _) = statistics(64, |i| {
                let mut sampler = Sampler::new(seed, i as u64, 0);
                let walker = Walker::zonal(&world, &zones);
                std::f64::consts::PI
                    * gather(&walker, &surface, &white, &plan, &mut sampler, &mut tally)[1] as f64
            });
            squares += (mean / truth - 1.0).powi(2) / runs as f64;
            sum += mean / truth / runs as f64;
            rays += tally.rays;
        }
        println!(
            "{hints:?}: {:.4} of the truth, error {:.4}, {rays} rays; {:?}",
            sum,
            f64::sqrt(squares),
            world.hints.outcomes()
        );
        let caster = world.hints.outcomes().first().map_or(0.0, |o| o.met as f64 / o.sent.max(1) as f64);
        (sum, squares.sqrt(), (rays as f64 / (64 * runs) as f64).sqrt(), caster)
    };
    let without = error(None);
    let with = error(Some("\"casters\": [ { \"object\": \"sequin\" } ]"));
    // The mean within what its own spread allows: t of 11 degrees of freedom, 1e-5 two-sided.
    assert!((with.0 - 1.0).abs() < 7.0 * with.1 / (runs as f64).sqrt() + 1e-3, "{with:?}");
    let gain = (without.1 * without.2) / (with.1 * with.2);
    println!("error × √rays: {gain:.1} times smaller with the hint");
    assert!(gain > 4.0, "{gain}");
    // A third and more of the particles that are sent meet it; by themselves, one in ten million do.
    assert!(with.3 > 0.3, "{}", with.3);
    // Control: a hint at something else gains nothing.
    let elsewhere = error(Some("\"regions\": [ { \"centre\": [-2, -2, 1], \"radius\": 0.01 } ]"));
    assert!((without.1 * without.2) / (elsewhere.1 * elsewhere.2) < 2.0, "{elsewhere:?}");
}

#[test]
fn windows_of_the_image_take_more_samples_and_keep_the_mean() {
    let render = |hints: Option<&str>| {
        let world = hints.map_or_else(|| World::new(room()), |h| hinted(room(), h));
        let plan = GatherPlan { rays: 1, shadow_rays: 1, strategy: Strategy::Sobol };
        let options = RenderOptions { mode: Mode::Path, plan, seed: 3, max_depth: 4 };
        let mut film = Film::new(32, 32, [0, 32, 0, 32]);
        Renderer::new(&world, None, 32, 32, options).passes(&mut film, 0..32, &AtomicU64::new(0));
        // Mean and variance of the mean, inside and outside of the left half.
        let mut halves = [(0.0, 0.0); 2];
        film.for_each(|x, _, p| {
            let (mean, error) = (p.mean().luminance() as f64, p.standard_error().luminance() as f64);
            let half = &mut halves[(x >= 16) as usize];
            *half = (half.0 + mean / 512.0, half.1 + error * error / (512.0 * 512.0));
        });
        halves
    };
    let (plain, more) =
        (render(None), render(Some("\"image\": [ { \"window\": [0, 0.5, 0, 1], \"samples\": 8 } ]")));
    println!("{plain:?} plain, {more:?} with 8 samples on the left");
    let z = (plain[0].0 - more[0].0) / (plain[0].1 + more[0].1).sqrt();
    assert!(z.abs() < 4.4, "{z}");
    assert_eq!(plain[1], more[1], "the right half is the same to the bit");
    let gain = plain[0].1 / more[0].1;
    assert!((4.0..16.0).contains(&gain), "the variance fell {gain} times, not about 8");
}
