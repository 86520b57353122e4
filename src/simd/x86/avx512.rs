//! 512 bits: AVX-512 F, VL, DQ and BW.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::x86_64::*;
use core::mem::MaybeUninit;

use super::avx2::{F8, numbers};
use super::doubles::{D4, D8};
use super::sort;
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
    fn corners(self, table: F16, list: &[u8; 8]) -> F8 {
        // SAFETY: the token proves AVX-512 F and AVX2. A permutation looks at the four lowest bits only.
        unsafe {
            let numbers = _mm512_castsi256_si512(numbers::<0>(list));
            F8(_mm512_castps512_ps256(_mm512_permutexvar_ps(numbers, table.0)))
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
    fn select(self, mask: u32, chosen: F16, other: F16) -> F16 {
        // SAFETY: the token proves AVX-512 F.
        F16(unsafe { _mm512_mask_mov_ps(other.0, mask as __mmask16, chosen.0) })
    }

    #[inline(always)]
    fn lane(self, v: F16, lane: u32) -> f32 {
        // SAFETY: the token proves AVX-512 F.
        unsafe {
            _mm512_cvtss_f32(_mm512_permutexvar_ps(_mm512_set1_epi32(lane as i32), v.0))
        }
    }

    #[inline(always)]
    fn largest(self, v: F16) -> f32 {
        // SAFETY: the token proves AVX-512 F.
        unsafe { _mm512_reduce_max_ps(v.0) }
    }

    #[inline(always)]
    fn set_words(self, mask: u32, word: u32, words: &mut [u32; 16]) {
        // SAFETY: the token proves AVX-512 F; the array has 16 words.
        unsafe {
            let all = _mm512_set1_epi32(word as i32);
            _mm512_mask_storeu_epi32(words.as_mut_ptr().cast(), mask as __mmask16, all);
        }
    }

    #[inline(always)]
    fn columns(self, rows: &[&[f32; 8]; 16]) -> [[f32; 16]; 8] {
        let mut columns = [[0.0; 16]; 8];
        // SAFETY: the token proves AVX-512 F and DQ; a row has eight floats, a column sixteen.
        unsafe {
            // Rows 0 to 3 beside rows 4 to 7, and then 8 to 11 beside 12 to 15.
            let mut pairs = [_mm512_setzero_ps(); 8];
            for (i, pair) in pairs.iter_mut().enumerate() {
                let first = i + i / 4 * 4;
                let low = _mm256_loadu_ps(rows[first].as_ptr());
                let high = _mm256_loadu_ps(rows[first + 4].as_ptr());
                *pair = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high);
            }
            let [a, b, c, d, e, f, g, h] = pairs;
            let (first, last) = (in_quarters([a, b, c, d]), in_quarters([e, f, g, h]));
            for k in 0..4 {
                let low = _mm512_shuffle_f32x4::<0x88>(first[k], last[k]);
                let high = _mm512_shuffle_f32x4::<0xDD>(first[k], last[k]);
                _mm512_storeu_ps(columns[k].as_mut_ptr(), low);
                _mm512_storeu_ps(columns[k + 4].as_mut_ptr(), high);
            }
        }
        columns
    }

    #[inline(always)]
    fn note(self, [near, far]: [F16; 2], bits: u32, words: &mut [u32; 16], least: F16) -> F16 {
        // SAFETY: the token proves AVX-512 F; the array has 16 words.
        unsafe {
            let lanes = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(near.0, far.0);
            let place = words.as_mut_ptr().cast();
            let before = _mm512_loadu_si512(place);
            let bits = _mm512_set1_epi32(bits as i32);
            _mm512_storeu_si512(place, _mm512_mask_or_epi32(before, lanes, before, bits));
            F16(_mm512_mask_min_ps(least.0, lanes, near.0, least.0))
        }
    }

    #[inline(always)]
    fn used_words(self, words: &[u32; 16]) -> u32 {
        // SAFETY: the token proves AVX-512 F; the array has 16 words.
        unsafe {
            let words = _mm512_loadu_si512(words.as_ptr().cast());
            u32::from(_mm512_test_epi32_mask(words, words))
        }
    }

    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]) {
        // SAFETY: the token proves AVX-512 F; both arrays have 16 words.
        unsafe {
            let all = _mm512_loadu_si512(words.as_ptr().cast());
            let front = _mm512_maskz_compress_epi32(mask as __mmask16, all);
            _mm512_storeu_si512(out.as_mut_ptr().cast(), front);
        }
    }

    #[inline(always)]
    fn sort(
        self,
        mask: u32,
        near: F16,
        words: &[u32; 16],
        near_out: &mut [MaybeUninit<f32>; 16],
        words_out: &mut [MaybeUninit<u32>; 16],
    ) -> u32 {
        let (mask, count) = (mask as __mmask16, mask.count_ones());
        let (near_out, words_out) = (near_out.as_mut_ptr(), words_out.as_mut_ptr());
        // SAFETY: the token proves AVX-512; all tables have 16 lanes, and no more are read or written. A
        // permutation looks at as many bits of a key as the number of a lane has.
        unsafe {
            let near = _mm512_maskz_compress_epi32(mask, _mm512_castps_si512(near.0));
            let words = _mm512_loadu_si512(words.as_ptr().cast());
            let words = _mm512_maskz_compress_epi32(mask, words);
            let numbers = _mm512_loadu_si512(NUMBERS.as_ptr().cast());
            let used = (0xFFFF_u32 >> (16 - count)) as __mmask16;
            if count <= 8 {
                let (near, words) = (_mm512_castsi512_si256(near), _mm512_castsi512_si256(words));
                return sort::sort(near, words, count, near_out, words_out);
            }
            let keys = _mm512_andnot_si512(_mm512_set1_epi32(15), near);
            let keys = _mm512_or_si512(keys, numbers);
            let least = _mm512_mask_reduce_min_epi32(used, keys);
            let least = _mm512_permutexvar_epi32(_mm512_set1_epi32(least), words);
            let keys = sorted_sixteen(_mm512_mask_mov_epi32(_mm512_set1_epi32(i32::MIN), used, keys));
            _mm512_storeu_si512(near_out.cast(), _mm512_permutexvar_epi32(keys, near));
            _mm512_storeu_si512(words_out.cast(), _mm512_permutexvar_epi32(keys, words));
            _mm_cvtsi128_si32(_mm512_castsi512_si128(least)) as u32
        }
    }

    #[inline(always)]
    fn nearest(self, mask: u32, near: F16, words: &[u32; 16]) -> (usize, u32) {
        // SAFETY: the token proves AVX-512; both tables have 16 words.
        unsafe {
            let (mask, above) = (mask as __mmask16, _mm512_set1_epi32(i32::MAX));
            let keys = _mm512_mask_compress_epi32(above, mask, _mm512_castps_si512(near.0));
            let words = _mm512_loadu_si512(words.as_ptr().cast());
            let words = _mm512_maskz_compress_epi32(mask, words);
            let numbers = _mm512_loadu_si512(NUMBERS.as_ptr().cast());
            if mask.count_ones() > 4 {
                let keys = _mm512_andnot_si512(_mm512_set1_epi32(15), keys);
                let key = _mm512_reduce_min_epi32(_mm512_or_si512(keys, numbers));
                let word = _mm512_permutexvar_epi32(_mm512_set1_epi32(key), words);
                let word = _mm_cvtsi128_si32(_mm512_castsi512_si128(word));
                return (key as usize & 15, word as u32);
            }
            let keys = _mm_andnot_si128(_mm_set1_epi32(3), _mm512_castsi512_si128(keys));
            let keys = _mm_or_si128(keys, _mm512_castsi512_si128(numbers));
            let keys = _mm_min_epi32(keys, _mm_shuffle_epi32::<0x4E>(keys));
            let keys = _mm_min_epi32(keys, _mm_shuffle_epi32::<0xB1>(keys));
            // This looks at the two lowest bits only.
            let words = _mm_castsi128_ps(_mm512_castsi512_si128(words));
            let word = _mm_castps_si128(_mm_permutevar_ps(words, keys));
            (_mm_cvtsi128_si32(keys) as usize & 3, _mm_cvtsi128_si32(word) as u32)
        }
    }
}

/// The columns of four rows, in each quarter of a vector by itself.
///
/// # Safety
///
/// The processor has AVX-512 F.
#[inline(always)]
unsafe fn in_quarters([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: the caller's promise.
    unsafe {
        let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
        [
            _mm512_shuffle_ps::<0x44>(ab, cd),
            _mm512_shuffle_ps::<0xEE>(ab, cd),
            _mm512_shuffle_ps::<0x44>(ab_high, cd_high),
            _mm512_shuffle_ps::<0xEE>(ab_high, cd_high),
        ]
    }
}

/// Integers in order, the largest first.
///
/// Source: \[Bat68\].
///
/// # Safety
///
/// The processor has AVX-512 F.
#[inline(always)]
unsafe fn sorted_sixteen(mut keys: __m512i) -> __m512i {
    macro_rules! step {
        ($other:expr, $mask:literal) => {{
            let other = $other;
            keys = _mm512_mask_min_epi32(_mm512_max_epi32(keys, other), $mask, keys, other);
        }};
    }
    // SAFETY: the caller's promise.
    unsafe {
        step!(_mm512_shuffle_epi32::<0xB1>(keys), 0xAAAA);
        step!(_mm512_shuffle_epi32::<0x1B>(keys), 0xCCCC);
        step!(_mm512_shuffle_epi32::<0xB1>(keys), 0xAAAA);
        let quarter = _mm512_shuffle_epi32::<0x1B>(keys);
        step!(_mm512_shuffle_i32x4::<0xB1>(quarter, quarter), 0xF0F0);
        step!(_mm512_shuffle_epi32::<0x4E>(keys), 0xCCCC);
        step!(_mm512_shuffle_epi32::<0xB1>(keys), 0xAAAA);
        let quarter = _mm512_shuffle_epi32::<0x1B>(keys);
        step!(_mm512_shuffle_i32x4::<0x1B>(quarter, quarter), 0xFF00);
        step!(_mm512_shuffle_i32x4::<0xB1>(keys, keys), 0xF0F0);
        step!(_mm512_shuffle_epi32::<0x4E>(keys), 0xCCCC);
        step!(_mm512_shuffle_epi32::<0xB1>(keys), 0xAAAA);
    }
    keys
}

const NUMBERS: [i32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

impl Simd for Avx512 {
    const FEW: u32 = 0;
    const IN_HALVES: bool = false;
    const FLIES: bool = true;

    type Doubles = D8;
    type Quad = D4;

    #[inline(always)]
    fn quad(self, floats: &[f32; 4]) -> D4 {
        // SAFETY: the token proves that the instructions exist.
        unsafe { D4::widened(floats) }
    }

    #[inline(always)]
    fn widened(self, floats: &[f32; 8]) -> D8 {
        // SAFETY: the token proves that the instructions exist.
        unsafe { D8::widened(floats) }
    }

    #[inline(always)]
    fn narrowed(self, doubles: D8) -> [f32; 8] {
        doubles.narrowed()
    }

    #[inline(always)]
    fn twice(self, four: &[f64; 4]) -> D8 {
        // SAFETY: the token proves that the instructions exist.
        unsafe { D8::twice(four) }
    }

    #[inline(always)]
    unsafe fn keep_up_to(
        self,
        near: &mut [MaybeUninit<f32>],
        refs: &mut [MaybeUninit<u32>],
        t_bound: f32,
    ) -> usize {
        let count = near.len().min(refs.len());
        let (near, refs) = (near.as_mut_ptr().cast::<f32>(), refs.as_mut_ptr().cast::<i32>());
        let (mut from, mut kept) = (0, 0);
        while from < count {
            let lanes = (1u32 << (count - from).min(16)) - 1;
            // SAFETY: the token proves AVX-512. Lanes below `count` are read and written, no others;
            // what is written lies in front of what is still to be read.
            unsafe {
                let lanes = lanes as __mmask16;
                let t = _mm512_maskz_loadu_ps(lanes, near.add(from));
                let words = _mm512_maskz_loadu_epi32(lanes, refs.add(from));
                let bound = _mm512_set1_ps(t_bound);
                let keep = _mm512_mask_cmp_ps_mask::<_CMP_NGT_UQ>(lanes, t, bound);
                let front = ((1u32 << keep.count_ones()) - 1) as __mmask16;
                let t = _mm512_maskz_compress_ps(keep, t);
                let words = _mm512_maskz_compress_epi32(keep, words);
                _mm512_mask_storeu_ps(near.add(kept), front, t);
                _mm512_mask_storeu_epi32(refs.add(kept), front, words);
                kept += keep.count_ones() as usize;
            }
            from += 16;
        }
        kept
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
        #[target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        )]
        #[inline(never)]
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
    fn fast_mul_add(self, factor: Self, other: Self) -> Self {
        // SAFETY: a value of this type proves AVX-512.
        F16(unsafe { _mm512_fmadd_ps(self.0, factor.0, other.0) })
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
}
