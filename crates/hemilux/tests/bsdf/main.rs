//! Scattering of surfaces against closed forms, statistics and their own symmetries.

mod chi_square;
mod fresnel;
mod furnace;
mod reciprocity;
mod robust;
mod stats;

use hemilux::bsdf::Bsdf;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// Gold, roughly: η and k per band.
const GOLD: (Rgb, Rgb) = (Rgb::new(0.143, 0.374, 1.442), Rgb::new(3.983, 2.385, 1.603));

/// A direction at cosine `mu` (negative: below) and azimuth `phi`.
fn direction(mu: f32, phi: f32) -> Vec3 {
    let sin = ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), mu)
}

/// Diffuse and specular, reflecting and transmitting.
fn polished(alpha: f32) -> Bsdf {
    let (tan, blue) = (Rgb::new(0.3, 0.2, 0.1), Rgb::new(0.1, 0.2, 0.3));
    Bsdf::polished([tan, blue], [Rgb::splat(0.2), blue], alpha, true)
}

/// Every material, smooth and rough.
fn materials() -> Vec<(&'static str, Bsdf)> {
    let (eta, k) = GOLD;
    let tan = Rgb::new(0.7, 0.5, 0.3);
    let gold = |alpha| Bsdf::conductor(eta, k, alpha);
    let varnish = |alpha| Bsdf::coated_diffuse(tan, 1.5, alpha);
    vec![
        ("diffuse", Bsdf::diffuse(tan)),
        ("metal smooth", gold([0.0; 2])),
        ("metal 0.002", gold([0.002; 2])),
        ("metal 0.05", gold([0.05; 2])),
        ("metal 0.3", gold([0.3; 2])),
        ("metal 1", gold([1.0; 2])),
        ("metal 0.05 x 0.4", gold([0.05, 0.4])),
        ("glass smooth", Bsdf::dielectric(1.5, [0.0; 2])),
        ("glass 0.02", Bsdf::dielectric(1.5, [0.02; 2])),
        ("glass 0.3", Bsdf::dielectric(1.5, [0.3; 2])),
        ("glass 0.8 of 1.33", Bsdf::dielectric(1.33, [0.8; 2])),
        ("bubble 0.2", Bsdf::dielectric(1.0 / 1.5, [0.2; 2])),
        ("glass 0.1 x 0.5", Bsdf::dielectric(1.5, [0.1, 0.5])),
        ("pane", Bsdf::thin_dielectric(1.5)),
        ("varnish smooth", varnish([0.0; 2])),
        ("varnish 0.1", varnish([0.1; 2])),
        ("varnish 0.5", varnish([0.5; 2])),
        ("coated metal smooth, smooth", Bsdf::coated_conductor(1.5, [0.0; 2], eta, k, [0.0; 2])),
        ("coated metal smooth, 0.2", Bsdf::coated_conductor(1.5, [0.0; 2], eta, k, [0.2; 2])),
        ("coated metal 0.1, 0.3", Bsdf::coated_conductor(1.5, [0.1; 2], eta, k, [0.3; 2])),
        ("coated metal 0.3, smooth", Bsdf::coated_conductor(1.33, [0.3; 2], eta, k, [0.0; 2])),
        ("polished smooth", polished(0.0)),
        ("polished 0.2", polished(0.2)),
        ("tinted pane", Bsdf::tinted_pane(1.52, tan)),
        ("tinted glass", Bsdf::tinted_dielectric(1.5, tan)),
        ("leaf", Bsdf::diffuse_transmission(tan, Rgb::new(0.1, 0.4, 0.2))),
        ("varnish 0.1 mixed with metal 0.3", Bsdf::mix(&varnish([0.1; 2]), &gold([0.3; 2]), 0.4)),
        (
            "leaf mixed with glass 0.3",
            Bsdf::mix(&Bsdf::diffuse_transmission(tan, tan), &Bsdf::dielectric(1.5, [0.3; 2]), 0.5),
        ),
    ]
}
