//! The one way through bundles.

use super::stack::{Columns, Stack};
use crate::block::bundle::{Bundle, ChildRef};
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{Late, PreparedRay, Slab, WideBoxes};
use crate::simd::{Simd, Width};

/// Where a ray stands on its way through a tree of bundles.
///
/// A bundle's children that the ray enters go to the stack in the order of their distance, in one step, but for the
/// nearest, which is next; with one child, the usual case near the leaves, nothing comes to the stack. The stack is
/// culled once for each hit that was accepted, so taking from it tests nothing.
pub(crate) struct Walk<'m, const ROOM: usize> {
    stack: Stack<'m, ROOM>,
    at: ChildRef,
    t_bound: f32,
}

/// A ray leaves at most 15 siblings a level behind; a push of 16 lanes writes past the last entry. What is at the bottom of the
/// stack has room too.
pub(crate) const ENOUGH_ROOM: usize = 15 * super::MAX_DEPTH + 3 * 16;

impl<'m, const ROOM: usize> Walk<'m, ROOM> {
    /// At the root.
    #[inline(always)]
    pub fn new(columns: &'m mut Columns<ROOM>, t_bound: f32) -> Self {
        Walk { stack: Stack::new(columns), at: ChildRef::ROOT, t_bound }
    }

    /// Back to the root, for another ray.
    #[inline(always)]
    pub fn restart(&mut self, t_bound: f32) {
        self.stack.clear();
        self.at = ChildRef::ROOT;
        self.t_bound = t_bound;
    }

    /// What comes next; [`ChildRef::NONE`] at the end.
    #[inline(always)]
    pub fn at(&self) -> ChildRef {
        self.at
    }

    /// Goes from a bundle to what comes next; false when there is no room for what is to come later.
    /// `t_bounds` is the bound in each lane.
    #[inline(always)]
    pub fn enter<S: Width<W>, Q: Query, const W: usize>(
        &mut self,
        s: S,
        bundle: &Bundle<W>,
        boxes: &impl WideBoxes<S, W>,
        t_bounds: S::V,
    ) -> bool {
        let entered = Self::entered::<S, Q, W>(bundle, boxes, t_bounds);
        self.go_on(s, bundle, entered, Q::ORDERED)
    }

    /// The children that are entered, and where.
    #[inline(always)]
    fn entered<S: Width<W>, Q: Query, const W: usize>(
        bundle: &Bundle<W>,
        boxes: &impl WideBoxes<S, W>,
        t_bounds: S::V,
    ) -> (u32, S::V) {
        if Q::ANY_BOXES {
            boxes.entered::<true>(&bundle.walls, t_bounds)
        } else {
            boxes.entered::<false>(&bundle.walls, t_bounds)
        }
    }

    /// Goes from the bundle at hand to what comes next; false if it does not.
    #[inline(always)]
    fn pass<S: Width<W> + Simd, Q: Query, const W: usize>(
        &mut self,
        s: S,
        bundles: &[Bundle<W>],
        leaves: &Leaves,
        boxes: &impl WideBoxes<S, W>,
        t_bounds: <S as Width<W>>::V,
        query: &mut Q,
    ) -> bool {
        let Some(bundle) = bundles.get(self.at.bundle_number()) else { return false };
        query.watch().step();
        let (mask, near) = Self::entered::<S, Q, W>(bundle, boxes, t_bounds);
        if Q::ORDERED && mask.is_power_of_two() {
            // The usual case near the leaves: what waits is what waited before, and was fetched.
            self.at = bundle.child(mask);
            return true;
        }
        let goes_on = self.go_on(s, bundle, (mask, near), Q::ORDERED);
        self.fetch_later::<S, Q, W>(s, bundles, leaves);
        goes_on
    }

    /// Has a child fetched that is not next but may be visited after that, so that memory answers both at once. Any hits are mostly
    /// found before that: for them only what is far away is worth it.
    #[inline(always)]
    fn fetch_later<S: Simd, Q: Query, const W: usize>(
        &self,
        s: S,
        bundles: &[Bundle<W>],
        leaves: &Leaves,
    ) {
        if Q::ORDERED || size_of_val(leaves.triangle_blocks) > NEAR {
            fetch(s, bundles, leaves, self.stack.top());
        }
    }

    /// Goes from the root to the first leaf; false if there is none.
    #[inline(always)]
    fn arrive<S: Width<W> + Simd, Q: Query, const W: usize>(
        &mut self,
        s: S,
        bundles: &[Bundle<W>],
        leaves: &Leaves,
        boxes: &impl WideBoxes<S, W>,
        query: &mut Q,
    ) -> bool {
        let t_bounds = Width::<W>::splat(s, self.t_bound());
        while !self.at.is_leaf() {
            if !self.pass::<S, Q, W>(s, bundles, leaves, boxes, t_bounds, query) {
                return false;
            }
        }
        self.at != ChildRef::NONE
    }

    /// Goes from a bundle to one of the children in the lanes of a mask, and comes back to the others later: if they are `ordered`,
    /// to the nearest; false when there is no room.
    #[inline(always)]
    pub fn go_on<S: Width<W>, const W: usize>(
        &mut self,
        s: S,
        bundle: &Bundle<W>,
        (mask, near): (u32, S::V),
        ordered: bool,
    ) -> bool {
        if mask == 0 {
            self.at = self.stack.pop();
            return true;
        }
        let next = if !ordered {
            // Without a bound that moves, it does not matter where they are entered. One child goes the same way, as a guess whether
            // there are more is often wrong.
            self.stack.push_but_last(s, mask, &bundle.refs)
        } else if mask.is_power_of_two() {
            Some(bundle.child(mask))
        } else {
            self.stack.push_but_nearest(s, mask, near, &bundle.refs)
        };
        self.at = next.unwrap_or(ChildRef::NONE);
        next.is_some()
    }

    /// Offers `query` a leaf and goes on to what comes next; true when it ended the search.
    #[inline(always)]
    pub fn open<S: Simd, Q: Query>(
        &mut self,
        s: S,
        leaves: &Leaves,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        if leaves.intersect_whole(s, self.at.leaf_block(), ray, query) {
            return true;
        }
        self.leave(s, query.t_bound(), Q::ORDERED);
        false
    }

    /// Goes on from a leaf; nothing beyond `t_bound` is of interest any more.
    #[inline(always)]
    pub fn leave<S: Simd>(&mut self, s: S, t_bound: f32, ordered: bool) {
        if ordered && t_bound < self.t_bound {
            self.t_bound = t_bound;
            self.stack.cull(s, t_bound);
        }
        self.at = self.stack.pop();
    }

    /// Nothing beyond this `t` of the frame is visited any more.
    #[inline(always)]
    pub fn t_bound(&self) -> f32 {
        self.t_bound
    }
}

/// Offers `query` everything the ray meets, near bundles first; true when it ended the search.
#[inline(always)]
pub(crate) fn traverse_wide<S: Simd + Width<W>, Q: Query, const W: usize>(
    s: S,
    bundles: &[Bundle<W>],
    leaves: &Leaves,
    (late, prepared): (&impl Late, &mut Option<PreparedRay>),
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let boxes = &slab.wide::<S, W>(s);
    let mut columns = Columns::<ENOUGH_ROOM>::UNWRITTEN;
    let mut walk = Walk::new(&mut columns, query.t_bound());
    // Many rays pass the whole scene by, or all its leaves. What only the others need is no business of the loop behind, either.
    if prepared.is_none() && !walk.arrive::<S, Q, W>(s, bundles, leaves, boxes, query) {
        return false;
    }
    let ray = &*prepared.get_or_insert_with(|| late.prepare());
    loop {
        let t_bounds = Width::<W>::splat(s, walk.t_bound());
        while !walk.at().is_leaf() {
            if !walk.pass::<S, Q, W>(s, bundles, leaves, boxes, t_bounds, query) {
                return false;
            }
        }
        if walk.at() == ChildRef::NONE {
            return false;
        }
        if walk.open(s, leaves, ray, query) {
            return true;
        }
        walk.fetch_later::<S, Q, W>(s, bundles, leaves);
    }
}

/// Fewer bytes of leaf blocks are near: most of what rays visit is in some cache. Measured: see `docs/METHODS.md`.
const NEAR: usize = 6 << 20;

/// Has a child fetched.
///
/// Without a branch on what it is, which would be guessed wrong; spheres are fetched in vain.
#[inline(always)]
pub(crate) fn fetch<S: Simd, const W: usize>(
    s: S,
    bundles: &[Bundle<W>],
    leaves: &Leaves,
    child: ChildRef,
) {
    let (leaf, (_, block)) = (child.is_leaf(), child.leaf_block());
    let block = block.min(leaves.triangle_blocks.len());
    let block = leaves.triangle_blocks.as_ptr().wrapping_add(block).cast::<u8>();
    let bundle = bundles.as_ptr().wrapping_add(child.bundle_number()).cast::<u8>();
    s.prefetch_lines::<4>(if leaf { block } else { bundle });
}
