//! What walks add where they end on a zone in mode corrected: residuals, (path − zone) / q.
//!
//! q goes by what the zone brings, as the zones themselves say: compare adjoint-driven Russian roulette and splitting (J. Vorba and
//! J. Křivánek 2016), with the solution as the adjoint. A path that goes on from a zone may end on a zone itself, with a residual of its own, so the
//! zones are a control variate at every bounce and not at the first alone; after [`GENERATIONS`] it goes on as a plain path.
//! Whatever q is and whatever the zones say, the expectation is that of the path.
//!
//! The number of residuals within one another stays bounded: along a way from zone to zone the q multiply to the albedos met times
//! the ratio of the last zone to the first, and the floor under q falls with the generation.

use super::{Arrival, Residual, Start, Tally, Walker, power_heuristic, sample};
use crate::bsdf::{Bsdf, Transport as Quantity};
use crate::gather::Found;
use crate::guide::{Guide, MOST_LISTED, images};
use crate::images::{Origin, radiance_by_chain};
use crate::sampler::Sampler;
use crate::world::Surface;
use crate::world::luminaire::Receiver;
use crate::zones::Zones;
use crate::zones::map::ZonePlace;
use crate::zones::records::Around;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// A residual is at least so probable, against that of a ray that brings what is expected of it; half of it for each generation.
const LEAST: f32 = 0.02;
/// Residuals at one end at most.
const MOST: f32 = 4.0;
/// Share of residuals within residuals.
const AGAIN: f32 = 1.0;
/// Residuals within one another; beyond, paths are plain.
const GENERATIONS: u32 = 5;
/// Where the others are shared, residuals that nobody shares are so many times as many.
const ALONE: f32 = 4.0;
/// Single images that are picked at a vertex: in the mean so many times the share of caustics there, by its zone, ...
const PICKS: f32 = 4.0;
/// ... within these. Paths that end on no zones pick a fixed number.
const PICKS_WITHIN: (f32, f32) = (0.3, 2.0);
const PATH_PICKS: f32 = 4.0;
/// Stream of a vertex's residual below the walk's own random numbers.
const RESIDUAL_STREAM: u32 = 0xc0_44ec;

/// Where a walk ends on a zone.
pub(super) struct End<'b> {
    pub s: &'b Surface,
    pub bsdf: &'b Bsdf,
    /// Local direction the walk came from.
    pub wo: Vec3,
    pub place: ZonePlace,
    /// Surface radiance by the zone.
    pub zonal: Rgb,
    pub depth: u32,
    /// [`Start::worth`] times what the walk lets through; 0 where it is not known.
    pub worth: f32,
}

/// What a zone of albedo `albedo` that sends `zonal` is expected to send in the mean square, about (luminance).
fn expected(zones: &Zones, place: ZonePlace, zonal: Rgb, albedo: f32) -> f32 {
    zonal.luminance() + zones.standard_error(place.zone, place.side) * albedo * std::f32::consts::FRAC_1_PI
}

/// A number of residuals, `q` in the mean, and the numbers they draw from: their own, so that without residuals the walk is the same.
fn drawn(q: f32, sampler: &Sampler) -> (u32, Sampler) {
    let mut sampler = sampler.branch(RESIDUAL_STREAM);
    ((q + sampler.next1()) as u32, sampler)
}

impl<'a> Walker<'a> {
    /// An estimate of what the zone gets wrong, for the diffuse lobes only.
    pub(super) fn residual(&self, zones: &Zones, end: &End, sampler: &Sampler, tally: &mut Tally) -> Rgb {
        let Residual { share, weight, .. } = self.residual;
        if share <= 0.0 {
            return Rgb::BLACK;
        }
        let albedo = end.bsdf.diffuse_albedo(end.wo).luminance();
        let expected = expected(zones, end.place, end.zonal, albedo);
        let shared = self.shared(end);
        let alone = if self.sharing && shared.is_none() { ALONE } else { 1.0 };
        let q = alone * self.residuals(end.worth * expected, end.worth > 0.0);
        let (count, sampler) = drawn(q, sampler);
        let diffuse = end.bsdf.only_diffuse();
        let mut sum = Rgb::BLACK;
        for k in 0..count {
            let path = self.diffuse_by_path(end, &diffuse, expected, &mut sampler.branch(k), tally);
            sum += path - end.zonal;
        }
        match shared {
            Some(view) if count > 0 => {
                let (residual, expected) = (sum * (weight / view), expected / view);
                let (s, bsdf, place, density) = (*end.s, *end.bsdf, end.place, tally.density);
                tally.found.push(Found { s, bsdf, place, residual, expected, density });
                Rgb::BLACK
            }
            _ => sum * (weight / q),
        }
    }

    /// Whether a gather ray of `worth` has a residual where it ends on a plain zone: what [`Walker::residual`] would decide with the same numbers.
    pub(super) fn has_residual(
        &self,
        zones: &Zones,
        place: ZonePlace,
        zonal: Rgb,
        albedo: f32,
        worth: f32,
        sampler: &Sampler,
    ) -> bool {
        let expected = expected(zones, place, zonal, albedo);
        drawn(self.residuals(worth * expected, worth > 0.0), sampler).0 > 0
    }

    /// [`Bsdf::diffuse_view`] at `end`, if residuals there are to be shared.
    fn shared(&self, end: &End) -> Option<f32> {
        let is_shared = self.sharing && end.depth == 1;
        is_shared.then(|| end.bsdf.diffuse_view(end.wo)).flatten().filter(|view| *view > 0.0)
    }

    /// Mean number of residuals where a zone brings `part` of what is expected, if that is `known`: noise is least for its cost if
    /// they are in proportion.
    pub(crate) fn residuals(&self, part: f32, known: bool) -> f32 {
        let share = if self.generation == 0 { self.residual.share } else { AGAIN };
        let least = LEAST / (1u32 << self.generation.min(16)) as f32;
        if known { share * part.max(least).min(MOST) } else { share }
    }

    /// The surface radiance by diffuse lobes, continued as a path: luminaire sampling and a bounce, shared by the power
    /// heuristic. Unbiased.
    fn diffuse_by_path(
        &self,
        end: &End,
        diffuse: &Bsdf,
        expected: f32,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let End { s, wo, depth, .. } = *end;
        let at = Receiver::surface(s, diffuse);
        let most = self.most_listed();
        let guide = self.guide().and_then(|zones| Guide::new(zones, s, diffuse, most));
        let around = self.guide().and_then(|zones| images(zones, s, diffuse, most));
        let picks = self.picks(end.place);
        let mut direct = self.direct(s, &at, diffuse, guide.as_ref(), wo, sampler, tally);
        if let Some(around) = &around {
            direct +=
                self.virtual_direct(s, diffuse, guide.as_ref(), (around, picks), wo, depth, sampler, tally);
        }
        let Some(next) = sample(s, diffuse, guide.as_ref(), wo, sampler) else { return direct };
        let wi = s.frame.to_world(next.wi).normalize();
        if s.is_front(wi) != (next.wi.z > 0.0) {
            return direct;
        }
        let worth = if expected > 0.0 { next.weight.luminance() / expected } else { 0.0 };
        let arrival = Arrival::Shared { from: at, rays: next.density, samples: 1.0 };
        let start = Start { origin: s.leave(wi), dir: wi, arrival, depth: depth + 1, worth };
        let generation = self.generation + 1;
        let ends_on_zones = generation < GENERATIONS;
        let zones = self.zones.filter(|_| ends_on_zones);
        let path = Walker { zones, steer: self.guide(), generation, sharing: false, ..*self };
        let picked = around.map(|around| Origin { around, picks, w: wi, density: next.density });
        tally.rays += 1;
        let hit = self.world.closest(start.origin, wi, f32::INFINITY);
        direct + next.weight * path.walk(start, hit, picked, sampler, tally)
    }

    /// More listed images than this have no cones at a vertex, and are picked one by one. Residuals are many and their vertices lie
    /// anywhere: a mixture costs each more than ten rays, and spends a third of them on images that bring a hundredth.
    pub(super) fn most_listed(&self) -> usize {
        if self.residual.share > 0.0 { 0 } else { MOST_LISTED }
    }

    /// Mean number of images picked at `s`.
    pub(super) fn picks_at(&self, s: &Surface) -> f32 {
        match self.guide().filter(|_| self.residual.share > 0.0) {
            Some(zones) => self.picks(zones.locate(self.world, s, [0.5; 2])),
            None => PATH_PICKS,
        }
    }

    /// Mean number of images picked at a vertex that lies in `place`.
    pub(super) fn picks(&self, place: ZonePlace) -> f32 {
        let caustic = self.guide().map_or(1.0, |zones| zones.caustic_share(place.zone, place.side));
        (PICKS * caustic).clamp(PICKS_WITHIN.0, PICKS_WITHIN.1)
    }

    /// Virtual luminaires at `s`, by single images of `around`, `picks` of them in the mean, weighted against the walk's own ray.
    pub(super) fn virtual_direct(
        &self,
        s: &Surface,
        bsdf: &Bsdf,
        guide: Option<&Guide>,
        (around, picks): (&Around, f32),
        wo: Vec3,
        depth: u32,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let mut sum = Rgb::BLACK;
        let shift = sampler.next1();
        // Every picks-th part of [0, 1) from a common start: a systematic sample, of picks in the mean where that is no whole number.
        let mut next = shift;
        while next < picks {
            let u = (next / picks).min(1.0 - f32::EPSILON);
            next += 1.0;
            let v = sampler.next2();
            let Some(picked) = around.pick(u, v) else { continue };
            let wi = s.frame.to_local(picked.w);
            if s.is_front(picked.w) != (wi.z > 0.0) {
                continue;
            }
            let f = bsdf.eval(wo, wi, Quantity::Radiance) * wi.z.abs();
            if f.is_black() {
                continue;
            }
            let own = bsdf.pdf_solid_angle(wo, wi);
            let own = guide.map_or(own, |g| g.density(picked.w, own));
            let density = picks * picked.density;
            let most = self.max_depth.min(super::LONGEST_WALK).saturating_sub(depth + 1);
            let from = s.leave(picked.w);
            let (met, likely) = radiance_by_chain(self.world, from, &picked, most, sampler, tally);
            if !met.is_black() {
                let weight = power_heuristic(density, own * likely);
                sum += f * met * (weight / (self.residual.density * density));
            }
        }
        sum
    }
}
