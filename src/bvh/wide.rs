//! The one loop over bundles.

use super::stack::Stack;
use crate::block::bundle::{Bundle, ChildRef};
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab, WideBoxes};
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
    let boxes = slab.wide::<S, W>(s);
    let mut stack = Stack::new();
    let mut t_bound = query.t_bound();
    let mut t_bounds = Width::<W>::splat(s, t_bound);
    let mut at = ChildRef::bundle(0);
    loop {
        while !at.is_leaf() {
            let Some(bundle) = bundles.get(at.bundle_number()) else { return false };
            query.watch().step();
            let (mask, near) = if Q::ANY_BOXES {
                boxes.entered::<true>(&bundle.walls, t_bounds)
            } else {
                boxes.entered::<false>(&bundle.walls, t_bounds)
            };
            if mask & mask.wrapping_sub(1) == 0 {
                let only = bundle.refs.get(mask.trailing_zeros() as usize);
                at = only.copied().unwrap_or_else(|| stack.pop());
            } else if Q::ORDERED {
                at = stack.push_and_take_nearest(s, mask, near, &bundle.refs);
            } else {
                stack.push(s, mask, near, &bundle.refs);
                at = stack.pop();
            }
        }
        if at == ChildRef::NONE {
            return false;
        }
        if leaves.intersect_whole(s, at.leaf_block(), ray, query) {
            return true;
        }
        if query.t_bound() < t_bound {
            t_bound = query.t_bound();
            t_bounds = Width::<W>::splat(s, t_bound);
            stack.cull(s, t_bound);
        }
        at = stack.pop();
    }
}
