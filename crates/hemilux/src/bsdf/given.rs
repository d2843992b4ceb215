//! Factors of lobes of given reflectance, and of tinted panes.

use super::lobe::Event;
use super::{Transport, fresnel};
use hemilux_scene::Rgb;

/// Cosine of the direction that radiance leaves to: `wo` of camera paths, `wi` of particles.
#[inline]
pub(super) fn view(wo: f32, wi: f32, t: Transport) -> f32 {
    match t {
        Transport::Radiance => wo,
        Transport::Flux => wi,
    }
}

/// Factor of a `Facets` lobe at `cos` to the facet's normal.
#[inline]
pub(super) fn facet_colour(colour: Rgb, grazing: bool, event: Event, cos: f32) -> Rgb {
    if !grazing {
        return colour;
    }
    let f = fresnel::polish(cos);
    let rest = colour * (1.0 - f);
    if event == Event::Reflect { rest + Rgb::splat(f) } else { rest }
}

/// Reflectance and transmittance of a tinted pane with all inner reflections, the mean of both polarisations.
#[inline]
pub(super) fn tinted_pane(cos: f32, eta: f32, tint: Rgb) -> (Rgb, Rgb) {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return (Rgb::WHITE, Rgb::BLACK);
    }
    let inner = (1.0 - sin2).sqrt();
    let s = (cos - eta * inner) / (cos + eta * inner);
    let p = (eta * cos - inner) / (eta * cos + inner);
    let (mut reflected, mut transmitted) = (Rgb::BLACK, Rgb::BLACK);
    for r in [s * s, p * p] {
        for band in 0..3 {
            let t = tint[band].powf(1.0 / inner);
            let through = (1.0 - r) * (1.0 - r) / (1.0 - r * r * t * t).max(1e-12);
            reflected.0[band] += 0.5 * (r + through * r * t * t).min(1.0);
            transmitted.0[band] += 0.5 * through * t;
        }
    }
    (reflected, transmitted)
}
