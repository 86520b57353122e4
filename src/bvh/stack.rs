//! What traversals come back to.

#![allow(unsafe_code, reason = "a large array is not worth writing before it is needed")]

use core::mem::MaybeUninit;

use super::MAX_DEPTH;
use crate::block::bundle::ChildRef;
use crate::simd::{Simd, Width};

/// Nodes to come back to, or what stands for them.
pub(super) type Pending<E> = crate::pending::Pending<E, MAX_DEPTH>;

/// Room for a [`Stack`]. Aligned, and with it all else that a search keeps: vectors that lie across two cache lines are slow.
#[repr(align(64))]
pub(crate) struct Columns<const ROOM: usize> {
    near: [MaybeUninit<f32>; ROOM],
    refs: [MaybeUninit<u32>; ROOM],
}

impl<const ROOM: usize> Columns<ROOM> {
    pub const UNWRITTEN: Self = Columns {
        near: [const { MaybeUninit::uninit() }; ROOM],
        refs: [const { MaybeUninit::uninit() }; ROOM],
    };
}

/// Children to come back to, each with the `t` at which the ray enters it.
///
/// The first entry is [`ChildRef::NONE`], which stays: so there always is one to take, and no branch tells whether.
/// All `refs` below `count` are written, and all of `near` too unless children were
/// [pushed without](Self::push_but_last). A push writes as many lanes as a vector has and then counts those that matter,
/// so that it takes no branch. The columns are borrowed, so that what is left can stay in registers.
pub(super) struct Stack<'m, const ROOM: usize> {
    near: &'m mut [MaybeUninit<f32>; ROOM],
    refs: &'m mut [MaybeUninit<u32>; ROOM],
    count: usize,
}

impl<'m, const ROOM: usize> Stack<'m, ROOM> {
    /// Without children.
    #[inline(always)]
    pub fn new(columns: &'m mut Columns<ROOM>) -> Self {
        let Columns { near, refs } = columns;
        // Never culled.
        near[0].write(f32::NEG_INFINITY);
        refs[0].write(ChildRef::NONE.0);
        Stack { near, refs, count: 1 }
    }

    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 1;
    }

    /// The child pushed last, or [`ChildRef::NONE`] when there is none.
    #[inline(always)]
    pub fn pop(&mut self) -> ChildRef {
        let top = self.top();
        self.count -= usize::from(self.count > 1);
        top
    }

    /// The child that would be taken next, or [`ChildRef::NONE`].
    #[inline(always)]
    pub fn top(&self) -> ChildRef {
        debug_assert!(self.count > 0);
        // SAFETY: the first entry is written, and both ways to push write the refs that they count.
        ChildRef(unsafe { self.refs[self.count - 1].assume_init() })
    }

    /// Pushes the children in the lanes of `mask`, two at least, far ones first but for the nearest, which it returns;
    /// `None` when there is no room.
    #[inline(always)]
    pub fn push_but_nearest<S: Width<W>, const W: usize>(
        &mut self,
        s: S,
        mask: u32,
        near: S::V,
        refs: &[ChildRef; W],
    ) -> Option<ChildRef> {
        let near_out = self.near.get_mut(self.count..)?.first_chunk_mut::<W>()?;
        let refs_out = self.refs.get_mut(self.count..)?.first_chunk_mut::<W>()?;
        let nearest = s.sort(mask, near, ChildRef::words(refs), near_out, refs_out);
        // Its place is the last, where the next ones go.
        self.count += mask.count_ones() as usize - 1;
        Some(ChildRef(nearest))
    }

    /// Pushes the children in the lanes of `mask`, in their order, but for the last, which it returns; without a word on
    /// where they are entered: they must not be [culled](Self::cull). `None` when there is no room.
    #[inline(always)]
    pub fn push_but_last<S: Width<W>, const W: usize>(
        &mut self,
        s: S,
        mask: u32,
        refs: &[ChildRef; W],
    ) -> Option<ChildRef> {
        let column = self.refs.get_mut(self.count..)?.first_chunk_mut::<W>()?;
        s.compress_words(mask, ChildRef::words(refs), column);
        // Its place is the last, where the next ones go; from the stack it would come only after what was written there.
        self.count += mask.count_ones() as usize - 1;
        refs.get(31 - mask.leading_zeros() as usize).copied()
    }

    /// Drops what the ray enters beyond `t_bound`.
    #[inline(always)]
    pub fn cull<S: Simd>(&mut self, s: S, t_bound: f32) {
        let (near, refs) = (&mut self.near[..self.count], &mut self.refs[..self.count]);
        // SAFETY: entries below `count` were written by a push, or moved down from such ones; queries that
        // push without `near` have a bound that does not move, and do not come here.
        self.count = unsafe { s.keep_up_to(near, refs, t_bound) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Scalar;

    #[test]
    fn what_is_at_the_bottom_stays() {
        let refs = [7, 8, 9, 10].map(ChildRef);
        let near = [4.0, 1.0, 3.0, 2.0];
        let mut columns = Columns::<16>::UNWRITTEN;
        let mut stack = Stack::new(&mut columns);
        for _ in 0..3 {
            assert_eq!((stack.top(), stack.pop()), (ChildRef::NONE, ChildRef::NONE));
        }
        assert_eq!(stack.push_but_nearest(Scalar, 0b1111, near, &refs), Some(ChildRef(8)));
        stack.cull(Scalar, 3.5);
        assert_eq!((stack.top(), stack.pop()), (ChildRef(10), ChildRef(10)));
        stack.cull(Scalar, f32::NEG_INFINITY);
        assert_eq!((stack.pop(), stack.pop()), (ChildRef::NONE, ChildRef::NONE));
        // Each but the last, and alone none at all.
        assert_eq!(stack.push_but_last(Scalar, 0b0110, &refs), Some(ChildRef(9)));
        assert_eq!(stack.push_but_last(Scalar, 0b0001, &refs), Some(ChildRef(7)));
        assert_eq!([stack.pop(), stack.pop()], [ChildRef(8), ChildRef::NONE]);
        stack.push_but_last(Scalar, 0b1111, &refs);
        stack.clear();
        assert_eq!(stack.pop(), ChildRef::NONE);
    }
}
