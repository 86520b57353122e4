//! The one loop over the tree.

use super::MAX_DEPTH;
use crate::block::BvhNode;
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab};
use crate::simd::Simd;

/// Offers `query` everything the ray meets, near nodes first; true when it ended the search.
///
/// The stack holds at most one sibling a level, so it cannot overflow on a tree that is no deeper
/// than [`MAX_DEPTH`]; deeper ones are refused when a block is opened.
#[inline(always)]
pub(crate) fn traverse<S: Simd, Q: Query>(
    s: S,
    nodes: &[BvhNode],
    leaves: &Leaves,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let mut stack = Stack { entries: [(0, 0.0); MAX_DEPTH], count: 0 };
    let Some(mut node) = nodes.first() else { return false };
    query.watch().step();
    if slab.part(&node.aabb(), query.t_bound()).is_empty() {
        return false;
    }
    loop {
        if node.is_leaf() {
            if leaves.intersect(s, node.leaf(), ray, query) {
                return true;
            }
        } else if let Some(child) = nearer_child(nodes, node.first, slab, query, &mut stack) {
            node = child;
            continue;
        }
        let Some(next) = stack.pop(query.t_bound()).and_then(|i| nodes.get(i as usize)) else {
            return false;
        };
        node = next;
    }
}

/// The nearer of two children that the ray meets; the other one goes on the stack.
#[inline(always)]
fn nearer_child<'n, Q: Query>(
    nodes: &'n [BvhNode],
    first: u32,
    slab: &impl Slab,
    query: &mut Q,
    stack: &mut Stack,
) -> Option<&'n BvhNode> {
    let [left, right] = nodes.get(first as usize..)?.first_chunk::<2>()?;
    query.watch().step();
    query.watch().step();
    let t_bound = query.t_bound();
    let (a, b) = (slab.part(&left.aabb(), t_bound), slab.part(&right.aabb(), t_bound));
    match (a.is_empty(), b.is_empty()) {
        (true, true) => None,
        (false, true) => Some(left),
        (true, false) => Some(right),
        (false, false) if a.near <= b.near => {
            stack.push(first + 1, b.near);
            Some(left)
        }
        (false, false) => {
            stack.push(first, a.near);
            Some(right)
        }
    }
}

/// Nodes to come back to, each with the `t` at which the ray enters it.
struct Stack {
    entries: [(u32, f32); MAX_DEPTH],
    count: usize,
}

impl Stack {
    fn push(&mut self, node: u32, near: f32) {
        if let Some(entry) = self.entries.get_mut(self.count) {
            *entry = (node, near);
            self.count += 1;
        }
    }

    /// The last node pushed that the ray enters before `t_bound`.
    fn pop(&mut self, t_bound: f32) -> Option<u32> {
        loop {
            self.count = self.count.checked_sub(1)?;
            let (node, near) = *self.entries.get(self.count)?;
            if near <= t_bound {
                return Some(node);
            }
        }
    }
}
