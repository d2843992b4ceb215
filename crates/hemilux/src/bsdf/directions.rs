//! What lobes share: directions mirrored, refracted and drawn about a normal, and the Fresnel factors of panes and coats.
//!
//! Directions are unit and local, z along the normal. Refraction of rough surfaces follows B. Walter et al. 2007.

use super::coat::{Coat, alpha_coordinate};
use super::fresnel;
use super::ggx::{GRAZING, Ggx};
use super::lobe::Event;
use super::{BsdfSample, Transport};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::map::{Cosine, Map, Uv};
use std::f32::consts::FRAC_1_PI;

/// `w` mirrored to the upper side, and the sign that undoes it.
#[inline]
pub(super) fn raised(w: Vec3) -> (Vec3, f32) {
    (Vec3::new(w.x, w.y, w.z.abs()), if w.z < 0.0 { -1.0 } else { 1.0 })
}

#[inline]
pub(super) fn grazing(w: Vec3) -> bool {
    // A cosine that is not a number counts as well.
    w.z.is_nan() || w.z.abs() <= GRAZING
}

#[inline]
pub(super) fn mirrored(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

/// Index of the far side relative to the side of `w`.
#[inline]
pub(super) fn relative(eta: f32, w: Vec3) -> f32 {
    if w.z > 0.0 { eta } else { 1.0 / eta }
}

/// What a refraction into relative index `eta` does to the transported quantity.
#[inline]
pub(super) fn compression(eta: f32, t: Transport) -> f32 {
    match t {
        Transport::Radiance => 1.0 / (eta * eta),
        Transport::Flux => 1.0,
    }
}

/// `w` refracted at a plane into relative index `eta`, cosine of refraction `cos_t` given; leaves on the other side.
#[inline]
pub(super) fn refracted(w: Vec3, eta: f32, cos_t: f32) -> Vec3 {
    Vec3::new(-w.x / eta, -w.y / eta, if w.z > 0.0 { -cos_t } else { cos_t })
}

/// Reflectance of a pane with all its inner bounces: R + T² R / (1 - R²) = 2 R / (1 + R).
#[inline]
pub(super) fn pane_reflectance(cos: f32, eta: f32) -> f32 {
    let r = fresnel::dielectric(cos, eta);
    2.0 * r / (1.0 + r)
}

/// Reflectance of a plane coat on a plane metal with all inner bounces: F + (1 - F)² M / (1 - F M).
#[inline]
pub(super) fn coated_mirror_reflectance(cos: f32, coat_eta: f32, eta: Rgb, k: Rgb) -> Rgb {
    let (f, cos_t) = fresnel::dielectric_refracted(cos, coat_eta);
    // F = 1 leaves no light for the metal, and the quotient undefined.
    if f >= 1.0 {
        return Rgb::WHITE;
    }
    fresnel::conductor(cos_t, eta, k).map(|m| f + (1.0 - f) * (1.0 - f) * m / (1.0 - f * m))
}

/// A direction inside a coat for one outside (both pointing up).
#[inline]
pub(super) fn inside_coat(w: Vec3, eta: f32) -> Vec3 {
    let (x, y) = (w.x / eta, w.y / eta);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// T(o) T(i) of the coat times Fresnel term and geometric series of the metal below (module `coat`).
#[inline]
pub(super) fn coated_metal_factor(
    coat: Coat,
    eta: Rgb,
    k: Rgb,
    base_alpha: f32,
    cos_o: f32,
    cos_i: f32,
    cos_h: f32,
) -> Rgb {
    let base = alpha_coordinate(base_alpha);
    let through = coat.transmittance(cos_o) * coat.transmittance(cos_i);
    let s = 1.0 - coat.interreflection(cos_o, base) * coat.interreflection(cos_i, base);
    fresnel::conductor(cos_h, eta, k).map(|m| through * m / (1.0 - m * s))
}

/// A sample of a rough reflection before its Fresnel term: (wi, h, G2/G1, density), all with z up.
#[inline]
pub(super) fn sample_reflection(ggx: Ggx, wo: Vec3, u: [f32; 2]) -> Option<(Vec3, Vec3, f32, f32)> {
    let h = ggx.sample_visible(wo, u)?;
    let wi = 2.0 * wo.dot(h) * h - wo;
    if wi.z <= GRAZING {
        return None;
    }
    Some((wi, h, ggx.shadowing(wo, wi), 0.25 * ggx.visible_density(wo, h)))
}

/// Half vector of a refraction with `wo.z` > 0 > `wi.z`, pointing up, with wo·h > 0 > wi·h; and |dh/dwi|.
#[inline]
pub(super) fn refraction_half(eta: f32, wo: Vec3, wi: Vec3) -> Option<(Vec3, f32)> {
    let sum = wo + wi * eta;
    let length2 = sum.length_squared();
    if length2 <= 0.0 {
        return None;
    }
    let h = sum * (length2.sqrt().recip().copysign(sum.z));
    let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
    if cos_o <= 0.0 || cos_i >= 0.0 {
        return None;
    }
    let d = cos_i + cos_o / eta;
    let jacobian = -cos_i / (d * d);
    jacobian.is_finite().then_some((h, jacobian))
}

/// Refracts `wo` (`wo`·`h` > 0) about `h`; `None` under total internal reflection or above the horizon.
#[inline]
pub(super) fn refract_about(wo: Vec3, h: Vec3, eta: f32, cos_t: f32) -> Option<Vec3> {
    let wi = (h * (wo.dot(h) / eta - cos_t) - wo / eta).normalize_or_zero();
    (cos_t > 0.0 && wi.z < -GRAZING).then_some(wi)
}

/// A direction with density cosine / π on the side that `event` names; `weight` gives what it counts by its cosine.
#[inline]
pub(super) fn sample_cosine(
    wo: Vec3,
    u: [f32; 2],
    event: Event,
    weight: impl Fn(f32) -> Rgb,
) -> Option<BsdfSample> {
    let d = Cosine.dir(Uv::new(u[0], u[1]));
    if d.z <= 0.0 || wo.z.is_nan() || wo.z == 0.0 {
        return None;
    }
    let transmitted = event == Event::Transmit;
    let up = (wo.z > 0.0) != transmitted;
    Some(BsdfSample {
        wi: Vec3::new(d.x, d.y, if up { d.z } else { -d.z }),
        weight: weight(d.z),
        pdf: d.z * FRAC_1_PI,
        transmitted,
        ..BsdfSample::REFLECTION
    })
}

/// Reflection or refraction of `wo` (raised) about the visible normal `h`: direction (raised frame), G2/G1 (over η² for radiance
/// that refracts) and density without Fresnel terms.
#[inline]
pub(super) fn rough_glass_outcome(
    ggx: Ggx,
    wo: Vec3,
    h: Vec3,
    eta: f32,
    cos_t: f32,
    event: Event,
    t: Transport,
) -> Option<BsdfSample> {
    let cos = wo.dot(h);
    if event == Event::Reflect {
        let wi = 2.0 * cos * h - wo;
        if wi.z <= GRAZING {
            return None;
        }
        let pdf = 0.25 * ggx.visible_density(wo, h);
        return Some(BsdfSample {
            wi,
            weight: Rgb::splat(ggx.shadowing(wo, wi)),
            pdf,
            ..BsdfSample::REFLECTION
        });
    }
    let wi = refract_about(wo, h, eta, cos_t)?;
    let d = cos / eta - cos_t;
    Some(BsdfSample {
        wi,
        weight: Rgb::splat(ggx.shadowing(wo, wi) * compression(eta, t)),
        pdf: ggx.visible_density(wo, h) * cos * cos_t / (d * d),
        transmitted: true,
        eta,
        ..BsdfSample::REFLECTION
    })
}
