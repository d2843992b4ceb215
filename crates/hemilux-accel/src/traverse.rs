//! Nearest-first traversal of the 8-wide tree.

use crate::build::MAX_DEPTH;
use crate::lanes::Lanes;
use crate::ray::Slab;
use crate::wide::{LEAF, Node, WIDTH, Wide};

/// A node leaves at most seven siblings behind, and the wide tree is no deeper than the binary one.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;

#[derive(Clone, Copy)]
struct Entry {
    t: f32,
    code: u32,
}

/// What to do at a leaf. A trait and not a closure: a closure is not compiled for the instruction set of its caller.
pub(crate) trait Visit {
    /// Lowers `t_max` at a hit; returns true to end the traversal.
    fn leaf(&mut self, number: u32, t_max: &mut f32) -> bool;
}

/// Visits the leaves whose boxes the ray may meet at `t_min <= t <= t_max`, about nearest first.
///
/// Inlined into functions compiled for one instruction set; the arithmetic is the same whatever the set.
#[inline(always)]
pub(crate) fn traverse<L: Lanes, V: Visit>(
    tree: &Wide,
    slab: &Slab,
    t_min: f32,
    t_max: &mut f32,
    visitor: &mut V,
) {
    if tree.nodes.is_empty() {
        return;
    }
    let mut stack = [Entry { t: 0.0, code: 0 }; STACK];
    let mut top = 0;
    let mut code = 0u32;
    loop {
        if code & LEAF == 0 {
            let node = &tree.nodes[code as usize];
            let (near, mask) = hit_children::<L>(node, slab, t_min, *t_max);
            let mut left = mask;
            let base = top;
            while left != 0 {
                let i = left.trailing_zeros() as usize;
                left &= left - 1;
                // Insertion keeps the entries of this node sorted, nearest on top.
                let entry = Entry { t: near[i & 7], code: node.child[i & 7] };
                let mut at = top;
                while at > base && stack[at - 1].t < entry.t {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = entry;
                top += 1;
            }
        } else if visitor.leaf(code & !LEAF, t_max) {
            return;
        }
        loop {
            if top == 0 {
                return;
            }
            top -= 1;
            if stack[top].t <= *t_max {
                code = stack[top].code;
                break;
            }
        }
    }
}

/// Entry distances of the children, and the mask of those met.
#[inline(always)]
fn hit_children<L: Lanes>(node: &Node, slab: &Slab, t_min: f32, t_max: f32) -> ([f32; WIDTH], u32) {
    let mut near = L::splat(t_min);
    let mut far = L::splat(t_max);
    for axis in 0..3 {
        let side = slab.side[axis] & 1;
        let inv = L::splat(slab.inv[axis]);
        // A NaN (a plane through the origin, along the ray) sets no limit.
        let entry = L::load(&node.planes[axis][side]).sub(L::splat(slab.near[axis])).mul(inv);
        near = entry.max_or(near);
        let exit = L::load(&node.planes[axis][side ^ 1]).sub(L::splat(slab.far[axis])).mul(inv);
        far = exit.min_or(far);
    }
    (near.store(), near.at_most(far) & node.present)
}
