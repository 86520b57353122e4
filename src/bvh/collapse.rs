//! From a binary tree to bundles and whole leaf blocks: which subtree becomes what, at the least cost.

use core::ops::Range;

use super::MAX_DEPTH;
use super::fits::Corners;
use super::split::Areas;
use super::tree::Grown;
use crate::block::BvhNode;
use crate::block::leaf::{SPHERES, TRIANGLES};
use crate::math::Aabb;
use crate::prim::{Shape, Shapes};

/// What becomes of an inner node.
///
/// ```text
/// bit 0     1 .. 5   6 .. 7      8 .. 63
///     | leaf | least | nothing | left[3] .. left[16], four bits each |
/// ```
///
/// Given one lane of a bundle, the node is a leaf (`leaf`) or a bundle of its own. Given `slots` lanes, at
/// least `least` of them, its children share them: `left[slots]` for the left one, the others for
/// the right one. Given fewer it takes one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Choice(pub u64);

impl Choice {
    fn new<const W: usize>(leaf: bool, least: usize, left: &[u32; W]) -> Choice {
        let splits = left.iter().skip(2).zip((8..).step_by(4));
        let left = splits.fold(0, |bits, (left, place)| bits | u64::from(*left) << place);
        Choice(u64::from(leaf) | (least as u64) << 1 | left)
    }

    /// Whether the node is a leaf where it has one lane.
    pub fn is_leaf(self) -> bool {
        self.0 & 1 != 0
    }

    /// Whether the node takes one lane although it may have `slots`.
    pub fn takes_one(self, slots: usize) -> bool {
        slots < (self.0 >> 1 & 31) as usize
    }

    /// How many of `slots >= 2` lanes go to the left child.
    pub fn left_of(self, slots: usize) -> usize {
        if slots < 3 { 1 } else { (self.0 >> (4 * slots - 4) & 15) as usize }
    }
}

/// The choice at an inner node; those of pairs stand in the order of the pairs.
pub(crate) fn choice_of(choices: &[u64], node: &BvhNode) -> Option<Choice> {
    choices.get((node.first as usize / 2).checked_sub(1)?).map(|bits| Choice(*bits))
}

/// A subtree that is decided, and what it may still be part of.
#[derive(Clone, Copy)]
pub(super) struct Decided<const W: usize> {
    /// The least cost with 1 .. W lanes.
    cost: [f32; W],
    /// More lanes than this, or than W, change nothing: the leaves of the binary tree.
    lanes: usize,
    aabb: Aabb,
    content: Content,
}

/// What a leaf over a subtree would hold.
#[derive(Clone, Copy)]
struct Content {
    kind: Kind,
    count: usize,
    /// Those of triangles.
    corners: Corners,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Triangles,
    Spheres,
    /// Too much for one block, or both kinds.
    Much,
}

/// The binary tree, and what decides about it.
///
/// A ray that enters a box pays 1 for the bundle in it, or [a little more](LEAF) for the leaf block, whatever that holds;
/// boxes are entered in proportion to their area. `price` is added for each leaf block, and to each
/// bundle in proportion to its bytes: it breaks ties, and a higher one saves memory. Leaf blocks
/// hold at most 16 triangles over 16 vertices, or 15 spheres.
#[derive(Clone, Copy)]
pub(super) struct Grounds<'t> {
    pub nodes: &'t [BvhNode],
    /// The ids of the tree's leaves.
    pub ids: &'t [u32],
    pub areas: Areas,
    pub price: f32,
    /// Leaves of more primitives are not put together. That is none where visiting an instance costs more than telling it from
    /// others, and where leaves are [runs](super::runs), which are whole leaf blocks.
    pub together: usize,
}

/// What a leaf block costs, in bundles. Where it may as well be a bundle over blocks of its own, with boxes that are little
/// smaller, that is better, as triangles of a few blocks are rarely all large.
pub(super) const LEAF: f32 = 1.1;

/// What is decided and still to be part of something: the last subtree first.
///
/// Pairs of children come after their parents and right subtrees after left ones, so the pairs in
/// reverse are the tree in reverse Polish notation: no other stack is needed, and it
/// holds one result for each level at most.
pub(super) struct Results<const W: usize> {
    stack: [Decided<W>; MAX_DEPTH + 2],
    pending: usize,
}

impl<const W: usize> Results<W> {
    pub const NONE: Self = Results { stack: [Decided::NOTHING; MAX_DEPTH + 2], pending: 0 };

    pub fn push(&mut self, decided: Decided<W>) -> Option<()> {
        *self.stack.get_mut(self.pending)? = decided;
        self.pending += 1;
        Some(())
    }

    /// The one result there is.
    pub fn only(&self) -> Option<Decided<W>> {
        self.stack.first().copied().filter(|_| self.pending == 1)
    }

    /// Decides these pairs of children, of which pair 0 does not exist, and writes their choices. What is below them
    /// is decided already; which triangles share vertices is seen in `shapes`.
    pub fn decide(
        &mut self,
        grounds: &Grounds,
        pairs: Range<usize>,
        shapes: &mut Shapes,
        choices: &mut [u64],
    ) -> Option<()> {
        let nodes = grounds.nodes.get(2 * pairs.start..2 * pairs.end)?;
        let mut leaf = Decided::NOTHING;
        for (pair, choice) in nodes.chunks_exact(2).zip(choices).rev() {
            let [left, right] = pair else { return None };
            // What was decided last is left. One of both becomes what they are together, where it stands: copies of what was just
            // written by parts take long.
            let inner = usize::from(!left.is_leaf()) + usize::from(!right.is_leaf());
            let first = self.pending.checked_sub(inner)?;
            let chosen = match self.stack.get_mut(first..first + inner.max(1))? {
                [right, left, ..] => right.join(Side::Left, left, grounds),
                [both] if inner == 1 => {
                    let (side, node) = match left.is_leaf() {
                        true => (Side::Left, left),
                        false => (Side::Right, right),
                    };
                    leaf.set_leaf(node, grounds, shapes)?;
                    both.join(side, &leaf, grounds)
                }
                [both] => {
                    both.set_leaf(left, grounds, shapes)?;
                    leaf.set_leaf(right, grounds, shapes)?;
                    both.join(Side::Right, &leaf, grounds)
                }
                [] => return None,
            };
            *choice = chosen.0;
            self.pending = first + 1;
        }
        Some(())
    }
}

/// The side of a pair.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

impl<const W: usize> Decided<W> {
    const NOTHING: Self =
        Decided { cost: [0.0; W], lanes: 0, aabb: Aabb::EMPTY, content: Content::MUCH };

    /// Becomes a leaf of the binary tree.
    fn set_leaf(&mut self, node: &BvhNode, grounds: &Grounds, shapes: &mut Shapes) -> Option<()> {
        let Grounds { ids, areas, price, .. } = *grounds;
        let (count, is_sphere) = Grown::of(node);
        self.aabb = node.aabb();
        self.cost = [LEAF * areas.of(&self.aabb) + price; W];
        self.lanes = 1;
        self.content.count = count;
        let alone = count > grounds.together;
        if alone || is_sphere {
            self.content.kind = if alone { Kind::Much } else { Kind::Spheres };
            return Some(());
        }
        self.content.kind = Kind::Triangles;
        let first = node.first as usize;
        // Leaves come from the last to the first.
        for i in first..first + count {
            shapes.look_ahead(|n| ids.get(i.checked_sub(n)?).copied());
        }
        let triangles = ids.get(first..first + count)?.iter();
        self.content.corners.become_those_of(triangles.filter_map(|id| triangle(*id, shapes)));
        Some(())
    }

    /// Becomes what it is together with `other` on this side.
    #[inline]
    fn join(&mut self, side: Side, other: &Self, grounds: &Grounds) -> Choice {
        let Grounds { areas, price, .. } = *grounds;
        let (shared, split) =
            if side == Side::Left { share(other, self) } else { share(self, other) };
        self.aabb.add(&other.aabb);
        let area = areas.of(&self.aabb);
        self.content.add(&other.content);
        let block =
            if self.content.kind == Kind::Much { f32::INFINITY } else { LEAF * area + price };
        let bundle = area + price * bundle_price(W) + shared[W - 1];
        let is_leaf = block <= bundle;
        let one = if is_leaf { block } else { bundle };
        // With more lanes the cost of sharing only falls.
        let least = (1..W).find(|&i| shared[i] < one).map_or(W + 1, |i| i + 1);
        self.cost = shared;
        self.cost[..(least - 1).min(W)].fill(one);
        self.lanes += other.lanes;
        Choice::new(is_leaf, least, &split)
    }
}

/// The corners of a triangle.
#[inline(always)]
fn triangle(id: u32, shapes: &mut Shapes) -> Option<[[f32; 3]; 3]> {
    // Not by a closure, to which they would be handed on in memory.
    if let Some(corners) = shapes.corners(id) {
        return Some(corners);
    }
    match shapes.get(id)? {
        Shape::Triangle(corners) => Some(corners),
        Shape::Sphere { .. } | Shape::Box(_) => None,
    }
}

/// Bytes of a bundle against those of a leaf block.
fn bundle_price(width: usize) -> f32 {
    (28 * width) as f32 / 256.0
}

/// The least cost of two subtrees that share 1 .. W lanes, and the lanes of the left one. One lane
/// is not enough for two.
fn share<const W: usize>(left: &Decided<W>, right: &Decided<W>) -> ([f32; W], [u32; W]) {
    let (mut cost, mut split) = ([f32::INFINITY; W], [0; W]);
    // The right one's costs behind as many lanes as are impossible, so that every shift of them is
    // a whole row.
    let mut shifted = [f32::INFINITY; 32];
    shifted[W..2 * W].copy_from_slice(&right.cost);
    for k in 1..=left.lanes.min(W - 1) {
        let (row, one) = (&shifted[W - k..][..W], left.cost[k - 1]);
        for ((cost, split), right) in cost.iter_mut().zip(&mut split).zip(row) {
            let sum = one + right;
            *split = if sum < *cost { k as u32 } else { *split };
            *cost = if sum < *cost { sum } else { *cost };
        }
    }
    (cost, split)
}

impl Content {
    const MUCH: Content = Content { kind: Kind::Much, count: 0, corners: Corners::NONE };

    /// Becomes what one block would hold of both, if it can.
    fn add(&mut self, other: &Content) {
        self.count += other.count;
        let most = match self.kind {
            Kind::Triangles => TRIANGLES,
            Kind::Spheres => SPHERES,
            Kind::Much => return,
        };
        let fits = self.kind == other.kind && self.count <= most;
        if !fits || self.kind == Kind::Triangles && !self.corners.merge(&other.corners) {
            self.kind = Kind::Much;
        }
    }
}
