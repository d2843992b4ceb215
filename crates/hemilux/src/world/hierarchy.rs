//! The light hierarchy: which luminaire to sample from where.
//!
//! A binary tree over luminaires after Conty Estevez and Kulla 2018 ("Importance sampling of many lights with adaptive
//! tree splitting"): every node knows a box, a cone of normals and an intensity, and a receiver judges from them how much
//! irradiance may come from there. A pick walks down, choosing between two children in proportion to their importance, and
//! consumes one number, so that systematic numbers spread over the leaves in tree order (that replaces the paper's
//! splitting). Invariants:
//!
//! - Importance is zero only where no luminaire of the node can send anything to the receiver.
//! - [`Hierarchy::probability`] repeats the arithmetic of [`Hierarchy::pick`] along the leaf's path: both agree to the bit.
//! - The tree depends on the luminaires alone; at most [`DEEPEST`] levels.
//!
//! The distance that a node counts as being away is √(d_near · d_far): 1/(d_near · d_far) is the exact mean of 1/d² over a
//! segment seen along its length, and stays close for the other shapes that rows and grids of lamps make. Inside a box the
//! nearest lamp is expected at half the spacing of the node's lamps.

use super::Surface;
use crate::bsdf::Bsdf;
use hemilux_scene::geom::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Most levels of a tree: a path fits 64 bits.
pub const DEEPEST: u32 = 60;
const LEAF: u32 = 1 << 31;
const BINS: usize = 16;

/// What picks know of the place that receives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// World position (m).
    pub p: Vec3,
    /// Unit normal on the side that receives; zero if unknown.
    pub n: Vec3,
    /// Whether directions on both sides of `n` count (transmission).
    pub both_sides: bool,
}

impl Receiver {
    /// A point that receives from everywhere.
    pub fn anywhere(p: Vec3) -> Receiver {
        Receiver { p, n: Vec3::ZERO, both_sides: true }
    }

    /// A point with a normal that receives from its side alone.
    pub fn facing(p: Vec3, n: Vec3) -> Receiver {
        Receiver { p, n, both_sides: false }
    }

    /// A surface that scatters by `bsdf`.
    pub fn surface(s: &Surface, bsdf: &Bsdf) -> Receiver {
        let n = if s.frame.n.dot(s.wo) >= 0.0 { s.frame.n } else { -s.frame.n };
        let both_sides = bsdf.lobes().iter().any(|l| l.is_transmissive());
        Receiver { p: s.p, n, both_sides }
    }

    /// Whether it receives from one known side only.
    pub fn is_one_sided(&self) -> bool {
        !self.both_sides && self.n != Vec3::ZERO
    }
}

/// Where a luminaire lies, where it shines and how much: what the tree knows of it.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Corners of a box around it (m).
    pub low: DVec3,
    /// See `low`.
    pub high: DVec3,
    /// Unit axis of the cone of its normals.
    pub axis: DVec3,
    /// Half-angle of that cone (rad), π for all directions.
    pub spread: f64,
    /// How far from its normals it shines (rad).
    pub reach: f64,
    /// Whether it shines to both sides of its normals.
    pub two_sided: bool,
    /// Intensity in its strongest direction, by luminance (W·sr⁻¹).
    pub intensity: f64,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    axis: Vec3,
    cos_spread: f32,
    cos_reach: f32,
    shine: Shine<f32>,
    /// Everything lies beyond this along `axis`: receivers behind it get nothing. -∞ if unknown.
    offset: f32,
    /// Least distance to the nearest luminaire that is believed (m).
    nearest: f32,
    /// First of two children, or `LEAF` and the luminaire; bit 30: two-sided.
    link: u32,
}

const TWO_SIDED: u32 = 1 << 30;
const INDEX: u32 = TWO_SIDED - 1;

/// The tree.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    /// Per luminaire: turns from the root, lowest bit first, and their number.
    paths: Vec<(u64, u8)>,
}

/// cos and sin of max(0, a - b) from those of a and b in [0, π].
#[inline]
fn less((cos_a, sin_a): (f32, f32), (cos_b, sin_b): (f32, f32)) -> (f32, f32) {
    if cos_a >= cos_b {
        return (1.0, 0.0);
    }
    (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b)
}

#[inline]
fn sin_of(cos: f32) -> f32 {
    (1.0 - cos * cos).max(0.0).sqrt()
}

impl Node {
    /// Estimated irradiance that the node's luminaires send to `at` without occlusion (W·m⁻², by luminance).
    #[inline]
    fn importance(&self, at: &Receiver) -> f32 {
        let (centre, half) = ((self.low + self.high) * 0.5, (self.high - self.low) * 0.5);
        let to = centre - at.p;
        let received = received(at, to, half);
        if received <= 0.0 || self.is_turned_away(at, to, half) {
            return 0.0;
        }
        let apart = to.abs();
        let outside = (apart - half).max(Vec3::ZERO).length_squared();
        let near = outside.sqrt().max(self.nearest);
        let far = (apart + half).length().max(f32::MIN_POSITIVE);
        let d2 = near * far;
        let cos = (received / d2.sqrt()).min(1.0);
        self.shine.towards(-to, outside > 0.0) * cos / d2
    }

    /// Whether every luminaire here surely shines elsewhere: the receiver is outside of the cone of its normals widened by
    /// what the box subtends.
    #[inline]
    fn is_turned_away(&self, at: &Receiver, to: Vec3, half: Vec3) -> bool {
        if self.cos_spread <= -1.0 {
            return false;
        }
        let rounding = 1e-6 * (at.p.abs().max_element() + (at.p + to).abs().max_element());
        if self.axis.dot(at.p) < self.offset - rounding {
            return true;
        }
        // A little wider than the box, so that rounding never cuts off what is there.
        let (d2, radius2) = (to.length_squared(), half.length_squared() * 1.0001);
        if d2 <= radius2 {
            return false;
        }
        let subtended2 = (radius2 / d2).min(1.0);
        let subtended = ((1.0 - subtended2).sqrt(), subtended2.sqrt());
        let cos = -self.axis.dot(to) / d2.sqrt();
        let cos = if self.link & TWO_SIDED != 0 { cos.abs() } else { cos };
        let off = less((cos, sin_of(cos)), (self.cos_spread, sin_of(self.cos_spread)));
        less(off, subtended).0 + 1e-6 <= self.cos_reach
    }
}

/// Mean of max(0, n·x) (|n·x| where both sides count) over the box of half-sides `half` around `to` (m). Zero only if all
/// of it lies behind.
#[inline]
fn received(at: &Receiver, to: Vec3, half: Vec3) -> f32 {
    if at.n == Vec3::ZERO {
        return f32::INFINITY;
    }
    let (middle, reach) = (at.n.dot(to), at.n.abs().dot(half));
    let reach = reach + 1e-6 * (at.p.abs().max_element() + to.abs().max_element());
    if middle.abs() >= reach {
        return if at.both_sides { middle.abs() } else { middle.max(0.0) };
    }
    match at.both_sides {
        true => (middle * middle + reach * reach) / (2.0 * reach),
        false => (middle + reach) * (middle + reach) / (4.0 * reach),
    }
}

/// How much a set of surfaces shines whither: moments of their normals, weighted by intensity.
///
/// Faces of intensity I along their normal n send Σ I max(0, n·w) = ½ (Σ I n·w + Σ I |n·w|) towards w; the last sum is at
/// most √(Σ I · Σ I (n·w)²) (Cauchy and Schwarz), which is exact for parallel faces and 15 % too much for a sphere.
#[derive(Clone, Copy, Debug)]
struct Shine<T> {
    weight: T,
    first: [T; 3],
    /// xx, yy, zz, xy, xz, yz.
    second: [T; 6],
}

impl Shine<f64> {
    fn leaf(e: &Extent) -> Shine<f64> {
        let a = e.axis.to_array();
        if e.spread > 0.0 || e.reach < FRAC_PI_2 - 1e-9 {
            // Alike in all directions that it reaches.
            let weight = 12f64.sqrt() * e.intensity;
            let third = weight / 3.0;
            return Shine { weight, first: [0.0; 3], second: [third, third, third, 0.0, 0.0, 0.0] };
        }
        let weight = if e.two_sided { 2.0 * e.intensity } else { e.intensity };
        let first = a.map(|x| if e.two_sided { 0.0 } else { weight * x });
        let second = [a[0] * a[0], a[1] * a[1], a[2] * a[2], a[0] * a[1], a[0] * a[2], a[1] * a[2]];
        Shine { weight, first, second: second.map(|x| weight * x) }
    }

    fn sum(&self, other: &Shine<f64>) -> Shine<f64> {
        let mut all = *self;
        all.weight += other.weight;
        (0..3).for_each(|i| all.first[i] += other.first[i]);
        (0..6).for_each(|i| all.second[i] += other.second[i]);
        all
    }

    fn single(&self) -> Shine<f32> {
        Shine {
            weight: self.weight as f32,
            first: self.first.map(|x| x as f32),
            second: self.second.map(|x| x as f32),
        }
    }
}

impl Shine<f32> {
    /// Intensity along `w` (any length); where the direction is not `known`, that of a sphere of as much.
    #[inline]
    fn towards(&self, w: Vec3, known: bool) -> f32 {
        let even = self.weight * 0.288_675_13;
        if !known {
            return even;
        }
        let [xx, yy, zz, xy, xz, yz] = self.second;
        let squares = xx * w.x * w.x
            + yy * w.y * w.y
            + zz * w.z * w.z
            + 2.0 * (xy * w.x * w.y + xz * w.x * w.z + yz * w.y * w.z);
        let net = self.first[0] * w.x + self.first[1] * w.y + self.first[2] * w.z;
        let all = 0.5 * (net + (self.weight * squares.max(0.0)).sqrt()) / w.length_squared().sqrt();
        all.max(1e-3 * even)
    }
}

impl Hierarchy {
    /// The tree over luminaires numbered as in `extents`.
    pub fn new(extents: &[Extent]) -> Hierarchy {
        let mut tree = Hierarchy { nodes: Vec::new(), paths: vec![(0, 0); extents.len()] };
        if extents.is_empty() {
            return tree;
        }
        let mut order: Vec<u32> = (0..extents.len() as u32).collect();
        tree.nodes.push(Summary::leaf(&extents[0]).node(0));
        let summary = tree.build(extents, &mut order, 0, 0, 0);
        let link = tree.nodes[0].link;
        tree.nodes[0] = summary.node(link);
        tree
    }

    /// Fill in node `at` (its link) over `order`; returns what it sums up to.
    fn build(&mut self, extents: &[Extent], order: &mut [u32], at: usize, path: u64, depth: u32) -> Summary {
        if let [only] = *order {
            self.nodes[at].link = LEAF | only;
            self.paths[only as usize] = (path, depth as u8);
            return Summary::leaf(&extents[only as usize]);
        }
        let middle = split(extents, order, depth);
        let (left, right) = order.split_at_mut(middle);
        let child = self.nodes.len();
        let blank = self.nodes[at];
        self.nodes.extend([blank, blank]);
        self.nodes[at].link = child as u32;
        let a = self.build(extents, left, child, path, depth + 1);
        let b = self.build(extents, right, child + 1, path | 1 << depth, depth + 1);
        for (summary, i) in [(&a, child), (&b, child + 1)] {
            let link = self.nodes[i].link;
            self.nodes[i] = summary.node(link);
        }
        a.union(&b)
    }

    /// Whether there is nothing to pick.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Levels below the root.
    pub fn depth(&self) -> u32 {
        self.paths.iter().map(|p| p.1 as u32).max().unwrap_or(0)
    }

    /// Estimated irradiance that everything here sends to `at` without occlusion (W·m⁻², by luminance).
    pub fn importance(&self, at: &Receiver) -> f32 {
        self.nodes.first().map_or(0.0, |n| n.importance(at))
    }

    /// Probability of the first child of two.
    #[inline]
    fn first(&self, child: usize, at: &Receiver) -> Option<f32> {
        let (a, b) = (self.nodes[child].importance(at), self.nodes[child + 1].importance(at));
        let sum = a + b;
        (sum > 0.0 && sum.is_finite()).then(|| a / sum)
    }

    /// A luminaire for `u` in [0, 1) and its probability; `None` where `u` falls on luminaires that cannot be seen.
    #[inline]
    pub fn pick(&self, at: &Receiver, u: f32) -> Option<(u32, f32)> {
        let mut link = self.nodes.first()?.link;
        let (mut u, mut probability) = (u, 1.0);
        while link & LEAF == 0 {
            let child = (link & INDEX) as usize;
            let p = self.first(child, at)?;
            let second = u >= p;
            if second {
                u = (u - p) / (1.0 - p);
                probability *= 1.0 - p;
            } else {
                u /= p;
                probability *= p;
            }
            u = u.clamp(0.0, 1.0 - f32::EPSILON / 2.0);
            link = self.nodes[child + second as usize].link;
        }
        Some((link & INDEX, probability))
    }

    /// Probability with which [`Hierarchy::pick`] finds `luminaire` for a uniform number.
    pub fn probability(&self, at: &Receiver, luminaire: u32) -> f32 {
        let (mut path, turns) = self.paths[luminaire as usize];
        let mut link = self.nodes[0].link;
        let mut probability = 1.0;
        for _ in 0..turns {
            let child = (link & INDEX) as usize;
            let Some(p) = self.first(child, at) else { return 0.0 };
            let second = path & 1 == 1;
            probability *= if second { 1.0 - p } else { p };
            if probability == 0.0 {
                return 0.0;
            }
            link = self.nodes[child + second as usize].link;
            path >>= 1;
        }
        probability
    }
}

/// A node while the tree is built.
#[derive(Clone, Copy, Debug)]
struct Summary {
    extent: Extent,
    shine: Shine<f64>,
    offset: f64,
    count: u32,
}

impl Summary {
    fn leaf(e: &Extent) -> Summary {
        let flat = e.spread == 0.0 && !e.two_sided;
        let corner = DVec3::select(e.axis.cmpgt(DVec3::ZERO), e.low, e.high);
        let offset = if flat { e.axis.dot(corner) } else { f64::NEG_INFINITY };
        Summary { extent: *e, shine: Shine::leaf(e), offset, count: 1 }
    }

    fn union(&self, other: &Summary) -> Summary {
        let (a, b) = (&self.extent, &other.extent);
        let mut extent = Extent {
            low: a.low.min(b.low),
            high: a.high.max(b.high),
            two_sided: a.two_sided && b.two_sided,
            reach: a.reach.max(b.reach),
            ..*a
        };
        if a.two_sided == b.two_sided {
            let turned = if a.two_sided && a.axis.dot(b.axis) < 0.0 { -b.axis } else { b.axis };
            (extent.axis, extent.spread) = cone_union((a.axis, a.spread), (turned, b.spread));
        } else {
            extent.spread = PI;
        }
        extent.intensity = a.intensity + b.intensity;
        let parallel = extent.spread < 1e-6 && !extent.two_sided;
        let offset = if parallel { self.offset.min(other.offset) } else { f64::NEG_INFINITY };
        Summary { extent, shine: self.shine.sum(&other.shine), offset, count: self.count + other.count }
    }

    fn node(&self, link: u32) -> Node {
        let e = &self.extent;
        let size = (e.high - e.low).length();
        let nearest = (0.25 * size / (self.count as f64).sqrt()).max(1e-6 * size).max(1e-30);
        // Rounded outwards.
        let slack = 1e-7 * (e.low.abs().max_element().max(e.high.abs().max_element()));
        Node {
            low: (e.low - slack).as_vec3(),
            high: (e.high + slack).as_vec3(),
            axis: e.axis.as_vec3(),
            cos_spread: if e.spread >= PI - 1e-3 { -1.0 } else { (e.spread + 1e-5).cos() as f32 },
            cos_reach: if e.reach >= FRAC_PI_2 - 1e-3 && e.reach <= FRAC_PI_2 {
                0.0
            } else {
                (e.reach + 1e-3).min(PI).cos() as f32
            },
            shine: self.shine.single(),
            offset: (self.offset - slack) as f32,
            nearest: nearest as f32,
            link: link | if e.two_sided { TWO_SIDED } else { 0 },
        }
    }

    /// How much of all directions the node shines into (Conty Estevez and Kulla, eq. 1), and its size.
    fn cost(&self) -> f64 {
        let e = &self.extent;
        let (o, w) = (e.spread, (e.spread + e.reach).min(PI));
        let orientation = TAU * (1.0 - o.cos())
            + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
        // The square of the diagonal instead of the surface: rows of lamps have no surface.
        e.intensity * orientation.max(1e-3) * (e.high - e.low).length_squared()
    }
}

/// The narrowest cone around two.
fn cone_union((a, spread_a): (DVec3, f64), (b, spread_b): (DVec3, f64)) -> (DVec3, f64) {
    let ((a, wide), (b, slim)) =
        if spread_a >= spread_b { ((a, spread_a), (b, spread_b)) } else { ((b, spread_b), (a, spread_a)) };
    let between = a.cross(b).length().atan2(a.dot(b));
    if (between + slim).min(PI) <= wide {
        return (a, wide);
    }
    let spread = 0.5 * (wide + between + slim);
    let across = (b - a * a.dot(b)).normalize_or_zero();
    if spread >= PI || across == DVec3::ZERO {
        return (a, if between < 1.0 { wide.max(slim) } else { PI });
    }
    let turn = spread - wide;
    (a * turn.cos() + across * turn.sin(), spread)
}

/// Order `order` and say where to cut it: the cheapest of binned cuts along the three axes (surface area orientation
/// heuristic), halves where nothing tells them apart or the tree grows too deep.
fn split(extents: &[Extent], order: &mut [u32], depth: u32) -> usize {
    let centre = |i: u32| (extents[i as usize].low + extents[i as usize].high) * 0.5;
    let low = order.iter().fold(DVec3::INFINITY, |m, &i| m.min(centre(i)));
    let high = order.iter().fold(DVec3::NEG_INFINITY, |m, &i| m.max(centre(i)));
    let size = high - low;
    let halves = |order: &mut [u32]| {
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
        });
        middle
    };
    if depth + 2 * order.len().ilog2() >= DEEPEST {
        return halves(order);
    }
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in 0..3 {
        // Also catches what is not a number.
        if size[axis].is_nan() || size[axis] <= 0.0 {
            continue;
        }
        let mut bins: [Option<Summary>; BINS] = [None; BINS];
        for &i in order.iter() {
            let bin = &mut bins[bin_of(centre(i)[axis], low[axis], size[axis])];
            let leaf = Summary::leaf(&extents[i as usize]);
            *bin = Some(bin.map_or(leaf, |b| b.union(&leaf)));
        }
        let join = |a: Option<Summary>, b: Option<Summary>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(&b)),
            (a, b) => a.or(b),
        };
        let mut above = [None; BINS];
        let mut all = None;
        for k in (1..BINS).rev() {
            all = join(bins[k], all);
            above[k] = all;
        }
        let mut below = None;
        for k in 1..BINS {
            below = join(below, bins[k - 1]);
            let (Some(a), Some(b)) = (&below, &above[k]) else { continue };
            // Cuts across the longest side are preferred.
            let cost = (a.cost() + b.cost()) * size.max_element() / size[axis];
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, k));
            }
        }
    }
    let Some((_, axis, k)) = best else { return halves(order) };
    order.sort_by_key(|&i| bin_of(centre(i)[axis], low[axis], size[axis]) >= k);
    order.partition_point(|&i| bin_of(centre(i)[axis], low[axis], size[axis]) < k)
}

fn bin_of(x: f64, low: f64, size: f64) -> usize {
    (((x - low) / size * BINS as f64) as usize).min(BINS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::Key;

    /// Lamps of every kind, scattered and piled up.
    fn extents(n: usize) -> Vec<Extent> {
        let key = Key::new(5);
        (0..n)
            .map(|i| {
                let u = |d: u32| key.with(i as u64).uniform(d) as f64;
                // A third of them in one spot.
                let spread = if i % 3 == 0 { 0.0 } else { 10.0 };
                let centre = DVec3::new(u(0), u(1), u(2)) * spread;
                let size = DVec3::splat(1e-3 + 0.1 * u(3));
                let axis = (DVec3::new(u(4), u(5), u(6)) - 0.5).normalize();
                Extent {
                    low: centre - size,
                    high: centre + size,
                    axis,
                    spread: if i % 2 == 0 { 0.0 } else { PI },
                    reach: if i % 5 == 0 { 0.4 } else { FRAC_PI_2 },
                    two_sided: i % 4 == 0,
                    intensity: 0.1 + 10.0 * u(7) * u(8),
                }
            })
            .collect()
    }

    fn receivers() -> Vec<Receiver> {
        let up = Vec3::new(0.3, 0.2, 0.9).normalize();
        vec![
            Receiver::anywhere(Vec3::splat(5.0)),
            Receiver::facing(Vec3::new(5.0, 5.0, -1.0), up),
            Receiver::facing(Vec3::new(20.0, 5.0, 1.0), -up),
            Receiver { p: Vec3::new(1.0, 9.0, 3.0), n: up, both_sides: true },
        ]
    }

    /// A pick takes up an interval of `u` as long as its probability: systematic numbers hit it as often, ±1. Halving
    /// one probability would be noticed.
    #[test]
    fn picks_fill_intervals_of_their_probability() {
        for n in [1, 2, 3, 17, 400] {
            let tree = Hierarchy::new(&extents(n));
            assert!(tree.depth() <= DEEPEST);
            for at in receivers() {
                let draws = 1 << 16;
                let mut counts = vec![0u32; n];
                for k in 0..draws {
                    if let Some((i, p)) = tree.pick(&at, (k as f32 + 0.5) / draws as f32) {
                        assert_eq!(p, tree.probability(&at, i));
                        counts[i as usize] += 1;
                    }
                }
                let mut sum = 0.0;
                for (i, &count) in counts.iter().enumerate() {
                    let p = tree.probability(&at, i as u32);
                    sum += p;
                    // Rounding of u shifts an end by less than one number.
                    assert!((count as f32 - p * draws as f32).abs() <= 2.0, "{n} {i}: {count} and {p}");
                }
                assert!(sum < 1.0 + 1e-5, "{sum}");
            }
        }
    }

    /// What can shine on the receiver is picked with a probability above zero, and what cannot is left out.
    #[test]
    fn only_what_cannot_shine_here_is_left_out() {
        let all = extents(300);
        let tree = Hierarchy::new(&all);
        let mut left_out = 0;
        for at in receivers() {
            for (i, e) in all.iter().enumerate() {
                let to = (e.low + e.high) * 0.5 - at.p.as_dvec3();
                let wi = to.normalize();
                let shines = if e.spread == PI {
                    true
                } else {
                    let cos = -e.axis.dot(wi);
                    (if e.two_sided { cos.abs() } else { cos }) > e.reach.cos()
                };
                let received = !at.is_one_sided() || at.n.as_dvec3().dot(wi) > 0.0;
                let p = tree.probability(&at, i as u32);
                if shines && received {
                    assert!(p > 0.0, "{at:?} {e:?}");
                }
                left_out += (p == 0.0) as u32;
            }
        }
        assert!(left_out > 200, "{left_out}");
    }

    /// A thousand lamps in one point, and a row whose spacing doubles, do not degenerate.
    #[test]
    fn awkward_sets_keep_the_depth() {
        let one = extents(1)[0];
        assert!(Hierarchy::new(&vec![one; 1000]).depth() <= 11);
        let row: Vec<Extent> = (0..1000)
            .map(|i| {
                let shift = DVec3::X * 1.5f64.powi(i % 200);
                Extent { low: one.low + shift, high: one.high + shift, ..one }
            })
            .collect();
        assert!(Hierarchy::new(&row).depth() <= DEEPEST);
        let bad = Extent { low: DVec3::NAN, intensity: f64::NAN, ..one };
        let tree = Hierarchy::new(&[one, bad, one, bad]);
        let _ = tree.pick(&receivers()[0], 0.7);
    }
}
