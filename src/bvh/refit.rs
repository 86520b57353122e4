//! Boxes over leaf blocks that have moved, in the tree as it was built.

use crate::block::BvhNode;
use crate::block::bundle::{Bundle, ChildRef};
use crate::math::Aabb;
use crate::prim::Leaves;

/// What rays pay by the surface area heuristic: each box that is entered costs 1.
#[derive(Clone, Copy, Default)]
pub(crate) struct Cost(f64);

impl Cost {
    /// Another box to enter.
    pub fn add(&mut self, aabb: &Aabb) {
        self.0 += area(aabb);
    }

    /// The cost of a ray that enters `whole`, all boxes within it added: 1 at least, and 1 if that is a line or less.
    pub fn of(self, whole: &Aabb) -> f32 {
        let ratio = self.0 / area(whole);
        // Not so for NaN.
        if ratio > 0.0 { 1.0 + ratio as f32 } else { 1.0 }
    }
}

/// Half the surface area. In `f64` it neither over- nor underflows, as infinite edges are cut.
fn area(aabb: &Aabb) -> f64 {
    let edge = |k: usize| {
        let [lower, upper] = [aabb.lower[k], aabb.upper[k]].map(|x| x.clamp(f32::MIN, f32::MAX));
        (f64::from(upper) - f64::from(lower)).max(0.0)
    };
    let [x, y, z] = [edge(0), edge(1), edge(2)];
    x * y + y * z + z * x
}

/// Makes all boxes of bundles anew, children before parents; returns the one around everything.
///
/// Children come after their parents, so from the last bundle to the first each finds the boxes below it made.
pub(crate) fn refit_bundles<const W: usize>(
    bundles: &mut [Bundle<W>],
    leaves: &Leaves,
    cost: &mut Cost,
) -> Aabb {
    for at in (0..bundles.len()).rev() {
        for lane in 0..W {
            let child = bundles.get(at).map_or(ChildRef::NONE, |bundle| bundle.refs[lane]);
            if child == ChildRef::NONE {
                continue;
            }
            let aabb = if child.is_leaf() {
                leaves.tight_box_of_block(child.leaf_block(), u32::MAX)
            } else {
                bundles.get(child.bundle_number()).map_or(Aabb::EMPTY, around)
            };
            cost.add(&aabb);
            if let Some(bundle) = bundles.get_mut(at) {
                set_walls(bundle, lane, &aabb);
            }
        }
    }
    bundles.first().map_or(Aabb::EMPTY, around)
}

/// Makes all boxes of binary nodes anew; returns the one around everything.
pub(crate) fn refit_nodes(nodes: &mut [BvhNode], leaves: &Leaves, cost: &mut Cost) -> Aabb {
    // Node 1 is none.
    for at in (0..nodes.len()).filter(|at| *at != 1).rev() {
        let Some(node) = nodes.get(at).copied() else { continue };
        let aabb = if node.is_leaf() {
            leaves.tight_box(node.leaf())
        } else {
            let pair = nodes.get(node.first as usize..).and_then(<[_]>::first_chunk::<2>);
            pair.map_or(Aabb::EMPTY, |[left, right]| {
                let mut both = left.aabb();
                both.add(&right.aabb());
                both
            })
        };
        if at != 0 {
            cost.add(&aabb);
        }
        if let Some(node) = nodes.get_mut(at) {
            (node.lower, node.upper) = (aabb.lower, aabb.upper);
        }
    }
    nodes.first().map_or(Aabb::EMPTY, BvhNode::aabb)
}

/// The box around all lanes: those without a child have empty ones.
fn around<const W: usize>(bundle: &Bundle<W>) -> Aabb {
    let mut aabb = Aabb::EMPTY;
    for lane in 0..W {
        let wall = |k: usize| bundle.walls[k][lane];
        aabb.add(&Aabb { lower: [wall(0), wall(1), wall(2)], upper: [wall(3), wall(4), wall(5)] });
    }
    aabb
}

fn set_walls<const W: usize>(bundle: &mut Bundle<W>, lane: usize, aabb: &Aabb) {
    for k in 0..3 {
        bundle.walls[k][lane] = aabb.lower[k];
        bundle.walls[3 + k][lane] = aabb.upper[k];
    }
}
