//! The gather: quadrature of the field radiance over the hemisphere at one visible point (report, equation 1).
//!
//! Strata of four kinds look for it: the chart of each lobe (the cosine-weighted disk for diffuse ones, visible normals for
//! glossy ones), the field radiance that light particles predict ([`crate::zones::field`]), cones around the virtual
//! luminaires and bright zones that particles have found ([`crate::zones::records`]), and shadow rays. A gather ray counts
//! BRDF × cosine × field radiance over the density of all strata, whichever it was drawn from (E. Veach's balance
//! heuristic on counts, 1997); shadow rays share luminaires with them by the power heuristic. What the strata are made
//! from never enters the estimate: where they are wrong they cost noise and no bias.
//! A [`Strategy`] decides the strata; everything else is shared.

mod draws;
mod sharing;

pub use draws::{Stratum, draws};
pub(crate) use sharing::{Found, share};

use crate::bsdf::{Bsdf, Lobe, LobeClass, MAX_LOBES, Transport as Quantity};
use crate::hints::Looks;
use crate::sampler::{PointSet, Sampler};
use crate::strategies::{self, Report};
use crate::transport::{Arrival, Start, Tally, Walker, power_heuristic};
use crate::world::Surface;
use crate::world::luminaire::Receiver;
use crate::wrong::{Wrong, makes};
use crate::zones::Zones;
use crate::zones::field::Prediction;
use crate::zones::records::{Cones, Lent};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// How the strata of a gather are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// A jittered grid on the unit square, anew in every pass. Unbiased.
    Jittered,
    /// Owen-scrambled Sobol' points that go on from pass to pass: every pass is stratified within itself and against
    /// the others. Unbiased. At equal rays 1.5 to 2.2 times less relMSE than `Jittered` on three test scenes.
    Sobol,
    /// The same points, and strata from light particles: the predicted field radiance ([`crate::zones::field`]) and cones
    /// around virtual luminaires and bright zones ([`crate::zones::records`]). Unbiased.
    #[default]
    Adaptive,
    /// One of the report's methods for diffuse reflection, `Sobol` for everything else.
    Report(Report),
}

impl Strategy {
    /// Every strategy with its name on the command line.
    pub const ALL: [(&'static str, Strategy); 3] =
        [("adaptive", Strategy::Adaptive), ("jittered", Strategy::Jittered), ("sobol", Strategy::Sobol)];

    /// The points of `n` gather rays.
    fn points(self, sampler: &mut Sampler, n: u32) -> PointSet {
        sampler.set(n, self == Strategy::Jittered)
    }
}

/// How much work one gather is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherPlan {
    /// Gather rays over all lobes.
    pub rays: u32,
    /// Shadow rays.
    pub shadow_rays: u32,
    /// Strata.
    pub strategy: Strategy,
}

impl GatherPlan {
    /// The plan for a vertex that counts only with factor `weight`: fewer rays, but never none.
    pub fn scaled(self, weight: f32) -> GatherPlan {
        let part = |n: u32| ((n as f32 * weight.clamp(0.0, 1.0).sqrt()).ceil() as u32).max(1);
        GatherPlan { rays: part(self.rays), shadow_rays: part(self.shadow_rays), ..self }
    }
}

/// The broad strata at a point: rays over each lobe's own chart, and over the predicted field radiance for diffuse ones.
struct Broad<'a> {
    /// Rays in the chart of each lobe: over all lobes in proportion to albedo, at least one.
    own: [u32; MAX_LOBES],
    /// Rays over the prediction.
    guided: u32,
    prediction: Option<Prediction<'a>>,
}

/// Share of a diffuse lobe's rays that is not left to the prediction where that covers another hemisphere; where it covers
/// the same, its even part is defence enough.
const OWN: f32 = 0.3;

/// Cosine between normals whose hemispheres count as one.
const SAME_HEMISPHERE: f32 = 0.9999;

impl<'a> Broad<'a> {
    fn new(steer: Option<&'a Zones>, s: &Surface, bsdf: &Bsdf, wo: Vec3, rays: u32) -> Broad<'a> {
        let mut broad = Broad { own: [0; MAX_LOBES], guided: 0, prediction: None };
        let smooth = |l: &&Lobe| l.kind() != LobeClass::Delta;
        let alone = bsdf.lobes().iter().filter(smooth).count() == 1;
        let all: f32 = bsdf.lobes().iter().filter(smooth).map(|l| l.albedo(wo).max()).sum();
        for (n, l) in broad.own.iter_mut().zip(bsdf.lobes()) {
            if l.kind() != LobeClass::Delta {
                let share = if alone || all <= 0.0 { 1.0 } else { l.albedo(wo).max() / all };
                *n = ((rays as f32 * share).ceil() as u32).max(1);
            }
        }
        let Some(zones) = steer else { return broad };
        let n = s.facing();
        broad.prediction = zones.field().near(s.p, n);
        if let Some(prediction) = &broad.prediction {
            let same = prediction.normal().dot(if s.is_front(s.wo) { s.frame.n } else { -s.frame.n })
                > SAME_HEMISPHERE;
            let kept = |n: u32| if same { 1 } else { ((n as f32 * OWN) as u32).max(1) };
            for (k, l) in bsdf.lobes().iter().enumerate() {
                if l.kind() == LobeClass::Diffuse && !l.is_transmissive() && broad.own[k] > 1 {
                    broad.guided += broad.own[k] - kept(broad.own[k]);
                    broad.own[k] = kept(broad.own[k]);
                }
            }
        }
        broad
    }
}

/// The surface radiance that the non-delta lobes at `s` send towards where the ray came from. Unbiased given the zones.
pub fn gather(
    walker: &Walker,
    s: &Surface,
    bsdf: &Bsdf,
    plan: &GatherPlan,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    if let Strategy::Report(method) = plan.strategy {
        return strategies::gather(walker, s, bsdf, plan, method, sampler, tally);
    }
    let gathered = gather_part(walker, s, bsdf, plan, Part::WHOLE, sampler, tally);
    tally.judge(&gathered, 1);
    gathered.whole
}

/// Which of its rays a gather traces at one of several places that share them, such as the places that a pixel spans: rays
/// `first`, `first` + `of`, and so on, of each stratum. The rays of all parts are stratified against one another where all draw them
/// from the same point sets. Each part alone is an unbiased gather of a fraction of the rays if `first` is equally
/// likely to be any of 0 … `of` − 1 (systematic sampling).
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// First ray.
    pub first: u32,
    /// Parts.
    pub of: u32,
}

impl Part {
    /// Every ray.
    pub const WHOLE: Part = Part { first: 0, of: 1 };

    /// The rays of this part, of `n` in all.
    fn rays(self, n: u32) -> impl Iterator<Item = u32> {
        (self.first..n).step_by(self.of as usize)
    }

    /// How many rays of `n` it has in the mean.
    fn mean(self, n: u32) -> f32 {
        n as f32 / self.of as f32
    }
}

/// What a gather, or a part of one, found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered {
    /// In all.
    pub whole: Rgb,
    /// By gather rays.
    pub by_rays: Rgb,
    /// The most that one ray brought (luminance), and how many rays there were.
    pub largest: f32,
    /// See `largest`.
    pub rays: u32,
    /// What they brought that had been scattered before (luminance).
    pub scattered: f64,
}

impl Gathered {
    /// Both, as parts of one gather.
    pub fn with(self, other: Gathered) -> Gathered {
        Gathered {
            whole: self.whole + other.whole,
            by_rays: self.by_rays + other.by_rays,
            largest: self.largest.max(other.largest),
            rays: self.rays + other.rays,
            scattered: self.scattered + other.scattered,
        }
    }
}

/// A part of a gather by any strategy but the report's, which counts for no surprise yet. Unbiased given
/// the zones if the part is drawn at random.
pub fn gather_part(
    walker: &Walker,
    s: &Surface,
    bsdf: &Bsdf,
    plan: &GatherPlan,
    part: Part,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Gathered {
    Point::new(walker, s, bsdf, plan, part).gather(sampler, tally)
}

/// One over the surface radiance that the zone at `s` expects, for walks whose residuals are to be shared out by what they bring; 0
/// where that is not asked for or not known.
fn worth(walker: &Walker, s: &Surface, bsdf: &Bsdf, wo: Vec3) -> f32 {
    match walker.zones {
        // A sensor is no part of any zone.
        Some(zones) if walker.residual.share > 0.0 && s.t > 0.0 && bsdf.has_diffuse() => {
            let expected = zones.reflected(&zones.locate(walker.world, s, [0.5, 0.5]), bsdf, wo).luminance();
            if expected > 0.0 { 1.0 / expected } else { 0.0 }
        }
        _ => 0.0,
    }
}

/// Cone rays over the plan's own, at least and at most.
type ConeShares = [f32; 2];

/// However little is known to come from images: with an eighth, filaments by curved mirrors had a third more error.
const LEAST_CONES: f32 = 0.25;

/// Those of a sensor: it is cautious until it has met enough of what shines by mirrors, so it asks in full.
const CAUTIOUS: ConeShares = [LEAST_CONES, 1.0];

/// Those of a surface: fewer the less of the flux there is `recorded`, for rays go by what they have to tell (J. Neyman 1934). The factor is a compromise
/// of the scenes it was tried in (docs/measurements.md, "Where the rays go and what they bring").
fn cone_shares(recorded: f32) -> ConeShares {
    [LEAST_CONES, (1.4 * recorded).clamp(LEAST_CONES, 1.0)]
}

/// As many as there are images, within `shares`; more where few rays meet the luminaire that they are for.
fn cone_rays(cones: &Cones, plan: &GatherPlan, shares: ConeShares) -> u32 {
    let need = |rays: f32| (rays * cones.need()).ceil() as u32;
    let [least, most] = shares.map(|share| plan.rays as f32 * share);
    let least = least.ceil() as u32;
    match cones.is_empty() {
        true => 0,
        false => need(cones.effective()).clamp(least, need(most).max(least)),
    }
}

/// A gather under way.
pub(crate) struct Point<'a> {
    walker: &'a Walker<'a>,
    s: &'a Surface,
    receiver: Receiver,
    bsdf: &'a Bsdf,
    wo: Vec3,
    broad: Broad<'a>,
    cones: Lent,
    cone_rays: u32,
    looks: Looks,
    plan: &'a GatherPlan,
    part: Part,
    /// See [`Start::worth`]: that of a ray of a whole gather whose BRDF × cosine over density is 1.
    worth: f32,
}

impl<'a> Point<'a> {
    /// The strata at `s`, nothing traced yet.
    pub(crate) fn new(
        walker: &'a Walker,
        s: &'a Surface,
        bsdf: &'a Bsdf,
        plan: &'a GatherPlan,
        part: Part,
    ) -> Point<'a> {
        let wo = s.frame.to_local(s.wo);
        let steer = walker.guide().filter(|_| plan.strategy == Strategy::Adaptive);
        let broad = Broad::new(steer, s, bsdf, wo, plan.rays);
        let cones = match steer {
            Some(zones) if !zones.records().is_empty() => Lent::new(zones.records(), s.p, s.facing()),
            _ => Lent::none(),
        };
        let shares = match &broad.prediction {
            Some(prediction) if s.t > 0.0 => cone_shares(prediction.recorded()),
            _ => CAUTIOUS,
        };
        let cone_rays = cone_rays(&cones, plan, shares);
        let receiver = Receiver::surface(s, bsdf);
        let looks = walker.world.hints.looks(&receiver, plan.rays);
        let rays = broad.own.iter().sum::<u32>() + broad.guided + cone_rays;
        let worth = rays as f32 * worth(walker, s, bsdf, wo);
        Point { walker, s, receiver, bsdf, wo, broad, cones, cone_rays, looks, plan, part, worth }
    }

    /// Trace all rays of the part.
    pub(crate) fn gather(&self, sampler: &mut Sampler, tally: &mut Tally) -> Gathered {
        let mut radiance = self.by_cones(sampler, tally);
        let by_shadow_rays = self.by_shadow_rays(sampler, tally);
        for (k, lobe) in self.bsdf.lobes().iter().enumerate() {
            if self.broad.own[k] > 0 {
                radiance += self.by_lobe(k, lobe, sampler, tally);
            }
        }
        radiance += self.by_prediction(sampler, tally);
        if !self.looks.cones().is_empty() {
            radiance += self.by_hints(sampler, tally);
            let hints = &self.walker.world.hints;
            hints.note_gather((radiance + by_shadow_rays).luminance() / self.part.of as f32);
        }
        tally.gathered_by(radiance, radiance + by_shadow_rays)
    }

    /// [`Start::worth`] of a ray of BRDF × cosine `f`, drawn with `density` rays per steradian.
    #[inline]
    fn worth(&self, f: Rgb, density: f32) -> f32 {
        f.luminance() / (density * self.part.of as f32) * self.worth
    }

    /// Rays of the part times density per steradian at world direction `w`, local `wi`, over all strata but the shadow rays.
    #[inline]
    fn density(&self, w: Vec3, wi: Vec3) -> f32 {
        let mut density = 0.0;
        for (k, lobe) in self.bsdf.lobes().iter().enumerate() {
            if self.broad.own[k] > 0 {
                density += self.broad.own[k] as f32 * lobe.pdf_solid_angle(self.wo, wi);
            }
        }
        let part = if makes(Wrong::Density) { 0.9 } else { 1.0 };
        if let Some(prediction) = &self.broad.prediction {
            density += part * self.broad.guided as f32 * prediction.pdf_solid_angle(w);
        }
        if self.cone_rays > 0 {
            density += part * self.cone_rays as f32 * self.cones.density(w);
        }
        (density + self.looks.density(w)) / self.part.of as f32
    }

    /// The part of one lobe's own chart.
    fn by_lobe(&self, k: usize, lobe: &Lobe, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let n = self.broad.own[k];
        let points = self.plan.strategy.points(sampler, n);
        let mut sum = Rgb::BLACK;
        for i in self.part.rays(n) {
            let Some(sample) = lobe.sample(self.wo, points.point(i), Quantity::Radiance) else { continue };
            let w = self.s.frame.to_world(sample.wi).normalize();
            sum += self.gather_ray(w, sample.wi, 0.0, &mut sampler.branch(i), tally);
        }
        sum
    }

    /// The part of the predicted field radiance.
    fn by_prediction(&self, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let Some(prediction) = &self.broad.prediction else { return Rgb::BLACK };
        let n = self.broad.guided;
        let points = self.plan.strategy.points(sampler, n);
        let mut sum = Rgb::BLACK;
        for i in self.part.rays(n) {
            let (w, _) = prediction.sample(points.point(i));
            sum += self.gather_ray(w, self.s.frame.to_local(w), 0.0, &mut sampler.branch(i), tally);
        }
        sum
    }

    /// The part of the cones, systematically over the mixture.
    fn by_cones(&self, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let n = self.cone_rays;
        let shift = sampler.next1();
        let points = self.plan.strategy.points(sampler, n.max(1));
        let mut sum = Rgb::BLACK;
        for i in self.part.rays(n) {
            let pick = (i as f32 + shift) / n as f32;
            let Some((w, missed)) = self.cones.sample(pick, points.point(i)) else { continue };
            let wi = self.s.frame.to_local(w);
            sum += self.gather_ray(w, wi, self.part.mean(n) * missed, &mut sampler.branch(i), tally);
        }
        sum
    }

    /// The part of the strata that hints ask for.
    fn by_hints(&self, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let mut sum = Rgb::BLACK;
        for cone in self.looks.cones() {
            let points = self.plan.strategy.points(sampler, cone.rays);
            let (mut brought, mut rays) = (Rgb::BLACK, 0);
            for i in self.part.rays(cone.rays) {
                let w = cone.sample(points.point(i));
                brought += self.gather_ray(w, self.s.frame.to_local(w), 0.0, &mut sampler.branch(i), tally);
                rays += 1;
            }
            self.walker.world.hints.note_look(cone, rays, brought.luminance() / self.part.of as f32);
            sum += brought;
        }
        sum
    }

    /// One gather ray along `w`: BRDF, cosine and field radiance over the density of all strata (the balance heuristic).
    /// `missed`: what the density lacks by rounding (rays per steradian).
    fn gather_ray(&self, w: Vec3, wi: Vec3, missed: f32, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        if self.s.is_front(w) != (wi.z > 0.0) {
            return Rgb::BLACK;
        }
        let f = self.bsdf.eval(self.wo, wi, Quantity::Radiance) * wi.z.abs();
        let density = self.density(w, wi) + missed;
        if f.is_black() || density <= 0.0 {
            return Rgb::BLACK;
        }
        let samples = self.part.mean(self.plan.shadow_rays);
        let arrival = Arrival::Shared { from: self.receiver, rays: density, samples };
        tally.density = density;
        let worth = self.worth(f, density);
        let start = Start { origin: self.s.leave(w), dir: w, arrival, depth: 1, worth };
        let value = f * self.walker.field_radiance(start, sampler, tally) * (1.0 / density);
        tally.brought(value, f.luminance() * tally.straight / density);
        value
    }

    /// Luminaires by shadow rays, stratified over luminaires and over their points.
    fn by_shadow_rays(&self, sampler: &mut Sampler, tally: &mut Tally) -> Rgb {
        let (s, world) = (self.s, self.walker.world);
        let m = self.plan.shadow_rays;
        let rays = self.part.mean(m);
        let shift = sampler.next1();
        let points = self.plan.strategy.points(sampler, m);
        let mut sum = Rgb::BLACK;
        for i in self.part.rays(m) {
            let u_pick = (i as f32 + shift) / m as f32;
            // Stride through the points so that each luminaire sees them well spread.
            let u = points.point(i);
            let Some(l) = world.luminaires.sample(&world.scene, &self.receiver, u_pick, u) else { continue };
            let wi = s.frame.to_local(l.wi);
            if s.is_front(l.wi) != (wi.z > 0.0) {
                continue;
            }
            let mut f = self.bsdf.eval(self.wo, wi, Quantity::Radiance);
            if f.is_black() {
                continue;
            }
            // What no ray meets is all the shadow rays'.
            if l.met_by_rays {
                f *= power_heuristic(rays * l.pdf_solid_angle, self.density(l.wi, wi));
            }
            tally.rays += 1;
            if !l.is_occluded(world, s) {
                sum += f * l.radiance * (wi.z.abs() / (l.pdf_solid_angle * rays));
            }
        }
        sum
    }
}
