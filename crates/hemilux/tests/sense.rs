//! Readings with intervals: coverage over many seeds, stopping, darkness.

mod common;
use common::*;
use hemilux::sense::{Goal, Reading, Receiver, Sense, SenseOptions};
use hemilux::world::World;
use hemilux::zones::scouts::Scouts;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3, Vec3};
use hemilux_scene::*;
use std::f64::consts::{PI, TAU};
use std::time::Duration;

fn options(goal: Goal, seed: u64) -> SenseOptions {
    SenseOptions {
        receiver: Receiver::Irradiance,
        goal,
        // Far beyond what any test takes, on a busy machine too: none is about time.
        limit: Duration::from_secs(600),
        seed,
        weights: [0.0, 1.0, 0.0],
    }
}

/// Name, world, sensor position and normal, true irradiance.
type Case = (&'static str, World, [f32; 3], [f32; 3], f64);

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let square = |tilt: [f32; 3], truth: f64, name| {
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.0);
        quad(&mut scene, [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], m, emission(1.0));
        (name, World::new(scene), [0.0; 3], tilt, truth)
    };
    cases.push(square([0.0, 0.0, 1.0], 1.740839503, "square overhead"));
    // Tilted to the side: of the vector irradiance only the half above the horizon counts, by symmetry of the square.
    let triangle = |n: [f32; 3], truth: f64, name| {
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.0);
        let positions = [[0.0, 0.0, 2.0], [0.0, 1.0, 2.0], [3.0, 0.0, 2.0]].map(Vec3::from).to_vec();
        scene.meshes.push(Mesh { positions, indices: vec![[0, 1, 2]], ..Mesh::default() });
        shape(&mut scene, Geometry::Mesh(MeshId(0)), m, emission(1.0));
        (name, World::new(scene), [0.0; 3], n, truth)
    };
    cases.push(triangle([0.0, 0.0, 1.0], 0.225353617, "triangle"));
    cases.push(triangle([1.0, 1.0, 1.0], 0.200705027, "triangle, tilted"));
    for (name, g, s, truth) in [
        ("sphere 60 30", 60.0f64, 30.0f64, PI / 8.0),
        ("sphere 80 20", 80.0, 20.0, 0.069150718),
        ("sphere 90 30", 90.0, 30.0, 0.090586074),
        ("sphere 100 20", 100.0, 20.0, 0.005335615),
    ] {
        let (g, s) = (g.to_radians(), s.to_radians());
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.0);
        sphere(&mut scene, [3.0 * g.sin(), 0.0, 3.0 * g.cos()], 3.0 * s.sin(), false, m, emission(1.0));
        cases.push((name, World::new(scene), [0.0; 3], [0.0, 0.0, 1.0], truth));
    }
    for (name, radius, h, d, truth) in
        [("disk", 1.0, 1.0, 1.0, PI * 0.276393202), ("small disk", 0.5, 2.0, 1.5, PI * 0.025658351)]
    {
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.0);
        let q = Quadric::Disk { height: 0.0, radius, inner_radius: 0.0, phi_max: TAU };
        let placed = DAffine3::from_translation(DVec3::new(d, 0.0, h));
        shape(&mut scene, Geometry::Quadric(q, placed), m, emission(1.0));
        scene.shapes[0].reverse_orientation = true;
        cases.push((name, World::new(scene), [0.0; 3], [0.0, 0.0, 1.0], truth));
    }
    // A black square hides part of a uniform sky.
    let mut scene = empty();
    scene.environments.push(Environment::Constant { radiance: Rgb::WHITE });
    let m = diffuse(&mut scene, 0.0);
    quad(&mut scene, [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], m, None);
    cases.push(("sky round a square", World::new(scene), [0.0; 3], [0.0, 0.0, 1.0], PI - 1.740839503));
    for (name, rho1, rho2) in [("concentric spheres", 0.5, 0.5), ("bright concentric spheres", 0.3, 0.8)] {
        let mut scene = empty();
        let (inner, outer) = (diffuse(&mut scene, rho1 as f32), diffuse(&mut scene, rho2 as f32));
        sphere(&mut scene, [0.0; 3], 1.0, false, inner, emission(1.0));
        sphere(&mut scene, [0.0; 3], 2.0, true, outer, None);
        let f = 0.25;
        let b1 = (PI * (1.0 - rho2 * (1.0 - f))) / (1.0 - rho2 * (1.0 - f) - rho1 * rho2 * f);
        let truth = f * b1 / (1.0 - rho2 * (1.0 - f));
        cases.push((name, World::new(scene), [0.0, 0.0, 1.999_999], [0.0, 0.0, -1.0], truth));
    }
    cases
}

/// Twelve sensors, 200 seeds each: the 95 % intervals cover in 94 to 96.5 % of all, and no sensor leaves its binomial
/// 99.9 % band (Šidák over twelve: 181 to 199 of 200).
#[test]
fn intervals_cover_as_often_as_they_say() {
    let cases = cases();
    assert_eq!(cases.len(), 12);
    let (mut covered, mut narrow, mut all) = (0, 0, 0);
    for (name, world, p, n, truth) in &cases {
        let n = Vec3::from(*n).normalize();
        let mut here = 0;
        for seed in 0..200 {
            let sense = Sense::new(world, &[], options(Goal::Gathers(32), seed));
            let r = sense.read(0, Vec3::from(*p), n);
            here += ((r.scalar - truth).abs() <= r.half_width) as u32;
            // Negative control: intervals of half the width must be found out.
            narrow += ((r.scalar - truth).abs() <= 0.5 * r.half_width) as u32;
            all += 1;
        }
        println!("{name}: {here} of 200");
        assert!((181..=199).contains(&here), "{name}: {here} of 200");
        covered += here;
    }
    let share = |n: u32| n as f64 / all as f64;
    println!("pooled coverage {:.4}; with half the width {:.4}", share(covered), share(narrow));
    assert!((0.94..=0.965).contains(&share(covered)), "pooled {}", share(covered));
    assert!(share(narrow) < 0.75);
}

/// Under a uniform sky alone every gather gives π: the interval still holds what single precision rounds away.
#[test]
fn an_answer_without_noise_has_the_interval_of_its_arithmetic() {
    let mut scene = empty();
    scene.environments.push(Environment::Constant { radiance: Rgb::WHITE });
    let world = World::new(scene);
    for seed in 0..50 {
        let r = Sense::new(&world, &[], options(Goal::Gathers(32), seed)).read(0, Vec3::ZERO, Vec3::Z);
        assert!((r.scalar - PI).abs() <= r.half_width && r.half_width < 1e-4, "{r:?}");
    }
}

#[test]
fn a_target_is_met_or_said_to_be_missed() {
    let cases = cases();
    let (_, world, p, n, truth) = &cases[6];
    let n = Vec3::from(*n).normalize();
    let sense = Sense::new(world, &[], options(Goal::RelativeError(0.01), 5));
    let r = sense.read(0, Vec3::from(*p), n);
    assert!(r.met && r.half_width <= 0.01 * r.scalar, "{r:?}");
    assert!((r.scalar - truth).abs() < 3.0 * r.half_width, "{r:?}, truth {truth}");
    let hopeless = SenseOptions { limit: Duration::from_millis(50), ..options(Goal::RelativeError(1e-9), 5) };
    assert!(!Sense::new(world, &[], hopeless).read(0, Vec3::from(*p), n).met);
    // A sensor that nothing reaches reads zero, and that is an answer.
    let turned_away = Sense::new(&cases[0].1, &[], options(Goal::RelativeError(0.01), 5));
    let dark = turned_away.read(1, Vec3::ZERO, -Vec3::Z);
    assert!(dark.met && dark.scalar == 0.0, "{dark:?}");
    let empty_world = World::new(empty());
    let nothing = Sense::new(&empty_world, &[], options(Goal::RelativeError(0.01), 5));
    let r = nothing.read(0, Vec3::ZERO, Vec3::Z);
    assert!(r.met && r.scalar == 0.0 && r.half_width == 0.0);
}

#[test]
fn a_reading_depends_on_seed_and_sensor_only() {
    let cases = cases();
    let (_, world, p, n, _) = &cases[10];
    let read = |index, seed, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let sense = Sense::new(world, &[], options(Goal::Gathers(64), seed));
        pool.install(|| sense.read(index, Vec3::from(*p), Vec3::from(*n))).scalar.to_bits()
    };
    assert_eq!(read(3, 1, 1), read(3, 1, 2));
    assert_ne!(read(3, 1, 1), read(4, 1, 1));
    assert_ne!(read(3, 1, 1), read(3, 2, 1));
}

/// A lamp of 1 cm in a mirrored dome: few rays meet its image, and until some have, the interval must say so.
#[test]
fn an_image_not_yet_met_widens_the_interval() {
    let mut scene = empty();
    let (black, shell) = (diffuse(&mut scene, 0.0), mirror(&mut scene, 0.9));
    sphere(&mut scene, [0.0, 0.0, 2.0], 0.01, false, black, emission(1e4));
    sphere(&mut scene, [0.0; 3], 3.0, true, shell, None);
    let q = Quadric::Disk { height: -0.01, radius: 2.9995, inner_radius: 0.0, phi_max: TAU };
    shape(&mut scene, Geometry::Quadric(q, DAffine3::IDENTITY), black, None);
    let world = World::new(scene);
    // 0.562 direct and 0.778 mirrored for a reflectance of 0.9 at every angle (here Fresnel's, a little less).
    let (direct, truth) = (0.562, 1.340);
    for seed in 0..20 {
        let r = Sense::new(&world, &[], options(Goal::Gathers(32), seed)).read(0, Vec3::X, Vec3::Z);
        assert!((r.scalar - truth).abs() <= r.half_width + 0.03, "{r:?}");
        // Negative control: without the caution most of these intervals would claim the direct part alone.
        assert!(r.unseen > 0.1 || r.scalar > 1.1 * direct, "{r:?}");
    }
}

fn steering(world: &World) -> Zones {
    Zones::solve_seen(world, &ZoneOptions { budget: 1000, particles: 1 << 17, seed: 3 }, None, |_| false)
}

/// A ball of 5 m, diffuse inside, lit by a lamp of 2 mm that shines into a mirror only: every wall is lit by what the mirror throws
/// somewhere, and the irradiance away from it is that of the integrating sphere, whatever the distribution: ρΦ / (A (1 − ρ)). By
/// chance no path meets the lamp; paths that are led do. Control: the same without leading.
#[test]
fn light_that_mirrors_throw_on_other_walls_is_met_where_particles_lead_to_it() {
    let mut scene = empty();
    let (wall, shiny, black) = (diffuse(&mut scene, 0.5), mirror(&mut scene, 0.9), diffuse(&mut scene, 0.0));
    sphere(&mut scene, [0.0; 3], 5.0, true, wall, None);
    quad(&mut scene, [-0.5, -0.5, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], shiny, None);
    let q = Quadric::Disk { height: 0.0, radius: 0.002, inner_radius: 0.0, phi_max: TAU };
    let placed = DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.9));
    shape(&mut scene, Geometry::Quadric(q, placed), black, emission(1e6));
    scene.shapes[2].reverse_orientation = true;
    let world = World::new(scene);
    // 97 % of the flux meets the mirror, which keeps 0.9 of it; the edges of both are worth less than 1 %.
    let flux = PI * 1e6 * PI * 0.002f64.powi(2) * (0.97 * 0.9 + 0.03);
    let truth = 0.5 * flux / (4.0 * PI * 25.0 * 0.5);
    let (p, n) = (Vec3::new(2.997, 0.0, -3.996), Vec3::new(-0.6, 0.0, 0.8));
    let zones = steering(&world);
    let student = |r: &Reading| r.half_width - r.unseen;
    for seed in 0..4 {
        let plain = Sense::new(&world, &[], options(Goal::Gathers(512), seed));
        let blind = plain.read(0, p, n);
        let led = Sense::new(&world, &[], options(Goal::Gathers(512), seed)).steered(&zones).read(0, p, n);
        println!("truth {truth:.4}; led {led:?}; by chance {blind:?}");
        assert!((led.scalar - truth).abs() <= 1.5 * student(&led) + 0.01 * truth, "{led:?}, truth {truth}");
        assert!(student(&led) < 0.15 * truth, "{led:?}");
        // Chance alone finds nothing, and is cautious enough to say so.
        assert!(blind.scalar + student(&blind) < 0.5 * truth && blind.half_width > truth, "{blind:?}");
    }
}

/// A luminous square overhead (1.7408), a sun behind a board, and a mirror that throws its light beside the sensor. The sun's
/// image could hide from gather rays for ever; scouts say where it is.
fn beside_a_mirrored_sun(curved: bool) -> World {
    let mut scene = empty();
    let (black, shiny) = (diffuse(&mut scene, 0.0), mirror(&mut scene, 0.9));
    quad(&mut scene, [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], black, emission(1.0));
    let sun = Vec3::new(0.8, 0.0, 0.6);
    let cos_half_angle = (0.2665f64).to_radians().cos();
    scene.environments.push(Environment::Sun { direction: sun, cos_half_angle, radiance: Rgb::splat(6e6) });
    // The board hides sun and its glare from the sensors, not from the mirror.
    quad(&mut scene, [1.5, -1.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0], black, None);
    if curved {
        sphere(&mut scene, [-3.0, 0.0, 4.0], 0.5, false, shiny, None);
    } else {
        quad(&mut scene, [-3.0, -0.5, 3.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], shiny, None);
    }
    World::new(scene)
}

#[test]
fn a_suns_image_that_is_not_there_is_ruled_out_and_one_that_is_there_is_not() {
    let truth = 1.740839503;
    let world = beside_a_mirrored_sun(false);
    let zones = steering(&world);
    let goal = Goal::RelativeError(0.01);
    // The image is seen at (-0.8, 0, 0.6): from the origin past the mirror.
    let beside = Sense::new(&world, &[], options(goal, 1)).steered(&zones).read(0, Vec3::ZERO, Vec3::Z);
    println!("beside {beside:?}");
    assert!(beside.met && (beside.scalar - truth).abs() <= beside.half_width, "{beside:?}");
    // From 1.25 m higher, beyond the square's edge, into its middle: 0.9 of the sun at a cosine of 0.6.
    let p = Vec3::new(0.0, 0.0, 1.25);
    let there = Sense::new(&world, &[], options(goal, 1)).steered(&zones).read(0, p, Vec3::Z);
    let sun = 0.9 * 0.6 * 6e6 * PI * (0.2665f64).to_radians().sin().powi(2);
    println!("there {there:?}, about {sun}");
    assert!((there.scalar / sun - 1.0).abs() < 0.02 && there.half_width < 0.05 * sun, "{there:?}");
    // Control: a sensor in the sun's reflection that nothing leads to it must not be told that there is none.
    let lost = Sense::new(&world, &[], options(Goal::Gathers(64), 1)).read(0, p, Vec3::Z);
    assert!(lost.half_width > 0.5 * sun || (lost.scalar / sun - 1.0).abs() < 0.1, "{lost:?}");
    // Where the mirror is curved, scouts do not pretend to tell.
    assert!(Scouts::send(&world, 1 << 14, 1, 1e5).is_some_and(|s| s.images.len() == 1));
    assert!(Scouts::send(&beside_a_mirrored_sun(true), 1 << 14, 1, 1e5).is_none());
}

/// A sensor in the dark of a scene with a mirror: done when what might be unseen is small against what the scene's surfaces receive.
#[test]
fn darkness_among_mirrors_is_an_answer() {
    let mut scene = empty();
    let (black, shiny) = (diffuse(&mut scene, 0.0), mirror(&mut scene, 0.9));
    quad(&mut scene, [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], black, emission(1.0));
    quad(&mut scene, [-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], black, None);
    quad(&mut scene, [-1.2, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 2.0, 0.0], shiny, None);
    let candle = scene.clone();
    let world = World::new(scene);
    let zones = steering(&world);
    let read = |world: &World, zones: &Zones| {
        let goal = options(Goal::RelativeError(0.01), 1);
        let sense = Sense::new(world, &[], SenseOptions { limit: Duration::from_secs(2), ..goal });
        sense.steered(zones).read(0, Vec3::new(0.0, 0.0, -0.5), -Vec3::Z)
    };
    let dark = read(&world, &zones);
    println!("{dark:?}");
    assert!(dark.met && dark.scalar == 0.0 && dark.half_width > 0.0 && dark.half_width < 0.01, "{dark:?}");
    // By a candle of a billionth of that brightness (π × 1e-9 / 2.25 of irradiance) a sensor knows no more of the mirror than in the dark.
    let mut scene = candle;
    let faint = diffuse(&mut scene, 0.0);
    quad(&mut scene, [-0.5, -0.5, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], faint, emission(1e-9));
    let world_by_candle = World::new(scene);
    let by_candle = read(&world_by_candle, &steering(&world_by_candle));
    println!("{by_candle:?}");
    assert!(
        (1e-10..1e-9).contains(&by_candle.scalar) && by_candle.half_width > 1e-7 && !by_candle.met,
        "{by_candle:?}"
    );
    // Control: without particles nobody knows how bright the scene is.
    let limit = Duration::from_millis(200);
    let blind = Sense::new(&world, &[], SenseOptions { limit, ..options(Goal::RelativeError(0.01), 1) });
    assert!(!blind.read(0, Vec3::new(0.0, 0.0, -0.5), -Vec3::Z).met);
}
