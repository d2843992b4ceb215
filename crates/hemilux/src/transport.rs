//! Following one ray: the reference path tracer, and the gather ray that ends on zones. One walk serves both.
//!
//! Without zones this is a unidirectional path tracer with luminaire sampling (Kajiya 1986), the two ways of reaching a
//! luminaire weighted by the power heuristic (Veach and Guibas 1995), ended by Russian roulette: unbiased.
//! With zones a walk ends at the first vertex that scatters diffusely and lies farther than about two zone radii: there
//! the diffuse part of the surface radiance is the zone's, and only narrower lobes go on. **Biased by the zones.**
//! A vertex closer than that does not trust its zone: it takes the zone's caustic bin, samples luminaires, and goes on
//! for a bounce.

use crate::bsdf::{Bsdf, Transport as Quantity};
use crate::sampler::Sampler;
use crate::world::luminaire::NO_LUMINAIRE;
use crate::world::{Surface, World};
use crate::zones::Zones;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// A zone is trusted from this many of its radii on.
pub const ZONE_TRUST: f32 = 2.0;
/// Scattering events before Russian roulette may end a walk.
const ROULETTE_FROM: u32 = 3;
/// No walk is longer; reached with probability below 1e-20 unless nothing absorbs.
const LONGEST_WALK: u32 = 4096;
/// Specular events of a chain; roulette ends it long before.
const LONGEST_CHAIN: u32 = 256;

/// What walks cost and found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rays traced.
    pub rays: u64,
    /// Luminaires (or sky) of at least luminance `bright` met at the end of a specular chain, by chance.
    pub chain_hits: u64,
    /// What counts as bright (W·sr⁻¹·m⁻²).
    pub bright: f32,
}

impl Tally {
    fn note(&mut self, in_chain: bool, met: Rgb) {
        self.chain_hits += (in_chain && !met.is_black() && met.luminance() >= self.bright) as u64;
    }
}

/// What a luminaire counts where a ray meets it.
#[derive(Clone, Copy, Debug)]
pub enum Arrival {
    /// Fully: nothing else looks for it.
    Full,
    /// In part: luminaire sampling at `from` looks for it too.
    Shared {
        /// Where luminaires were sampled.
        from: Vec3,
        /// Number of rays times their density per solid angle.
        rays: f32,
        /// Number of luminaire samples there.
        samples: f32,
    },
    /// Not at all: something else has it already.
    None,
}

/// The power heuristic (β = 2) for `a` = count × density of the way taken, `b` of the other.
#[inline]
pub fn power_heuristic(a: f32, b: f32) -> f32 {
    if b <= 0.0 {
        return 1.0;
    }
    // By the ratio, so that large densities do not overflow.
    let r = b / a;
    1.0 / (1.0 + r * r)
}

/// Everything a walk needs to know.
#[derive(Clone, Copy)]
pub struct Walker<'a> {
    /// The scene.
    pub world: &'a World,
    /// Where walks may end; `None`: path tracing.
    pub zones: Option<&'a Zones>,
    /// Limit on scattering events (path tracing only).
    pub max_depth: u32,
}

/// Where a walk starts.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Origin, off the surface.
    pub origin: Vec3,
    /// Unit direction.
    pub dir: Vec3,
    /// What a luminaire counts on the first segment.
    pub arrival: Arrival,
    /// Scattering events before this ray.
    pub depth: u32,
    /// What a luminaire counts at the end of a specular chain from the start: 1 unless something else looks for it too.
    pub chain: f32,
}

impl<'a> Walker<'a> {
    /// An estimate of the field radiance that arrives along `start`, W·sr⁻¹·m⁻². Adds what it traces and finds to `tally`.
    pub fn field_radiance(&self, start: Start, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        tally.rays += 1;
        let hit = self.world.closest(start.origin, start.dir, f32::INFINITY);
        self.field_radiance_from(start, hit, sampler, tally)
    }

    /// The same, given what the first ray meets.
    pub fn field_radiance_from(
        &self,
        start: Start,
        mut hit: Option<Surface>,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let Start { mut origin, mut dir, mut arrival, mut depth, .. } = start;
        let mut radiance = Rgb::BLACK;
        let mut beta = Rgb::WHITE;
        // What a luminaire counts, per band, once the ray has passed a mirror or glass: all of it, unless a zone's
        // caustic bin holds the same.
        let mut after_chain = Rgb::splat(start.chain);
        let mut in_chain = false;
        let mut travelled = 0.0;
        loop {
            let Some(s) = hit else {
                let chain = if in_chain { after_chain } else { Rgb::WHITE };
                let sky = self.sky(origin, dir, arrival);
                tally.note(in_chain, sky);
                radiance += beta * chain * sky;
                break;
            };
            travelled += s.t;
            if s.luminaire != NO_LUMINAIRE {
                let chain = if in_chain { after_chain } else { Rgb::WHITE };
                let emission = self.emission(&s, arrival);
                tally.note(in_chain, emission);
                radiance += beta * chain * emission;
            }
            if depth >= self.max_depth.min(LONGEST_WALK) {
                break;
            }
            let bsdf = self.world.bsdf(&s);
            let wo = s.frame.to_local(s.wo);
            let (zonal, going_on) = self.end_on_zone(&s, &bsdf, wo, travelled, sampler);
            radiance += beta * zonal;
            let narrow;
            let on = match going_on {
                GoingOn::NarrowLobes => {
                    narrow = bsdf.without_diffuse();
                    &narrow
                }
                _ => &bsdf,
            };
            if on.is_black() {
                break;
            }
            if on.has_non_delta() {
                radiance += beta * self.direct(&s, on, wo, sampler, tally);
            }
            let (u_lobe, u) = (sampler.next1(), sampler.next2());
            let Some(next) = on.sample(wo, u_lobe, u, Quantity::Radiance) else { break };
            let wi = s.frame.to_world(next.wi).normalize();
            // Shading normals must not carry radiance through the surface.
            if s.is_front(wi) != (next.wi.z > 0.0) {
                break;
            }
            beta *= next.weight;
            depth += 1;
            if next.delta {
                in_chain = true;
                arrival = Arrival::Full;
            } else {
                arrival = Arrival::Shared { from: s.p, rays: next.pdf, samples: 1.0 };
                in_chain = false;
                travelled = 0.0;
                after_chain = match going_on {
                    GoingOn::WithoutCaustic => narrow_share(on, wo, next.wi),
                    _ => Rgb::WHITE,
                };
            }
            if beta.is_black() || !roulette(&mut beta, depth, sampler) {
                break;
            }
            (origin, dir) = (s.leave(wi), wi);
            tally.rays += 1;
            hit = self.world.closest(origin, dir, f32::INFINITY);
        }
        radiance
    }

    /// An estimate of what arrives along a ray from luminaires at the end of specular chains, and only that: the ray
    /// follows mirrors and glass until it meets something else.
    pub fn virtual_radiance(&self, origin: Vec3, dir: Vec3, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let (mut origin, mut dir, mut beta) = (origin, dir, Rgb::WHITE);
        let mut radiance = Rgb::BLACK;
        for depth in 0..LONGEST_CHAIN {
            tally.rays += 1;
            let Some(s) = self.world.closest(origin, dir, f32::INFINITY) else {
                if depth > 0 {
                    radiance += beta * self.sky(origin, dir, Arrival::Full);
                }
                break;
            };
            if depth > 0 {
                radiance += beta * self.emission(&s, Arrival::Full);
            }
            let bsdf = self.world.bsdf(&s);
            if !bsdf.has_delta() {
                break;
            }
            let Some((wi, weight)) = specular_branch(&s, &bsdf, sampler.next1()) else { break };
            beta *= weight;
            if depth >= ROULETTE_FROM {
                let survive = beta.max().min(0.95);
                if sampler.next1() >= survive {
                    break;
                }
                beta *= 1.0 / survive;
            }
            (origin, dir) = (s.leave(wi), wi);
        }
        radiance
    }

    /// Radiance of the skies at `origin` along `dir`, weighted.
    pub(crate) fn sky(&self, origin: Vec3, dir: Vec3, arrival: Arrival) -> Rgb {
        let mut sum = Rgb::BLACK;
        for (radiance, i) in self.world.luminaires.sky_radiance(&self.world.scene, origin, dir) {
            if radiance.is_black() {
                continue;
            }
            sum += radiance
                * match arrival {
                    Arrival::Full => 1.0,
                    Arrival::None => 0.0,
                    Arrival::Shared { rays, samples, .. } => {
                        let other = self.world.luminaires.sky_pdf(&self.world.scene, i, dir);
                        power_heuristic(rays, samples * other)
                    }
                };
        }
        sum
    }

    /// Radiance of the luminaire at `s`, weighted.
    pub(crate) fn emission(&self, s: &Surface, arrival: Arrival) -> Rgb {
        if s.luminaire == NO_LUMINAIRE {
            return Rgb::BLACK;
        }
        let luminaires = &self.world.luminaires;
        let radiance = luminaires.radiance(&self.world.scene, s.luminaire, s.ng, s.uv, s.wo);
        if radiance.is_black() {
            return radiance;
        }
        match arrival {
            Arrival::Full => radiance,
            Arrival::None => Rgb::BLACK,
            Arrival::Shared { from, rays, samples } => {
                let distance = (s.p - from).length();
                let other = luminaires.pdf_solid_angle(s.luminaire, from, -s.wo, distance, s.ng);
                radiance * power_heuristic(rays, samples * other)
            }
        }
    }

    /// The zone's share of the surface radiance at `s`, and what must still be followed.
    fn end_on_zone(
        &self,
        s: &Surface,
        bsdf: &Bsdf,
        wo: Vec3,
        travelled: f32,
        sampler: &mut Sampler,
    ) -> (Rgb, GoingOn) {
        let Some(zones) = self.zones else { return (Rgb::BLACK, GoingOn::All) };
        if !bsdf.has_diffuse() {
            return (Rgb::BLACK, GoingOn::All);
        }
        let jitter = sampler.next2();
        let place = zones.locate(self.world, s, jitter);
        if travelled >= ZONE_TRUST * place.radius {
            (zones.reflected(&place, bsdf, wo), GoingOn::NarrowLobes)
        } else {
            (zones.reflected_caustic(&place, bsdf, wo), GoingOn::WithoutCaustic)
        }
    }

    /// One luminaire sample at `s`, weighted against sampling the scattering.
    fn direct(&self, s: &Surface, bsdf: &Bsdf, wo: Vec3, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let (u_pick, u) = (sampler.next1(), sampler.next2());
        let Some(l) = self.world.luminaires.sample(&self.world.scene, s.p, u_pick, u) else {
            return Rgb::BLACK;
        };
        let wi = s.frame.to_local(l.wi);
        if s.is_front(l.wi) != (wi.z > 0.0) {
            return Rgb::BLACK;
        }
        let f = bsdf.eval(wo, wi, Quantity::Radiance) * wi.z.abs();
        if f.is_black() {
            return Rgb::BLACK;
        }
        let weight = if l.met_by_rays {
            power_heuristic(l.pdf_solid_angle, bsdf.pdf_solid_angle(wo, wi))
        } else {
            1.0
        };
        tally.rays += 1;
        if l.is_occluded(self.world, s) {
            return Rgb::BLACK;
        }
        f * l.radiance * (weight / l.pdf_solid_angle)
    }
}

/// One of the specular ways on from `s`, picked in proportion to what it carries, with its weight over probability.
pub(crate) fn specular_branch(s: &Surface, bsdf: &Bsdf, u: f32) -> Option<(Vec3, Rgb)> {
    let wo = s.frame.to_local(s.wo);
    let branches = || bsdf.lobes().iter().flat_map(|l| l.branches(wo, Quantity::Radiance)).flatten();
    let all: f32 = branches().map(|b| b.weight.max()).sum();
    let mut left = u * all;
    for b in branches() {
        let strength = b.weight.max();
        if left < strength {
            let wi = s.frame.to_world(b.wi).normalize();
            let kept = s.is_front(wi) == (b.wi.z > 0.0);
            return kept.then_some((wi, b.weight * (all / strength)));
        }
        left -= strength;
    }
    None
}

/// What a walk still has to follow behind a vertex.
#[derive(Clone, Copy)]
enum GoingOn {
    /// Everything.
    All,
    /// Everything but the diffuse lobes, which the zone has given.
    NarrowLobes,
    /// Everything but caustics on the diffuse lobes, which the zone has given.
    WithoutCaustic,
}

/// Share of the scattering that is not diffuse, per band.
fn narrow_share(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> Rgb {
    let narrow = bsdf.without_diffuse();
    if !narrow.has_non_delta() {
        return Rgb::BLACK;
    }
    let (part, all) = (narrow.eval(wo, wi, Quantity::Radiance), bsdf.eval(wo, wi, Quantity::Radiance));
    Rgb([0, 1, 2].map(|c| if all[c] > 0.0 { part[c] / all[c] } else { 0.0 }))
}

/// Russian roulette on the throughput; survivors are scaled up.
#[inline]
fn roulette(beta: &mut Rgb, depth: u32, sampler: &mut Sampler) -> bool {
    if depth < ROULETTE_FROM {
        return true;
    }
    let survive = beta.max().min(0.95);
    if sampler.next1() >= survive {
        return false;
    }
    *beta *= 1.0 / survive;
    true
}
