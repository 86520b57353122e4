//! 256 bits: AVX2 and FMA.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::asm;
use core::arch::x86_64::*;
use core::mem::MaybeUninit;

use super::doubles::{D4, D44};
use super::sort;
use super::sse2::F4;
use crate::simd::doubled::{Two, halves};
use crate::simd::{Kernel, Lanes, Simd, Width, scalar};

/// Proof that this processor runs AVX2 and FMA.
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

impl Avx2 {
    /// # Safety
    ///
    /// The processor has AVX2 and FMA.
    pub unsafe fn assume() -> Self {
        Avx2(())
    }
}

/// Eight lanes of AVX2: such a value is made from a token, so the instructions exist.
#[derive(Clone, Copy)]
pub(super) struct F8(pub(super) __m256);

width!(Avx2 4 F4 _mm_set1_ps _mm_loadu_ps);
width! {
    Avx2 8 F8 _mm256_set1_ps _mm256_loadu_ps

    #[inline(always)]
    fn corners(self, table: Two<F8>, list: &[u8; 8]) -> F8 {
        // SAFETY: the token proves AVX2.
        unsafe { pick(table, numbers::<0>(list)) }
    }

    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; 8], out: &mut [MaybeUninit<u32>; 8]) {
        // SAFETY: the token proves AVX2; both arrays have eight words.
        unsafe {
            let all = _mm256_loadu_si256(words.as_ptr().cast());
            let front = _mm256_permutevar8x32_epi32(all, sort::numbers_of(mask));
            _mm256_storeu_si256(out.as_mut_ptr().cast(), front);
        }
    }

    #[inline(always)]
    fn sort(
        self,
        mask: u32,
        near: F8,
        words: &[u32; 8],
        near_out: &mut [MaybeUninit<f32>; 8],
        words_out: &mut [MaybeUninit<u32>; 8],
    ) -> u32 {
        near.sort(mask, words, near_out, words_out)
    }
}

doubled! {
    Avx2 16 of 8 F8,

    #[inline(always)]
    fn corners(self, table: Two<F8>, list: &[u8; 8]) -> Two<F8> {
        // SAFETY: the token proves AVX2.
        unsafe { Two(pick(table, numbers::<0>(list)), pick(table, numbers::<16>(list))) }
    }

    #[inline(always)]
    fn select(self, mask: u32, chosen: Two<F8>, other: Two<F8>) -> Two<F8> {
        Two(other.0.replaced(mask, chosen.0), other.1.replaced(mask >> 8, chosen.1))
    }

    #[inline(always)]
    fn largest(self, v: Two<F8>) -> f32 {
        v.0.max(v.1).largest()
    }

    #[inline(always)]
    fn set_words(self, mask: u32, word: u32, words: &mut [u32; 16]) {
        // SAFETY: the token proves AVX2; the array has 16 words.
        unsafe {
            let (all, words) = (_mm256_set1_epi32(word as i32), words.as_mut_ptr().cast::<i32>());
            _mm256_maskstore_epi32(words, lanes_of(mask), all);
            _mm256_maskstore_epi32(words.add(8), lanes_of(mask >> 8), all);
        }
    }

    #[inline(always)]
    fn columns(self, rows: &[&[f32; 8]; 16]) -> [[f32; 16]; 8] {
        let mut columns = [[0.0; 16]; 8];
        for half in [0, 8] {
            // SAFETY: the token proves AVX2; a row has eight floats, half a column too.
            unsafe {
                let mut loaded = [_mm256_setzero_ps(); 8];
                for (i, row) in loaded.iter_mut().enumerate() {
                    *row = _mm256_loadu_ps(rows[half + i].as_ptr());
                }
                let [a, b, c, d, e, f, g, h] = loaded;
                let (first, last) = (in_halves([a, b, c, d]), in_halves([e, f, g, h]));
                for k in 0..4 {
                    let low = _mm256_permute2f128_ps::<0x20>(first[k], last[k]);
                    let high = _mm256_permute2f128_ps::<0x31>(first[k], last[k]);
                    _mm256_storeu_ps(columns[k].as_mut_ptr().add(half), low);
                    _mm256_storeu_ps(columns[k + 4].as_mut_ptr().add(half), high);
                }
            }
        }
        columns
    }

    #[inline(always)]
    fn note(
        self,
        [near, far]: [Two<F8>; 2],
        bits: u32,
        words: &mut [u32; 16],
        least: Two<F8>,
    ) -> Two<F8> {
        // SAFETY: the token proves AVX2; the array has 16 words.
        unsafe {
            let low = words.as_mut_ptr().cast::<__m256i>();
            Two(
                note([near.0, far.0], bits, low, least.0),
                note([near.1, far.1], bits, low.add(1), least.1),
            )
        }
    }

    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]) {
        let (low, high) = (mask & 0xFF, mask >> 8 & 0xFF);
        // SAFETY: the token proves AVX2; both arrays have 16 words, and a half has eight at most.
        unsafe {
            let (words, out) = (words.as_ptr(), out.as_mut_ptr());
            let lower = _mm256_loadu_si256(words.cast());
            let upper = _mm256_loadu_si256(words.add(8).cast());
            let lower = _mm256_permutevar8x32_epi32(lower, sort::numbers_of(low));
            let upper = _mm256_permutevar8x32_epi32(upper, sort::numbers_of(high));
            _mm256_storeu_si256(out.cast(), lower);
            _mm256_storeu_si256(out.add(low.count_ones() as usize).cast(), upper);
        }
    }

    #[inline(always)]
    fn sort(
        self,
        mask: u32,
        near: Two<F8>,
        words: &[u32; 16],
        near_out: &mut [MaybeUninit<f32>; 16],
        words_out: &mut [MaybeUninit<u32>; 16],
    ) -> u32 {
        let count = mask.count_ones();
        if count > 8 {
            let mut lanes = [0.0; 16];
            near.store(&mut lanes);
            return scalar::sort(mask, &lanes, words, near_out, words_out);
        }
        // SAFETY: the token proves AVX2; all tables have 16 lanes.
        unsafe {
            let numbers = sort::numbers_of(mask);
            let lower = _mm256_loadu_ps(words.as_ptr().cast());
            let upper = _mm256_loadu_ps(words.as_ptr().add(8).cast());
            let words = _mm256_castps_si256(pick(Two(F8(lower), F8(upper)), numbers).0);
            let near = _mm256_castps_si256(pick(near, numbers).0);
            sort::sort(near, words, count, near_out.as_mut_ptr(), words_out.as_mut_ptr())
        }
    }
}

impl F8 {
    /// This, with the lanes of `mask` from `by`.
    #[inline(always)]
    fn replaced(self, mask: u32, by: F8) -> F8 {
        // SAFETY: a value of this type proves AVX2.
        F8(unsafe { _mm256_blendv_ps(self.0, by.0, _mm256_castsi256_ps(lanes_of(mask))) })
    }

    /// The largest lane, of which none is a NaN.
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: a value of this type proves AVX2.
        unsafe {
            let v = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let v = _mm_max_ps(v, _mm_movehl_ps(v, v));
            _mm_cvtss_f32(_mm_max_ss(v, _mm_movehdup_ps(v)))
        }
    }

    /// See [`Width::sort`].
    #[inline(always)]
    pub fn sort(
        self,
        mask: u32,
        words: &[u32; 8],
        near_out: &mut [MaybeUninit<f32>; 8],
        words_out: &mut [MaybeUninit<u32>; 8],
    ) -> u32 {
        // SAFETY: a value of this type proves AVX2; all tables have eight lanes.
        unsafe {
            let numbers = sort::numbers_of(mask & 0xFF);
            let near = _mm256_castps_si256(_mm256_permutevar8x32_ps(self.0, numbers));
            let words = _mm256_loadu_si256(words.as_ptr().cast());
            let words = _mm256_permutevar8x32_epi32(words, numbers);
            let count = mask.count_ones();
            sort::sort(near, words, count, near_out.as_mut_ptr(), words_out.as_mut_ptr())
        }
    }
}

/// [`Width::note`] for eight lanes and words.
///
/// # Safety
///
/// The processor has AVX2; the words may be written to.
#[inline(always)]
unsafe fn note([near, far]: [F8; 2], bits: u32, words: *mut __m256i, least: F8) -> F8 {
    // SAFETY: the caller's promise.
    unsafe {
        let lanes = _mm256_cmp_ps::<_CMP_LE_OQ>(near.0, far.0);
        let added = _mm256_and_si256(_mm256_castps_si256(lanes), _mm256_set1_epi32(bits as i32));
        _mm256_storeu_si256(words, _mm256_or_si256(_mm256_loadu_si256(words), added));
        F8(_mm256_blendv_ps(least.0, near.min(least).0, lanes))
    }
}

/// One bit for each lane whose sign is set.
///
/// A compiler that sees two of these put together packs the lanes of both first, which takes twice the instructions
/// and three times as long: what is empty here hides where a mask comes from.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn mask(lanes: __m256) -> u32 {
    // SAFETY: the caller's promise.
    let mut mask = unsafe { _mm256_movemask_ps(lanes) } as u32;
    // SAFETY: no instruction at all.
    unsafe {
        asm!("/* {0:e} */", inout(reg) mask, options(pure, nomem, nostack, preserves_flags));
    }
    mask
}

/// All bits in the lanes of `mask`, none in the others.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn lanes_of(mask: u32) -> __m256i {
    // SAFETY: the caller's promise.
    unsafe {
        let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bits), bits)
    }
}

/// The columns of four rows, in each half of a vector by itself.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn in_halves([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    // SAFETY: the caller's promise.
    unsafe {
        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0x44>(ab, cd),
            _mm256_shuffle_ps::<0xEE>(ab, cd),
            _mm256_shuffle_ps::<0x44>(ab_high, cd_high),
            _mm256_shuffle_ps::<0xEE>(ab_high, cd_high),
        ]
    }
}

/// Of 16 lanes the eight with these numbers, in the four lowest bits.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn pick(table: Two<F8>, numbers: __m256i) -> F8 {
    // SAFETY: the caller's promise.
    unsafe {
        let below = _mm256_permutevar8x32_ps(table.0.0, numbers);
        let above = _mm256_permutevar8x32_ps(table.1.0, numbers);
        // The fourth bit of a number becomes the sign.
        let upper = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(numbers));
        F8(_mm256_blendv_ps(below, above, upper))
    }
}

/// The numbers that a list names for eight lanes, in their lowest four bits; `SKIP` is 16 for the upper lanes, else zero.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
pub(super) unsafe fn numbers<const SKIP: i32>(list: &[u8; 8]) -> __m256i {
    const SHIFTS: [i32; 8] = [0, 0, 4, 4, 8, 8, 12, 12];
    // SAFETY: the caller's promise; the array has eight words.
    unsafe {
        let shifts = _mm256_loadu_si256(SHIFTS.as_ptr().cast());
        let shifts = _mm256_add_epi32(shifts, _mm256_set1_epi32(SKIP));
        _mm256_srlv_epi32(_mm256_set1_epi64x(i64::from_le_bytes(*list)), shifts)
    }
}

impl Simd for Avx2 {
    const FEW: u32 = 0;
    const FLIES: bool = true;

    type Doubles = D44;
    type Quad = D4;

    #[inline(always)]
    fn quad(self, floats: &[f32; 4]) -> D4 {
        // SAFETY: the token proves that the instructions exist.
        unsafe { D4::widened(floats) }
    }

    #[inline(always)]
    fn widened(self, floats: &[f32; 8]) -> D44 {
        // SAFETY: the token proves that the instructions exist.
        unsafe { D44::widened(floats) }
    }

    #[inline(always)]
    fn narrowed(self, doubles: D44) -> [f32; 8] {
        doubles.narrowed()
    }

    #[inline(always)]
    fn twice(self, four: &[f64; 4]) -> D44 {
        // SAFETY: the token proves that the instructions exist.
        unsafe { D44::twice(four) }
    }

    #[inline(always)]
    unsafe fn keep_up_to(
        self,
        near: &mut [MaybeUninit<f32>],
        refs: &mut [MaybeUninit<u32>],
        t_bound: f32,
    ) -> usize {
        let count = near.len().min(refs.len());
        let (mut from, mut kept) = (0, 0);
        while from + 8 <= count {
            // SAFETY: the token proves AVX2. Eight entries below `count` are read, and written where at least
            // as many were read.
            unsafe {
                let (near, refs) = (near.as_mut_ptr(), refs.as_mut_ptr());
                let t = _mm256_loadu_ps(near.add(from).cast());
                let words = _mm256_loadu_si256(refs.add(from).cast());
                let keep = _mm256_cmp_ps::<_CMP_NGT_UQ>(t, _mm256_set1_ps(t_bound));
                let keep = _mm256_movemask_ps(keep) as u32;
                let numbers = sort::numbers_of(keep);
                let t = _mm256_permutevar8x32_ps(t, numbers);
                let words = _mm256_permutevar8x32_epi32(words, numbers);
                _mm256_storeu_ps(near.add(kept).cast(), t);
                _mm256_storeu_si256(refs.add(kept).cast(), words);
                kept += keep.count_ones() as usize;
            }
            from += 8;
        }
        // SAFETY: the caller's promise; what was moved was written.
        unsafe { scalar::keep_from(from, kept, near, refs, t_bound) }
    }

    by_four!();

    #[inline(always)]
    fn prefetch<T>(self, what: &T) {
        super::prefetch(what);
    }

    #[inline(always)]
    fn prefetch_lines<const LINES: usize>(self, first: *const u8) {
        (0..LINES).for_each(|line| super::prefetch_line(first, line));
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        #[inline(never)]
        fn with<K: Kernel>(s: Avx2, kernel: K) -> K::Output {
            kernel.run(s)
        }
        // SAFETY: the token proves AVX2 and FMA; processors with these have the rest, which is
        // checked where the token is made.
        unsafe { with(self, kernel) }
    }
}

impl Lanes<8> for F8 {
    pairwise! {
        add: _mm256_add_ps;
        sub: _mm256_sub_ps;
        mul: _mm256_mul_ps;
        div: _mm256_div_ps;
        // These two return their second operand when either is a NaN, and for zeros of two signs.
        min: _mm256_min_ps;
        max: _mm256_max_ps;
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: a value of this type proves AVX2.
        F8(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        // SAFETY: a value of this type proves AVX2.
        F8(unsafe { _mm256_xor_ps(self.0, _mm256_and_ps(_mm256_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        // SAFETY: a value of this type proves AVX2.
        F8(unsafe { _mm256_or_ps(self.0, _mm256_and_ps(_mm256_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn fast_mul_sub(self, factor: Self, other: Self) -> Self {
        // SAFETY: a value of this type proves AVX2 and FMA.
        F8(unsafe { _mm256_fmsub_ps(self.0, factor.0, other.0) })
    }

    #[inline(always)]
    fn fast_mul_add(self, factor: Self, other: Self) -> Self {
        // SAFETY: a value of this type proves AVX2 and FMA.
        F8(unsafe { _mm256_fmadd_ps(self.0, factor.0, other.0) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: a value of this type proves AVX2.
        unsafe { mask(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        // SAFETY: a value of this type proves AVX2.
        unsafe { mask(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 8]) {
        // SAFETY: `out` has room for eight floats.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) }
    }
}
