//! The reference: what every operation means.

use core::mem::MaybeUninit;

use super::{Kernel, Lanes, Simd, Width, corner};
use crate::math::float::less;

/// Portable code, one lane after the other.
#[derive(Clone, Copy)]
pub(crate) struct Scalar;

// The remainders are for compilers that do not see that there is nothing to check; loops over pairs take twice as long where
// there are no vectors.

fn zip<const N: usize>(a: [f32; N], b: [f32; N], f: impl Fn(f32, f32) -> f32) -> [f32; N] {
    core::array::from_fn(|i| f(a[i % N], b[i % N]))
}

fn mask<const N: usize>(a: [f32; N], b: [f32; N], f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..N).fold(0, |bits, i| bits | u32::from(f(a[i % N], b[i % N])) << i)
}

/// Writes those of `values` that `mask` names to the front of `out`.
pub(super) fn compress<T: Copy, const N: usize>(
    values: &[T; N],
    mask: u32,
    out: &mut [MaybeUninit<T>; N],
) {
    let mut rest = mask;
    for out in out {
        let Some(value) = values.get(rest.trailing_zeros() as usize) else { break };
        out.write(*value);
        rest &= rest.wrapping_sub(1);
    }
}

/// See [`Width::sort`].
#[inline(always)]
pub(super) fn sort<const N: usize>(
    mask: u32,
    near: &[f32; N],
    words: &[u32; N],
    near_out: &mut [MaybeUninit<f32>; N],
    words_out: &mut [MaybeUninit<u32>; N],
) -> u32 {
    let numbers = match mask.count_ones() {
        0..=4 => 3,
        5..=8 => 7,
        _ => 15,
    };
    // Each key is put in front of the smaller ones.
    let (mut keys, mut lanes) = ([0; N], [0; N]);
    let (mut rest, mut count) = (mask, 0);
    while let Some(t) = near.get(rest.trailing_zeros() as usize) {
        let key = t.to_bits() as i32 & !numbers | count as i32;
        let mut place = count;
        while place > 0 && keys[place - 1] < key {
            (keys[place], lanes[place]) = (keys[place - 1], lanes[place - 1]);
            place -= 1;
        }
        (keys[place], lanes[place]) = (key, rest.trailing_zeros() as usize);
        count += 1;
        rest &= rest - 1;
    }
    for ((lane, near_out), words_out) in lanes[..count].iter().zip(near_out).zip(words_out) {
        near_out.write(near[*lane]);
        words_out.write(words[*lane]);
    }
    count.checked_sub(1).map_or(u32::MAX, |last| words[lanes[last]])
}

/// See [`Width::nearest`].
#[inline(always)]
pub(super) fn nearest<const N: usize>(
    mask: u32,
    near: &[f32; N],
    words: &[u32; N],
) -> (usize, u32) {
    // Two bits for the number of up to four lanes.
    let numbers = if mask.count_ones() <= 4 { 3 } else { 15 };
    let (mut rest, mut number, mut least, mut nearest) = (mask, 0, i32::MAX, (0, u32::MAX));
    while let Some(t) = near.get(rest.trailing_zeros() as usize) {
        let key = t.to_bits() as i32 & !numbers | number;
        // Keys differ, so this is the first one also where all are as large as can be.
        if key <= least {
            (least, nearest) = (key, (number as usize, words[rest.trailing_zeros() as usize]));
        }
        number += 1;
        rest &= rest - 1;
    }
    nearest
}

/// See [`Simd::keep_up_to`].
///
/// # Safety
///
/// All entries are written.
#[inline(always)]
pub(super) unsafe fn keep_up_to(
    near: &mut [MaybeUninit<f32>],
    refs: &mut [MaybeUninit<u32>],
    t_bound: f32,
) -> usize {
    // SAFETY: the caller's promise.
    unsafe { keep_from(0, 0, near, refs, t_bound) }
}

/// The same for the entries from `from` on, which go behind the `kept` first ones.
///
/// # Safety
///
/// All entries are written.
#[inline(always)]
pub(super) unsafe fn keep_from(
    from: usize,
    mut kept: usize,
    near: &mut [MaybeUninit<f32>],
    refs: &mut [MaybeUninit<u32>],
    t_bound: f32,
) -> usize {
    for i in from..near.len().min(refs.len()) {
        // SAFETY: the caller's promise, and what is moved was written.
        let t = unsafe { near[i].assume_init() };
        near[kept] = near[i];
        refs[kept] = refs[i];
        // Written so that a NaN is kept.
        kept += usize::from(!(t > t_bound));
    }
    kept
}

impl<const N: usize> Lanes<N> for [f32; N] {
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        zip(self, other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        zip(self, other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        zip(self, other, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        zip(self, other, |a, b| a / b)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        zip(self, other, |a, b| if less(a, b) { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        zip(self, other, |a, b| if less(b, a) { a } else { b })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        zip(self, sign, |a, b| f32::from_bits(a.to_bits() ^ (b.to_bits() & 1 << 31)))
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        zip(self, sign, |a, b| f32::from_bits(a.to_bits() | (b.to_bits() & 1 << 31)))
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
        mask(self, other, less)
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        mask(self, other, |a, b| a <= b)
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; N]) {
        *out = self;
    }
}

impl<const N: usize> Width<N> for Scalar {
    type V = [f32; N];

    #[inline(always)]
    fn splat(self, x: f32) -> [f32; N] {
        [x; N]
    }

    #[inline(always)]
    fn load(self, lanes: &[f32; N]) -> [f32; N] {
        *lanes
    }

    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; N], out: &mut [MaybeUninit<u32>; N]) {
        compress(words, mask, out);
    }

    #[inline(always)]
    fn corners(self, table: [f32; 16], list: &[u8; 8]) -> [f32; N] {
        core::array::from_fn(|i| table[corner(list, i)])
    }
}

impl Simd for Scalar {
    const FEW: u32 = 8;
    const IN_HALVES: bool = false;

    doubles_one_by_one!();

    #[inline(never)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}
