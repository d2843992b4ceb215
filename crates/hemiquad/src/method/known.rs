//! Methods that are told where luminaires are: the split into direct and indirect light (report, section 3.1), the sampling of
//! luminaires by one mixture (P. Shirley and C. Wang, "Direct lighting by Monte Carlo integration", 1991), and the partition of
//! the domain (D. Kirk and J. Arvo, "Unbiased variance reduction for global illumination", 1991). All unbiased.

use super::draw::{Placed, whole};
use super::{Method, Workspace};
use crate::curve;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::{Integrand, Probe};
use crate::map::{Concentric, Map, Uv};
use crate::points::Key;
use crate::shape::Shape;
use crate::value::Value;

/// A place known beforehand, with what it is expected to contribute (any unit; only ratios count).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Where.
    pub shape: Shape,
    /// How much, relative to the other regions; not negative.
    pub weight: f64,
}

/// How many shapes hold a point, and the mixture density Σ αᵢ / areaᵢ over them.
pub(crate) fn mixture(regions: &[Region], p: Uv<f64>) -> (u32, f64) {
    let (mut count, mut density, mut total) = (0, 0.0, 0.0);
    let mut dir = None;
    for r in regions {
        total += r.weight;
        let inside = match r.shape {
            Shape::Cap { axis, height } => {
                let d = *dir.get_or_insert_with(|| Concentric.dir(p));
                let (x, y, z) = (d.x - axis.x, d.y - axis.y, d.z - axis.z);
                x * x + y * y + z * z <= 2.0 * height
            }
            shape => shape.contains(p),
        };
        if inside {
            count += 1;
            density += r.weight / r.shape.area().max(f64::MIN_POSITIVE);
        }
    }
    (count, if total > 0.0 { density / total } else { 0.0 })
}

/// The region at position `t` in [0, 1) when each has a length in proportion to its weight, and the position inside it.
pub(crate) fn choose(regions: &[Region], t: f64, cursor: &mut (usize, f64)) -> Option<(usize, f64)> {
    let total: f64 = regions.iter().map(|r| r.weight).sum();
    let t = t * total;
    if t < cursor.1 {
        *cursor = (0, 0.0);
    }
    while cursor.0 < regions.len() {
        let w = regions[cursor.0].weight;
        if t < cursor.1 + w {
            return Some((cursor.0, (t - cursor.1) / w));
        }
        *cursor = (cursor.0 + 1, cursor.1 + w);
    }
    None
}

/// Carries an integrand to the outside of some regions: evaluated everywhere, zero inside.
struct Outside<'a, 'f, V> {
    f: &'f mut dyn Integrand<V>,
    regions: &'a [Region],
    /// How many samples fell inside.
    inside: u32,
}

impl<V: Value> Integrand<V> for Outside<'_, '_, V> {
    fn eval(&mut self, at: &[Probe], out: &mut [V]) {
        self.f.eval(at, out);
        for (o, p) in out.iter_mut().zip(at) {
            if mixture(self.regions, p.uv).0 > 0 {
                *o = V::default();
                self.inside += 1;
            }
        }
    }
}

/// The broad samples count as zero inside the regions. As long as none of `samples` fell there their spread shows nothing of it, but it
/// is known: with the rest at its mean, regions of area A in all add (1 - A)A/n times the square of the mean to the variance.
pub(super) fn holes<V: Value>(regions: &[Region], inside: u32, samples: u32, mean: V, pairs: &mut Pairs<V>) {
    let area = regions.iter().map(|r| r.shape.area()).sum::<f64>().min(1.0);
    if inside == 0 && samples > 0 {
        pairs.add_variance(mean, area * (1.0 - area) / samples as f64);
    }
}

/// Broad samples of what lies outside of the regions, at no cost where they fall inside. Returns the number of evaluations.
pub(super) fn outside<V: Value>(
    f: &mut dyn Integrand<V>,
    regions: &[Region],
    strata: u32,
    key: Key,
    work: &mut Workspace<V>,
    pairs: &mut Pairs<V>,
) -> u32 {
    let place = |t: f64| {
        let p = curve::at(t);
        (mixture(regions, p).0 == 0).then_some(Placed { uv: p, weight: 1.0, cell: u32::MAX })
    };
    let before = pairs.sum;
    let spent = work.draw.pairs(f, strata, key, place, |v, _| v, pairs);
    let rest = pairs.sum.minus(before);
    holes(regions, 2 * strata - spent, 2 * strata, rest, pairs);
    spent
}

fn finish<V: Value>(pairs: &Pairs<V>, spent: u32, work: &mut Workspace<V>) -> Estimate<V> {
    let unexplored = work.draw.unexplored();
    let evaluations = Evaluations { pilot: 0, estimate: spent };
    Estimate::new(
        pairs.sum,
        Some(pairs.std_error()),
        pairs.degrees_of_freedom(),
        evaluations,
        unexplored,
        false,
    )
}

/// Direct light from known luminaires plus indirect light from everywhere (report, section 3.1): I = ∫ Lr + ∫ Le over the
/// luminaires. Every luminaire gets its own strata, two samples at least, even where that exceeds the budget.
#[derive(Clone, Copy, Debug)]
pub struct DirectIndirect<'a> {
    /// The luminaires. Where they overlap each takes its part.
    pub luminaires: &'a [Region],
    /// Share of the samples that goes to them, in [0, 1].
    pub direct: f64,
}

impl<'a> DirectIndirect<'a> {
    /// Half of the samples to the luminaires.
    pub fn new(luminaires: &'a [Region]) -> Self {
        DirectIndirect { luminaires, direct: 0.5 }
    }

    fn direct<V: Value>(
        &self,
        f: &mut dyn Integrand<V>,
        samples: f64,
        key: Key,
        work: &mut Workspace<V>,
        pairs: &mut Pairs<V>,
    ) -> u32 {
        let total: f64 = self.luminaires.iter().map(|l| l.weight).sum();
        let mut spent = 0;
        for (i, l) in self.luminaires.iter().enumerate() {
            let share = if total > 0.0 { l.weight / total } else { 1.0 / self.luminaires.len() as f64 };
            let strata = ((samples * share / 2.0) as u32).max(1);
            let (shape, area) = (l.shape, l.shape.area());
            let place = |t: f64| {
                let uv = shape.sample(curve::at(t))?;
                let shared = mixture(self.luminaires, uv).0.max(1);
                Some(Placed { uv, weight: area / shared as f64, cell: i as u32 })
            };
            spent += work.draw.pairs(f, strata, key.with(i as u64), place, |v, _| v, pairs);
        }
        spent
    }

    /// The two integrals of the report: `reflected` over the whole square, `emitted` over the luminaires only. The reflected
    /// part is counted inside the luminaires too.
    pub fn integrate_parts<V: Value>(
        &self,
        reflected: &mut dyn Integrand<V>,
        emitted: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let mut pairs = Pairs::new();
        work.draw.start();
        let direct =
            if self.luminaires.is_empty() { 0.0 } else { budget as f64 * self.direct.clamp(0.0, 1.0) };
        let mut spent = self.direct(emitted, direct, key.with(1), work, &mut pairs);
        let left = (budget.saturating_sub(spent) / 2).max(1);
        spent += work.draw.pairs(reflected, left, key.with(2), whole, |v, _| v, &mut pairs);
        finish(&pairs, spent, work)
    }
}

impl<V: Value> Method<V> for DirectIndirect<'_> {
    fn name(&self) -> &'static str {
        "DirectIndirect"
    }

    /// Takes the integrand as emitted inside the luminaires and as reflected outside.
    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let mut pairs = Pairs::new();
        work.draw.start();
        let direct =
            if self.luminaires.is_empty() { 0.0 } else { budget as f64 * self.direct.clamp(0.0, 1.0) };
        let mut spent = self.direct(f, direct, key.with(1), work, &mut pairs);
        let left = (budget.saturating_sub(spent) / 2).max(1);
        let mut outside = Outside { f, regions: self.luminaires, inside: 0 };
        let before = pairs.sum;
        spent += work.draw.pairs(&mut outside, left, key.with(2), whole, |v, _| v, &mut pairs);
        let rest = pairs.sum.minus(before);
        holes(self.luminaires, outside.inside, 2 * left, rest, &mut pairs);
        finish(&pairs, spent, work)
    }
}

/// Luminaire sampling by one mixture density over all luminaires: the cost does not grow with their number. The rest of the
/// square gets its own samples, at no cost where they fall into a luminaire.
#[derive(Clone, Copy, Debug)]
pub struct ShirleyWang<'a> {
    /// The luminaires, weighted by their estimated contributions.
    pub luminaires: &'a [Region],
    /// Share of the samples that goes to them, in [0, 1].
    pub direct: f64,
}

impl<'a> ShirleyWang<'a> {
    /// Half of the samples to the luminaires.
    pub fn new(luminaires: &'a [Region]) -> Self {
        ShirleyWang { luminaires, direct: 0.5 }
    }
}

impl<V: Value> Method<V> for ShirleyWang<'_> {
    fn name(&self) -> &'static str {
        "ShirleyWang"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let mut pairs = Pairs::new();
        work.draw.start();
        let lit = self.luminaires.iter().any(|l| l.weight > 0.0);
        let share = if lit { self.direct.clamp(0.0, 1.0) } else { 0.0 };
        let strata = (budget as f64 * share / 2.0) as u32;
        let mut spent = 0;
        if strata > 0 {
            let mut cursor = (0, 0.0);
            let place = |t: f64| {
                let (i, s) = choose(self.luminaires, t, &mut cursor)?;
                let uv = self.luminaires[i].shape.sample(curve::at(s))?;
                let (_, density) = mixture(self.luminaires, uv);
                // Rounding at a rim may leave the point just outside all of them.
                (density > 0.0).then_some(Placed { uv, weight: 1.0 / density, cell: i as u32 })
            };
            spent += work.draw.pairs(f, strata, key.with(1), place, |v, _| v, &mut pairs);
        }
        let covered = if strata > 0 { self.luminaires } else { &[] };
        let left = (budget / 2).saturating_sub(strata).max(1);
        spent += outside(f, covered, left, key.with(2), work, &mut pairs);
        finish(&pairs, spent, work)
    }
}

/// Domain partitioning: the regions (luminaires and casters, the first of overlapping ones) and the rest are integrated each by
/// themselves, with numbers of samples fixed beforehand.
#[derive(Clone, Copy, Debug)]
pub struct KirkArvo<'a> {
    /// Regions chosen before any sample is taken.
    pub regions: &'a [Region],
    /// Share of the samples that goes to them, in [0, 1).
    pub inside: f64,
}

impl<'a> KirkArvo<'a> {
    /// Half of the samples to the regions.
    pub fn new(regions: &'a [Region]) -> Self {
        KirkArvo { regions, inside: 0.5 }
    }
}

impl<V: Value> Method<V> for KirkArvo<'_> {
    fn name(&self) -> &'static str {
        "KirkArvo"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let mut pairs = Pairs::new();
        work.draw.start();
        let total: f64 = self.regions.iter().map(|l| l.weight).sum();
        let inside = if self.regions.is_empty() { 0.0 } else { budget as f64 * self.inside.clamp(0.0, 0.99) };
        let mut spent = 0;
        for (i, r) in self.regions.iter().enumerate() {
            let share = if total > 0.0 { r.weight / total } else { 1.0 / self.regions.len() as f64 };
            let strata = ((inside * share / 2.0) as u32).max(1);
            let (shape, area) = (r.shape, r.shape.area());
            let place = |t: f64| {
                let uv = shape.sample(curve::at(t))?;
                (mixture(&self.regions[..i], uv).0 == 0).then_some(Placed {
                    uv,
                    weight: area,
                    cell: i as u32,
                })
            };
            spent += work.draw.pairs(f, strata, key.with(i as u64), place, |v, _| v, &mut pairs);
        }
        // What falls into a region is known to be none of the rest and costs nothing, so there is room for more.
        let rest = (1.0 - self.regions.iter().map(|r| r.shape.area()).sum::<f64>()).clamp(0.25, 1.0);
        let strata = ((budget.saturating_sub(spent) as f64 / 2.0 / rest) as u32).max(1);
        spent += outside(f, self.regions, strata, key.with(u64::MAX), work, &mut pairs);
        finish(&pairs, spent, work)
    }
}
