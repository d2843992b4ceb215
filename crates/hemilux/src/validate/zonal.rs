//! The zonal solver alone: books, the discrete system of a cube, refinement, leaks.

use super::oracle::*;
use super::scenes::{cuboid, diffuse, emission, empty, quad as board, sphere};
use super::*;
use std::f64::consts::PI;

/// Grey enclosure: the mean incident irradiance is Φ / (S (1 − ρ)); the books balance.
pub(super) fn grey_enclosure_and_books(page: &mut Page) {
    let rho = 0.6f64;
    let mut scene = empty();
    let m = diffuse(&mut scene, rho as f32);
    cuboid(&mut scene, [0.0; 3], [4.0, 3.0, 2.5], true, m);
    sphere(&mut scene, [1.0, 1.0, 1.5], 0.1, false, m, emission(50.0));
    let world = World::new(scene);
    let zones = solved(&world, 3000, 1 << 20, 2);
    let l = &zones.ledger;
    let gone = l.absorbed[1] + l.escaped[1] + l.truncated[1];
    page.exact("light particles: absorbed and escaped over emitted", gone / l.emitted[1], 1.0, 1e-9);
    let incident = flux(&zones, 0) + flux(&zones, 1);
    page.exact("zones: sum of A E over what arrived", incident / l.incident[1], 1.0, 1e-6);
    let power = 50.0 * PI * 4.0 * PI * 0.01;
    let area = 2.0 * (12.0 + 7.5 + 10.0) + 4.0 * PI * 0.01;
    let truth = power / (area * (1.0 - rho));
    let e = by_replicates(&world, 3000, 1 << 20, |z| (flux(z, 0) + flux(z, 1)) / area);
    e.check(page, "grey enclosure, mean irradiance", truth, power / area);
}

/// Faces of a unit cube: corner and edges with their cross product inwards. Face 0 is the floor, 1 the ceiling.
const FACES: [[[f32; 3]; 3]; 6] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
];

/// The discrete system of six zones, one of them emitting: form factors by particles, radiosities by elimination.
pub(super) fn six_zones(page: &mut Page) {
    // F from face 0 to the opposite one and to a side, by tracing particles from it alone.
    let factor = |to: usize| {
        let mut scene = empty();
        let black = diffuse(&mut scene, 0.0);
        let [p, a, b] = FACES[0];
        board(&mut scene, p, a, b, black, emission(1.0));
        let [p, a, b] = FACES[to];
        board(&mut scene, p, a, b, black, None);
        let world = World::new(scene);
        by_replicates(&world, 200, 1 << 20, |z| flux(z, 0) / PI)
    };
    let (opposite, side) = (factor(1), factor(2));
    opposite.check(page, "form factor to the opposite face of a cube", 0.199824896, 0.19);
    side.check(page, "form factor to a side of a cube", 0.200043776, 0.19);
    for (rho, truth_side, truth_opposite) in
        [(0.5, 0.166683245, 0.166600339), (0.8, 0.444461209, 0.444377352)]
    {
        // Unknowns: side s (four alike), opposite o; the emitting face is black. Sides see two neighbours and one opposite side.
        let solve = |fo: f64, fs: f64| {
            // s = ρ (fs + fo s + 2 fs s + fs o); o = ρ (fo + 4 fs s).
            let k = 1.0 - rho * (fo + 2.0 * fs);
            let s = rho * (fs + rho * fs * fo) / (k - 4.0 * rho * rho * fs * fs);
            (s, rho * (fo + 4.0 * fs * s))
        };
        let (s, o) = solve(opposite.mean, side.mean);
        let nudged =
            (solve(opposite.mean + opposite.error, side.mean), solve(opposite.mean, side.mean + side.error));
        let error = |pick: fn((f64, f64)) -> f64, at: f64| (pick(nudged.0) - at).hypot(pick(nudged.1) - at);
        let e = Estimate { mean: s, error: error(|v| v.0, s) };
        e.check(page, &format!("six zones, albedo {rho}, side"), truth_side, truth_side * (1.0 - rho));
        let e = Estimate { mean: o, error: error(|v| v.1, o) };
        e.check(
            page,
            &format!("six zones, albedo {rho}, opposite"),
            truth_opposite,
            truth_opposite * (1.0 - rho),
        );
    }
}

/// Finer zones: the flux stays the same, and the mean error of zone irradiance against the closed form falls.
pub(super) fn refinement(page: &mut Page) {
    let mut scene = empty();
    let black = diffuse(&mut scene, 0.0);
    let [p, a, b] = FACES[0];
    board(&mut scene, p, a, b, black, emission(1.0));
    let [p, a, b] = FACES[1];
    board(&mut scene, p, a, b, black, None);
    let world = World::new(scene);
    let floor = corners([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let mut last = f64::INFINITY;
    let (mut falls, mut fluxes) = (true, Vec::new());
    for budget in [12u32, 48, 192, 768] {
        let zones = solved(&world, budget, 1 << 21, 3);
        fluxes.push(flux(&zones, 0));
        // What a point of the ceiling is told by its zone, against what it receives.
        let mut squares = 0.0;
        for i in 0..400 {
            let (x, y) = ((i % 20) as f64 / 20.0 + 0.025, (i / 20) as f64 / 20.0 + 0.025);
            let up = world.closest(Vec3::new(x as f32, y as f32, 0.5), Vec3::Z, f32::INFINITY);
            let Some(s) = up else { continue };
            let place = zones.locate(&world, &s, [0.5, 0.5]);
            let truth = lambert(&floor, [x, y, 1.0], [0.0, 0.0, -1.0]);
            squares += (zones.irradiance(place.zone, place.side)[1] as f64 / truth - 1.0).powi(2) / 400.0;
        }
        falls &= squares < last;
        last = squares;
    }
    page.exact(
        "refinement: zones tell points of a ceiling ever better (1: yes)",
        falls as u32 as f64,
        1.0,
        0.0,
    );
    let spread = fluxes.iter().map(|f| (f / fluxes[0] - 1.0).abs()).fold(0.0, f64::max);
    page.exact("refinement: the flux stays the same, largest relative change", spread, 0.0, 1e-6);
}

/// Two rooms a millimetre apart, one lit: the other is black. A board before a wall shades it.
pub(super) fn leaks(page: &mut Page) {
    let mut scene = empty();
    let m = diffuse(&mut scene, 0.8);
    cuboid(&mut scene, [-2.0, -1.0, -1.0], [-0.0005, 1.0, 1.0], true, m);
    cuboid(&mut scene, [0.0005, -1.0, -1.0], [2.0, 1.0, 1.0], true, m);
    sphere(&mut scene, [-1.0, 0.2, 0.3], 0.2, false, m, emission(1000.0));
    let world = World::new(scene);
    let zones = solved(&world, 3000, 1 << 18, 2);
    let told = |world: &World, zones: &Zones, from: Vec3, dir: Vec3| {
        world.closest(from, dir, f32::INFINITY).map_or(f64::NAN, |s| {
            let place = zones.locate(world, &s, [0.5, 0.5]);
            zones.irradiance(place.zone, place.side)[1] as f64
        })
    };
    let dark = (0..200)
        .map(|i| {
            let d = unit([0, 1, 2].map(|k| random(3 * i + k) - 0.5)).map(|v| v as f32);
            told(&world, &zones, Vec3::new(0.3, 0.1, 0.2), Vec3::from(d))
        })
        .fold(0.0, f64::max);
    page.exact("leak through 1 mm: brightest zone of the dark room", dark, 0.0, 0.0);
    page.form(told(&world, &zones, Vec3::new(-0.3, 0.1, 0.2), Vec3::X) > 1.0, "the lit room is lit");

    let mut scene = empty();
    let m = diffuse(&mut scene, 0.0);
    board(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], m, None);
    board(&mut scene, [-1.0, -1.0, 0.01], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], m, None);
    sphere(&mut scene, [0.0, 0.0, 3.0], 0.2, false, m, emission(100.0));
    let world = World::new(scene);
    let zones = solved(&world, 2000, 1 << 18, 4);
    let below = told(&world, &zones, Vec3::new(0.5, 0.3, 0.005), Vec3::NEG_Z);
    page.exact("board 1 cm before a wall of the same normal: irradiance behind it", below, 0.0, 0.0);
    page.form(told(&world, &zones, Vec3::new(0.5, 0.3, 1.0), Vec3::NEG_Z) > 1.0, "the board is lit");
}
