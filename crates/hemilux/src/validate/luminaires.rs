//! Irradiance from luminaires of every shape, of unit radiance, and form factors.

use super::daylight::{gensky_overcast, under_sky};
use super::oracle::*;
use super::scenes::empty;
use super::*;
use std::f64::consts::PI;

const UP: V3 = [0.0, 0.0, 1.0];
const LIGHT: &str = "void light l 0 0 3 1 1 1\n";

pub(super) fn a_uniform_sky_gives_pi(page: &mut Page) {
    let world = rad("void glow l 0 0 4 1 1 1 0\nl source s 0 0 4 0 0 1 360\n");
    sensed(&world, [0.0; 3], [0.3, 0.2, 1.0], 256).check(page, "uniform", PI, 0.999 * PI);
    // A hemisphere of sky, seen by a tilted sensor: (1 + cos) / 2 of it.
    let world = rad("void glow l 0 0 4 1 1 1 0\nl source s 0 0 4 0 0 1 180\n");
    let truth = PI * (1.0 + 0.6) / 2.0;
    sensed(&world, [0.0; 3], [0.8, 0.0, 0.6], 8192).check(page, "half a sky", truth, PI * 0.6);
}

/// L = Lz (1 + 2 sin γ) / 3, as an image: 7π/9 Lz on the horizontal, (π/6 + 4/9) Lz on a vertical.
pub(super) fn the_overcast_sky(page: &mut Page) {
    let world = World::new(under_sky(empty(), |d| (1.0 + 2.0 * d[2]) / 3.0));
    sensed(&world, [0.0; 3], UP, 8192).check(page, "overcast, horizontal", 2.443460953, PI);
    sensed(&world, [0.0; 3], [0.0, -1.0, 0.0], 8192).check(
        page,
        "overcast, vertical",
        0.968043220,
        0.5 * 2.443460953,
    );
}

/// gensky's overcast sky is the same, blended with the ground near the horizon by Radiance's `skybright.cal`.
pub(super) fn the_overcast_sky_of_gensky(page: &mut Page) {
    let world = rad("!gensky 6 21 12 -c -B 50\nskyfunc glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\n");
    for (what, n, ideal) in
        [("horizontal", UP, 50.0), ("vertical", [0.0, -1.0, 0.0], 50.0 * 0.968043220 / 2.443460953)]
    {
        let (mut truth, cells) = (0.0, 1000);
        for i in 0..cells {
            for j in 0..cells {
                // z = 1 - u², so that the integrand is smooth at the zenith.
                let (u, phi) = ((i as f64 + 0.5) / cells as f64, (j as f64 + 0.5) / cells as f64 * 2.0 * PI);
                let (s, z) = (u * (2.0 - u * u).sqrt(), 1.0 - u * u);
                let d = [s * phi.cos(), s * phi.sin(), z];
                let cell = 2.0 * u * 2.0 * PI / (cells * cells) as f64;
                truth += gensky_overcast(50.0, d) * dot(d, n).max(0.0) * cell;
            }
        }
        // Wrong: without the blend.
        sensed(&world, [0.0; 3], n, 32_768).check(page, &format!("gensky -c, {what}"), truth, ideal);
    }
}

pub(super) fn disks(page: &mut Page) {
    for (r, h, d, f) in [(1.0, 2.0, 0.0, 0.2), (1.0, 1.0, 1.0, 0.276393202), (0.5, 2.0, 1.5, 0.025658351)] {
        let world = rad(&format!("{LIGHT}l ring d 0 0 8 {d} 0 {h} 0 0 -1 0 {r}\n"));
        sensed(&world, [0.0; 3], UP, 8192).check(page, &format!("disk {r} {h} {d}"), PI * f, PI * f * 1.01);
    }
}

pub(super) fn spheres_above_and_across_the_horizon(page: &mut Page) {
    for (g, s, truth) in [
        (60.0f64, 30.0f64, PI / 8.0),
        (80.0, 20.0, 0.069150718),
        (90.0, 30.0, 0.090586074),
        (100.0, 20.0, 0.005335615),
    ] {
        let (g, s) = (g.to_radians(), s.to_radians());
        page.form((ball(g, s) - truth).abs() < 1e-8, "the closed form itself");
        let (x, z, r) = (3.0 * g.sin(), 3.0 * g.cos(), 3.0 * s.sin());
        let world = rad(&format!("{LIGHT}l sphere b 0 0 4 {x} 0 {z} {r}\n"));
        // Wrong: what a ball that the horizon does not cut would give; or 2 % more.
        let uncut = PI * s.sin().powi(2) * g.cos().abs();
        let wrong = if g + s > 0.5 * PI { uncut } else { 1.02 * truth };
        sensed(&world, [0.0; 3], UP, 8192).check(page, &format!("ball {g:.2} {s:.2}"), truth, wrong);
    }
}

pub(super) fn polygons(page: &mut Page) {
    let square = quad("l", [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0]);
    let triangle = "l polygon t 0 0 9  0 0 2  0 1 2  3 0 2\n".to_owned();
    let small = quad("l", [-0.5, -0.5, 2.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let tilted = [0.5, 0.0, 0.75f64.sqrt()];
    for (what, text, n, truth) in [
        ("square", &square, UP, 1.740839503),
        ("triangle", &triangle, UP, 0.225353617),
        ("triangle, tilted", &triangle, [1.0, 1.0, 1.0], 0.200705027),
        ("unit square at 2, tilted", &small, tilted, 0.199910531),
    ] {
        let world = rad(&format!("{LIGHT}{text}"));
        sensed(&world, [0.0; 3], n, 8192).check(page, what, truth, 1.01 * truth);
    }
}

pub(super) fn form_factors_of_points(page: &mut Page) {
    for (what, p, e1, e2, f) in [
        ("corner above the foot", [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 0.138531606),
        ("centred", [-0.5, -0.5, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 0.239456471),
        ("perpendicular", [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], 0.055734197),
    ] {
        page.form(
            (lambert(&corners(p, e1, e2), [0.0; 3], UP) / PI - f).abs() < 1e-8,
            "the closed form itself",
        );
        let world = rad(&format!("{LIGHT}{}", quad("l", p, e1, e2)));
        sensed(&world, [0.0; 3], UP, 8192).check(page, what, PI * f, PI * f * 1.01);
    }
}

pub(super) fn form_factors_of_rectangles(page: &mut Page) {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let times = |v: V3, s: f64| v.map(|c| c * s);
    let mut closure = Vec::new();
    for (side, length, h, f) in [
        (1.0, 1.0, 1.0, 0.199824896),
        (2.0, 2.0, 1.0, 0.415253284),
        (1.0, 1.0, 2.0, 0.068589589),
        (1.0, 2.0, 1.0, 0.285875385),
    ] {
        let world = rad(&format!("{LIGHT}{}", quad("l", [0.0, 0.0, h], times(y, length), times(x, side))));
        let e = mean_over(&world, [[0.0; 3], times(x, side), times(y, length)], 0.0, 6, nothing);
        e.check(page, &format!("parallel {side} x {length} at {h}"), PI * f, PI * f * 1.02);
        closure.push(e);
    }
    for (height, f) in [(1.0, 0.200043776), (2.0, 0.232852603)] {
        // The luminaire stands on the edge x = 0 of the unit square and faces it.
        let world = rad(&format!("{LIGHT}{}", quad("l", [0.0; 3], y, times(z, height))));
        let e = mean_over(&world, [[0.0; 3], x, y], 0.0, 8, nothing);
        e.check(page, &format!("perpendicular, height {height}"), PI * f, PI * f * 1.03);
        closure.push(e);
    }
    // One face of a unit cube sends everything to the other five.
    let (opposite, side) = (closure[0], closure[4]);
    let sum =
        Estimate { mean: opposite.mean + 4.0 * side.mean, error: opposite.error.hypot(4.0 * side.error) };
    sum.check(page, "closure of the cube", PI, PI * (1.0 - 0.199824896));
}

/// A luminaire in a coordinate plane, whose points have no rounding error of their own: shadow rays must not end behind it.
pub(super) fn a_luminaire_in_a_coordinate_plane_does_not_hide_itself(page: &mut Page) {
    let (y, z) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let text = format!("{LIGHT}{}", quad("l", [0.0; 3], y, z));
    for x in [0.001, 0.03, 0.3, 0.9] {
        let truth = lambert(&corners([0.0; 3], y, z), [x, 0.4, 0.0], UP);
        // Wrong: 0.4 % less; 1.7 % were lost at 0.3 m before this test was written.
        sensed(&rad(&text), [x, 0.4, 0.0], UP, 8192).check(
            page,
            &format!("rectangle in a coordinate plane, at {x} m"),
            truth,
            0.996 * truth,
        );
    }
}
