//! The tree as branches that grow independently, on any number of threads.

use super::MAX_DEPTH;
use super::refs::PrimRef;
use super::split::{Areas, Extent};
use super::tree::{Grown, Limits, Splitter, Task};
use crate::block::BvhNode;
use crate::caller::Caller;
use crate::math::Aabb;

/// How much a tree has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub nodes: usize,
    /// Refs of all leaves.
    pub refs: usize,
}

/// Builds the tree over the first `count` of `slots`, of which there is at least one, and brings them
/// into the order of the leaves. If there are more slots and `limits` says where shapes are, refs may be
/// cut in two.
///
/// Nodes are laid out as [`tree_is_sound`](super::tree_is_sound) expects them; leaves are
/// [`Grown`](super::tree::Grown) until they are packed. `nodes` has two entries for each leaf of `budget`.
///
/// A few large splits part the tree into branches, which grow independently: each in the place that its
/// budget of leaves reserves for it, so that the tree is the same in whatever order they grow. The
/// places that stay free are closed at the end.
///
/// Source: \[Wald07\], with leaves limited in number as the memory is.
pub(crate) fn grow(
    nodes: &mut [BvhNode],
    slots: &mut [PrimRef],
    count: usize,
    limits: &Limits,
    caller: &Caller,
) -> Option<Size> {
    let refs = slots.get(..count)?;
    let extent = Extent::around(refs);
    let bounds = extent.bounds.aabb();
    let areas = Areas::new(&bounds);
    let splitter = Splitter { limits, areas, whole: areas.of(&bounds) };
    let room = if limits.source.is_some() { slots.len() } else { count };
    let budget = limits.leaves;
    let root = Task { node: 0, pairs: 2, first: 0, count, room, depth: 0, budget, extent };
    let mut tasks = [root; BRANCHES];
    let count = splitter.branch_out(nodes, slots, &mut tasks)?;
    let tasks = &tasks[..count];
    let mut branches: [Option<Branch>; BRANCHES] = [const { None }; BRANCHES];
    let (mut free_nodes, mut free_refs) = (&mut *nodes, &mut *slots);
    let (mut at_node, mut at_ref) = (0, 0);
    for (task, branch) in tasks.iter().zip(&mut branches) {
        let (first, room) = (task.pairs as usize, 2 * (task.budget - 1));
        let rest = core::mem::take(&mut free_nodes).split_at_mut_checked(first - at_node)?.1;
        let (nodes, rest) = rest.split_at_mut_checked(room)?;
        (free_nodes, at_node) = (rest, first + room);
        let rest = core::mem::take(&mut free_refs).split_at_mut_checked(task.first - at_ref)?.1;
        let (refs, rest) = rest.split_at_mut_checked(task.room)?;
        (free_refs, at_ref) = (rest, task.first + task.room);
        *branch = Some(Branch { task: *task, nodes, refs, root: None });
    }
    caller.for_each(&mut branches[..count], |branch| {
        if let Some(branch) = branch {
            branch.root = splitter.grow_branch(branch);
        }
    });
    let mut roots = [BvhNode::inner(&Aabb::EMPTY, 0); BRANCHES];
    for (root, branch) in roots.iter_mut().zip(branches.iter().flatten()) {
        *root = branch.root?;
    }
    for (task, root) in tasks.iter().zip(roots) {
        *nodes.get_mut(task.node as usize)? = root;
    }
    close_gaps(nodes, slots)
}

/// Branches at most. How many there are must not depend on the threads, as the tree must not.
const BRANCHES: usize = 64;
/// Branches of fewer refs are not parted further.
const BRANCH: usize = 2048;

/// A subtree of its own, with its places.
pub(super) struct Branch<'b> {
    pub task: Task,
    pub nodes: &'b mut [BvhNode],
    pub refs: &'b mut [PrimRef],
    /// Its root, when it has grown.
    root: Option<BvhNode>,
}

impl Splitter<'_, '_, '_> {
    /// Splits the largest task again and again, until there are enough or all are small; returns their
    /// number. They stay in the order of the tree.
    fn branch_out(
        self,
        nodes: &mut [BvhNode],
        refs: &mut [PrimRef],
        tasks: &mut [Task; BRANCHES],
    ) -> Option<usize> {
        let grain = (tasks[0].count / 48).max(BRANCH);
        let mut scratch = self.scratch();
        let mut count = 1;
        while count < BRANCHES {
            let largest = (0..count).rev().max_by_key(|i| tasks[*i].count)?;
            let task = tasks[largest];
            if task.count <= grain {
                break;
            }
            let slots = refs.get_mut(task.first..task.first + task.room)?;
            // More than a leaf, so it is split.
            let split = self.part(slots, &task, &mut scratch)?;
            let node = nodes.get_mut(task.node as usize)?;
            *node = BvhNode::inner(&task.extent.bounds.aabb(), task.pairs);
            let [left, right] = task.children(&split, task.pairs, slots)?;
            tasks.copy_within(largest + 1..count, largest + 2);
            tasks[largest] = left;
            tasks[largest + 1] = right;
            count += 1;
        }
        Some(count)
    }
}

/// Moves pairs of children, and the refs of leaves, down to where the ones before end.
fn close_gaps(nodes: &mut [BvhNode], slots: &mut [PrimRef]) -> Option<Size> {
    let mut stack = [0u32; MAX_DEPTH];
    let mut size = Size { nodes: 2, refs: 0 };
    let (mut pending, mut at) = (0, 0u32);
    loop {
        let node = nodes.get_mut(at as usize)?;
        if node.is_leaf() {
            let (first, count) = (node.first as usize, Grown::of(node).0);
            if first != size.refs {
                node.first = size.refs as u32;
                slots.get(first..first + count)?;
                slots.copy_within(first..first + count, size.refs);
            }
            size.refs += count;
            if pending == 0 {
                return Some(size);
            }
            pending -= 1;
            at = stack[pending];
            continue;
        }
        let (pair, place) = (node.first as usize, size.nodes);
        node.first = place as u32;
        // Pairs lie in the order of this walk, so the place is this pair's own, or one moved before.
        nodes.copy_within(pair..pair + 2, place);
        at = place as u32;
        *stack.get_mut(pending)? = at + 1;
        pending += 1;
        size.nodes += 2;
    }
}
