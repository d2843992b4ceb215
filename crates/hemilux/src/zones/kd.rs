//! Neighbourhoods: a k-d tree over places, one per facing, whose leaves hold what was found near one another.
//!
//! A node is cut where its places spread most (by variance, so that a stray does not decide), at their median; equal
//! coordinates stay together, so that every place on a plane across the cut lies on one side of it.

use super::file::ZoneFileError;
use super::wire::{Wire, wire};
use hemilux_scene::geom::Vec3;

/// A node of the tree.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// Across `axis`: below `at`, and from `at` on; each before this node in the list.
    Split { axis: u8, at: f32, children: [u32; 2] },
    /// Number of the leaf.
    Leaf(u32),
}

/// No node.
const NONE: u32 = u32::MAX;

/// The trees of the six facings.
#[derive(Clone, Debug)]
pub(super) struct Kd {
    nodes: Vec<Node>,
    /// Root per facing (±x, ±y, ±z), [`NONE`] where there is nothing.
    roots: [u32; 6],
}

wire!(Kd { nodes, roots });

impl Default for Kd {
    fn default() -> Self {
        Kd { nodes: Vec::new(), roots: [NONE; 6] }
    }
}

/// What lies in a leaf, and its box.
pub(super) struct Group<'a, T> {
    pub members: &'a [T],
    pub low: Vec3,
    pub high: Vec3,
}

impl<T> Group<'_, T> {
    /// The box, wider on every side by `part` of its size.
    pub fn dilated(&self, part: f32) -> (Vec3, Vec3) {
        let margin = Vec3::splat(part * (self.high - self.low).max_element());
        (self.low - margin, self.high + margin)
    }
}

/// Something found at a place on a side of a surface.
pub(super) trait Placed {
    fn place(&self) -> Vec3;
    fn normal(&self) -> Vec3;
}

impl Kd {
    /// Trees over `found`, and their leaves in order; `small` says which sets stay whole.
    pub fn new<T: Placed>(found: &mut [T], small: impl Fn(&[T]) -> bool) -> (Kd, Vec<Group<'_, T>>) {
        let (mut kd, mut groups) = (Kd::default(), Vec::new());
        found.sort_by_key(|f| facing(f.normal()));
        let mut rest = found;
        for side in 0..6 {
            let count = rest.partition_point(|f| facing(f.normal()) <= side);
            let (here, later) = rest.split_at_mut(count);
            rest = later;
            if !here.is_empty() {
                kd.roots[side] = kd.split(here, &small, &mut groups);
            }
        }
        (kd, groups)
    }

    fn split<'a, T: Placed>(
        &mut self,
        here: &'a mut [T],
        small: &impl Fn(&[T]) -> bool,
        groups: &mut Vec<Group<'a, T>>,
    ) -> u32 {
        let cut = if small(here) { None } else { cut(here) };
        let node = match cut {
            Some((axis, at, count)) => {
                let (left, right) = here.split_at_mut(count);
                let children = [self.split(left, small, groups), self.split(right, small, groups)];
                Node::Split { axis, at, children }
            }
            None => {
                let (low, high) = here.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |b, f| {
                    (b.0.min(f.place()), b.1.max(f.place()))
                });
                groups.push(Group { members: here, low, high });
                Node::Leaf(groups.len() as u32 - 1)
            }
        };
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// The leaf that `p` on a surface facing unit `n` belongs to.
    #[inline]
    pub fn leaf(&self, p: Vec3, n: Vec3) -> Option<usize> {
        let mut node = self.nodes.get(self.roots[facing(n)] as usize)?;
        loop {
            match node {
                Node::Split { axis, at, children } => {
                    node = &self.nodes[children[(p[*axis as usize] >= *at) as usize] as usize];
                }
                Node::Leaf(leaf) => return Some(*leaf as usize),
            }
        }
    }

    /// Every leaf of those that face unit `n` whose half-spaces the box from `low` to `high` meets.
    pub fn visit(&self, n: Vec3, low: Vec3, high: Vec3, f: &mut impl FnMut(u32)) {
        self.visit_below(self.roots[facing(n)], low, high, f);
    }

    fn visit_below(&self, node: u32, low: Vec3, high: Vec3, f: &mut impl FnMut(u32)) {
        match self.nodes.get(node as usize) {
            Some(Node::Leaf(leaf)) => f(*leaf),
            Some(Node::Split { axis, at, children }) => {
                if low[*axis as usize] < *at {
                    self.visit_below(children[0], low, high, f);
                }
                if high[*axis as usize] >= *at {
                    self.visit_below(children[1], low, high, f);
                }
            }
            None => {}
        }
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }

    /// Whether every way down ends at one of `leaves` leaves.
    pub fn is_sound(&self, leaves: usize) -> bool {
        let sound = |(i, node): (usize, &Node)| match node {
            Node::Split { axis, children, .. } => *axis < 3 && children.iter().all(|c| (*c as usize) < i),
            Node::Leaf(leaf) => (*leaf as usize) < leaves,
        };
        let rooted = |r: &u32| *r == NONE || (*r as usize) < self.nodes.len();
        self.nodes.iter().enumerate().all(sound) && self.roots.iter().all(rooted)
    }
}

/// Where to cut a set, which is put in order: axis, coordinate, number of those below. `None` where all are in one place.
fn cut<T: Placed>(here: &mut [T]) -> Option<(u8, f32, usize)> {
    let n = here.len() as f32;
    let mean = here.iter().map(|f| f.place()).sum::<Vec3>() / n;
    let spread = here.iter().map(|f| (f.place() - mean).powf(2.0)).sum::<Vec3>();
    let mut axes = [0usize, 1, 2];
    axes.sort_by(|a, b| spread[*b].total_cmp(&spread[*a]));
    for axis in axes {
        let middle = here.len() / 2;
        here.select_nth_unstable_by(middle, |a, b| a.place()[axis].total_cmp(&b.place()[axis]));
        let median = here[middle].place()[axis];
        let below = |at: f32| here.iter().filter(|f| f.place()[axis] < at).count();
        let beyond = || here.iter().map(|f| f.place()[axis]).filter(|v| *v > median).min_by(f32::total_cmp);
        let at = if below(median) > 0 { Some(median) } else { beyond() };
        let Some(at) = at else { continue };
        // Stable, so that what comes of the order does not depend on how the median was found.
        here.sort_by_key(|f| f.place()[axis] >= at);
        let count = here.partition_point(|f| f.place()[axis] < at);
        return Some((axis as u8, at, count));
    }
    None
}

/// Which of ±x, ±y, ±z a normal is closest to.
pub(super) fn facing(n: Vec3) -> usize {
    let axis = n.abs().max_position();
    axis * 2 + (n[axis] < 0.0) as usize
}

/// Interleave the bits of two numbers below 2¹⁶; `x` takes the even ones.
pub(super) fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| {
        let v = (v | v << 8) & 0x00ff_00ff;
        let v = (v | v << 4) & 0x0f0f_0f0f;
        let v = (v | v << 2) & 0x3333_3333;
        (v | v << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

impl Wire for Node {
    fn put(&self, out: &mut Vec<u8>) {
        match self {
            Node::Split { axis, at, children } => {
                axis.put(out);
                at.put(out);
                children.put(out);
            }
            Node::Leaf(leaf) => {
                u8::MAX.put(out);
                leaf.put(out);
            }
        }
    }

    fn take(at: &mut &[u8]) -> Result<Self, ZoneFileError> {
        match u8::take(at)? {
            u8::MAX => Ok(Node::Leaf(u32::take(at)?)),
            axis => Ok(Node::Split { axis, at: f32::take(at)?, children: Wire::take(at)? }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::Key;

    struct At(Vec3);

    impl Placed for At {
        fn place(&self) -> Vec3 {
            self.0
        }

        fn normal(&self) -> Vec3 {
            Vec3::Z
        }
    }

    /// A floor and one stray far above it: the stray must not shuffle the floor, whose places share a coordinate.
    #[test]
    fn a_stray_does_not_scatter_neighbours() {
        let key = Key::new(8);
        let mut found: Vec<At> =
            (0..4000).map(|i| At(Vec3::new(key.with(i).uniform(0), key.with(i).uniform(1), 0.0))).collect();
        found.push(At(Vec3::new(0.3, 0.3, 9.0)));
        let (kd, groups) = Kd::new(&mut found, |here| here.len() <= 64);
        assert!(kd.is_sound(groups.len()));
        assert_eq!(groups.iter().map(|g| g.members.len()).sum::<usize>(), 4001);
        for group in &groups {
            let floor: Vec<Vec3> = group.members.iter().map(|m| m.0).filter(|p| p.z == 0.0).collect();
            let wide = |f: &dyn Fn(&Vec3) -> f32| {
                floor.iter().map(f).fold(f32::MIN, f32::max) - floor.iter().map(f).fold(f32::MAX, f32::min)
            };
            assert!(wide(&|p| p.x) < 0.4 && wide(&|p| p.y) < 0.4, "{} m scattered", floor.len());
            for p in floor {
                let leaf = &groups[kd.leaf(p, Vec3::Z).unwrap()];
                assert!(leaf.members.iter().any(|m| m.0 == p), "{p} is not in its own leaf");
            }
        }
    }

    #[test]
    fn equal_places_are_one_leaf() {
        let mut found: Vec<At> = (0..100).map(|_| At(Vec3::ONE)).collect();
        let (kd, groups) = Kd::new(&mut found, |here| here.len() <= 8);
        assert_eq!(
            (groups.len(), kd.leaf(Vec3::ONE, Vec3::Z), kd.leaf(Vec3::ONE, Vec3::X)),
            (1, Some(0), None)
        );
    }

    #[test]
    fn loops_and_strays_are_not_trees() {
        let split = |a, b| Node::Split { axis: 0, at: 0.0, children: [a, b] };
        let kd = |nodes: Vec<Node>, root| Kd { nodes, roots: [root, NONE, NONE, NONE, NONE, NONE] };
        assert!(kd(vec![Node::Leaf(0), Node::Leaf(1), split(0, 1)], 2).is_sound(2));
        assert!(!kd(vec![Node::Leaf(0), split(0, 1)], 1).is_sound(1), "a node below itself");
        assert!(!kd(vec![Node::Leaf(3)], 0).is_sound(1), "no such leaf");
        assert!(!kd(vec![Node::Leaf(0)], 1).is_sound(1), "no such root");
    }
}
