//! Cases modelled on CIE 171 for electric lighting (5.2 to 5.8); references are closed forms. Values in lux of Radiance, 179 lm/W.

use super::oracle::*;
use super::*;
use std::f64::consts::PI;

const UP: V3 = [0.0, 0.0, 1.0];
const EFFICACY: f64 = 179.0;

/// A ball of radius `r` that sends `lumens` into the whole sphere, at `p`.
fn isotropic(lumens: f64, p: V3, r: f64) -> String {
    let l = lumens / EFFICACY / (4.0 * PI * PI * r * r);
    format!("void light l 0 0 3 {l} {l} {l}\nl sphere lamp 0 0 4 {} {} {} {r}\n", p[0], p[1], p[2])
}

fn lux(e: Estimate) -> Estimate {
    Estimate { mean: EFFICACY * e.mean, error: EFFICACY * e.error }
}

/// Like 5.2: 10,000 lm, isotropic, 3 m up: I h / (h² + r²)^1.5.
pub(super) fn case_5_2_a_point_source(page: &mut Page) {
    let world = rad(&isotropic(1e4, [0.0, 0.0, 3.0], 0.01));
    for (x, truth) in [(0.0, 88.4194), (1.0, 75.4938), (2.0, 50.9327), (3.0, 31.2610), (5.0, 12.0418)] {
        let e = 1e4 / (4.0 * PI) * 3.0 / (9.0f64 + x * x).powf(1.5);
        page.form((e - truth).abs() < 1e-4, "the closed form itself");
        lux(sensed(&world, [x, 0.0, 0.0], UP, 512)).check(page, &format!("5.2, {x} m"), e, 1.005 * e);
    }
}

/// Like 5.3: panels of 0.5 m to 1 m, 1000 cd/m², in the ceiling and on a wall, horizontal and vertical sensors.
pub(super) fn case_5_3_area_sources(page: &mut Page) {
    let l = 1000.0 / EFFICACY;
    for (what, p, e1, e2) in [
        ("ceiling, 1 m", [-0.5, -0.5, 2.5], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
        ("ceiling, 0.5 m", [-0.25, -0.25, 2.5], [0.0, 0.5, 0.0], [0.5, 0.0, 0.0]),
        ("wall, 1 m x 0.5 m", [-1.5, -0.5, 1.2], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]),
    ] {
        let world = rad(&format!("void light l 0 0 3 {l} {l} {l}\n{}", quad("l", p, e1, e2)));
        let panel = corners(p, e1, e2);
        for (place, n) in [
            ([0.0; 3], UP),
            ([1.2, 0.3, 0.0], UP),
            ([1.2, 0.3, 0.8], [-1.0, 0.0, 0.0]),
            ([0.6, -0.9, 0.8], [0.0, 1.0, 0.0]),
        ] {
            let e = 1000.0 * lambert(&panel, place, n);
            lux(sensed(&world, place, n, 8192)).check(
                page,
                &format!("5.3, {what}, {place:?} {n:?}"),
                e,
                1.01 * e,
            );
        }
    }
}

/// Like 5.4: what comes in by an opening arrives: Σ E dA over floor and walls of a black room is π L A of the opening.
pub(super) fn case_5_4_flux_is_kept(page: &mut Page) {
    let (x, y, z) = ([4.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 2.5]);
    let o = [0.0; 3];
    let walls = [[o, x, y], [o, y, z], [x, z, y], [o, z, x], [y, x, z]];
    // The ceiling has an opening of 1 m x 1 m.
    let room: String = walls.iter().map(|w| quad("k", w[0], w[1], w[2])).collect();
    let ceiling = super::daylight::surround([0.0, 0.0, 2.5], x, y, [0.3, 0.55], [1.0 / 3.0, 2.0 / 3.0]);
    let world = rad(&format!(
        "void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\nvoid plastic k 0 0 5 0 0 0 0 0\n{room}{ceiling}"
    ));
    let mut sum = Estimate { mean: 0.0, error: 0.0 };
    for wall in walls {
        let n = cross(wall[1], wall[2]);
        let (e, area) = (mean_over(&world, wall, 1e-4, 16, nothing), dot(n, n).sqrt());
        sum = Estimate { mean: sum.mean + area * e.mean, error: sum.error.hypot(area * e.error) };
    }
    sum.check(page, "5.4, flux", PI, 1.02 * PI);
}

/// Like 5.5: directional transmittance of clear glass, a slab with both interfaces and all inner reflections. Unpolarised light at each
/// interface: T = (1 − F) / (1 + F).
pub(super) fn case_5_5_transmittance_of_a_slab(page: &mut Page) {
    let slab = "void dielectric m 0 0 5 1 1 1 1.5 0\n!genbox m slab 100 100 .006 | xform -t -50 -50 0\n";
    let panel = quad("l", [-200.0, -200.0, 2.0], [0.0, 400.0, 0.0], [400.0, 0.0, 0.0]);
    let world = rad(&format!("void light l 0 0 3 1 1 1\n{panel}{slab}"));
    for (angle, truth) in
        [(0.0f64, 0.923077), (30.0, 0.920734), (45.0, 0.907), (60.0, 0.836232), (70.0, 0.0), (80.0, 0.0)]
    {
        let cos = angle.to_radians().cos();
        let (r, _) = fresnel(cos, 1.5);
        let f = 0.5 * (r[0] + r[1]);
        let t = (1.0 - f) / (1.0 + f);
        page.form(truth == 0.0 || (t - truth).abs() < 3e-3, "the closed form itself");
        let e = radiance(&world, [0.0, 0.0, -1.0], [angle.to_radians().sin(), 0.0, cos], 65_536);
        // Wrong: only the first reflection at each interface.
        e.check(page, &format!("5.5, {angle} degrees"), t, (1.0 - f).powi(2));
    }
}

/// Like 5.6: a board of reflectance ρ lit evenly by a sun from behind the sensor: E = ρ E_S F.
pub(super) fn case_5_6_reflection_of_an_evenly_lit_board(page: &mut Page) {
    let (rho, half) = (0.6, 0.25f64.to_radians());
    let sun = |d: &str| {
        format!(
            "void light s 0 0 3 1e4 1e4 1e4\ns source sun 0 0 4 {d} .5\nvoid plastic m 0 0 5 {rho} {rho} {rho} 0 0\n"
        )
    };
    let normal_irradiance = 1e4 * PI * half.sin().powi(2);
    for (what, d, cos, p, e1, e2, f) in [
        ("overhead", "0 0 -1", 1.0, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 0.138531606),
        (
            "overhead, centred",
            "0 0 -1",
            1.0,
            [-0.5, -0.5, 1.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            0.239456471,
        ),
        (
            "upright",
            "-1 0 -.5",
            1.0 / 1.25f64.sqrt(),
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0],
            0.055734197,
        ),
    ] {
        let world = rad(&(sun(d) + &quad("m", p, e1, e2)));
        let truth = rho * normal_irradiance * cos * f;
        sensed(&world, [0.0; 3], UP, 16_384).check(page, &format!("5.6, {what}"), truth, 1.02 * truth);
    }
}

/// Like 5.7: the same with an upright black board, edge on to the sun, that hides part of it.
pub(super) fn case_5_7_with_an_obstruction(page: &mut Page) {
    // So small a sun that the board's penumbra hardly darkens what it hides.
    let (rho, half) = (0.6, 0.01f64.to_radians());
    let (p, e1, e2) = ([-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0]);
    let (b, f1, f2) = ([0.3, -0.4, 0.2], [0.0, 0.8, 0.0], [0.0, 0.0, 0.5]);
    let world = rad(&format!(
        "void light s 0 0 3 6e6 6e6 6e6\ns source sun 0 0 4 0 0 -1 .02\nvoid plastic m 0 0 5 {rho} {rho} {rho} 0 0\n\
         void plastic k 0 0 5 0 0 0 0 0\n{}{}",
        quad("m", p, e1, e2),
        quad("k", b, f1, f2)
    ));
    let board = corners(p, e1, e2);
    for place in [[0.0; 3], [-0.4, 0.2, 0.0], [0.9, 0.0, 0.1]] {
        let open = lambert(&board, place, UP);
        let hidden = lambert(&seen_through(&board, place, &corners(b, f1, f2)), place, UP);
        page.form(hidden > 0.03 * open, "something is hidden");
        let scale = rho * 6e6 * half.sin().powi(2);
        sensed(&world, place, UP, 16_384).check(
            page,
            &format!("5.7, {place:?}"),
            scale * (open - hidden),
            scale * open,
        );
    }
}

/// Like 5.8: a cube of 4 m, 10,000 lm at its middle: the mean indirect illuminance is Φ / S · ρ / (1 − ρ).
pub(super) fn case_5_8_interreflection_in_a_cube(page: &mut Page) {
    for (rho, truth) in [
        (0.05f64, 5.4825f64),
        (0.1, 11.574),
        (0.2, 26.042),
        (0.3, 44.643),
        (0.4, 69.444),
        (0.5, 104.167),
        (0.6, 156.25),
        (0.7, 243.06),
        (0.8, 416.67),
        (0.9, 937.5),
        (0.95, 1979.17),
    ] {
        let indirect = 1e4 / 96.0 * rho / (1.0 - rho);
        page.form((indirect / truth - 1.0).abs() < 1e-4, "the closed form itself");
        let room = format!("void plastic m 0 0 5 {rho} {rho} {rho} 0 0\n!genbox m room 4 4 4 -i\n");
        let world = rad(&(isotropic(1e4, [2.0; 3], 0.005) + &room));
        // Every wall has the same mean, a quarter of one stands for all. The lamp's own part is known.
        let direct = |at: V3| {
            let to = add([2.0; 3], at, -1.0);
            1e4 / EFFICACY / (4.0 * PI) * to[2] / dot(to, to).powf(1.5)
        };
        let e = lux(mean_over(&world, [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], 1e-5, 3, direct));
        e.check(page, &format!("5.8, reflectance {rho}"), indirect, indirect * rho);
    }
}
