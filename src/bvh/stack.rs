//! What a traversal of bundles comes back to.

#![allow(unsafe_code, reason = "a large array is not worth writing before it is needed")]

use core::mem::MaybeUninit;

use super::MAX_DEPTH;
use crate::block::bundle::ChildRef;
use crate::simd::{Lanes, Simd, Width};

/// A ray leaves at most 15 siblings a level behind; a push of 16 lanes writes past the last entry.
const CAPACITY: usize = 15 * MAX_DEPTH + 2 * 16;

/// Children to come back to, each with the `t` at which the ray enters it: two columns.
///
/// All entries below `count` are written. A push writes as many lanes as a vector has and then counts those
/// that matter, so that it takes no branch.
pub(super) struct Stack {
    near: [MaybeUninit<f32>; CAPACITY],
    refs: [MaybeUninit<u32>; CAPACITY],
    count: usize,
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        Stack {
            near: [const { MaybeUninit::uninit() }; CAPACITY],
            refs: [const { MaybeUninit::uninit() }; CAPACITY],
            count: 0,
        }
    }

    /// The child pushed last, or [`ChildRef::NONE`] when there is none.
    #[inline(always)]
    pub fn pop(&mut self) -> ChildRef {
        let Some(last) = self.count.checked_sub(1) else { return ChildRef::NONE };
        self.count = last;
        ChildRef(self.reference(last))
    }

    /// Pushes the children in the lanes of `mask`, in their order.
    #[inline(always)]
    pub fn push<S: Width<W>, const W: usize>(
        &mut self,
        s: S,
        mask: u32,
        near: S::V,
        refs: &[ChildRef; W],
    ) {
        let at = self.count;
        let room = self.near.get_mut(at..).and_then(|near| near.first_chunk_mut::<W>());
        let Some(room) = room else { return };
        near.compress(mask, room);
        let Some(room) = self.refs.get_mut(at..).and_then(|refs| refs.first_chunk_mut::<W>())
        else {
            return;
        };
        s.compress_words(mask, ChildRef::words(refs), room);
        self.count = at + mask.count_ones() as usize;
    }

    /// Pushes the children in the lanes of `mask`, of which there are some, and takes the nearest of
    /// them, or nearly so.
    #[inline(always)]
    pub fn push_and_take_nearest<S: Width<W>, const W: usize>(
        &mut self,
        s: S,
        mask: u32,
        near: S::V,
        refs: &[ChildRef; W],
    ) -> ChildRef {
        let first = self.count;
        self.push(s, mask, near, refs);
        let nearest = first + near.least_of(mask);
        let Some(last) = self.count.checked_sub(1).filter(|last| nearest <= *last) else {
            return ChildRef::NONE;
        };
        let taken = self.reference(nearest);
        self.near[nearest] = self.near[last];
        self.refs[nearest] = self.refs[last];
        self.count = last;
        ChildRef(taken)
    }

    /// Drops what the ray enters beyond `t_bound`.
    #[inline(always)]
    pub fn cull<S: Simd>(&mut self, s: S, t_bound: f32) {
        let (near, refs) = (&mut self.near[..self.count], &mut self.refs[..self.count]);
        // SAFETY: entries below `count` were written by `push`, or moved down from such ones.
        self.count = unsafe { s.keep_up_to(near, refs, t_bound) };
    }

    /// Entry `i`, which is or was the last below `count`.
    #[inline(always)]
    fn reference(&self, i: usize) -> u32 {
        debug_assert!(i <= self.count);
        // SAFETY: as above; taking an entry does not unwrite it.
        unsafe { self.refs[i].assume_init() }
    }
}
