//! The tree as branches that grow independently, on any number of threads.

use super::MAX_DEPTH;
use super::bins::Bins;
use super::refs::PrimRef;
use super::split::{Areas, Extent};
use super::tree::{Grown, Limits, Splitter, Task};
use crate::block::BvhNode;
use crate::caller::{Caller, PARTS};
use crate::math::Aabb;
use crate::prim::GRAIN;

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
    let extent = whole(refs, caller);
    let areas = Areas::new(&extent.bounds.aabb());
    let uneven = are_uneven(refs, areas, caller);
    let effort = if uneven { limits.effort.for_uneven() } else { limits.effort };
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
    let count = splitter.branch_out(nodes, refs, &mut tasks, caller)?;
    let tasks = &tasks[..count];
    let mut branches: [Option<Branch>; BRANCHES] = [const { None }; BRANCHES];
    let (mut free_nodes, mut at_node) = (&mut *nodes, 0);
    for ((task, refs), branch) in tasks.iter().zip(ranges(tasks, refs)).zip(&mut branches) {
        let (first, room) = (task.pairs as usize, 2 * (task.budget - 1));
        let rest = core::mem::take(&mut free_nodes).split_at_mut_checked(first - at_node)?.1;
        let (nodes, rest) = rest.split_at_mut_checked(room)?;
        (free_nodes, at_node) = (rest, first + room);
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
    /// Splits the tasks that are large, at the same time, until there are enough or all are small; returns their
    /// number. They stay in the order of the tree.
    fn branch_out(
        self,
        nodes: &mut [BvhNode],
        refs: &mut [PrimRef],
        tasks: &mut [Task; BRANCHES],
        caller: &Caller,
    ) -> Option<usize> {
        let grain = (refs.len() / 48).max(BRANCH);
        let mut count = 1;
        while let Some(large) = self.large(&tasks[..count], grain) {
            let mut jobs = [const { None }; BRANCHES];
            for ((task, refs), job) in
                tasks.iter().zip(ranges(&tasks[..count], refs)).zip(&mut jobs)
            {
                *job = (task.count > large).then_some((*task, refs, None));
            }
            caller.for_each(&mut jobs[..count], |job| {
                if let Some((task, refs, split)) = job {
                    let mut bins = Bins::EMPTY;
                    *split = self.part(refs, task, &mut bins);
                }
            });
            let olds = *tasks;
            let olds_and_jobs = olds.iter().zip(&jobs).take(count);
            count = 0;
            for (task, job) in olds_and_jobs {
                let Some((_, _, split)) = job else {
                    tasks[count] = *task;
                    count += 1;
                    continue;
                };
                // More than a leaf, so it is split.
                let node = nodes.get_mut(task.node as usize)?;
                *node = BvhNode::inner(&task.extent.bounds.aabb(), task.pairs);
                tasks[count..count + 2]
                    .copy_from_slice(&task.children(split.as_ref()?, task.pairs));
                count += 2;
            }
        }
        Some(count)
    }

    /// Tasks with more refs than this are to be split: the least number, from `grain` on, for which there is room;
    /// `None` when there are none.
    fn large(self, tasks: &[Task], grain: usize) -> Option<usize> {
        let more = |large: usize| tasks.iter().filter(|task| task.count > large).count();
        let mut large = grain;
        while tasks.len() + more(large) > BRANCHES {
            large *= 2;
        }
        (more(large) > 0).then_some(large)
    }
}

/// The refs of each task: they follow each other.
fn ranges<'r>(tasks: &[Task], refs: &'r mut [PrimRef]) -> impl Iterator<Item = &'r mut [PrimRef]> {
    let mut free = refs;
    tasks.iter().map(move |task| {
        let count = task.count.min(free.len());
        let (refs, rest) = core::mem::take(&mut free).split_at_mut(count);
        free = rest;
        refs
    })
}

/// The box around all refs, and around their centres.
fn whole(refs: &[PrimRef], caller: &Caller) -> Extent {
    let mut extent = Extent::EMPTY;
    for part in caller.map_parts(refs.len(), part_size(refs), |part| Extent::around(&refs[part])) {
        extent.bounds.add(&part.bounds);
        extent.centres.add(&part.centres);
    }
    extent
}

/// Whether few refs are much larger than the others, such as the walls of a building.
fn are_uneven(refs: &[PrimRef], areas: Areas, caller: &Caller) -> bool {
    let parts = caller.map_parts(refs.len(), part_size(refs), |part| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for r in &refs[part] {
            let area = f64::from(areas.of_finite(&r.bounds));
            sum += area;
            squares += area * area;
        }
        (sum, squares)
    });
    let (sum, squares) = parts.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    // 1 where all are alike, about `n / k` where `k` have most of the area.
    squares * refs.len() as f64 > UNEVEN * sum * sum
}

/// Above this the areas of refs are uneven.
const UNEVEN: f64 = 64.0;

/// Parts that do not depend on the threads, as sums are rounded.
fn part_size(refs: &[PrimRef]) -> usize {
    refs.len().div_ceil(PARTS).max(GRAIN)
}

/// Moves pairs of children down to where the one before ends; returns the number of nodes.
fn close_gaps(nodes: &mut [BvhNode]) -> Option<usize> {
    let mut stack = [0u32; MAX_DEPTH];
    let (mut pending, mut used, mut at, mut prims) = (0, 2, 0u32, 0);
    loop {
        let node = nodes.get_mut(at as usize)?;
        if node.is_leaf() {
            node.first = prims;
            prims += Grown::of(node).0 as u32;
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
