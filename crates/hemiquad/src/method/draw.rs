//! Fresh samples for the estimate: two independent points in each of equal strata along a curve.
//!
//! A technique is a density over the square laid out on [0, 1): equal lengths are equal probabilities (leaves in Morton order,
//! Morton order inside each). Cutting [0, 1) into m equal parts with two points each spreads the samples systematically, gives
//! every leaf its share to within two samples, needs no rounding of sample counts, and leaves an unbiased variance.

use super::evaluate;
use crate::curve;
use crate::estimate::Pairs;
use crate::gap::Gap;
use crate::integrand::{Integrand, Probe, Stage};
use crate::map::Uv;
use crate::partition::{Partition, QuadTree};
use crate::points::Key;
use crate::value::Value;

/// Where a position of a technique falls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placed {
    /// The point.
    pub uv: Uv<f64>,
    /// What its value is multiplied with: the reciprocal of the density there.
    pub weight: f64,
    /// Which cell or region it came from.
    pub cell: u32,
}

/// Reusable memory of the drawing.
#[derive(Debug, Default)]
pub(crate) struct Draw<V> {
    probes: Vec<Probe>,
    values: Vec<V>,
    placed: Vec<Option<Placed>>,
    /// Every point drawn since `start`: for the largest gap.
    pub points: Vec<Uv<f64>>,
    pub gap: Gap,
}

/// Strata per batch.
const BATCH: u32 = 64;

impl<V: Value> Draw<V> {
    pub fn start(&mut self) {
        self.points.clear();
    }

    /// Draws two points in each of `strata` equal parts of [0, 1). `place` says where a position falls (`None`: in vain, which
    /// costs no evaluation and counts as zero), `post` turns value and place into the contribution before weighting. Returns the
    /// number of evaluations.
    pub fn pairs(
        &mut self,
        f: &mut dyn Integrand<V>,
        strata: u32,
        key: Key,
        mut place: impl FnMut(f64) -> Option<Placed>,
        mut post: impl FnMut(V, &Placed) -> V,
        into: &mut Pairs<V>,
    ) -> u32 {
        let mut spent = 0;
        let step = 1.0 / strata.max(1) as f64;
        let mut first = 0;
        while first < strata {
            let last = (first + BATCH).min(strata);
            self.probes.clear();
            self.placed.clear();
            self.values.clear();
            for k in first..last {
                let r = key.with(k as u64).uniform2_f64(0);
                // In the order of the curve, so that a technique may walk along its leaves.
                let (a, b) = if r.u < r.v { (r.u, r.v) } else { (r.v, r.u) };
                for x in [a, b] {
                    let at = place((k as f64 + x) * step);
                    if let Some(p) = at {
                        self.probes.push(Probe { stage: Stage::Estimate, ..Probe::at(p.uv) });
                        self.points.push(p.uv);
                    }
                    self.placed.push(at);
                }
            }
            evaluate(f, &self.probes, &mut self.values);
            spent += self.probes.len() as u32;
            let mut next = self.values.iter();
            let mut take = |at: &Option<Placed>| match (at, at.as_ref().and_then(|_| next.next())) {
                (Some(p), Some(v)) => post(*v, p).times(p.weight * step),
                _ => V::default(),
            };
            for pair in self.placed.chunks_exact(2) {
                let (a, b) = (take(&pair[0]), take(&pair[1]));
                into.add(a, b);
            }
            first = last;
        }
        spent
    }

    /// The largest disk without a point drawn since `start`.
    pub fn unexplored(&mut self) -> f64 {
        let points = &self.points;
        self.gap.radius(points.len(), |i| points[i])
    }
}

/// Pairs of uniform points over the whole square.
pub(crate) fn whole(t: f64) -> Option<Placed> {
    Some(Placed { uv: curve::at(t), weight: 1.0, cell: 0 })
}

/// A piecewise constant density over the leaves of a quadtree, laid out along its Morton order.
#[derive(Clone, Debug, Default)]
pub struct LeafDensity {
    leaves: Vec<u32>,
    /// Where each leaf ends on [0, 1).
    end: Vec<f64>,
    /// Density in the square, by node number.
    density: Vec<f64>,
}

impl LeafDensity {
    /// Takes the leaves of `tree` and their probabilities (in Morton order, sum one).
    pub fn set(&mut self, tree: &QuadTree, share: &[f64]) {
        self.leaves.clear();
        self.end.clear();
        self.density.clear();
        self.density.resize(tree.node_count() as usize, 0.0);
        let mut sum = 0.0;
        for (leaf, p) in tree.leaves().zip(share) {
            sum += p;
            self.leaves.push(leaf);
            self.end.push(sum);
            self.density[leaf as usize] = p / tree.area(leaf);
        }
    }

    /// Makes the density uniform.
    pub fn set_uniform(&mut self, tree: &QuadTree, scratch: &mut Vec<f64>) {
        scratch.clear();
        scratch.extend(tree.leaves().map(|l| tree.area(l)));
        self.set(tree, scratch);
    }

    /// Density of a leaf.
    pub fn of_leaf(&self, leaf: u32) -> f64 {
        self.density.get(leaf as usize).copied().unwrap_or(0.0)
    }

    /// Density at a point.
    pub fn pdf_square(&self, tree: &QuadTree, p: Uv<f64>) -> f64 {
        self.of_leaf(tree.leaf_at(p))
    }

    /// Where a position in [0, 1) falls. `cursor` remembers the last leaf: ascending positions are found by walking, others by
    /// bisection. Begin with 0.
    #[inline]
    pub fn place(&self, tree: &QuadTree, t: f64, cursor: &mut usize) -> Option<Placed> {
        let begin = |i: usize| if i == 0 { 0.0 } else { self.end[i - 1] };
        let last = self.leaves.len().checked_sub(1)?;
        let t = t * self.end[last];
        let mut i = (*cursor).min(last);
        if t < begin(i) {
            i = self.end.partition_point(|e| *e <= t).min(last);
        }
        while i < last && self.end[i] <= t {
            i += 1;
        }
        *cursor = i;
        let (from, to) = (begin(i), self.end[i]);
        if to <= from {
            return None;
        }
        let leaf = self.leaves[i];
        let uv = tree.cell(leaf).at(curve::at((t - from) / (to - from)));
        Some(Placed { uv, weight: 1.0 / self.density[leaf as usize], cell: leaf })
    }
}
