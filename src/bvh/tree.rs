//! The binary tree over boxes, before there are leaf blocks: how a node is split, and a subtree grown.

use super::MAX_DEPTH;
use super::bins::{Bins, Effort, best_plane};
use super::branch::Branch;
use super::budget::{fewest_leaves, full_leaves, levels_to_halve};
use super::fits::Fits;
use super::refs::PrimRef;
use super::spatial::{best_cut, overlap};
use super::split::{Areas, Extent, greater};
use super::spread::unevenness;
use super::sweep::{FEW, sort_few, sweep};
use super::task::{Split, Task, Tasks};
use crate::block::BvhNode;
use crate::block::leaf::TRIANGLES;
use crate::kinds::{BALLS, SPHERES, WIDE};
use crate::math::Aabb;
use crate::prim::{Shapes, Source};

/// A leaf that has no lanes yet. `first` is its first ref and, in the end, the number of primitives in the leaves
/// before; `lanes` holds what it has:
///
/// ```text
/// bit 0          8         9
///     | primitives | spheres | refs |
/// ```
pub(crate) struct Grown;

impl Grown {
    fn leaf(bounds: &Aabb, first: usize, refs: &[PrimRef]) -> BvhNode {
        let sphere = u32::from(refs.first().is_some_and(PrimRef::is_sphere));
        let count: usize = refs.iter().map(PrimRef::count).sum();
        let lanes = count as u32 | sphere << 8 | (refs.len() as u32) << 9;
        BvhNode { lanes, ..BvhNode::inner(bounds, first as u32) }
    }

    /// The number of primitives, and whether they are spheres.
    pub fn of(node: &BvhNode) -> (usize, bool) {
        ((node.lanes & 0xFF) as usize, BALLS && node.lanes >> 8 & 1 != 0)
    }

    pub fn ref_count(node: &BvhNode) -> usize {
        (node.lanes >> 9) as usize
    }
}

/// What a tree may be.
#[derive(Clone, Copy)]
pub(crate) struct Limits<'s, 'a> {
    /// Leaves at most; at least those of [`leaf_budget`](super::budget::leaf_budget) for what works.
    pub leaves: usize,
    /// Where shapes are looked up to cut them in two, if they may be.
    pub source: Option<Source<'s, 'a>>,
    /// Where vertices are looked up, if a tree is wanted soon: then what fits into a leaf block is a leaf, unless two boxes are
    /// smaller than one, and few refs are parted along one axis only.
    pub blocks: Option<Source<'s, 'a>>,
    /// Refs of a leaf at most; 2 to 6.
    pub leaf_max: usize,
    /// So many refs at the front are parted from the others first of all.
    pub apart: usize,
    /// Whether there are triangles and spheres: a leaf is of one kind.
    pub mixed: bool,
    /// How far refs that may be one leaf are parted.
    pub depth: Depth,
    /// How carefully planes are chosen.
    pub effort: Effort,
    /// The same for parts that turn out to be even, if that is worth a look.
    pub even: Option<Effort>,
}

impl Limits<'_, '_> {
    /// For refs of one kind, of which nothing else is known and none are cut.
    pub fn new(leaves: usize, leaf_max: usize, depth: Depth, effort: Effort) -> Self {
        let (source, blocks, apart, mixed, even) = (None, None, 0, false, None);
        Limits { leaves, source, blocks, leaf_max, apart, mixed, depth, effort, even }
    }
}

/// How far refs that may be one leaf are parted.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Depth {
    /// Not at all.
    Whole,
    /// Not at all, and where leaves are scarce all but one are full.
    Full,
    /// Until they are [alike](are_alike).
    Alike,
    /// As long as it pays.
    Paying,
    /// As long as the leaves last.
    Deep,
}

/// Whether a few refs, in a box of the area `whole`, may as well be one leaf: none is much larger than the others, so that it
/// would have them visited in vain, and they lie close together.
fn are_alike(refs: &[PrimRef], whole: f32, areas: Areas) -> bool {
    let (mut sum, mut most) = (0.0, 0.0);
    for r in refs {
        let area = areas.of_finite(&r.bounds);
        sum += area;
        most = greater(area, most);
    }
    most * refs.len() as f32 <= LARGEST * sum && whole <= APART * sum
}

/// The largest of a few refs that are alike, over their mean.
const LARGEST: f32 = 1.5;
/// The area of the box around them, over the sum of theirs.
const APART: f32 = 1.2;

/// Cost of a step to two children, in tests of one primitive.
const STEP_COST: f32 = 2.0;

/// Where boxes of two sides overlap by less than this part of the scene's area, nothing is cut.
const OVERLAP: f32 = 5e-3;
/// The same for a part of the node's own area.
const OVERLAP_OF_NODE: f32 = 0.1;
/// Cutting must save this part of the work.
const SAVED: f32 = 0.02;
/// Fewer refs are parted along one axis, where that may be.
const ONE_AXIS: usize = 1024;

/// Of fewer refs none are cut.
const CUT_FROM: usize = 32;

/// Where refs are parted.
struct Place {
    left_count: usize,
    /// Triangles from spheres, so few that each kind can be one leaf.
    by_kind: bool,
}

/// How nodes are split.
#[derive(Clone, Copy)]
pub(super) struct Splitter<'l, 's, 'a> {
    pub limits: &'l Limits<'s, 'a>,
    pub areas: Areas,
    /// The area of the whole.
    pub whole: f32,
}

/// What choosing splits takes.
pub(super) struct Scratch<'s, 'a> {
    bins: Bins,
    shapes: Option<Shapes<'s, 'a>>,
    fits: Option<Fits<'s, 'a>>,
}

impl<'s, 'a> Splitter<'_, 's, 'a> {
    pub fn scratch(self) -> Scratch<'s, 'a> {
        let shapes = self.limits.source.map(Source::shapes);
        let fits = self.limits.blocks.map(|source| Fits::new(source.shapes()));
        Scratch { bins: Bins::UNUSED, shapes, fits }
    }

    /// Grows a branch; returns its root.
    pub fn grow_branch(self, branch: &mut Branch) -> Option<BvhNode> {
        let Branch { task: whole, nodes, refs, .. } = branch;
        let mut root = None;
        let mut scratch = self.scratch();
        let mut stack = Tasks::NONE;
        stack.push(whole)?;
        let (mut used, mut split) = (whole.pairs, Split::NONE);
        while let Some(task) = stack.last() {
            let first = task.first - whole.first;
            let slots = refs.get_mut(first..first + task.room)?;
            let refs = slots.get(..task.count)?;
            let extent = task.known.extent(refs, self.step(refs, task.even));
            let parted = self.part(slots, task, &extent, (&mut scratch, &mut split));
            let aabb = extent.bounds.aabb();
            let node = match parted {
                false => Grown::leaf(&aabb, task.first, slots.get(..task.count)?),
                true => BvhNode::inner(&aabb, used),
            };
            match task.node.checked_sub(whole.pairs) {
                Some(place) if task.depth > whole.depth => *nodes.get_mut(place as usize)? = node,
                _ => root = Some(node),
            }
            if !parted {
                stack.pop();
                continue;
            }
            // The left child is taken next, so its subtree is stored before the right one's.
            stack.part_last(&split, used, slots)?;
            used += 2;
        }
        root
    }
}

impl Splitter<'_, '_, '_> {
    /// Parts what the first slots hold in two, and says how in `split`, or decides for a leaf: false.
    pub fn part(
        self,
        slots: &mut [PrimRef],
        task: &Task,
        extent: &Extent,
        (scratch, split): (&mut Scratch, &mut Split),
    ) -> bool {
        let Some(refs) = slots.get_mut(..task.count) else { return false };
        let Some(place) = self.part_refs(refs, task, extent, &mut scratch.bins) else {
            return false;
        };
        self.split_at(refs, place.left_count, task.even, split);
        if place.by_kind {
            split.least = [1, 1];
        }
        if WIDE && scratch.fits.as_mut().is_some_and(|f| self.is_block(refs, extent, split, f)) {
            return false;
        }
        // Compact trees are not cut.
        if WIDE
            && task.count >= CUT_FROM
            && task.room > task.count
            && let Some(shapes) = &mut scratch.shapes
        {
            self.cut(slots, (task, extent), split, shapes);
        }
        true
    }

    /// Whether refs had better not be parted, but be one leaf block.
    fn is_block(self, refs: &[PrimRef], extent: &Extent, split: &Split, fits: &mut Fits) -> bool {
        if refs.len() > TRIANGLES {
            return false;
        }
        let area = |extent: &Extent| self.areas.of_finite(&extent.bounds);
        let (left, right) = refs.split_at_checked(split.counts[0]).unwrap_or((refs, &[]));
        let [left, right] =
            [split.sides[0].extent(left, 1), split.sides[1].extent(right, 1)].map(|e| area(&e));
        area(extent) <= left + right && fits.are_a_block(refs)
    }

    /// Brings the refs of a node into two parts; `None` for a leaf.
    fn part_refs(
        self,
        refs: &mut [PrimRef],
        task: &Task,
        extent: &Extent,
        bins: &mut Bins,
    ) -> Option<Place> {
        let at = |left_count| Place { left_count, by_kind: false };
        let (Limits { leaf_max, depth, .. }, areas) = (*self.limits, self.areas);
        let effort = self.effort(task.even);
        let mixed = SPHERES && self.limits.mixed;
        // Only wide trees are not parted just as long as it pays.
        let depth = if WIDE { depth } else { Depth::Paying };
        let count = refs.len();
        let spheres = if mixed { refs.iter().filter(|r| r.is_sphere()).count() } else { 0 };
        let one_kind = !mixed || spheres == 0 || spheres == count;
        let may_be_leaf = count <= leaf_max && one_kind;
        let is_whole = matches!(depth, Depth::Whole | Depth::Full);
        if may_be_leaf && (count == 1 || task.budget < 2 || is_whole) {
            return None;
        }
        let whole = || areas.of(&extent.bounds.aabb());
        if may_be_leaf && depth == Depth::Alike && are_alike(refs, whole(), areas) {
            return None;
        }
        let pays = |work: f32| {
            let area = whole();
            // Everything on one line or in one point: any split is as good as another.
            STEP_COST * area + work < area * count as f32 || area == 0.0
        };
        let lasts = |left_count: usize| self.lasts(task, [left_count, count - left_count]);
        let apart = self.limits.apart;
        if WIDE && task.depth == 0 && (1..count).contains(&apart) && lasts(apart) {
            return Some(at(apart));
        }
        let sah = if count <= FEW {
            let sweep = sweep(refs, areas, lasts)
                .filter(|s| !may_be_leaf || depth != Depth::Paying || pays(s.work));
            sweep.map(|s| at(s.left_count))
        } else {
            // None when all centres are in one point.
            let one_axis = self.limits.blocks.is_some() && count < ONE_AXIS;
            best_plane(refs, &extent.centres, areas, (effort, one_axis), bins).and_then(|plane| {
                let left_count = plane.part(refs);
                lasts(left_count).then(|| at(left_count))
            })
        };
        match sah {
            Some(place) => Some(place),
            None if may_be_leaf => None,
            // Few, but of two kinds: each kind can be one leaf.
            None if SPHERES && count <= leaf_max => {
                sort_few(refs, |r| (i32::from(r.is_sphere()) << 30) | r.id() as i32);
                Some(Place { left_count: count - spheres, by_kind: true })
            }
            // All leaves but one are full then.
            None if depth == Depth::Full => Some(at(full_leaves(count, leaf_max) / 2 * leaf_max)),
            None => Some(at(count / 2)),
        }
    }

    /// Cuts space in two instead, where the sides of `split` overlap and cutting saves work.
    fn cut(
        self,
        slots: &mut [PrimRef],
        (task, extent): (&Task, &Extent),
        split: &mut Split,
        shapes: &mut Shapes,
    ) -> Option<()> {
        let refs = slots.get(..task.count)?;
        let (left, right) = refs.split_at_checked(split.counts[0])?;
        let of_side = |side: usize, refs: &[PrimRef]| {
            split.sides[side].extent(refs, self.step(refs, split.even[side]))
        };
        let [left, right] = [of_side(0, left), of_side(1, right)];
        let areas = self.areas;
        let area = areas.of(&extent.bounds.aabb());
        let least = (OVERLAP * self.whole).max(OVERLAP_OF_NODE * area);
        if overlap(areas, [&left.bounds, &right.bounds]) <= least {
            return None;
        }
        let work = |side: &Extent, count: usize| areas.of_finite(&side.bounds) * count as f32;
        let work = work(&left, split.counts[0]) + work(&right, split.counts[1]);
        let allowed = |counts: [usize; 2]| {
            let [left, right] = counts;
            let fits = left + right <= task.room && left.max(right) < task.count;
            fits && self.lasts(task, counts)
        };
        let cut = best_cut(refs, &extent.bounds, areas, allowed)?;
        if cut.work >= (1.0 - SAVED) * work {
            return None;
        }
        let counts = cut.part(slots, task.count, shapes)?;
        debug_assert!(
            !counts.contains(&0),
            "a wall lies between two slabs in which refs begin or end"
        );
        let refs = slots.get(..counts[0] + counts[1])?;
        self.split_at(refs, counts[0], task.even, split);
        Some(())
    }

    /// The fewest leaves that two sides need.
    fn fewest(self, counts: [usize; 2]) -> [usize; 2] {
        let Limits { leaf_max, depth, .. } = *self.limits;
        if WIDE && depth == Depth::Full {
            return counts.map(|count| full_leaves(count, leaf_max));
        }
        let mixed = SPHERES && self.limits.mixed;
        let [left, right] = counts;
        [fewest_leaves(left, mixed, leaf_max), fewest_leaves(right, mixed, leaf_max)]
    }

    /// Whether leaves and levels last for these sides.
    #[cfg_attr(target_os = "none", inline(never))]
    fn lasts(self, task: &Task, counts: [usize; 2]) -> bool {
        let [left, right] = self.fewest(counts);
        let levels = levels_to_halve(counts[0].max(counts[1]), self.limits.leaf_max);
        left + right <= task.budget && task.depth + 1 + levels < MAX_DEPTH
    }

    /// The sides of a place between refs, which are known to be `even` or not. Written where they are read, as a copy would wait
    /// for the parts of what was just written.
    fn split_at(self, refs: &[PrimRef], left_count: usize, even: bool, split: &mut Split) {
        let (left, right) = refs.split_at_checked(left_count).unwrap_or((refs, &[]));
        let counts = [left.len(), right.len()];
        let even = [left, right].map(|refs| even || self.are_even(refs));
        (split.counts, split.least, split.even) = (counts, self.fewest(counts), even);
        for ((side, refs), even) in split.sides.iter_mut().zip([left, right]).zip(even) {
            side.become_those_of(refs, self.step(refs, even));
        }
    }

    /// Whether a part of an uneven scene is even, and large enough for that to matter.
    fn are_even(self, refs: &[PrimRef]) -> bool {
        // Compact trees do not ask.
        let effort = self.limits.even.filter(|_| WIDE);
        effort.is_some_and(|effort| {
            effort.step(refs.len()) > 1 && effort.is_even(unevenness(refs, self.areas))
        })
    }

    /// How carefully planes are chosen for a node.
    fn effort(self, even: bool) -> Effort {
        self.limits.even.filter(|_| WIDE && even).unwrap_or(self.limits.effort)
    }

    /// Of so many refs one is looked at to choose a plane.
    pub fn step(self, refs: &[PrimRef], even: bool) -> usize {
        self.effort(even).step(refs.len())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::bvh::branch::grow;
    use crate::bvh::budget::leaf_budget;
    use crate::caller::Caller;

    /// Levels of a tree, the root's included.
    pub(in crate::bvh) fn levels(nodes: &[BvhNode]) -> usize {
        let mut depth = std::vec![1; nodes.len()];
        for (i, node) in nodes.iter().enumerate().filter(|(i, node)| *i != 1 && !node.is_leaf()) {
            depth[node.first as usize] = depth[i] + 1;
            depth[node.first as usize + 1] = depth[i] + 1;
        }
        depth.into_iter().max().unwrap_or(0)
    }

    /// Boxes each `ratio` times as large and as far away as the one before: SAH parts the largest from
    /// the others, again and again.
    pub(in crate::bvh) fn series(count: usize, ratio: f64) -> std::vec::Vec<PrimRef> {
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
            for (leaf_max, depth) in [(5, Depth::Deep), (6, Depth::Paying)] {
                let count = (240.0 / ratio.log2()) as usize;
                let leaves = leaf_budget(count, false, leaf_max, true);
                let mut refs = series(count, ratio);
                let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * leaves];
                let effort = Effort::BALANCED;
                let limits = Limits::new(leaves, leaf_max, depth, effort);
                let caller = &Caller::new(None, None);
                let used = grow(&mut nodes, &mut refs, count, &limits, caller).expect("room");
                let levels = levels(&nodes[..used.nodes]);
                assert!(levels <= MAX_DEPTH, "{ratio} {leaf_max}: {levels}");
                deepest = deepest.max(levels);
            }
        }
        assert!(deepest > 55, "the series is no test: {deepest}");
    }

    #[test]
    fn a_wall_is_not_alike_to_chairs() {
        let of = |boxes: &[([f32; 3], f32)]| {
            let mut around = Aabb::EMPTY;
            let refs: std::vec::Vec<_> = (boxes.iter())
                .map(|(lower, edge)| {
                    let aabb = Aabb { lower: *lower, upper: lower.map(|x| x + edge) };
                    around.add(&aabb);
                    PrimRef::new(0, &aabb, false)
                })
                .collect();
            let areas = Areas::new(&Aabb { lower: [0.0; 3], upper: [1.0; 3] });
            are_alike(&refs, areas.of(&around), areas)
        };
        let chair = |x: f32| ([x, 0.0, 0.0], 0.125);
        assert!(of(&[chair(0.0), chair(0.125), chair(0.25)]), "side by side");
        assert!(!of(&[chair(0.0), chair(0.125), ([0.0; 3], 0.5)]), "with a wall");
        assert!(!of(&[chair(0.0), chair(0.75)]), "far apart");
        assert!(of(&[([0.5; 3], 0.0); 4]), "all in one point");
    }
}
