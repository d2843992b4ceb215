//! Nearest-first traversal of the 8-wide tree.

use std::mem::MaybeUninit;

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
    /// Asks for the memory of a leaf that may be visited soon.
    #[inline(always)]
    fn prefetch(&self, _number: u32) {}
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
    let mut stack = Stack::new();
    let mut code = 0u32;
    loop {
        if code & LEAF == 0 {
            let node = &tree.nodes[code as usize];
            let (near, mut met) = hit_children::<L>(node, slab, t_min, *t_max);
            if met.is_power_of_two() {
                code = node.child[met.trailing_zeros() as usize & (WIDTH - 1)];
                continue;
            }
            let base = stack.top;
            while met != 0 {
                let i = met.trailing_zeros() as usize & (WIDTH - 1);
                met &= met - 1;
                let entry = Entry { t: near[i], code: node.child[i] };
                if entry.code & LEAF == 0 {
                    L::prefetch(&tree.nodes[entry.code as usize]);
                } else {
                    visitor.prefetch(entry.code & !LEAF);
                }
                stack.insert(entry, base);
            }
        } else if visitor.leaf(code & !LEAF, t_max) {
            return;
        }
        loop {
            let Some(entry) = stack.pop() else { return };
            if entry.t <= *t_max {
                code = entry.code;
                break;
            }
        }
    }
}

/// Children still to be visited, those of one node nearest on top.
///
/// Clearing its four kilobytes for each ray cost a seventh of the time in a room of a thousand triangles, so it
/// begins uninitialised.
struct Stack {
    entries: [MaybeUninit<Entry>; STACK],
    /// The entries below are initialised.
    top: usize,
}

impl Stack {
    #[inline(always)]
    fn new() -> Stack {
        Stack { entries: [const { MaybeUninit::uninit() }; STACK], top: 0 }
    }

    /// Puts an entry among those from `base` on.
    #[inline(always)]
    fn insert(&mut self, entry: Entry, base: usize) {
        let mut at = self.top;
        while at > base {
            // SAFETY: `at - 1 < top`, initialised.
            let below = unsafe { self.entries[at - 1].assume_init() };
            if below.t >= entry.t {
                break;
            }
            self.entries[at].write(below);
            at -= 1;
        }
        self.entries[at].write(entry);
        self.top += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        self.top = self.top.checked_sub(1)?;
        // SAFETY: `top` was larger, so this entry is initialised.
        Some(unsafe { self.entries[self.top].assume_init() })
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
