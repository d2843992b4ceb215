//! A quadtree in an index arena whose leaves are linked in Morton order.

use super::{Few, Partition, rectangle};
use crate::curve;
use crate::map::Uv;
use crate::points::Key;

const NONE: u32 = u32::MAX;

/// What becomes of the sample of a cell that is split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parent {
    /// The child in which it lies keeps it: three new samples per split.
    #[default]
    Keep,
    /// It is dropped and every child draws its own: four new samples per split. What was found can be lost again.
    Drop,
}

/// A square of side 2^-level whose lower corner is (x, y) · 2^-level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Depth below the unit square.
    pub level: u8,
}

impl Cell {
    /// Length of a side.
    #[inline(always)]
    pub fn side(self) -> f64 {
        // 2^-level, from the exponent's bits.
        f64::from_bits((1023 - self.level as u64) << 52)
    }

    /// Carries a point of the unit square into the cell.
    #[inline(always)]
    pub fn at(self, p: Uv<f64>) -> Uv<f64> {
        let h = self.side();
        Uv::new((self.x as f64 + p.u) * h, (self.y as f64 + p.v) * h)
    }

    /// Its area.
    #[inline(always)]
    pub fn area(self) -> f64 {
        self.side() * self.side()
    }

    /// Whether it holds a point.
    #[inline(always)]
    pub fn contains(self, p: Uv<f64>) -> bool {
        let k = (1u64 << self.level) as f64;
        (p.u * k) as u32 == self.x && (p.v * k) as u32 == self.y
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    cell: Cell,
    /// First of four children, or `NONE` for a leaf.
    child: u32,
    /// The next leaf in Morton order (leaves only).
    next: u32,
    previous: u32,
    /// The sample that speaks for the leaf.
    sample: u32,
}

/// The quadtree. Nodes are numbered in the order of their making; node 0 is the whole square.
#[derive(Clone, Debug)]
pub struct QuadTree {
    nodes: Vec<Node>,
    /// What lies across the edges of a node (lower u, upper u, lower v, upper v): the smallest node no smaller than itself that
    /// was there when it was made. The leaves of today are that one or below it.
    sides: Vec<[u32; 4]>,
    points: Vec<Uv<f64>>,
    touched: Vec<u32>,
    leaves: u32,
    /// The level down to which [`QuadTree::grow`] has made the tree full. Its nodes stand in Morton order.
    full: u8,
    parent: Parent,
    /// How far samples stray from the centre of their cell: 1 for uniform ones.
    stray: f64,
}

impl Default for QuadTree {
    fn default() -> Self {
        Self::new(Parent::Keep)
    }
}

impl QuadTree {
    /// Cells are not split below this level: a side of 2^-20, about 6e-12 sr on the hemisphere.
    pub const DEEPEST: u8 = 20;

    /// The whole square as one leaf.
    pub fn new(parent: Parent) -> Self {
        let mut tree = QuadTree {
            nodes: Vec::new(),
            sides: Vec::new(),
            points: Vec::new(),
            touched: Vec::new(),
            leaves: 1,
            full: 0,
            parent,
            stray: 1.0,
        };
        tree.clear();
        tree
    }

    /// Back to one leaf, keeping the memory.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.sides.clear();
        self.points.clear();
        self.touched.clear();
        self.full = 0;
        self.leaves = 1;
        let cell = Cell { x: 0, y: 0, level: 0 };
        self.nodes.push(Node { cell, child: NONE, next: NONE, previous: NONE, sample: NONE });
        self.sides.push([NONE; 4]);
    }

    /// What a split does to the cell's sample; takes effect from the next one.
    pub fn set_parent(&mut self, parent: Parent) {
        self.parent = parent;
    }

    /// How far new samples stray from the centre of their cell: 1 (the default) makes them uniform, 0 puts them at the centre,
    /// where a feature half a diagonal wide cannot be missed. For pilots only: a partition sum over centres is no Monte Carlo.
    pub fn set_stray(&mut self, stray: f64) {
        self.stray = stray.clamp(0.0, 1.0);
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> u32 {
        self.leaves
    }

    /// Number of nodes, inner ones included.
    pub fn node_count(&self) -> u32 {
        self.nodes.len() as u32
    }

    /// The square of a node.
    #[inline(always)]
    pub fn cell(&self, node: u32) -> Cell {
        self.nodes[node as usize].cell
    }

    /// Whether a node is a leaf.
    #[inline(always)]
    pub fn is_leaf(&self, node: u32) -> bool {
        self.nodes[node as usize].child == NONE
    }

    /// The four children of an inner node are this one and the next three, in Morton order; `None` for a leaf.
    #[inline(always)]
    pub fn children(&self, node: u32) -> Option<u32> {
        let c = self.nodes[node as usize].child;
        (c != NONE).then_some(c)
    }

    /// The leaf that holds a point (points outside are taken to the nearest edge).
    #[inline]
    pub fn leaf_at(&self, p: Uv<f64>) -> u32 {
        let fixed = |x: f64| (x.clamp(0.0, 1.0) * 4_294_967_296.0).min(4_294_967_295.0) as u32;
        self.leaf_at_fixed(fixed(p.u), fixed(p.v))
    }

    #[inline]
    fn leaf_at_fixed(&self, u: u32, v: u32) -> u32 {
        // Begin at the full level, whose first node comes after 1 + 4 + 16 + … others.
        let top = 32 - self.full as u32;
        let begin = ((1u64 << (2 * self.full as u32)) / 3) as u32;
        let mut node = begin + curve::interleave((u as u64 >> top) as u32, (v as u64 >> top) as u32) as u32;
        let mut shift = top.wrapping_sub(1);
        loop {
            let child = self.nodes[node as usize].child;
            if child == NONE {
                return node;
            }
            node = child + ((u >> shift) & 1) + 2 * ((v >> shift) & 1);
            shift = shift.wrapping_sub(1);
        }
    }

    /// The leaves in Morton order.
    pub fn leaves(&self) -> impl Iterator<Item = u32> + '_ {
        let mut first = 0;
        while let Some(c) = self.children(first) {
            first = c;
        }
        std::iter::successors(Some(first), |&n| {
            let next = self.nodes[n as usize].next;
            (next != NONE).then_some(next)
        })
    }

    /// Cuts a leaf into four and returns the first child; `None` at the deepest level or when it is no leaf. Draws no samples.
    #[inline]
    pub fn cut(&mut self, leaf: u32) -> Option<u32> {
        let Node { cell, child, next, previous, .. } = self.nodes[leaf as usize];
        if child != NONE || cell.level >= Self::DEEPEST {
            return None;
        }
        let first = self.nodes.len() as u32;
        for k in 0..4 {
            self.nodes.push(Node {
                cell: Cell { x: 2 * cell.x + (k & 1), y: 2 * cell.y + (k >> 1), level: cell.level + 1 },
                child: NONE,
                next: if k < 3 { first + k + 1 } else { next },
                previous: if k > 0 { first + k - 1 } else { previous },
                sample: NONE,
            });
        }
        let around = self.sides[leaf as usize];
        // The part of what lies across an edge of the parent that faces a child: the one in column and row (x, y) of the children's
        // level, or the leaf that holds it.
        let half = 31 - cell.level as u32;
        let facing = |edge: usize, x: u32, y: u32| match around[edge] {
            NONE => NONE,
            side => self.descend(side, cell.level + 1, (x << half, y << half)),
        };
        let (x, y) = (2 * cell.x, 2 * cell.y);
        let (left, right, below, above) = (x.wrapping_sub(1), x + 2, y.wrapping_sub(1), y + 2);
        let sides = [
            [facing(0, left, y), first + 1, facing(2, x, below), first + 2],
            [first, facing(1, right, y), facing(2, x + 1, below), first + 3],
            [facing(0, left, y + 1), first + 3, first, facing(3, x, above)],
            [first + 2, facing(1, right, y + 1), first + 1, facing(3, x + 1, above)],
        ];
        self.sides.extend(sides);
        self.nodes[leaf as usize].child = first;
        if previous != NONE {
            self.nodes[previous as usize].next = first;
        }
        if next != NONE {
            self.nodes[next as usize].previous = first + 3;
        }
        self.leaves += 3;
        Some(first)
    }

    /// Cuts every leaf down to a level.
    pub fn grow(&mut self, level: u8) {
        // The short cut of `leaf_at` holds for trees grown from the root; ten levels of it are plenty.
        if self.leaves == 1 {
            self.full = level.min(10);
        }
        let mut node = 0;
        while (node as usize) < self.nodes.len() {
            if self.cell(node).level < level.min(Self::DEEPEST) {
                self.cut(node);
            }
            node += 1;
        }
    }

    fn draw(&mut self, node: u32, key: Key) {
        let i = self.points.len() as u32;
        let r = key.with(i as u64).uniform2_f64(0);
        let near = |x: f64| 0.5 + self.stray * (x - 0.5);
        let p = self.cell(node).at(Uv::new(near(r.u), near(r.v)));
        self.nodes[node as usize].sample = i;
        self.points.push(p);
    }

    /// From a node down to the leaf, or the node of a level, that holds a point given in 32 binary digits.
    #[inline]
    fn descend(&self, mut node: u32, level: u8, (u, v): (u32, u32)) -> u32 {
        loop {
            let Node { cell, child, .. } = self.nodes[node as usize];
            if child == NONE || cell.level >= level {
                return node;
            }
            let shift = 31 - cell.level as u32;
            node = child + ((u >> shift) & 1) + 2 * ((v >> shift) & 1);
        }
    }

    /// Calls back for the leaves across the four edges, two per edge when they are smaller.
    #[inline]
    fn across(&self, node: u32, mut visit: impl FnMut(u32)) {
        let Cell { x, y, level } = self.cell(node);
        if level == 0 {
            return;
        }
        // Two of the neighbours are siblings; as leaves they come last.
        let (beside, above) = (1 - (x & 1) as usize, 3 - (y & 1) as usize);
        let mut siblings = [NONE; 2];
        for (edge, &side) in self.sides[node as usize].iter().enumerate() {
            if side == NONE {
                continue;
            }
            if self.is_leaf(side) {
                if edge == beside {
                    siblings[0] = side;
                } else if edge == above {
                    siblings[1] = side;
                } else {
                    visit(side);
                }
                continue;
            }
            // The two leaves at a quarter and three quarters of the edge; the second look is needed only when the first met a
            // smaller one.
            let size = 1u32 << (32 - level as u32);
            let (x0, y0) = (x * size, y * size);
            let (near, far) = (size / 4, size - size / 4 - 1);
            let at = |along: u32| match edge {
                0 => (x0.wrapping_sub(1), y0 + along),
                1 => (x0.wrapping_add(size), y0 + along),
                2 => (x0 + along, y0.wrapping_sub(1)),
                _ => (x0 + along, y0.wrapping_add(size)),
            };
            let top = self.descend(side, level, at(near));
            let a = self.descend(top, u8::MAX, at(near));
            visit(a);
            if self.cell(a).level > level {
                visit(self.descend(top, u8::MAX, at(far)));
            }
        }
        siblings.iter().filter(|s| **s != NONE).for_each(|s| visit(*s));
    }
}

impl Partition for QuadTree {
    /// The finest full level with at most `n` leaves, one uniform sample in each.
    fn seed(&mut self, n: u32, key: Key) {
        self.clear();
        self.grow((n.max(1).ilog2() / 2) as u8);
        let mut node = 0;
        while node < self.node_count() {
            if self.is_leaf(node) {
                self.draw(node, key);
                self.touched.push(node);
            }
            node += 1;
        }
    }

    fn split(&mut self, cell: u32, key: Key) -> bool {
        let Some(first) = self.cut(cell) else { return false };
        self.touched.clear();
        let old = self.nodes[cell as usize].sample;
        for child in first..first + 4 {
            self.touched.push(child);
            if self.parent == Parent::Keep
                && old != NONE
                && self.cell(child).contains(self.points[old as usize])
            {
                self.nodes[child as usize].sample = old;
            } else {
                self.draw(child, key);
            }
        }
        true
    }

    fn points(&self) -> &[Uv<f64>] {
        &self.points
    }

    fn cells(&self) -> u32 {
        self.node_count()
    }

    fn is_cell(&self, cell: u32) -> bool {
        self.is_leaf(cell)
    }

    #[inline]
    fn area(&self, cell: u32) -> f64 {
        self.cell(cell).area()
    }

    #[inline]
    fn members(&self, cell: u32) -> Few {
        let mut few = Few::default();
        let s = self.nodes[cell as usize].sample;
        if s != NONE {
            few.push_new(s);
        }
        few
    }

    #[inline]
    fn mean(&self, cell: u32, values: &[f64]) -> f64 {
        values.get(self.nodes[cell as usize].sample as usize).copied().unwrap_or(0.0)
    }

    #[inline]
    fn neighbours(&self, cell: u32) -> Few {
        let mut few = Few::default();
        // No leaf lies across two edges, nor twice across one.
        self.across(cell, |n| few.push_new(n));
        few
    }

    fn outline(&self, cell: u32, polygon: &mut Vec<Uv<f64>>) {
        let cell = self.cell(cell);
        rectangle(cell.at(Uv::new(0.0, 0.0)), cell.at(Uv::new(1.0, 1.0)), polygon);
    }

    fn touched(&self) -> &[u32] {
        &self.touched
    }

    fn samples_per_split(&self) -> u32 {
        4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ragged() -> QuadTree {
        let mut t = QuadTree::default();
        t.seed(64, Key::new(1));
        for i in 0..200u64 {
            let leaf = t.leaf_at(Key::new(2).with(i % 40).uniform2_f64(0));
            t.split(leaf, Key::new(3));
        }
        t
    }

    #[test]
    fn leaves_tile_the_square_in_morton_order() {
        let t = ragged();
        let area: f64 = t.leaves().map(|l| t.area(l)).sum();
        assert!((area - 1.0).abs() < 1e-12);
        assert_eq!(t.leaves().count() as u32, t.leaf_count());
        let order: Vec<f64> =
            t.leaves().map(|l| crate::curve::position(t.cell(l).at(Uv::new(0.5, 0.5)))).collect();
        assert!(order.windows(2).all(|w| w[0] < w[1]));
        for l in t.leaves() {
            let p = t.cell(l).at(Uv::new(0.3, 0.9));
            assert_eq!(t.leaf_at(p), l);
            assert!(t.cell(l).contains(p));
            assert_eq!(t.members(l).as_slice().len(), 1);
            assert!(t.cell(l).contains(t.points()[t.members(l).as_slice()[0] as usize]));
        }
    }

    #[test]
    fn neighbours_touch_and_keep_differs_from_drop() {
        let t = ragged();
        for l in t.leaves() {
            let c = t.cell(l);
            for &n in t.neighbours(l).as_slice() {
                let d = t.cell(n);
                let (p, q) = (c.at(Uv::new(0.5, 0.5)), d.at(Uv::new(0.5, 0.5)));
                let reach = 0.5 * (c.side() + d.side());
                let gap = (p.u - q.u).abs().max((p.v - q.v).abs());
                assert!(n != l && (gap - reach).abs() < 1e-12);
            }
        }
        for (parent, new) in [(Parent::Keep, 3), (Parent::Drop, 4)] {
            let mut t = QuadTree::new(parent);
            t.seed(16, Key::new(1));
            assert_eq!(t.points().len(), 16);
            let leaf = t.leaf_at(Uv::new(0.1, 0.1));
            assert!(t.split(leaf, Key::new(2)));
            assert_eq!(t.points().len(), 16 + new);
            assert!(!t.split(leaf, Key::new(2)));
        }
    }
}
