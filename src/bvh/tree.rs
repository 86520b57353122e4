//! The binary tree over boxes, before there are leaf blocks: how a node is split, and a subtree grown.

use super::MAX_DEPTH;
use super::bins::{Bins, Effort, best_plane};
use super::branch::Branch;
use super::refs::PrimRef;
use super::split::{Areas, Extent};
use super::sweep::{FEW, sweep};
use crate::block::BvhNode;
use crate::math::Aabb;

/// A leaf that has no lanes yet: `lanes` holds the number of its primitives, and their kind in bit 8; `first` is, in
/// the end, the number of primitives in the leaves before.
pub(crate) struct Grown;

impl Grown {
    fn leaf(bounds: &Aabb, refs: &[PrimRef]) -> BvhNode {
        let sphere = u32::from(refs.first().is_some_and(PrimRef::is_sphere));
        let count: usize = refs.iter().map(PrimRef::count).sum();
        BvhNode { lanes: count as u32 | sphere << 8, ..BvhNode::inner(bounds, 0) }
    }

    /// The number of primitives, and whether they are spheres.
    pub fn of(node: &BvhNode) -> (usize, bool) {
        ((node.lanes & 0xFF) as usize, node.lanes >> 8 != 0)
    }
}

/// What a tree may be.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    /// Leaves at most.
    pub leaves: usize,
    /// Refs of a leaf at most; 4 to 6.
    pub leaf_max: usize,
    /// Whether there are triangles and spheres: a leaf is of one kind.
    pub mixed: bool,
    /// Whether to split as long as the leaves last, and not as long as it pays.
    pub deep: bool,
    /// How carefully planes are chosen.
    pub effort: Effort,
}

/// Cost of a step to two children, in tests of one primitive.
const STEP_COST: f32 = 2.0;

/// A subtree to build: the refs `first .. first + count` under node `node`.
#[derive(Clone, Copy)]
pub(super) struct Task {
    pub node: u32,
    /// Where the nodes below it begin.
    pub pairs: u32,
    pub first: usize,
    pub count: usize,
    pub depth: usize,
    /// Leaves it may have.
    pub budget: usize,
    pub extent: Extent,
}

/// Where a node's refs are parted, the fewest leaves that either side needs, and their boxes.
pub(super) struct Split {
    left_count: usize,
    least: [usize; 2],
    sides: [Extent; 2],
}

/// The fewest leaves that `count` refs can always be brought into by halving, and by parting
/// kinds at the end when both occur.
///
/// By induction: what is at most a leaf is one leaf, or two of different kinds; what is more, `leaf_max + 1` at
/// least, has halves of at least `half`, the lesser half of that, and `count / half` is superadditive.
fn fewest_leaves(count: usize, mixed: bool, leaf_max: usize) -> usize {
    let half = leaf_max.div_ceil(2);
    match (count, mixed) {
        (0 | 1, _) => count,
        (_, false) => (count / half).max(1),
        (_, true) => (2 * count / half).max(2),
    }
}

/// The leaves that a tree over `count` refs may have: `full` is what good trees want, the
/// other bound the least that works.
pub(crate) fn leaf_budget(count: usize, mixed: bool, leaf_max: usize, full: bool) -> usize {
    let least = fewest_leaves(count, mixed, leaf_max);
    let wanted = if mixed { count } else { count.div_ceil(2) };
    if full { wanted.max(least) } else { least }
}

/// Levels below a node of `count` primitives that is halved down to leaves.
fn levels_to_halve(count: usize, leaf_max: usize) -> usize {
    let leaves = count.div_ceil(leaf_max).next_power_of_two();
    // One more level, to part kinds.
    leaves.trailing_zeros() as usize + 1
}

/// How nodes are split.
#[derive(Clone, Copy)]
pub(super) struct Splitter<'l> {
    pub limits: &'l Limits,
    pub areas: Areas,
}

impl Splitter<'_> {
    /// Grows a branch; returns its root.
    pub fn grow_branch(self, branch: &mut Branch) -> Option<BvhNode> {
        let Branch { task: whole, nodes, refs, .. } = branch;
        let mut root = None;
        let mut bins = Bins::EMPTY;
        let mut stack = [*whole; MAX_DEPTH];
        let mut pending = 1;
        let mut used = whole.pairs;
        while pending > 0 {
            pending -= 1;
            let task = stack[pending];
            let first = task.first - whole.first;
            let range = refs.get_mut(first..first + task.count)?;
            let split = self.part(range, &task, &mut bins);
            let aabb = task.extent.bounds.aabb();
            let node = match &split {
                None => Grown::leaf(&aabb, range),
                Some(_) => BvhNode::inner(&aabb, used),
            };
            match task.node.checked_sub(whole.pairs) {
                Some(place) if task.depth > whole.depth => *nodes.get_mut(place as usize)? = node,
                _ => root = Some(node),
            }
            let Some(split) = split else { continue };
            let [left, right] = task.children(&split, used);
            used += 2;
            // The left child is taken next, so its subtree is stored before the right one's.
            for child in [right, left] {
                *stack.get_mut(pending)? = child;
                pending += 1;
            }
        }
        root
    }
}

impl Task {
    /// The tasks of the sides, whose nodes are the pair at `pair`.
    pub fn children(&self, split: &Split, pair: u32) -> [Task; 2] {
        let depth = self.depth + 1;
        let (count, budget) = (split.left_count, share(self, split));
        let [left, right] = split.sides;
        let (first, pairs) = (self.first, pair + 2);
        let left = Task { node: pair, pairs, first, count, depth, budget, extent: left };
        // A subtree has a pair for each of its leaves but one.
        let pairs = pairs + 2 * (budget as u32).saturating_sub(1);
        let (first, count) = (first + count, self.count - count);
        let budget = self.budget - budget;
        [left, Task { node: pair + 1, pairs, first, count, depth, budget, extent: right }]
    }
}

/// The leaves that the left child may have: its share by count, but enough for either side.
fn share(task: &Task, split: &Split) -> usize {
    let [least, least_right] = split.least;
    let most = task.budget.saturating_sub(least_right).max(least);
    let fair = (task.budget as u64 * split.left_count as u64 / task.count as u64) as usize;
    fair.clamp(least, most).min(task.budget)
}

impl Splitter<'_> {
    /// Parts the refs of a node in two, or decides for a leaf.
    pub fn part(self, refs: &mut [PrimRef], task: &Task, bins: &mut Bins) -> Option<Split> {
        let (Limits { leaf_max, mixed, deep, effort, .. }, areas) = (*self.limits, self.areas);
        let count = refs.len();
        let spheres = if mixed { refs.iter().filter(|r| r.is_sphere()).count() } else { 0 };
        let one_kind = !mixed || spheres == 0 || spheres == count;
        let may_be_leaf = count <= leaf_max && one_kind;
        if may_be_leaf && (count == 1 || task.budget < 2) {
            return None;
        }
        let least = |left_count: usize| {
            [left_count, count - left_count].map(|n| fewest_leaves(n, mixed, leaf_max))
        };
        let pays = |work: f32| {
            let area = areas.of(&task.extent.bounds.aabb());
            // Everything on one line or in one point: any split is as good as another.
            STEP_COST * area + work < area * count as f32 || area == 0.0
        };
        let lasts = |left_count: usize| {
            let [left, right] = least(left_count);
            let levels = levels_to_halve(left_count.max(count - left_count), leaf_max);
            left + right <= task.budget && task.depth + 1 + levels < MAX_DEPTH
        };
        let sah = if count <= FEW {
            let sweep = sweep(refs, areas, lasts).filter(|s| !may_be_leaf || deep || pays(s.work));
            sweep.map(|s| Split {
                left_count: s.left_count,
                least: least(s.left_count),
                sides: s.sides,
            })
        } else {
            // None when all centres are in one point.
            best_plane(refs, &task.extent.centres, areas, effort, bins).and_then(|plane| {
                let left_count = plane.part(refs);
                lasts(left_count).then(|| split_at(refs, left_count, least(left_count)))
            })
        };
        match sah {
            Some(split) => Some(split),
            None if may_be_leaf => None,
            // Few, but of two kinds: each kind can be one leaf.
            None if count <= leaf_max => {
                refs.sort_unstable_by_key(|r| (r.is_sphere(), r.id()));
                Some(split_at(refs, count - spheres, [1, 1]))
            }
            None => Some(split_at(refs, count / 2, least(count / 2))),
        }
    }
}

fn split_at(refs: &[PrimRef], left_count: usize, least: [usize; 2]) -> Split {
    let (left, right) = refs.split_at(left_count);
    Split { left_count, least, sides: [Extent::around(left), Extent::around(right)] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::branch::grow;
    use crate::caller::Caller;

    #[test]
    fn budgets_are_enough_for_halving() {
        for (mixed, leaf_max) in [4, 5, 6].into_iter().flat_map(|n| [(false, n), (true, n)]) {
            for count in 2..2000 {
                let fewest = |count| fewest_leaves(count, mixed, leaf_max);
                let halves = fewest(count / 2) + fewest(count - count / 2);
                let done = if mixed { 2 } else { 1 };
                let least = if count <= leaf_max { done } else { halves };
                assert!(least <= fewest(count), "{count} {mixed} {leaf_max}");
            }
        }
    }

    #[test]
    fn the_most_primitives_fit_the_depth() {
        assert!(levels_to_halve(1 << 30, 4) < MAX_DEPTH - 32);
        assert_eq!((levels_to_halve(5, 5), levels_to_halve(6, 5)), (1, 2));
        assert_eq!((levels_to_halve(6, 6), levels_to_halve(7, 6)), (1, 2));
    }

    /// Levels of a tree, the root's included.
    fn levels(nodes: &[BvhNode]) -> usize {
        let mut depth = std::vec![1; nodes.len()];
        for (i, node) in nodes.iter().enumerate().filter(|(i, node)| *i != 1 && !node.is_leaf()) {
            depth[node.first as usize] = depth[i] + 1;
            depth[node.first as usize + 1] = depth[i] + 1;
        }
        depth.into_iter().max().unwrap_or(0)
    }

    /// Boxes each `ratio` times as large and as far away as the one before: SAH parts the largest from
    /// the others, again and again.
    fn series(count: usize, ratio: f64) -> std::vec::Vec<PrimRef> {
        let start = ratio.powi(-(count as i32) / 2);
        let boxes = (0..count).map(|i| {
            let size = (start * ratio.powi(i as i32)) as f32;
            let aabb = Aabb { lower: [size, 0.0, 0.0], upper: [1.25 * size, size / 8.0, 0.0] };
            PrimRef::new(i as u32, &aabb, false)
        });
        boxes.collect()
    }

    #[test]
    fn no_scene_is_deeper_than_the_stack() {
        let mut deepest = 0;
        for ratio in [1.1f64, 1.3, 1.5, 2.0, 3.0, 4.0, 8.0] {
            for (leaf_max, deep) in [(5, true), (6, false)] {
                let count = (240.0 / ratio.log2()) as usize;
                let leaves = leaf_budget(count, false, leaf_max, true);
                let mut refs = series(count, ratio);
                let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * leaves];
                let limits =
                    Limits { leaves, leaf_max, mixed: false, deep, effort: Effort::BALANCED };
                let used =
                    grow(&mut nodes, &mut refs, &limits, &Caller::new(None, None)).expect("room");
                let levels = levels(&nodes[..used]);
                assert!(levels <= MAX_DEPTH, "{ratio} {leaf_max}: {levels}");
                deepest = deepest.max(levels);
            }
        }
        assert!(deepest > 55, "the series is no test: {deepest}");
    }
}
