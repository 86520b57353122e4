//! The tree as branches that grow independently, on any number of threads.

use super::MAX_DEPTH;
use super::bins::Bins;
use super::refs::PrimRef;
use super::split::{Areas, Extent};
use super::tree::{Limits, Splitter, Task};
use crate::block::BvhNode;
use crate::caller::Caller;
use crate::math::Aabb;

/// Builds the tree over `refs`, of which there is at least one, and brings them into the order of
/// the leaves. Returns the number of nodes.
///
/// Nodes are laid out as [`tree_is_sound`](super::tree_is_sound) expects them; leaves are
/// [`Grown`] until they are packed. `nodes` has two entries for each leaf of `budget`.
///
/// A few large splits part the tree into branches, which grow independently: each in the place that its
/// budget of leaves reserves for it, so that the tree is the same in whatever order they grow. The
/// places that stay free are closed at the end.
///
/// Source: \[Wald07\], with leaves limited in number as the memory is.
pub(crate) fn grow(
    nodes: &mut [BvhNode],
    refs: &mut [PrimRef],
    limits: &Limits,
    caller: &Caller,
) -> Option<usize> {
    let extent = Extent::around(refs);
    let areas = Areas::new(&extent.bounds.aabb());
    let effort = limits.effort.for_refs(refs, areas);
    let splitter = Splitter { limits: &Limits { effort, ..*limits }, areas };
    let root = Task {
        node: 0,
        pairs: 2,
        first: 0,
        count: refs.len(),
        depth: 0,
        budget: limits.leaves,
        extent,
    };
    let mut tasks = [root; BRANCHES];
    let count = splitter.branch_out(nodes, refs, &mut tasks)?;
    let tasks = &tasks[..count];
    let mut branches: [Option<Branch>; BRANCHES] = [const { None }; BRANCHES];
    let (mut free_nodes, mut free_refs) = (&mut *nodes, refs);
    let (mut at_node, mut at_ref) = (0, 0);
    for (task, branch) in tasks.iter().zip(&mut branches) {
        let (first, room) = (task.pairs as usize, 2 * (task.budget - 1));
        let rest = core::mem::take(&mut free_nodes).split_at_mut_checked(first - at_node)?.1;
        let (nodes, rest) = rest.split_at_mut_checked(room)?;
        (free_nodes, at_node) = (rest, first + room);
        let rest = core::mem::take(&mut free_refs).split_at_mut_checked(task.first - at_ref)?.1;
        let (refs, rest) = rest.split_at_mut_checked(task.count)?;
        (free_refs, at_ref) = (rest, task.first + task.count);
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
    close_gaps(nodes)
}

/// Branches at most. How many there are must not depend on the threads, as the tree must not.
const BRANCHES: usize = 64;
/// Branches of fewer refs are not parted further.
const BRANCH: usize = 2048;

/// A subtree of its own, with its place.
pub(super) struct Branch<'b> {
    pub task: Task,
    pub nodes: &'b mut [BvhNode],
    pub refs: &'b mut [PrimRef],
    /// Its root, when it has grown.
    root: Option<BvhNode>,
}

impl Splitter<'_> {
    /// Splits the largest task again and again, until there are enough or all are small; returns their
    /// number. They stay in the order of the tree.
    fn branch_out(
        self,
        nodes: &mut [BvhNode],
        refs: &mut [PrimRef],
        tasks: &mut [Task; BRANCHES],
    ) -> Option<usize> {
        let grain = (refs.len() / 48).max(BRANCH);
        let mut bins = Bins::EMPTY;
        let mut count = 1;
        while count < BRANCHES {
            let largest = (0..count).rev().max_by_key(|i| tasks[*i].count)?;
            let task = tasks[largest];
            if task.count <= grain {
                break;
            }
            let range = refs.get_mut(task.first..task.first + task.count)?;
            // More than a leaf, so it is split.
            let split = self.part(range, &task, &mut bins)?;
            let node = nodes.get_mut(task.node as usize)?;
            *node = BvhNode::inner(&task.extent.bounds.aabb(), task.pairs);
            let [left, right] = task.children(&split, task.pairs);
            tasks.copy_within(largest + 1..count, largest + 2);
            tasks[largest] = left;
            tasks[largest + 1] = right;
            count += 1;
        }
        Some(count)
    }
}

/// Moves pairs of children down to where the one before ends; returns the number of nodes.
fn close_gaps(nodes: &mut [BvhNode]) -> Option<usize> {
    let mut stack = [0u32; MAX_DEPTH];
    let (mut pending, mut used, mut at) = (0, 2, 0u32);
    loop {
        let node = nodes.get_mut(at as usize)?;
        if node.is_leaf() {
            if pending == 0 {
                return Some(used as usize);
            }
            pending -= 1;
            at = stack[pending];
            continue;
        }
        let pair = node.first as usize;
        node.first = used;
        // Pairs lie in the order of this walk, so the place is this pair's own, or one moved before.
        nodes.copy_within(pair..pair + 2, used as usize);
        *stack.get_mut(pending)? = used + 1;
        pending += 1;
        at = used;
        used += 2;
    }
}
