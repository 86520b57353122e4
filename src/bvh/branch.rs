//! The tree as branches that grow independently, on any number of threads.

use super::MAX_DEPTH;
use super::refs::PrimRef;
use super::split::{Areas, Extent};
use super::spread::part_size;
use super::task::{Known, Split, Task};
use super::tree::{Grown, Limits, Splitter};
use crate::block::BvhNode;
use crate::caller::Caller;
use crate::kinds::{THREADS, WIDE};
use crate::math::Aabb;
use crate::simd::SMALL;

/// How much a tree has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub nodes: usize,
    /// Refs of all leaves.
    pub refs: usize,
    /// Primitives of all leaves; what is cut in two counts twice.
    pub prims: usize,
}

/// Builds the tree over the first `count` of `slots`, of which there is at least one, and brings them
/// into the order of the leaves. If there are more slots and `limits` says where shapes are, refs may be
/// cut in two.
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
    slots: &mut [PrimRef],
    count: usize,
    limits: &Limits,
    caller: &Caller,
) -> Option<Size> {
    let extent = whole(slots.get(..count)?, caller)?;
    let bounds = extent.bounds.aabb();
    let areas = Areas::new(&bounds);
    let splitter = Splitter { limits, areas, whole: areas.of(&bounds) };
    let room = if limits.source.is_some() { slots.len() } else { count };
    let budget = limits.leaves;
    let root = Task {
        node: 0,
        pairs: 2,
        first: 0,
        count,
        room,
        depth: 0,
        budget,
        even: false,
        known: Known::of(extent),
    };
    if THREADS {
        splitter.grow_apart(root, nodes, slots, caller)?;
    } else {
        splitter.grow_at_once(root, nodes, slots)?;
    }
    let size = close_gaps(nodes, slots)?;
    if !SMALL {
        close_boxes(nodes.get_mut(..size.nodes)?);
    }
    Some(size)
}

impl Splitter<'_, '_, '_> {
    /// Grows the tree by branches that need not wait for each other.
    fn grow_apart(
        self,
        root: Task,
        nodes: &mut [BvhNode],
        slots: &mut [PrimRef],
        caller: &Caller,
    ) -> Option<()> {
        let mut tasks = [root; BRANCHES];
        let count = self.branch_out(nodes, slots, &mut tasks, caller)?;
        let tasks = &tasks[..count];
        let mut branches: [Option<Branch>; BRANCHES] = [const { None }; BRANCHES];
        let (mut free_nodes, mut at_node) = (&mut *nodes, 0);
        for ((task, refs), branch) in tasks.iter().zip(places(tasks, slots)).zip(&mut branches) {
            let (first, room) = (task.pairs as usize, 2 * (task.budget - 1));
            let rest = core::mem::take(&mut free_nodes).split_at_mut_checked(first - at_node)?.1;
            let (nodes, rest) = rest.split_at_mut_checked(room)?;
            (free_nodes, at_node) = (rest, first + room);
            *branch = Some(Branch { task: *task, nodes, refs, root: None });
        }
        caller.for_each(&mut branches[..count], |branch| {
            if let Some(branch) = branch {
                branch.root = self.grow_branch(branch);
            }
        });
        let mut roots = [BvhNode::inner(&Aabb::EMPTY, 0); BRANCHES];
        for (root, branch) in roots.iter_mut().zip(branches.iter().flatten()) {
            *root = branch.root?;
        }
        for (task, root) in tasks.iter().zip(roots) {
            *nodes.get_mut(task.node as usize)? = root;
        }
        Some(())
    }

    /// Grows the same tree as one branch.
    fn grow_at_once(self, task: Task, nodes: &mut [BvhNode], refs: &mut [PrimRef]) -> Option<()> {
        let (root, nodes) = nodes.split_at_mut_checked(task.pairs as usize)?;
        let mut branch = Branch { task, nodes, refs, root: None };
        *root.first_mut()? = self.grow_branch(&mut branch)?;
        Some(())
    }
}

/// Branches at most. How many there are must not depend on the threads, as the tree must not.
const BRANCHES: usize = 64;
/// Branches of fewer refs are not parted further.
const BRANCH: usize = 256;

/// A subtree of its own, with its places.
pub(super) struct Branch<'b> {
    pub task: Task,
    pub nodes: &'b mut [BvhNode],
    pub refs: &'b mut [PrimRef],
    /// Its root, when it has grown.
    root: Option<BvhNode>,
}

impl Splitter<'_, '_, '_> {
    /// Splits the tasks that are large, at the same time, until there are enough or all are small; returns their
    /// number. They stay in the order of the tree.
    fn branch_out(
        self,
        nodes: &mut [BvhNode],
        slots: &mut [PrimRef],
        tasks: &mut [Task; BRANCHES],
        caller: &Caller,
    ) -> Option<usize> {
        let grain = (tasks[0].count / 48).max(BRANCH);
        let mut count = 1;
        while let Some(large) = self.large(&tasks[..count], grain) {
            let mut jobs = [const { None }; BRANCHES];
            for ((task, slots), job) in
                tasks.iter().zip(places(&tasks[..count], slots)).zip(&mut jobs)
            {
                *job = (task.count > large).then_some((*task, slots, None));
            }
            caller.for_each(&mut jobs[..count], |job| {
                if let Some((task, slots, children)) = job {
                    *children = self.children(task, slots);
                }
            });
            let olds = *tasks;
            let olds_and_jobs = olds.iter().zip(&jobs).take(count);
            count = 0;
            for (task, job) in olds_and_jobs {
                let Some((_, _, parted)) = job else {
                    tasks[count] = *task;
                    count += 1;
                    continue;
                };
                let (aabb, children) = parted.as_ref()?;
                *nodes.get_mut(task.node as usize)? = BvhNode::inner(aabb, task.pairs);
                tasks[count..count + 2].copy_from_slice(children);
                count += 2;
            }
        }
        Some(count)
    }

    /// The box around what a task splits, and what it is split into.
    fn children(self, task: &Task, slots: &mut [PrimRef]) -> Option<(Aabb, [Task; 2])> {
        let refs = slots.get(..task.count)?;
        let extent = task.known.extent(refs, self.step(refs, task.even));
        let (mut left, mut right, mut split) = (Task::UNUSED, *task, Split::NONE);
        // More than a leaf, so it is split.
        if !self.part(slots, task, &extent, (&mut self.scratch(), &mut split)) {
            return None;
        }
        right.part(&mut left, &split, task.pairs, slots)?;
        Some((extent.bounds.aabb(), [left, right]))
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

/// The slots of each task: they follow each other.
fn places<'r>(tasks: &[Task], slots: &'r mut [PrimRef]) -> impl Iterator<Item = &'r mut [PrimRef]> {
    let mut free = slots;
    tasks.iter().map(move |task| {
        let room = task.room.min(free.len());
        let (slots, rest) = core::mem::take(&mut free).split_at_mut(room);
        free = rest;
        slots
    })
}

/// The box around all refs, and around their centres.
pub(super) fn whole(refs: &[PrimRef], caller: &Caller) -> Option<Extent> {
    if !THREADS {
        return Some(Extent::around(refs));
    }
    let mut extent = Some(Extent::EMPTY);
    let around = |part| refs.get(part).map(Extent::around);
    caller.for_parts(refs.len(), part_size(refs), around, |part| {
        extent = extent.zip(part).map(|(extent, part)| extent.with(&part));
    });
    extent
}

/// Gives nodes whose boxes were left open those of their children, which come after them.
fn close_boxes(nodes: &mut [BvhNode]) {
    for i in (0..nodes.len()).rev() {
        let node = &nodes[i];
        if node.is_leaf() || node.lower[0] <= node.upper[0] {
            continue;
        }
        let pair = node.first as usize;
        if let Some([left, right]) = nodes.get(pair..pair + 2) {
            let mut aabb = left.aabb();
            aabb.add(&right.aabb());
            nodes[i] = BvhNode::inner(&aabb, pair as u32);
        }
    }
}

/// Moves pairs of children, and the refs of leaves, down to where the ones before end.
fn close_gaps(nodes: &mut [BvhNode], slots: &mut [PrimRef]) -> Option<Size> {
    let mut stack = [0u32; MAX_DEPTH];
    let mut size = Size { nodes: 2, refs: 0, prims: 0 };
    let (mut pending, mut at) = (0, 0u32);
    loop {
        let node = nodes.get_mut(at as usize)?;
        if node.is_leaf() {
            let (first, count) = (node.first as usize, Grown::ref_count(node));
            // Slots stay free only where refs may be cut.
            if WIDE && first != size.refs {
                slots.get(first..first + count)?;
                slots.copy_within(first..first + count, size.refs);
            }
            node.first = size.prims as u32;
            size.refs += count;
            size.prims += Grown::of(node).0;
            if pending == 0 {
                return Some(size);
            }
            pending -= 1;
            at = *stack.get(pending)?;
            continue;
        }
        let (pair, place) = (node.first as usize, size.nodes);
        node.first = place as u32;
        // Pairs lie in the order of this walk, so the place is this pair's own, or one moved before.
        if THREADS {
            nodes.copy_within(pair..pair + 2, place);
        }
        at = place as u32;
        *stack.get_mut(pending)? = at + 1;
        pending += 1;
        size.nodes += 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::bins::Effort;
    use crate::bvh::budget::leaf_budget;
    use crate::bvh::tree::Depth;
    use crate::bvh::tree::tests::series;
    use raykern_harness::make::Random;
    use std::vec::Vec;

    #[test]
    fn branches_are_those_of_a_tree_that_grows_at_once() {
        let count = 20_000;
        let leaves = leaf_budget(count, false, 6, true);
        let effort = Effort::BALANCED;
        let limits = Limits::new(leaves, 6, Depth::Paying, effort);
        let (refs, caller) = (series(count, 1.001), Caller::new(None, None));
        let extent = Extent::around(&refs);
        let areas = Areas::new(&extent.bounds.aabb());
        let splitter = Splitter { limits: &limits, areas, whole: areas.of(&extent.bounds.aabb()) };
        let ([depth, budget], known) = ([0, leaves], Known::of(extent));
        let (room, even) = (count, false);
        let root = Task { node: 0, pairs: 2, first: 0, count, room, depth, budget, even, known };
        let tree = |apart: bool| {
            let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * leaves];
            let mut refs = refs.clone();
            let grown = match apart {
                true => splitter.grow_apart(root, &mut nodes, &mut refs, &caller),
                false => splitter.grow_at_once(root, &mut nodes, &mut refs),
            };
            let size = grown.and_then(|()| close_gaps(&mut nodes, &mut refs)).expect("room");
            nodes.truncate(size.nodes);
            let bits =
                |node: &BvhNode| (node.aabb().lower.map(f32::to_bits), node.first, node.lanes);
            let ids: Vec<_> = refs.iter().map(PrimRef::id).collect();
            (nodes.iter().map(bits).collect::<Vec<_>>(), ids)
        };
        assert!(tree(true) == tree(false));
    }

    #[test]
    fn what_stands_apart_is_parted_first() {
        let (count, leaf_max, depth) = (5_000, 4, Depth::Whole);
        let refs = series(count, 1.001);
        for apart in [0, 1, 3, 7] {
            let effort = Effort::BALANCED;
            let limits = Limits { apart, ..Limits::new(count, leaf_max, depth, effort) };
            let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * count];
            let (mut grown, caller) = (refs.clone(), Caller::new(None, None));
            grow(&mut nodes, &mut grown, count, &limits, &caller).expect("room");
            let left = nodes[nodes[0].first as usize];
            let mut around = Aabb::EMPTY;
            refs[..apart].iter().for_each(|r| around.add(&r.bounds.aabb()));
            assert_eq!(left.aabb() == around, apart > 0, "{apart}");
        }
    }

    #[test]
    fn boxes_are_those_of_what_is_below() {
        let mut random = Random::new(3);
        let mut refs: Vec<_> = (0..20_000)
            .map(|id| {
                let lower = random.point(0.0, 1.0).map(|x| x as f32);
                PrimRef::new(id, &Aabb { lower, upper: lower.map(|x| x + 0.01) }, false)
            })
            .collect();
        let count = refs.len();
        let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); count];
        let (fast, balanced) = (Effort::FAST, Effort::BALANCED);
        let careful = balanced.for_uneven(f64::INFINITY).expect("more effort");
        // All choose planes of large nodes by samples, the last one of those that turn out to be even.
        for (effort, even) in [(fast, None), (balanced, None), (careful, Some(balanced))] {
            let (leaves, leaf_max, depth) = (count / 2, 4, Depth::Whole);
            let limits = Limits { even, ..Limits::new(leaves, leaf_max, depth, effort) };
            let size = grow(&mut nodes, &mut refs, count, &limits, &Caller::new(None, None));
            assert_eq!(size.map(|size| size.refs), Some(count));
            let (mut pending, mut first) = (std::vec![0], 0);
            while let Some(at) = pending.pop() {
                let node = nodes[at];
                let mut around = Aabb::EMPTY;
                if node.is_leaf() {
                    let end = first + Grown::ref_count(&node);
                    refs[first..end].iter().for_each(|r| around.add(&r.bounds.aabb()));
                    first = end;
                } else {
                    let pair = node.first as usize;
                    nodes[pair..pair + 2].iter().for_each(|child| around.add(&child.aabb()));
                    pending.extend([pair + 1, pair]);
                }
                assert_eq!(node.aabb(), around, "{at}");
            }
            assert_eq!(first, count);
        }
    }
}
