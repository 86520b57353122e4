//! Whether the tree of a foreign block can be traversed.

use super::MAX_DEPTH;
use crate::block::BvhNode;
use crate::prim::Leaves;

/// Whether the nodes form one tree, no deeper than a traversal's stack, whose leaves exist.
///
/// Nodes are stored as a depth-first walk meets them, each pair of children when their parent is
/// met. So the walk is repeated with a counter: the pair of the next inner node is the next pair.
/// That proves that each pair has exactly one parent, which comes before it, and takes no memory
/// beyond a stack like a traversal's.
pub(crate) fn tree_is_sound(nodes: &[BvhNode], leaves: &Leaves) -> bool {
    if nodes.len() < 2 {
        return false;
    }
    let mut stack = [0u32; MAX_DEPTH];
    let mut count = 0;
    let mut next_pair = 2;
    let mut at = 0;
    loop {
        let Some(node) = nodes.get(at as usize) else { return false };
        if node.is_leaf() {
            if !leaves.has(node.leaf()) {
                return false;
            }
            if count == 0 {
                // The walk is over: all nodes must have been met.
                return next_pair as usize == nodes.len();
            }
            count -= 1;
            at = stack[count];
        } else {
            let Some(entry) = stack.get_mut(count) else { return false };
            if node.first != next_pair || next_pair as usize + 1 >= nodes.len() {
                return false;
            }
            *entry = node.first + 1;
            count += 1;
            at = node.first;
            next_pair += 2;
        }
    }
}
