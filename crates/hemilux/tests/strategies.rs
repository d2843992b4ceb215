//! The report's strategies in the gather: what is unbiased is so, what is biased is found out, and none is blind to mirrors.

mod common;
use common::*;
use hemilux::bsdf::Bsdf;
use hemilux::gather::{GatherPlan, Strategy, gather};
use hemilux::sampler::Sampler;
use hemilux::sensor::sensor_surface;
use hemilux::strategies::{self, Known, NAMES, Report, virtual_cones};
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::*;
use std::f64::consts::PI;

const POWER: f64 = 100.0;

/// A lamp at (1, 0, 2) over a black floor, beside a flat mirror that shows it at (3, 0, 2).
fn lamp_and_mirror(radius: f64) -> World {
    let mut scene = empty();
    let (black, shiny) = (diffuse(&mut scene, 0.0), mirror(&mut scene, 1.0));
    let radiance = POWER / (4.0 * PI * PI * radius * radius);
    sphere(&mut scene, [1.0, 0.0, 2.0], radius, false, black, emission(radiance as f32));
    quad(&mut scene, [2.0, -3.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 5.0], shiny, None);
    quad(&mut scene, [-1.0, -1.5, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], black, None);
    World::new(scene)
}

/// Irradiance at the origin from a lamp at (x, 0, 2).
fn part(x: f64) -> f64 {
    POWER / (4.0 * PI) * 2.0 / (x * x + 4.0f64).powf(1.5)
}

fn solve(world: &World) -> Zones {
    Zones::solve(world, &ZoneOptions { budget: 1000, particles: 1 << 17, seed: 3 })
}

fn radiance(world: &World, zones: &Zones, bsdf: &Bsdf, strategy: Strategy, rays: u32, n: u32) -> (f64, f64) {
    let walker = Walker::zonal(world, zones);
    let mut surface = sensor_surface(Vec3::new(0.0, 0.0, 1e-5), Vec3::Z);
    surface.wo = Vec3::new(-0.3, 0.2, 0.933).normalize();
    let plan = GatherPlan { rays, shadow_rays: 4, strategy };
    statistics(n, |i| {
        let mut sampler = Sampler::new(17, i as u64, 0);
        gather(&walker, &surface, bsdf, &plan, &mut sampler, &mut Tally::default())[1] as f64
    })
}

fn irradiance(world: &World, zones: &Zones, method: Report, rays: u32, n: u32) -> (f64, f64) {
    let white = Bsdf::diffuse(Rgb::WHITE);
    let (m, e) = radiance(world, zones, &white, Strategy::Report(method), rays, n);
    (PI * m, PI * e)
}

#[test]
fn unbiased_strategies_find_lamp_and_image() {
    let world = lamp_and_mirror(0.3);
    let zones = solve(&world);
    for (name, method) in NAMES.iter().filter(|n| !n.1.is_biased()) {
        let e = irradiance(&world, &zones, *method, 64, 4000);
        println!("{name}: {e:?}, {:.4}", part(1.0) + part(3.0));
        // The control value is the lamp without its image.
        assert_is(name, e, part(1.0) + part(3.0), part(1.0));
    }
}

#[test]
fn one_stage_strategies_are_dark_in_the_typical_run() {
    let world = lamp_and_mirror(0.03);
    let zones = solve(&world);
    let truth = part(1.0) + part(3.0);
    let walker = Walker::zonal(&world, &zones);
    let surface = sensor_surface(Vec3::new(0.0, 0.0, 1e-5), Vec3::Z);
    let white = Bsdf::diffuse(Rgb::WHITE);
    // Lower quartile, median, upper quartile of 400 runs, relative to the truth.
    let quartiles = |method: Report| {
        let plan = GatherPlan { rays: 64, shadow_rays: 4, strategy: Strategy::Report(method) };
        let mut values: Vec<f64> = (0..400u64)
            .map(|i| {
                let mut sampler = Sampler::new(19, i, 0);
                let l = gather(&walker, &surface, &white, &plan, &mut sampler, &mut Tally::default());
                PI * l[1] as f64 / truth
            })
            .collect();
        values.sort_by(f64::total_cmp);
        [100, 200, 300].map(|i| values[i])
    };
    for (name, method) in NAMES.iter().filter(|n| n.0.starts_with("report1994:")) {
        let q = quartiles(*method);
        println!("{name}: quartiles {q:.3?}");
        if *method == Report::Shrinking {
            // Finds what the others miss, if not yet at its size.
            assert!(q[0] > 0.3 && q[1] > 0.6, "{q:?}");
        } else {
            assert!(q[2] < 0.5, "{name}: {q:?}");
        }
    }
    // The control: the same judgement on a strategy that knows where to look.
    let q = quartiles(Report::Regions);
    assert!(q[0] > 0.8 && q[2] < 1.2, "{q:?}");
}

#[test]
fn enlarged_lamps_keep_their_light_in_mirrors_too() {
    // On a black ground E(I') = 0 but for the cosine: twenty times the area is still small.
    let world = lamp_and_mirror(0.03);
    let zones = solve(&world);
    let truth = part(1.0) + part(3.0);
    let (m, e) = irradiance(&world, &zones, Report::Enlarged(400), 1024, 200);
    println!("enlarged 400 times: {m:.4} ± {e:.4}, {truth:.4}");
    assert!((m / truth - 1.0).abs() < 0.05 && e < 0.02 * truth, "{m} ± {e}, {truth}");
    // The control: without the image it would be a fifth less.
    assert!(part(1.0) < 0.85 * truth);
}

#[test]
fn other_lobes_are_gathered_as_ever() {
    let world = lamp_and_mirror(0.3);
    let zones = solve(&world);
    let coated = Bsdf::coated_diffuse(Rgb::splat(0.5), 1.5, [0.3; 2]);
    let sobol = radiance(&world, &zones, &coated, Strategy::Sobol, 64, 4000);
    let report = radiance(&world, &zones, &coated, Strategy::Report(Report::Uniform), 64, 8000);
    let diffuse = Bsdf::diffuse(Rgb::splat(0.5));
    let other = radiance(&world, &zones, &diffuse, Strategy::Sobol, 64, 4000);
    let z = (sobol.0 - report.0) / sobol.1.hypot(report.1);
    println!("sobol {sobol:?}, report {report:?}, z = {z:.2}");
    assert!(z.abs() < Z_LIMIT);
    // The control: a surface without the coat.
    assert!((sobol.0 - other.0).abs() / sobol.1.hypot(other.1) > 2.0 * Z_LIMIT);
}

#[test]
fn cones_point_where_the_image_method_says() {
    let world = lamp_and_mirror(1e-3);
    let zones = solve(&world);
    let surface = sensor_surface(Vec3::new(0.2, -0.1, 1e-5), Vec3::Z);
    let angle = |a: Vec3, b: Vec3| (a - b).length();
    let image = (Vec3::new(3.0, 0.0, 2.0) - surface.p).normalize();
    let mut cones = Vec::new();
    virtual_cones(&zones, &surface, &mut cones);
    let found = cones.iter().map(|c| angle(c.0, image)).fold(9.0, f32::min);
    assert!(found < 1e-3, "{found}");
    let walker = Walker::zonal(&world, &zones);
    let mut known = Known::default();
    known.look(&walker, &surface, &Bsdf::diffuse(Rgb::WHITE), Vec3::Z);
    let hemiquad::Shape::Cap { axis, .. } = known.lamps[0].shape else { panic!("a cone") };
    let d = Vec3::new(axis.x as f32, axis.y as f32, axis.z as f32);
    let lamp = (Vec3::new(1.0, 0.0, 2.0) - surface.p).normalize();
    assert!(angle(surface.frame.to_world(d), lamp) < 1e-5);
    // Lamp, image, mirror.
    assert_eq!((known.lamps.len(), known.regions.len() >= 2), (1, true));
}

#[test]
fn balls_know_their_intensity() {
    let mut scene = empty();
    let black = diffuse(&mut scene, 0.0);
    sphere(&mut scene, [0.0, 0.0, 3.0], 0.5, false, black, emission(2.0));
    quad(&mut scene, [0.0, 0.0, 1.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], black, emission(3.0));
    let shiny = mirror(&mut scene, 0.5);
    sphere(&mut scene, [5.0, 0.0, 0.0], 0.25, false, shiny, None);
    let world = World::new(scene);
    let down = Vec3::new(0.6, 0.0, -0.8);
    assert_eq!((world.balls.len(), world.balls.casters().len()), (2, 1));
    // Radiance × projected area.
    let i = world.balls.intensity(&world, 0, down)[0] as f64;
    assert!((i - 2.0 * PI * 0.25).abs() < 1e-5, "{i}");
    let i = world.balls.intensity(&world, 1, down)[0];
    assert!((i - 3.0 * 2.0 * 0.8).abs() < 1e-5, "{i}");
    // One-sided: nothing upwards.
    assert_eq!(world.balls.intensity(&world, 1, -down)[0], 0.0);
    let ball = world.balls.casters()[0];
    assert!((ball.centre - Vec3::new(5.0, 0.0, 0.0)).length() < 0.05 && (ball.radius - 0.25).abs() < 0.05);
}

#[test]
fn names_are_read_as_they_are_written() {
    for (name, report) in NAMES {
        assert_eq!(strategies::parse(name), Some(Strategy::Report(report)));
        assert_eq!(strategies::name(Strategy::Report(report)), name);
        assert_eq!(strategies::is_biased(Strategy::Report(report)), report.is_biased());
        // The family says it; Ward's shadow test is biased and no one-stage method.
        assert_eq!(report.is_biased(), name.starts_with("report1994:") || report == Report::Ward);
    }
    let enlarged = Strategy::Report(Report::Enlarged(20));
    assert_eq!(strategies::parse("report1994:enlarged:20"), Some(enlarged));
    assert_eq!(strategies::name(enlarged), "report1994:enlarged:20");
    for bad in ["", "report1994:", "report1994:enlarged:-1", "enlarged:20", "Voronoi"] {
        assert_eq!(strategies::parse(bad), None, "{bad}");
    }
}
