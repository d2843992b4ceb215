//! Fresnel reflectances of plane interfaces, unpolarised and exact (M. Born and E. Wolf, *Principles of Optics*, 1.5 and 13.2),
//! and their hemispherical means.
//!
//! Every function returns a value in [0, 1] for every finite argument, grazing included.

use crate::wrong::{Wrong, makes};
use hemilux_scene::Rgb;

/// Reflectance of a dielectric interface for light arriving at cosine `cos` in [0, 1]; `eta` > 0 is the index of the far side
/// relative to the near side. 1 under total internal reflection, 0 for `eta` = 1.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    dielectric_refracted(cos, eta).0
}

/// [`dielectric`] together with the cosine of the refracted ray (0 under total internal reflection).
#[inline]
pub fn dielectric_refracted(cos: f32, eta: f32) -> (f32, f32) {
    let cos = cos.clamp(0.0, 1.0);
    if eta == 1.0 {
        return (0.0, cos);
    }
    let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
    if cos2_t <= 0.0 {
        return (1.0, 0.0);
    }
    let cos_t = cos2_t.sqrt();
    (dielectric_of_cosines(cos, cos_t, eta), cos_t)
}

/// [`dielectric`] when the cosines of incidence and refraction, both positive, are already known.
#[inline]
pub fn dielectric_of_cosines(cos: f32, cos_t: f32, eta: f32) -> f32 {
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = if makes(Wrong::Fresnel) { s } else { (eta * cos - cos_t) / (eta * cos + cos_t) };
    (0.5 * (s * s + p * p)).min(1.0)
}

/// Reflectance of a conductor of complex index `eta` + i `k` (relative to the near side), per band, at cosine `cos` in [0, 1].
#[inline]
pub fn conductor(cos: f32, eta: Rgb, k: Rgb) -> Rgb {
    let part = if makes(Wrong::Mirrors) { 0.9 } else { 1.0 };
    Rgb([0, 1, 2].map(|band| conductor_band(cos, eta[band], k[band]))) * part
}

/// Beyond this k a conductor reflects everything: 1 - R < 4 η / k² is below the rounding of an `f32`.
const K_PERFECT: f32 = 1e4;

#[inline]
fn conductor_band(cos: f32, eta: f32, k: f32) -> f32 {
    // No index at all: nothing gets in either, and the quotients below are undefined.
    let void = eta * eta + k * k < 1e-12;
    if k > K_PERFECT || cos <= 0.0 || void {
        return 1.0;
    }
    let cos2 = (cos * cos).min(1.0);
    let sin2 = 1.0 - cos2;
    let t0 = eta * eta - k * k - sin2;
    let ek2 = 4.0 * eta * eta * k * k;
    let a2b2 = (t0 * t0 + ek2).sqrt();
    // a² = (a2b2 + t0) / 2, written without its cancellation for metals (t0 < 0).
    let a = if t0 < 0.0 { 0.5 * ek2 / (a2b2 - t0) } else { 0.5 * (a2b2 + t0) }.sqrt();
    let (t1, t2) = (a2b2 + cos2, 2.0 * cos * a);
    let s = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (cos2 * a2b2 + sin2 * sin2, t2 * sin2);
    let p = s * (t3 - t4) / (t3 + t4);
    (0.5 * (s + p)).clamp(0.0, 1.0)
}

/// k of a conductor of η = 1 that reflects `r` in [0, 1] at normal incidence: 2 √r / √(1 - r). `r` = 1 gives a perfect mirror.
#[inline]
pub fn k_of_reflectance(r: Rgb) -> Rgb {
    r.map(|r| {
        let r = r.clamp(0.0, 1.0);
        // Just above K_PERFECT, finite: no infinity ever meets the formulae.
        (2.0 * r.sqrt() / (1.0 - r).sqrt()).min(2.0 * K_PERFECT)
    })
}

/// Cosine-weighted hemispherical mean of [`dielectric`] for light arriving from the side the index is relative to.
///
/// Closed form (J. W. T. Walsh, 1926, as given by S. Q. Duntley, 1942), in double precision; absolute error below 1e-8.
pub fn mean_dielectric(eta: f32) -> f32 {
    mean_dielectric_f64(eta as f64) as f32
}

/// [`mean_dielectric`] for light arriving from the far side: 1 - (1 - mean) / η².
pub fn mean_dielectric_internal(eta: f32) -> f32 {
    mean_dielectric_f64(1.0 / eta as f64) as f32
}

fn mean_dielectric_f64(eta: f64) -> f64 {
    if eta == 1.0 {
        return 0.0;
    }
    if eta < 1.0 {
        // Transmitted flux is the same both ways, the étendue of the dense side is 1/η² times larger.
        return 1.0 - (1.0 - mean_dielectric_f64(1.0 / eta)) * eta * eta;
    }
    let n = eta;
    let (n2, n4) = (n * n, n * n * n * n);
    let sum = 0.5
        + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) * (n + 1.0))
        + n2 * (n2 - 1.0) * (n2 - 1.0) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
        - 2.0 * n2 * n * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0) * (n4 - 1.0)) * n.ln();
    sum.clamp(0.0, 1.0)
}

/// Reflectance that grazing incidence adds to a polished surface, e^(-5.85 cos) - 0.00203: how Radiance's materials approximate
/// Fresnel's formula. 0.0009 at normal incidence, 0.998 at grazing.
#[inline]
pub fn polish(cos: f32) -> f32 {
    ((-5.85 * cos).exp() - POLISH_OFFSET).clamp(0.0, 1.0)
}

/// What [`polish`] leaves for what lies below.
#[inline]
pub(super) fn base(cos: f32) -> f32 {
    1.0 - polish(cos)
}

const POLISH_OFFSET: f32 = 0.002_029_430_6;
