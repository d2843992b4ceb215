//! Numbers of camera samples by tile, from the error of an earlier pass.
//!
//! A pilot of other random numbers says how noisy each tile is; tiles then get samples in proportion to their typical
//! relative error (Neyman's allocation, for equal cost), within limits, and the pilot is thrown away: what decides is not
//! part of the answer (D. Kirk and J. Arvo 1991), so every pixel stays the mean of as many samples as were fixed before the first.
//!
//! Invariant: the rates' mean, weighted by pixels, is that of one sample per pixel and pass, up to rounding.

use crate::film::Film;
use std::ops::Range;

/// Rates are in units of 1 / this.
const UNIT: u32 = 256;
/// A tile gets at least and at most this much of the mean.
const WITHIN: (f64, f64) = (0.4, 4.0);
/// Share of the samples that goes without regard to the pilot, which is noisy itself.
const EVEN: f64 = 0.25;

/// Samples per pixel and pass, by tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rates(Vec<u32>);

impl Rates {
    /// What `pilot` says; the same for all tiles where it says nothing.
    pub fn of(pilot: &Film) -> Rates {
        let (mut n, mut mean) = (0u64, 0f64);
        pilot.for_each(|_, _, p| {
            n += 1;
            mean += p.mean().luminance() as f64;
        });
        let floor = 0.01 * (mean / n.max(1) as f64).powi(2);
        let tiles = pilot.tiles();
        let errors: Vec<f64> = tiles
            .iter()
            .map(|t| {
                let of = |p: &crate::film::Pixel| {
                    let (m, e) = (p.mean().luminance() as f64, p.standard_error().luminance() as f64);
                    if e > 0.0 { e * e / (m * m + floor) } else { 0.0 }
                };
                (t.pixels.iter().map(of).sum::<f64>() / t.pixels.len().max(1) as f64).sqrt()
            })
            .collect();
        let sizes: Vec<f64> = tiles.iter().map(|t| t.pixels.len() as f64).collect();
        let all: f64 = sizes.iter().sum();
        let weighted = |v: &[f64]| v.iter().zip(&sizes).map(|(v, s)| v * s).sum::<f64>() / all.max(1.0);
        let typical = weighted(&errors);
        if typical <= 0.0 || !typical.is_finite() {
            return Rates(vec![UNIT; tiles.len()]);
        }
        let mut rates: Vec<f64> = errors.iter().map(|e| EVEN + (1.0 - EVEN) * e / typical).collect();
        // Limits move the mean, which is then put right; a few rounds settle it.
        for _ in 0..8 {
            let mean = weighted(&rates);
            rates.iter_mut().for_each(|r| *r = (*r / mean).clamp(WITHIN.0, WITHIN.1));
        }
        Rates(rates.iter().map(|r| (r * UNIT as f64).round() as u32).collect())
    }

    /// The samples that tile number `tile` takes in `passes`.
    pub fn samples(&self, tile: usize, passes: Range<u32>) -> Range<u32> {
        let at = |pass: u32| {
            let n = (pass as u64 * self.0[tile] as u64).div_ceil(UNIT as u64);
            n.min(u32::MAX as u64) as u32
        };
        at(passes.start)..at(passes.end)
    }

    /// The pass in which tile number `tile` takes its sample number `sample`.
    pub fn pass(&self, tile: usize, sample: u32) -> u32 {
        (sample as u64 * UNIT as u64 / self.0[tile].max(1) as u64).min(u32::MAX as u64) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Sample;
    use hemilux_scene::Rgb;

    /// A film whose left half is noisy.
    fn pilot(width: u32) -> Film {
        let mut film = Film::new(width, 40, [0, width, 0, 40]);
        for tile in film.tiles_mut() {
            let spread = if tile.x0 < width / 2 { 0.5 } else { 0.05 };
            for (i, p) in tile.pixels.iter_mut().enumerate() {
                for pass in 0..4u32 {
                    let v = 1.0 + if (i as u32 + pass).is_multiple_of(2) { spread } else { -spread };
                    p.add(&Sample { radiance: Rgb::splat(v), ..Sample::default() });
                }
            }
        }
        film
    }

    #[test]
    fn noisy_tiles_get_more_and_the_mean_is_kept() {
        let film = pilot(128);
        let rates = Rates::of(&film);
        let (mut samples, mut pixels) = (0u64, 0u64);
        for (i, t) in film.tiles().iter().enumerate() {
            let n = rates.samples(i, 0..100);
            assert_eq!(n.start, 0);
            assert!(if t.x0 < 64 { n.end > 140 } else { n.end < 60 }, "{n:?} at {}", t.x0);
            samples += n.end as u64 * t.pixels.len() as u64;
            pixels += t.pixels.len() as u64;
        }
        assert!((samples as f64 / pixels as f64 / 100.0 - 1.0).abs() < 0.02);
        // Without noise, or without samples: even.
        for film in [Film::new(40, 40, [0, 40, 0, 40]), Film::new(0, 0, [0; 4])] {
            let rates = Rates::of(&film);
            assert!((0..film.tiles().len()).all(|i| rates.samples(i, 3..9) == (3..9)));
        }
    }

    #[test]
    fn passes_and_samples_fit_together() {
        let rates = Rates::of(&pilot(64));
        for tile in 0..rates.0.len() {
            let mut next = 0;
            for pass in 0..200 {
                let range = rates.samples(tile, pass..pass + 1);
                assert_eq!(range.start, next);
                assert!(range.clone().all(|sample| rates.pass(tile, sample) == pass), "{range:?} in {pass}");
                next = range.end;
            }
        }
        assert!(rates.samples(0, 0..1).end >= 1, "every tile has a sample after the first pass");
    }
}
