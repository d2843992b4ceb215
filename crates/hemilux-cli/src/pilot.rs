//! `--target-error`: a pilot of other random numbers decides how many samples are taken; it is then thrown away.
//!
//! What decides must not be part of the answer: a pixel that looks finished because its bright samples have not come yet
//! would stay dark (D. Kirk and J. Arvo, "Unbiased sampling techniques for image synthesis", 1991; C. Stein 1945). So the
//! picture is that of `--spp N` with the N that the pilot found, bit for bit.

use hemilux::adaptive::Rates;
use hemilux::film::Film;
use hemilux::render::Renderer;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Samples per pixel of a first pilot. Few samples understate the error where bright ones are rare.
const FIRST: u32 = 8;
/// It is followed by a second one where more than this are needed, ...
const LEAST: u32 = 16;
/// ... with this part of what the first one asks for, and at least [`LEAST`].
const SHARE: u32 = 6;
/// Passes are planned for this part of the target, so that the picture seldom misses it.
const MARGIN: f64 = 0.93;
/// Part of the samples that decides on their numbers by tile, ...
const RATES_SHARE: u32 = 16;
/// ... and the fewest that do.
const RATES_LEAST: u32 = 4;
/// No more samples per pixel than this.
const MOST: f64 = 1e6;

/// What a pilot found.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// Samples per pixel that the target needs.
    pub passes: u32,
    /// Samples per pixel that were spent on finding out.
    pub spent: u32,
    /// Rays.
    pub rays: u64,
}

/// How many passes bring the typical relative error of a pixel to `target`; no more than `limit` are of interest. `None` if
/// there was no time to find out.
pub fn pilot(
    renderer: &Renderer,
    region: [u32; 4],
    seed: u64,
    target: f64,
    limit: Option<u32>,
    deadline: Option<Instant>,
    cancel: &AtomicBool,
) -> Option<Pilot> {
    let [width, height] = renderer.size();
    let mut trial = Film::new(width, height, region);
    // Numbers of its own: the picture's are fresh.
    let renderer = renderer.clone().with_seed(seed ^ 0x9_1107);
    let mut rays = 0;
    let mut needed = |passes: u32| {
        rays += renderer.run_range(&mut trial, 0..passes, deadline, cancel, |_, _| ()).rays;
        let (least, _) = trial.samples();
        let error = trial.relative_error().filter(|_| least >= passes)? as f64;
        let needed = least as f64 * (error / (MARGIN * target)).powi(2);
        Some((needed.ceil().clamp(2.0, MOST) as u32, least))
    };
    let (mut passes, mut spent) = needed(FIRST)?;
    // Where another limit ends the run, a better guess of how far beyond it the target lies is worth nothing.
    let known = passes.min(limit.unwrap_or(u32::MAX));
    if passes > LEAST
        && limit.is_none_or(|n| passes / 2 < n)
        && let Some((better, all)) = needed((known / SHARE).max(LEAST))
    {
        (passes, spent) = (better, all);
    }
    Some(Pilot { passes, spent, rays })
}

/// Numbers of samples by tile, from a pilot of other random numbers, and its rays; `None` if there was no time for one.
pub fn rates(
    renderer: &Renderer,
    region: [u32; 4],
    seed: u64,
    spp: Option<u32>,
    deadline: Option<Instant>,
    cancel: &AtomicBool,
) -> Option<(Rates, u64)> {
    let [width, height] = renderer.size();
    let mut trial = Film::new(width, height, region);
    let passes = (spp.unwrap_or(0) / RATES_SHARE).max(RATES_LEAST);
    let renderer = renderer.clone().with_seed(seed ^ 0xada9);
    let outcome = renderer.run_range(&mut trial, 0..passes, deadline, cancel, |_, _| ());
    (trial.samples().0 >= RATES_LEAST).then(|| (Rates::of(&trial), outcome.rays))
}
