//! Cases modelled on CIE 171 for daylight (5.9 to 5.14): openings in black rooms; references are closed forms or quadrature.

use super::oracle::*;
use super::scenes::{diffuse, empty};
use super::*;
use hemilux_scene::geom::DAffine3;
use hemilux_scene::*;
use std::f64::consts::PI;

const UP: V3 = [0.0, 0.0, 1.0];

/// Relative radiance of a CIE standard general sky (CIE S 011), zenith 1: gradation (a, b) and indicatrix (c, d, e).
fn general_sky(kind: usize, d: V3, sun: V3) -> f64 {
    const GRADATION: [(f64, f64); 6] =
        [(4.0, -0.7), (1.1, -0.8), (0.0, -1.0), (-1.0, -0.55), (-1.0, -0.32), (-1.0, -0.15)];
    const INDICATRIX: [(f64, f64, f64); 6] = [
        (0.0, -1.0, 0.0),
        (2.0, -1.5, 0.15),
        (5.0, -2.5, 0.3),
        (10.0, -3.0, 0.45),
        (16.0, -3.0, 0.3),
        (24.0, -2.8, 0.15),
    ];
    const TYPES: [(usize, usize); 15] = [
        (0, 0),
        (0, 1),
        (1, 0),
        (1, 1),
        (2, 0),
        (2, 1),
        (2, 2),
        (2, 3),
        (3, 1),
        (3, 2),
        (3, 3),
        (4, 3),
        (4, 4),
        (5, 4),
        (5, 5),
    ];
    let ((a, b), (c, k, e)) = (GRADATION[TYPES[kind].0], INDICATRIX[TYPES[kind].1]);
    let gradation = |cos: f64| 1.0 + a * (b / cos.max(1e-6)).exp();
    let indicatrix = |cos: f64| 1.0 + c * ((k * cos.acos()).exp() - (k * 0.5 * PI).exp()) + e * cos * cos;
    indicatrix(dot(d, sun).clamp(-1.0, 1.0)) / indicatrix(sun[2]) * gradation(d[2]) / gradation(1.0)
}

/// The four strips of a surround (parallelogram at `p`) that leave the window [a0, a1] × [b0, b1] of it open.
pub fn surround(p: V3, e1: V3, e2: V3, a: [f64; 2], b: [f64; 2]) -> String {
    let strip = |a0: f64, a1: f64, b0: f64, b1: f64| {
        let corner = add(add(p, e1, a0), e2, b0);
        quad("k", corner, e1.map(|x| x * (a1 - a0)), e2.map(|x| x * (b1 - b0)))
    };
    strip(0.0, a[0], 0.0, 1.0)
        + &strip(a[1], 1.0, 0.0, 1.0)
        + &strip(a[0], a[1], 0.0, b[0])
        + &strip(a[0], a[1], b[1], 1.0)
}

/// Radiance's overcast sky of gensky for a horizontal irradiance: CIE's, blended with the ground (of reflectance 0.2) near the horizon as
/// `skybright.cal` does.
pub fn gensky_overcast(horizontal: f64, d: V3) -> f64 {
    let zenith = horizontal / (7.0 * PI / 9.0);
    let (sky, ground) = (zenith * (1.0 + 2.0 * d[2]) / 3.0, zenith * 7.0 / 9.0 * 0.2);
    let w = (d[2] + 1.01).powi(10);
    (w * sky + ground / w) / (w + 1.0 / w)
}

/// The scene under a sky given as an image, nothing below the horizon.
pub fn under_sky(mut scene: Scene, radiance: impl Fn(V3) -> f64) -> Scene {
    let (width, height) = (720u32, 360u32);
    let texel = |x: u32, y: u32| {
        let theta = (y as f64 + 0.5) / height as f64 * PI;
        let phi = (x as f64 + 0.5) / width as f64 * 2.0 * PI;
        let d = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        if d[2] > 0.0 { Rgb::splat(radiance(d) as f32) } else { Rgb::BLACK }
    };
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    scene.images.push(TextureImage { width, height, texels, alpha: None, path: Default::default() });
    scene.environments.push(Environment::Image {
        image: ImageId(0),
        scale: Rgb::WHITE,
        layout: EnvironmentLayout::LatLong,
        to_world: DAffine3::IDENTITY,
        portal: None,
    });
    scene
}

/// Like 5.9: an unglazed opening of 2 m x 1.5 m in a roof, under the fifteen CIE general skies (sun 40° high), given as images.
pub(super) fn case_5_9_a_roof_opening_under_general_skies(page: &mut Page) {
    let (p, e1, e2) = ([1.0, 0.5, 3.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]);
    let sensor = [1.2, 0.7, 0.0];
    let sun = [40f64.to_radians().cos(), 0.0, 40f64.to_radians().sin()];
    for kind in 0..15 {
        let mut scene = empty();
        let black = diffuse(&mut scene, 0.0);
        let mut board = |p, e1, e2| super::scenes::quad(&mut scene, p, e1, e2, black, None);
        for (x, y, w, h) in
            [(-5.0, -5.0, 6.0, 10.0), (3.0, -5.0, 2.0, 10.0), (1.0, -5.0, 2.0, 5.5), (1.0, 2.0, 2.0, 3.0)]
        {
            board([x, y, 3.0], [w, 0.0, 0.0], [0.0, h, 0.0]);
        }
        for (x, y) in [(-5.0, 0.0), (5.0, 0.0)] {
            board([x, y - 5.0, -1.0], [0.0, 10.0, 0.0], [0.0, 0.0, 4.0]);
            board([y - 5.0, x, -1.0], [10.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
        }
        let world = World::new(under_sky(scene, |d| general_sky(kind, d, sun)));
        let truth = through(p, e1, e2, sensor, UP, |d, _| general_sky(kind, d, sun));
        // Wrong: the sky mirrored in azimuth, or its zenith's radiance everywhere, or 2 % more.
        let turned = through(p, e1, e2, sensor, UP, |d, _| general_sky(kind, [-d[0], d[1], d[2]], sun));
        let even = lambert(&corners(p, e1, e2), sensor, UP);
        let differs = |e: &f64| (e - truth).abs() > 0.02 * truth;
        let wrong = [turned, even].into_iter().find(differs).unwrap_or(1.02 * truth);
        sensed(&world, sensor, UP, 8192).check(page, &format!("5.9, sky {}", kind + 1), truth, wrong);
    }
}

/// Like 5.9 and 5.10: the roof opening under gensky's overcast sky and under a uniform one, unglazed and glazed.
pub(super) fn case_5_10_a_glazed_roof_opening(page: &mut Page) {
    let (p, e1, e2) = ([1.0, 0.5, 3.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]);
    let (x, y, z) = ([10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 4.0]);
    let corner = [-5.0, -5.0, -1.0];
    let roof = "void plastic k 0 0 5 0 0 0 0 0\n".to_owned()
        + &surround([-5.0, -5.0, 3.0], x, y, [0.6, 0.8], [0.55, 0.7])
        + &quad("k", corner, y, z)
        + &quad("k", [5.0, -5.0, -1.0], z, y)
        + &quad("k", corner, z, x)
        + &quad("k", [-5.0, 5.0, -1.0], x, z);
    let glazing = format!("void glass c 0 0 3 .96 .96 .96\n{}", quad("c", p, e1, e2));
    let uniform = "void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\n".to_owned();
    let overcast =
        "!gensky 6 21 12 -c -B 50\nskyfunc glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\n".to_owned();
    let zenith = 50.0 / (7.0 * PI / 9.0);
    for sensor in [[2.0, 1.2, 0.0], [0.4, 1.0, 0.8]] {
        let sky = |glazed: bool, d: V3, cos: f64, cloudy: bool| {
            let l = if cloudy { gensky_overcast(50.0, d) } else { 1.0 };
            l * if glazed { pane(cos, 1.52, 0.96) } else { 1.0 }
        };
        for (what, text, cloudy) in [("uniform", &uniform, false), ("overcast", &overcast, true)] {
            let e = |glazed: bool| through(p, e1, e2, sensor, UP, |d, cos| sky(glazed, d, cos, cloudy));
            let open = rad(&format!("{text}{roof}"));
            let even = through(p, e1, e2, sensor, UP, |_, _| if cloudy { zenith } else { 1.02 });
            sensed(&open, sensor, UP, 8192).check(page, &format!("5.9, {what}, {sensor:?}"), e(false), even);
            let glazed = rad(&format!("{text}{roof}{glazing}"));
            sensed(&glazed, sensor, UP, 8192).check(
                page,
                &format!("5.10, {what}, {sensor:?}"),
                e(true),
                e(false),
            );
        }
    }
}

/// The facade of the cases below: a black wall y = 0 with a window of 2 m x 1.5 m, seen from inside (y > 0).
const WINDOW: (V3, V3, V3) = ([1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.5]);

fn facade() -> String {
    // Sky of radiance 1 above the horizon, ground of 0.2 below it: the externally reflected part.
    let wall = surround(
        [-20.0, 0.0, -20.0],
        [40.0, 0.0, 0.0],
        [0.0, 0.0, 40.0],
        [21.0 / 40.0, 23.0 / 40.0],
        [21.0 / 40.0, 22.5 / 40.0],
    );
    // The room behind it: the other five walls of a black box.
    let (x, y, z) = ([40.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 40.0]);
    let corner = [-20.0, 0.0, -20.0];
    let room = quad("k", corner, x, y)
        + &quad("k", [-20.0, 0.0, 20.0], y, x)
        + &quad("k", corner, y, z)
        + &quad("k", [20.0, 0.0, -20.0], z, y)
        + &quad("k", [-20.0, 20.0, -20.0], x, z);
    format!(
        "void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\nvoid glow h 0 0 4 .2 .2 .2 0\nh source e 0 0 4 0 0 -1 180\n\
         void plastic k 0 0 5 0 0 0 0 0\n{wall}{room}"
    )
}

/// Sensors of the facade's cases: a desk and two walls.
const SENSORS: [(V3, V3); 3] =
    [([2.0, 1.5, 0.8], UP), ([2.0, 3.0, 1.5], [0.0, -1.0, 0.0]), ([0.2, 1.0, 1.6], [1.0, -0.3, 0.0])];

/// Sky above the sensor's horizon, ground below, of the part of the facade's window that is not hidden.
fn from_facade(part: &[V3], sensor: V3, n: V3) -> f64 {
    let (above, below) = (clip(part, sensor, UP), clip(part, sensor, [0.0, 0.0, -1.0]));
    let e = |polygon: &[V3]| if polygon.len() > 2 { lambert(polygon, sensor, n) } else { 0.0 };
    e(&above) + 0.2 * e(&below)
}

/// Like 5.11: an unglazed opening in a facade; sky and external reflected component.
pub(super) fn case_5_11_a_facade_opening(page: &mut Page) {
    let world = rad(&facade());
    let (p, e1, e2) = WINDOW;
    let window = corners(p, e1, e2);
    for (sensor, n) in SENSORS {
        let truth = from_facade(&window, sensor, n);
        // Wrong: no ground; for a sensor that does not see it, 1 % more.
        let sky_only = lambert(&clip(&window, sensor, UP), sensor, n);
        let wrong = if sky_only < 0.99 * truth { sky_only } else { 1.01 * truth };
        sensed(&world, sensor, n, 16_384).check(page, &format!("5.11, {sensor:?}"), truth, wrong);
    }
}

/// Like 5.12: the same, glazed.
pub(super) fn case_5_12_a_glazed_facade_opening(page: &mut Page) {
    let (p, e1, e2) = WINDOW;
    let world = rad(&(facade() + "void glass c 0 0 3 .96 .96 .96\n" + &quad("c", p, e1, e2)));
    for (sensor, n) in SENSORS {
        let outside = |d: V3| if d[2] > 0.0 { 1.0 } else { 0.2 };
        // The window is cut at the horizon, where the integrand jumps.
        let parts = |t: &dyn Fn(f64) -> f64| {
            let split = (sensor[2] - p[2]).clamp(0.0, 1.5);
            [(p[2], split), (p[2] + split, 1.5 - split)]
                .iter()
                .filter(|(_, height)| *height > 0.0)
                .map(|&(z, height)| {
                    through([p[0], 0.0, z], e1, [0.0, 0.0, height], sensor, n, |d, cos| outside(d) * t(cos))
                })
                .sum::<f64>()
        };
        let truth = parts(&|cos| pane(cos, 1.52, 0.96));
        // Wrong: the transmittance at normal incidence for every direction.
        let normal = parts(&|_| pane(1.0, 1.52, 0.96));
        let wrong = if (normal / truth - 1.0).abs() > 0.01 { normal } else { parts(&|_| 1.0) };
        sensed(&world, sensor, n, 16_384).check(page, &format!("5.12, {sensor:?}"), truth, wrong);
    }
}

/// Like 5.13 and 5.14: a black mask outside, lying over the window or standing beside it.
pub(super) fn cases_5_13_and_5_14_masks(page: &mut Page) {
    let (p, e1, e2) = WINDOW;
    let window = corners(p, e1, e2);
    for (what, m, f1, f2) in [
        ("5.13, horizontal", [-3.0, -1.0, 2.5], [8.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ("5.14, vertical", [3.0, -1.2, -4.0], [0.0, 1.2, 0.0], [0.0, 0.0, 12.0]),
    ] {
        let world = rad(&(facade() + &quad("k", m, f1, f2)));
        let mask = corners(m, f1, f2);
        for (sensor, n) in SENSORS {
            let hidden = seen_through(&window, sensor, &mask);
            let open = from_facade(&window, sensor, n);
            let truth = open - if hidden.len() > 2 { from_facade(&hidden, sensor, n) } else { 0.0 };
            let wrong = if truth < 0.99 * open { open } else { 1.01 * truth };
            sensed(&world, sensor, n, 16_384).check(page, &format!("{what}, {sensor:?}"), truth, wrong);
        }
    }
}
