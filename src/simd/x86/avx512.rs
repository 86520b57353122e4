//! 512 bits: AVX-512 F, VL, DQ and BW.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::x86_64::*;
use core::mem::MaybeUninit;

use super::avx2::F8;
use super::sse2::F4;
use crate::simd::{Kernel, Lanes, Simd, Width};

/// Proof that this processor runs AVX-512 F, VL, DQ and BW.
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

impl Avx512 {
    /// # Safety
    ///
    /// The processor has AVX-512 F, VL, DQ and BW, and so AVX2 and FMA.
    pub unsafe fn assume() -> Self {
        Avx512(())
    }
}

/// Sixteen lanes of AVX-512: such a value is made from a token, so the instructions exist.
#[derive(Clone, Copy)]
pub(super) struct F16(__m512);

width!(Avx512 4 F4 _mm_set1_ps _mm_loadu_ps);

width! {
    Avx512 8 F8 _mm256_set1_ps _mm256_loadu_ps

    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; 8], out: &mut [MaybeUninit<u32>; 8]) {
        // SAFETY: the token proves AVX-512 F and VL; both arrays have eight words.
        unsafe {
            let all = _mm256_loadu_si256(words.as_ptr().cast());
            let front = _mm256_maskz_compress_epi32(mask as __mmask8, all);
            _mm256_storeu_si256(out.as_mut_ptr().cast(), front);
        }
    }
}

width! {
    Avx512 16 F16 _mm512_set1_ps _mm512_loadu_ps

    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]) {
        // SAFETY: the token proves AVX-512 F; both arrays have 16 words.
        unsafe {
            let all = _mm512_loadu_si512(words.as_ptr().cast());
            let front = _mm512_maskz_compress_epi32(mask as __mmask16, all);
            _mm512_storeu_si512(out.as_mut_ptr().cast(), front);
        }
    }
}

impl Simd for Avx512 {
    const FEW: u32 = 0;

    #[inline(always)]
    fn corners(self, table: F16, list: &[u8; 8]) -> F16 {
        const SHIFTS: [i32; 16] = [0, 0, 4, 4, 8, 8, 12, 12, 16, 16, 20, 20, 24, 24, 28, 28];
        // SAFETY: the token proves AVX-512 F. A permutation looks at the four lowest bits only.
        unsafe {
            let all = _mm512_set1_epi64(i64::from_le_bytes(*list));
            let shifts = _mm512_loadu_si512(SHIFTS.as_ptr().cast());
            F16(_mm512_permutexvar_ps(_mm512_srlv_epi32(all, shifts), table.0))
        }
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        )]
        fn with<K: Kernel>(s: Avx512, kernel: K) -> K::Output {
            kernel.run(s)
        }
        // SAFETY: the token proves AVX-512; processors with it have the rest, which is checked where
        // the token is made.
        unsafe { with(self, kernel) }
    }
}

impl Lanes<16> for F16 {
    pairwise! {
        add: _mm512_add_ps;
        sub: _mm512_sub_ps;
        mul: _mm512_mul_ps;
        div: _mm512_div_ps;
        // These two return their second operand when either is a NaN, and for zeros of two signs.
        min: _mm512_min_ps;
        max: _mm512_max_ps;
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: a value of this type proves AVX-512.
        F16(unsafe { _mm512_abs_ps(self.0) })
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        // SAFETY: a value of this type proves AVX-512 F and DQ.
        F16(unsafe { _mm512_xor_ps(self.0, _mm512_and_ps(_mm512_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        // SAFETY: a value of this type proves AVX-512 F and DQ.
        F16(unsafe { _mm512_or_ps(self.0, _mm512_and_ps(_mm512_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn fast_mul_sub(self, factor: Self, other: Self) -> Self {
        // SAFETY: a value of this type proves AVX-512.
        F16(unsafe { _mm512_fmsub_ps(self.0, factor.0, other.0) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: a value of this type proves AVX-512.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        // SAFETY: a value of this type proves AVX-512.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 16]) {
        // SAFETY: `out` has room for 16 floats.
        unsafe { _mm512_storeu_ps(out.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn compress(self, mask: u32, out: &mut [MaybeUninit<f32>; 16]) {
        // SAFETY: a value of this type proves AVX-512; `out` has room for 16 floats. In a register
        // first: compressing to memory is slow on some processors.
        unsafe {
            let front = _mm512_maskz_compress_ps(mask as __mmask16, self.0);
            _mm512_storeu_ps(out.as_mut_ptr().cast(), front);
        }
    }
}
