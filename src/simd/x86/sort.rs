//! Children in the order of their distance, with AVX2: see [`Width::sort`](crate::simd::Width::sort).

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::x86_64::*;
use core::mem::MaybeUninit;

/// For each mask of eight lanes the numbers of those in it, from the lowest byte on, and zeros.
const LANES: [u64; 256] = {
    let mut table = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut place) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask] |= lane << place;
                place += 8;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// The numbers of the lanes of `mask`, which is of 16 lanes of which eight at most are in it; zero for the rest.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
pub(super) unsafe fn numbers_of(mask: u32) -> __m256i {
    let (low, high) = (mask as usize & 0xFF, mask as usize >> 8 & 0xFF);
    let upper = LANES[high] | (0x0808_0808_0808_0808 & low_bytes(high.count_ones()));
    let numbers = LANES[low] | upper.checked_shl(8 * low.count_ones()).unwrap_or(0);
    // SAFETY: the caller's promise.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(numbers as i64)) }
}

/// The lowest `count <= 8` bytes.
#[inline(always)]
fn low_bytes(count: u32) -> u64 {
    u64::MAX.checked_shr(64 - 8 * count).unwrap_or(0)
}

/// Sorts the first `count` lanes, two to eight, and writes them; returns the last word.
///
/// # Safety
///
/// The processor has AVX2; eight lanes may be written to either column.
#[inline(always)]
pub(super) unsafe fn sort(
    near: __m256i,
    words: __m256i,
    count: u32,
    near_out: *mut MaybeUninit<f32>,
    words_out: *mut MaybeUninit<u32>,
) -> u32 {
    // SAFETY: the caller's promise. A permutation looks at as many bits of a key as the number of a lane has.
    unsafe {
        let numbers = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        let used = _mm256_cmpgt_epi32(_mm256_set1_epi32(count as i32), numbers);
        let low = _mm256_set1_epi32(if count <= 4 { 3 } else { 7 });
        let keys = _mm256_or_si256(_mm256_andnot_si256(low, near), numbers);
        // What is not used comes behind all others; what is found first is the nearest, which all else waits for.
        let most = _mm256_blendv_epi8(_mm256_set1_epi32(i32::MAX), keys, used);
        let keys = _mm256_blendv_epi8(_mm256_set1_epi32(i32::MIN), keys, used);
        if count <= 4 {
            let near = _mm_castsi128_ps(_mm256_castsi256_si128(near));
            let words = _mm_castsi128_ps(_mm256_castsi256_si128(words));
            let least = least_of_four(_mm256_castsi256_si128(most));
            let least = _mm_castps_si128(_mm_permutevar_ps(words, least));
            let keys = sorted_four(_mm256_castsi256_si128(keys));
            _mm_storeu_ps(near_out.cast(), _mm_permutevar_ps(near, keys));
            _mm_storeu_ps(words_out.cast(), _mm_permutevar_ps(words, keys));
            return _mm_cvtsi128_si32(least) as u32;
        }
        let (lower, upper) = (_mm256_castsi256_si128(most), _mm256_extracti128_si256::<1>(most));
        let least = _mm256_castsi128_si256(least_of_four(_mm_min_epi32(lower, upper)));
        let least = _mm256_permutevar8x32_epi32(words, least);
        let keys = sorted_eight(keys);
        _mm256_storeu_si256(near_out.cast(), _mm256_permutevar8x32_epi32(near, keys));
        _mm256_storeu_si256(words_out.cast(), _mm256_permutevar8x32_epi32(words, keys));
        _mm_cvtsi128_si32(_mm256_castsi256_si128(least)) as u32
    }
}

/// The least of four integers, in all lanes.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn least_of_four(keys: __m128i) -> __m128i {
    // SAFETY: the caller's promise.
    unsafe {
        let keys = _mm_min_epi32(keys, _mm_shuffle_epi32::<0x4E>(keys));
        _mm_min_epi32(keys, _mm_shuffle_epi32::<0xB1>(keys))
    }
}

/// One step of a bitonic network: of the integers in `$keys` and in `$other`, the same in another order, the smaller ones go
/// to the lanes of `$mask`.
macro_rules! step {
    ($max:ident $min:ident $blend:ident, $keys:ident, $other:expr, $mask:literal) => {{
        let other = $other;
        $keys = $blend::<$mask>($max($keys, other), $min($keys, other));
    }};
}

/// Integers in order, the largest first.
///
/// Source: \[Bat68\], as for eight.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn sorted_four(mut keys: __m128i) -> __m128i {
    macro_rules! step4 {
        ($order:literal, $mask:literal) => {
            step!(_mm_max_epi32 _mm_min_epi32 _mm_blend_epi32,
                keys, _mm_shuffle_epi32::<$order>(keys), $mask)
        };
    }
    // SAFETY: the caller's promise.
    unsafe {
        step4!(0xB1, 0b1010);
        step4!(0x1B, 0b1100);
        step4!(0xB1, 0b1010);
    }
    keys
}

/// The same for eight.
///
/// # Safety
///
/// The processor has AVX2.
#[inline(always)]
unsafe fn sorted_eight(mut keys: __m256i) -> __m256i {
    macro_rules! step8 {
        ($other:expr, $mask:literal) => {
            step!(_mm256_max_epi32 _mm256_min_epi32 _mm256_blend_epi32, keys, $other, $mask)
        };
    }
    // SAFETY: the caller's promise.
    unsafe {
        step8!(_mm256_shuffle_epi32::<0xB1>(keys), 0xAA);
        step8!(_mm256_shuffle_epi32::<0x1B>(keys), 0xCC);
        step8!(_mm256_shuffle_epi32::<0xB1>(keys), 0xAA);
        // Backwards: each half, and the halves.
        let half = _mm256_shuffle_epi32::<0x1B>(keys);
        step8!(_mm256_permute4x64_epi64::<0x4E>(half), 0xF0);
        step8!(_mm256_shuffle_epi32::<0x4E>(keys), 0xCC);
        step8!(_mm256_shuffle_epi32::<0xB1>(keys), 0xAA);
    }
    keys
}
