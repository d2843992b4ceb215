//! Glances: camera rays beside the one that gathers, which know at little cost what a pixel spans.
//!
//! A pixel on an edge, or on a texture, varies more than its gathers are noisy. So a camera sample takes [`COUNT`] rays. All of them ask what
//! shines and what would be *expected* of the surfaces they meet, diffuse albedo times [broad irradiance](crate::zones::broad); one of them gathers. The
//! sample is the mean of what is expected, plus what was gathered less what was expected there: a control variate, so the mean does not
//! depend on what is expected, whatever that is.
//!
//! Surfaces that several rays meet close together in one plane share one expected irradiance, the mean of theirs: then steps between
//! boxes of the broad irradiance do not show, and only albedo differs. What is expected of one ray thus depends on the others. That is no bias
//! as long as the ray that gathers is any of them with equal probability given all of them, which holds for
//! a lattice shifted by a uniform point: it looks the same from each of its points.

use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// Camera rays of a sample.
pub const COUNT: usize = 8;
/// Steps from one to the next on the unit torus, in units of 1 / COUNT.
const STEP: [u32; 2] = [1, 3];
/// More surfaces than this in a sample do not share.
const MOST: usize = 64;
/// Cosine between normals of one plane.
const PARALLEL: f32 = 0.99;
/// Slope of the line between two points of one plane.
const SLOPE: f32 = 0.1;

/// A surface that a glance met, straight or by mirrors and glass.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Which glance.
    pub glance: u32,
    /// Where (m).
    pub p: Vec3,
    /// Normal on its side, unit.
    pub n: Vec3,
    /// Within this distance it shares with others (m).
    pub reach: f32,
    /// Radiance of the pixel per irradiance (sr⁻¹).
    pub weight: Rgb,
    /// Expected irradiance (W·m⁻²).
    pub irradiance: Rgb,
}

impl Seen {
    fn is_beside(&self, other: &Seen) -> bool {
        let d = other.p - self.p;
        let far = d.length();
        let reach = self.reach.min(other.reach);
        self.n.dot(other.n) > PARALLEL
            && far <= reach
            && self.n.dot(d).abs().max(other.n.dot(d).abs()) <= SLOPE * far
    }
}

/// Glance `k` of the one at `u`, on the unit torus.
pub fn place(u: [f32; 2], k: u32) -> [f32; 2] {
    let n = count() as u32;
    let step = if n == 16 { [1, 7] } else { STEP };
    [0, 1].map(|i: usize| (u[i] + (k * step[i] % n) as f32 / n as f32).fract())
}

pub fn count() -> usize {
    static N: std::sync::OnceLock<usize> = std::sync::OnceLock::new();
    *N.get_or_init(|| std::env::var("HX_G").ok().and_then(|v| v.parse().ok()).unwrap_or(COUNT))
}
fn noshare() -> bool {
    static N: std::sync::OnceLock<bool> = std::sync::OnceLock::new();
    *N.get_or_init(|| std::env::var("HX_NOSHARE").is_ok())
}

/// What is expected of the mean of all glances, less what is expected of glance 0.
pub fn expected_more(seen: &mut [Seen]) -> Rgb {
    share(seen);
    let mean = 1.0 / count() as f32;
    seen.iter().fold(Rgb::BLACK, |sum, s| {
        let factor = if s.glance == 0 { mean - 1.0 } else { mean };
        sum + s.weight * s.irradiance * factor
    })
}

/// Give all that lie in one plane, each beside another, the mean of their irradiances.
fn share(seen: &mut [Seen]) {
    let n = seen.len();
    if n > MOST || noshare() {
        return;
    }
    let mut group = [0u8; MOST];
    for (i, g) in group.iter_mut().enumerate() {
        *g = i as u8;
    }
    for i in 1..n {
        for j in 0..i {
            let (a, b) = (group[i], group[j]);
            if a != b && seen[i].is_beside(&seen[j]) {
                group[..n].iter_mut().filter(|g| **g == a.max(b)).for_each(|g| *g = a.min(b));
            }
        }
    }
    let mut sums = [(Rgb::BLACK, 0u32); MOST];
    for (s, g) in seen.iter().zip(group) {
        let (sum, count) = &mut sums[g as usize];
        (*sum, *count) = (*sum + s.irradiance, *count + 1);
    }
    for (s, g) in seen.iter_mut().zip(group) {
        let (sum, count) = sums[g as usize];
        s.irradiance = sum * (1.0 / count as f32);
    }
}
