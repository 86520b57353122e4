//! What a traversal of bundles comes back to when many rays share it.

#![allow(unsafe_code, reason = "large arrays are not worth writing before they are needed")]

use core::mem::MaybeUninit;

use super::wide::ENOUGH_ROOM;
use crate::block::bundle::{Bundle, ChildRef};
use crate::simd::{NUMBERS, Simd, Width};

/// Children to come back to, each with the rays that enter it: one bit a ray.
///
/// All entries below `count` are written. A push writes as many lanes as a vector has and then counts those that matter.
pub(crate) struct SharedStack {
    refs: [MaybeUninit<u32>; ENOUGH_ROOM],
    rays: [MaybeUninit<u32>; ENOUGH_ROOM],
    count: usize,
}

impl SharedStack {
    /// Without children.
    #[inline(always)]
    pub fn new() -> Self {
        SharedStack {
            refs: [const { MaybeUninit::uninit() }; ENOUGH_ROOM],
            rays: [const { MaybeUninit::uninit() }; ENOUGH_ROOM],
            count: 0,
        }
    }

    /// Pushes the children in the lanes of `lanes`, in their order; false when there is no room. `entered` has the rays that
    /// enter each.
    #[inline(always)]
    pub fn push<S: Simd>(
        &mut self,
        s: S,
        bundle: &Bundle<16>,
        lanes: u32,
        entered: &[u32; 16],
    ) -> bool {
        let refs = self.refs.get_mut(self.count..).and_then(|refs| refs.first_chunk_mut::<16>());
        let rays = self.rays.get_mut(self.count..).and_then(|rays| rays.first_chunk_mut::<16>());
        let (Some(refs), Some(rays)) = (refs, rays) else { return false };
        s.compress_words(lanes, ChildRef::words(&bundle.refs), refs);
        s.compress_words(lanes, entered, rays);
        self.count += lanes.count_ones() as usize;
        true
    }

    /// The same, but far ones first; `near` is where the first ray enters each.
    #[inline(always)]
    pub fn push_by_distance<S: Simd>(
        &mut self,
        s: S,
        bundle: &Bundle<16>,
        lanes: u32,
        entered: &[u32; 16],
        near: <S as Width<16>>::V,
    ) -> bool {
        let count = lanes.count_ones() as usize;
        if count < 2 {
            return self.push(s, bundle, lanes, entered);
        }
        let (mut depths, mut order) = ([MaybeUninit::uninit(); 16], [MaybeUninit::uninit(); 16]);
        s.sort(lanes, near, &NUMBERS, &mut depths, &mut order);
        let refs = self.refs.get_mut(self.count..self.count + count);
        let rays = self.rays.get_mut(self.count..self.count + count);
        let (Some(refs), Some(rays)) = (refs, rays) else { return false };
        for ((child, ray), number) in refs.iter_mut().zip(rays).zip(&order) {
            // SAFETY: the sort writes the numbers of all lanes that it is given.
            let lane = unsafe { number.assume_init() } as usize % 16;
            child.write(bundle.refs[lane].0);
            ray.write(entered[lane]);
        }
        self.count += count;
        true
    }

    /// The child pushed last that one of the rays of `wanted` enters, and which of them do; without rays at the end.
    #[inline(always)]
    pub fn pop(&mut self, wanted: u32) -> (ChildRef, u32) {
        while let Some(last) = self.count.checked_sub(1) {
            self.count = last;
            // SAFETY: both ways to push write both words of the entries that they count.
            let [child, rays] =
                [self.refs[last], self.rays[last]].map(|x| unsafe { x.assume_init() });
            if rays & wanted != 0 {
                return (ChildRef(child), rays & wanted);
            }
        }
        (ChildRef::NONE, 0)
    }
}
