//! Refraction: Fresnel's formulae, panes, a lamp behind a slab and above water, a glass ball.

use super::oracle::*;
use super::*;
use crate::bsdf::fresnel::{dielectric, mean_dielectric, mean_dielectric_internal};

const UP: V3 = [0.0, 0.0, 1.0];

pub(super) fn fresnel_values(page: &mut Page) {
    for (degrees, truth) in [(0.0f64, 0.04), (45.0, 0.050240), (60.0, 0.089187), (80.0, 0.387704)] {
        let value = dielectric(degrees.to_radians().cos() as f32, 1.5) as f64;
        page.exact(&format!("Fresnel, index 1.5, {degrees} degrees"), value, truth, 1e-6);
    }
    for (eta, outer, inner) in
        [(1.5f32, 0.091778, 0.596346), (1.33, 0.065931, 0.471949), (1.52, 0.094707, 0.608166)]
    {
        page.exact(
            &format!("hemispherical, index {eta}, external"),
            mean_dielectric(eta) as f64,
            outer,
            1e-6,
        );
        page.exact(
            &format!("hemispherical, index {eta}, internal"),
            mean_dielectric_internal(eta) as f64,
            inner,
            1e-6,
        );
        // The mean is also that of the values, by quadrature.
        let cells = 20_000;
        let at = |i: usize| (i as f64 + 0.5) / cells as f64;
        let sum: f64 = (0..cells).map(|i| dielectric(at(i) as f32, eta) as f64 * 2.0 * at(i)).sum();
        page.exact(&format!("hemispherical, index {eta}, by quadrature"), sum / cells as f64, outer, 2e-5);
    }
}

/// A pane with all inner reflections, each polarisation by itself (Radiance's `glass` without absorption).
pub(super) fn panes(page: &mut Page) {
    let panel = quad("l", [-200.0, -200.0, 2.0], [0.0, 400.0, 0.0], [400.0, 0.0, 0.0]);
    for (eta, degrees, truth) in [
        (1.5, 0.0f64, 0.923077),
        (1.5, 30.0, 0.920734),
        (1.5, 45.0, 0.907344),
        (1.5, 60.0, 0.848128),
        (1.5, 70.0, 0.728712),
        (1.52, 0.0, 0.918318),
    ] {
        let glass = quad("g", [-50.0, -50.0, 0.0], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0]);
        let world = rad(&format!("void light l 0 0 3 1 1 1\n{panel}void glass g 0 0 4 1 1 1 {eta}\n{glass}"));
        let a = degrees.to_radians();
        let e = radiance(&world, [0.0, 0.0, -1.0], [a.sin(), 0.0, a.cos()], 65_536);
        e.check(page, &format!("pane, index {eta}, {degrees} degrees"), truth, 0.98 * truth);
    }
}

/// A lamp straight above a slab of thickness d: what it would give d (1 − 1/n) nearer, and 2 d / n farther for every pair of reflections within.
/// The slab is so wide that nothing comes by its sides (0.4 % did by those of one of 4 m).
pub(super) fn a_slab_brings_the_lamp_nearer(page: &mut Page) {
    let (d, n, h, r, intensity) = (0.3f64, 1.5f64, 1.5f64, 0.02f64, 10.0f64);
    let l = intensity / (std::f64::consts::PI * r * r);
    let world = rad(&format!(
        "void light l 0 0 3 {l} {l} {l}\nl sphere lamp 0 0 4 0 0 {h} {r}\nvoid dielectric m 0 0 5 1 1 1 {n} 0\n\
         !genbox m slab 60 60 {d} | xform -t -30 -30 .5\nvoid plastic b 0 0 5 0 0 0 0 0\n{}",
        quad("b", [-0.3, -0.3, 0.0], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0])
    ));
    let f = 0.04f64;
    let near = h - d * (1.0 - 1.0 / n);
    let image =
        |k: i32| (1.0 - f) * (1.0 - f) * f.powi(2 * k) * intensity / (near + 2.0 * k as f64 * d / n).powi(2);
    let truth: f64 = (0..4).map(image).sum();
    let e = sensed_with_residuals(&world, [0.0, 0.0, 1e-4], UP, 4096, 1 << 20);
    e.check(page, "slab above a sensor", truth, (1.0 - f) / (1.0 + f) * intensity / (h * h));
}

/// A lamp of 1 W/sr 2 m above water (1.33), sensors 1 m below its surface: E = I T sin θ1 / (x dx/dθ1).
pub(super) fn under_water(page: &mut Page) {
    let (r, intensity) = (0.02, 1.0);
    let l = intensity / (std::f64::consts::PI * r * r);
    for (x, truth) in [
        (0.0, 0.129401974),
        (0.734292, 0.118560534),
        (1.560401, 0.090003936),
        (2.627728, 0.053678832),
        (4.322057, 0.021278462),
    ] {
        let world = rad(&format!(
            "void light l 0 0 3 {l} {l} {l}\nl sphere lamp 0 0 4 0 0 2 {r}\nvoid dielectric w 0 0 5 1 1 1 1.33 0\n{}\
             void plastic b 0 0 5 0 0 0 0 0\n{}",
            quad("w", [-20.0, -20.0, 0.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]),
            quad("b", [x - 0.3, -0.3, -1.0], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0]),
        ));
        let e = sensed_with_residuals(&world, [x, 0.0, -1.0 + 1e-4], UP, 4096, 1 << 20);
        e.check(page, &format!("under water, {x} m off"), truth, 1.03 * truth);
    }
}

/// A glass ball of radius 1 in collimated light, on the plane z = 3 behind it: the first passage, times (1 − F)², and what comes after
/// reflections within. At the last sensor that is 1.5 % of all: three reflections, near their rainbow, in images 120 times smaller than
/// the sun, which few rays meet. A reading that misses them looks sure of itself and is 1.5 % low; hence the many gathers.
pub(super) fn glass_ball(page: &mut Page) {
    let half = 0.25f64.to_radians();
    let l = 1.0 / (std::f64::consts::PI * half.sin().powi(2));
    for (h, x, geometric, through, gathers) in [
        (0.05, 0.050097, 0.992250, 0.921600, 65_536),
        (0.2, 0.206407, 0.882462, 0.921552, 65_536),
        (0.4, 0.456372, 0.599980, 0.920668, 65_536),
    ] {
        // The light comes from below; the sensor at z = 3 faces it.
        let world = rad(&format!(
            "void light s 0 0 3 {l} {l} {l}\ns source sun 0 0 4 0 0 -1 .5\nvoid dielectric g 0 0 5 1 1 1 1.5 0\n\
             g sphere ball 0 0 4 0 0 0 1\nvoid plastic b 0 0 5 0 0 0 0 0\n{}",
            quad("b", [x - 0.1, -0.1, 3.0], [0.0, 0.2, 0.0], [0.2, 0.0, 0.0]),
        ));
        let e = sensed_with_residuals(&world, [x, 0.0, 3.0 - 1e-4], [0.0, 0.0, -1.0], gathers, 1 << 19);
        let truth = geometric * through + after_reflections(x);
        e.check(page, &format!("glass ball, offset {h}"), truth, geometric);
    }
    // What passes at the first go, of all that falls on the ball: the mean of (1 − F)² of each polarisation.
    let cells = 100_000;
    let sum: f64 = (0..cells)
        .map(|i| {
            let h2 = (i as f64 + 0.5) / cells as f64;
            let (r, _) = fresnel((1.0 - h2).sqrt(), 1.5);
            0.5 * ((1.0 - r[0]).powi(2) + (1.0 - r[1]).powi(2))
        })
        .sum();
    page.form((sum / cells as f64 - 0.840611).abs() < 1e-5, "the glass ball's first passage by quadrature");
    passage(page);
}

/// Irradiance behind the ball, `x` off its axis, by rays reflected up to five times within: flux by rings of the incident light, over
/// rings of the plane.
fn after_reflections(x: f64) -> f64 {
    let (cells, wide) = (4_000_000, 0.005);
    let mut flux = 0.0;
    for i in 0..cells {
        let across = ((i as f64 + 0.5) / cells as f64).sqrt();
        let (outer, inner) = (across.asin(), (across / 1.5).asin());
        let ([rs, rp], _) = fresnel(outer.cos(), 1.5);
        let reflected = 0.5 * (rs + rp);
        for k in 1..=5 {
            let chord = std::f64::consts::PI - 2.0 * inner;
            let turned = 2.0 * (outer - inner) + k as f64 * chord;
            // Where it leaves the ball, as an angle from the axis behind it.
            let leaves = std::f64::consts::PI - outer - (k + 1) as f64 * chord;
            let (down, off) = (turned.cos(), -turned.sin());
            let at = leaves.sin() + (3.0 - leaves.cos()) * off / down;
            if down > 1e-3 && (at.abs() - x).abs() < wide {
                flux += (1.0 - reflected).powi(2) * reflected.powi(k);
            }
        }
    }
    // A ring of the plane from x - wide to x + wide: 4 pi x wide; of the light, pi over the number of cells.
    flux / cells as f64 / (4.0 * x * wide)
}

/// The same by tracing: shares of rays that leave the ball downstream by two refractions, with the program's own Fresnel
/// term, which is the mean of the polarisations at each surface.
fn passage(page: &mut Page) {
    let cells = 100_000;
    let (mut unpolarised, mut ours) = (0.0, 0.0);
    for i in 0..cells {
        let cos = (1.0 - (i as f64 + 0.5) / cells as f64).sqrt();
        let (r, inner) = fresnel(cos, 1.5);
        unpolarised += (1.0 - 0.5 * (r[0] + r[1])).powi(2) / cells as f64;
        let (enter, leave) = (dielectric(cos as f32, 1.5) as f64, dielectric(inner as f32, 1.0 / 1.5) as f64);
        ours += (1.0 - enter) * (1.0 - leave) / cells as f64;
    }
    page.exact("glass ball, first passage, unpolarised at each surface", ours, unpolarised, 1e-5);
}
