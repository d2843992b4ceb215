//! Driving a render: tiles in parallel, pass after pass, until the budget is spent.
//!
//! A pass is one camera sample per pixel. Every sample is a function of (scene, options, seed, pixel, pass) alone, so
//! the picture is the same for any number of threads; passes end at film boundaries, where a run may be stopped.

use crate::film::{Film, Sample, Tile};
use crate::gather::{GatherPlan, gather};
use crate::sampler::Sampler;
use crate::transport::{Arrival, Start, Tally, Walker};
use crate::world::camera::{CameraRay, Lens};
use crate::world::{Surface, World};
use crate::zones::Zones;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What is computed at visible points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Gathering over the zonal solution. **Biased by the zones**, and by nothing else.
    Zonal,
    /// Path tracing: the unbiased reference.
    Path,
    /// The zonal solution as one sees it.
    Zones,
}

impl Mode {
    /// Every mode with its name on the command line.
    pub const ALL: [(&'static str, Mode); 3] =
        [("zonal", Mode::Zonal), ("path", Mode::Path), ("zones", Mode::Zones)];
}

/// Everything that shapes the samples of a picture.
#[derive(Clone, Copy, Debug)]
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
    /// No more passes than this.
    pub passes: u32,
    /// No pass starts that would, by the experience of this run, end after this.
    pub deadline: Option<Instant>,
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Passes done.
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
    /// Passes in the film, beyond those it had.
    pub passes: u32,
    /// Rays traced.
    pub rays: u64,
    /// Whether it was cancelled.
    pub cancelled: bool,
}

/// A renderer of one picture.
pub struct Renderer<'a> {
    world: &'a World,
    zones: Option<&'a Zones>,
    lens: Lens,
    options: RenderOptions,
}

/// A branch of the camera's specular tree counts at least this much, or survives by roulette.
const THINNEST_BRANCH: f32 = 0.05;
/// Branches waiting at once.
const MOST_BRANCHES: usize = 16;
/// Specular events from the camera; cut off beyond with less than 1e-6 of the radiance in any real scene.
const LONGEST_CHAIN: u32 = 128;

impl<'a> Renderer<'a> {
    /// Prepare to render onto films of `width` × `height`. Modes zonal and zones need `zones`; path ignores it.
    pub fn new(
        world: &'a World,
        zones: Option<&'a Zones>,
        width: u32,
        height: u32,
        options: RenderOptions,
    ) -> Renderer<'a> {
        Renderer { world, zones, lens: Lens::new(&world.scene, width, height), options }
    }

    /// Add passes to the film, from the first one that no tile has, until `stop`.
    /// `report` is called between batches; setting `cancel` ends the run at the next pass boundary.
    pub fn run(
        &self,
        film: &mut Film,
        stop: Stop,
        cancel: &AtomicBool,
        mut report: impl FnMut(Progress),
    ) -> Outcome {
        let begin = Instant::now();
        let first = film.tiles().iter().filter_map(|t| t.passes().last().map(|r| r.end)).max().unwrap_or(0);
        let last = first.saturating_add(stop.passes);
        let rays = AtomicU64::new(0);
        let (mut next, mut error, mut error_at) = (first, None, 0u32);
        let mut batch = 1u32;
        while next < last && !cancel.load(Ordering::Relaxed) {
            let elapsed = begin.elapsed();
            let per_pass = if next > first { elapsed / (next - first) } else { Duration::ZERO };
            if let Some(deadline) = stop.deadline {
                let left = deadline.saturating_duration_since(Instant::now());
                if next > first && left < per_pass {
                    break;
                }
                if per_pass > Duration::ZERO {
                    let fit = (left.as_secs_f64() / per_pass.as_secs_f64()) as u32;
                    batch = batch.min(fit.max(1));
                }
            }
            let end = next.saturating_add(batch).min(last);
            self.passes(film, next..end, &rays);
            next = end;
            // Batches of about a quarter of a second: few barriers, prompt answers.
            let per_pass = begin.elapsed().as_secs_f64() / (next - first) as f64;
            batch = ((0.25 / per_pass.max(1e-9)) as u32).clamp(1, 64);
            if next >= error_at {
                error = film.relative_error();
                error_at = next + (next - first).div_ceil(4);
            }
            let by_passes = (next - first) as f32 / stop.passes.max(1) as f32;
            let by_time = stop.deadline.map_or(0.0, |d| {
                let all = d.saturating_duration_since(begin).as_secs_f32();
                if all > 0.0 { begin.elapsed().as_secs_f32() / all } else { 1.0 }
            });
            report(Progress {
                passes: next - first,
                done: by_passes.max(by_time).min(1.0),
                rays: rays.load(Ordering::Relaxed),
                elapsed: begin.elapsed(),
                error,
            });
        }
        Outcome {
            passes: next - first,
            rays: rays.load(Ordering::Relaxed),
            cancelled: cancel.load(Ordering::Relaxed) && next < last,
        }
    }

    /// Add exactly these passes to every tile of the film; tiles that have one of them are left alone.
    pub fn passes(&self, film: &mut Film, passes: std::ops::Range<u32>, rays: &AtomicU64) {
        let (width, height) = (film.width(), film.height());
        debug_assert!(width > 0 && height > 0);
        film.tiles_mut().par_iter_mut().for_each(|tile| {
            if tile.cover(passes.clone()).is_ok() {
                let n = self.tile(tile, width, passes.clone());
                rays.fetch_add(n, Ordering::Relaxed);
            }
        });
    }

    fn tile(&self, tile: &mut Tile, width: u32, passes: std::ops::Range<u32>) -> u64 {
        let mut tally = Tally::default();
        for i in 0..tile.pixels.len() as u32 {
            let (x, y) = (tile.x0 + i % tile.width, tile.y0 + i / tile.width);
            let pixel = y as u64 * width as u64 + x as u64;
            for pass in passes.clone() {
                let mut sampler = Sampler::new(self.options.seed, pixel, pass);
                let (u_film, u_lens) = (sampler.next2(), sampler.next2());
                let ray = self.lens.ray(x, y, u_film, u_lens);
                let mut sample = self.sample(&ray, &mut sampler, &mut tally);
                sample.radiance *= ray.weight * self.world.scene.film.scale;
                tile.pixels[i as usize].add(&sample);
            }
        }
        tally.rays
    }

    /// One camera sample, unweighted.
    pub fn sample(&self, ray: &CameraRay, sampler: &mut Sampler, tally: &mut Tally) -> Sample {
        let mut out = Sample::default();
        tally.rays += 1;
        let first = self.world.closest(ray.origin, ray.dir, f32::INFINITY);
        if let Some(s) = &first {
            out.depth = Some(s.t);
            out.normal = s.frame.n.to_array();
            out.albedo = self.world.bsdf(s).albedo(s.frame.to_local(s.wo));
        }
        out.radiance = match self.options.mode {
            Mode::Path => {
                let walker = Walker { world: self.world, zones: None, max_depth: self.options.max_depth };
                let start = Start { origin: ray.origin, dir: ray.dir, arrival: Arrival::Full, depth: 0 };
                walker.field_radiance_from(start, first, sampler, tally)
            }
            Mode::Zonal | Mode::Zones => self.specular_tree(ray, first, sampler, tally),
        };
        out
    }

    /// Follow mirrors and glass from the camera, both ways at each interface, and gather where they end.
    fn specular_tree(
        &self,
        ray: &CameraRay,
        first: Option<Surface>,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let walker = Walker { world: self.world, zones: self.zones, max_depth: u32::MAX };
        let mut waiting: Vec<(Vec3, Vec3, Option<Surface>, Rgb, u32)> =
            vec![(ray.origin, ray.dir, first, Rgb::WHITE, 0)];
        let mut radiance = Rgb::BLACK;
        while let Some((origin, dir, hit, beta, depth)) = waiting.pop() {
            let Some(s) = hit else {
                radiance += beta * walker.sky(origin, dir, Arrival::Full);
                continue;
            };
            radiance += beta * walker.emission(&s, Arrival::Full);
            let bsdf = self.world.bsdf(&s);
            if bsdf.has_non_delta() {
                radiance += beta
                    * match self.options.mode {
                        Mode::Zones => self.zone_radiance(&s),
                        _ => {
                            let plan = self.options.plan.scaled(beta.max());
                            gather(&walker, &s, &bsdf, &plan, sampler, tally)
                        }
                    };
            }
            if !bsdf.has_delta() || depth >= LONGEST_CHAIN {
                continue;
            }
            let wo = s.frame.to_local(s.wo);
            for lobe in bsdf.lobes() {
                for branch in lobe.branches(wo, crate::bsdf::Transport::Radiance).into_iter().flatten() {
                    let wi = s.frame.to_world(branch.wi).normalize();
                    let mut beta = beta * branch.weight;
                    let strength = beta.max();
                    let thin = strength < THINNEST_BRANCH || waiting.len() >= MOST_BRANCHES;
                    if thin {
                        let survive = (strength / THINNEST_BRANCH).clamp(0.02, 0.9);
                        if sampler.next1() >= survive {
                            continue;
                        }
                        beta *= 1.0 / survive;
                    }
                    if !beta.is_black() && s.is_front(wi) == (branch.wi.z > 0.0) {
                        tally.rays += 1;
                        let origin = s.leave(wi);
                        let hit = self.world.closest(origin, wi, f32::INFINITY);
                        waiting.push((origin, wi, hit, beta, depth + 1));
                    }
                }
            }
        }
        radiance
    }

    /// What the zone at `s` says, without interpolation.
    fn zone_radiance(&self, s: &Surface) -> Rgb {
        let Some(zones) = self.zones else { return Rgb::BLACK };
        let place = zones.locate(self.world, s, [0.5, 0.5]);
        zones.reflected(&place, &self.world.bsdf(s), s.frame.to_local(s.wo))
    }
}
