//! From near boxes to far ones around a point.

use super::MAX_DEPTH;
use crate::block::BvhNode;
use crate::block::bundle::{Bundle, ChildRef};
use crate::math::Aabb;
use crate::point::Seek;

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
            let squares = [left, right].map(|child| nearest.square_to(&child.aabb()));
            let far = usize::from(squares[0] <= squares[1]);
            if nearest.is_within(squares[far])
                && let Some(entry) = stack.get_mut(count)
            {
                *entry = (node.first + far as u32, squares[far]);
                count += 1;
            }
            if nearest.is_within(squares[1 - far]) {
                node = [left, right][1 - far];
                continue;
            }
        }
        // What was found meanwhile may be closer than what waits.
        let next = loop {
            let Some(last) = count.checked_sub(1) else { return };
            count = last;
            let Some((next, square)) = stack.get(last).copied() else { return };
            if nearest.is_within(square) {
                break next;
            }
        };
        let Some(next) = nodes.get(next as usize) else { return };
        node = next;
    }
}

/// A bundle on the way from the root, and which of its lanes are still to be visited.
#[derive(Clone, Copy)]
struct Level {
    bundle: u32,
    left: u32,
}

/// Offers `nearest` the leaves of a tree of bundles, near ones first.
///
/// On the way back distances are computed again: that takes less than a stack of them, of which most would never be taken.
pub(crate) fn search_wide<const W: usize>(bundles: &[Bundle<W>], nearest: &mut impl Seek) {
    let all = u32::MAX >> (32 - W);
    let mut levels = [Level { bundle: 0, left: all }; MAX_DEPTH];
    let mut depth = 0;
    loop {
        let Some(level) = levels.get_mut(depth) else { return };
        let bundle = bundles.get(level.bundle as usize);
        let Some((lane, child)) = bundle.and_then(|b| nearest_child(b, level.left, nearest)) else {
            let Some(above) = depth.checked_sub(1) else { return };
            depth = above;
            continue;
        };
        level.left &= !(1 << lane);
        if child.is_leaf() {
            nearest.block(child.leaf_block(), u32::MAX);
        } else if let Some(below) = levels.get_mut(depth + 1) {
            *below = Level { bundle: child.0, left: all };
            depth += 1;
        }
    }
}

/// The nearest child in the lanes of `left` that comes within the bound.
fn nearest_child<const W: usize>(
    bundle: &Bundle<W>,
    left: u32,
    nearest: &impl Seek,
) -> Option<(usize, ChildRef)> {
    let mut squares = [0.0; W];
    for (lane, square) in squares.iter_mut().enumerate() {
        let wall = |k: usize| bundle.walls[k][lane];
        let aabb = Aabb { lower: [wall(0), wall(1), wall(2)], upper: [wall(3), wall(4), wall(5)] };
        *square = nearest.square_to(&aabb);
    }
    // Lanes without a child are infinitely far.
    let mut least = (f64::INFINITY, None);
    for (lane, square) in squares.into_iter().enumerate() {
        if left >> lane & 1 == 1 && square < least.0 {
            least = (square, Some(lane));
        }
    }
    let lane = least.1.filter(|_| nearest.is_within(least.0))?;
    Some((lane, bundle.refs[lane]))
}
