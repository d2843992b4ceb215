//! Virtual luminaires in plane mirrors, by the image method.

use super::furnace::concentric;
use super::oracle::*;
use super::*;
use std::f64::consts::PI;

const UP: V3 = [0.0, 0.0, 1.0];

/// A lamp of given power and any size beside a mirror of reflectance 0.9: Φ cos θ / (4 π D²), direct and from its image. From a metre
/// down to where its image covers 1e-9 of the hemisphere the noise at equal rays does not grow.
pub(super) fn a_shrinking_lamp_and_its_image(page: &mut Page) {
    let (direct, image) = (1.423525087, 0.339551070);
    let mut errors = Vec::new();
    for r in [0.3, 0.1, 1e-2, 1e-3, 1e-4] {
        let l = 100.0 / (4.0 * PI * PI * r * r);
        let text = format!(
            "void light l 0 0 3 {l} {l} {l}\nl sphere lamp 0 0 4 1 0 2 {r}\n\
             void mirror m 0 0 3 .9 .9 .9\n{}void plastic b 0 0 5 0 0 0 0 0\n{}",
            quad("m", [2.0, -3.0, 0.0], [0.0, 0.0, 5.0], [0.0, 6.0, 0.0]),
            quad("b", [-1.0, -1.5, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
        );
        let e = sensed_with_residuals(&rad(&text), [0.0, 0.0, 1e-5], UP, 2048, 1 << 19);
        e.check(page, &format!("lamp of {r} m"), direct + 0.9 * image, direct + image);
        errors.push(e.error);
    }
    page.at_most(
        "noise of the smallest lamp over that of the largest, at equal gathers",
        errors[4] / errors[0],
        1.0,
    );
}

pub(super) fn a_square_in_an_unbounded_mirror_and_in_a_window_of_it(page: &mut Page) {
    let lamp = quad("l", [0.0, -0.5, 3.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let square = corners([0.0, -0.5, 3.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let direct = 10.0 * lambert(&square, [0.0; 3], UP);
    page.form((direct - 1.018129811).abs() < 1e-8, "the closed form itself");
    for (what, rho, corner, e1, e2, image) in [
        ("unbounded", 0.9, [2.0, -50.0, -50.0], [0.0, 0.0, 100.0], [0.0, 100.0, 0.0], 0.201549034),
        ("window", 1.0, [2.0, -0.2, 1.0], [0.0, 0.0, 0.7], [0.0, 1.2, 0.0], 0.068923926),
    ] {
        let virtual_part = 10.0 * lambert_in_mirror(&square, &corners(corner, e1, e2), [0.0; 3], UP);
        page.form((virtual_part - image).abs() < 1e-8, "the closed form itself");
        let mirror = quad("m", corner, e1, e2);
        let text =
            format!("void light l 0 0 3 10 10 10\n{lamp}void mirror m 0 0 3 {rho} {rho} {rho}\n{mirror}");
        sensed(&rad(&text), [0.0; 3], UP, 8192).check(page, what, direct + rho * image, direct);
    }
}

/// Concentric spheres cut by mirrors through their centre look as if they were whole: diffuse dome, half or a quarter or an eighth
/// of it, on one to three mirrors, round a ball of intensity 10 W/sr; chains of up to three mirrors, interreflection included.
pub(super) fn domes_on_one_to_three_mirrors(page: &mut Page) {
    let (big, rho, intensity) = (2.0, 0.5, 10.0);
    let planes = [
        quad("m", [-3.0, -3.0, 0.0], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0]),
        quad("m", [0.0, -3.0, -3.0], [0.0, 6.0, 0.0], [0.0, 0.0, 6.0]),
        quad("m", [-3.0, 0.0, -3.0], [0.0, 0.0, 6.0], [6.0, 0.0, 0.0]),
    ];
    let towards = unit([0.5, 0.6, 0.4]);
    let (place, back) = (towards.map(|x| 1.999_999 * x), towards.map(|x| -x));
    for r in [0.3, 0.02] {
        let le = intensity / (PI * r * r);
        let truth = concentric(le, r / big, 0.0, rho);
        // The limit of a small lamp, L = ρ I / (π R² (1 − ρ)) = 0.795774715; a lamp just above one mirror is two of these.
        page.form(r > 0.1 || (truth * rho / PI / 0.795774715 - 1.0).abs() < 1e-3, "the closed form itself");
        let text = format!(
            "void light l 0 0 3 {le} {le} {le}\nl sphere lamp 0 0 4 0 0 0 {r}\n\
             void plastic d 0 0 5 {rho} {rho} {rho} 0 0\nd bubble dome 0 0 4 0 0 0 {big}\n"
        );
        for count in 0..=3 {
            let world = rad(&format!("{text}void mirror m 0 0 3 1 1 1\n{}", planes[..count].concat()));
            // The image of the small lamp is found from records.
            let e = if r > 0.1 {
                sensed(&world, place, back, 4096)
            } else {
                sensed_with_residuals(&world, place, back, 4096, 1 << 20)
            };
            e.check(page, &format!("lamp of {r} m on {count} mirrors"), truth, truth * rho);
        }
        // Negative control: a black board in place of the mirror.
        let world = rad(&format!("{text}void plastic m 0 0 5 0 0 0 0 0\n{}", planes[0]));
        let e = sensed(&world, place, back, 1024);
        page.form(e.z(truth) < -10.0, "black boards for mirrors must show");
    }
}

/// A lamp between two mirrors that face each other: E = Σ ρ^k I cos_k / D_k².
pub(super) fn two_facing_mirrors(page: &mut Page) {
    let (rho, gap, x, h, r) = (0.8f64, 2.0, 1.3, 2.0, 0.1);
    let l = 1.0 / (PI * r * r);
    let text = format!(
        "void light l 0 0 3 {l} {l} {l}\nl sphere lamp 0 0 4 {x} 0 {h} {r}\nvoid mirror m 0 0 3 {rho} {rho} {rho}\n{}{}",
        quad("m", [0.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0]),
        quad("m", [gap, -2.0, 0.0], [0.0, 0.0, 3.0], [0.0, 4.0, 0.0]),
    );
    let sensor = 0.6;
    let part = |k: i32, image: f64| {
        let d2 = (image - sensor).powi(2) + h * h;
        rho.powi(k) * h / d2.powf(1.5)
    };
    let direct = part(0, x);
    // Images lie at 2 m gap ± x, by |2 m| and |2 m − 1| reflections.
    let mut truth = direct;
    for m in 1..40 {
        let shift = 2.0 * m as f64 * gap;
        truth += part(2 * m, x + shift)
            + part(2 * m, x - shift)
            + part(2 * m - 1, shift - x)
            + part(2 * m - 1, -x - shift + 2.0 * gap);
    }
    let first = direct + part(1, -x) + part(1, 2.0 * gap - x);
    sensed(&rad(&text), [sensor, 0.0, 0.0], UP, 16_384).check(page, "facing mirrors", truth, first);
}

/// A mirror at 45° turns the beam of a panel down to the sensor.
pub(super) fn a_beam_turned_by_a_mirror(page: &mut Page) {
    let (p, e1, e2) = ([-2.0, -0.5, 1.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let (m, f1, f2) = ([-0.4, -0.6, 2.4], [0.8, 0.0, -0.8], [0.0, 1.2, 0.0]);
    let panel = corners(p, e1, e2);
    let (direct, turned) =
        (lambert(&panel, [0.0; 3], UP), lambert_in_mirror(&panel, &corners(m, f1, f2), [0.0; 3], UP));
    let text = format!(
        "void light l 0 0 3 1 1 1\n{}void mirror m 0 0 3 .8 .8 .8\n{}",
        quad("l", p, e1, e2),
        quad("m", m, f1, f2)
    );
    sensed(&rad(&text), [0.0; 3], UP, 8192).check(page, "corner", direct + 0.8 * turned, direct);
}

/// A convex fan of ten facets shows clipped images of a panel.
pub(super) fn a_fan_of_facets(page: &mut Page) {
    let (p, e1, e2) = ([1.2, -0.4, 2.4], [0.0, 0.8, 0.0], [0.8, 0.0, 0.0]);
    let panel = corners(p, e1, e2);
    let sensor = [2.0, 0.1, 0.0];
    let (mut text, mut fan) =
        (format!("void light l 0 0 3 1 1 1\n{}void mirror m 0 0 3 1 1 1\n", quad("l", p, e1, e2)), 0.0);
    // Facets of a cylinder of radius 1 about the axis x = −0.3, z = 1.3, on the side of +x.
    let at = |i: i32| {
        let phi = (-50.0 + 10.0 * i as f64).to_radians();
        [-0.3 + phi.cos(), -1.0, 1.3 + phi.sin()]
    };
    for i in 0..10 {
        let (a, b) = (at(i), at(i + 1));
        let edge = add(b, a, -1.0);
        fan += lambert_in_mirror(&panel, &corners(a, edge, [0.0, 2.0, 0.0]), sensor, UP);
        text += &quad("m", a, [0.0, 2.0, 0.0], edge);
    }
    let direct = lambert(&panel, sensor, UP);
    page.form(fan > 0.02 * direct, "the fan shows something");
    sensed(&rad(&text), sensor, UP, 32_768).check(page, "fan", direct + fan, direct);
}
