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
