//! The one loop over the tree.

use super::stack::Pending;
use crate::block::BvhNode;
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab};
use crate::simd::{SMALL, Simd};

/// A node to come back to, and the `t` at which the ray enters it. Where room is scarce that is computed again: it takes half
/// the stack, and three hundredths more instructions.
#[derive(Clone, Copy)]
struct Waiting {
    node: u32,
    near: [f32; KEPT],
}

const KEPT: usize = if SMALL { 0 } else { 1 };

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
    let mut stack = Pending::NONE;
    let Some(mut node) = nodes.first() else { return false };
    query.watch().step();
    if slab.part(node.corners(), query.t_bound()).is_empty() {
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
        // What was met meanwhile may be nearer than what waits.
        node = loop {
            let Some(waiting) = stack.pop() else { return false };
            let Some(next) = nodes.get(waiting.node as usize) else { return false };
            let is_within = match waiting.near.first() {
                Some(near) => *near <= query.t_bound(),
                None => !slab.part(next.corners(), query.t_bound()).is_empty(),
            };
            if is_within {
                break next;
            }
        };
    }
}

/// The nearer of two children that the ray meets; the other one goes on the stack.
#[inline(always)]
fn nearer_child<'n, Q: Query>(
    nodes: &'n [BvhNode],
    first: u32,
    slab: &impl Slab,
    query: &mut Q,
    stack: &mut Pending<Waiting>,
) -> Option<&'n BvhNode> {
    let [left, right] = nodes.get(first as usize..)?.first_chunk::<2>()?;
    query.watch().step();
    query.watch().step();
    let t_bound = query.t_bound();
    let (a, b) = (slab.part(left.corners(), t_bound), slab.part(right.corners(), t_bound));
    match (a.is_empty(), b.is_empty()) {
        (true, true) => None,
        (false, true) => Some(left),
        (true, false) => Some(right),
        (false, false) if a.near <= b.near => {
            stack.push(Waiting { node: first + 1, near: [b.near; KEPT] });
            Some(left)
        }
        (false, false) => {
            stack.push(Waiting { node: first, near: [a.near; KEPT] });
            Some(right)
        }
    }
}
