//! Helmholtz reciprocity, and radiance against flux.

use crate::materials;
use crate::stats::Random;
use hemilux::bsdf::{Bsdf, Transport};
use hemilux_scene::geom::Vec3;
use hemiquad::map::{Map, Sphere, Uv};

fn random_direction(random: &mut Random) -> Vec3 {
    let [u, v] = random.square();
    let d = Sphere.dir(Uv::new(u, v));
    Vec3::new(d.x, d.y, d.z)
}

/// Index of refraction on the side of `w`.
fn index(name: &str, w: Vec3) -> f32 {
    let inside = match name {
        "glass 0.8 of 1.33" => 1.33,
        "bubble 0.2" => 1.0 / 1.5,
        _ if name.contains("glass") => 1.5,
        _ => 1.0,
    };
    if w.z > 0.0 { 1.0 } else { inside }
}

/// Largest relative asymmetry over random pairs of f(o, i) against `other`(o, i), and how many pairs were not dark.
fn asymmetry(bsdf: &Bsdf, other: impl Fn(Vec3, Vec3) -> f32, seed: u64) -> (f32, usize) {
    let mut random = Random(seed);
    let (mut worst, mut lit) = (0f32, 0);
    for _ in 0..20_000 {
        let (wo, wi) = (random_direction(&mut random), random_direction(&mut random));
        let (there, back) = (bsdf.eval(wo, wi, Transport::Radiance)[0], other(wo, wi));
        if there.max(back) > 1e-6 {
            lit += 1;
            worst = worst.max((there - back).abs() / there.max(back));
        }
    }
    (worst, lit)
}

#[test]
fn values_are_reciprocal() {
    // A leaf has no index: mixed with glass it obeys neither law alone, only the adjoint one below.
    // What lies below a smooth polish fades with the direction it is seen from alone.
    let lawless = |name: &str| name.starts_with("leaf mixed") || name.starts_with("polished smooth");
    let lawful = |name: &str, bsdf: &Bsdf| bsdf.has_non_delta() && !lawless(name);
    for (i, (name, bsdf)) in materials().into_iter().enumerate().filter(|(_, m)| lawful(m.0, &m.1)) {
        // f(o, i) n(i)² = f(i, o) n(o)².
        let back = |wo: Vec3, wi: Vec3| {
            bsdf.eval(wi, wo, Transport::Radiance)[0] * (index(name, wo) / index(name, wi)).powi(2)
        };
        let (worst, lit) = asymmetry(&bsdf, back, i as u64);
        let narrow = name.ends_with("0.002");
        assert!(lit > if narrow { 0 } else { 1000 }, "{name}: {lit}");
        assert!(worst < 2e-3, "{name}: {worst}");
    }
}

#[test]
fn flux_is_the_adjoint_of_radiance() {
    for (i, (name, bsdf)) in materials().into_iter().enumerate().filter(|(_, m)| m.1.has_non_delta()) {
        let (worst, _) = asymmetry(&bsdf, |wo, wi| bsdf.eval(wi, wo, Transport::Flux)[0], i as u64);
        assert!(worst < 2e-3, "{name}: {worst}");
    }
}

/// Negative control: forgetting η² must show.
#[test]
fn forgotten_compression_is_seen() {
    let glass = Bsdf::dielectric(1.5, [0.3; 2]);
    let (worst, _) = asymmetry(&glass, |wo, wi| glass.eval(wi, wo, Transport::Radiance)[0], 1);
    assert!(worst > 0.5);
}
