//! Whether the tree of a foreign block can be traversed.

use super::MAX_DEPTH;
use super::stack::Pending;
use crate::block::BvhNode;
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::leaf::KIND_SPHERES;
use crate::prim::Leaves;

/// Whether the nodes form one tree, no deeper than a traversal's stack, whose leaves exist.
///
/// Nodes are stored as a depth-first walk meets them, each pair of children when their parent is
/// met. So the walk is repeated with a counter: the pair of the next inner node is the next pair.
/// That proves that each pair has exactly one parent, which comes before it, and takes no memory
/// beyond a stack like a traversal's. Each node waits with its depth: a traversal may leave either child for later.
pub(crate) fn tree_is_sound(nodes: &[BvhNode], leaves: &Leaves) -> bool {
    if nodes.len() < 2 {
        return false;
    }
    let mut right = Pending::NONE;
    let mut next_pair = 2;
    let (mut at, mut depth) = (0, 0);
    loop {
        let Some(node) = nodes.get(at as usize) else { return false };
        if node.is_leaf() {
            if !leaves.has(node.leaf()) {
                return false;
            }
            let Some(next) = right.pop() else {
                // The walk is over: all nodes must have been met.
                return next_pair as usize == nodes.len();
            };
            (at, depth) = next;
        } else {
            if node.first != next_pair || next_pair as usize + 1 >= nodes.len() {
                return false;
            }
            depth += 1;
            if depth > MAX_DEPTH || !right.push((node.first + 1, depth)) {
                return false;
            }
            at = node.first;
            next_pair += 2;
        }
    }
}

/// Whether the bundles form one tree, no deeper than a traversal's stack, over just the leaf blocks
/// that there are, or in an index without any over just the ids.
///
/// A depth-first walk that takes lanes in order meets a bundle: its inner children have the next
/// numbers of bundles, its leaves the next numbers of blocks of their kind. So the walk is repeated
/// with a counter for each, as in [`tree_is_sound`].
pub(crate) fn bundles_are_sound<const W: usize>(
    bundles: &[Bundle<W>],
    leaves: &Leaves,
    of_index: bool,
) -> bool {
    // For each level the next bundle to meet, and the end of its siblings.
    let mut stack = [(0, 0); MAX_DEPTH];
    stack[0] = (0, 1);
    let mut level = 0;
    let mut next = Next { bundle: 1, triangle_block: 0, sphere_block: 0 };
    loop {
        let (at, end) = &mut stack[level];
        if *at == *end {
            if level == 0 {
                break;
            }
            level -= 1;
            continue;
        }
        let Some(bundle) = bundles.get(*at) else { return false };
        *at += 1;
        let first = next.bundle;
        if !next.passes(bundle) {
            return false;
        }
        if next.bundle > first {
            level += 1;
            let Some(children) = stack.get_mut(level) else { return false };
            *children = (first, next.bundle);
        }
    }
    next.bundle == bundles.len()
        && next.triangle_block == leaves.triangle_blocks.len()
        && match of_index {
            true => leaves.sphere_blocks.is_empty() && next.sphere_block == leaves.prim_ids.len(),
            false => next.sphere_block == leaves.sphere_blocks.len(),
        }
}

/// The numbers that the walk expects next.
struct Next {
    bundle: usize,
    triangle_block: usize,
    sphere_block: usize,
}

impl Next {
    /// Whether a bundle's lanes continue the numbers, with empty lanes last, and are not all empty.
    fn passes<const W: usize>(&mut self, bundle: &Bundle<W>) -> bool {
        let used = bundle.refs.iter().take_while(|r| **r != ChildRef::NONE).count();
        let empty = Bundle::<W>::EMPTY;
        let rest_is_empty = bundle.refs[used..] == empty.refs[used..]
            && bundle.walls.iter().zip(empty.walls).all(|(a, b)| a[used..] == b[used..]);
        used > 0
            && rest_is_empty
            && bundle.refs[..used].iter().all(|child| {
                let (expected, next) = match child.leaf_block() {
                    _ if !child.is_leaf() => {
                        (ChildRef::bundle(self.bundle as u32), &mut self.bundle)
                    }
                    (KIND_SPHERES, _) => (
                        ChildRef::leaf(KIND_SPHERES, self.sphere_block as u32),
                        &mut self.sphere_block,
                    ),
                    (kind, _) => {
                        (ChildRef::leaf(kind, self.triangle_block as u32), &mut self.triangle_block)
                    }
                };
                *next += 1;
                *child == expected
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::leaf::{KIND_TRIANGLES, SphereBlock, TriangleBlock};
    use crate::math::Aabb;

    const LEAF: BvhNode = BvhNode { lower: [0.0; 3], first: 1 << 30, upper: [1.0; 3], lanes: 1 };

    fn inner(first: u32) -> BvhNode {
        BvhNode::inner(&Aabb { lower: [0.0; 3], upper: [1.0; 3] }, first)
    }

    fn is_sound(nodes: &[BvhNode]) -> bool {
        let block = TriangleBlock { count: 1, ..TriangleBlock::EMPTY };
        let leaves = Leaves { triangle_blocks: &[block], sphere_blocks: &[], prim_ids: &[0] };
        tree_is_sound(nodes, &leaves)
    }

    #[test]
    fn trees_are_told_from_other_graphs() {
        let unused = inner(0);
        assert!(is_sound(&[LEAF, unused]));
        assert!(is_sound(&[inner(2), unused, LEAF, inner(4), LEAF, LEAF]));
        assert!(!is_sound(&[]), "no root");
        assert!(!is_sound(&[inner(0), unused]), "a node that is its own child");
        assert!(!is_sound(&[inner(2), unused, inner(2), LEAF]), "a pair that is its own parent");
        let shared = [inner(2), unused, inner(4), inner(4), LEAF, LEAF];
        assert!(!is_sound(&shared), "a pair with two parents");
        assert!(!is_sound(&[inner(2), unused, LEAF]), "half a pair");
        assert!(!is_sound(&[inner(2), unused, LEAF, LEAF, LEAF, LEAF]), "nodes without a parent");
        assert!(!is_sound(&[inner(4), unused, LEAF, LEAF, LEAF, LEAF]), "a gap");
    }

    #[test]
    fn leaves_must_exist() {
        let unused = inner(0);
        for (first, lanes) in
            [(1 << 30, 2), (1 << 30 | 1, 1), (2 << 30, 1), (0, 1), (1 << 30, 1 << 16)]
        {
            assert!(!is_sound(&[BvhNode { first, lanes, ..LEAF }, unused]), "{first:x} {lanes:x}");
        }
    }

    /// A bundle with these children.
    fn bundle(children: &[ChildRef]) -> Bundle<4> {
        let mut bundle = Bundle::EMPTY;
        bundle.refs[..children.len()].copy_from_slice(children);
        for wall in &mut bundle.walls {
            wall[..children.len()].fill(1.0);
        }
        bundle
    }

    fn inner_of(number: u32) -> ChildRef {
        ChildRef::bundle(number)
    }

    fn triangles(number: u32) -> ChildRef {
        ChildRef::leaf(KIND_TRIANGLES, number)
    }

    fn spheres(number: u32) -> ChildRef {
        ChildRef::leaf(KIND_SPHERES, number)
    }

    /// Whether these bundles are a tree over so many blocks of each kind.
    fn are_sound(bundles: &[Bundle<4>], triangle_blocks: usize, sphere_blocks: usize) -> bool {
        let triangle_blocks = std::vec![TriangleBlock::EMPTY; triangle_blocks];
        let sphere_blocks = std::vec![SphereBlock::EMPTY; sphere_blocks];
        let (triangle_blocks, sphere_blocks) = (&triangle_blocks[..], &sphere_blocks[..]);
        bundles_are_sound(bundles, &Leaves { triangle_blocks, sphere_blocks, prim_ids: &[] }, false)
    }

    #[test]
    fn trees_of_bundles_are_told_from_other_graphs() {
        let leaf = bundle(&[triangles(0)]);
        assert!(are_sound(&[leaf], 1, 0));
        let top = bundle(&[inner_of(1), inner_of(2)]);
        let (a, b) = (bundle(&[inner_of(3)]), bundle(&[triangles(1)]));
        assert!(are_sound(&[top, a, b, leaf], 2, 0), "siblings, then the first one's children");
        assert!(!are_sound(&[], 0, 0), "no root");
        assert!(!are_sound(&[bundle(&[])], 0, 0), "a bundle of nothing");
        assert!(!are_sound(&[bundle(&[inner_of(0)])], 0, 0), "a bundle that is its own child");
        let looped = [bundle(&[inner_of(1)]), bundle(&[inner_of(1)])];
        assert!(!are_sound(&looped, 0, 0), "a bundle that is its own parent");
        let back = [bundle(&[inner_of(1)]), bundle(&[inner_of(0)])];
        assert!(!are_sound(&back, 0, 0), "a way back to the root");
        assert!(!are_sound(&[bundle(&[inner_of(1), inner_of(1)]), leaf], 1, 0), "two parents");
        assert!(!are_sound(&[bundle(&[inner_of(1)])], 0, 0), "a child that is not there");
        assert!(!are_sound(&[leaf, leaf], 1, 0), "a bundle without a parent");
        assert!(!are_sound(&[bundle(&[inner_of(7)]), leaf], 1, 0), "a child far away");
        let crossed = bundle(&[inner_of(2), inner_of(1)]);
        assert!(!are_sound(&[crossed, a, b, leaf], 2, 0), "children in another order");
        assert!(!are_sound(&[bundle(&[inner_of(2)]), leaf, leaf], 1, 0), "a gap");
        let later = [top, b, a, bundle(&[triangles(0)])];
        assert!(!are_sound(&later, 2, 0), "children of the second before those of the first");
    }

    #[test]
    fn each_leaf_block_has_one_place() {
        let both = bundle(&[triangles(0), spheres(0), triangles(1), spheres(1)]);
        assert!(are_sound(&[both], 2, 2));
        assert!(!are_sound(&[both], 3, 2), "a block without a leaf");
        assert!(!are_sound(&[both], 2, 3), "a block without a leaf");
        assert!(!are_sound(&[both], 1, 2), "a leaf without a block");
        assert!(!are_sound(&[bundle(&[triangles(0), triangles(0)])], 1, 0), "a block twice");
        assert!(!are_sound(&[bundle(&[triangles(1), triangles(0)])], 2, 0), "another order");
        assert!(!are_sound(&[bundle(&[triangles(1)])], 1, 0), "a gap");
        let apart = [bundle(&[inner_of(1), triangles(0)]), bundle(&[triangles(0)])];
        assert!(!are_sound(&apart, 1, 0), "a block in two bundles");
    }

    #[test]
    fn empty_lanes_come_last_and_are_empty() {
        let mut holed = bundle(&[triangles(0), triangles(1), triangles(2)]);
        assert!(are_sound(&[holed], 3, 0));
        holed.refs[1] = ChildRef::NONE;
        assert!(!are_sound(&[holed], 2, 0), "a hole");
        for wall in 0..6 {
            let mut open = bundle(&[triangles(0), triangles(1), triangles(2)]);
            open.walls[wall][3] = 0.0;
            assert!(!are_sound(&[open], 3, 0), "wall {wall}");
        }
    }

    #[test]
    fn bundles_deeper_than_the_stack_are_refused() {
        let chain = |depth: u32| {
            let inner = (1..depth).map(|level| bundle(&[inner_of(level)]));
            inner.chain([bundle(&[triangles(0)])]).collect::<std::vec::Vec<_>>()
        };
        assert!(are_sound(&chain(MAX_DEPTH as u32), 1, 0));
        assert!(!are_sound(&chain(MAX_DEPTH as u32 + 1), 1, 0));
    }

    #[test]
    fn what_is_deeper_than_the_stack_is_refused() {
        let chain = |depth: u32, turn: fn(u32) -> bool| {
            let mut nodes = std::vec![inner(2), inner(0)];
            for level in 1..depth {
                let (next, is_left) = (inner(2 * level + 2), turn(level));
                nodes.extend(if is_left { [next, LEAF] } else { [LEAF, next] });
            }
            nodes.extend([LEAF, LEAF]);
            nodes
        };
        // To the left, to the right, and both: a ray may leave either child for later.
        for turn in [|_| true, |_| false, |level| level % 2 == 0] {
            assert!(is_sound(&chain(MAX_DEPTH as u32, turn)));
            assert!(!is_sound(&chain(MAX_DEPTH as u32 + 1, turn)));
        }
    }
}
