//! What residuals cost and bring: the share of gather rays that ought to carry one, and the zones' bias, by pairs.
//!
//! A pair is one estimate by zones alone and the same one, with the same random numbers, with residuals. Their difference
//! is the residuals' contribution: its mean is what the zones get wrong, its spread what residuals cost in noise. With
//! share q the variance is V + M / q and the cost C + q R (V and C of the zonal part, M the second moment and R the rays of
//! residuals at q = 1), so variance times cost is least at q = √(M C / (V R)); compare A. Rath et al., "EARS" (2022). Pairs
//! are never part of a picture or reading, so what they decide shapes no value. In pictures they come in blocks of pixels that share residuals
//! ([`crate::gather`]), so M is what is left of it by sharing.

use crate::render::Renderer;
use crate::transport::Residual;
use hemiquad::points::Key;
use rayon::prelude::*;

/// Share of residuals in pairs.
pub const PAIR_SHARE: f32 = 0.25;
/// Shares are within these: residuals that never come never correct, and more than half seldom pays. In pictures the share is that of
/// a gather ray that brings what is expected of it; others have more or less ([`crate::transport`]), no more in the mean.
const SHARES: (f64, f64) = (0.02, 0.5);

/// One pair of estimates (luminance) of one thing, and a second zonal one with other random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// By zones alone, twice.
    pub zonal: [f64; 2],
    /// The first of them with residuals.
    pub corrected: f64,
    /// Rays of the first zonal one.
    pub zonal_rays: u64,
    /// Rays of the corrected one.
    pub corrected_rays: u64,
}

/// What pairs say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Study {
    /// Share of residuals that pays best.
    pub share: f32,
    /// Estimated relative bias of the zones in the mean of the picture: (zonal − truth) / zonal.
    pub bias: f64,
    /// Standard error of `bias`.
    pub bias_error: f64,
    /// Number of pairs.
    pub pairs: usize,
    /// Rays spent.
    pub rays: u64,
}

impl Study {
    /// What pairs say that come in `blocks`, which are independent of one another.
    pub fn of(blocks: &[Vec<Pair>]) -> Study {
        let pairs: Vec<&Pair> = blocks.iter().flatten().collect();
        let n = pairs.len().max(1) as f64;
        let each = |p: &Pair| 0.5 * (p.zonal[0] + p.zonal[1]);
        let mean = pairs.iter().copied().map(each).sum::<f64>() / n;
        let difference = |p: &Pair| p.corrected - p.zonal[0];
        let bias = pairs.iter().copied().map(difference).sum::<f64>() / n;
        let off = |block: &Vec<Pair>| block.iter().map(|p| difference(p) - bias).sum::<f64>();
        let squares = blocks.iter().map(|block| off(block).powi(2)).sum::<f64>();
        let m = blocks.len() as f64;
        let error = (squares * m / (m - 1.0).max(1.0)).sqrt() / n;
        // Relative to each one's own brightness, as eyes are; a floor keeps the dark ones from deciding.
        let weight = |p: &Pair| 1.0 / (each(p).powi(2) + 0.01 * mean * mean).max(1e-300);
        let variance = pairs.iter().map(|p| weight(p) * 0.5 * (p.zonal[0] - p.zonal[1]).powi(2)).sum::<f64>();
        let moment = PAIR_SHARE as f64 * pairs.iter().map(|p| weight(p) * difference(p).powi(2)).sum::<f64>();
        let cost = pairs.iter().map(|p| p.zonal_rays).sum::<u64>() as f64;
        let all = pairs.iter().map(|p| p.corrected_rays).sum::<u64>() as f64;
        let path = (all - cost).max(0.0) / PAIR_SHARE as f64;
        let best = (moment * cost / (variance * path).max(1e-300)).sqrt();
        Study {
            share: if best.is_finite() { best.clamp(SHARES.0, SHARES.1) as f32 } else { SHARES.1 as f32 },
            bias: if mean > 0.0 { -bias / mean } else { 0.0 },
            bias_error: if mean > 0.0 { error / mean } else { 0.0 },
            pairs: pairs.len(),
            rays: pairs.iter().map(|p| 2 * p.zonal_rays + p.corrected_rays).sum(),
        }
    }
}

/// Study `pairs` camera samples of the picture that `renderer` makes (over zones), spread over `region` at random.
pub fn study(renderer: &Renderer, region: [u32; 4], pairs: usize, seed: u64) -> Study {
    let blocks = self::blocks(renderer, region, pairs, seed);
    Study::of(&blocks)
}

/// The pairs of a study.
pub fn pairs(renderer: &Renderer, region: [u32; 4], pairs: usize, seed: u64) -> Vec<Pair> {
    blocks(renderer, region, pairs, seed).concat()
}

/// The same by blocks of pixels that share residuals.
fn blocks(renderer: &Renderer, region: [u32; 4], pairs: usize, seed: u64) -> Vec<Vec<Pair>> {
    let [x0, x1, y0, y1] = region;
    let zonal = renderer.clone().with_residual(Residual::NONE);
    let corrected = renderer.clone().with_residual(Residual::new(PAIR_SHARE));
    let key = Key::new(seed).with(0x9a_125);
    let one = |i: u64| {
        let at = key.with(i);
        let x = x0 + ((x1 - x0) as f32 * at.uniform(0)) as u32;
        let y = y0 + ((y1 - y0) as f32 * at.uniform(1)) as u32;
        let on = |renderer: &Renderer, pass: u32| {
            renderer.clone().with_seed(at.bits64(2)).trial([x.min(x1 - 1), y.min(y1 - 1)], pass)
        };
        let ((a, zonal_rays), (b, _)) = (on(&zonal, 0), on(&zonal, 1));
        let (c, corrected_rays) = on(&corrected, 0);
        let n = c.len() as u64;
        // Rays are known of the whole block alone.
        let part = |rays: u64, k: u64| rays * (k + 1) / n - rays * k / n;
        let pair = |k: usize| Pair {
            zonal: [a[k], b[k]],
            corrected: c[k],
            zonal_rays: part(zonal_rays, k as u64),
            corrected_rays: part(corrected_rays, k as u64),
        };
        (0..c.len()).map(pair).collect::<Vec<Pair>>()
    };
    let most = Renderer::SHARING as usize;
    (0..pairs.div_ceil(most) as u64).into_par_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made-up pairs: zonal part of variance 4 costing 10 rays, residuals of second moment M at 5 rays each.
    fn pairs(residual: f64) -> Vec<Vec<Pair>> {
        let key = Key::new(1);
        (0..20_000u64)
            .map(|i| {
                let u = |d: u32| key.with(i).uniform64(d);
                let noise = |d: u32| 12f64.sqrt() * (u(d) - 0.5) * 2.0;
                let has = u(4) < PAIR_SHARE as f64;
                let more = if has { residual / PAIR_SHARE as f64 } else { 0.0 };
                let zonal = [10.0 + noise(0), 10.0 + noise(1)];
                let rays = 10 + if has { 5 } else { 0 };
                vec![Pair { zonal, corrected: zonal[0] + more, zonal_rays: 10, corrected_rays: rays }]
            })
            .collect()
    }

    #[test]
    fn the_share_is_the_best_one_and_the_bias_is_found() {
        let s = Study::of(&pairs(0.5));
        // M = 0.25, C = 10, V = 4, R = 5: the root of 0.125.
        assert!((s.share as f64 - 0.125f64.sqrt()).abs() < 0.02, "{s:?}");
        assert!((s.bias + 0.05).abs() < 4.4 * s.bias_error && s.bias_error < 0.002, "{s:?}");
        assert!((Study::of(&pairs(0.0)).share - 0.02).abs() < 1e-6);
        assert!((Study::of(&pairs(20.0)).share - 0.5).abs() < 1e-6);
        assert!(Study::of(&[]).bias == 0.0);
    }
}
