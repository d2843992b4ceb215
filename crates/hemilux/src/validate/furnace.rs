//! Furnaces and interreflection in spheres.

use super::scenes::{diffuse, emission, empty, sphere};
use super::*;
use std::f64::consts::PI;

/// Nothing that loses nothing can be seen in uniform surroundings: E = π beside a ball of it.
pub(super) fn white_furnace_of_every_material(page: &mut Page) {
    let sky = "void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 360\n";
    let ball = "m sphere b 0 0 4 0 0 2 1\n";
    // The ball fills a quarter of the sensor's cosine-weighted sky.
    let without = PI * (1.0 - 0.25);
    for material in [
        "plastic m 0 0 5 1 1 1 0 0",
        "plastic m 0 0 5 1 1 1 .05 0",
        "metal m 0 0 5 1 1 1 1 0",
        "mirror m 0 0 3 1 1 1",
        "glass m 0 0 3 1 1 1",
        "dielectric m 0 0 5 1 1 1 1.5 0",
        "trans m 0 0 7 1 1 1 0 0 .5 0",
        "trans m 0 0 7 1 1 1 .1 0 .5 .3",
    ] {
        let world = rad(&format!("{sky}void {material}\n{ball}"));
        sensed(&world, [0.0; 3], [0.0, 0.0, 1.0], 2048).check(page, material, PI, PI - 0.02 * (PI - without));
    }
}

/// Inside of a sphere that emits Le and reflects ρ: E = π Le / (1 − ρ), anywhere and any way up.
pub(super) fn an_emitting_sphere(page: &mut Page) {
    for (le, rho, l) in [(0.5, 0.5, 1.0), (1.0, 0.8, 5.0), (0.1, 0.9, 1.0)] {
        let mut scene = empty();
        let m = diffuse(&mut scene, rho);
        sphere(&mut scene, [0.0; 3], 1.0, true, m, emission(le));
        let world = World::new(scene);
        let e = sensed(&world, [0.2, 0.3, -0.1], [0.5, 0.1, 1.0], 512);
        // Wrong: one bounce less.
        e.check(page, &format!("sphere {le} {rho}"), PI * l, PI * l * rho as f64);
    }
}

/// A sphere of radius r, emitting `le` and reflecting ρ1, within one of radius R reflecting ρ2: B1 = π Le + ρ1 B2,
/// B2 = ρ2 (F B1 + (1 − F) B2), F = (r / R)². Irradiance of the outer sphere.
pub fn concentric(le: f64, ratio: f64, rho1: f64, rho2: f64) -> f64 {
    let f = ratio * ratio;
    let c = 1.0 - rho2 * (1.0 - f);
    let b1 = PI * le * c / (c - rho1 * rho2 * f);
    f * b1 / c
}

pub(super) fn concentric_spheres(page: &mut Page) {
    for (rho1, rho2, l2) in [(0.0, 0.5, 0.2), (0.5, 0.5, 0.222222222), (0.3, 0.8, 0.588235294)] {
        let truth = concentric(1.0, 0.5, rho1, rho2);
        page.form((truth * rho2 / PI - l2).abs() < 1e-8, "the closed form itself");
        let mut scene = empty();
        let (inner, outer) = (diffuse(&mut scene, rho1 as f32), diffuse(&mut scene, rho2 as f32));
        sphere(&mut scene, [0.0; 3], 1.0, false, inner, emission(1.0));
        sphere(&mut scene, [0.0; 3], 2.0, true, outer, None);
        let world = World::new(scene);
        let e = sensed(&world, [0.0, 1.999_999, 0.0], [0.0, -1.0, 0.0], 2048);
        // Wrong: the inner sphere casts no shadow.
        e.check(page, &format!("concentric {rho1} {rho2}"), truth, PI * 0.25 / (1.0 - rho2));
    }
}

/// A small lamp of intensity I = π at the centre of a unit sphere: L = ρ I / (π R² (1 − ρ)) = 1 at ρ = 0.5, and E = L π / ρ.
pub(super) fn a_lamp_at_the_centre_of_a_sphere(page: &mut Page) {
    let r = 1e-3;
    let text = format!(
        "void light l 0 0 3 {0} {0} {0}\nl sphere lamp 0 0 4 0 0 0 {r}\n\
         void plastic m 0 0 5 .5 .5 .5 0 0\nm bubble wall 0 0 4 0 0 0 1\n",
        1.0 / (r * r)
    );
    let e = sensed(&rad(&text), [0.0, 0.0, -0.999_999], [0.0, 0.0, 1.0], 4096);
    e.check(page, "lamp in a sphere", 2.0 * PI, PI);
}
