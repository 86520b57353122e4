//! A grown tree mended: subtrees are taken out and put where they enlarge boxes least.

use super::MAX_DEPTH;
use super::order::put_in_order;
use super::split::Areas;
use crate::block::BvhNode;
use crate::math::Aabb;
use crate::storage;

/// One of so many nodes is looked at, those of the largest area.
const ONE_OF: usize = 64;
/// How often.
const PASSES: usize = 2;
/// Places at most that are looked at for a subtree.
const PLACES: usize = 512;

/// A tree with the ways up.
struct Linked<'t> {
    nodes: &'t mut [BvhNode],
    /// The parent of each pair of children.
    parents: &'t mut [u32],
    /// Levels below each node.
    heights: &'t mut [u8],
    areas: Areas,
}

/// Mends a tree whose leaves are those of `ids`, and brings both into the order of a depth-first walk.
/// `scratch` is aligned for `u64`; where it is too small, nothing is done.
///
/// ```text
/// | keys                   | parents | heights |    finding places
/// | ids in the new order   | pairs   |    putting in order
/// ```
pub(super) fn mend(
    nodes: &mut [BvhNode],
    ids: &mut [u32],
    areas: Areas,
    scratch: &mut [u8],
) -> Option<()> {
    let (pairs, count) = (nodes.len() / 2, nodes.len());
    let words = 2 * size_of::<u32>() * count;
    let first = words.max(size_of_val(ids).next_multiple_of(size_of::<u64>()));
    if scratch.len() < first + size_of::<u32>() * pairs + count {
        return Some(());
    }
    let (front, rest) = scratch.split_at_mut_checked(first)?;
    let (links, heights) = rest.split_at_mut_checked(size_of::<u32>() * pairs)?;
    let links = storage::view_mut::<u32>(links, 0, pairs)?;
    reinsert(nodes, areas, links, heights, storage::view_mut::<u64>(front, 0, count)?)?;
    let ordered = storage::view_mut::<u32>(front, 0, ids.len())?;
    put_in_order(nodes, links, ids, ordered)?;
    ids.copy_from_slice(ordered);
    Some(())
}

/// Puts nodes of large area where they cost least: a ray enters a box in proportion to its area, so what
/// is made less is the sum of the areas of all inner nodes.
///
/// `parents` holds a word for each pair, `heights` a byte and `keys` eight for each node. Pairs of
/// children stay together, but not in their order; no path becomes longer than [`MAX_DEPTH`].
///
/// Source: \[Bittner13\], one subtree after another; places are found as in \[Meister18\].
fn reinsert(
    nodes: &mut [BvhNode],
    areas: Areas,
    parents: &mut [u32],
    heights: &mut [u8],
    keys: &mut [u64],
) -> Option<()> {
    let mut tree = Linked { nodes, parents, heights, areas };
    tree.link()?;
    for _ in 0..PASSES {
        let chosen = tree.largest(keys)?;
        for key in chosen {
            tree.move_node(!(*key as u32))?;
        }
    }
    Some(())
}

impl Linked<'_> {
    /// Finds parents and heights, and makes boxes smaller where those of children are, as happens where
    /// refs were cut. Children come after their parents.
    fn link(&mut self) -> Option<()> {
        for at in (0..self.nodes.len()).filter(|at| *at != 1).rev() {
            let node = self.nodes.get(at)?;
            let pair = node.first;
            if node.is_leaf() {
                *self.heights.get_mut(at)? = 0;
            } else {
                *self.parents.get_mut(pair as usize / 2)? = at as u32;
                self.join(at as u32)?;
            }
        }
        Some(())
    }

    /// The box and the height of an inner node from those of its children.
    fn join(&mut self, at: u32) -> Option<()> {
        let pair = self.nodes.get(at as usize)?.first;
        let of = |at: u32| -> Option<(Aabb, u8)> {
            Some((self.nodes.get(at as usize)?.aabb(), *self.heights.get(at as usize)?))
        };
        let ((mut aabb, height), (other, other_height)) = (of(pair)?, of(pair + 1)?);
        aabb.add(&other);
        *self.nodes.get_mut(at as usize)? = BvhNode::inner(&aabb, pair);
        *self.heights.get_mut(at as usize)? = 1 + height.max(other_height);
        Some(())
    }

    /// The nodes of the largest area, those first, below the root's children; as keys whose low words are
    /// their complements.
    fn largest<'k>(&self, keys: &'k mut [u64]) -> Option<&'k [u64]> {
        let keys = keys.get_mut(..self.nodes.len())?.get_mut(4..).unwrap_or_default();
        for ((node, at), key) in self.nodes.iter().zip(0u32..).skip(4).zip(&mut *keys) {
            let area = self.areas.of(&node.aabb()).to_bits();
            *key = u64::from(area) << 32 | u64::from(!at);
        }
        let count = keys.len().div_ceil(ONE_OF).min(keys.len());
        if count < keys.len() {
            keys.select_nth_unstable_by(count, |a, b| b.cmp(a));
        }
        let chosen = keys.get_mut(..count)?;
        chosen.sort_unstable_by(|a, b| b.cmp(a));
        Some(chosen)
    }

    fn area(&self, at: u32) -> Option<f32> {
        Some(self.areas.of(&self.nodes.get(at as usize)?.aabb()))
    }

    fn parent(&self, at: u32) -> Option<u32> {
        self.parents.get(at as usize / 2).copied()
    }

    /// Moves a node, which is not the root's child, to where it costs least.
    fn move_node(&mut self, at: u32) -> Option<()> {
        match self.best_place(at)? {
            Some(place) if self.is_shallow(at, place)? => self.put(at, place),
            _ => Some(()),
        }
    }

    /// The node whose sibling a node had best become; `None` if it had best stay.
    ///
    /// `gain` is the area saved so far: the parent goes, the boxes on the way up shrink, those on
    /// the way down grow.
    fn best_place(&self, moved: u32) -> Option<Option<u32>> {
        let own = self.nodes.get(moved as usize)?.aabb();
        let own_area = self.area(moved)?;
        let (mut best, mut place) = (0.0, None);
        let parent = self.parent(moved)?;
        let mut saved = self.area(parent)?;
        let (mut above, mut below) = (parent, moved);
        let mut rest = self.nodes.get((moved ^ 1) as usize)?.aabb();
        let mut looked_at = 0;
        loop {
            let other = below ^ 1;
            let mut stack = [(0.0f32, 0u32); MAX_DEPTH + 2];
            stack[0] = (saved, other);
            let mut pending = 1;
            while pending > 0 && looked_at < PLACES {
                pending -= 1;
                let (gain, at) = stack[pending];
                // The new parent is at least as large as what is moved.
                if gain - own_area <= best {
                    continue;
                }
                looked_at += 1;
                let node = self.nodes.get(at as usize)?;
                let mut both = node.aabb();
                both.add(&own);
                let here = gain - self.areas.of(&both);
                if here > best && at != moved ^ 1 {
                    (best, place) = (here, Some(at));
                }
                let further = here + self.areas.of(&node.aabb());
                if !node.is_leaf() && further - own_area > best {
                    *stack.get_mut(pending)? = (further, node.first);
                    *stack.get_mut(pending + 1)? = (further, node.first + 1);
                    pending += 2;
                }
            }
            if above != parent {
                rest.add(&self.nodes.get(other as usize)?.aabb());
                saved += self.area(above)? - self.areas.of(&rest);
            }
            if above == 0 {
                return Some(place);
            }
            (below, above) = (above, self.parent(above)?);
        }
    }

    /// Whether no path would be too long if `moved` became the sibling of `place`.
    fn is_shallow(&self, moved: u32, place: u32) -> Option<bool> {
        let height = self.heights.get(moved as usize)?.max(self.heights.get(place as usize)?);
        let mut levels = usize::from(*height) + 2;
        let mut at = place;
        while at != 0 {
            at = self.parent(at)?;
            levels += 1;
        }
        Some(levels < MAX_DEPTH)
    }

    /// Makes `moved` the sibling of `place`: its sibling takes the place of their parent, and their pair
    /// becomes that of `moved` and what is at `place`.
    fn put(&mut self, moved: u32, place: u32) -> Option<()> {
        let (parent, pair) = (self.parent(moved)?, moved & !1);
        let subtree = (*self.nodes.get(moved as usize)?, *self.heights.get(moved as usize)?);
        let sibling = moved ^ 1;
        let sibling = (*self.nodes.get(sibling as usize)?, *self.heights.get(sibling as usize)?);
        self.set(parent, sibling)?;
        self.mend(self.parent(parent)?)?;
        let other = (*self.nodes.get(place as usize)?, *self.heights.get(place as usize)?);
        self.set(pair, other)?;
        self.set(pair + 1, subtree)?;
        *self.nodes.get_mut(place as usize)? = BvhNode::inner(&other.0.aabb(), pair);
        *self.parents.get_mut(pair as usize / 2)? = place;
        self.mend(place)
    }

    /// Puts a node with its height at `at`.
    fn set(&mut self, at: u32, (node, height): (BvhNode, u8)) -> Option<()> {
        if !node.is_leaf() {
            *self.parents.get_mut(node.first as usize / 2)? = at;
        }
        *self.nodes.get_mut(at as usize)? = node;
        *self.heights.get_mut(at as usize)? = height;
        Some(())
    }

    /// Boxes and heights from `at` up to the root.
    fn mend(&mut self, mut at: u32) -> Option<()> {
        self.join(at)?;
        while at != 0 {
            at = self.parent(at)?;
            self.join(at)?;
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::bins::Effort;
    use crate::bvh::branch::grow;
    use crate::bvh::refs::PrimRef;
    use crate::bvh::tree::tests::{levels, series};
    use crate::bvh::tree::{Depth, Grown, Limits};
    use crate::caller::Caller;
    use std::vec::Vec;

    const AREAS: Aabb = Aabb { lower: [0.0; 3], upper: [1.0; 3] };

    /// The tree over these refs, and their ids.
    fn tree(mut refs: Vec<PrimRef>, effort: Effort) -> (Vec<BvhNode>, Vec<u32>) {
        let count = refs.len();
        let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * count];
        let limits = Limits::new(count, 5, Depth::Deep, effort);
        let caller = &Caller::new(None, None);
        let size = grow(&mut nodes, &mut refs, count, &limits, caller).expect("room");
        nodes.truncate(size.nodes);
        (nodes, refs.iter().map(PrimRef::id).collect())
    }

    fn cost(nodes: &[BvhNode]) -> f64 {
        let areas = Areas::new(&AREAS);
        let inner = nodes.iter().enumerate().filter(|(i, node)| *i != 1 && !node.is_leaf());
        inner.map(|(_, node)| f64::from(areas.of(&node.aabb()))).sum()
    }

    /// Mends the tree, checks that it is one over the same leaves, in order, and returns it.
    fn mended(nodes: &[BvhNode], ids: &[u32]) -> Vec<BvhNode> {
        let (mut nodes, mut mended_ids) = (nodes.to_vec(), ids.to_vec());
        let mut memory = crate::storage::AlignedMemory::new(64 * nodes.len()).expect("memory");
        let scratch = memory.bytes_mut();
        mend(&mut nodes, &mut mended_ids, Areas::new(&AREAS), scratch).expect("a tree");
        let (mut stack, mut pairs, mut next_id) = (std::vec![0usize], 1, 0);
        while let Some(at) = stack.pop() {
            let node = nodes[at];
            if node.is_leaf() {
                assert_eq!(node.first as usize, next_id);
                next_id += Grown::of(&node).0;
                continue;
            }
            assert_eq!(node.first as usize, 2 * pairs, "in order of the walk");
            pairs += 1;
            let pair = node.first as usize;
            let mut both = nodes[pair].aabb();
            both.add(&nodes[pair + 1].aabb());
            assert_eq!(both, node.aabb());
            stack.extend([pair + 1, pair]);
        }
        assert_eq!((2 * pairs, next_id), (nodes.len(), ids.len()));
        mended_ids.sort_unstable();
        let mut ids = ids.to_vec();
        ids.sort_unstable();
        assert_eq!(mended_ids, ids);
        nodes
    }

    #[test]
    fn mending_makes_boxes_smaller() {
        let mut state = 3u32;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            (state >> 16) as f32 / 65536.0
        };
        let refs = (0..2000u32).map(|id| {
            let lower = [next(), next(), next()];
            let long = if id % 16 == 0 { 0.5 } else { 0.01 };
            let upper = [lower[0] + long * next(), lower[1] + long * next(), lower[2] + 0.01];
            PrimRef::new(id, &Aabb { lower, upper }, false)
        });
        let (nodes, ids) = tree(refs.collect(), Effort::HASTY);
        let better = cost(&mended(&nodes, &ids)) / cost(&nodes);
        // One of 64 nodes is looked at, twice.
        assert!(better < 0.995, "{better} of the cost");
    }

    #[test]
    fn mended_trees_are_no_deeper_than_the_stack() {
        let mut deepest = 0;
        for ratio in [1.1f64, 1.5, 2.0, 4.0] {
            let (nodes, ids) = tree(series((240.0 / ratio.log2()) as usize, ratio), Effort::FAST);
            deepest = deepest.max(levels(&mended(&nodes, &ids)));
        }
        assert!(deepest > 40 && deepest <= MAX_DEPTH, "{deepest}");
    }
}
