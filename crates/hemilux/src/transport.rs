//! Following one ray: the reference path tracer, and the gather ray that ends on zones. One walk serves both.
//!
//! Without zones this is a unidirectional path tracer with luminaire sampling (Kajiya 1986), the two ways of reaching a
//! luminaire weighted by the power heuristic (Veach and Guibas 1995), ended by Russian roulette: unbiased.
//! With zones a walk ends at the first vertex that scatters diffusely and lies farther than about two zone radii: there
//! the diffuse part of the surface radiance is the zone's, and only narrower lobes go on. **Biased by the zones.**
//! A vertex closer than that does not trust its zone: it takes the zone's caustic bin (from luminaires, and from bright zones), samples
//! luminaires, and goes on for a bounce, which counts neither where it comes to them by mirrors and glass.
//! With a [`Residual`] the bias goes: at a vertex that ends on a zone the walk goes on as a path with probability q, and
//! (path − zone) / q is added, whose expectation is what the zone gets wrong; a vertex that does not trust its zone takes
//! nothing from it. Unbiased for the whole light transport, whatever the zones are. Paths that light particles can lead (a
//! solution at hand, and no zone to end on) draw their directions from a [`crate::guide`].
//!
//! A luminaire at the end of a chain of mirrors and glass is hundreds of times brighter than what such a chain is worth elsewhere, so no chance
//! decides whether a weak chain is followed: gather rays, and paths that pick images, go both ways at the first interfaces of glass
//! ([`fork`]), and roulette leaves short chains alone.

mod correction;

use crate::bsdf::{Branch, Bsdf, Transport as Quantity};
use crate::gather::{Found, Gathered};
use crate::guide::{Guide, Next, images};
use crate::images::{Chain, FORKS, Origin, fork, likelihood};
use crate::sampler::Sampler;
use crate::world::luminaire::{NO_LUMINAIRE, Receiver};
use crate::world::{Surface, World};
use crate::zones::Zones;
use correction::End;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// A zone is trusted from this many of its radii on.
pub const ZONE_TRUST: f32 = 2.0;
/// Scattering events before Russian roulette may end a walk.
const ROULETTE_FROM: u32 = 3;
/// Nor does it end a chain of mirrors and glass that is no longer.
const UNJUDGED: usize = 8;
/// No walk is longer; reached with probability below 1e-20 unless nothing absorbs.
const LONGEST_WALK: u32 = 4096;

/// What walks cost and found.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Rays traced.
    pub rays: u64,
    /// Luminaires (or sky) of at least luminance `bright` met at the end of a specular chain from the start of a walk.
    pub chain_hits: u64,
    /// The same after a further scattering that is not specular: there nothing leads to them but chance.
    pub later_hits: u64,
    /// What counts as bright (W·sr⁻¹·m⁻²).
    pub bright: f32,
    /// Luminance of all gathers, and the part of it that came as surprise ([`Tally::judge`]).
    pub gathered: f64,
    /// See `gathered`.
    pub surprise: f64,
    /// The part of `gathered` that was scattered before it came to the gather's rays.
    pub scattered: f64,
    /// Gather rays, each with its whole chain.
    pub samples: u64,
    /// The most that one ray of the present gather brought (luminance), and how many rays it had.
    pub(crate) largest: f32,
    pub(crate) gather_rays: u32,
    /// What the present walk met before it was scattered, and what rays of the present gather brought that was scattered before (luminance).
    pub(crate) straight: f32,
    scattered_now: f64,
    /// Residuals that are to be shared, and the rays per steradian with which the present gather ray was drawn.
    pub(crate) found: Vec<Found>,
    pub(crate) density: f32,
}

/// A ray that brings more than this many times the mean of its gather went where the strata expected little.
const SURPRISING: f32 = 10.0;

impl Tally {
    /// A ray of the present gather brought `value` (over its density), of which `straight` had not been scattered.
    pub(crate) fn brought(&mut self, value: Rgb, straight: f32) {
        self.scattered_now += (value.luminance() - straight) as f64;
        self.largest = self.largest.max(value.luminance());
        self.gather_rays += 1;
        self.samples += 1;
    }

    /// A gather or a part of one is over: `by_rays` came by gather rays, `whole` in all.
    pub(crate) fn gathered_by(&mut self, by_rays: Rgb, whole: Rgb) -> Gathered {
        let (largest, rays, scattered) = (self.largest, self.gather_rays, self.scattered_now);
        (self.largest, self.gather_rays, self.scattered_now) = (0.0, 0, 0.0);
        Gathered { whole, by_rays, largest, rays, scattered }
    }

    /// Count a gather, the sum of `parts`. Were the strata perfect, every ray would
    /// bring the same; what one brings beyond [`SURPRISING`] times the mean came from where they expected less than a tenth
    /// of what there was, and counts as surprise.
    pub(crate) fn judge(&mut self, gathered: &Gathered, parts: u32) {
        let (sum, whole) = (gathered.by_rays.luminance(), gathered.whole.luminance());
        let each = 1.0 / parts as f64;
        if whole.is_finite() {
            self.gathered += whole as f64 * each;
            self.scattered += gathered.scattered * each;
            if gathered.largest * gathered.rays as f32 > SURPRISING * sum {
                self.surprise += gathered.largest as f64 * each;
            }
        }
    }

    fn note(&mut self, in_chain: bool, later: bool, met: Rgb) {
        let hit = (in_chain && !met.is_black() && met.luminance() >= self.bright) as u64;
        *(if later { &mut self.later_hits } else { &mut self.chain_hits }) += hit;
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
        from: Receiver,
        /// Number of rays times their density per solid angle.
        rays: f32,
        /// Number of luminaire samples there.
        samples: f32,
    },
    /// Not at all: something else has it already.
    None,
    /// Not at all, nor at the end of a specular chain.
    Unlit,
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

/// How walks that end on a zone make up for what the zone gets wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Probability q that such a walk goes on as a path, in [0, 1]; 0: never, the zones' bias stays.
    pub share: f32,
    /// What the residual counts: 1. Anything else is wrong, and serves the tests to see that they notice.
    pub weight: f32,
    /// What the density of a single image's ray ([`crate::images`]) is multiplied by where its value is divided by it: 1, or wrong.
    pub density: f32,
}

impl Residual {
    /// No residuals.
    pub const NONE: Residual = Residual { share: 0.0, weight: 1.0, density: 1.0 };

    /// Residuals with probability `share`.
    pub fn new(share: f32) -> Residual {
        Residual { share, ..Residual::NONE }
    }
}

/// Everything a walk needs to know.
#[derive(Clone, Copy)]
pub struct Walker<'a> {
    /// The scene.
    pub world: &'a World,
    /// Where walks may end; `None`: path tracing.
    pub zones: Option<&'a Zones>,
    /// What steers gathers, and paths behind them, where that is not `zones`: its records and predicted field radiance cost
    /// noise or save it, and change no mean.
    pub steer: Option<&'a Zones>,
    /// Limit on scattering events (path tracing only).
    pub max_depth: u32,
    /// What makes up for the zones' bias.
    pub residual: Residual,
    /// How many residuals this walk is within.
    pub generation: u32,
    /// Whether gather rays that end straight on a zone leave their residuals in the [`Tally`], for their gatherer to deal out.
    pub sharing: bool,
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
    /// What a unit of radiance counts, in units of what one ray of its gather is expected to bring: residuals are shared out by
    /// it. 0 where that is not known: then all walks are alike.
    pub worth: f32,
}

impl<'a> Walker<'a> {
    /// A path tracer without limit.
    pub fn path(world: &'a World) -> Walker<'a> {
        Walker {
            world,
            zones: None,
            steer: None,
            max_depth: u32::MAX,
            residual: Residual::NONE,
            generation: 0,
            sharing: false,
        }
    }

    /// The solution that steers gathers.
    pub fn guide(&self) -> Option<&'a Zones> {
        self.steer.or(self.zones)
    }

    /// The solution that leads walks that go on as paths; those that end on zones for good are left alone.
    fn leads(&self) -> Option<&'a Zones> {
        match self.zones {
            None => self.steer,
            Some(_) if self.residual.share > 0.0 => self.guide(),
            Some(_) => None,
        }
    }

    /// Walks that end on zones.
    pub fn zonal(world: &'a World, zones: &'a Zones) -> Walker<'a> {
        Walker { zones: Some(zones), ..Walker::path(world) }
    }

    /// An estimate of the field radiance that arrives along `start`, W·sr⁻¹·m⁻². Adds what it traces and finds to `tally`.
    pub fn field_radiance(&self, start: Start, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        tally.rays += 1;
        tally.straight = 0.0;
        let (origin, dir) = (start.origin, start.dir);
        let Some(hit) = self.world.closest_hit(origin, dir, f32::INFINITY) else {
            return self.field_radiance_from(start, None, sampler, tally);
        };
        // Most gather rays end at once, on a plain zone: the same as below, with the same numbers.
        if let (Some(zones), Some((reflectance, front))) = (self.zones, self.world.plain(&hit, dir)) {
            let mut ahead = sampler.clone();
            let place = zones.map().locate_triangle(&hit, front, ahead.next2());
            if hit.t >= ZONE_TRUST * place.radius {
                let zonal =
                    reflectance * zones.irradiance(place.zone, place.side) * std::f32::consts::FRAC_1_PI;
                let albedo = reflectance.luminance();
                if self.residual.share <= 0.0
                    || !self.has_residual(zones, place, zonal, albedo, start.worth, &ahead)
                {
                    return zonal;
                }
            }
        }
        let surface = self.world.surface_behind(hit, origin, dir, f32::INFINITY);
        self.field_radiance_from(start, surface, sampler, tally)
    }

    /// The same, given what the first ray meets.
    pub fn field_radiance_from(
        &self,
        start: Start,
        hit: Option<Surface>,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        self.walk(start, hit, None, sampler, tally)
    }

    /// The same; `picked`: the vertex it starts from, if images were picked there.
    pub(crate) fn walk(
        &self,
        start: Start,
        hit: Option<Surface>,
        picked: Option<Origin<'a>>,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let Start { origin, dir, arrival, depth, .. } = start;
        let way = Way {
            origin,
            dir,
            hit,
            arrival,
            depth,
            picked,
            beta: Rgb::WHITE,
            after_chain: Rgb::WHITE,
            in_chain: false,
            chain: Chain::new(),
            travelled: 0.0,
            later: depth > 1,
            worth: 1.0,
        };
        self.follow(way, start.worth, sampler, tally)
    }

    /// What comes along `way`. `unit`: [`Start::worth`] of the walk.
    fn follow(&self, mut way: Way<'a>, unit: f32, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let mut radiance = Rgb::BLACK;
        loop {
            let Some(s) = way.hit else {
                let sky = match way.picked.filter(|_| way.in_chain) {
                    Some(from) => self.sky_by(way.origin, way.dir, |i| from.share(self.world, &way.chain, i)),
                    None => self.sky(way.origin, way.dir, way.arrival),
                };
                radiance += way.brings(sky, tally);
                break;
            };
            way.travelled += s.t;
            if s.luminaire != NO_LUMINAIRE {
                let mut emission = self.emission(&s, way.arrival);
                if let Some(from) = way.picked.filter(|_| way.in_chain) {
                    emission *= from.share(self.world, &way.chain, s.luminaire);
                }
                radiance += way.brings(emission, tally);
            }
            if way.depth >= self.max_depth.min(LONGEST_WALK) {
                break;
            }
            let bsdf = self.world.bsdf(&s);
            let wo = s.frame.to_local(s.wo);
            if way.in_chain && way.after_chain != Rgb::WHITE && self.is_bright(&s, &bsdf) {
                way.beta *= way.after_chain;
                if way.beta.is_black() {
                    break;
                }
            }
            let (zonal, going_on) = self.end_on_zone(
                &s,
                &bsdf,
                wo,
                way.travelled,
                way.depth,
                unit * way.beta.max(),
                sampler,
                tally,
            );
            radiance += way.beta * zonal;
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
            let at = Receiver::surface(&s, on);
            let most = self.most_listed();
            let guide = match going_on {
                GoingOn::All => self.leads().and_then(|zones| Guide::new(zones, &s, on, most)),
                GoingOn::WithoutCaustic => {
                    self.guide().and_then(|zones| Guide::without_images(zones, &s, on))
                }
                _ => None,
            };
            let around = match going_on {
                GoingOn::All => self.leads().and_then(|zones| images(zones, &s, on, most)),
                _ => None,
            };
            let around = around.map(|around| (around, self.picks_at(&s)));
            if on.has_non_delta() {
                radiance += way.beta * self.direct(&s, &at, on, guide.as_ref(), wo, sampler, tally);
            }
            if let Some((around, picks)) = &around {
                let found = self.virtual_direct(
                    &s,
                    on,
                    guide.as_ref(),
                    (around, *picks),
                    wo,
                    way.depth,
                    sampler,
                    tally,
                );
                radiance += way.beta * found;
            }
            let forks =
                (way.picked.is_some() || self.zones.is_some() && !way.later) && way.chain.length() < FORKS;
            if forks && let Some(ways) = fork(on, wo) {
                radiance += self.both_ways(&s, ways, way, unit, sampler, tally);
                break;
            }
            let Some(next) = sample(&s, on, guide.as_ref(), wo, sampler) else { break };
            let wi = s.frame.to_world(next.wi).normalize();
            // Shading normals must not carry radiance through the surface.
            if s.is_front(wi) != (next.wi.z > 0.0) {
                break;
            }
            let before = way.beta.max();
            way.beta *= next.weight;
            // Refraction squeezes radiance and lets it go again: no reason to die in between.
            way.worth *= match guide.is_some() && !next.delta {
                true => on.albedo(wo).max(),
                false => way.beta.max() / before * next.eta * next.eta,
            };
            way.depth += 1;
            if next.delta {
                way.in_chain = true;
                let likely = match way.picked {
                    Some(_) => likelihood(&bsdf, wo, next.transmitted, way.chain.length()),
                    None => 1.0,
                };
                way.chain.pass(self.world, &s, next.transmitted, likely);
                way.arrival = if let Arrival::Unlit = way.arrival { way.arrival } else { Arrival::Full };
            } else {
                way.arrival = Arrival::Shared { from: at, rays: next.density, samples: 1.0 };
                way.in_chain = false;
                way.chain = Chain::new();
                way.picked =
                    around.map(|(around, picks)| Origin { around, picks, w: wi, density: next.density });
                way.travelled = 0.0;
                way.later = true;
                way.after_chain = match going_on {
                    GoingOn::WithoutCaustic => narrow_share(on, wo, next.wi),
                    _ => Rgb::WHITE,
                };
            }
            if way.beta.is_black() {
                break;
            }
            let exempt = next.delta && way.chain.length() <= UNJUDGED;
            if !exempt && !roulette(&mut way.beta, &mut way.worth, way.depth, sampler) {
                break;
            }
            (way.origin, way.dir) = (s.leave(wi), wi);
            tally.rays += 1;
            way.hit = self.world.closest(way.origin, way.dir, f32::INFINITY);
        }
        radiance
    }

    /// What comes along `way` by both ways at glass at `s`, where it has come.
    fn both_ways(
        &self,
        s: &Surface,
        ways: [(Branch, f32); 2],
        way: Way<'a>,
        unit: f32,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let mut radiance = Rgb::BLACK;
        for (branch, followed) in ways {
            let wi = s.frame.to_world(branch.wi).normalize();
            let is_taken = followed >= 1.0 || sampler.next1() < followed;
            if !is_taken || s.is_front(wi) != (branch.wi.z > 0.0) {
                continue;
            }
            let weight = branch.weight * (1.0 / followed);
            let (origin, mut chain) = (s.leave(wi), way.chain);
            chain.pass(self.world, s, branch.transmitted, followed);
            tally.rays += 1;
            let on = Way {
                origin,
                dir: wi,
                hit: self.world.closest(origin, wi, f32::INFINITY),
                arrival: if let Arrival::Unlit = way.arrival { way.arrival } else { Arrival::Full },
                depth: way.depth + 1,
                beta: way.beta * weight,
                in_chain: true,
                chain,
                worth: way.worth * weight.max() * branch.eta * branch.eta,
                ..way
            };
            radiance += self.follow(on, unit, sampler, tally);
        }
        radiance
    }

    /// Radiance of the skies at `origin` along `dir`, weighted.
    pub(crate) fn sky(&self, origin: Vec3, dir: Vec3, arrival: Arrival) -> Rgb {
        self.sky_by(origin, dir, |i| match arrival {
            Arrival::Full => 1.0,
            Arrival::None | Arrival::Unlit => 0.0,
            Arrival::Shared { from, rays, samples } => {
                let other = self.world.luminaires.sky_pdf(&self.world.scene, i, &from, dir);
                power_heuristic(rays, samples * other)
            }
        })
    }

    /// The same with `share` of each sky.
    fn sky_by(&self, origin: Vec3, dir: Vec3, share: impl Fn(u32) -> f32) -> Rgb {
        let mut sum = Rgb::BLACK;
        for (radiance, i) in self.world.luminaires.sky_radiance(&self.world.scene, origin, dir) {
            if !radiance.is_black() {
                sum += radiance * share(i);
            }
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
            Arrival::None | Arrival::Unlit => Rgb::BLACK,
            Arrival::Shared { from, rays, samples } => {
                let distance = (s.p - from.p).length();
                let other = luminaires.pdf_solid_angle(s.luminaire, &from, -s.wo, distance, s.ng);
                radiance * power_heuristic(rays, samples * other)
            }
        }
    }

    /// Whether `s` scatters and lies on a bright zone.
    fn is_bright(&self, s: &Surface, bsdf: &Bsdf) -> bool {
        let scatters = bsdf.has_non_delta();
        scatters && self.zones.is_some_and(|z| z.is_bright(z.locate(self.world, s, [0.5; 2]).zone))
    }

    /// The zone's share of the surface radiance at `s`, and what must still be followed.
    fn end_on_zone(
        &self,
        s: &Surface,
        bsdf: &Bsdf,
        wo: Vec3,
        travelled: f32,
        depth: u32,
        worth: f32,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> (Rgb, GoingOn) {
        let Some(zones) = self.zones else { return (Rgb::BLACK, GoingOn::All) };
        if !bsdf.has_diffuse() {
            return (Rgb::BLACK, GoingOn::All);
        }
        let jitter = sampler.next2();
        let place = zones.locate(self.world, s, jitter);
        if travelled >= ZONE_TRUST * place.radius {
            let zonal = zones.reflected(&place, bsdf, wo);
            let end = End { s, bsdf, wo, place, zonal, depth, worth };
            (zonal + self.residual(zones, &end, sampler, tally), GoingOn::NarrowLobes)
        } else if self.residual.share > 0.0 {
            (Rgb::BLACK, GoingOn::All)
        } else {
            (zones.reflected_caustic(&place, bsdf, wo), GoingOn::WithoutCaustic)
        }
    }

    /// One luminaire sample at `s`, weighted against sampling the scattering, or the mixture that `guide` makes of it.
    fn direct(
        &self,
        s: &Surface,
        at: &Receiver,
        bsdf: &Bsdf,
        guide: Option<&Guide>,
        wo: Vec3,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let (u_pick, u) = (sampler.next1(), sampler.next2());
        let Some(l) = self.world.luminaires.sample(&self.world.scene, at, u_pick, u) else {
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
            let own = bsdf.pdf_solid_angle(wo, wi);
            power_heuristic(l.pdf_solid_angle, guide.map_or(own, |g| g.density(l.wi, own)))
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

/// Where a walk has come.
#[derive(Clone, Copy)]
struct Way<'a> {
    origin: Vec3,
    dir: Vec3,
    /// What it meets.
    hit: Option<Surface>,
    arrival: Arrival,
    depth: u32,
    /// The vertex it last scattered at, if images were picked there.
    picked: Option<Origin<'a>>,
    beta: Rgb,
    /// What a luminaire or a bright zone counts, per band, once the ray has passed a mirror or glass: all of it, unless a
    /// zone's caustic bin holds the same.
    after_chain: Rgb,
    in_chain: bool,
    /// Since the walk last scattered; its length (m) so far.
    chain: Chain,
    travelled: f32,
    /// Whether the walk has left the gather's own ray behind.
    later: bool,
    /// What the walk would weigh, were its directions drawn by scattering alone: roulette by `beta` would end just those
    /// that were led to something bright.
    worth: f32,
}

impl Way<'_> {
    /// What it brings of what `shines` where it has come.
    fn brings(&self, shines: Rgb, tally: &mut Tally) -> Rgb {
        let counts = if self.in_chain { self.after_chain } else { Rgb::WHITE };
        let brought = self.beta * counts * shines;
        tally.note(self.in_chain, self.later, shines);
        if !self.later {
            tally.straight += brought.luminance();
        }
        brought
    }
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

/// The next direction at `s`: by scattering alone, or by the mixture that `guide` makes of it.
#[inline]
fn sample(s: &Surface, bsdf: &Bsdf, guide: Option<&Guide>, wo: Vec3, sampler: &mut Sampler) -> Option<Next> {
    match guide {
        Some(guide) => guide.sample(s, bsdf, wo, sampler),
        None => {
            let (u_lobe, u) = (sampler.next1(), sampler.next2());
            let next = bsdf.sample(wo, u_lobe, u, Quantity::Radiance)?;
            Some(Next {
                wi: next.wi,
                weight: next.weight,
                density: next.pdf,
                delta: next.delta,
                transmitted: next.transmitted,
                eta: next.eta,
            })
        }
    }
}

/// Russian roulette by what the walk is worth; survivors are scaled up.
#[inline]
fn roulette(beta: &mut Rgb, worth: &mut f32, depth: u32, sampler: &mut Sampler) -> bool {
    if depth < ROULETTE_FROM {
        return true;
    }
    let survive = worth.min(0.95);
    if sampler.next1() >= survive {
        return false;
    }
    *beta *= 1.0 / survive;
    *worth /= survive;
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::scenes::{diffuse, emission, empty, material, quad};
    use hemilux_scene::{ConductorFresnel, FloatParam, MaterialKind, RgbParam, Roughness};

    /// Two mirrors of a tenth or a seventh face one another; a ray goes up between them, five times from one to the other, to a lamp.
    #[test]
    fn weak_mirrors_are_followed_to_a_lamp() {
        let mut scene = empty();
        let smooth = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
        let fresnel = ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::splat(0.1)));
        let dim = material(&mut scene, MaterialKind::Conductor { fresnel, roughness: smooth });
        let dark = diffuse(&mut scene, 0.0);
        quad(&mut scene, [0.0, -5.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 5.0], dim, None);
        quad(&mut scene, [1.0, -5.0, 0.0], [0.0, 0.0, 5.0], [0.0, 10.0, 0.0], dim, None);
        quad(&mut scene, [-1.0, -5.0, 5.5], [0.0, 10.0, 0.0], [3.0, 0.0, 0.0], dark, emission(3e6));
        let world = World::new(scene);
        let dir = Vec3::new(1.0, 0.0, 1.0).normalize();
        let start =
            Start { origin: Vec3::new(0.5, 0.0, 0.1), dir, arrival: Arrival::Full, depth: 1, worth: 0.0 };
        let one = |i| {
            let mut sampler = Sampler::new(3, i, 0);
            Walker::path(&world).field_radiance(start, &mut sampler, &mut Tally::default()).luminance()
        };
        // A tenth at normal incidence, up to a seventh at this one. Ended by what they are worth, nine rays in ten would bring nothing.
        assert!((30.0..180.0).contains(&one(0)), "{}", one(0));
        for i in 1..64 {
            assert!((one(i) / one(0) - 1.0).abs() < 1e-5, "{} and {}", one(i), one(0));
        }
    }
}
