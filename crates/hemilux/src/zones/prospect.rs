//! Prospectors: particles that leave the bright zones for every flat piece of mirrors and glass, for the records alone.
//!
//! Ordinary particles go where the flux goes, so the image of a bright zone in a facet that it sees aslant has no record, though
//! a ray that meets it brings as much as one that meets any other. Here each pair of a bright zone and a facet gets its share, whatever
//! flux goes that way; where a chain has flat mirrors alone, one record says all of its image (the image method, [`super::records::Exact`]).
//!
//! Invariants: nothing is deposited in zones; the records are a function of world, map, bright zones and the number of particles.

use super::bright::Bright;
use super::map::ZoneMap;
use super::particles::{Finds, Source};
use super::records::Record;
use super::scouts::specular;
use crate::bsdf::Transport as Quantity;
use crate::world::outline::Outline;
use crate::world::{Surface, World};
use hemilux_scene::geom::Vec3;
use hemiquad::points::{Key, sobol};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f32::consts::PI;

/// For each pair, ...
const EACH: u64 = 64;
/// ... but no more in all.
const MOST: u64 = 1 << 16;
/// Records kept of each signature.
const KEPT: u32 = 4;
/// Sent as one unit of work.
const CHUNK: u64 = 1024;
/// Longest chain that is followed.
const LONGEST: u32 = 12;
/// Of the flux that goes their way their records have so much: ordinary particles bring most of it already.
const PART: f32 = 0.25;
/// A zone sends them if it gives off so many times as much as the mean surface receives: a gather has tens of rays, and what brings one of
/// them less than that is no more than its share.
const OUTSHINES: f32 = 100.0;
/// How far before a facet the way back to the zone begins, over the length of the way.
const BEFORE: f32 = 1e-4;

/// Send them, and add what they find to `finds`; `particles` have gone before.
pub(super) fn send(world: &World, map: &ZoneMap, bright: &Bright, particles: u64, finds: &mut Finds) {
    let zones = Flat::of(bright);
    if zones.is_empty() {
        return;
    }
    let facets = world.flat_casters();
    let pairs = facets.len() as u64 * zones.len() as u64;
    if pairs == 0 {
        return;
    }
    let count = (EACH * pairs).min(MOST);
    let key = Key::new(0x9205_9ec7);
    let all = Sending { world, map, bright, zones, facets, key, count, particles };
    let starts: Vec<u64> = (0..count).step_by(CHUNK as usize).collect();
    let found: Vec<Finds> = starts
        .par_iter()
        .map(|&start| {
            let mut found = Finds::default();
            (start..(start + CHUNK).min(count)).for_each(|i| all.one(i, &mut found));
            found
        })
        .collect();
    let mut kept: HashMap<u32, u32> = HashMap::new();
    let mut is_new = |r: &Record| {
        let kept = kept.entry(r.signature).or_default();
        *kept += 1;
        *kept <= KEPT
    };
    for found in found {
        finds.zone_records.extend(found.zone_records.into_iter().filter(&mut is_new));
        for (signature, exact) in found.exact {
            finds.exact.entry(signature).or_insert(exact);
        }
    }
}

/// A flat bright zone: a zone side of it, and its outline.
struct Flat {
    side: u32,
    outline: Outline,
    /// By radiance × area, with those before it.
    cumulative: f64,
}

impl Flat {
    fn of(bright: &Bright) -> Vec<Flat> {
        let mut all: Vec<Flat> = Vec::new();
        let mut sum = 0.0;
        for source in bright.sources() {
            let shines = source.radiance * PI > OUTSHINES * bright.mean();
            if let Some(outline) = source.outline.filter(|_| shines) {
                sum += (source.radiance * outline.area()) as f64;
                all.push(Flat { side: source.name, outline, cumulative: sum });
            }
        }
        all
    }
}

struct Sending<'a> {
    world: &'a World,
    map: &'a ZoneMap,
    bright: &'a Bright,
    zones: Vec<Flat>,
    facets: Vec<Outline>,
    key: Key,
    count: u64,
    particles: u64,
}

impl Sending<'_> {
    /// The zone and the facet of number `i`, and how probable they are among the pairs.
    fn pair(&self, i: u64) -> (&Flat, &Outline, f64) {
        let pairs = self.facets.len() as u64 * self.zones.len() as u64;
        if self.count == EACH * pairs {
            let (zone, facet) = (i / EACH / self.facets.len() as u64, i / EACH % self.facets.len() as u64);
            return (&self.zones[zone as usize], &self.facets[facet as usize], 1.0 / pairs as f64);
        }
        // Facets in turn, or every so many of them; zones by power.
        let all = self.facets.len() as u64;
        let turn =
            if all > self.count { (i as u128 * all as u128 / self.count as u128) as u64 } else { i % all };
        let facet = &self.facets[turn as usize];
        let all = self.zones.last().map_or(0.0, |z| z.cumulative);
        let pick = self.key.with(1).with(i).uniform64(0) * all;
        let k = self.zones.partition_point(|z| z.cumulative <= pick).min(self.zones.len() - 1);
        let before = if k == 0 { 0.0 } else { self.zones[k - 1].cumulative };
        let share = if all > 0.0 { (self.zones[k].cumulative - before) / all } else { 0.0 };
        (&self.zones[k], facet, share / self.facets.len() as f64)
    }

    /// Send number `i`.
    fn one(&self, i: u64, finds: &mut Finds) {
        let (zone, facet, probability) = self.pair(i);
        let (from, to) = (sobol(i as u32, self.key.with(2)), sobol(i as u32, self.key.with(3)));
        let (p, q) = (zone.outline.point([from.u, from.v]), facet.point([to.u, to.v]));
        let back = p - q;
        let distance = back.length();
        let Some(back) = back.try_normalize() else { return };
        // Nothing in the way, and the lit side: asked from the facet, for the zone's outline may reach past the zone.
        let Some(s) = self.world.closest(q + back * (BEFORE * distance), back, f32::INFINITY) else { return };
        if s.t < (1.0 - 100.0 * BEFORE) * distance {
            return;
        }
        let place = self.map.locate(self.world, &s, [0.5; 2]);
        let side = place.zone * 2 + place.side;
        let Some(source) = self.bright.of(side).filter(|source| source.name == zone.side) else { return };
        let wo = s.frame.to_local(s.wo);
        let albedo = self.world.bsdf(&s).diffuse_albedo(wo).luminance();
        if source.radiance * albedo * PI < OUTSHINES * self.bright.mean() {
            return;
        }
        let across = facet.normal().dot(back).abs() * facet.area() / (distance * distance);
        let power = source.radiance * albedo * zone.outline.area() * wo.z.abs() * across;
        let flux = PART * power * (self.particles as f64 / (probability * self.count as f64)) as f32;
        if flux > 0.0 && flux.is_finite() {
            self.follow(i, &s, -back, Source::of_bright(source, None, false, albedo, p), flux, finds);
        }
    }

    /// From `s` along unit `dir` to where the chain ends.
    fn follow(&self, i: u64, s: &Surface, mut dir: Vec3, mut source: Source, flux: f32, finds: &mut Finds) {
        let numbers = self.key.with(4).with(i);
        let mut origin = s.leave(dir);
        for depth in 0..LONGEST {
            let Some(s) = self.world.closest(origin, dir, f32::INFINITY) else { return };
            let bsdf = self.world.bsdf(&s);
            if !bsdf.has_delta() {
                if depth > 0 && bsdf.has_non_delta() {
                    finds.record(&s, &source, true, flux);
                }
                return;
            }
            let u = [0, 1, 2].map(|k| numbers.uniform(3 * depth + k));
            let Some((on, wi, next)) = specular(self.world, &s, Quantity::Flux, u) else { return };
            source.pass(self.world, &s, &bsdf, wi, &next);
            (origin, dir) = (on, wi);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::records::{Cones, Records};
    use super::super::{Making, ZoneOptions};
    use super::*;
    use crate::validate::scenes::{diffuse, emission, empty, material, quad, sphere};
    use crate::world::outline::mirrored;
    use hemilux_scene::{ConductorFresnel, FloatParam, MaterialKind, Rgb, RgbParam, Roughness};

    /// Over a floor, a lamp close above a dark card, and 400 facets on a dome around it that show the card to one spot of the floor each. Those
    /// at the rim see it aslant. With the middle of the card.
    fn card_and_facets() -> (World, Vec3) {
        let mut scene = empty();
        let (floor, dark) = (diffuse(&mut scene, 0.6), diffuse(&mut scene, 0.08));
        let smooth = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
        let fresnel = ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::splat(0.9)));
        let shiny = material(&mut scene, MaterialKind::Conductor { fresnel, roughness: smooth });
        quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], floor, None);
        sphere(&mut scene, [0.0, 0.0, 1.03], 0.004, false, dark, emission(4e5));
        quad(&mut scene, [-0.03, -0.03, 1.0], [0.06, 0.0, 0.0], [0.0, 0.06, 0.0], dark, None);
        let card = Vec3::new(0.0, 0.0, 1.0);
        let key = Key::new(5);
        for i in 0..400 {
            let u = |d: u32| key.with(i).uniform(d);
            let (up, turn) = (0.05 + 0.85 * u(0), 2.0 * PI * u(1));
            let out = (1.0 - up * up).sqrt();
            let at = card + Vec3::new(out * turn.cos(), out * turn.sin(), up) * 0.5;
            let spot = Vec3::new(2.0 * u(2) - 1.0, 2.0 * u(3) - 1.0, 0.0);
            let n = ((card - at).normalize() + (spot - at).normalize()).normalize();
            let side = n.any_orthonormal_vector() * 0.03;
            let corner = (at - 0.5 * (side + n.cross(side))).to_array();
            quad(&mut scene, corner, side.to_array(), n.cross(side).to_array(), shiny, None);
        }
        (World::new(scene), card)
    }

    /// Directions from `x` in which the middle of the card is seen in a facet.
    fn images(world: &World, x: Vec3, card: Vec3) -> Vec<Vec3> {
        let seen = |facet: &Outline| {
            let n = facet.normal();
            let image = mirrored(card, facet.corner, n);
            let w = (image - x).normalize();
            let mirror = world.closest(x, w, f32::INFINITY)?;
            let on = w - mirror.ng * (2.0 * mirror.ng.dot(w));
            let met = world.closest(mirror.leave(on), on, f32::INFINITY)?;
            (mirror.p.z > 1.01 && (met.p - card).length() < 1e-3).then_some(w)
        };
        world.flat_casters().iter().filter_map(seen).collect()
    }

    #[test]
    fn images_of_a_bright_zone_are_known_wherever_they_are_seen() {
        let (world, card) = card_and_facets();
        let options = ZoneOptions { budget: 2000, particles: 1 << 16, seed: 1 };
        let mut making = Making::new(&world, &options, None);
        making.trace(options.particles, |_| false);
        let plain = making.deposits.finds.clone();
        let mut more = plain.clone();
        send(&world, &making.map, making.deposits.bright(), options.particles, &mut more);
        let covered = |mut finds: Finds| {
            finds.records.append(&mut finds.zone_records);
            let records = Records::new(finds.records, &finds.exact);
            let mut counts = [0, 0];
            for i in 0..400 {
                let spot = Key::new(9).with(i).uniform2(0);
                let x = Vec3::new(2.0 * spot.u - 1.0, 2.0 * spot.v - 1.0, 1e-4);
                let cones = Cones::new(&records, x, Vec3::Z);
                for w in images(&world, x, card) {
                    counts[0] += 1;
                    counts[1] += (cones.density(w) > 0.0) as u32;
                }
            }
            counts
        };
        let [seen, known] = covered(more);
        assert!(seen > 300 && known as f64 > 0.98 * seen as f64, "{known} of {seen}");
        // Negative control: ordinary particles alone leave some out.
        let [_, before] = covered(plain);
        assert!((before as f64) < 0.9 * seen as f64, "{before} of {seen} without prospectors");
    }
}
