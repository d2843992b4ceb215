//! One-stage adaptive quadrature (report, section 3.2): cells are split where a criterion asks for it, and the samples that
//! decided are also the answer, Σ Aᵢ Lᵢ. *Biased*: what was missed is never looked for again (D. Kirk and J. Arvo, "Unbiased
//! sampling techniques for image synthesis", 1991), and the standard error, taken from neighbouring values, does not know it.

use super::{Leaves, Method, Workspace, evaluate};
use crate::criterion::{CellView, Criterion, Weighted};
use crate::estimate::{Estimate, Evaluations};
use crate::gap::Gap;
use crate::integrand::{Integrand, Probe, Size, Stage};
use crate::partition::{Few, Parent, Partition};
use crate::points::Key;
use crate::value::Value;
use std::collections::BinaryHeap;

/// How large luminaires are taken while a partition is refined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sizing {
    /// As they are.
    #[default]
    True,
    /// At least this many sides of the cell in radius, so that the cells that ask are sure to hit; they shrink as cells do.
    Shrinking(f64),
}

/// What [`refine`] does.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    /// Which cell is next.
    pub criterion: Weighted<'a>,
    /// Samples to begin with.
    pub initial: u32,
    /// Samples in all.
    pub total: u32,
    /// What the integrand is told.
    pub stage: Stage,
    /// What it is told about luminaires.
    pub sizing: Sizing,
}

/// A cell and its urgency. Of equals the larger cell first, then the older one: where nothing differs the search goes
/// breadth-first. Numbers that are not negative sort like their bits: priority, area and the reversed number of the cell make one
/// large integer, which is compared without branches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u128);

impl Entry {
    #[inline]
    fn new(priority: f64, area: f64, cell: u32) -> Self {
        let low = ((area as f32).to_bits() as u64) << 32 | !cell as u64;
        Entry((priority.to_bits() as u128) << 64 | low as u128)
    }

    #[inline]
    fn priority(self) -> f64 {
        f64::from_bits((self.0 >> 64) as u64)
    }

    #[inline]
    fn area(self) -> f64 {
        f32::from_bits((self.0 >> 32) as u32) as f64
    }

    #[inline]
    fn cell(self) -> u32 {
        !(self.0 as u32)
    }
}

/// Reusable memory of the refinement.
#[derive(Debug, Default)]
pub(crate) struct Refine<V> {
    pub values: Vec<V>,
    pub drives: Vec<f64>,
    probes: Vec<Probe>,
    sizes: Vec<f64>,
    heap: BinaryHeap<Entry>,
    seen: Seen,
    /// Mean and area by cell, as they were when it was last touched.
    known: Vec<(f64, f64)>,
    /// Current priority by cell; entries of the heap that differ are stale.
    priority: Vec<f64>,
    /// Whether something next to a cell has changed since it was ranked.
    stale: Vec<bool>,
    /// The last cell that turned out to differ from this one; the partition may list too few neighbours to show it.
    instigator: Vec<u32>,
    /// Guess at the variance inside, by cell.
    pub variance: Vec<f64>,
    pub gap: Gap,
}

/// What a cell looks like at present: a few values.
#[derive(Debug, Default)]
struct Seen {
    inside: [f64; 4],
    n_inside: usize,
    around: [f64; 16],
    around_area: [f64; 16],
    n_around: usize,
    at: crate::map::Uv<f64>,
}

/// Whether a criterion depends on the neighbours of a cell.
fn looks_around(plan: &Plan<'_>) -> bool {
    matches!(plan.criterion.criterion, Criterion::Contrast | Criterion::Deviation | Criterion::Unresolved)
}

impl Seen {
    #[inline]
    fn look<P: Partition>(
        &mut self,
        p: &P,
        drives: &[f64],
        known: &[(f64, f64)],
        cell: u32,
        neighbours: &[u32],
    ) {
        self.n_inside = 0;
        for &i in p.members(cell).as_slice().iter().take(4) {
            self.inside[self.n_inside] = drives[i as usize];
            self.n_inside += 1;
            self.at = p.points()[i as usize];
        }
        self.n_around = neighbours.len().min(16);
        for ((x, a), &n) in self.around.iter_mut().zip(&mut self.around_area).zip(neighbours) {
            (*x, *a) = known[n as usize];
        }
    }
}

impl<V: Value> Refine<V> {
    /// Evaluates the samples from `first` on. The size of luminaires follows the cells that were touched.
    fn evaluate_new<P: Partition>(&mut self, p: &P, f: &mut dyn Integrand<V>, plan: &Plan<'_>, first: usize) {
        let points = &p.points()[first..];
        self.probes.clear();
        if let Sizing::Shrinking(reach) = plan.sizing {
            self.sizes.clear();
            self.sizes.resize(points.len(), 0.0);
            for &cell in p.touched() {
                let size = reach * p.area(cell).sqrt();
                for &i in p.members(cell).as_slice() {
                    if let Some(s) = (i as usize).checked_sub(first).and_then(|i| self.sizes.get_mut(i)) {
                        *s = s.max(size);
                    }
                }
            }
            let with = points.iter().zip(&self.sizes);
            self.probes.extend(with.map(|(uv, s)| Probe {
                uv: *uv,
                stage: plan.stage,
                size: Size::AtLeast(*s),
            }));
        } else {
            self.probes.extend(points.iter().map(|uv| Probe {
                uv: *uv,
                stage: plan.stage,
                size: Size::True,
            }));
        }
        evaluate(f, &self.probes, &mut self.values);
        let values = &self.values[first..];
        self.drives.extend(values.iter().map(|v| v.drive()));
    }

    /// Ranks the cells that were touched, and lifts neighbours that now differ more.
    fn rank<P: Partition>(&mut self, p: &P, plan: &Plan<'_>) {
        let cells = p.cells() as usize;
        if self.priority.len() < cells {
            self.priority.resize(cells, 0.0);
            self.variance.resize(cells, 0.0);
            self.instigator.resize(cells, u32::MAX);
            self.stale.resize(cells, false);
            self.known.resize(cells, (0.0, 0.0));
        }
        for &cell in p.touched() {
            self.known[cell as usize] = (p.mean(cell, &self.drives), p.area(cell));
        }
        let by_contrast = looks_around(plan);
        let by_side = matches!(plan.criterion.criterion, Criterion::Unresolved);
        for &cell in p.touched() {
            self.instigator[cell as usize] = u32::MAX;
            let neighbours = p.neighbours(cell);
            let priority = self.rank_one(p, plan, cell, neighbours.as_slice());
            let (mine, area) = self.known[cell as usize];
            self.heap.push(Entry::new(priority, area, cell));
            if by_contrast {
                for &n in neighbours.as_slice() {
                    self.stale[n as usize] = true;
                    let (other, area) = self.known[n as usize];
                    let scale = if by_side { area * area.sqrt() } else { area };
                    let lifted = 0.5 * (mine - other).abs() * scale;
                    if lifted > self.priority[n as usize] {
                        self.instigator[n as usize] = cell;
                        let priority = self.rank_one(p, plan, n, self.around(p, n).as_slice());
                        self.heap.push(Entry::new(priority, area, n));
                    }
                }
            }
        }
    }

    /// The neighbours of a cell, and whoever lifted it.
    fn around<P: Partition>(&self, p: &P, cell: u32) -> Few {
        let mut few = p.neighbours(cell);
        let other = self.instigator[cell as usize];
        if other != u32::MAX && p.is_cell(other) {
            few.push(other);
        }
        few
    }

    fn rank_one<P: Partition>(&mut self, p: &P, plan: &Plan<'_>, cell: u32, neighbours: &[u32]) -> f64 {
        self.seen.look(p, &self.drives, &self.known, cell, neighbours);
        let seen = &self.seen;
        let view = CellView {
            area: self.known[cell as usize].1,
            inside: &seen.inside[..seen.n_inside],
            around: &seen.around[..seen.n_around],
            around_area: &seen.around_area[..seen.n_around],
            at: seen.at,
        };
        let priority = plan.criterion.priority(&view);
        self.stale[cell as usize] = false;
        self.priority[cell as usize] = priority;
        self.variance[cell as usize] = view.variance();
        priority
    }

    /// Σ area · mean of members, and the root of Σ area² · guessed variance.
    pub fn sum<P: Partition>(&self, p: &P) -> (V, V) {
        let (mut value, mut error) = (V::default(), 0.0);
        for cell in (0..p.cells()).filter(|c| p.is_cell(*c)) {
            let members = p.members(cell);
            let (area, n) = (p.area(cell), members.as_slice().len().max(1) as f64);
            for &i in members.as_slice() {
                value = value.plus(self.values[i as usize].times(area / n));
            }
            error += area * area * self.variance.get(cell as usize).copied().unwrap_or(0.0);
        }
        // The guess is made for the driving scalar; other channels get it in proportion.
        let scale = if value.drive().abs() > 0.0 { error.sqrt() / value.drive().abs() } else { 0.0 };
        (value, value.each(|x| x.abs() * scale))
    }
}

/// Seeds a partition, evaluates, and splits the worst cell until the budget is spent. Values, drives and guessed variances stay
/// in `state`; the number of evaluations is returned.
pub(crate) fn refine_with<P: Partition, V: Value>(
    partition: &mut P,
    f: &mut dyn Integrand<V>,
    plan: &Plan<'_>,
    key: Key,
    state: &mut Refine<V>,
) -> u32 {
    state.values.clear();
    state.drives.clear();
    state.heap.clear();
    state.priority.clear();
    state.variance.clear();
    state.instigator.clear();
    state.stale.clear();
    state.known.clear();
    partition.seed(plan.initial.min(plan.total).max(1), key.with(1));
    state.evaluate_new(partition, f, plan, 0);
    state.rank(partition, plan);
    let key = key.with(2);
    while partition.points().len() as u32 + partition.samples_per_split() <= plan.total {
        let Some(top) = state.heap.pop() else { break };
        let (priority, cell) = (top.priority(), top.cell());
        if !partition.is_cell(cell) || state.priority[cell as usize] != priority {
            continue;
        }
        // The refinement of a neighbour may have made this cell less urgent: put it back in its place.
        if looks_around(plan) && state.stale[cell as usize] {
            let neighbours = state.around(partition, cell);
            let now = state.rank_one(partition, plan, cell, neighbours.as_slice());
            if now < priority && state.heap.peek().is_some_and(|next| next.priority() > now) {
                state.heap.push(Entry::new(now, top.area(), cell));
                continue;
            }
        }
        let first = partition.points().len();
        if partition.split(cell, key.with(cell as u64)) {
            state.evaluate_new(partition, f, plan, first);
            state.rank(partition, plan);
        } else {
            state.priority[cell as usize] = -1.0;
        }
    }
    partition.points().len() as u32
}

/// One-stage adaptive quadrature over any partition. *Biased.*
pub fn refine<P: Partition, V: Value>(
    partition: &mut P,
    f: &mut dyn Integrand<V>,
    plan: &Plan<'_>,
    key: Key,
    work: &mut Workspace<V>,
) -> Estimate<V> {
    run(partition, f, plan, key, &mut work.refine)
}

pub(crate) fn run<P: Partition, V: Value>(
    partition: &mut P,
    f: &mut dyn Integrand<V>,
    plan: &Plan<'_>,
    key: Key,
    state: &mut Refine<V>,
) -> Estimate<V> {
    let spent = refine_with(partition, f, plan, key, state);
    let (value, error) = state.sum(partition);
    let points = partition.points();
    let unexplored = state.gap.radius(points.len(), |i| points[i]);
    let evaluations = Evaluations { pilot: 0, estimate: spent };
    Estimate::new(value, Some(error), f64::INFINITY, evaluations, unexplored, true)
}

/// The part of the budget that one-stage methods spend before they adapt.
const INITIAL: f64 = 0.25;

fn plan(criterion: Weighted<'_>, budget: u32) -> Plan<'_> {
    let initial = ((budget as f64 * INITIAL) as u32).max(1);
    Plan { criterion, initial, total: budget.max(1), stage: Stage::Estimate, sizing: Sizing::True }
}

/// Randomised quadtree subdivision: J. Painter and K. Sloan, "Antialiased ray tracing by adaptive progressive refinement",
/// 1989, with the report's criteria. *Biased.* About 0.15 µs (value) to 0.3 µs (contrast) of bookkeeping per sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct PainterSloan<'a> {
    /// Which cell is next.
    pub criterion: Weighted<'a>,
    /// Whether a split keeps its sample. Dropping it can lose what was found.
    pub parent: Parent,
}

impl<V: Value> Method<V> for PainterSloan<'_> {
    fn name(&self) -> &'static str {
        match (self.criterion.criterion, self.parent) {
            (Criterion::Contrast, Parent::Keep) => "PainterSloan contrast",
            (Criterion::Contrast, Parent::Drop) => "PainterSloan contrast drop",
            (Criterion::Value, Parent::Keep) => "PainterSloan value",
            (Criterion::Value, Parent::Drop) => "PainterSloan value drop",
            _ => "PainterSloan",
        }
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        work.tree.set_parent(self.parent);
        run(&mut work.tree, f, &plan(self.criterion, budget), key, &mut work.refine)
    }

    fn leaves(&self) -> Option<Leaves> {
        Some(Leaves::QuadTree)
    }
}

/// Adaptive weighted Monte Carlo: A. Glassner, "Dynamic stratification", 1993. Samples are added where the criterion asks;
/// each is weighted by its Voronoi cell. *Biased.* About 2 µs per sample.
#[cfg(feature = "delaunay")]
#[derive(Clone, Copy, Debug, Default)]
pub struct Glassner<'a> {
    /// Which cell is next.
    pub criterion: Weighted<'a>,
}

#[cfg(feature = "delaunay")]
impl<V: Value> Method<V> for Glassner<'_> {
    fn name(&self) -> &'static str {
        "Glassner (Voronoi)"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        run(&mut work.voronoi, f, &plan(self.criterion, budget), key, &mut work.refine)
    }

    fn leaves(&self) -> Option<Leaves> {
        Some(Leaves::Voronoi)
    }
}

/// Adaptive triangulation of the hemisphere: M. Beyer and B. Lange, "Rayvolution", 1994. The square stands for the hemisphere
/// through [`Concentric`](crate::map::Concentric). *Biased.*
#[derive(Clone, Copy, Debug, Default)]
pub struct BeyerLange<'a> {
    /// Which triangle is next.
    pub criterion: Weighted<'a>,
}

impl<V: Value> Method<V> for BeyerLange<'_> {
    fn name(&self) -> &'static str {
        "BeyerLange (triangles)"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        run(&mut work.triangles, f, &plan(self.criterion, budget), key, &mut work.refine)
    }

    fn leaves(&self) -> Option<Leaves> {
        Some(Leaves::Triangles)
    }
}

/// Delaunay triangulation with linear weights, refined where the criterion asks (report, section 3.2). *Biased.* About 2 µs
/// per sample.
#[cfg(feature = "delaunay")]
#[derive(Clone, Copy, Debug, Default)]
pub struct DelaunayAdaptive<'a> {
    /// Which triangle is next.
    pub criterion: Weighted<'a>,
}

#[cfg(feature = "delaunay")]
impl<V: Value> Method<V> for DelaunayAdaptive<'_> {
    fn name(&self) -> &'static str {
        "Delaunay"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        run(&mut work.delaunay, f, &plan(self.criterion, budget), key, &mut work.refine)
    }

    fn leaves(&self) -> Option<Leaves> {
        Some(Leaves::Delaunay)
    }
}
