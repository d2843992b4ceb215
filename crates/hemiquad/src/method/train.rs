//! A quadtree that learns from samples where an integrand varies, and turns that into a density for fresh ones.

use super::draw::LeafDensity;
use crate::allocation::Allocation;
use crate::map::Uv;
use crate::partition::{Partition, QuadTree};
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Sample {
    uv: Uv<f64>,
    drive: f64,
    next: u32,
}

/// What is known of a node from the samples that fell into it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stats {
    pub n: f64,
    pub mean: f64,
    pub variance: f64,
    /// Largest minus smallest value.
    pub range: f64,
}

/// A trained partition: feed it samples ([`Trained::add`]), refine it ([`Trained::refine`]), and make it a density
/// ([`Trained::finish`]). The samples must not be those of the estimate that will use it, or the estimate is biased.
#[derive(Debug, Default)]
pub struct Trained {
    tree: QuadTree,
    samples: Vec<Sample>,
    first: Vec<u32>,
    stats: Vec<Stats>,
    heap: BinaryHeap<(u64, u32)>,
    strata: Vec<(f64, f64, f64)>,
    spread: Vec<f64>,
    share: Vec<f64>,
    pub(crate) order: Vec<u32>,
    density: LeafDensity,
}

impl Trained {
    /// An empty one.
    pub fn new() -> Self {
        Trained::default()
    }

    /// Forgets everything, keeping the memory, and begins with a full tree of this depth.
    pub fn start(&mut self, level: u8) {
        self.tree.clear();
        self.tree.grow(level);
        self.samples.clear();
        self.first.clear();
        self.first.resize(self.tree.node_count() as usize, NONE);
        self.stats.clear();
        self.stats.resize(self.tree.node_count() as usize, Stats::default());
    }

    /// A sample: where, and the scalar that drives.
    pub fn add(&mut self, uv: Uv<f64>, drive: f64) {
        if self.first.is_empty() {
            self.start(0);
        }
        let leaf = self.tree.leaf_at(uv) as usize;
        self.samples.push(Sample { uv, drive, next: self.first[leaf] });
        self.first[leaf] = self.samples.len() as u32 - 1;
    }

    fn of_leaf(&self, leaf: u32) -> impl Iterator<Item = &Sample> {
        let start = self.first[leaf as usize];
        let chain = |i: u32| self.samples.get(i as usize);
        std::iter::successors(chain(start), move |s| chain(s.next))
    }

    fn measure(&self, leaf: u32) -> Stats {
        let (mut n, mut mean, mut m2, mut low, mut high) = (0.0, 0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        for s in self.of_leaf(leaf) {
            n += 1.0;
            let d = s.drive - mean;
            mean += d / n;
            m2 += d * (s.drive - mean);
            low = s.drive.min(low);
            high = s.drive.max(high);
        }
        Stats { n, mean, variance: if n > 1.0 { m2 / (n - 1.0) } else { 0.0 }, range: (high - low).max(0.0) }
    }

    /// Splits the leaf with the largest range × area again and again, until there are `leaves` of them or all that matter have
    /// fewer than `fewest` samples.
    pub fn refine(&mut self, leaves: u32, fewest: u32) {
        if self.first.is_empty() {
            self.start(0);
        }
        self.heap.clear();
        for leaf in 0..self.tree.node_count() {
            if self.tree.is_leaf(leaf) {
                self.rank(leaf, fewest);
            }
        }
        while self.tree.leaf_count() + 3 <= leaves {
            let Some((_, leaf)) = self.heap.pop() else { break };
            let Some(child) = self.tree.cut(leaf) else { continue };
            let parent = self.stats[leaf as usize];
            self.first.resize(child as usize + 4, NONE);
            // Until it has samples of its own a child believes what its parent knew.
            self.stats.resize(child as usize + 4, Stats { n: 0.0, ..parent });
            let mut i = std::mem::replace(&mut self.first[leaf as usize], NONE);
            while let Some(s) = self.samples.get_mut(i as usize) {
                let c = (child..child + 4).find(|c| self.tree.cell(*c).contains(s.uv)).unwrap_or(child);
                let next = s.next;
                s.next = self.first[c as usize];
                self.first[c as usize] = i;
                i = next;
            }
            for c in child..child + 4 {
                self.rank(c, fewest);
                let own = self.stats[c as usize];
                let s = &mut self.stats[c as usize];
                if own.n < 1.0 {
                    *s = Stats { n: 0.0, ..parent };
                } else {
                    // One sample's worth of belief in the parent's variance.
                    let k = (own.n - 1.0).max(0.0);
                    s.variance = (k * own.variance + parent.variance) / (k + 1.0);
                }
            }
        }
    }

    fn rank(&mut self, leaf: u32, fewest: u32) {
        let s = self.measure(leaf);
        self.stats[leaf as usize] = s;
        let score = s.range * self.tree.area(leaf);
        if s.n >= fewest.max(2) as f64 && score > 0.0 {
            // The bits of a positive number sort like the number.
            self.heap.push((score.to_bits(), leaf));
        }
    }

    /// Turns what was learnt into probabilities and a density. `guess` may replace the deviation of a leaf (given its number and
    /// the learnt one), for example after a control variate was taken out.
    pub(crate) fn finish_with(&mut self, allocation: Allocation, guess: impl Fn(u32, f64) -> f64) {
        self.spread.clear();
        self.spread.resize(self.tree.node_count() as usize, 0.0);
        for leaf in self.tree.leaves() {
            let s = &self.stats[leaf as usize];
            self.spread[leaf as usize] = guess(leaf, s.variance.max(0.0).sqrt());
        }
        self.strata.clear();
        for leaf in self.tree.leaves() {
            // A leaf beside a restless one is not to be trusted when it looks calm.
            let around = self
                .tree
                .neighbours(leaf)
                .as_slice()
                .iter()
                .fold(0f64, |m, n| m.max(self.spread[*n as usize]));
            let spread = self.spread[leaf as usize].max(0.1 * around);
            let area = self.tree.area(leaf);
            self.strata.push((area, area * self.stats[leaf as usize].mean.abs(), spread));
        }
        allocation.shares(&self.strata, &mut self.share);
        self.density.set(&self.tree, &self.share);
    }

    /// Turns what was learnt into probabilities and a density.
    pub fn finish(&mut self, allocation: Allocation) {
        if self.first.is_empty() {
            self.start(0);
        }
        self.finish_with(allocation, |_, s| s);
    }

    /// The partition.
    pub fn tree(&self) -> &QuadTree {
        &self.tree
    }

    /// The density of the last [`Trained::finish`].
    pub fn density(&self) -> &LeafDensity {
        &self.density
    }

    pub(crate) fn stats(&self, leaf: u32) -> Stats {
        self.stats[leaf as usize]
    }

    /// Indices, in the order of [`Trained::add`], of the samples in a leaf.
    pub(crate) fn members(&self, leaf: u32) -> impl Iterator<Item = usize> + '_ {
        let start = self.first[leaf as usize];
        let valid = |i: u32| (i != NONE).then_some(i as usize);
        std::iter::successors(valid(start), move |i| valid(self.samples[*i].next))
    }

    pub(crate) fn point(&self, i: usize) -> Uv<f64> {
        self.samples[i].uv
    }
}

/// The memory for shares is lent to methods that bring their own strata.
impl Trained {
    pub(crate) fn strata_mut(&mut self) -> &mut Vec<(f64, f64, f64)> {
        &mut self.strata
    }

    pub(crate) fn share_out(&mut self, allocation: Allocation) {
        allocation.shares(&self.strata, &mut self.share);
    }

    pub(crate) fn shares(&self) -> &[f64] {
        &self.share
    }
}
