//! The one loop over a tree of bundles.

use super::MAX_DEPTH;
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::leaf::KIND_SPHERES;
use crate::math::Aabb;
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab};

/// Offers `query` everything the ray meets, near boxes first; true when it ended the search.
pub(crate) fn traverse_wide<Q: Query, const W: usize>(
    bundles: &[Bundle<W>],
    leaves: &Leaves,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    // Each level leaves at most all lanes but one behind.
    let mut stack = [(ChildRef::NONE, 0.0f32); MAX_DEPTH * 15 + 1];
    let mut pending = 1;
    stack[0] = (ChildRef::bundle(0), f32::NEG_INFINITY);
    while pending > 0 {
        pending -= 1;
        let (at, near) = stack[pending];
        if near > query.t_bound() {
            continue;
        }
        if at.is_leaf() {
            if leaf(leaves, at, ray, query) {
                return true;
            }
            continue;
        }
        let Some(bundle) = bundles.get(at.bundle_number()) else { continue };
        let first = pending;
        for lane in 0..W {
            if bundle.refs[lane] == ChildRef::NONE {
                break;
            }
            query.watch().step();
            let [a, b, c, d, e, f] = bundle.walls.map(|wall| wall[lane]);
            let part = slab.part(&Aabb { lower: [a, b, c], upper: [d, e, f] }, query.t_bound());
            if part.is_empty() {
                continue;
            }
            // The farthest at the bottom: the nearest comes off first.
            let mut place = pending;
            while place > first && stack[place - 1].1 < part.near {
                let moved = stack[place - 1];
                let Some(entry) = stack.get_mut(place) else { return false };
                *entry = moved;
                place -= 1;
            }
            let Some(entry) = stack.get_mut(place) else { return false };
            *entry = (bundle.refs[lane], part.near);
            pending += 1;
        }
    }
    false
}

fn leaf<Q: Query>(leaves: &Leaves, at: ChildRef, ray: &PreparedRay, query: &mut Q) -> bool {
    let (kind, number) = at.leaf_block();
    let lanes = if kind == KIND_SPHERES {
        leaves.sphere_blocks.get(number).map_or(0, |block| block.lanes())
    } else {
        leaves.triangle_blocks.get(number).map_or(0, |block| block.lanes())
    };
    leaves.intersect_block(kind, number, lanes, ray, query)
}
