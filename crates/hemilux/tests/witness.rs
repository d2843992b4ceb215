//! What fresh particles say of the light that is hardly looked for, against a room where the answer is known.

mod common;
use common::*;
use hemilux::sense::{Goal, Reading, Receiver, Sense, SenseOptions};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3, Vec3};
use hemilux_scene::*;
use std::f64::consts::{PI, TAU};
use std::time::Duration;

/// Albedo of the wall, reflectance of the mirror, radius of the lamp.
const RHO: f64 = 0.5;
const SHINY: f64 = 0.9;
const LAMP: f64 = 0.002;

/// A ball of 5 m, diffuse inside, lit by a lamp of 2 mm that shines into a mirror only: 97 % of its flux comes to the wall by it.
fn room() -> World {
    let mut scene = empty();
    let (wall, shiny) = (diffuse(&mut scene, RHO as f32), mirror(&mut scene, SHINY as f32));
    let black = diffuse(&mut scene, 0.0);
    sphere(&mut scene, [0.0; 3], 5.0, true, wall, None);
    quad(&mut scene, [-0.5, -0.5, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], shiny, None);
    let q = Quadric::Disk { height: 0.0, radius: LAMP, inner_radius: 0.0, phi_max: TAU };
    let placed = DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.9));
    shape(&mut scene, Geometry::Quadric(q, placed), black, emission(1e6));
    scene.shapes[2].reverse_orientation = true;
    World::new(scene)
}

fn solution(world: &World, particles: u64) -> Zones {
    Zones::solve_seen(world, &ZoneOptions { budget: 1000, particles, seed: 3 }, None, |_| false)
}

/// Of the light that arrives anywhere a half (1 − ρ) has not been scattered, and 0.97 × 0.9 of 0.97 × 0.9 + 0.03 of that comes by the
/// mirror. Where nothing is listed all of it is unseen. Where particles have found the image hardly anything is. Controls: a count of particles
/// alone (three of them) would say the same of both, and so would the share of all caustics.
#[test]
fn witnesses_know_what_is_listed_and_what_is_not() {
    let world = room();
    let by_mirror = 0.97 * SHINY / (0.97 * SHINY + 0.03);
    let (blind, led) = (solution(&world, 0), solution(&world, 1 << 17));
    for rays in [4096.0, 65536.0] {
        let (a, b) = (blind.witnesses(&world), led.witnesses(&world));
        println!(
            "{rays}: {:.5} {:.5}, led {:.5} {:.5}",
            a.unseen(rays),
            a.unseen_later(rays),
            b.unseen(rays),
            b.unseen_later(rays)
        );
        // Two standard errors of 2¹⁸ particles, and the edges of mirror and lamp.
        assert!((a.unseen(rays) - (1.0 - RHO) * by_mirror).abs() < 0.02, "{a:?}");
        assert!((a.unseen_later(rays) - by_mirror).abs() < 0.02, "{a:?}");
        assert!(b.unseen(rays) < 0.002 && b.unseen_later(rays) < 0.002, "{b:?}");
    }
}

/// Readings steered by a solution that lists nothing miss nearly everything; their intervals must hold the truth all the same, and
/// not by the whole brightness of the lamp. Control: without what is unseen they do not.
#[test]
fn what_nothing_leads_to_is_in_the_interval_at_its_size() {
    let world = room();
    let flux = PI * 1e6 * PI * LAMP.powi(2) * (0.97 * SHINY + 0.03);
    let truth = RHO * flux / (4.0 * PI * 25.0 * (1.0 - RHO));
    let (p, n) = (Vec3::new(2.997, 0.0, -3.996), Vec3::new(-0.6, 0.0, 0.8));
    let blind = solution(&world, 0);
    let options = |seed| SenseOptions {
        receiver: Receiver::Irradiance,
        goal: Goal::Gathers(512),
        limit: Duration::from_secs(600),
        seed,
        weights: [0.0, 1.0, 0.0],
    };
    let read = |seed| Sense::new(&world, &[], options(seed)).steered(&blind).read(0, p, n);
    let all: Vec<Reading> = (0..8).map(read).collect();
    for r in &all {
        println!("truth {truth:.4}: {r:?}");
        assert!((r.scalar - truth).abs() <= r.half_width, "{r:?}, truth {truth}");
        assert!(r.half_width < 100.0 * truth, "{r:?}");
    }
    let without = all.iter().filter(|r| (r.scalar - truth).abs() <= r.half_width - r.unseen).count();
    assert!(without <= 2, "{without} of 8 hold the truth without it");
}
