//! Scouts: what chains of mirrors and glass lead from the brightest luminaires to where a sensor might be, searched for by
//! themselves. They answer what cannot be told from gather rays that met nothing: whether the image of a sun, too small to be
//! met by chance, is there after all.
//!
//! Scouts leave the luminaires evenly (never aimed: where there is nothing to learn from, aim is a prejudice; but those that start
//! past all balls around casters need not be followed). They go by mirrors and glass and note every segment behind one. Sightings of one signature tell where its image lies. What has been seen is then
//! looked for from the sensor; what has not been seen carries about as much flux as what has been seen but a few times, and one
//! scout more (I. J. Good 1953, "The population frequencies of species").

use super::particles::{Source, starting_numbers};
use super::records::Record;
use crate::bsdf::{BsdfSample, Transport as Quantity};
use crate::world::balls::{Ball, Balls};
use crate::world::emission::EmittedParticle;
use crate::world::luminaire::NO_LUMINAIRE;
use crate::world::{Surface, World};
use hemilux_scene::geom::{DVec3, Frame, Vec3};
use hemiquad::points::Key;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Longest chain that is followed.
const LONGEST: u32 = 64;
/// Casters that starts are compared with; where there are more, every scout is followed.
const MOST_BALLS: usize = 64;
/// Starts that show how many go for casters.
const TRIED: u64 = 1 << 14;
/// Starts for each scout that is wanted, at most.
const MOST_STARTS: u64 = 16;
/// Scouts traced as one unit of work.
const CHUNK: u64 = 4096;
/// Sightings from which on a signature's image is known.
const FEW: usize = 3;
/// Sightings of a fixed image lie within this many radii of the luminaire from their mean; the image is taken to be a little larger.
const FIXED: f32 = 1.5;
const TAKEN: f32 = 1.6;
/// Index of what a segment runs in, where it counts as outside of glass.
const OUTSIDE: f32 = 1e-3;

/// A virtual luminaire at a fixed place, whoever looks.
#[derive(Clone, Copy, Debug)]
pub struct FixedImage {
    /// m.
    pub centre: Vec3,
    /// m.
    pub radius: f32,
}

/// What scouts found.
#[derive(Clone, Debug)]
pub struct Scouts {
    /// Images that were seen often enough to know their places.
    pub images: Vec<FixedImage>,
    /// Luminance of the flux (W) that may take chains which were not, or hardly, seen.
    pub unsure: f64,
    /// Area (m²) of balls around the casters: what such flux is spread over, at least.
    pub area: f64,
    /// Luminance from which on a luminaire counts (W·sr⁻¹·m⁻²).
    bright: f32,
}

impl Scouts {
    /// Send so many that about `count` go for casters, from luminaires that somewhere have at least luminance `bright`. `None`
    /// where they cannot tell: an image has no fixed place (curved casters), what is bright fills a part of the sky, or it has
    /// hardly any of the power.
    pub fn send(world: &World, count: u64, seed: u64, bright: f32) -> Option<Scouts> {
        let luminaires = &world.luminaires;
        if luminaires.brightest_wide_sky(&world.scene, [0.2126, 0.7152, 0.0722]) >= bright as f64 {
            return None;
        }
        let key = Key::new(seed).with(0x5c_0075);
        let balls = Balls::new(world);
        let casters = if balls.casters().len() <= MOST_BALLS { balls.casters() } else { &[] };
        let goes =
            |e: &EmittedParticle| casters.is_empty() || casters.iter().any(|b| meets(b, e.origin, e.dir));
        // Few of them, to see how many go for casters.
        let tried: Vec<EmittedParticle> = (0..TRIED).filter_map(|i| start(world, key, i, bright)).collect();
        if tried.is_empty() {
            return None;
        }
        let one = tried.iter().map(|e| e.flux.luminance() as f64).sum::<f64>() / tried.len() as f64;
        let going = tried.iter().filter(|e| goes(e)).count() as u64;
        let count = (count * TRIED / going.max(1)).clamp(count, MOST_STARTS * count);
        let chunks: Vec<u64> = (0..count).step_by(CHUNK as usize).collect();
        let found: Vec<Vec<Sighting>> = chunks
            .par_iter()
            .map(|&first| {
                let mut found = Vec::new();
                for i in first..(first + CHUNK).min(count) {
                    if let Some(e) = start(world, key, i, bright).filter(goes) {
                        scout(world, key, i, &e, &mut found);
                    }
                }
                found
            })
            .collect();
        let mut seen: Vec<Sighting> = found.into_iter().flatten().collect();
        seen.sort_by_key(|s| (s.record.signature, s.scout));
        let mut all = Scouts { images: Vec::new(), unsure: one, area: area(&balls), bright };
        let mut unsure: Vec<(u64, f32)> = Vec::new();
        for group in seen.chunk_by(|a, b| a.record.signature == b.record.signature) {
            if group.len() < FEW {
                unsure.extend(group.iter().map(|s| (s.scout, s.record.flux)));
            } else {
                all.images.push(fixed_image(group)?);
            }
        }
        // A scout counts once, however many hardly known chains it went.
        unsure.sort_by_key(|u| u.0);
        unsure.dedup_by_key(|u| u.0);
        all.unsure += unsure.iter().map(|u| u.1 as f64).sum::<f64>();
        all.unsure /= count as f64;
        Some(all)
    }

    /// Part of the hemisphere around `n` that an image fills as seen from `x`, weighted by cosine and over π; its directions
    /// are a cone: axis, squared sine. `None` if it lies behind.
    pub fn part(&self, image: &FixedImage, x: Vec3, n: Vec3) -> Option<(f64, Vec3, f32)> {
        let to = image.centre - x;
        let distance = to.length().max(f32::MIN_POSITIVE);
        let sin = (image.radius / distance).min(1.0);
        let cos = (to / distance).dot(n);
        (cos > -sin).then(|| ((sin * sin * cos.max(sin)) as f64, to / distance, sin * sin))
    }

    /// How many of `rays` rays from `x` into an image's cone leave on the side of unit `n` and end on a bright luminaire by mirrors and glass.
    pub fn hits(&self, world: &World, [x, n]: [Vec3; 2], axis: Vec3, sin2: f32, rays: u64, key: Key) -> u64 {
        let frame = Frame::from_normal(axis);
        let height = 0.5 * sin2 * (1.0 + 0.25 * sin2);
        (0..rays)
            .into_par_iter()
            .filter(|&i| {
                let key = key.with(i);
                let (up, turn) = (key.uniform(0) * height, std::f32::consts::TAU * key.uniform(1));
                let sin = (up * (2.0 - up)).max(0.0).sqrt();
                let local = Vec3::new(sin * turn.cos(), sin * turn.sin(), 1.0 - up);
                let dir = frame.to_world(local).normalize();
                dir.dot(n) > 0.0 && self.ends_bright(world, x, dir, key)
            })
            .count() as u64
    }

    /// Whether a ray that follows mirrors and glass (branches by chance) ends on a bright luminaire.
    fn ends_bright(&self, world: &World, mut origin: Vec3, mut dir: Vec3, key: Key) -> bool {
        let mut numbers = (2u32..).map(|d| key.uniform(d));
        let mut next = || numbers.next().unwrap_or(0.0);
        for depth in 0..LONGEST {
            let Some(s) = world.closest(origin, dir, f32::INFINITY) else {
                let skies = world.luminaires.sky_radiance(&world.scene, origin, dir);
                return depth > 0 && skies.into_iter().any(|(r, _)| r.luminance() >= self.bright);
            };
            if s.luminaire != NO_LUMINAIRE && depth > 0 {
                let r = world.luminaires.radiance(&world.scene, s.luminaire, s.ng, s.uv, s.wo);
                if r.luminance() >= self.bright {
                    return true;
                }
            }
            let Some((on, wi, _)) = specular(world, &s, Quantity::Radiance, [next(), next(), next()]) else {
                return false;
            };
            (origin, dir) = (on, wi);
        }
        false
    }
}

/// A segment behind mirrors or glass, and the number of its scout.
struct Sighting {
    record: Record,
    scout: u64,
}

/// The image that sightings of one signature come from, if it has a fixed place: if, wherever it was seen from, it was hardly
/// farther from the mean than the luminaire is wide.
fn fixed_image(group: &[Sighting]) -> Option<FixedImage> {
    let point = |s: &Sighting| s.record.image();
    let centre = (group.iter().map(|s| point(s).as_dvec3()).sum::<DVec3>() / group.len() as f64).as_vec3();
    let spread = group.iter().map(|s| (point(s) - centre).length()).fold(0.0, f32::max);
    let known = group[0].record.radius;
    (spread <= FIXED * known).then_some(FixedImage { centre, radius: TAKEN * known })
}

/// The way on from `s` by a mirror or glass: origin, direction, and what was sampled. `None` if chance chose anything else.
pub(super) fn specular(
    world: &World,
    s: &Surface,
    q: Quantity,
    u: [f32; 3],
) -> Option<(Vec3, Vec3, BsdfSample)> {
    let bsdf = world.bsdf(s);
    if !bsdf.has_delta() {
        return None;
    }
    let next = bsdf.sample(s.frame.to_local(s.wo), u[0], [u[1], u[2]], q)?;
    let wi = s.frame.to_world(next.wi).normalize();
    (next.delta && s.is_front(wi) == (next.wi.z > 0.0)).then(|| (s.leave(wi), wi, next))
}

/// Whether the ray from `origin` along unit `dir` meets a ball.
fn meets(ball: &Ball, origin: Vec3, dir: Vec3) -> bool {
    let to = ball.centre - origin;
    let along = to.dot(dir);
    // A little larger, so that rounding does not hide a rim.
    let radius2 = ball.radius * ball.radius * 1.001;
    to.length_squared() <= radius2 || (along > 0.0 && (to - dir * along).length_squared() <= radius2)
}

/// Scout number `i` as it leaves a bright luminaire; `None` if it is another's.
fn start(world: &World, key: Key, i: u64, bright: f32) -> Option<EmittedParticle> {
    let [pick, p0, p1, d0, d1] = starting_numbers(key, i);
    let e = world.luminaires.emit(&world.scene, pick, [p0, p1], [d0, d1])?;
    (world.luminaires.peak_radiance(&world.scene, e.luminaire) >= bright as f64).then_some(e)
}

/// Follow one scout.
fn scout(world: &World, key: Key, i: u64, e: &EmittedParticle, found: &mut Vec<Sighting>) {
    let flux = e.flux.luminance();
    let mut source = Source::of_luminaire(world, e.luminaire, e.origin);
    let numbers = key.with(4).with(i);
    let (mut origin, mut dir, mut index) = (e.origin, e.dir, 1.0f32);
    for depth in 0..LONGEST {
        let hit = world.closest(origin, dir, f32::INFINITY);
        // No sensor stands in glass.
        if depth > 0 && (index - 1.0).abs() < OUTSIDE {
            let (p, t) = hit.as_ref().map_or((origin, 0.0), |s| (s.p, s.t));
            found.push(Sighting { record: source.record(p, -dir, t, flux), scout: i });
        }
        let Some(s) = hit else { break };
        let u = [0, 1, 2].map(|k| numbers.uniform(3 * depth + k));
        let Some((on, wi, next)) = specular(world, &s, Quantity::Flux, u) else { break };
        source.pass(world, &s, &world.bsdf(&s), wi, &next);
        index *= next.eta;
        (origin, dir) = (on, wi);
    }
}

/// Area of balls around the casters, or of one around all of them if that is smaller.
fn area(balls: &Balls) -> f64 {
    let casters = balls.casters();
    let centre = casters.iter().map(|b| b.centre).sum::<Vec3>() / casters.len().max(1) as f32;
    let whole = casters.iter().map(|b| (b.centre - centre).length() + b.radius).fold(0.0, f32::max) as f64;
    let each: f64 = casters.iter().map(|b| (b.radius as f64).powi(2)).sum();
    4.0 * PI * each.min(whole * whole)
}
