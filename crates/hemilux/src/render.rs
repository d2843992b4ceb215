//! Driving a render: tiles in parallel, pass after pass, until the budget is spent.
//!
//! A pass is one camera sample per pixel, or as many as [`crate::adaptive`] gives a tile. Every sample is a function of (scene, options, seed, pixel, pass) alone, so
//! the picture is the same for any number of threads; every tile ends at a pass boundary, where a run may be stopped.

mod blocks;
mod glances;
mod tree;

use self::blocks::{Block, CELL, SQUARE};
use self::glances::Seen;
use crate::adaptive::Rates;
use crate::bsdf::Bsdf;
use crate::film::{Film, Sample, Tile};
use crate::gather::{GatherPlan, Gathered, Part, Point, Strategy, gather, share};
use crate::residual::{Pair, Study, pairs, study};
use crate::sampler::Sampler;
use crate::transport::{Arrival, Residual, Start, Tally, Walker};
use crate::world::camera::{CameraRay, Lens};
use crate::world::{Surface, World};
use crate::zones::Zones;
use crate::zones::broad::Broad;
use hemilux_scene::Rgb;
use hemiquad::points::{Key, sobol};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Surfaces that a camera ray meets by mirrors and glass, beyond which gathers are judged together.
const MOST_WHOLES: usize = 4;

/// Images listed in a neighbourhood, beyond which one place of a pixel gathers and not two.
const CROWDED: usize = 256;

/// What is computed at visible points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Gathering over the zonal solution. **Biased by the zones**, and by nothing else.
    Zonal,
    /// The same, with residuals that take the zones' bias away. Unbiased.
    Corrected,
    /// Path tracing: the unbiased reference.
    Path,
    /// The zonal solution as one sees it.
    Zones,
}

impl Mode {
    /// Every mode with its name on the command line.
    pub const ALL: [(&'static str, Mode); 4] = [
        ("zonal", Mode::Zonal),
        ("corrected", Mode::Corrected),
        ("path", Mode::Path),
        ("zones", Mode::Zones),
    ];

    /// Whether it needs a zonal solution.
    pub fn needs_zones(self) -> bool {
        self != Mode::Path
    }
}

/// Everything that shapes the samples of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// What is computed.
    pub mode: Mode,
    /// The work of one gather (mode zonal).
    pub plan: GatherPlan,
    /// Seed of all randomness.
    pub seed: u64,
    /// Limit on scattering events (mode path).
    pub max_depth: u32,
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// The film is to hold passes 0 up to this, those included that it has already.
    pub passes: u32,
    /// No work begins that would, by the experience of this run, end after this.
    pub deadline: Option<Instant>,
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Passes that every tile has.
    pub passes: u32,
    /// Part of the budget that is spent, 0 to 1.
    pub done: f32,
    /// Rays traced.
    pub rays: u64,
    /// Time since the render began.
    pub elapsed: Duration,
    /// Typical relative standard error of a pixel ([`Film::relative_error`]), when it was last computed.
    pub error: Option<f32>,
}

/// How a render ended.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Whole passes that were added.
    pub passes: u32,
    /// Rays traced.
    pub rays: u64,
    /// Whether it was cancelled.
    pub cancelled: bool,
    /// Whether every tile has all passes that were asked for.
    pub complete: bool,
}

/// A camera sample to take.
#[derive(Clone, Copy)]
struct Asked {
    /// Across and down.
    at: [u32; 2],
    /// Its address.
    pixel: u64,
    pass: u32,
}

/// Where a glance would gather.
struct Spot {
    glance: u32,
    s: Surface,
    bsdf: Bsdf,
    /// What its radiance counts: by mirrors and glass on the way, and by the camera.
    weight: (Rgb, f32),
    plan: GatherPlan,
}

/// What the glances of one camera sample see.
struct Look {
    /// All but the radiance.
    out: Sample,
    shone: Rgb,
    seen: Vec<Seen>,
    /// Those that gather.
    found: Vec<Spot>,
    /// How many glances gather, and which part of the rays is the first one's.
    places: u32,
    turn: u32,
    /// The numbers that are left.
    sampler: Sampler,
}

/// A gather that shares residuals.
struct Sharer {
    /// Which of the pixels it is for.
    pixel: usize,
    place: u32,
    /// What its radiance counts there.
    weight: Rgb,
    /// Residuals found when it was done.
    until: usize,
}

/// A renderer of one picture.
#[derive(Clone)]
pub struct Renderer<'a> {
    world: &'a World,
    zones: Option<&'a Zones>,
    steer: Option<&'a Zones>,
    /// What pixels expect of the surfaces they span, where that is not what the zones say.
    expected: Option<&'a Broad>,
    lens: Lens,
    size: [u32; 2],
    options: RenderOptions,
    residual: Residual,
    /// Samples per pixel and pass by tile of the film; `None`: one.
    rates: Option<Arc<Rates>>,
    /// Luminance gathered and the part of it that came as surprise, in units of 2⁻¹⁶: integers, so that no order shows.
    surprise: Arc<[AtomicU64; 2]>,
}

/// Share of residuals where nobody has measured what pays.
pub const DEFAULT_SHARE: f32 = 0.1;
/// Seconds of work between two looks at clock and user.
const PORTION: f64 = 0.5;
/// Within this many radii of their zones, surfaces that a pixel spans share what is expected of them.
const SHARING_REACH: f32 = 4.0;
impl<'a> Renderer<'a> {
    /// Pixels that share residuals.
    pub(crate) const SHARING: u32 = (SQUARE / CELL) * (SQUARE / CELL);

    /// Prepare to render onto films of `width` × `height`. Modes zonal and zones need `zones`; path ignores it.
    pub fn new(
        world: &'a World,
        zones: Option<&'a Zones>,
        width: u32,
        height: u32,
        options: RenderOptions,
    ) -> Renderer<'a> {
        let residual = match options.mode {
            Mode::Corrected => Residual::new(DEFAULT_SHARE),
            _ => Residual::NONE,
        };
        Renderer {
            world,
            zones,
            steer: None,
            expected: None,
            lens: Lens::new(&world.scene, width, height),
            size: [width, height],
            options,
            residual,
            rates: None,
            surprise: Default::default(),
        }
    }

    /// The same with other numbers of samples by tile, for films whose tiles are those of the film that decided them.
    pub fn with_rates(self, rates: Rates) -> Renderer<'a> {
        Renderer { rates: Some(Arc::new(rates)), ..self }
    }

    /// The first pass from `from` on that some tile of `film` lacks.
    fn first_missing(&self, film: &Film, from: u32) -> u32 {
        let Some(rates) = &self.rates else { return film.first_missing(from) };
        let of = |(i, t): (usize, &Tile)| {
            let begin = rates.samples(i, from..from).start;
            t.missing(begin..u32::MAX).first().map_or(u32::MAX, |r| rates.pass(i, r.start))
        };
        film.tiles().iter().enumerate().map(of).min().unwrap_or(u32::MAX)
    }

    /// The same with other residuals (mode corrected; see [`crate::residual`] for how large a share pays).
    pub fn with_residual(self, residual: Residual) -> Renderer<'a> {
        Renderer { residual, ..self }
    }

    /// The same, led by what the particles of `steer` have found instead of those of its own zones; no mean depends on it.
    pub fn steered(self, steer: &'a Zones) -> Renderer<'a> {
        Renderer { steer: Some(steer), ..self }
    }

    /// The same, where pixels expect something else of the surfaces they span than the zones say; no mean depends on it.
    pub fn expecting(self, expected: &'a Broad) -> Renderer<'a> {
        Renderer { expected: Some(expected), ..self }
    }

    /// The same with another seed.
    pub fn with_seed(self, seed: u64) -> Renderer<'a> {
        Renderer { options: RenderOptions { seed, ..self.options }, ..self }
    }

    /// Pixels across and down of the whole picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Study the zones' bias, and what residuals would cost, by `pairs` camera samples of `region`.
    pub fn study(&self, region: [u32; 4], pairs: usize) -> Study {
        study(self, region, pairs, self.options.seed)
    }

    /// The pairs of such a study, of any options.
    pub fn pairs(&self, region: [u32; 4], count: usize) -> Vec<Pair> {
        pairs(self, region, count, self.options.seed)
    }

    /// The residuals.
    pub fn residual(&self) -> Residual {
        self.residual
    }

    /// Complete the film up to `stop.passes` passes, or until `stop.deadline`.
    /// `report` is called between portions of the work; setting `cancel` ends the run there.
    pub fn run(
        &self,
        film: &mut Film,
        stop: Stop,
        cancel: &AtomicBool,
        mut report: impl FnMut(Progress),
    ) -> Outcome {
        self.run_range(film, 0..stop.passes, stop.deadline, cancel, |_, p| report(p))
    }

    /// Give every tile the passes of `range` that it lacks. Work is done in portions of half a second: several passes
    /// where they are short, part of the tiles where they are long. Between portions `report` sees the film, which may be
    /// stored: every tile ends at a pass boundary. After `deadline` no portion begins once every tile has one pass; the
    /// portions before it are small enough to meet it.
    pub fn run_range(
        &self,
        film: &mut Film,
        range: Range<u32>,
        deadline: Option<Instant>,
        cancel: &AtomicBool,
        mut report: impl FnMut(&Film, Progress),
    ) -> Outcome {
        let begin = Instant::now();
        let rays = AtomicU64::new(0);
        let tiles = film.tiles().len();
        let least = rayon::current_num_threads().clamp(1, tiles.max(1));
        let first = self.first_missing(film, range.start);
        let (mut next, mut at, mut done, mut work) = (first, 0usize, 0u64, Duration::ZERO);
        let (mut error, mut error_at) = (None, first);
        while next < range.end && !cancel.load(Ordering::Relaxed) {
            let per_tile = (done > 0).then(|| (work.as_secs_f64() / done as f64).max(1e-9));
            let left = deadline.map(|d| d.saturating_duration_since(Instant::now()).as_secs_f64());
            // Half of what is left, so that what the next tiles cost more than the last ones does not break the budget.
            let portion = left.map_or(PORTION, |l| PORTION.min(0.5 * l));
            let fit = per_tile.map_or(4 * least, |t| (portion / t) as usize);
            if left.is_some() && fit < least && film.samples().0 > 0 {
                break;
            }
            let (count, passes) = match fit / tiles.max(1) {
                0 => (fit.max(least).min(tiles - at), 1),
                _ if at > 0 => (tiles - at, 1),
                n => (tiles, (n as u32).min(64).min(range.end - next)),
            };
            let since = Instant::now();
            self.tiles(film, at..at + count, next..next + passes, &rays);
            work += since.elapsed();
            done += count as u64 * passes as u64;
            at += count;
            if at >= tiles {
                at = 0;
                next = self.first_missing(film, next);
                if next >= error_at {
                    error = film.relative_error();
                    error_at = next.saturating_add((next - first).div_ceil(4));
                }
            }
            let by_passes = ((next - first) as f32 + at as f32 / tiles.max(1) as f32)
                / range.end.saturating_sub(first).max(1) as f32;
            let by_time = deadline.map_or(0.0, |d| {
                let all = d.saturating_duration_since(begin).as_secs_f32();
                if all > 0.0 { begin.elapsed().as_secs_f32() / all } else { 1.0 }
            });
            let progress = Progress {
                passes: next.min(range.end) - range.start,
                done: by_passes.max(by_time).min(1.0),
                rays: rays.load(Ordering::Relaxed),
                elapsed: begin.elapsed(),
                error,
            };
            report(film, progress);
        }
        Outcome {
            passes: next.min(range.end).saturating_sub(first),
            rays: rays.load(Ordering::Relaxed),
            cancelled: cancel.load(Ordering::Relaxed) && next < range.end,
            complete: next >= range.end,
        }
    }

    /// Give every tile of the film these passes; those that a tile has already are not done again.
    pub fn passes(&self, film: &mut Film, passes: Range<u32>, rays: &AtomicU64) {
        let tiles = film.tiles().len();
        self.tiles(film, 0..tiles, passes, rays);
    }

    fn tiles(&self, film: &mut Film, tiles: Range<usize>, passes: Range<u32>, rays: &AtomicU64) {
        let (width, height) = (film.width(), film.height());
        debug_assert!(width > 0 && height > 0);
        let from = tiles.start;
        film.tiles_mut()[tiles].par_iter_mut().enumerate().for_each(|(i, tile)| {
            let samples = match &self.rates {
                Some(rates) => rates.samples(from + i, passes.clone()),
                None => passes.clone(),
            };
            for gap in tile.missing(samples) {
                let n = self.tile(tile, gap.clone());
                rays.fetch_add(n, Ordering::Relaxed);
                // A gap is what the tile lacks, so this cannot fail.
                let _ = tile.cover(gap);
            }
        });
    }

    fn tile(&self, tile: &mut Tile, passes: Range<u32>) -> u64 {
        let mut tally = Tally::default();
        let (right, bottom) = (tile.x0 + tile.width, tile.y0 + tile.height);
        let within = |[x, y]: [u32; 2]| (tile.x0..right).contains(&x) && (tile.y0..bottom).contains(&y);
        let edge = if self.shares() { SQUARE } else { 1 };
        let along = |from: u32, to: u32| (from / edge * edge..to).step_by(edge as usize);
        let squares = along(tile.y0, bottom).flat_map(|y| along(tile.x0, right).map(move |x| [x, y]));
        for at in squares.collect::<Vec<_>>() {
            for pass in passes.clone() {
                for block in self.blocks(at, pass).filter(|block| block.pixels().any(within)) {
                    let samples = self.together(&block, pass, &mut tally);
                    for (at, sample) in block.pixels().zip(&samples).filter(|(at, _)| within(*at)) {
                        let [x, y] = [at[0] - tile.x0, at[1] - tile.y0];
                        tile.pixels[(y * tile.width + x) as usize].add(sample);
                    }
                }
            }
        }
        for (sum, part) in self.surprise.iter().zip([tally.gathered, tally.surprise]) {
            sum.fetch_add((part * 65536.0) as u64, Ordering::Relaxed);
        }
        tally.rays
    }

    /// Whether pixels share residuals.
    fn shares(&self) -> bool {
        let report = matches!(self.options.plan.strategy, Strategy::Report(_));
        // A hole that is one by chance may be none for who else looks.
        self.residual.share > 0.0 && !report && !self.world.has_holes()
    }

    /// The blocks of the square around `at`; that pixel alone where none are shared.
    fn blocks(&self, at: [u32; 2], deal: u32) -> impl Iterator<Item = Block> + use<> {
        let (alone, size) = (!self.shares(), self.size);
        let single = alone.then(|| Block::pixel(at, size));
        single.into_iter().chain(Block::around(at, deal, size).filter(move |_| !alone))
    }

    /// Luminance of one camera sample of each of some pixels around `at`, which share residuals if any do, and the rays they took. The same
    /// pixels whether they do or not; a function of this renderer and `pass` alone.
    pub(crate) fn trial(&self, at: [u32; 2], pass: u32) -> (Vec<f64>, u64) {
        let mut tally = Tally::default();
        let block = Block::around(at, 0, self.size).find(|block| block.pixels().any(|p| p == at));
        let pixels = block.iter().flat_map(Block::pixels);
        let samples: Vec<Sample> = match &block {
            Some(block) if self.shares() => self.together(block, pass, &mut tally),
            _ => {
                pixels.flat_map(|at| self.together(&Block::pixel(at, self.size), pass, &mut tally)).collect()
            }
        };
        let value = |s: &Sample| s.radiance.luminance() as f64;
        (samples.iter().map(value).map(|v| if v.is_finite() { v } else { 0.0 }).collect(), tally.rays)
    }

    /// Pass `pass` of the pixels of a block, each the mean of several camera samples where a hint asks for it. The same pixels whatever
    /// part of the picture is asked for, so a part has the bits of the whole.
    fn together(&self, block: &Block, pass: u32, tally: &mut Tally) -> Vec<Sample> {
        let several: Vec<u32> =
            block.pixels().map(|[x, y]| self.world.hints.samples(x, y, self.size)).collect();
        let most = several.iter().copied().max().unwrap_or(1);
        let mut wholes = vec![Sample::default(); several.len()];
        for k in 0..most {
            let asked = block.pixels().zip(&several).enumerate().filter(|(_, (_, several))| k < **several);
            let (places, pixels): (Vec<usize>, Vec<Asked>) = asked
                .map(|(i, (at, several))| {
                    let pixel = at[1] as u64 * self.size[0] as u64 + at[0] as u64;
                    (i, Asked { at, pixel, pass: pass.wrapping_mul(*several).wrapping_add(k) })
                })
                .unzip();
            for (i, more) in places.into_iter().zip(self.samples(&pixels, tally)) {
                let whole = &mut wholes[i];
                if k == 0 {
                    *whole = more;
                } else {
                    whole.radiance += more.radiance;
                    whole.albedo += more.albedo;
                }
            }
        }
        for (whole, several) in wholes.iter_mut().zip(several).filter(|(_, several)| *several > 1) {
            whole.radiance *= 1.0 / several as f32;
            whole.albedo *= 1.0 / several as f32;
        }
        wholes
    }

    /// A camera sample of each of `pixels`, weighted. In mode corrected they share residuals.
    fn samples(&self, pixels: &[Asked], tally: &mut Tally) -> Vec<Sample> {
        let mut samples = match self.options.mode {
            Mode::Path | Mode::Zones => pixels
                .iter()
                .map(|asked| {
                    let mut sampler = Sampler::new(self.options.seed, asked.pixel, asked.pass);
                    let (u_film, u_lens) = (sampler.next2(), sampler.next2());
                    let ray = self.lens.ray(asked.at[0], asked.at[1], u_film, u_lens);
                    let mut sample = self.sample(&ray, &mut sampler, tally);
                    sample.radiance *= ray.weight;
                    sample
                })
                .collect(),
            Mode::Zonal | Mode::Corrected => {
                let looks: Vec<Look> = pixels.iter().map(|asked| self.look(asked, tally)).collect();
                self.gather_from(looks, tally)
            }
        };
        samples.iter_mut().for_each(|s| s.radiance *= self.world.scene.film.scale);
        samples
    }

    /// Share of the gathered luminance that came from directions in which the strata expected less than a tenth of it, over
    /// all passes of this renderer and its clones: how often it was surprised. `None` before anything was gathered.
    pub fn surprise(&self) -> Option<f64> {
        let [all, part] = [0, 1].map(|i: usize| self.surprise[i].load(Ordering::Relaxed) as f64);
        (all > 0.0).then(|| part / all)
    }

    /// The same of a pilot: `samples` camera samples all over the picture, whose values are thrown away. A function of this renderer
    /// alone; 0 if nothing was gathered.
    pub fn pilot_surprise(&self, samples: usize) -> f64 {
        let key = Key::new(self.options.seed).with(0x5a_9415e);
        let [width, height] = self.size;
        let tallies: Vec<[f64; 2]> = (0..samples as u64)
            .into_par_iter()
            .map(|i| {
                let (at, mut tally) = (key.with(i), Tally::default());
                let on = |u: f32, n: u32| ((u * n as f32) as u32).min(n.saturating_sub(1));
                let place = sobol(i as u32, key);
                let mut sampler = Sampler::new(at.bits64(0), 0, 0);
                let (u_film, u_lens) = (sampler.next2(), sampler.next2());
                let ray = self.lens.ray(on(place.u, width), on(place.v, height), u_film, u_lens);
                self.sample(&ray, &mut sampler, &mut tally);
                [tally.gathered, tally.surprise]
            })
            .collect();
        let [all, part] = tallies.iter().fold([0.0, 0.0], |s, t| [s[0] + t[0], s[1] + t[1]]);
        if all > 0.0 { part / all } else { 0.0 }
    }

    /// One camera sample, unweighted.
    pub fn sample(&self, ray: &CameraRay, sampler: &mut Sampler, tally: &mut Tally) -> Sample {
        tally.rays += 1;
        let first = self.world.closest(ray.origin, ray.dir, f32::INFINITY);
        let mut out = self.first_hit(first.as_ref());
        let walker = self.walker();
        out.radiance = match self.options.mode {
            Mode::Path => {
                let walker = Walker { max_depth: self.options.max_depth, ..Walker::path(self.world) };
                let start =
                    Start { origin: ray.origin, dir: ray.dir, arrival: Arrival::Full, depth: 0, worth: 0.0 };
                walker.field_radiance_from(start, first, sampler, tally)
            }
            Mode::Zonal | Mode::Corrected | Mode::Zones => {
                let mut gathered = Rgb::BLACK;
                let mut scatters =
                    |s: &Surface, bsdf: &Bsdf, beta: Rgb, sampler: &mut Sampler, tally: &mut Tally| {
                        gathered += beta
                            * match self.options.mode {
                                Mode::Zones => self.zone_radiance(s),
                                _ => {
                                    let plan = self.options.plan.scaled(beta.max());
                                    gather(&walker, s, bsdf, &plan, sampler, tally)
                                }
                            };
                    };
                let shone = self.specular_tree(ray, first, &mut scatters, sampler, tally);
                gathered + shone
            }
        };
        out
    }

    /// What is known of a camera sample without looking for radiance.
    fn first_hit(&self, first: Option<&Surface>) -> Sample {
        let mut out = Sample::default();
        if let Some(s) = first {
            out.depth = Some(s.t);
            out.normal = s.frame.n.to_array();
            out.albedo = self.world.bsdf(s).albedo(s.frame.to_local(s.wo));
        }
        out
    }

    /// What the glances of one camera sample see ([`glances`]): all ask what shines, some will gather, each a part of the rays.
    fn look(&self, asked: &Asked, tally: &mut Tally) -> Look {
        let [x, y] = asked.at;
        let mut sampler = Sampler::new(self.options.seed, asked.pixel, asked.pass);
        let (u_film, u_lens) = (sampler.next2(), sampler.next2());
        let report = matches!(self.options.plan.strategy, Strategy::Report(_));
        let most = if report { 1 } else { glances::PLACES };
        let mut out = Sample::default();
        let mut shone = Rgb::BLACK;
        let (mut seen, mut found) = (Vec::new(), Vec::new());
        for k in 0..glances::COUNT as u32 {
            let ray = self.lens.ray(x, y, glances::place(u_film, k), u_lens);
            tally.rays += 1;
            let first = self.world.closest(ray.origin, ray.dir, f32::INFINITY);
            if k == 0 {
                out = self.first_hit(first.as_ref());
            }
            let mut scatters = |s: &Surface, bsdf: &Bsdf, beta: Rgb, _: &mut Sampler, _: &mut Tally| {
                seen.extend(self.seen(k, &ray, s, bsdf, beta));
                if !report || k == 0 {
                    let plan = self.options.plan.scaled(beta.max());
                    found.push(Spot { glance: k, s: *s, bsdf: *bsdf, weight: (beta, ray.weight), plan });
                }
            };
            let mut branch = sampler.branch(k);
            let own = self.specular_tree(&ray, first, &mut scatters, &mut branch, tally) * ray.weight;
            shone += match first.is_some_and(|s| self.is_curved(&s)) {
                true => self.shone_around([x, y], glances::place(u_film, k), u_lens, own, &mut branch, tally),
                false => own,
            };
        }
        let places = match glances::differ(&seen, most) || !self.is_crowded(&seen, most) {
            true if !report && glances::are_steep(&mut seen) => glances::COUNT as u32,
            true => most,
            false => 1,
        };
        let turn = ((sampler.next1() * places as f32) as u32).min(places - 1);
        found.retain(|spot: &Spot| glances::gathers(spot.glance, places));
        Look { out, shone, seen, found, places, turn, sampler }
    }

    /// The camera samples of `looks`, weighted: what is gathered at their spots is added to what they see.
    fn gather_from(&self, mut looks: Vec<Look>, tally: &mut Tally) -> Vec<Sample> {
        let sharing = looks.len() > 1;
        let walker = Walker { sharing, ..self.walker() };
        let mut gathered = vec![Rgb::BLACK; looks.len()];
        {
            let (mut points, mut of) = (Vec::new(), Vec::new());
            for (i, look) in looks.iter().enumerate() {
                gathered[i] = self.gather_at(look, &walker, tally, |point, place, weight, until| {
                    if sharing {
                        points.push(point);
                        of.push(Sharer { pixel: i, place, weight, until });
                    }
                });
            }
            // The places of one pixel need not share: what each of them gets is one of two shares, or of eight.
            let together = |a: usize, b: usize| of[a].place == of[b].place;
            let all = std::mem::take(&mut tally.found);
            let mut next = 0;
            for (from, &Sharer { until, .. }) in of.iter().enumerate() {
                for found in &all[next..until] {
                    share(&points, from, found, together, tally, |k, radiance| {
                        gathered[of[k].pixel] += of[k].weight * radiance;
                    });
                }
                next = until;
            }
        }
        looks
            .iter_mut()
            .zip(gathered)
            .map(|(look, gathered)| {
                look.out.radiance = gathered * (1.0 / look.places as f32)
                    + look.shone * (1.0 / glances::COUNT as f32)
                    + glances::expected_more(&mut look.seen, look.places);
                look.out
            })
            .collect()
    }

    /// The sum of what is gathered at the spots of one camera sample. `done` gets each gather, the number of its place, what its radiance counts, and how many
    /// residuals have been found by then.
    fn gather_at<'b>(
        &self,
        look: &'b Look,
        walker: &'b Walker<'b>,
        tally: &mut Tally,
        mut done: impl FnMut(Point<'b>, u32, Rgb, usize),
    ) -> Rgb {
        let (places, turn) = (look.places, look.turn);
        let report = matches!(self.options.plan.strategy, Strategy::Report(_));
        let mut gathered = Rgb::BLACK;
        let mut wholes = [Gathered::default(); MOST_WHOLES];
        // All parts draw from the same points, so that their rays are spread over the hemisphere together.
        let (mut points, mut at) = (look.sampler.clone(), (0, 0));
        for Spot { glance, s, bsdf, weight: (beta, weight), plan } in &look.found {
            if at.0 != *glance {
                (points, at) = (look.sampler.clone(), (*glance, 0));
            }
            let radiance = if report {
                gather(walker, s, bsdf, plan, &mut points, tally)
            } else {
                let place = glance / (glances::COUNT as u32 / places);
                let point =
                    Point::new(walker, s, bsdf, plan, Part { first: (place + turn) % places, of: places });
                let part = point.gather(&mut points, tally);
                let whole = &mut wholes[at.1.min(MOST_WHOLES - 1)];
                *whole = whole.with(part);
                done(point, place, *beta * *weight, tally.found.len());
                part.whole
            };
            at.1 += 1;
            gathered += *beta * radiance * *weight;
        }
        wholes.iter().for_each(|whole| tally.judge(whole, places));
        gathered
    }

    /// Whether mirrors or glass are curved at `s`: there lamps are seen small and in many places.
    fn is_curved(&self, s: &Surface) -> bool {
        self.world.bsdf(s).has_delta() && self.world.flat_outline(s).is_none()
    }

    /// The mean of `own`, what shone at `u` of a pixel where something [is curved](Self::is_curved), and of what shines around it
    /// ([`glances::mean_around`]).
    fn shone_around(
        &self,
        [x, y]: [u32; 2],
        u: [f32; 2],
        u_lens: [f32; 2],
        own: Rgb,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let steps = std::array::from_fn(|_| sampler.next2());
        glances::mean_around(u, own, steps, |to| {
            let ray = self.lens.ray(x, y, to, u_lens);
            tally.rays += 1;
            let first = self.world.closest(ray.origin, ray.dir, f32::INFINITY);
            first.is_some_and(|s| self.is_curved(&s)).then(|| {
                let mut nothing = |_: &Surface, _: &Bsdf, _: Rgb, _: &mut Sampler, _: &mut Tally| {};
                self.specular_tree(&ray, first, &mut nothing, sampler, tally) * ray.weight
            })
        })
    }

    /// Whether so many images are listed where one of the `places` would gather that pointing their cones at a second place costs more than it
    /// brings.
    fn is_crowded(&self, seen: &[Seen], places: u32) -> bool {
        let Some(zones) = self.walker().guide() else { return false };
        let listed = |s: &Seen| zones.records().listed(s.p, s.n);
        seen.iter().filter(|s| glances::gathers(s.glance, places)).any(|s| listed(s) > CROWDED)
    }

    fn walker(&self) -> Walker<'_> {
        Walker { zones: self.zones, steer: self.steer, residual: self.residual, ..Walker::path(self.world) }
    }

    /// What glance `k` expects where it meets `s`.
    fn seen(&self, k: u32, ray: &CameraRay, s: &Surface, bsdf: &Bsdf, beta: Rgb) -> Option<Seen> {
        let zones = self.zones?;
        let broad = self.expected.unwrap_or_else(|| zones.broad(self.world));
        let albedo = bsdf.diffuse_albedo(s.frame.to_local(s.wo));
        let place = zones.locate(self.world, s, [0.5, 0.5]);
        Some(Seen {
            glance: k,
            p: s.p,
            n: s.facing(),
            reach: SHARING_REACH * place.radius,
            weight: beta * albedo * (ray.weight * FRAC_1_PI),
            irradiance: broad.irradiance(&place),
        })
    }

    /// What the zone at `s` says, without interpolation.
    fn zone_radiance(&self, s: &Surface) -> Rgb {
        let Some(zones) = self.zones else { return Rgb::BLACK };
        let place = zones.locate(self.world, s, [0.5, 0.5]);
        zones.reflected(&place, &self.world.bsdf(s), s.frame.to_local(s.wo))
    }
}
