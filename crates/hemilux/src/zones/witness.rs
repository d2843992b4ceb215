//! Witnesses: light particles that nothing was learnt from say how much of the light is hardly looked for.
//!
//! Directions at a point of a path are drawn by its own scattering and by the virtual luminaires that the particles of a solution have
//! left records of. Light that comes by mirrors and glass from where neither looks is met once in very many rays, and a reading that has
//! not met it has a narrow interval all the same. Fresh particles, traced like those of the solution but with random numbers of their
//! own, arrive in proportion to flux, whatever looks for them. The *weight* of an arrival is what a ray to its image would bring over
//! what the point receives: radiance × cosine over the density of drawing that ray, over the zone's irradiance. Light of weight W that is a
//! share f of all is met by n rays about n f / W times; where that is more than once the spread of a reading tells of it, elsewhere f is
//! what the reading lacks more often than not. This is the missing mass of I. J. Good 1953 ("The population frequencies of species"),
//! asked of held-out samples.
//!
//! The shares are means over the light of the scene: they hold for a place as typical as one that a particle was sent to. A place in a
//! reflection that hardly any light takes, where a solution lists nothing, has less of its light looked for than they say.
//!
//! Invariants: the shares do not depend on threads; with nothing learnt they are those of all small images.

use super::particles::{Bin, Deposits};
use super::records::Record;
use super::{ZoneMap, Zones};
use crate::world::World;
use hemilux_scene::Rgb;
use hemiquad::points::Key;
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Powers of two of a weight that are told apart.
const BINS: usize = 48;
/// A direction is drawn by the scattering, by the predicted field radiance and for an image with about this probability each.
const EACH: f32 = 1.0 / 3.0;
/// Witnesses to a solution.
pub(super) const COUNT: u64 = 1 << 18;
/// Stream of the witnesses.
const STREAM: u64 = 0x3177e55;

/// Shares of the light by the power of two of their weight, with the sums of the squares of what single particles have of them.
type Shares = [[f64; 2]; BINS];

/// What witnesses say.
#[derive(Clone, Copy, Debug)]
pub struct Witnesses {
    /// Of all light that arrives anywhere, what comes by mirrors and glass from luminaires that look small, where they are not listed.
    seen: Shares,
    /// Of the light that was scattered before, what once came so.
    scattered: Shares,
    /// Share of one particle in the light that was not scattered before.
    one: f64,
}

impl Witnesses {
    /// Trace `count` particles, and hold their arrivals against what `zones` lists and expects.
    pub fn call(world: &World, zones: &Zones, count: u64) -> Witnesses {
        let map = ZoneMap::new(world, 1);
        let mut deposits = Deposits::new(map.len(), world.luminaires.power(), None);
        let seed = Key::new(zones.particles).with(STREAM).bits64(0);
        deposits.trace(world, &map, [seed, count], count, |_| false);
        let sum = |bin: Bin| {
            let of = |side| Rgb(deposits.flux(side, bin).map(|f| f as f32)).luminance() as f64;
            (0..2 * map.len()).map(of).sum::<f64>()
        };
        let (straight, indirect) = (sum(Bin::Direct) + sum(Bin::Caustic), sum(Bin::Indirect));
        let all = (straight + indirect).max(f64::MIN_POSITIVE);
        // What of the straight light is scattered on, where all surfaces scatter alike: then light that was scattered has the shares of
        // the light it comes from.
        let scattered_on = (straight * indirect / all).max(f64::MIN_POSITIVE);
        let weighed: Vec<Weighed> =
            deposits.finds.records.par_iter().map(|r| weigh(world, zones, r)).collect();
        let (mut seen, mut scattered) = ([[0.0; 2]; BINS], [[0.0; 2]; BINS]);
        let add = |to: &mut Shares, bin: usize, share: f64| {
            to[bin][0] += share;
            to[bin][1] += share * share;
        };
        for w in weighed {
            let bin = (w.weight.max(1.0).log2() as usize).min(BINS - 1);
            add(&mut seen, bin, w.unlisted / all);
            add(&mut scattered, bin, w.scattered / scattered_on);
        }
        let power = world.luminaires.power();
        Witnesses { seen, scattered, one: power / straight.max(f64::MIN_POSITIVE) }
    }

    /// The share of the light at a place that `rays` rays from there to virtual luminaires are likely to have met too seldom.
    pub fn unseen(&self, rays: f64) -> f64 {
        missed(&self.seen, rays)
    }

    /// The share of the light that was scattered before which so many rays are likely to have met too seldom behind the scattering.
    pub fn unseen_later(&self, rays: f64) -> f64 {
        missed(&self.scattered, rays)
    }

    /// The share of all light on the scene's surfaces of which nothing is known, for no witness has seen any of it: three particles (95 %, the rule of three).
    pub fn unknown(&self) -> f64 {
        3.0 * self.one
    }
}

/// What witnesses saw of light that is met too seldom by `rays` rays, and two standard errors.
fn missed(shares: &Shares, rays: f64) -> f64 {
    let met = |bin: usize, share: f64| rays * share >= 2f64.powi(bin as i32 + 1);
    let missed = shares.iter().enumerate().filter(|(bin, share)| !met(*bin, share[0]));
    let [share, squares] = missed.fold([0.0; 2], |sum, (_, s)| [sum[0] + s[0], sum[1] + s[1]]);
    (share + 2.0 * squares.sqrt()).min(1.0)
}

/// An arrival: its weight, its flux, what of it is scattered on.
struct Weighed {
    weight: f32,
    unlisted: f64,
    scattered: f64,
}

/// What a ray back along an arrival would bring, over what its place receives.
fn weigh(world: &World, zones: &Zones, r: &Record) -> Weighed {
    let flux = r.flux as f64;
    // From a little way back towards the interface that it met last.
    let back = world.closest(r.p + r.dir * (1e-3 * r.reach[0]), -r.dir, f32::INFINITY);
    let Some(at) = back else { return Weighed { weight: f32::INFINITY, unlisted: flux, scattered: flux } };
    let place = zones.locate(world, &at, [0.5; 2]);
    let receives = zones.irradiance(place.zone, place.side).luminance();
    let cos = r.n.dot(r.dir).max(0.0);
    let listed = zones.records().around(r.p, r.n).map_or(0.0, |around| around.density(r.signature, r.dir));
    let predicted = zones.field().near(r.p, r.n).map_or(0.0, |field| field.pdf_solid_angle(r.dir));
    let density = EACH * (cos * FRAC_1_PI + listed + predicted);
    let albedo = world.bsdf(&at).albedo(at.frame.to_local(at.wo)).luminance().min(1.0) as f64;
    Weighed {
        weight: r.strength * cos / (density * receives).max(f32::MIN_POSITIVE),
        unlisted: if listed > 0.0 { 0.0 } else { flux },
        scattered: albedo * flux,
    }
}
