//! Fresnel terms and thin panes against tabulated values.

use crate::direction;
use hemilux::bsdf::{Bsdf, Transport, fresnel};
use hemilux_scene::Rgb;

fn degrees(angle: f32) -> f32 {
    angle.to_radians().cos()
}

#[test]
fn dielectric_values() {
    for (angle, expected) in [(0.0, 0.04), (45.0, 0.050240), (60.0, 0.089187), (80.0, 0.387704)] {
        let f = fresnel::dielectric(degrees(angle), 1.5);
        assert!((f - expected).abs() < 1.5e-6, "{angle}: {f}");
    }
    // Negative control: another index.
    assert!((fresnel::dielectric(degrees(60.0), 1.501) - 0.089187).abs() > 1.5e-6);
    // From inside at the angle of refraction: the same; beyond the critical angle 1; Brewster's angle: half of the s term.
    let sin = 60f32.to_radians().sin() / 1.5;
    assert!((fresnel::dielectric((1.0 - sin * sin).sqrt(), 1.0 / 1.5) - 0.089187).abs() < 1.5e-6);
    assert_eq!(fresnel::dielectric(degrees(42.0), 1.0 / 1.5), 1.0);
    let brewster = 1.5f32.atan().cos();
    let s = ((1.0 - 2.25f32) / (1.0 + 2.25)).powi(2);
    assert!((fresnel::dielectric(brewster, 1.5) - 0.5 * s).abs() < 1e-6);
    assert_eq!(fresnel::dielectric(0.0, 1.5), 1.0);
    assert_eq!(fresnel::dielectric(0.3, 1.0), 0.0);
}

#[test]
fn dielectric_means() {
    for (eta, external, internal) in
        [(1.5, 0.091778, 0.596346), (1.33, 0.065931, 0.471949), (1.52, 0.094707, 0.608166)]
    {
        assert!((fresnel::mean_dielectric(eta) - external).abs() < 1e-6, "{eta}");
        assert!((fresnel::mean_dielectric_internal(eta) - internal).abs() < 1e-6, "{eta}");
    }
    // Against quadrature, thin and thick indices from both sides; midpoints in μ² with 1e5 points are good to 1e-6.
    for eta in [1.0001f32, 1.01, 1.2, 2.4, 5.0, 1.0 / 1.5, 0.3] {
        let n = 100_000;
        let sum: f64 =
            (0..n).map(|i| fresnel::dielectric(((i as f32 + 0.5) / n as f32).sqrt(), eta) as f64).sum();
        let mean = fresnel::mean_dielectric(eta);
        assert!((sum / n as f64 - mean as f64).abs() < 2e-6, "{eta}: {mean} {}", sum / n as f64);
    }
}

/// The same in complex numbers, double precision.
fn conductor_reference(cos: f64, eta: f64, k: f64) -> f64 {
    type C = (f64, f64);
    let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let norm2 = |a: C| a.0 * a.0 + a.1 * a.1;
    let sqrt = |a: C| {
        let m = norm2(a).sqrt();
        (((m + a.0) / 2.0).max(0.0).sqrt(), ((m - a.0) / 2.0).max(0.0).sqrt())
    };
    let n = (eta, k);
    let n2 = mul(n, n);
    let t = sqrt((n2.0 - (1.0 - cos * cos), n2.1));
    let s = norm2((cos - t.0, -t.1)) / norm2((cos + t.0, t.1));
    let nc = (n2.0 * cos, n2.1 * cos);
    let p = norm2((nc.0 - t.0, nc.1 - t.1)) / norm2((nc.0 + t.0, nc.1 + t.1));
    0.5 * (s + p)
}

#[test]
fn conductor_values() {
    for (eta, k) in
        [(0.143, 3.983), (1.442, 1.603), (1.0, 6.0), (1.0, 63.2), (3.0, 0.0), (0.05, 9.0), (1.0, 0.02)]
    {
        for i in 0..=1000 {
            let cos = (i as f32 / 1000.0).powi(2);
            let f = fresnel::conductor(cos, Rgb::splat(eta), Rgb::splat(k))[0];
            let expected = conductor_reference(cos as f64, eta as f64, k as f64);
            assert!((f as f64 - expected).abs() < 1e-5, "{eta} {k} {cos}: {f} {expected}");
        }
    }
    // r = 0.9 falls to 0.8539 at 75 degrees; r = 1 is perfect everywhere.
    let k = fresnel::k_of_reflectance(Rgb::splat(0.9));
    assert!((fresnel::conductor(1.0, Rgb::WHITE, k)[0] - 0.9).abs() < 1e-6);
    assert!((fresnel::conductor(degrees(75.0), Rgb::WHITE, k)[0] - 0.853_912).abs() < 1e-5);
    let k = fresnel::k_of_reflectance(Rgb::WHITE);
    for cos in [1.0, 0.5, 1e-3, 0.0] {
        assert_eq!(fresnel::conductor(cos, Rgb::WHITE, k), Rgb::WHITE);
    }
}

/// The unpolarised pane: (1 - F) / (1 + F).
#[test]
fn pane_values() {
    let pane = Bsdf::thin_dielectric(1.5);
    for (angle, through) in [(0.0, 0.923077), (60.0, 0.836232)] {
        let wo = direction(degrees(angle), 0.7);
        for wo in [wo, -wo] {
            let branches = pane.lobes()[0].branches(wo, Transport::Radiance).map(|b| b.unwrap());
            let [reflected, straight] = branches;
            assert!((straight.weight[0] - through).abs() < 1.5e-6, "{angle}: {straight:?}");
            assert!((reflected.weight[0] + straight.weight[0] - 1.0).abs() < 1e-6);
            assert_eq!((straight.wi, straight.eta), (-wo, 1.0));
            assert!((reflected.wi - hemilux_scene::geom::Vec3::new(-wo.x, -wo.y, wo.z)).length() == 0.0);
        }
    }
    // Negative control: with separate polarisations it would be 0.848128 at 60 degrees.
    let wo = direction(degrees(60.0), 0.0);
    let through = pane.lobes()[0].branches(wo, Transport::Radiance)[1].unwrap().weight[0];
    assert!((through - 0.848128f32).abs() > 0.01);
}

#[test]
fn smooth_glass_obeys_snell() {
    let glass = Bsdf::dielectric(1.5, [0.0; 2]);
    for mu in [1.0, 0.7, 0.2, 0.01] {
        let wo = direction(mu, 0.3);
        let [_, through] = glass.lobes()[0].branches(wo, Transport::Radiance);
        let through = through.unwrap();
        let sin = |w: hemilux_scene::geom::Vec3| w.x.hypot(w.y);
        assert!((sin(wo) - 1.5 * sin(through.wi)).abs() < 1e-6 && through.wi.z < 0.0);
        assert!((through.wi.length() - 1.0).abs() < 1e-6);
        // Back along the same path.
        let [_, back] = glass.lobes()[0].branches(through.wi, Transport::Radiance);
        let back = back.unwrap();
        assert!((back.wi - wo).length() < 1e-3 * (1.0 + 0.01 / mu), "{mu}: {} {wo}", back.wi);
        // Radiance: over η² in, times η² out.
        let f = fresnel::dielectric(mu, 1.5);
        assert!((through.weight[0] - (1.0 - f) / 2.25).abs() < 1e-6 && through.eta == 1.5);
        assert!((back.weight[0] - (1.0 - f) * 2.25).abs() < 1e-3 / mu);
    }
    // Total internal reflection leaves one branch.
    let inside = direction(-0.5, 0.0);
    let [reflected, through] = glass.lobes()[0].branches(inside, Transport::Radiance);
    assert!(through.is_none() && reflected.unwrap().weight == Rgb::WHITE);
}
