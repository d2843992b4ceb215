//! The binary tree: top-down, binned surface-area heuristic (I. Wald, *On fast Construction of SAH-based Bounding
//! Volume Hierarchies*, 2007).
//!
//! Depth is at most [`MAX_DEPTH`] and time O(n log n) on any input. An agglomerative builder (PLOC, as in obvhs 0.4)
//! takes quadratic time and depth where neighbouring boxes tie: 3.6 s and depth 8 015 for a strip of 16 000 equal
//! quads, the like for identical boxes. With reinsertion its trees were traced 10–15 % slower on displaced spheres of
//! 82 k and 1.3 M triangles and held half as much memory again; reinsertion on top of this builder gained nothing.
//!
//! One thread: the result cannot depend on their number. A million triangles take about 0.7 s.

use glam::Vec4;

use crate::bounds::Bounds;

const BINS: usize = 16;
/// Below this depth the heuristic decides; beyond, halving the primitives bounds the depth.
const HEURISTIC_DEPTH: u32 = 40;
/// Of any tree: 32 halvings exhaust the primitives.
pub(crate) const MAX_DEPTH: usize = HEURISTIC_DEPTH as usize + 32;
/// Cost of testing a box, in leaves of one pack. A box is an eighth of a node.
const BOX_COST: f32 = 0.12;

#[derive(Clone, Copy)]
pub(crate) struct Box4 {
    pub min: Vec4,
    pub max: Vec4,
}

impl Box4 {
    pub const EMPTY: Box4 = Box4 { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    pub fn new(b: &Bounds) -> Box4 {
        Box4 { min: b.min.extend(0.0), max: b.max.extend(0.0) }
    }

    #[inline(always)]
    fn grow(&mut self, other: &Box4) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    pub fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        if d.x < 0.0 { 0.0 } else { (d.x + d.y) * d.z + d.x * d.y }
    }

    /// Twice the centre.
    #[inline(always)]
    fn centre(&self) -> Vec4 {
        self.min + self.max
    }
}

/// A leaf of `count > 0` entries of [`Binary::order`] from `first`, or an inner node with children `first` and `first + 1`.
pub(crate) struct BinaryNode {
    pub bounds: Box4,
    pub first: u32,
    pub count: u32,
}

/// Root at 0; no nodes when there are no primitives.
pub(crate) struct Binary {
    pub nodes: Vec<BinaryNode>,
    /// Primitive numbers, leaf after leaf.
    pub order: Vec<u32>,
}

struct Task {
    node: usize,
    start: usize,
    end: usize,
    depth: u32,
}

/// Builds over the boxes, each with its primitive's number; all must be finite. Leaves hold at most `leaf_max`.
pub(crate) fn build(mut boxes: Vec<Box4>, mut order: Vec<u32>, leaf_max: usize) -> Binary {
    let n = boxes.len();
    let mut nodes = Vec::with_capacity(if n == 0 { 0 } else { 2 * n.div_ceil(leaf_max.div_ceil(2)) });
    if n == 0 {
        return Binary { nodes, order };
    }
    let all = bounds_of(&boxes);
    nodes.push(BinaryNode { bounds: all.0, first: 0, count: n as u32 });
    let mut tasks = vec![Task { node: 0, start: 0, end: n, depth: 0 }];
    while let Some(Task { node, start, end, depth }) = tasks.pop() {
        let part = &mut boxes[start..end];
        let ids = &mut order[start..end];
        if part.len() == 1 {
            continue;
        }
        let split =
            if depth < HEURISTIC_DEPTH { best_split(part, &nodes[node].bounds, leaf_max) } else { None };
        let middle = match split {
            Some(Split::Leaf) => continue,
            Some(Split::At(plane)) => partition(part, ids, &plane),
            None if part.len() <= leaf_max => continue,
            None => part.len() / 2,
        };
        let children = nodes.len();
        for (from, to) in [(start, start + middle), (start + middle, end)] {
            let bounds = bounds_of(&boxes[from..to]).0;
            tasks.push(Task { node: nodes.len(), start: from, end: to, depth: depth + 1 });
            nodes.push(BinaryNode { bounds, first: from as u32, count: (to - from) as u32 });
        }
        nodes[node].first = children as u32;
        nodes[node].count = 0;
    }
    Binary { nodes, order }
}

fn bounds_of(boxes: &[Box4]) -> (Box4, Box4) {
    let (mut bounds, mut centres) = (Box4::EMPTY, Box4::EMPTY);
    for b in boxes {
        bounds.grow(b);
        let c = b.centre();
        centres.grow(&Box4 { min: c, max: c });
    }
    (bounds, centres)
}

enum Split {
    Leaf,
    At(Plane),
}

/// Primitives whose bin along `axis` is at most `last` go left.
struct Plane {
    axis: usize,
    last: usize,
    origin: Vec4,
    scale: Vec4,
}

#[inline(always)]
fn bins(centre: Vec4, origin: Vec4, scale: Vec4) -> [usize; 4] {
    // `as usize` saturates and takes NaN to 0: any coordinates give a bin.
    ((centre - origin) * scale).to_array().map(|x| (x as i32).clamp(0, BINS as i32 - 1) as usize)
}

/// `None` when no plane separates the centres or no cost is finite.
fn best_split(boxes: &[Box4], node: &Box4, leaf_max: usize) -> Option<Split> {
    let (_, centres) = bounds_of(boxes);
    let extent = centres.max - centres.min;
    let origin = centres.min;
    let scale = Vec4::splat(BINS as f32 * (1.0 - f32::EPSILON)) / extent;
    let mut counts = [[0u32; BINS]; 3];
    let mut spans = [[Box4::EMPTY; BINS]; 3];
    for b in boxes {
        let at = bins(b.centre(), origin, scale);
        for axis in 0..3 {
            counts[axis][at[axis]] += 1;
            spans[axis][at[axis]].grow(b);
        }
    }
    let packs = |n: u32| (n as usize).div_ceil(leaf_max) as f32;
    let mut best = (f32::INFINITY, 0, 0);
    for axis in 0..3 {
        // A flat extent gives an infinite scale, an overflowing one zero.
        if scale[axis].is_nan() || scale[axis].is_infinite() || scale[axis] == 0.0 {
            continue;
        }
        let mut right_cost = [0.0; BINS];
        let (mut count, mut span) = (0, Box4::EMPTY);
        for i in (1..BINS).rev() {
            count += counts[axis][i];
            span.grow(&spans[axis][i]);
            right_cost[i] = if count == 0 { f32::INFINITY } else { span.half_area() * packs(count) };
        }
        let (mut count, mut span) = (0, Box4::EMPTY);
        for i in 0..BINS - 1 {
            count += counts[axis][i];
            span.grow(&spans[axis][i]);
            if count == 0 {
                continue;
            }
            let cost = span.half_area() * packs(count) + right_cost[i + 1];
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    if best.0 == f32::INFINITY {
        return None;
    }
    let area = node.half_area();
    if boxes.len() <= leaf_max && area <= best.0 + 2.0 * BOX_COST * area {
        return Some(Split::Leaf);
    }
    Some(Split::At(Plane { axis: best.1, last: best.2, origin, scale }))
}

/// Reorders in place; both sides are nonempty because the plane came from counts of the same bins.
fn partition(boxes: &mut [Box4], ids: &mut [u32], plane: &Plane) -> usize {
    let left = |b: &Box4| bins(b.centre(), plane.origin, plane.scale)[plane.axis] <= plane.last;
    let (mut i, mut j) = (0, boxes.len());
    while i < j {
        if left(&boxes[i]) {
            i += 1;
        } else {
            j -= 1;
            boxes.swap(i, j);
            ids.swap(i, j);
        }
    }
    i
}
