//! The one loop over bundles.

use super::stack::Stack;
use crate::block::bundle::{Bundle, ChildRef};
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab};
use crate::simd::{Simd, Width};

/// Offers `query` everything the ray meets, near bundles first; true when it ended the search.
///
/// A bundle's children that the ray enters go to the stack in one step and the nearest of them is taken
/// back; with one child, the usual case near the leaves, the stack is not touched. The stack is
/// culled once for each hit that was accepted, so taking from it tests nothing.
#[inline(always)]
pub(crate) fn traverse_wide<S: Simd + Width<W>, Q: Query, const W: usize>(
    s: S,
    bundles: &[Bundle<W>],
    leaves: &Leaves,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let mut stack = Stack::new();
    let mut t_bound = query.t_bound();
    let mut at = ChildRef::bundle(0);
    loop {
        while !at.is_leaf() {
            let Some(bundle) = bundles.get(at.bundle_number()) else { return false };
            query.watch().step();
            let (mask, near) = if Q::ANY_BOXES {
                slab.lanes::<S, true, W>(s, &bundle.walls, t_bound)
            } else {
                slab.lanes::<S, false, W>(s, &bundle.walls, t_bound)
            };
            if mask & mask.wrapping_sub(1) == 0 {
                let only = bundle.refs.get(mask.trailing_zeros() as usize);
                at = only.copied().unwrap_or_else(|| stack.pop());
                continue;
            }
            stack.push(s, mask, near, &bundle.refs);
            at = if Q::ORDERED {
                stack.pop_nearest(mask.count_ones() as usize)
            } else {
                stack.pop()
            };
        }
        if at == ChildRef::NONE {
            return false;
        }
        if leaves.intersect_whole(s, at.leaf_block(), ray, query) {
            return true;
        }
        if query.t_bound() < t_bound {
            t_bound = query.t_bound();
            stack.cull(t_bound);
        }
        at = stack.pop();
    }
}
