//! From near boxes to far ones around a point.

use super::MAX_DEPTH;
use super::stack::Columns;
use super::wide::{ENOUGH_ROOM, Walk};
use crate::block::BvhNode;
use crate::block::bundle::{Bundle, ChildRef};
use crate::point::Seek;
use crate::simd::{Simd, Width};

/// Offers `nearest` the leaves of a binary tree, near ones first.
pub(crate) fn search(nodes: &[BvhNode], nearest: &mut impl Seek) {
    // One sibling a level at most, as for a ray.
    let mut stack = [(0u32, 0.0f64); MAX_DEPTH];
    let mut count = 0;
    let Some(mut node) = nodes.first() else { return };
    loop {
        if node.is_leaf() {
            nearest.leaf(node.leaf());
        } else if let Some(pair) = nodes.get(node.first as usize..).and_then(<[_]>::first_chunk) {
            let [left, right]: &[BvhNode; 2] = pair;
            let squares = [left, right].map(|child| nearest.around().square_to(&child.aabb()));
            let far = usize::from(squares[0] <= squares[1]);
            if nearest.around().is_within(squares[far])
                && let Some(entry) = stack.get_mut(count)
            {
                *entry = (node.first + far as u32, squares[far]);
                count += 1;
            }
            if nearest.around().is_within(squares[1 - far]) {
                node = [left, right][1 - far];
                continue;
            }
        }
        // What was found meanwhile may be closer than what waits.
        let next = loop {
            let Some(last) = count.checked_sub(1) else { return };
            count = last;
            let Some((next, square)) = stack.get(last).copied() else { return };
            if nearest.around().is_within(square) {
                break next;
            }
        };
        let Some(next) = nodes.get(next as usize) else { return };
        node = next;
    }
}

/// Offers `nearest` the leaves of a tree of bundles, near ones first: the walk of a ray, with the squares of distances for `t`.
#[inline(always)]
pub(crate) fn search_wide<S: Simd + Width<W>, const W: usize>(
    s: S,
    bundles: &[Bundle<W>],
    nearest: &mut impl Seek,
) {
    let mut columns = Columns::<ENOUGH_ROOM>::UNWRITTEN;
    let mut walk = Walk::new(&mut columns, f32::INFINITY);
    loop {
        while !walk.at().is_leaf() {
            let Some(bundle) = bundles.get(walk.at().bundle_number()) else { return };
            let entered = nearest.around().boxes::<S, W>(s, &bundle.walls);
            if !walk.go_on(s, bundle, entered, true) {
                return;
            }
        }
        if walk.at() == ChildRef::NONE {
            return;
        }
        nearest.block(walk.at().leaf_block(), u32::MAX);
        walk.leave(s, nearest.around().narrow_bound(), true);
    }
}
