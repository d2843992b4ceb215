//! Virtual luminaires sampled as luminaires are, by a ray of their own at each vertex of a path.
//!
//! Where light particles list hundreds of images, a path cannot afford the mixture of all their cones at every vertex. Instead it
//! (and a residual everywhere) picks single images ([`crate::zones::records`]), sends a ray into the cone of each and follows mirrors and glass the
//! way that the image's chain goes: where glass reflects 4 % the ray is reflected and brings 4 %. What it meets counts
//! only if its specular chain is that image's, so nothing else need be known of the density. The path's own ray may come by the same
//! chain, and both share it by the power heuristic: two ways to one path, as with shadow rays (E. Veach and L. Guibas 1995), where the
//! own ray's density falls with every choice at glass that the chain asks of it. At a vertex where nothing is picked, and for chains
//! that are not listed, the path's own ray counts in full.
//!
//! Invariants: an [`Origin`] weighs a chain by the same densities whichever way found it; the sum of both weights is 1.

use crate::bsdf::{Branch, Bsdf, Transport as Quantity};
use crate::sampler::Sampler;
use crate::transport::{Tally, power_heuristic};
use crate::world::luminaire::NO_LUMINAIRE;
use crate::world::{Surface, World};
use crate::zones::records::{Around, Picked};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::points::Key;

/// Interfaces of a chain at most: longer ones have no name.
pub(crate) const LONGEST: usize = 12;

/// The mirrors and glass met since a vertex.
#[derive(Clone, Copy)]
pub(crate) struct Chain {
    met: [(u64, bool); LONGEST],
    length: usize,
    /// How probable the ways taken are, for a ray that goes either way by what it brings.
    likely: f32,
}

impl Chain {
    pub const fn new() -> Chain {
        Chain { met: [(0, false); LONGEST], length: 0, likely: 1.0 }
    }

    /// Go on at the interface `s`, through it or reflected, which a ray that chooses does with probability `likely` ([`likelihood`]).
    pub fn pass(&mut self, world: &World, s: &Surface, transmitted: bool, likely: f32) {
        self.likely *= likely;
        if let Some(slot) = self.met.get_mut(self.length) {
            *slot = (world.patch(s), transmitted);
        }
        self.length += 1;
    }

    /// Number of interfaces.
    pub fn length(&self) -> usize {
        self.length
    }

    /// The name of the chain's signature where it ends on luminaire `i`: what particles that come the other way call it.
    pub fn name(&self, world: &World, i: u32) -> Option<u32> {
        let met = self.met.get(..self.length).filter(|m| !m.is_empty())?;
        let (name, ..) = world.luminaires.identity(&world.scene, i)?;
        let forward = met.iter().rev();
        let key = forward
            .fold(Key::new(name as u64), |key, (patch, through)| key.with(*patch).with(*through as u64));
        Some(key.bits(0))
    }
}

/// A vertex whose images are sampled, and what its own ray set out with.
#[derive(Clone, Copy)]
pub(crate) struct Origin<'a> {
    /// What is listed there.
    pub around: Around<'a>,
    /// Picks.
    pub picks: f32,
    /// Unit direction of the path's own ray, and its density over solid angle.
    pub w: Vec3,
    pub density: f32,
}

impl Origin<'_> {
    /// What luminaire `i` counts where the path's own ray meets it by `chain`.
    pub fn share(&self, world: &World, chain: &Chain, i: u32) -> f32 {
        match chain.name(world, i) {
            Some(name) => {
                let picks = self.picks * self.around.density(name, self.w);
                power_heuristic(self.density * chain.likely, picks)
            }
            None => 1.0,
        }
    }
}

/// Interfaces of a chain at which a ray goes both ways where there are two.
pub(crate) const FORKS: usize = 4;

/// The weaker of two ways is followed so many times as often as it would be by what it brings.
const OFTENER: f32 = 8.0;

/// Both ways at a surface that is glass and nothing else, each with the probability that it is followed, whatever becomes of the
/// other; `None` elsewhere. What is weak brings little when it is followed, so that no ray brings all of a luminaire by the 4 % that glass
/// reflects (splitting: compare J. Arvo and D. Kirk 1990).
pub(crate) fn fork(bsdf: &Bsdf, wo: Vec3) -> Option<[(Branch, f32); 2]> {
    match bsdf.lobes() {
        [glass] => match glass.branches(wo, Quantity::Radiance) {
            [Some(a), Some(b)] => {
                let all = a.weight.max() + b.weight.max();
                let followed = |branch: Branch| (branch, (OFTENER * branch.weight.max() / all).min(1.0));
                (all > 0.0).then(|| [followed(a), followed(b)])
            }
            _ => None,
        },
        _ => None,
    }
}

/// How probable it is that a path's own ray goes through the surface, or is reflected, where mirrors and glass send it on: by what either way
/// brings, after so many interfaces; where it may go both ways, how probable that one is.
pub(crate) fn likelihood(bsdf: &Bsdf, wo: Vec3, transmitted: bool, passed: usize) -> f32 {
    if passed < FORKS
        && let Some(ways) = fork(bsdf, wo)
    {
        return ways.iter().filter(|w| w.0.transmitted == transmitted).map(|w| w.1).sum();
    }
    let (mut meant, mut all) = (0.0, 0.0);
    for b in bsdf.branches(wo, Quantity::Radiance) {
        let weight = b.weight.max();
        all += weight;
        meant += if b.transmitted == transmitted { weight } else { 0.0 };
    }
    if all > 0.0 { meant / all } else { 1.0 }
}

/// What a ray from `origin` along the direction `picked` meets by the chain it is meant for, of `most` interfaces at most, and how
/// probable that chain is for a ray that chooses its ways ([`likelihood`]).
pub(crate) fn radiance_by_chain(
    world: &World,
    mut origin: Vec3,
    picked: &Picked,
    most: u32,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> (Rgb, f32) {
    let (mut w, mut turns) = (picked.w, picked.turns);
    if turns.count().is_none_or(|n| n > most) {
        return (Rgb::BLACK, 1.0);
    }
    let mut chain = Chain::new();
    let mut beta = Rgb::WHITE;
    let is_meant = |chain: &Chain, i: u32| chain.name(world, i) == Some(picked.name);
    loop {
        tally.rays += 1;
        let hit = world.closest(origin, w, f32::INFINITY);
        let Some((transmitted, others)) = turns.split_last() else {
            let met = match hit {
                Some(s) if s.luminaire != NO_LUMINAIRE && is_meant(&chain, s.luminaire) => {
                    world.luminaires.radiance(&world.scene, s.luminaire, s.ng, s.uv, s.wo)
                }
                Some(_) => Rgb::BLACK,
                None => {
                    let skies = world.luminaires.sky_radiance(&world.scene, origin, w);
                    let met = skies.filter(|(r, i)| !r.is_black() && is_meant(&chain, *i));
                    met.map(|(r, _)| r).fold(Rgb::BLACK, |a, b| a + b)
                }
            };
            return (beta * met, chain.likely);
        };
        let Some(s) = hit else { return (Rgb::BLACK, 1.0) };
        let bsdf = world.bsdf(&s);
        let wo = s.frame.to_local(s.wo);
        let meant = || bsdf.branches(wo, Quantity::Radiance).filter(|b| b.transmitted == transmitted);
        // One, as a rule.
        let all: f32 = meant().map(|b| b.weight.max()).sum();
        let mut left = sampler.next1() * all;
        let chosen = meant().find(|b| {
            left -= b.weight.max();
            left < 0.0
        });
        let Some(branch) = chosen else { return (Rgb::BLACK, 1.0) };
        let wi = s.frame.to_world(branch.wi).normalize();
        if s.is_front(wi) != (branch.wi.z > 0.0) {
            return (Rgb::BLACK, 1.0);
        }
        beta *= branch.weight * (all / branch.weight.max());
        chain.pass(world, &s, transmitted, likelihood(&bsdf, wo, transmitted, chain.length));
        (origin, w, turns) = (s.leave(wi), wi, others);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::sensor_surface;
    use crate::transport::{Start, Walker};
    use crate::validate::scenes::{diffuse, emission, empty, material, quad, sphere};
    use crate::zones::{ZoneOptions, Zones};
    use hemilux_scene::MaterialKind;

    const LOW: f32 = 100.0;
    const HIGH: f32 = 40.0;

    /// A floor, a pane of glass 1 m above it, a lamp between them and one above the pane, each of 5 cm.
    fn pane_and_lamps() -> (World, Zones) {
        let mut scene = empty();
        let floor = diffuse(&mut scene, 0.5);
        let pane = material(&mut scene, MaterialKind::ThinDielectric { eta: 1.5 });
        quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], floor, None);
        quad(&mut scene, [-2.0, -2.0, 1.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], pane, None);
        sphere(&mut scene, [0.6, 0.0, 0.5], 0.05, false, floor, emission(LOW));
        sphere(&mut scene, [0.0, 0.0, 2.0], 0.05, false, floor, emission(HIGH));
        let world = World::new(scene);
        let zones = Zones::solve_seen(
            &world,
            &ZoneOptions { budget: 400, particles: 1 << 16, seed: 3 },
            None,
            |_| false,
        );
        (world, zones)
    }

    /// A ray that chose its way at the pane would bring all of a lamp, or nothing: eight times in a hundred for the reflected one.
    #[test]
    fn picked_rays_go_the_way_of_their_chain() {
        let (world, zones) = pane_and_lamps();
        let s = sensor_surface(Vec3::new(0.1, 0.1, 1e-4), Vec3::Z);
        let around = zones.records().around(s.p, Vec3::Z).expect("images");
        let (mut reflected, mut passed) = (Vec::new(), Vec::new());
        for i in 0..2000 {
            let mut sampler = Sampler::new(5, i, 0);
            let (u, v) = (sampler.next1(), sampler.next2());
            let Some(picked) = around.pick(u, v) else { continue };
            let Some((through, _)) = picked.turns.split_last() else { panic!("no interface") };
            let tally = &mut Tally::default();
            let (met, likely) = radiance_by_chain(&world, s.p, &picked, 8, &mut sampler, tally);
            if through { &mut passed } else { &mut reflected }.push((met.luminance(), likely));
        }
        for (met, lamp, part) in [(&reflected, LOW, 0.0768), (&passed, HIGH, 0.9232)] {
            let hits: Vec<_> = met.iter().filter(|m| m.0 > 0.0).collect();
            assert!(hits.len() > 100 && 2 * hits.len() > met.len(), "{} of {}", hits.len(), met.len());
            // A pane at up to 40 degrees: 7.7 % at normal incidence, 8.2 % there.
            for (met, likely) in hits {
                assert!((met / lamp - part).abs() < 0.02, "{met} of {lamp}");
                let own = (OFTENER * part).min(1.0);
                assert!((likely / own - 1.0).abs() < 0.1, "{likely}");
            }
        }
    }

    /// One that chose would bring the lamp above the pane, or nothing.
    #[test]
    fn gather_rays_and_paths_that_pick_go_both_ways() {
        let (world, zones) = pane_and_lamps();
        let x = Vec3::new(0.0, 0.0, 1e-4);
        let around = zones.records().around(x, Vec3::Z).expect("images");
        let (w, density) = (Vec3::Z, 3.0);
        let picked = Origin { around, picks: 1.0, w, density };
        let arrival = crate::transport::Arrival::Full;
        let walker = Walker { max_depth: 2, ..Walker::path(&world) };
        let mut chain = Chain::new();
        let pane = world.closest(x, w, f32::INFINITY).expect("the pane");
        chain.pass(&world, &pane, true, 1.0);
        let lamp = world.closest(pane.leave(w), w, f32::INFINITY).expect("the lamp");
        let expected = HIGH * 0.9232 * picked.share(&world, &chain, lamp.luminaire);
        assert!(expected > 0.0);
        let brought = |walker: &Walker, picked: Option<Origin>, i: u64| {
            let start = Start { origin: x, dir: w, arrival, depth: 1, worth: 0.0 };
            let hit = world.closest(x, w, f32::INFINITY);
            let mut sampler = Sampler::new(7, i, 0);
            walker.walk(start, hit, picked, &mut sampler, &mut Tally::default()).luminance()
        };
        for i in 0..64 {
            let by_lamp = brought(&walker, Some(picked), i);
            assert!((by_lamp / expected - 1.0).abs() < 0.01, "{by_lamp} for {expected}");
        }
        // So does a gather ray, which ends on the floor's zones by the other one.
        let gathers = Walker::zonal(&world, &zones);
        for i in 0..64 {
            let by_lamp = brought(&gathers, None, i);
            assert!((0.92..0.98).contains(&(by_lamp / HIGH)), "{by_lamp}");
        }
        // Negative control: a plain path chooses.
        assert!((0..64).any(|i| brought(&walker, None, i) == 0.0));
    }
}
