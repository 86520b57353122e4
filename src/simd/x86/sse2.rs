//! 128 bits: every x86-64 processor has SSE2.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::x86_64::*;

use crate::simd::doubled::{Two, halves};
use crate::simd::{Kernel, Lanes, Simd, Width};

/// The token of 128 bits.
#[derive(Clone, Copy)]
pub(super) struct Sse2;

/// Four lanes of SSE2.
#[derive(Clone, Copy)]
pub(super) struct F4(pub(super) __m128);

width!(Sse2 4 F4 _mm_set1_ps _mm_loadu_ps);
doubled!(Sse2 8 of 4 F4);
doubled!(Sse2 16 of 8 Two<F4>);

impl Simd for Sse2 {
    const FEW: u32 = 3;

    doubles_one_by_one!();

    by_four!();

    #[inline(always)]
    fn prefetch<T>(self, what: &T) {
        super::prefetch(what);
    }

    #[inline(always)]
    fn prefetch_lines<const LINES: usize>(self, first: *const u8) {
        (0..LINES).for_each(|line| super::prefetch_line(first, line));
    }

    #[inline(never)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}

impl F4 {
    /// See [`Simd::three`].
    #[inline(always)]
    pub fn three(self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_and_ps(self.0, _mm_castsi128_ps(_mm_setr_epi32(-1, -1, -1, 0))) })
    }

    /// See [`Simd::largest_of_three`].
    #[inline(always)]
    pub fn largest_of_three(self) -> Self {
        // SAFETY: SSE2 is there.
        unsafe {
            let next = _mm_shuffle_ps::<0b00_00_10_01>(self.0, self.0);
            let last = _mm_shuffle_ps::<0b00_01_00_10>(self.0, self.0);
            F4(_mm_max_ps(_mm_max_ps(self.0, next), last))
        }
    }

    /// See [`Simd::least_of_three`].
    #[inline(always)]
    pub fn least_of_three(self) -> Self {
        // SAFETY: SSE2 is there.
        unsafe {
            let next = _mm_shuffle_ps::<0b00_00_10_01>(self.0, self.0);
            let last = _mm_shuffle_ps::<0b00_01_00_10>(self.0, self.0);
            F4(_mm_min_ps(_mm_min_ps(self.0, next), last))
        }
    }

    /// See [`Simd::where_less_or_equal`].
    #[inline(always)]
    pub fn where_less_or_equal(self, other: Self, v: Self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_and_ps(_mm_cmple_ps(self.0, other.0), v.0) })
    }

    /// See [`Simd::whole`].
    #[inline(always)]
    pub fn whole(self) -> [i32; 4] {
        let mut whole = [0; 4];
        // SAFETY: SSE2 is there, and the array has four numbers.
        unsafe { _mm_storeu_si128(whole.as_mut_ptr().cast(), _mm_cvttps_epi32(self.0)) };
        whole
    }

    /// See [`Simd::floats`].
    #[inline(always)]
    pub fn from_whole(whole: [i32; 4]) -> Self {
        // SAFETY: SSE2 is there, and the array has four numbers.
        F4(unsafe { _mm_cvtepi32_ps(_mm_loadu_si128(whole.as_ptr().cast())) })
    }
}

impl Lanes<4> for F4 {
    pairwise! {
        add: _mm_add_ps;
        sub: _mm_sub_ps;
        mul: _mm_mul_ps;
        div: _mm_div_ps;
        // These two return their second operand when either is a NaN, and for zeros of two signs.
        min: _mm_min_ps;
        max: _mm_max_ps;
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_xor_ps(self.0, _mm_and_ps(_mm_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_or_ps(self.0, _mm_and_ps(_mm_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn fast_mul_sub(self, factor: Self, other: Self) -> Self {
        self.mul(factor).sub(other)
    }

    #[inline(always)]
    fn fast_mul_add(self, factor: Self, other: Self) -> Self {
        self.mul(factor).add(other)
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: SSE2 is there.
        unsafe { _mm_movemask_ps(_mm_cmplt_ps(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        // SAFETY: SSE2 is there.
        unsafe { _mm_movemask_ps(_mm_cmple_ps(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 4]) {
        // SAFETY: `out` has room for four floats.
        unsafe { _mm_storeu_ps(out.as_mut_ptr(), self.0) }
    }
}
