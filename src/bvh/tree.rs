//! Binned SAH: the tree over boxes, before there are leaf blocks.

#![allow(unsafe_code, reason = "a promise about the layout drawn here")]

use glam::DVec3;

use super::MAX_DEPTH;
use crate::block::BvhNode;
use crate::math::Aabb;
use crate::prim::{Shape, for_each_prim};
use crate::scene::Scene;
use crate::storage::Plain;

/// A primitive as the builder sees it.
///
/// ```text
/// byte 0       12   16      28          32
///      | lower | id | upper | is sphere |
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct PrimRef {
    pub lower: [f32; 3],
    pub id: u32,
    pub upper: [f32; 3],
    /// 0 or 1.
    pub sphere: u32,
}
const _: () = assert!(size_of::<PrimRef>() == 32);

// SAFETY: numbers only; 12 + 4 + 12 + 4 = 32, so no padding.
unsafe impl Plain for PrimRef {}

impl PrimRef {
    pub fn new(id: u32, aabb: &Aabb, sphere: bool) -> Self {
        PrimRef { lower: aabb.lower, id, upper: aabb.upper, sphere: u32::from(sphere) }
    }

    fn aabb(&self) -> Aabb {
        Aabb { lower: self.lower, upper: self.upper }
    }
}

/// Writes a ref for each primitive that can be hit.
pub(crate) fn gather(scene: &Scene, refs: &mut [PrimRef]) {
    let mut free = refs.iter_mut();
    for_each_prim(scene, |prim| {
        if let Some(r) = free.next() {
            let sphere = matches!(prim.shape, Shape::Sphere { .. });
            *r = PrimRef::new(prim.id, &prim.shape.aabb(), sphere);
        }
    });
}

/// A leaf that has no lanes yet: `first` is its first ref; `lanes` holds the number of its refs, and
/// their kind in bit 8.
pub(crate) struct Grown;

impl Grown {
    fn leaf(bounds: &Aabb, first: usize, refs: &[PrimRef]) -> BvhNode {
        let sphere = refs.first().map_or(0, |r| r.sphere);
        BvhNode { lanes: refs.len() as u32 | sphere << 8, ..BvhNode::inner(bounds, first as u32) }
    }

    /// The number of refs, and whether they are spheres.
    pub fn of(node: &BvhNode) -> (usize, bool) {
        ((node.lanes & 0xFF) as usize, node.lanes >> 8 != 0)
    }
}

/// Areas of boxes as `f32`, in units in which a scene's coordinates are about 1 at most: they
/// neither overflow nor, unless a box is 1e-19 of the scene, underflow.
#[derive(Clone, Copy)]
pub(crate) struct Areas(f32);

impl Areas {
    pub fn new(bounds: &Aabb) -> Self {
        // 2 to the minus exponent, as far as that is a normal number.
        let exponent = bounds.reach().to_bits() >> 23;
        Areas(f32::from_bits(254u32.saturating_sub(exponent).max(1) << 23))
    }

    /// Half the surface area. Finite, and not NaN, for infinite boxes too.
    pub fn of(self, aabb: &Aabb) -> f32 {
        let edge = |k: usize| {
            let edge = aabb.upper[k] * self.0 - aabb.lower[k] * self.0;
            if edge < 16.0 { if edge > 0.0 { edge } else { 0.0 } } else { 16.0 }
        };
        let [x, y, z] = [edge(0), edge(1), edge(2)];
        x * y + y * z + z * x
    }
}

/// What a tree may be.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    /// Leaves at most.
    pub leaves: usize,
    /// Primitives of a leaf at most; 5 or 6.
    pub leaf_max: usize,
    /// Whether there are triangles and spheres: a leaf is of one kind.
    pub mixed: bool,
    /// Whether to split as long as the leaves last, and not as long as it pays.
    pub deep: bool,
}

/// Cost of a step to two children, in tests of one primitive.
const STEP_COST: f64 = 2.0;
const BINS: usize = 16;

/// A subtree to build: the refs `first .. first + count` under node `node`.
#[derive(Clone, Copy)]
struct Task {
    node: u32,
    first: usize,
    count: usize,
    depth: usize,
    /// Leaves it may have.
    budget: usize,
    bounds: Aabb,
}

/// Where a node's refs are parted, the fewest leaves that either side needs, and their boxes.
struct Split {
    left_count: usize,
    least: [usize; 2],
    left: Aabb,
    right: Aabb,
}

/// The fewest leaves that `count` primitives can always be brought into by halving, and by parting
/// kinds at the end when both occur.
///
/// By induction: what is at most a leaf is one leaf, or two of different kinds; what is more, six at
/// least, has halves of at least three, and `count / 3` is superadditive.
fn fewest_leaves(count: usize, mixed: bool) -> usize {
    match (count, mixed) {
        (0 | 1, _) => count,
        (_, false) => (count / 3).max(1),
        (_, true) => (2 * count / 3).max(2),
    }
}

/// The leaves that a tree over `count` primitives may have: `full` is what good trees want, the
/// other bound the least that works.
pub(crate) fn leaf_budget(count: usize, mixed: bool, full: bool) -> usize {
    let least = fewest_leaves(count, mixed);
    let wanted = if mixed { count } else { count.div_ceil(2) };
    if full { wanted.max(least) } else { least }
}

/// Levels below a node of `count` primitives that is halved down to leaves.
fn levels_to_halve(count: usize, leaf_max: usize) -> usize {
    let leaves = count.div_ceil(leaf_max).next_power_of_two();
    // One more level, to part kinds.
    leaves.trailing_zeros() as usize + 1
}

/// Builds the tree over `refs`, of which there is at least one, and brings them into the order of
/// the leaves. Returns the number of nodes.
///
/// Nodes are laid out as [`tree_is_sound`](super::tree_is_sound) expects them; leaves are
/// [`Grown`] until they are packed. `nodes` has two entries for each leaf of `budget`.
///
/// Source: \[Wald07\], with leaves limited in number as the memory is.
pub(crate) fn grow(nodes: &mut [BvhNode], refs: &mut [PrimRef], limits: &Limits) -> Option<usize> {
    let budget = limits.leaves;
    let bounds = bounds_of(refs);
    let mut stack =
        [Task { node: 0, first: 0, count: refs.len(), depth: 0, budget, bounds }; MAX_DEPTH];
    let mut pending = 1;
    let mut used = 2;
    while pending > 0 {
        pending -= 1;
        let task = stack[pending];
        let range = refs.get_mut(task.first..task.first + task.count)?;
        let node = nodes.get_mut(task.node as usize)?;
        let Some(split) = part(range, &task, limits) else {
            *node = Grown::leaf(&task.bounds, task.first, range);
            continue;
        };
        *node = BvhNode::inner(&task.bounds, used);
        let right_count = task.count - split.left_count;
        let left_budget = share(&task, &split);
        let children = [
            Task {
                node: used + 1,
                first: task.first + split.left_count,
                count: right_count,
                depth: task.depth + 1,
                budget: task.budget - left_budget,
                bounds: split.right,
            },
            Task {
                node: used,
                first: task.first,
                count: split.left_count,
                depth: task.depth + 1,
                budget: left_budget,
                bounds: split.left,
            },
        ];
        used += 2;
        // The left child is taken next, so its subtree is stored before the right one's.
        for child in children {
            *stack.get_mut(pending)? = child;
            pending += 1;
        }
    }
    Some(used as usize)
}

/// The leaves that the left child may have: its share by count, but enough for either side.
fn share(task: &Task, split: &Split) -> usize {
    let [least, least_right] = split.least;
    let most = task.budget.saturating_sub(least_right).max(least);
    let fair = (task.budget as u64 * split.left_count as u64 / task.count as u64) as usize;
    fair.clamp(least, most).min(task.budget)
}

/// Parts the refs of a node in two, or decides for a leaf.
fn part(refs: &mut [PrimRef], task: &Task, limits: &Limits) -> Option<Split> {
    let Limits { leaf_max, mixed, deep, .. } = *limits;
    let count = refs.len();
    let spheres = if mixed { refs.iter().filter(|r| r.sphere != 0).count() } else { 0 };
    let one_kind = !mixed || spheres == 0 || spheres == count;
    let may_be_leaf = count <= leaf_max && one_kind;
    if may_be_leaf && (count == 1 || task.budget < 2) {
        return None;
    }
    let least = |left_count: usize| {
        [fewest_leaves(left_count, mixed), fewest_leaves(count - left_count, mixed)]
    };
    let sah = binned(refs, task).filter(|plane| {
        let [left, right] = least(plane.left_count);
        let levels = levels_to_halve(plane.left_count.max(count - plane.left_count), leaf_max);
        left + right <= task.budget && task.depth + 1 + levels < MAX_DEPTH
    });
    match sah {
        Some(plane) if !may_be_leaf || deep || plane.cost < count as f64 => {
            let left_count = partition(refs, |r| plane.is_left(r));
            let least = least(left_count);
            Some(Split { left_count, least, left: plane.left, right: plane.right })
        }
        _ if may_be_leaf => None,
        // Few, but of two kinds: each kind can be one leaf.
        _ if count <= leaf_max => {
            let left_count = partition(refs, |r| r.sphere == 0);
            Some(split_at(refs, left_count, [1, 1]))
        }
        _ => Some(split_at(refs, count / 2, least(count / 2))),
    }
}

fn split_at(refs: &[PrimRef], left_count: usize, least: [usize; 2]) -> Split {
    let (left, right) = refs.split_at(left_count);
    Split { left_count, least, left: bounds_of(left), right: bounds_of(right) }
}

fn bounds_of(refs: &[PrimRef]) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for r in refs {
        bounds.add(&r.aabb());
    }
    bounds
}

/// Brings the refs for which `left` holds to the front; returns their number.
fn partition(refs: &mut [PrimRef], left: impl Fn(&PrimRef) -> bool) -> usize {
    let (mut i, mut end) = (0, refs.len());
    while i < end {
        if left(&refs[i]) {
            i += 1;
        } else {
            end -= 1;
            refs.swap(i, end);
        }
    }
    i
}

/// The plane with the least cost, between two bins of one axis.
struct Plane {
    binning: Binning,
    axis: usize,
    /// Bins below this one are left.
    bin: usize,
    cost: f64,
    left_count: usize,
    left: Aabb,
    right: Aabb,
}

impl Plane {
    fn is_left(&self, r: &PrimRef) -> bool {
        self.binning.bins_of(r)[self.axis] < self.bin
    }
}

/// How centroids fall into bins.
#[derive(Clone, Copy)]
struct Binning {
    lower: DVec3,
    scale: DVec3,
}

impl Binning {
    fn around(refs: &[PrimRef]) -> Self {
        let mut lower = DVec3::splat(f64::INFINITY);
        let mut upper = DVec3::splat(f64::NEG_INFINITY);
        for r in refs {
            let c = r.aabb().centroid2();
            lower = lower.min(c);
            upper = upper.max(c);
        }
        Binning { lower, scale: BINS as f64 / (upper - lower) }
    }

    /// The bin on each axis. A float-to-integer cast saturates and sends NaN, which comes from
    /// infinite boxes or an axis without extent, to 0: everything is in some bin.
    fn bins_of(&self, r: &PrimRef) -> [usize; 3] {
        let at = (r.aabb().centroid2() - self.lower) * self.scale;
        at.to_array().map(|x| (x as usize).min(BINS - 1))
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

const EMPTY_BIN: Bin = Bin { bounds: Aabb::EMPTY, count: 0 };

impl Bin {
    fn add(&mut self, bounds: &Aabb, count: usize) {
        self.bounds.add(bounds);
        self.count += count;
    }
}

/// The best split by bins, or `None` when all centroids fall into one.
fn binned(refs: &[PrimRef], task: &Task) -> Option<Plane> {
    let binning = Binning::around(refs);
    let mut bins = [[EMPTY_BIN; BINS]; 3];
    for r in refs {
        let aabb = r.aabb();
        for (axis, bin) in binning.bins_of(r).into_iter().enumerate() {
            bins[axis][bin].add(&aabb, 1);
        }
    }
    let mut best: Option<Plane> = None;
    for (axis, bins) in bins.iter().enumerate() {
        // What lies right of each plane, from the right; then what lies left, and the cost.
        let mut right = [EMPTY_BIN; BINS];
        let mut sum = EMPTY_BIN;
        for bin in (1..BINS).rev() {
            sum.add(&bins[bin].bounds, bins[bin].count);
            right[bin] = sum;
        }
        let mut left = EMPTY_BIN;
        for bin in 1..BINS {
            left.add(&bins[bin - 1].bounds, bins[bin - 1].count);
            let right = right[bin];
            if left.count == 0 || right.count == 0 {
                continue;
            }
            let work = left.bounds.half_area() * left.count as f64
                + right.bounds.half_area() * right.count as f64;
            let area = task.bounds.half_area();
            // Everything on one line or in one point: any split is as good as another.
            let cost = STEP_COST + if area > 0.0 { work / area } else { 0.0 };
            if best.as_ref().is_none_or(|best| cost < best.cost) {
                best = Some(Plane {
                    binning,
                    axis,
                    bin,
                    cost,
                    left_count: left.count,
                    left: left.bounds,
                    right: right.bounds,
                });
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_enough_for_halving() {
        for mixed in [false, true] {
            for count in 2..2000 {
                let half = count / 2;
                let halves = fewest_leaves(half, mixed) + fewest_leaves(count - half, mixed);
                let done = if mixed { 2 } else { 1 };
                let least = if count < 6 { done } else { halves };
                assert!(least <= fewest_leaves(count, mixed), "{count} {mixed}");
            }
        }
    }

    #[test]
    fn the_most_primitives_fit_the_depth() {
        assert!(levels_to_halve(1 << 30, 5) < MAX_DEPTH - 32);
        assert_eq!((levels_to_halve(5, 5), levels_to_halve(6, 5)), (1, 2));
        assert_eq!((levels_to_halve(6, 6), levels_to_halve(7, 6)), (1, 2));
    }
}
