//! Nearest-first traversal of the 8-wide tree.

use crate::build::MAX_DEPTH;
use crate::ray::Slab;
use crate::wide::{LEAF, Node, WIDTH, Wide};

/// A node leaves at most seven siblings behind, and the wide tree is no deeper than the binary one.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;

#[derive(Clone, Copy)]
struct Entry {
    t: f32,
    code: u32,
}

/// Calls `leaf(number, t_max)` for the leaves whose boxes the ray may meet at `t_min <= t <= t_max`, about nearest
/// first. `leaf` lowers `t_max` as it finds hits, and returns true to end the traversal.
///
/// Inlined into functions compiled for one instruction set; the arithmetic is the same whatever the set.
#[inline(always)]
pub(crate) fn traverse(
    tree: &Wide,
    slab: &Slab,
    t_min: f32,
    t_max: &mut f32,
    mut leaf: impl FnMut(u32, &mut f32) -> bool,
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
            let (near, mask) = hit_children(node, slab, t_min, *t_max);
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
        } else if leaf(code & !LEAF, t_max) {
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
fn hit_children(node: &Node, slab: &Slab, t_min: f32, t_max: f32) -> ([f32; WIDTH], u32) {
    let mut near = [t_min; WIDTH];
    let mut far = [t_max; WIDTH];
    for axis in 0..3 {
        let side = slab.side[axis] & 1;
        let (entry, exit) = (&node.planes[axis][side], &node.planes[axis][side ^ 1]);
        let (o_near, o_far, inv) = (slab.near[axis], slab.far[axis], slab.inv[axis]);
        for i in 0..WIDTH {
            // A NaN (a plane through the origin, along the ray) fails the comparison and sets no limit.
            let a = (entry[i] - o_near) * inv;
            near[i] = if a > near[i] { a } else { near[i] };
            let b = (exit[i] - o_far) * inv;
            far[i] = if b < far[i] { b } else { far[i] };
        }
    }
    let mut mask = 0;
    for i in 0..WIDTH {
        mask |= u32::from(near[i] <= far[i]) << i;
    }
    (near, mask & node.present)
}
