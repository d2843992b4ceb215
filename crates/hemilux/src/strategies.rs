//! The report's strategies in the gather: every method of [`hemiquad`] that makes sense there, over the hemisphere at one point
//! (P. Shirley and K. Chiu, "Notes on Adaptive Quadrature on the Hemisphere", 1994, sections 3 to 5).
//!
//! The domain is the unit square that the report's map ([`Concentric`]) carries to the hemisphere; the integrand is
//! 2π f cos θ times the field radiance, luminaires and all, so that cells are weighted by size and BRDF · cos θ as the report
//! has it. Luminaires and casters are known as cones around their [balls](crate::world::balls), virtual luminaires as the cones of
//! the zonal solution's records. Enlarged luminaires are balls that keep their intensity, met by a ray on its specular chain or
//! not at all.
//!
//! One-stage methods are biased and belong to the family `report1994:`.

use crate::bsdf::{Bsdf, Lobe, LobeClass, Transport as Quantity};
use crate::gather::{self, GatherPlan, Strategy};
use crate::hints::CriterionHint;
use crate::sampler::Sampler;
use crate::transport::{Arrival, Start, Tally, Walker};
use crate::world::balls::Ball;
use crate::world::luminaire::Receiver;
use crate::world::{Surface, World};
use crate::zones::Zones;
use crate::zones::records::Cones;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::map::{Concentric, Map};
use hemiquad::method::*;
use hemiquad::partition::Parent;
use hemiquad::{Criterion, Dir, Estimate, Integrand, Key, Probe, Region, Shape, Size, Workspace};
use std::cell::RefCell;
use std::f32::consts::PI;

/// A method over the hemisphere at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// Jittered over the whole hemisphere, luminaires in the integrand. Unbiased. (For comparison; the plain strategy
    /// `jittered` samples each lobe in its own chart and luminaires by shadow rays.)
    Uniform,
    /// Luminaires by one mixture of their cones, the rest by itself (Shirley and Wang 1991). Unbiased.
    Luminaires,
    /// Luminaires by falling potential until the rest cannot matter (Ward 1991). **Biased.**
    Ward,
    /// Cones of luminaires, virtual luminaires and casters as domains of their own (Kirk and Arvo 1991). Unbiased.
    Regions,
    /// A pilot with luminaires that shrink, then fresh samples. Unbiased.
    TwoStage,
    /// Voronoi weights (Glassner 1993). **Biased.**
    Voronoi,
    /// Quadtree subdivision by contrast (Painter and Sloan 1989). **Biased.**
    Contrast,
    /// Quadtree subdivision by value. **Biased.**
    Value,
    /// Triangles on the hemisphere (Beyer and Lange 1994). **Biased.**
    Triangles,
    /// Delaunay triangulation with linear weights. **Biased.**
    Delaunay,
    /// Luminaires enlarged so many times in area, subdivision by contrast. **Biased.**
    Enlarged(u32),
    /// Luminaires that shrink with the cells. **Biased.**
    Shrinking,
}

/// Names on the command line, but for `report1994:enlarged:K`.
pub const NAMES: [(&str, Report); 11] = [
    ("uniform", Report::Uniform),
    ("luminaires", Report::Luminaires),
    ("luminaires:ward", Report::Ward),
    ("regions", Report::Regions),
    ("two-stage", Report::TwoStage),
    ("report1994:voronoi", Report::Voronoi),
    ("report1994:subdivision:contrast", Report::Contrast),
    ("report1994:subdivision:value", Report::Value),
    ("report1994:triangles", Report::Triangles),
    ("report1994:delaunay", Report::Delaunay),
    ("report1994:shrinking", Report::Shrinking),
];
const ENLARGED: &str = "report1994:enlarged:";

/// The strategy of a name; `K` in `report1994:enlarged:K` is a whole number from 1 to 1000000.
pub fn parse(name: &str) -> Option<Strategy> {
    if let Some(k) = name.strip_prefix(ENLARGED) {
        let k = k.parse().ok().filter(|k| (1..=1_000_000).contains(k))?;
        return Some(Strategy::Report(Report::Enlarged(k)));
    }
    let plain = Strategy::ALL.iter().find(|n| n.0 == name).map(|n| n.1);
    plain.or_else(|| NAMES.iter().find(|n| n.0 == name).map(|n| Strategy::Report(n.1)))
}

/// The name of a strategy.
pub fn name(strategy: Strategy) -> String {
    match strategy {
        Strategy::Report(Report::Enlarged(k)) => format!("{ENLARGED}{k}"),
        Strategy::Report(r) => NAMES.iter().find(|n| n.1 == r).map_or("", |n| n.0).to_string(),
        s => Strategy::ALL.iter().find(|n| n.1 == s).map_or("", |n| n.0).to_string(),
    }
}

/// Whether a strategy is biased by itself, beyond what the zones do.
pub fn is_biased(strategy: Strategy) -> bool {
    matches!(strategy, Strategy::Report(r) if r.is_biased())
}

/// Cones of virtual luminaires that `Regions` takes at most, and casters.
const MOST_REGIONS: usize = 12;
/// Half-angles beyond which a cone is no help (radians).
const WIDEST: f32 = 1.2;

impl Report {
    /// Whether its expectation is not the integral.
    pub fn is_biased(self) -> bool {
        !matches!(self, Report::Uniform | Report::Luminaires | Report::Regions | Report::TwoStage)
    }

    /// Hand the method, told what is known at a point, to `then`.
    pub fn with<R>(self, known: &Known, then: impl FnOnce(&dyn Method<[f64; 3]>) -> R) -> R {
        let asked = known.criterion.map(criterion_of);
        let criterion = asked.unwrap_or(Criterion::Contrast).into();
        let contrast = PainterSloan { criterion: Criterion::Contrast.into(), parent: Parent::Keep };
        match self {
            Report::Uniform => then(&Jittered),
            Report::Luminaires => then(&ShirleyWang::new(&known.lamps)),
            Report::Ward => {
                // Without memory: what other gathers saw would depend on the order of threads.
                let history = History::new(known.lamps.len());
                then(&WardShadows { luminaires: &known.lamps, tolerance: 0.1, history: &history })
            }
            Report::Regions => then(&KirkArvo::new(&known.regions)),
            Report::TwoStage => {
                let plain = TwoStage::default();
                then(&TwoStage { criterion: asked.map_or(plain.criterion, Into::into), ..plain })
            }
            Report::Voronoi => then(&Glassner { criterion }),
            Report::Contrast => then(&contrast),
            Report::Value => then(&PainterSloan { criterion: Criterion::Value.into(), parent: Parent::Keep }),
            Report::Triangles => then(&BeyerLange { criterion }),
            Report::Delaunay => then(&DelaunayAdaptive { criterion }),
            Report::Enlarged(k) => {
                then(&Enlarged { k: k as f64, inner: PainterSloan { criterion, ..contrast } })
            }
            Report::Shrinking => then(&Shrinking::default()),
        }
    }
}

/// What is known at a point before any ray: cones on the hemisphere.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// Luminaires, weighted by what they would contribute unoccluded.
    pub lamps: Vec<Region>,
    /// Luminaires, then virtual luminaires, then casters.
    pub regions: Vec<Region>,
    images: Vec<(Vec3, f32, f32)>,
    /// Hinted criterion.
    criterion: Option<CriterionHint>,
}

fn criterion_of(hint: CriterionHint) -> Criterion<'static> {
    match hint {
        CriterionHint::Contrast => Criterion::Contrast,
        CriterionHint::Value => Criterion::Value,
        CriterionHint::Deviation => Criterion::Deviation,
        CriterionHint::Unresolved => Criterion::Unresolved,
    }
}

impl Known {
    /// Forget the last point and look at this one, with local `wo`.
    pub fn look(&mut self, walker: &Walker, s: &Surface, bsdf: &Bsdf, wo: Vec3) {
        self.lamps.clear();
        self.regions.clear();
        let side = if wo.z < 0.0 { -1.0 } else { 1.0 };
        let world = walker.world;
        for (i, lamp) in world.balls.lamps().enumerate() {
            let Some((axis, angle)) = cone(s, lamp, side) else { continue };
            let to = lamp.centre - s.p;
            let local = Vec3::new(axis.x as f32, axis.y as f32, side * axis.z as f32);
            let f = bsdf.eval(wo, local, Quantity::Radiance);
            // A lamp that only looks over the horizon counts as if it stood a little above it.
            let cos = (axis.z as f32).max(0.1 * angle.sin());
            let e =
                world.balls.intensity(world, i, -to.normalize_or_zero()) * f * (cos / to.length_squared());
            let weight = e.luminance() as f64;
            if weight > 0.0 {
                self.lamps.push(Region { shape: Shape::cap(axis, angle as f64), weight });
            }
        }
        self.regions.extend_from_slice(&self.lamps);
        let all = self.lamps.iter().map(|l| l.weight).sum::<f64>();
        let all = if all > 0.0 { all } else { 1.0 };
        let before = self.regions.len();
        self.virtual_luminaires(walker, s, side);
        let images = self.regions.len();
        for caster in world.balls.casters() {
            if self.regions.len() >= images + MOST_REGIONS / 2 {
                break;
            }
            if let Some((axis, angle)) = cone(s, *caster, side) {
                self.regions.push(Region { shape: Shape::cap(axis, angle as f64), weight: 0.0 });
            }
        }
        // How bright they are is not known: virtual luminaires get as much as luminaires, casters half of that, evenly.
        let even = |regions: &mut [Region], total: f64| {
            let each = total / regions.len().max(1) as f64;
            regions.iter_mut().for_each(|r| r.weight = each);
        };
        even(&mut self.regions[before..images], all);
        even(&mut self.regions[images..], 0.5 * all);
        self.criterion = world.hints.criterion();
        self.hinted(world, s, bsdf, side, all);
    }

    /// Cones that hints ask to look into: each with its share of what luminaires have.
    fn hinted(&mut self, world: &World, s: &Surface, bsdf: &Bsdf, side: f32, all: f64) {
        const WHOLE: u32 = 1000;
        for look in world.hints.looks(&Receiver::surface(s, bsdf), WHOLE).cones() {
            let (axis, height) = look.shape();
            let local = s.frame.to_local(axis);
            let axis = Dir::normalize(local.x as f64, local.y as f64, (side * local.z) as f64);
            if let Some(axis) = axis.filter(|a| a.z > 0.0 && height < 1.0 - WIDEST.cos()) {
                let weight = all * look.rays as f64 / WHOLE as f64;
                self.regions.push(Region { shape: Shape::Cap { axis, height: height as f64 }, weight });
            }
        }
    }

    fn virtual_luminaires(&mut self, walker: &Walker, s: &Surface, side: f32) {
        let Some(zones) = walker.zones else { return };
        self.images.clear();
        virtual_cones(zones, s, &mut self.images);
        for (axis, height, _) in self.images.iter().take(MOST_REGIONS / 2) {
            let axis = s.frame.to_local(*axis);
            let axis = Dir::normalize(axis.x as f64, axis.y as f64, (side * axis.z) as f64);
            if let Some(axis) = axis.filter(|a| a.z > 0.0) {
                self.regions.push(Region { shape: Shape::Cap { axis, height: *height as f64 }, weight: 0.0 });
            }
        }
    }
}

/// The cones in which virtual luminaires are expected at a point: unit axis, 1 - cos of the half-angle, share of the
/// samples that gathers give to it; the largest share first.
pub fn virtual_cones(zones: &Zones, s: &Surface, into: &mut Vec<(Vec3, f32, f32)>) {
    if zones.records().is_empty() {
        return;
    }
    let n = s.facing();
    into.extend(Cones::new(zones.records(), s.p, n).iter());
    into.sort_by(|a, b| b.2.total_cmp(&a.2));
}

/// Axis (z up on the side looked from) and half-angle of the cone that a ball fills; `None` where it is below the horizon or
/// so near that the cone says nothing.
fn cone(s: &Surface, ball: Ball, side: f32) -> Option<(Dir<f64>, f32)> {
    let to = ball.centre - s.p;
    let distance = to.length();
    let sin = ball.radius / distance;
    // NaN where the ball's centre is the point itself.
    if sin.is_nan() || sin >= WIDEST.sin() || to.dot(s.ng) * side <= -ball.radius {
        return None;
    }
    let local = s.frame.to_local(to / distance);
    let axis = Dir::normalize(local.x as f64, local.y as f64, (side * local.z) as f64)?;
    // A little wider than the ball, for rounding.
    Some((axis, sin.asin() * 1.000_1))
}

/// The integrand of a gather over the unit square, and what its evaluation costs.
pub struct Domain<'a, 'w> {
    /// Follows the rays.
    pub walker: &'a Walker<'w>,
    /// Where.
    pub surface: &'a Surface,
    /// What scatters.
    pub bsdf: &'a Bsdf,
    /// Towards where the ray came from, local.
    pub wo: Vec3,
    /// Stream of the rays; each takes a branch.
    pub sampler: Sampler,
    /// Number of the next branch.
    pub next: u32,
    /// Costs.
    pub tally: &'a mut Tally,
}

impl Domain<'_, '_> {
    /// Local direction at a point of the square, on the side of `wo`.
    pub fn local(&self, uv: hemiquad::Uv<f64>) -> Vec3 {
        let d = Concentric.dir(uv);
        let z = (d.z as f32).max(1e-7);
        Vec3::new(d.x as f32, d.y as f32, if self.wo.z < 0.0 { -z } else { z })
    }

    /// 2π f cos θ at a local direction; black where shading and geometric normal disagree.
    pub fn weight(&self, wi: Vec3) -> Rgb {
        let w = self.surface.frame.to_world(wi);
        if self.surface.is_front(w) != (wi.z > 0.0) {
            return Rgb::BLACK;
        }
        self.bsdf.eval(self.wo, wi, Quantity::Radiance) * (2.0 * PI * wi.z.abs())
    }

    /// Field radiance from a local direction, of which the part that is not a luminaire's (real or virtual) if `dark`.
    pub fn field_radiance(&mut self, wi: Vec3, dark: bool) -> Rgb {
        let mut branch = self.sampler.branch(self.next);
        self.next += 1;
        let w = self.surface.frame.to_world(wi).normalize();
        let arrival = if dark { Arrival::Unlit } else { Arrival::Full };
        let start = Start { origin: self.surface.leave(w), dir: w, arrival, depth: 1, worth: 0.0 };
        self.walker.field_radiance(start, &mut branch, self.tally)
    }

    /// What enlarged luminaires shine along a direction, through mirrors and glass too. They keep their intensity, and are as
    /// little hidden as their centres: what stands within the ball does not hide it.
    fn enlarged(&mut self, wi: Vec3, size: Size) -> Rgb {
        let world = self.walker.world;
        let mut branch = self.sampler.branch(self.next);
        self.next += 1;
        let mut dir = self.surface.frame.to_world(wi).normalize();
        let (mut origin, mut beta, mut travelled) = (self.surface.leave(dir), Rgb::WHITE, 0.0);
        let mut sum = Rgb::BLACK;
        for _ in 0..LONGEST_CHAIN {
            self.tally.rays += 1;
            let hit = world.closest(origin, dir, f32::INFINITY);
            let reach = hit.as_ref().map_or(f32::INFINITY, |h| h.t);
            for (i, lamp) in world.balls.lamps().enumerate() {
                let to = lamp.centre - origin;
                let along = to.dot(dir);
                if along <= 0.0 {
                    continue;
                }
                let distance = travelled + to.length();
                let radius = grown(lamp.radius, distance, size);
                let miss2 = (to - dir * along).length_squared();
                if miss2 > radius * radius || along - radius > reach {
                    continue;
                }
                let sin = (radius / distance).min(1.0);
                let height = sin * sin / (1.0 + (1.0 - sin * sin).sqrt());
                let intensity = world.balls.intensity(world, i, -to.normalize_or_zero());
                sum += beta * intensity * (1.0 / (2.0 * PI * height * distance * distance));
            }
            let Some(s) = hit else { break };
            let bsdf = world.bsdf(&s);
            if !bsdf.has_delta() {
                break;
            }
            let Some((next, weight)) = specular_branch(&s, &bsdf, branch.next1()) else { break };
            beta *= weight;
            travelled += s.t;
            (origin, dir) = (s.leave(next), next);
        }
        sum
    }
}

/// Specular events that an enlarged luminaire is looked for behind.
const LONGEST_CHAIN: u32 = 12;

/// The radius (m) of an enlarged ball at a distance (m).
fn grown(radius: f32, distance: f32, size: Size) -> f32 {
    match size {
        Size::True => radius,
        Size::Times(k) => radius * (k as f32).sqrt(),
        Size::AtLeast(on_square) => {
            let angle = (on_square * Concentric::LARGEST_STRETCH) as f32;
            radius.max(distance * angle.min(WIDEST).sin())
        }
    }
}

impl Integrand<[f64; 3]> for Domain<'_, '_> {
    fn eval(&mut self, at: &[Probe], out: &mut [[f64; 3]]) {
        for (probe, out) in at.iter().zip(out) {
            let wi = self.local(probe.uv);
            let weight = self.weight(wi);
            *out = [0.0; 3];
            if weight.is_black() {
                continue;
            }
            let radiance = match probe.size {
                Size::True => self.field_radiance(wi, false),
                size => self.field_radiance(wi, true) + self.enlarged(wi, size),
            };
            *out = (weight * radiance).0.map(f64::from);
        }
    }
}

/// Whether the report's methods answer for a lobe: diffuse reflection.
fn is_handled(lobe: &Lobe, wo: Vec3) -> bool {
    let back = Vec3::new(0.0, 0.0, 1f32.copysign(wo.z));
    lobe.kind() == LobeClass::Diffuse && !lobe.eval(wo, back, Quantity::Radiance).is_black()
}

struct Scratch {
    known: Known,
    work: Workspace<[f64; 3]>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> =
        RefCell::new(Scratch { known: Known::default(), work: Workspace::new() });
}

/// The surface radiance that the non-delta lobes at `s` send towards where the ray came from: diffuse reflection by one of the
/// report's methods with `plan.rays` rays, everything else by the default strategy.
pub fn gather(
    walker: &Walker,
    s: &Surface,
    bsdf: &Bsdf,
    plan: &GatherPlan,
    method: Report,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    let wo = s.frame.to_local(s.wo);
    let diffuse = bsdf.keeping(|lobe| is_handled(lobe, wo));
    let mut radiance = Rgb::BLACK;
    if !diffuse.is_black() {
        let key = sampler.key();
        let domain =
            Domain { walker, surface: s, bsdf: &diffuse, wo, sampler: sampler.clone(), next: 0, tally };
        radiance = SCRATCH.with_borrow_mut(|Scratch { known, work }| {
            known.look(walker, s, &diffuse, wo);
            integrate(domain, known, method, plan.rays, key, work).value_rgb()
        });
    }
    let rest = bsdf.keeping(|lobe| !is_handled(lobe, wo));
    if rest.has_non_delta() {
        let plan = GatherPlan { strategy: Strategy::Sobol, ..*plan };
        radiance += gather::gather(walker, s, &rest, &plan, sampler, tally);
    }
    radiance
}

/// One of the specular ways on from `s`, picked in proportion to what it carries, with its weight over probability.
fn specular_branch(s: &Surface, bsdf: &Bsdf, u: f32) -> Option<(Vec3, Rgb)> {
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

/// Run a method over a domain.
pub fn integrate(
    mut domain: Domain,
    known: &Known,
    method: Report,
    rays: u32,
    key: Key,
    work: &mut Workspace<[f64; 3]>,
) -> Estimate<[f64; 3]> {
    method.with(known, |m| m.integrate(&mut domain, rays.max(4), key, work))
}

/// The value as radiance.
pub trait ValueRgb {
    /// Negative channels (a control variate may leave some) are kept: cutting them off would be a bias.
    fn value_rgb(&self) -> Rgb;
}

impl ValueRgb for Estimate<[f64; 3]> {
    fn value_rgb(&self) -> Rgb {
        Rgb(self.value.map(|v| v as f32))
    }
}
