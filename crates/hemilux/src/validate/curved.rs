//! Virtual luminaires in curved reflectors: mirror ball, concave bowl, paraboloid, ellipsoid.

use super::oracle::*;
use super::scenes::{diffuse, emission, empty, material, quad as board, revolved, sphere};
use super::*;
use hemilux_scene::*;
use std::f64::consts::PI;

const DOWN: V3 = [0.0, 0.0, -1.0];

fn mirror(scene: &mut Scene) -> MaterialId {
    let smooth = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
    let fresnel = ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::WHITE));
    material(scene, MaterialKind::Conductor { fresnel, roughness: smooth })
}

/// A sun of half-angle `degrees` overhead that gives irradiance 1 on the horizontal.
fn sun(scene: &mut Scene, degrees: f64) {
    let half = degrees.to_radians();
    let radiance = Rgb::splat((1.0 / (PI * half.sin().powi(2))) as f32);
    let direction = geom::Vec3::Z;
    scene.environments.push(Environment::Sun { direction, cos_half_angle: half.cos(), radiance });
}

/// A ball of radius 1 in collimated light: E = E0 (R² / 4) / ((s + R cos α / 2) (s + R / (2 cos α))) across the ray at
/// distance s, α the angle at the surface; here on the plane z = 3 (factor cos 2α).
pub(super) fn mirror_ball(page: &mut Page) {
    for (degrees, r, truth) in [
        (5.0, 0.440481682, 0.038320524),
        (10.0, 0.907118172, 0.033590432),
        (20.0, 2.070823305, 0.018815495),
        (30.0, 4.196152423, 0.005487855),
    ] {
        let mut scene = empty();
        let (m, black) = (mirror(&mut scene), diffuse(&mut scene, 0.0));
        sphere(&mut scene, [0.0; 3], 1.0, false, m, None);
        // A patch behind the sensor, for light particles to say where the sun's image is. It shades the ball outside the
        // rays that matter.
        let w = 0.1f32 + 0.05 * r as f32;
        board(&mut scene, [r as f32 - w, -w, 3.0], [0.0, 2.0 * w, 0.0], [2.0 * w, 0.0, 0.0], black, None);
        sun(&mut scene, 0.5);
        let world = World::new(scene);
        let e = sensed_with_residuals(&world, [r, 0.0, 3.0 - 1e-4], DOWN, 16_384, 1 << 21);
        e.check(page, &format!("mirror ball, {degrees} degrees"), truth, 1.03 * truth);
    }
}

/// A concave spherical bowl: flux through rings beyond the focus is that of the annulus of the beam that goes there.
pub(super) fn bowl(page: &mut Page) {
    let (radius, height, rim) = (2.0f64, 3.0, 0.5f64);
    // Where the ray at offset h from the axis meets the plane z = height.
    let lands = |h: f64| h - (height + (radius * radius - h * h).sqrt()) * (2.0 * (h / radius).asin()).tan();
    for (h0, h1) in [(0.25, 0.35), (0.35, 0.45)] {
        let mut scene = empty();
        let (m, black) = (mirror(&mut scene), diffuse(&mut scene, 0.0));
        let profile = |t: f64| {
            let r = rim * t;
            let z = -(radius * radius - r * r).sqrt();
            ([r, z], [-r, -z])
        };
        revolved(&mut scene, [64, 128], profile, m);
        let [inner, outer] = [h0, h1].map(|h: f64| lands(h).abs());
        let ring = |t: f64| ([inner + (outer - inner) * t, height], [0.0, -1.0]);
        revolved(&mut scene, [1, 256], ring, black);
        sun(&mut scene, 0.05);
        let world = World::new(scene);
        // The sun falls on the other side of the ring, all of it; the rest of the flux comes from the bowl.
        let sides = 256.0;
        let polygon = (2.0 * PI / sides).sin() * sides / 2.0;
        let above = polygon * (outer * outer - inner * inner);
        let flux = by_replicates(&world, 500, 1 << 21, |z| flux(z, 0) + flux(z, 1) - above);
        let truth = PI * (h1 * h1 - h0 * h0);
        flux.check(page, &format!("concave bowl, offsets {h0} to {h1} m"), truth, 1.2 * truth);
    }
}

/// A small lamp of intensity I at the focus: a parallel beam of E(r) = I / (f² (1 + r² / 4f²)²).
pub(super) fn paraboloid(page: &mut Page) {
    let (f, intensity, lamp, rim) = (0.5f64, 100.0f64, 0.01f64, 1.2f64);
    let mut scene = empty();
    let (m, black) = (mirror(&mut scene), diffuse(&mut scene, 0.0));
    let profile = |t: f64| {
        let r = rim * t;
        ([r, r * r / (4.0 * f)], [-r / (2.0 * f), 1.0])
    };
    revolved(&mut scene, [200, 400], profile, m);
    let radiance = (intensity / (PI * lamp * lamp)) as f32;
    sphere(&mut scene, [0.0, 0.0, f], lamp, false, black, emission(radiance));
    board(&mut scene, [-1.5, -1.5, 2.0], [0.0, 3.0, 0.0], [3.0, 0.0, 0.0], black, None);
    let world = World::new(scene);
    for (r, beam) in [(0.1f64, 400.0 / 1.01f64.powi(2)), (0.25, 354.325260), (0.5, 256.0), (1.0, 100.0)] {
        let d2 = r * r + 1.5 * 1.5;
        let direct = intensity * 1.5 / d2.powf(1.5);
        let e = sensed_with_residuals(&world, [r, 0.0, 2.0 - 1e-4], DOWN, 2048, 1 << 21);
        e.check(page, &format!("paraboloid, {r} m off the axis"), beam + direct, beam + 2.0 * direct);
    }
}

/// Part of an ellipsoid: what it takes of the lamp's flux at one focus goes to the other.
pub(super) fn ellipsoid(page: &mut Page) {
    // Half-axes a along z and b; foci at z = ±c. The reflector is the part below z = -0.2.
    let (a, c, cut, lamp) = (1.0f64, 0.6f64, -0.2f64, 0.004f64);
    let b = (a * a - c * c).sqrt();
    let mut scene = empty();
    let (m, black) = (mirror(&mut scene), diffuse(&mut scene, 0.0));
    let last = (-cut / a).acos();
    let profile = |t: f64| {
        let (s, k) = (last * t).sin_cos();
        ([b * s, -a * k], [-s / b, k / a])
    };
    revolved(&mut scene, [200, 400], profile, m);
    sphere(&mut scene, [0.0, 0.0, -c], lamp, false, black, emission((1.0 / (lamp * lamp)) as f32));
    let size = 0.05f32;
    board(&mut scene, [-size, -size, c as f32], [0.0, 2.0 * size, 0.0], [2.0 * size, 0.0, 0.0], black, None);
    let world = World::new(scene);
    // Seen from the lamp, the rim stands at this angle from the reflector's axis (-z).
    let rim = b * last.sin();
    let cos = (cut + c) / (rim * rim + (cut + c).powi(2)).sqrt();
    let power = 4.0 * PI * PI;
    let share = 0.5 * (1.0 + cos);
    // Straight from the lamp comes the solid angle of the board; the lamp catches as much of what is reflected.
    let direct = 4.0 * (size as f64).powi(2) / (2.0 * c).powi(2) / (4.0 * PI);
    let truth = power * (share + direct);
    let caught = by_replicates(&world, 300, 1 << 19, |z| flux(z, 0) + flux(z, 1));
    caught.check(page, "ellipsoid, flux at the other focus", truth, 0.98 * truth);
}
