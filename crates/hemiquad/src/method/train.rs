//! A quadtree that learns from samples where an integrand varies, and turns that into a density for fresh ones.

use super::draw::LeafDensity;
use crate::allocation::Allocation;
use crate::integrand::{Integrand, Probe, Stage};
use crate::map::Uv;
use crate::partition::{Partition, QuadTree};
use crate::points::Key;
use crate::value::Value;
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;

/// A leaf is restless when its range × area is above this part of the largest.
const RESTLESS: f64 = 1e-4;

#[derive(Clone, Copy, Debug)]
struct Sample<V> {
    uv: Uv<f64>,
    value: V,
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
    /// The value nearest to zero.
    pub low: f64,
    /// Which sample speaks for the node when it has none of its own, plus one; 0 for none.
    pub donor: u32,
}

/// A trained partition: feed it samples ([`Trained::add`]), refine it ([`Trained::refine`]), and make it a density
/// ([`Trained::finish`]). The samples must not be those of the estimate that will use it, or the estimate is biased.
#[derive(Debug)]
pub struct Trained<V = f64> {
    tree: QuadTree,
    samples: Vec<Sample<V>>,
    first: Vec<u32>,
    stats: Vec<Stats>,
    heap: BinaryHeap<(u64, u32)>,
    strata: Vec<(f64, f64, f64)>,
    spread: Vec<f64>,
    share: Vec<f64>,
    /// The mean of each leaf's samples, by node number.
    level: Vec<V>,
    pub(crate) order: Vec<u32>,
    density: LeafDensity,
    /// The largest estimate of the integral that the training came by, with its standard error.
    witness: Option<(V, V)>,
    /// Whether a sample was negative.
    signed: bool,
}

impl<V> Default for Trained<V> {
    fn default() -> Self {
        Trained {
            tree: QuadTree::default(),
            samples: Vec::new(),
            first: Vec::new(),
            stats: Vec::new(),
            heap: BinaryHeap::new(),
            strata: Vec::new(),
            spread: Vec::new(),
            share: Vec::new(),
            level: Vec::new(),
            order: Vec::new(),
            density: LeafDensity::default(),
            witness: None,
            signed: false,
        }
    }
}

impl<V: Value> Trained<V> {
    /// An empty one.
    pub fn new() -> Self {
        Trained::default()
    }

    /// Forgets everything, keeping the memory, and begins with a full tree of this depth.
    pub fn start(&mut self, level: u8) {
        self.tree.clear();
        self.tree.grow(level);
        (self.witness, self.signed) = (None, false);
        self.samples.clear();
        self.first.clear();
        self.first.resize(self.tree.node_count() as usize, NONE);
        self.stats.clear();
        self.stats.resize(self.tree.node_count() as usize, Stats::default());
    }

    /// A sample: where, and what was seen there.
    pub fn add(&mut self, uv: Uv<f64>, value: V) {
        if self.first.is_empty() {
            self.start(0);
        }
        let leaf = self.tree.leaf_at(uv) as usize;
        let drive = value.drive();
        self.signed |= drive < 0.0;
        self.samples.push(Sample { uv, value, drive, next: self.first[leaf] });
        self.first[leaf] = self.samples.len() as u32 - 1;
    }

    /// Tells of an unbiased estimate of the same integral that the training samples gave (value and standard error). The largest
    /// is kept, and [`Predicted`](super::Predicted) widens its interval where it contradicts that: the fresh samples go where the
    /// training led, and so cannot see themselves that a hit of the training was a sign of much more. [`Trained::learn`] tells
    /// of its rounds by itself.
    pub fn witness(&mut self, value: V, std_error: V) {
        if self.witness.is_none_or(|(v, _)| value.drive() > v.drive()) {
            self.witness = Some((value, std_error));
        }
    }

    /// What was told, unless there were negative samples, of which no sum says anything.
    pub(crate) fn witnessed(&self) -> Option<(V, V)> {
        self.witness.filter(|_| !self.signed)
    }

    fn of_leaf(&self, leaf: u32) -> impl Iterator<Item = &Sample<V>> {
        let start = self.first[leaf as usize];
        let chain = |i: u32| self.samples.get(i as usize);
        std::iter::successors(chain(start), move |s| chain(s.next))
    }

    fn measure(&self, leaf: u32) -> Stats {
        let (mut n, mut mean, mut m2, mut low, mut high) = (0.0, 0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        let mut dark = f64::INFINITY;
        for s in self.of_leaf(leaf) {
            n += 1.0;
            let d = s.drive - mean;
            mean += d / n;
            m2 += d * (s.drive - mean);
            low = s.drive.min(low);
            high = s.drive.max(high);
            dark = s.drive.abs().min(dark);
        }
        let variance = m2 / (n - 1.0).max(1.0);
        let low_value = if n > 0.0 { dark } else { 0.0 };
        Stats { n, mean, variance, range: (high - low).max(0.0), low: low_value, donor: 0 }
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
                self.stats[leaf as usize] = self.measure(leaf);
                self.rank(leaf, fewest);
            }
        }
        while self.tree.leaf_count() + 3 <= leaves {
            let Some((_, leaf)) = self.heap.pop() else { break };
            let Some(child) = self.divide(leaf) else { continue };
            for c in child..child + 4 {
                self.rank(c, fewest);
            }
        }
        self.grade();
    }

    fn divide(&mut self, leaf: u32) -> Option<u32> {
        let child = self.tree.cut(leaf)?;
        let parent = self.stats[leaf as usize];
        let mut darkest = (parent.donor, f64::INFINITY);
        self.first.resize(child as usize + 4, NONE);
        self.stats.resize(child as usize + 4, Stats::default());
        let mut i = std::mem::replace(&mut self.first[leaf as usize], NONE);
        while let Some(s) = self.samples.get_mut(i as usize) {
            let c = (child..child + 4).find(|c| self.tree.cell(*c).contains(s.uv)).unwrap_or(child);
            if s.drive.abs() < darkest.1 {
                darkest = (i + 1, s.drive.abs());
            }
            let next = s.next;
            s.next = self.first[c as usize];
            self.first[c as usize] = i;
            i = next;
        }
        for c in child..child + 4 {
            let own = self.measure(c);
            // Where nothing fell: as dark as the darkest that was seen nearby.
            // The fewer samples the parent had, the more its doubts are also the child's.
            let variance = parent.variance * 0.75f64.powf(parent.n);
            let dark =
                Stats { variance, mean: parent.low, low: parent.low, donor: darkest.0, ..Stats::default() };
            self.stats[c as usize] = if own.n < 1.0 { dark } else { Stats { donor: darkest.0, ..own } };
        }
        Some(child)
    }

    /// Splits leaves that are more than twice as wide as a restless neighbour, so that the density has no cliffs where a feature
    /// may reach over: a sample that hits there would weigh too much.
    fn grade(&mut self) {
        // Values differ inside, or from those next door.
        let score = |t: &Self, leaf: u32| {
            let own = t.stats[leaf as usize];
            let neighbours = t.tree.neighbours(leaf);
            let differs = |n: &u32| (t.stats[*n as usize].mean - own.mean).abs();
            neighbours.as_slice().iter().map(differs).fold(own.range, f64::max) * t.tree.area(leaf)
        };
        let top = self.tree.leaves().map(|l| score(self, l)).fold(0.0, f64::max);
        let mut leaf = 0;
        while leaf < self.tree.node_count() {
            if self.tree.is_leaf(leaf) && score(self, leaf) > RESTLESS * top {
                let level = self.tree.cell(leaf).level;
                while let Some(&wide) = self
                    .tree
                    .neighbours(leaf)
                    .as_slice()
                    .iter()
                    .find(|n| self.tree.cell(**n).level + 1 < level)
                {
                    if self.divide(wide).is_none() {
                        break;
                    }
                }
            }
            leaf += 1;
        }
    }

    fn rank(&mut self, leaf: u32, fewest: u32) {
        let s = self.stats[leaf as usize];
        let score = s.range * self.tree.area(leaf);
        if s.n >= fewest.max(2) as f64 && score > 0.0 {
            // The bits of a positive number sort like the number.
            self.heap.push((score.to_bits(), leaf));
        }
    }

    /// Takes over a tree with one sample per leaf, and the variances that were guessed from neighbours (by node number).
    pub(crate) fn adopt(&mut self, tree: &mut QuadTree, values: &[V], variance: &[f64]) {
        std::mem::swap(&mut self.tree, tree);
        (self.witness, self.signed) = (None, false);
        self.samples.clear();
        self.first.clear();
        self.first.resize(self.tree.node_count() as usize, NONE);
        self.stats.clear();
        self.stats.resize(self.tree.node_count() as usize, Stats::default());
        for leaf in 0..self.tree.node_count() {
            if !self.tree.is_leaf(leaf) {
                continue;
            }
            if let Some(&i) = self.tree.members(leaf).as_slice().first() {
                let (uv, value) = (self.tree.points()[i as usize], values[i as usize]);
                let drive = value.drive();
                self.signed |= drive < 0.0;
                self.first[leaf as usize] = self.samples.len() as u32;
                self.samples.push(Sample { uv, value, drive, next: NONE });
                let variance = variance[leaf as usize].max(0.0);
                let (range, low) = (variance.sqrt(), drive.abs());
                let stats =
                    Stats { n: 1.0, mean: drive, variance, range, low, donor: self.samples.len() as u32 };
                self.stats[leaf as usize] = stats;
            }
        }
        self.grade();
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
            // A leaf beside a restless one is not to be trusted when it looks calm, the less so the fewer samples it has; but no
            // further than the neighbour itself could contribute.
            let area = self.tree.area(leaf);
            let neighbours = self.tree.neighbours(leaf);
            let mean = self.stats[leaf as usize].mean;
            let reach = |n: &u32| {
                let differs = (self.stats[*n as usize].mean - mean).abs();
                self.spread[*n as usize].max(differs) * (self.tree.area(*n) / area).min(1.0)
            };
            let around = neighbours.as_slice().iter().map(reach).fold(0.0, f64::max);
            let doubt = 0.6 + 0.4 / (1.0 + self.stats[leaf as usize].n);
            let spread = self.spread[leaf as usize].max(doubt * around);
            self.strata.push((area, area * self.stats[leaf as usize].mean.abs(), spread));
        }
        allocation.shares(&self.strata, &mut self.share);
        self.density.set(&self.tree, &self.share);
        self.level.clear();
        self.level.resize(self.tree.node_count() as usize, V::default());
        for leaf in self.tree.leaves() {
            let (mut n, mut sum) = (0.0, V::default());
            for s in self.of_leaf(leaf) {
                n += 1.0;
                sum = sum.plus(s.value);
            }
            let donor = (self.stats[leaf as usize].donor as usize).checked_sub(1);
            self.level[leaf as usize] = match donor {
                _ if n > 0.0 => sum.times(1.0 / n),
                Some(i) => self.samples[i].value,
                None => V::default(),
            };
        }
    }

    /// Turns what was learnt into probabilities and a density.
    pub fn finish(&mut self, allocation: Allocation) {
        if self.first.is_empty() {
            self.start(0);
        }
        self.finish_with(allocation, |_, s| s);
    }

    /// Learns from `samples` evaluations of an integrand, spread by what is known so far; then refines to at most `leaves` leaves
    /// and makes a new density. Call it again and again: only samples that follow the density resolve what lies below the
    /// first ones' spacing. The integrand sees [`Stage::Pilot`].
    pub fn learn(
        &mut self,
        f: &mut dyn Integrand<V>,
        samples: u32,
        leaves: u32,
        key: Key,
        allocation: Allocation,
    ) {
        if self.level.is_empty() {
            self.finish(Allocation::Proportional);
        }
        let mut probes = [Probe::default(); 64];
        let mut weights = [0.0; 64];
        let mut values = [V::default(); 64];
        let (mut sum, mut sum2) = (V::default(), V::default());
        let (mut done, mut cursor) = (0, 0);
        while done < samples {
            let m = (samples - done).min(64) as usize;
            let mut n = 0;
            for k in 0..m as u32 {
                let t = (done + k) as f64 + key.with((done + k) as u64).uniform64(0);
                if let Some(p) = self.density.place(&self.tree, t / samples as f64, &mut cursor) {
                    probes[n] = Probe { stage: Stage::Pilot, ..Probe::at(p.uv) };
                    weights[n] = p.weight;
                    n += 1;
                }
            }
            f.eval(&probes[..n], &mut values[..n]);
            for (i, p) in probes[..n].iter().enumerate() {
                let v = values[i].times(weights[i]);
                (sum, sum2) = (sum.plus(v), sum2.plus(v.each(|x| x * x)));
                self.add(p.uv, values[i]);
            }
            done += m as u32;
        }
        if samples > 0 {
            // As if the samples were independent: spread as they are, they do better.
            let n = samples as f64;
            let variance = sum2.zip(sum, |s2, s| ((s2 - s * s / n) / (n * (n - 1.0).max(1.0))).max(0.0));
            self.witness(sum.times(1.0 / n), variance.each(f64::sqrt));
        }
        self.refine(leaves, 4);
        self.finish(allocation);
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

    /// The mean value of a leaf's samples (of its parent's darkest, where it has none): a constant control variate.
    pub fn level(&self, leaf: u32) -> V {
        self.level.get(leaf as usize).copied().unwrap_or_default()
    }

    /// The integral of [`Trained::level`] over the square as a witness, its standard error from the spread of the leaves.
    pub(crate) fn level_as_witness(&self) -> Option<(V, V)> {
        let part = |l| (self.tree.area(l) * self.spread[l as usize]).powi(2);
        let doubt = self.tree.leaves().map(part).sum::<f64>().sqrt();
        let value = self.integral();
        let scale = if value.drive() > 0.0 { doubt / value.drive() } else { 0.0 };
        (!self.signed).then(|| (value, value.times(scale)))
    }

    /// The integral of [`Trained::level`] over the square.
    pub fn integral(&self) -> V {
        let part = |leaf| self.level(leaf).times(self.tree.area(leaf));
        self.tree.leaves().fold(V::default(), |sum, leaf| sum.plus(part(leaf)))
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
