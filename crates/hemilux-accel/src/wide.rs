//! The 8-wide tree, collapsed from the binary one by opening the child of the largest area first
//! (I. Wald, C. Benthin, S. Boulos, *Getting Rid of Packets*, 2008).

use crate::bounds::Bounds;
use crate::build::{Binary, Box4};

/// Children per node.
pub(crate) const WIDTH: usize = 8;
/// Marks a child code as a leaf.
pub(crate) const LEAF: u32 = 1 << 31;

/// Eight child boxes in structure-of-arrays order. Four cache lines.
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Axis, lower or upper plane, child.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// Node index, or [`LEAF`] | leaf index.
    pub child: [u32; WIDTH],
    /// Bit i: child i exists.
    pub present: u32,
}

/// A tree whose leaves are numbers the owner understands.
pub(crate) struct Wide {
    pub nodes: Vec<Node>,
    pub bounds: Bounds,
}

impl Wide {
    /// `leaf` turns the primitives of a leaf (an entry of `order` each) into its number below 2³¹. The root is always a node.
    pub fn from_binary(binary: &Binary, mut leaf: impl FnMut(&[u32]) -> u32) -> Wide {
        let Some(root) = binary.nodes.first() else {
            return Wide { nodes: Vec::new(), bounds: Bounds::EMPTY };
        };
        let bounds = Bounds { min: root.bounds.min.truncate(), max: root.bounds.max.truncate() };
        let mut nodes: Vec<Node> = Vec::new();
        nodes.push(EMPTY_NODE);
        // Depth first, so that subtrees are contiguous in memory.
        let mut todo = vec![(0usize, 0usize)];
        while let Some((from, to)) = todo.pop() {
            let (children, count) = open(binary, from);
            let mut inner = Vec::with_capacity(WIDTH);
            for (slot, &b) in children[..count].iter().enumerate() {
                let source = &binary.nodes[b];
                let code = if source.count > 0 {
                    let first = source.first as usize;
                    LEAF | leaf(&binary.order[first..first + source.count as usize])
                } else {
                    nodes.push(EMPTY_NODE);
                    inner.push((b, nodes.len() - 1));
                    (nodes.len() - 1) as u32
                };
                nodes[to].set(slot, &source.bounds, code);
            }
            todo.extend(inner.into_iter().rev());
        }
        Wide { nodes, bounds }
    }

    pub fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }
}

const EMPTY_NODE: Node =
    Node { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], child: [0; WIDTH], present: 0 };

impl Node {
    fn set(&mut self, slot: usize, bounds: &Box4, code: u32) {
        for axis in 0..3 {
            self.planes[axis][0][slot] = bounds.min[axis];
            self.planes[axis][1][slot] = bounds.max[axis];
        }
        self.child[slot] = code;
        self.present |= 1 << slot;
    }
}

/// Up to eight descendants of `from` that together cover it.
fn open(binary: &Binary, from: usize) -> ([usize; WIDTH], usize) {
    let mut children = [0; WIDTH];
    children[0] = from;
    let mut count = 1;
    while count < WIDTH {
        let mut largest: Option<(f32, usize)> = None;
        for (slot, &b) in children[..count].iter().enumerate() {
            let node = &binary.nodes[b];
            let area = node.bounds.half_area();
            if node.count == 0 && largest.is_none_or(|(a, _)| area > a) {
                largest = Some((area, slot));
            }
        }
        let Some((_, slot)) = largest else { break };
        let first = binary.nodes[children[slot]].first as usize;
        children[slot] = first;
        children[count] = first + 1;
        count += 1;
    }
    (children, count)
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;
    use crate::build::{MAX_DEPTH, build};

    fn boxes(n: u32, place: impl Fn(f32) -> (Vec3, Vec3)) -> (Vec<Box4>, Vec<u32>) {
        let at = |i| {
            let (min, max) = place(i as f32);
            Box4::new(&Bounds { min, max })
        };
        ((0..n).map(at).collect(), (0..n).collect())
    }

    /// Primitives found below `node` and the depth of the tree; checks that boxes contain those below them.
    fn walk(tree: &Wide, leaves: &[Vec<u32>], all: &[Box4]) -> (Vec<u32>, usize) {
        let (mut seen, mut depth) = (Vec::new(), 0);
        let mut todo = vec![(0u32, 1usize, tree.bounds)];
        while let Some((code, level, outer)) = todo.pop() {
            depth = depth.max(level);
            let node = &tree.nodes[code as usize];
            for slot in (0..WIDTH).filter(|i| node.present >> i & 1 == 1) {
                let plane =
                    |side: usize| Vec3::from_array([0, 1, 2].map(|axis| node.planes[axis][side][slot]));
                let inner = Bounds { min: plane(0), max: plane(1) };
                assert_eq!(outer.union(inner), outer);
                let child = node.child[slot];
                if child & LEAF == 0 {
                    todo.push((child, level + 1, inner));
                    continue;
                }
                for &prim in &leaves[(child & !LEAF) as usize] {
                    let b = &all[prim as usize];
                    let b = Bounds { min: b.min.truncate(), max: b.max.truncate() };
                    assert_eq!(inner.union(b), inner);
                    seen.push(prim);
                }
            }
        }
        (seen, depth)
    }

    #[test]
    fn every_primitive_is_in_one_leaf_of_a_tree_of_bounded_depth() {
        type Place = fn(f32) -> (Vec3, Vec3);
        let places: [Place; 6] = [
            |_| (Vec3::ZERO, Vec3::ONE),
            |i| (vec3(i, 0.0, 0.0), vec3(i + 1.0, 1.0, 0.0)),
            |i| (Vec3::splat(-i), Vec3::splat(i)),
            |i| (Vec3::X * 1.004f32.powf(i), Vec3::X * 1.004f32.powf(i + 1.0)),
            |i| (Vec3::ZERO, Vec3::splat(1.004f32.powf(i))),
            |i| (Vec3::splat(-3e38), Vec3::splat(3e38 - i * 1e33)),
        ];
        for place in places {
            for (n, leaf_max) in [(1, 8), (2, 1), (9, 8), (20_000, 8), (20_000, 1)] {
                let (all, order) = boxes(n, place);
                let mut leaves = Vec::new();
                let tree = Wide::from_binary(&build(all.clone(), order, leaf_max), |leaf| {
                    assert!(leaf.len() <= leaf_max);
                    leaves.push(leaf.to_vec());
                    leaves.len() as u32 - 1
                });
                let (mut seen, depth) = walk(&tree, &leaves, &all);
                seen.sort_unstable();
                assert!(seen.into_iter().eq(0..n));
                assert!(depth <= MAX_DEPTH, "{depth}");
            }
        }
    }
}
