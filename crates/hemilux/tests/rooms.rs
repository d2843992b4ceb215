//! Interreflection against closed forms, flux books, leaks, determinism: path tracing, zones and gathers over zones.

mod common;
use common::*;
use hemilux::film::Film;
use hemilux::render::{Mode, RenderOptions, Renderer, Stop};
use hemilux::sampler::Sampler;
use hemilux::sensor::irradiance;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::zones::broad::Broad;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::*;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, AtomicU64};

fn options(mode: Mode) -> RenderOptions {
    RenderOptions { mode, plan: PLAN, seed: 3, max_depth: u32::MAX }
}

/// Mean radiance (green) of a picture with its standard error over pixels of independent samples.
fn picture_mean(world: &World, zones: Option<&Zones>, mode: Mode, passes: u32) -> (f64, f64) {
    let renderer = Renderer::new(world, zones, 32, 32, options(mode));
    let mut film = Film::new(32, 32, [0, 32, 0, 32]);
    renderer.passes(&mut film, 0..passes, &AtomicU64::new(0));
    let mut values = Vec::new();
    film.for_each(|_, _, p| values.push(p.mean()[1] as f64));
    statistics(values.len() as u32, |i| values[i as usize])
}

fn zonal_irradiance(world: &World, zones: &Zones, p: [f32; 3], n: [f32; 3], count: u32) -> (f64, f64) {
    let walker = Walker::zonal(world, zones);
    statistics(count, |i| {
        let mut sampler = Sampler::new(11, i as u64, 0);
        irradiance(
            &walker,
            Vec3::from(p),
            Vec3::from(n).normalize(),
            &PLAN,
            &mut sampler,
            &mut Tally::default(),
        )[1] as f64
    })
}

/// Inside of a sphere that emits Le and reflects ρ: L = Le / (1 − ρ) everywhere.
#[test]
fn furnace_of_an_emitting_sphere() {
    for (le, rho, truth) in [(0.5, 0.5, 1.0), (1.0, 0.8, 5.0), (0.1, 0.9, 1.0)] {
        let mut scene = empty();
        let m = diffuse(&mut scene, rho);
        sphere(&mut scene, [0.0; 3], 1.0, true, m, emission(le));
        let world = World::new(scene);
        let path = picture_mean(&world, None, Mode::Path, 64);
        assert_is("furnace, path", path, truth, truth * 1.05);
        let zones = Zones::solve(&world, &ZoneOptions { budget: 500, particles: 1 << 18, seed: 1 });
        let (mean, _) = picture_mean(&world, Some(&zones), Mode::Zonal, 4);
        println!("furnace, zonal: {mean}");
        // The zones' own noise (262,144 particles) is common to all pixels: 0.5 % is ten times it.
        assert!((mean / truth - 1.0).abs() < 0.005, "zonal furnace {mean}, truth {truth}");
    }
}

/// A small lamp of intensity I at the centre of a diffuse sphere: the wall's radiance is ρ I / (π R² (1 − ρ)).
#[test]
fn lamp_at_the_centre_of_a_sphere() {
    let mut scene = empty();
    let (wall, black) = (diffuse(&mut scene, 0.5), diffuse(&mut scene, 0.0));
    sphere(&mut scene, [0.0; 3], 1.0, true, wall, None);
    let r = 1e-3;
    // I = π: radiance of the lamp I / (π r²).
    sphere(&mut scene, [0.0; 3], r, false, black, emission((1.0 / (r * r)) as f32));
    scene.camera.to_world = geom::DAffine3::from_translation(geom::DVec3::new(0.0, 0.0, 0.1));
    let world = World::new(scene);
    let path = picture_mean(&world, None, Mode::Path, 64);
    assert_is("lamp in sphere, path", path, 1.0, 0.975);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 500, particles: 1 << 18, seed: 1 });
    let (mean, _) = picture_mean(&world, Some(&zones), Mode::Zonal, 4);
    assert!((mean - 1.0).abs() < 0.005, "zonal: {mean}");
}

/// Concentric spheres: exact interreflection with occlusion.
#[test]
fn concentric_spheres() {
    for (rho1, rho2) in [(0.0f64, 0.5f64), (0.5, 0.5), (0.3, 0.8)] {
        let mut scene = empty();
        let (inner, outer) = (diffuse(&mut scene, rho1 as f32), diffuse(&mut scene, rho2 as f32));
        sphere(&mut scene, [0.0; 3], 1.0, false, inner, emission(1.0));
        sphere(&mut scene, [0.0; 3], 2.0, true, outer, None);
        let world = World::new(scene);
        // B1 = π + ρ1 B2, B2 = ρ2 (F B1 + (1 − F) B2), F = 1/4; irradiance on the outer sphere is B2 / ρ2.
        let f = 0.25;
        let b1 = (PI * (1.0 - rho2 * (1.0 - f))) / (1.0 - rho2 * (1.0 - f) - rho1 * rho2 * f);
        let b2 = rho2 * f * b1 / (1.0 - rho2 * (1.0 - f));
        let truth = b2 / rho2;
        let p = [0.0, 0.0, 1.999_999];
        let path = path_irradiance(&world, p, [0.0, 0.0, -1.0], 6000);
        assert_is("concentric, path", path, truth, truth * 1.03);
        let zones = Zones::solve(&world, &ZoneOptions { budget: 4000, particles: 1 << 19, seed: 5 });
        let zonal = zonal_irradiance(&world, &zones, p, [0.0, 0.0, -1.0], 3000);
        println!("concentric ({rho1}, {rho2}) zonal: {zonal:?}, truth {truth}");
        assert!((zonal.0 / truth - 1.0).abs() < 0.01, "zonal {zonal:?}, truth {truth}");
    }
}

fn room(rho: f32) -> (Scene, f64, f64) {
    let mut scene = empty();
    let m = diffuse(&mut scene, rho);
    cuboid(&mut scene, [0.0; 3], [4.0, 3.0, 2.5], true, m);
    sphere(&mut scene, [1.0, 1.0, 1.5], 0.1, false, m, emission(50.0));
    let power = 50.0 * PI * 4.0 * PI * 0.01;
    let area = 2.0 * (12.0 + 7.5 + 10.0) + 4.0 * PI * 0.01;
    (scene, power, area)
}

/// Grey enclosure of any shape: the mean incident irradiance over all surfaces is Φ / (S (1 − ρ)), exactly; and the
/// zones hold exactly what the particles brought.
#[test]
fn grey_enclosure_and_the_books() {
    let (scene, power, area) = room(0.6);
    let world = World::new(scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 3000, particles: 1 << 19, seed: 2 });
    let total: f64 = zones.map().areas().iter().map(|&a| a as f64).sum();
    assert!((total / area - 1.0).abs() < 1e-6, "areas sum to {total}, surface is {area}");
    let mut incident = 0.0;
    for z in 0..zones.map().len() {
        for side in 0..2 {
            incident += zones.irradiance(z as u32, side)[1] as f64 * zones.map().areas()[z] as f64;
        }
    }
    let l = &zones.ledger;
    // Zones keep their irradiance in single precision: sum A E agrees with the books to that; the books to 1e-9.
    assert!((incident / l.incident[1] - 1.0).abs() < 1e-6, "{incident} in zones, {} arrived", l.incident[1]);
    for c in 0..3 {
        let gone = l.absorbed[c] + l.escaped[c] + l.truncated[c];
        assert!((gone / l.emitted[c] - 1.0).abs() < 1e-9, "emitted {}, gone {gone}", l.emitted[c]);
        assert_eq!((l.escaped[c], l.truncated[c]), (0.0, 0.0), "a closed room lets nothing out");
    }
    assert!((l.emitted[1] / power - 1.0).abs() < 1e-5);
    // Statistical: roulette makes the number of bounces random. Relative standard deviation per particle is about
    // √ρ, so 0.0011 here; 4.4 of them.
    let mean = incident / area;
    let truth = power / (area * 0.4);
    assert!(
        (mean / truth - 1.0).abs() < 4.4 * 0.6f64.sqrt() / (zones.particles as f64).sqrt(),
        "{mean}, truth {truth}"
    );
    // Negative control: without interreflection it would be Φ / S.
    assert!((mean / (power / area) - 1.0).abs() > 1.0);
}

/// Two rooms behind a wall of 1 mm, one of them lit: the other is exactly black in every mode.
#[test]
fn nothing_leaks_through_a_millimetre() {
    let mut scene = empty();
    let m = diffuse(&mut scene, 0.8);
    cuboid(&mut scene, [-2.0, -1.0, -1.0], [-0.0005, 1.0, 1.0], true, m);
    cuboid(&mut scene, [0.0005, -1.0, -1.0], [2.0, 1.0, 1.0], true, m);
    sphere(&mut scene, [-1.0, 0.2, 0.3], 0.2, false, m, emission(1000.0));
    // The camera stands in the dark room and looks at the common wall.
    // z to −x: looking along −x from the dark room.
    let turn = geom::DAffine3::from_rotation_y(-std::f64::consts::FRAC_PI_2);
    scene.camera.to_world = geom::DAffine3::from_translation(geom::DVec3::new(1.7, 0.3, 0.1)) * turn;
    let world = World::new(scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 3000, particles: 1 << 19, seed: 2 });
    for (mode, passes) in [(Mode::Path, 256), (Mode::Zonal, 32), (Mode::Zones, 1)] {
        let renderer = Renderer::new(&world, Some(&zones), 32, 32, options(mode));
        let mut film = Film::new(32, 32, [0, 32, 0, 32]);
        renderer.passes(&mut film, 0..passes, &AtomicU64::new(0));
        film.for_each(|x, y, p| assert_eq!(p.mean(), Rgb::BLACK, "{mode:?} leaks at ({x}, {y})"));
    }
    // Negative control: the lit room is not black.
    let lit = zonal_irradiance(&world, &zones, [-0.0006, 0.0, 0.0], [-1.0, 0.0, 0.0], 4);
    assert!(lit.0 > 1.0, "{lit:?}");
}

/// Diffuse dome on a mirror floor with a lamp just above it: as a whole sphere with twice the lamp. Chains and
/// interreflection through the mirror, zones included.
#[test]
fn dome_on_a_mirror_floor() {
    let mut scene = empty();
    let (wall, black) = (diffuse(&mut scene, 0.5), diffuse(&mut scene, 0.0));
    // r = 1: reflects everything at every angle.
    let floor = mirror(&mut scene, 1.0);
    let q = Quadric::Sphere { radius: 2.0, z_min: 0.0, z_max: 2.0, phi_max: std::f64::consts::TAU };
    shape(&mut scene, Geometry::Quadric(q, geom::DAffine3::IDENTITY), wall, None);
    scene.shapes[0].reverse_orientation = true;
    quad(&mut scene, [-3.0, -3.0, 0.0], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0], floor, None);
    // The mean over the dome does not depend on where the lamp hangs; high enough not to stand in its own image.
    let (r, intensity) = (0.02, 10.0);
    let le = intensity / (PI * r * r);
    sphere(&mut scene, [0.0, 0.0, 0.5], r, false, black, emission(le as f32));
    let world = World::new(scene);
    let truth = 2.0 * 0.5 * intensity / (PI * 4.0 * 0.5) / 0.5 * PI; // irradiance on the dome: L π / ρ
    let zones = Zones::solve(&world, &ZoneOptions { budget: 2000, particles: 1 << 19, seed: 2 });
    assert!(zones.has_caustics());
    let dome: Vec<u32> = (0..zones.map().len() as u32).collect();
    let (mut flux, mut area) = (0.0, 0.0);
    for z in dome {
        let e = zones.irradiance(z, 0)[1] as f64;
        let a = zones.map().areas()[z as usize] as f64;
        // The floor is a mirror and takes no deposits; the lamp is black and tiny.
        if e > 0.0 && a > 1e-3 {
            flux += e * a;
            area += a;
        }
    }
    println!("dome on a mirror: mean E {} over {area} m², truth {truth}", flux / area);
    assert!((area / (8.0 * PI) - 1.0).abs() < 1e-3);
    assert!((flux / area / truth - 1.0).abs() < 0.01);
    // Negative control: without the mirror the dome would have half the lamp and lose the lower half of the rest.
    assert!((flux / area / (truth / 2.0) - 1.0).abs() > 0.5);
}

/// The same bits with one thread and with two, and from two halves merged.
#[test]
fn threads_and_halves_do_not_show() {
    let (mut scene, _, _) = room(0.6);
    scene.camera.to_world = geom::DAffine3::from_translation(geom::DVec3::new(2.0, 1.5, 0.2));
    let world = World::new(scene);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let zones = Zones::solve(&world, &ZoneOptions { budget: 1000, particles: 1 << 17, seed: 2 });
            let renderer = Renderer::new(&world, Some(&zones), 40, 24, options(Mode::Zonal));
            let mut film = Film::new(40, 24, [0, 40, 0, 24]);
            let never = AtomicBool::new(false);
            renderer.run(&mut film, Stop { passes: 6, deadline: None }, &never, |_| ());
            (film, zones)
        })
    };
    let ((one, zones), (two, _)) = (solve(1), solve(2));
    assert_eq!(one, two);
    // Passes in two halves, the second first.
    let renderer = Renderer::new(&world, Some(&zones), 40, 24, options(Mode::Zonal));
    let (mut late, mut early) = (Film::new(40, 24, [0, 40, 0, 24]), Film::new(40, 24, [0, 40, 0, 24]));
    renderer.passes(&mut late, 3..6, &AtomicU64::new(0));
    renderer.passes(&mut early, 0..3, &AtomicU64::new(0));
    late.merge(&early).unwrap();
    assert_eq!(one, late);
    // Negative control: another seed is another picture.
    let other = RenderOptions { seed: 4, ..options(Mode::Zonal) };
    let mut film = Film::new(40, 24, [0, 40, 0, 24]);
    Renderer::new(&world, Some(&zones), 40, 24, other).passes(&mut film, 0..6, &AtomicU64::new(0));
    assert_ne!(one, film);
}

/// A solution written and read back is the same; damaged, foreign and truncated files are refused.
#[test]
fn zone_files_round_trip_and_refuse_damage() {
    let (scene, _, _) = room(0.6);
    let world = World::new(scene);
    let options = ZoneOptions { budget: 500, particles: 1 << 14, seed: 2 };
    let zones = Zones::solve(&world, &options);
    let mut bytes = Vec::new();
    zones.write(&world, options.budget, &mut bytes).unwrap();
    let back = Zones::read(&world, &bytes).unwrap();
    for z in 0..zones.map().len() as u32 {
        for side in 0..2 {
            assert_eq!(zones.irradiance(z, side), back.irradiance(z, side));
            assert_eq!(zones.standard_error(z, side), back.standard_error(z, side));
        }
    }
    for cut in [0, 7, 8, 40, bytes.len() / 2, bytes.len() - 1] {
        assert!(Zones::read(&world, &bytes[..cut]).is_err(), "cut at {cut}");
    }
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 4;
    assert!(Zones::read(&world, &flipped).is_err());
    let (mut other, _, _) = room(0.6);
    other.content_hash = 99;
    let text = Zones::read(&World::new(other), &bytes).unwrap_err().to_string();
    assert!(text.starts_with("made from another scene"), "{text}");
}

/// A quadrilateral of given irradiance answers: the mean over one square of what another sends is its form factor.
#[test]
fn form_factors_of_squares_by_particles() {
    // Parallel unit squares at distance 1, 2 × 2 at 1, 1 × 1 at 2; perpendicular ones with a common edge.
    for (side, distance, truth) in
        [(1.0f32, 1.0f32, 0.199824896), (2.0, 1.0, 0.415253284), (1.0, 2.0, 0.068589589)]
    {
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.0);
        quad(&mut scene, [0.0; 3], [side, 0.0, 0.0], [0.0, side, 0.0], m, emission(1.0));
        quad(&mut scene, [0.0, 0.0, distance], [0.0, side, 0.0], [side, 0.0, 0.0], m, None);
        assert_form_factor(scene, side as f64, truth, &format!("parallel {side} at {distance}"));
    }
    for (height, truth) in [(1.0f32, 0.200043776), (2.0, 0.232852603)] {
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.0);
        quad(&mut scene, [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], m, emission(1.0));
        quad(&mut scene, [0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, height], m, None);
        assert_form_factor(scene, 1.0, truth, &format!("perpendicular, height {height}"));
    }
}

fn assert_form_factor(scene: Scene, side: f64, truth: f64, what: &str) {
    let world = World::new(scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 200, particles: 1 << 19, seed: 4 });
    let map = zones.map();
    let incident = |z: u32| {
        (0..2).map(|s| zones.irradiance(z, s)[1] as f64).sum::<f64>() * map.areas()[z as usize] as f64
    };
    let received: f64 = (0..map.len() as u32).map(incident).sum();
    let f = received / (PI * side * side);
    // A particle arrives or not: binomial, and stratification can only help. 4.4 standard deviations.
    let sd = (truth * (1.0 - truth) / zones.particles as f64).sqrt();
    println!("{what}: {f:.6}, truth {truth:.6}, sd {sd:.6}");
    assert!((f - truth).abs() < 4.4 * sd, "{what}: {f}, truth {truth}");
    assert!((f - truth * 1.03).abs() > 4.4 * sd, "cannot tell three per cent");
}

/// A board 1 cm before a wall, both facing the same way: the wall's zones do not take the board's irradiance.
#[test]
fn a_board_before_a_wall_shades_it() {
    let mut scene = empty();
    let m = diffuse(&mut scene, 0.0);
    quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], m, None);
    quad(&mut scene, [-1.0, -1.0, 0.01], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], m, None);
    sphere(&mut scene, [0.0, 0.0, 3.0], 0.2, false, m, emission(100.0));
    let world = World::new(scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 2000, particles: 1 << 19, seed: 4 });
    let below = |x: f32, y: f32, z: f32| {
        let s = world.closest(Vec3::new(x, y, z), Vec3::NEG_Z, f32::INFINITY).unwrap();
        let place = zones.locate(&world, &s, [0.5, 0.5]);
        zones.irradiance(place.zone, place.side)[1]
    };
    // From between board and wall, a hand's breadth inside the board's rim: exactly dark.
    assert_eq!(below(0.5, 0.3, 0.005), 0.0);
    assert_eq!(below(-0.8, 0.8, 0.005), 0.0);
    assert!(
        below(0.5, 0.3, 1.0) > 1.0 && below(1.6, 0.0, 1.0) > 0.5,
        "negative control: both are lit from above"
    );
}

/// Mirrored and stretched instances: a lamp inside a placed glass-free shell, seen through its transform, keeps sides.
#[test]
fn a_mirrored_instance_keeps_its_outside_outside() {
    let mut scene = empty();
    let m = diffuse(&mut scene, 0.5);
    sphere(&mut scene, [0.0; 3], 1.0, false, m, None);
    let shell = scene.shapes.pop().unwrap();
    scene.objects.push(Object { name: "ball".into(), shapes: vec![shell] });
    for scale in [geom::DVec3::new(1.0, 2.0, 0.5), geom::DVec3::new(-1.0, 2.0, 0.5)] {
        let mut scene = scene.clone();
        scene.instances.push(Instance { object: 0, to_world: geom::DAffine3::from_scale(scale) });
        let world = World::new(scene);
        for d in [Vec3::X, Vec3::Y, Vec3::new(0.3, -0.2, 0.9).normalize()] {
            let s = world.closest(d * 10.0, -d, f32::INFINITY).unwrap();
            assert!(s.is_front(d), "{scale}: outside seen from {d}");
            // The normal of an ellipsoid at p is along p / axes².
            let a = scale.as_vec3();
            let n = (s.p / (a * a)).normalize();
            assert!((s.ng - n).length() < 1e-4, "{} and {n}", s.ng);
        }
    }
}

/// Dark and light stripes, narrower than pixels, under a uniform sky. What is expected of surfaces, right or absurd, changes
/// no mean; the right expectation takes most of the variance.
#[test]
fn expectations_change_no_mean() {
    let mut scene = empty();
    let black = diffuse(&mut scene, 0.0);
    let stripes = [diffuse(&mut scene, 0.2), diffuse(&mut scene, 0.7)];
    sphere(&mut scene, [0.0; 3], 20.0, true, black, emission(1.0));
    for i in 0..64 {
        let x = -2.0 + i as f32 / 16.0;
        quad(&mut scene, [x, -2.0, 2.0], [0.0, 4.0, 0.0], [1.0 / 16.0, 0.0, 0.0], stripes[i % 2], None);
    }
    let world = World::new(scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 4000, particles: 1 << 18, seed: 1 });
    let sides = zones.map().len() * 2;
    let key = hemiquad::points::Key::new(5);
    let absurd = Broad::given((0..sides).map(|i| Rgb::splat(20.0 * key.uniform(i as u32))).collect());
    let nothing = Broad::given(vec![Rgb::BLACK; sides]);
    let picture = |expected: Option<&Broad>, seed: u64| {
        let mut renderer = Renderer::new(&world, Some(&zones), 12, 12, options(Mode::Zonal)).with_seed(seed);
        if let Some(expected) = expected {
            renderer = renderer.expecting(expected);
        }
        let mut film = Film::new(12, 12, [0, 12, 0, 12]);
        renderer.passes(&mut film, 0..1, &AtomicU64::new(0));
        let mut values = Vec::new();
        film.for_each(|_, _, p| values.push(p.mean()[1] as f64));
        values.iter().sum::<f64>() / values.len() as f64
    };
    let mean = |expected: Option<&Broad>| statistics(400, |i| picture(expected, i as u64));
    let [right, wrong, none] = [None, Some(&absurd), Some(&nothing)].map(mean);
    println!("expected by zones {right:?}, absurd {wrong:?}, nothing {none:?}");
    // Half of what is seen is dark; E = π.
    for (what, value) in [("by zones", right), ("absurd", wrong), ("nothing", none)] {
        assert_is(what, value, 0.45, 0.5);
    }
    assert!(right.1 < 0.5 * none.1, "{right:?} {none:?}");
    // Control: absurd expectations do cost noise, so they are used.
    assert!(wrong.1 > 2.0 * none.1, "{wrong:?} {none:?}");
}
