//! What GGX facets of reflectance 1 keep by scattering once: the directional albedo that lobes of *given* reflectance are
//! divided by, so that they reflect what they were told to.
//!
//! A table over √α and √cos, made on first use from visible normals (Hammersley's points) and interpolated linearly.

use super::ggx::{GRAZING, Ggx};
use hemilux_scene::geom::Vec3;
use std::sync::OnceLock;

const SIZE: usize = 48;
const POINTS: u32 = 512;

/// Directional albedo in (0, 1] of isotropic facets `alpha` in [0, 1] (clamped) seen at `cos` in [0, 1].
pub(super) fn single_scattering(cos: f32, alpha: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(tabulated);
    let coordinate = |v: f32| v.clamp(0.0, 1.0).sqrt() * (SIZE - 1) as f32;
    let (x, y) = (coordinate(cos), coordinate(alpha));
    let (i, j) = ((x as usize).min(SIZE - 2), (y as usize).min(SIZE - 2));
    let (fx, fy) = (x - i as f32, y - j as f32);
    let row = |j: usize| table[j * SIZE + i] * (1.0 - fx) + table[j * SIZE + i + 1] * fx;
    row(j) * (1.0 - fy) + row(j + 1) * fy
}

fn tabulated() -> Vec<f32> {
    let at = |k: usize| (k as f32 / (SIZE - 1) as f32).powi(2);
    let mut table = Vec::with_capacity(SIZE * SIZE);
    for j in 0..SIZE {
        for i in 0..SIZE {
            table.push(directional_albedo(at(i).max(1e-4), at(j)));
        }
    }
    table
}

fn directional_albedo(cos: f32, alpha: f32) -> f32 {
    let ggx = Ggx::new([alpha; 2]);
    if ggx.is_smooth() {
        return 1.0;
    }
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let mut sum = 0.0;
    for k in 0..POINTS {
        let u = [(k as f32 + 0.5) / POINTS as f32, k.reverse_bits() as f32 / 4_294_967_296.0];
        let Some(h) = ggx.sample_visible(wo, [u[0], u[1].min(1.0 - f32::EPSILON)]) else { continue };
        let wi = 2.0 * wo.dot(h) * h - wo;
        if wi.z > GRAZING {
            sum += ggx.shadowing(wo, wi);
        }
    }
    (sum / POINTS as f32).clamp(0.05, 1.0)
}
