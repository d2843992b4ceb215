//! Virtual luminaires sampled as luminaires are, by a ray of their own at each vertex of a path.
//!
//! Where light particles list hundreds of images, a path cannot afford the mixture of all their cones at every vertex. Instead it
//! (and a residual everywhere) picks single images ([`crate::zones::records`]), sends a ray into the cone of each and follows mirrors and glass; what the ray meets counts
//! only if its specular chain is that image's, so nothing else need be known of the density. The path's own ray may come by the same
//! chain, and both share it by the power heuristic: two ways to one path, as with shadow rays (E. Veach and L. Guibas 1995). At a
//! vertex where nothing is picked, and for chains that are not listed, the path's own ray counts in full.
//!
//! Invariants: an [`Origin`] weighs a chain by the same densities whichever way found it; the sum of both weights is 1.

use crate::bsdf::Transport as Quantity;
use crate::sampler::Sampler;
use crate::transport::{Tally, power_heuristic};
use crate::world::luminaire::NO_LUMINAIRE;
use crate::world::{Surface, World};
use crate::zones::records::Around;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::points::Key;

/// Interfaces of a chain at most: longer ones have no name.
const LONGEST: usize = 12;

/// The mirrors and glass met since a vertex.
#[derive(Clone, Copy)]
pub(crate) struct Chain {
    met: [(u64, bool); LONGEST],
    length: usize,
}

impl Chain {
    pub const fn new() -> Chain {
        Chain { met: [(0, false); LONGEST], length: 0 }
    }

    /// Go through the interface at `s`.
    pub fn pass(&mut self, world: &World, s: &Surface, transmitted: bool) {
        if let Some(slot) = self.met.get_mut(self.length) {
            *slot = (world.patch(s), transmitted);
        }
        self.length += 1;
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
            Some(name) => power_heuristic(self.density, self.picks * self.around.density(name, self.w)),
            None => 1.0,
        }
    }
}

/// What a ray from `origin` along unit `w` meets by the specular chain called `name`, of `most` interfaces at most; every choice at
/// glass is taken at random.
pub(crate) fn radiance_by_chain(
    world: &World,
    (mut origin, mut w): (Vec3, Vec3),
    name: u32,
    most: u32,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    let mut chain = Chain::new();
    let mut beta = Rgb::WHITE;
    loop {
        tally.rays += 1;
        let is_meant = |chain: &Chain, i: u32| chain.name(world, i) == Some(name);
        let Some(s) = world.closest(origin, w, f32::INFINITY) else {
            let skies = world.luminaires.sky_radiance(&world.scene, origin, w);
            let met = skies.filter(|(r, i)| !r.is_black() && is_meant(&chain, *i));
            return met.map(|(r, _)| beta * r).fold(Rgb::BLACK, |a, b| a + b);
        };
        if s.luminaire != NO_LUMINAIRE && is_meant(&chain, s.luminaire) {
            return beta * world.luminaires.radiance(&world.scene, s.luminaire, s.ng, s.uv, s.wo);
        }
        if chain.length >= LONGEST.min(most as usize) {
            return Rgb::BLACK;
        }
        let bsdf = world.bsdf(&s);
        if !bsdf.has_delta() {
            return Rgb::BLACK;
        }
        let wo = s.frame.to_local(s.wo);
        let branches = || bsdf.lobes().iter().flat_map(|l| l.branches(wo, Quantity::Radiance)).flatten();
        let all: f32 = branches().map(|b| b.weight.max()).sum();
        let mut left = sampler.next1() * all;
        let chosen = branches().find(|b| {
            left -= b.weight.max();
            left < 0.0
        });
        let Some(branch) = chosen else { return Rgb::BLACK };
        let wi = s.frame.to_world(branch.wi).normalize();
        if s.is_front(wi) != (branch.wi.z > 0.0) {
            return Rgb::BLACK;
        }
        beta *= branch.weight * (all / branch.weight.max());
        chain.pass(world, &s, branch.transmitted);
        (origin, w) = (s.leave(wi), wi);
    }
}
