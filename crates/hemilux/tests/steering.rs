//! What steers gathers (records, predicted field radiance, aimed particles) changes their noise and nothing else.
//!
//! Over one frozen zonal solution, gathers with strategy `adaptive` against plain Sobol' points, at many points of rooms with
//! mirrors, glass and water-like facets: a z-test per point, Šidák over all, and a control that must be found out.

mod common;
use common::*;
use hemilux::gather::{GatherPlan, Strategy, gather};
use hemilux::sampler::Sampler;
use hemilux::sense::{Goal, Receiver, Sense, SenseOptions};
use hemilux::sensor::sensor_surface;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::*;

/// A room with a lamp, a wall mirror and a ball of `caster`; `tilted` adds facets that throw many images.
fn room(mirrored: bool, glass: bool, tilted: bool) -> World {
    let mut scene = empty();
    let white = diffuse(&mut scene, 0.6);
    let wall = if mirrored { mirror(&mut scene, 0.9) } else { diffuse(&mut scene, 0.0) };
    let black = diffuse(&mut scene, 0.0);
    let roughness = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
    let ball = match glass {
        true => material(&mut scene, MaterialKind::Dielectric { eta: 1.5, roughness }),
        false => mirror(&mut scene, 0.9),
    };
    sphere(&mut scene, [1.0, 0.4, 2.2], 0.12, false, black, emission(50.0));
    sphere(&mut scene, [-0.4, 0.6, 0.45], 0.4, false, ball, None);
    quad(&mut scene, [2.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0], wall, None);
    quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], white, None);
    quad(&mut scene, [-2.0, -2.0, 0.0], [0.0, 0.0, 3.0], [0.0, 4.0, 0.0], white, None);
    quad(&mut scene, [-2.0, -2.0, 3.0], [0.0, 4.0, 0.0], [4.0, 0.0, 0.0], white, None);
    if tilted {
        let shiny = mirror(&mut scene, 0.9);
        for i in 0..5 {
            let y = -1.5 + 0.6 * i as f32;
            quad(
                &mut scene,
                [-1.9, y, 1.0],
                [0.1 * (i as f32 - 2.0), 0.4, 0.0],
                [0.08, 0.0, 0.4],
                shiny,
                None,
            );
        }
    }
    World::new(scene)
}

const POINTS: [([f32; 3], [f32; 3]); 8] = [
    ([0.0, -0.5, 0.0], [0.0, 0.0, 1.0]),
    ([-1.2, 0.5, 0.0], [0.0, 0.0, 1.0]),
    ([1.2, 1.2, 0.0], [0.0, 0.0, 1.0]),
    ([-0.5, 1.6, 0.0], [0.0, 0.0, 1.0]),
    ([-2.0, 0.3, 0.8], [1.0, 0.0, 0.0]),
    ([-2.0, 1.5, 2.0], [1.0, 0.0, 0.0]),
    ([0.5, 0.5, 3.0], [0.0, 0.0, -1.0]),
    ([-0.6, -1.0, 3.0], [0.0, 0.0, -1.0]),
];

/// Mean irradiance (green) of `n` gathers at a point, its standard error, and the surprise.
fn estimate(world: &World, zones: &Zones, at: usize, strategy: Strategy, n: u32) -> ((f64, f64), f64) {
    let (p, normal) = POINTS[at];
    let surface = sensor_surface(Vec3::from(p) + Vec3::from(normal) * 1e-5, Vec3::from(normal));
    let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy };
    let white = hemilux::bsdf::Bsdf::diffuse(Rgb::WHITE);
    let walker = Walker::zonal(world, zones);
    let mut tally = Tally::default();
    let mean = statistics(n, |i| {
        let mut sampler = Sampler::new(71 + at as u64, i as u64, 0);
        std::f64::consts::PI * gather(&walker, &surface, &white, &plan, &mut sampler, &mut tally)[1] as f64
    });
    (mean, tally.surprise / tally.gathered)
}

fn solve(world: &World) -> Zones {
    Zones::solve(world, &ZoneOptions { budget: 800, particles: 1 << 17, seed: 5 })
}

/// Šidák over 24 points at a false-alarm rate of 1e-4 in all: |z| < 4.6.
const LIMIT: f64 = 4.6;

#[test]
fn steered_and_plain_gathers_have_one_mean() {
    let (mut worst, mut worst_control, mut gain) = (0.0f64, 0.0f64, 0.0);
    for (name, glass, tilted) in [("ball", false, false), ("glass", true, false), ("facets", false, true)] {
        let world = room(true, glass, tilted);
        let zones = solve(&world);
        for at in 0..POINTS.len() {
            let (steered, _) = estimate(&world, &zones, at, Strategy::Adaptive, 2000);
            let (plain, _) = estimate(&world, &zones, at, Strategy::Sobol, 16_000);
            let error = steered.1.hypot(plain.1);
            let z = (steered.0 - plain.0) / error;
            println!("{name} {at}: {steered:?} steered, {plain:?} plain, z = {z:.2}");
            assert!(z.abs() < LIMIT, "{name}, point {at}: z = {z}");
            worst = worst.max(z.abs());
            // Control: densities that are 3 % too low somewhere would show like this.
            worst_control = worst_control.max((1.03 * steered.0 - plain.0).abs() / error);
            gain += (plain.1 * plain.1 * 16_000.0) / (steered.1 * steered.1 * 2000.0) / 24.0;
        }
    }
    println!(
        "worst z {worst:.2}, of the control {worst_control:.2}; variance ratio {gain:.1} at equal gathers"
    );
    assert!(worst_control > LIMIT, "the test is too blunt to see 3 %");
}

/// A mirror that no particle has met (they were traced in the same room with a black wall in its place): plain and steered
/// gathers still agree, and the steered ones say that they were surprised.
#[test]
fn a_hidden_caster_is_found_without_bias_and_with_surprise() {
    let (world, blind) = (room(true, false, false), room(false, false, false));
    let (hidden, known) = (solve(&blind), solve(&world));
    let (mut surprised, mut calm) = (0.0, 0.0);
    for at in 0..POINTS.len() {
        let (steered, u) = estimate(&world, &hidden, at, Strategy::Adaptive, 12_000);
        let (plain, _) = estimate(&world, &hidden, at, Strategy::Sobol, 16_000);
        let z = (steered.0 - plain.0) / steered.1.hypot(plain.1);
        assert!(z.abs() < LIMIT, "point {at}: {steered:?} and {plain:?}, z = {z}");
        surprised += u / POINTS.len() as f64;
        calm += estimate(&world, &known, at, Strategy::Adaptive, 2000).1 / POINTS.len() as f64;
    }
    println!("surprise {surprised:.4} with the mirror hidden, {calm:.4} without");
    assert!(surprised > 0.03 && calm < 0.5 * surprised, "{surprised} and {calm}");
}

/// Sensors say so too, each for itself and as its first rays see it: the image of the lamp in a mirror that no particle has met is a
/// surprise, and none where they were traced with it.
#[test]
fn a_sensor_says_how_much_nothing_had_led_to() {
    let wall = |mirrored: bool| {
        let mut scene = empty();
        let (white, black) = (diffuse(&mut scene, 0.6), diffuse(&mut scene, 0.0));
        let wall = if mirrored { mirror(&mut scene, 0.9) } else { black };
        sphere(&mut scene, [1.0, 0.4, 2.2], 0.12, false, black, emission(50.0));
        quad(&mut scene, [2.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0], wall, None);
        quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], white, None);
        World::new(scene)
    };
    let world = wall(true);
    let (hidden, known) = (solve(&wall(false)), solve(&world));
    let options = SenseOptions {
        receiver: Receiver::Irradiance,
        goal: Goal::Gathers(8000),
        limit: std::time::Duration::from_secs(600),
        seed: 3,
        weights: [0.0, 1.0, 0.0],
    };
    for p in [[0.0, -0.5, 0.5], [-1.2, 0.5, 0.2], [1.2, 1.2, 0.0]] {
        let by_paths = |zones| Sense::new(&world, &[], options).steered(zones);
        let corrected = |zones| Sense::corrected(&world, std::slice::from_ref(zones), options);
        let over_zones = |zones| Sense::new(&world, std::slice::from_ref(zones), options);
        let surprise = |s: Sense| s.read(0, Vec3::from(p) + Vec3::Z * 1e-4, Vec3::Z).surprise.unwrap();
        for (name, hidden, known) in [
            ("paths", surprise(by_paths(&hidden)), surprise(by_paths(&known))),
            ("corrected", surprise(corrected(&hidden)), surprise(corrected(&known))),
            ("zonal", surprise(over_zones(&hidden)), surprise(over_zones(&known))),
        ] {
            println!("{name} at {p:?}: surprise {hidden:.4} with the mirror hidden, {known:.4} without");
            assert!(hidden > 0.03 && known < 0.01, "{name} at {p:?}: {hidden} and {known}");
        }
        // One ray has no strata.
        let along = SenseOptions { receiver: Receiver::Radiance, goal: Goal::Gathers(16), ..options };
        let ray = Sense::new(&world, &[], along).steered(&known);
        assert_eq!(ray.read(0, Vec3::from(p), Vec3::X).surprise, None);
    }
}
