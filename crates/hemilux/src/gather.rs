//! The gather: quadrature of the field radiance over the hemisphere at one visible point (report, equation 1).
//!
//! Every lobe of the BRDF is integrated in its own chart of the unit square: the cosine-weighted disk for diffuse ones,
//! visible normals for glossy ones. Luminaires are sampled by shadow rays; a gather ray that meets a luminaire first
//! thing shares it with them by the power heuristic on counts. A luminaire at the end of a specular chain is a *virtual
//! luminaire*: besides the broad strata, cones around the images that light particles have found near the point
//! ([`crate::zones::records`]) are sampled for it, and both share it by the power heuristic. The cones come from particles
//! alone, never from values that enter the estimate, so they cost noise where they are wrong and no bias.
//! A [`Strategy`] decides the broad strata; everything else is shared.

use crate::bsdf::{Bsdf, BsdfSample, Lobe, LobeClass, Transport as Quantity};
use crate::sampler::{PointSet, Sampler};
use crate::strategies::{self, Report};
use crate::transport::{Arrival, Start, Tally, Walker, power_heuristic};
use crate::world::Surface;
use crate::zones::records::{Cone, MOST};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// How the strata of a gather are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// A jittered grid on the unit square, anew in every pass. Unbiased.
    Jittered,
    /// Owen-scrambled Sobol' points that go on from pass to pass: every pass is stratified within itself and against
    /// the others. Unbiased. At equal rays 1.5 to 2.2 times less relMSE than `Jittered` on three test scenes.
    #[default]
    Sobol,
    /// One of the report's methods for diffuse reflection, `Sobol` for everything else.
    Report(Report),
}

impl Strategy {
    /// Every strategy with its name on the command line.
    pub const ALL: [(&'static str, Strategy); 2] =
        [("jittered", Strategy::Jittered), ("sobol", Strategy::Sobol)];

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

/// Rays that each lobe of a BSDF receives: in proportion to its albedo, at least one.
struct Shares {
    rays: [u32; crate::bsdf::MAX_LOBES],
}

impl Shares {
    fn new(bsdf: &Bsdf, wo: Vec3, rays: u32) -> Shares {
        let mut shares = Shares { rays: [0; crate::bsdf::MAX_LOBES] };
        let smooth = bsdf.lobes().iter().filter(|l| l.kind() != LobeClass::Delta).count();
        if smooth == 1 {
            for (n, l) in shares.rays.iter_mut().zip(bsdf.lobes()) {
                *n = if l.kind() == LobeClass::Delta { 0 } else { rays };
            }
            return shares;
        }
        let all: f32 =
            bsdf.lobes().iter().filter(|l| l.kind() != LobeClass::Delta).map(|l| l.albedo(wo).max()).sum();
        for (n, l) in shares.rays.iter_mut().zip(bsdf.lobes()) {
            if l.kind() != LobeClass::Delta {
                let share = if all > 0.0 { l.albedo(wo).max() / all } else { 1.0 };
                *n = ((rays as f32 * share).ceil() as u32).max(1);
            }
        }
        shares
    }

    /// Give no rays to some lobes; whether any lobe keeps some.
    fn leave_out(&mut self, bsdf: &Bsdf, out: impl Fn(&Lobe) -> bool) -> bool {
        for (n, l) in self.rays.iter_mut().zip(bsdf.lobes()) {
            if out(l) {
                *n = 0;
            }
        }
        self.rays.iter().any(|n| *n > 0)
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
    let wo = s.frame.to_local(s.wo);
    let mut shares = Shares::new(bsdf, wo, plan.rays);
    let mut reported = Rgb::BLACK;
    if let Strategy::Report(method) = plan.strategy {
        reported = strategies::gather_diffuse(walker, s, bsdf, wo, method, plan.rays, sampler, tally);
        if !shares.leave_out(bsdf, |lobe| strategies::is_handled(lobe, wo)) {
            return reported;
        }
    }
    let cones = Cones::new(walker, s, plan);
    let mut radiance = virtual_luminaires(walker, s, bsdf, wo, &shares, &cones, plan, sampler, tally);
    radiance += reported + shadow_rays(walker, s, bsdf, wo, &shares, plan, sampler, tally);
    for (k, lobe) in bsdf.lobes().iter().enumerate() {
        let n = shares.rays[k];
        if n == 0 {
            continue;
        }
        let points = plan.strategy.points(sampler, n);
        let mut sum = Rgb::BLACK;
        for i in 0..n {
            let Some(sample) = lobe.sample(wo, points.point(i), Quantity::Radiance) else { continue };
            let mut branch = sampler.branch(i);
            sum += gather_ray(walker, s, &sample, n, &cones, plan.shadow_rays, &mut branch, tally);
        }
        radiance += sum * (1.0 / n as f32);
    }
    radiance
}

/// One gather ray: the field radiance along it, times BRDF and cosine over density.
fn gather_ray(
    walker: &Walker,
    s: &Surface,
    sample: &BsdfSample,
    n: u32,
    cones: &Cones,
    shadow_rays: u32,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    let wi = s.frame.to_world(sample.wi).normalize();
    if s.is_front(wi) != (sample.wi.z > 0.0) || sample.weight.is_black() {
        return Rgb::BLACK;
    }
    let arrival = Arrival::Shared { from: s.p, rays: n as f32 * sample.pdf, samples: shadow_rays as f32 };
    let other = cones.rays as f32 * cones.density(wi);
    let chain = power_heuristic(n as f32 * sample.pdf, other);
    let start = Start { origin: s.leave(wi), dir: wi, arrival, depth: 1, chain };
    sample.weight * walker.field_radiance(start, sampler, tally)
}

/// The cones of the virtual luminaires expected at a point: a mixture of directions.
struct Cones {
    cones: [Cone; MOST],
    count: usize,
    /// Samples to take.
    rays: u32,
}

impl Cones {
    fn new(walker: &Walker, s: &Surface, plan: &GatherPlan) -> Cones {
        let empty = Cone { axis: Vec3::Z, height: 1.0, share: 0.0 };
        let mut all = Cones { cones: [empty; MOST], count: 0, rays: 0 };
        let Some(zones) = walker.zones else { return all };
        if zones.records().is_empty() {
            return all;
        }
        let n = if s.is_front(s.wo) { s.ng } else { -s.ng };
        let (mut previous, mut kept) = (0.0, 0.0);
        for candidate in zones.records().near(s.p, n) {
            let cone = candidate.cone(s.p, previous);
            previous = candidate.cumulative();
            if cone.axis.dot(n) > 0.0 {
                all.cones[all.count] = cone;
                all.count += 1;
                kept += cone.share;
            }
        }
        all.cones[..all.count].iter_mut().for_each(|c| c.share /= kept);
        if all.count > 0 {
            // As many as there are images, within what the gather may cost.
            all.rays = (all.count as u32).clamp(plan.rays.div_ceil(4), plan.rays * 2).max(1);
        }
        all
    }

    /// Density per steradian of the mixture at `w`.
    #[inline]
    fn density(&self, w: Vec3) -> f32 {
        self.cones[..self.count].iter().filter(|c| c.contains(w)).map(|c| c.share * c.density()).sum()
    }

    /// The cone that holds `u` of the mixture.
    fn pick(&self, u: f32) -> &Cone {
        let mut left = u;
        for cone in &self.cones[..self.count] {
            if left < cone.share {
                return cone;
            }
            left -= cone.share;
        }
        &self.cones[self.count - 1]
    }
}

/// Virtual luminaires by sampling the cones, systematically over the mixture, each lobe weighted against its own gather
/// rays.
fn virtual_luminaires(
    walker: &Walker,
    s: &Surface,
    bsdf: &Bsdf,
    wo: Vec3,
    shares: &Shares,
    cones: &Cones,
    plan: &GatherPlan,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    let shift = sampler.next1();
    let points = plan.strategy.points(sampler, cones.rays.max(1));
    let mut sum = Rgb::BLACK;
    for i in 0..cones.rays {
        let u = (i as f32 + shift) / cones.rays as f32;
        let w = cones.pick(u).sample(points.point(i));
        let wi = s.frame.to_local(w);
        if s.is_front(w) != (wi.z > 0.0) {
            continue;
        }
        let here = cones.rays as f32 * cones.density(w);
        let mut f = Rgb::BLACK;
        for (k, lobe) in bsdf.lobes().iter().enumerate() {
            if shares.rays[k] > 0 {
                let gathered = shares.rays[k] as f32 * lobe.pdf_solid_angle(wo, wi);
                f += lobe.eval(wo, wi, Quantity::Radiance) * power_heuristic(here, gathered);
            }
        }
        if f.is_black() || here <= 0.0 {
            continue;
        }
        let mut branch = sampler.branch(i);
        let radiance = walker.virtual_radiance(s.leave(w), w, &mut branch, tally);
        sum += f * radiance * (wi.z.abs() / here);
    }
    sum
}

/// Luminaires by shadow rays, stratified over luminaires and over their points, each lobe weighted against its own
/// gather rays.
fn shadow_rays(
    walker: &Walker,
    s: &Surface,
    bsdf: &Bsdf,
    wo: Vec3,
    shares: &Shares,
    plan: &GatherPlan,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    let m = plan.shadow_rays;
    let shift = sampler.next1();
    let points = plan.strategy.points(sampler, m);
    let mut sum = Rgb::BLACK;
    for i in 0..m {
        let u_pick = (i as f32 + shift) / m as f32;
        // Stride through the points so that each luminaire sees them well spread.
        let u = points.point(i);
        let Some(l) = walker.world.luminaires.sample(&walker.world.scene, s.p, u_pick, u) else { continue };
        let wi = s.frame.to_local(l.wi);
        if s.is_front(l.wi) != (wi.z > 0.0) {
            continue;
        }
        let mut f = Rgb::BLACK;
        for (k, lobe) in bsdf.lobes().iter().enumerate() {
            if shares.rays[k] == 0 {
                continue;
            }
            let weight = if l.met_by_rays {
                let gathered = shares.rays[k] as f32 * lobe.pdf_solid_angle(wo, wi);
                power_heuristic(m as f32 * l.pdf_solid_angle, gathered)
            } else {
                1.0
            };
            f += lobe.eval(wo, wi, Quantity::Radiance) * weight;
        }
        if f.is_black() {
            continue;
        }
        tally.rays += 1;
        if !l.is_occluded(walker.world, s) {
            sum += f * l.radiance * (wi.z.abs() / (l.pdf_solid_angle * m as f32));
        }
    }
    sum
}
