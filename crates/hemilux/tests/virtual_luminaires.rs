//! Virtual luminaires: small lamps by way of mirrors and glass, found from records of light particles, without bias.

mod common;
use common::*;
use hemilux::gather::{Part, gather_part};
use hemilux::sampler::Sampler;
use hemilux::sensor::sensor_surface;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::*;
use std::f64::consts::PI;

/// Irradiance (green) at a point of a floor z = 0, by `n` gathers over zones, records included.
fn floor_irradiance(world: &World, zones: Option<&Zones>, p: [f32; 2], n: u32) -> (f64, f64) {
    let walker = Walker { zones, ..Walker::path(world) };
    let white = hemilux::bsdf::Bsdf::diffuse(Rgb::WHITE);
    let surface = sensor_surface(Vec3::new(p[0], p[1], 1e-5), Vec3::Z);
    statistics(n, |i| {
        let mut sampler = Sampler::new(13, i as u64, 0);
        let l =
            hemilux::gather::gather(&walker, &surface, &white, &PLAN, &mut sampler, &mut Tally::default());
        PI * l[1] as f64
    })
}

fn solve(world: &World) -> Zones {
    Zones::solve(world, &ZoneOptions { budget: 1000, particles: 1 << 19, seed: 3 })
}

/// A lamp of `radius` and 100 W beside a flat mirror over a black floor, with the irradiance (W/m²) at the origin of the floor by lamp and by image,
/// at (1, 0, 2) and (3, 0, 2): Φ cos θ / (4 π d²) each.
fn lamp_by_a_mirror(radius: f64) -> (World, [f64; 2]) {
    let mut scene = empty();
    let (black, shiny) = (diffuse(&mut scene, 0.0), mirror(&mut scene, 1.0));
    let radiance = 100.0 / (4.0 * PI * PI * radius * radius);
    sphere(&mut scene, [1.0, 0.0, 2.0], radius, false, black, emission(radiance as f32));
    quad(&mut scene, [2.0, -3.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 5.0], shiny, None);
    quad(&mut scene, [-1.0, -1.5, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], black, None);
    (World::new(scene), [1.0, 3.0].map(|x: f64| 100.0 / (4.0 * PI) * 2.0 / (x * x + 4.0).powf(1.5)))
}

/// The image method: a lamp beside a flat mirror over a black floor, from 30 cm to 1 mm. The noise does not grow.
#[test]
fn a_shrinking_lamp_in_a_flat_mirror() {
    for radius in [0.3, 0.03, 1e-3] {
        let (world, [direct, image]) = lamp_by_a_mirror(radius);
        let (zones, truth) = (solve(&world), direct + image);
        let e = floor_irradiance(&world, Some(&zones), [0.0, 0.0], 4000);
        assert_is(&format!("lamp of {radius} m"), e, truth, direct);
        assert!(e.1 < 0.004 * truth, "lamp of {radius} m: noise {} of {truth}", e.1);
        if radius < 0.01 {
            // Negative control: broad strata alone miss an image of 8e-8 of the hemisphere.
            let blind = floor_irradiance(&world, None, [0.0, 0.0], 400);
            assert!((blind.0 - direct).abs() < 0.01 * truth, "{blind:?}");
        }
    }
}

/// Each of the places that share a gather's rays is an unbiased gather of its own, as long as none is always dealt the same rays;
/// together they are as good as a whole gather.
#[test]
fn parts_of_a_gather_keep_the_mean() {
    let (world, [direct, image]) = lamp_by_a_mirror(0.01);
    let (zones, truth) = (solve(&world), direct + image);
    let walker = Walker { zones: Some(&zones), ..Walker::path(&world) };
    let white = hemilux::bsdf::Bsdf::diffuse(Rgb::WHITE);
    let surface = sensor_surface(Vec3::new(0.0, 0.0, 1e-5), Vec3::Z);
    // Neither the rays nor the shadow rays of this plan go up in four parts.
    let plan = hemilux::gather::GatherPlan { rays: 10, shadow_rays: 3, ..PLAN };
    let part = |first: u32, of: u32, i: u32| {
        let mut sampler = Sampler::new(17, i as u64, 0);
        let part = Part { first, of };
        let l =
            gather_part(&walker, &surface, &white, &plan, part, &mut sampler, &mut Tally::default()).whole;
        PI * l[1] as f64
    };
    let of = 4;
    let dealt = |i: u32| (hemiquad::points::Key::new(3).with(i as u64).uniform(0) * of as f32) as u32;
    assert_is("one part", statistics(8000, |i| part(dealt(i), of, i)), truth, direct);
    let all = |i: u32| (0..of).map(|k| part((k + dealt(i)) % of, of, i)).sum::<f64>() / of as f64;
    let (all, whole) = (statistics(4000, all), statistics(4000, |i| part(0, 1, i)));
    assert_is("all parts", all, truth, direct);
    assert!(all.1 < 1.2 * whole.1, "parts {all:?}, whole {whole:?}");
    // Negative control: always the last of four has fewer rays than its share.
    let last = statistics(8000, |i| part(of - 1, of, i));
    assert!(z(last, truth).abs() > 2.0 * Z_LIMIT, "the fake passes: {last:?} for {truth}");
}

/// Curved mirrors and glass: the records change the noise, not the mean. Against broad strata with many more rays.
#[test]
fn curved_casters_keep_the_mean() {
    let glass = MaterialKind::Dielectric {
        eta: 1.5,
        roughness: Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false },
    };
    for (name, kind) in [("mirror ball", None), ("glass ball", Some(glass))] {
        let mut scene = empty();
        let black = diffuse(&mut scene, 0.0);
        let caster = match kind {
            None => mirror(&mut scene, 0.9),
            Some(kind) => material(&mut scene, kind),
        };
        sphere(&mut scene, [1.0, 0.0, 2.0], 0.06, false, black, emission(100.0));
        sphere(&mut scene, [0.3, 0.6, 0.5], 0.4, false, caster, None);
        quad(&mut scene, [-1.0, -1.5, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], black, None);
        let world = World::new(scene);
        let zones = solve(&world);
        assert!(!zones.records().is_empty());
        for p in [[-0.3, -0.2], [0.6, -0.1]] {
            let found = floor_irradiance(&world, Some(&zones), p, 4000);
            let broad = floor_irradiance(&world, None, p, 150_000);
            let z = (found.0 - broad.0) / (found.1.powi(2) + broad.1.powi(2)).sqrt();
            println!("{name} {p:?}: {found:?} from records, {broad:?} from broad strata, z = {z:.2}");
            assert!(z.abs() < Z_LIMIT, "{name} at {p:?}");
        }
    }
}
