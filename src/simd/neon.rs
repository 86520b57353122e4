//! AArch64: NEON, which is part of the base architecture.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::aarch64::*;

use super::doubled::{Two, halves};
use super::{Backend, Kernel, Lanes, Scalar, Simd, Width};

pub(super) fn detect() -> Backend {
    Backend::Bits128
}

/// Runs `kernel` with the instructions of `backend`, or of the best there is below.
///
/// # Safety
///
/// None is needed here; other processors need `backend` to be no more than `detect` finds.
#[inline(always)]
pub(super) unsafe fn run_with<K: Kernel>(backend: Backend, kernel: K) -> K::Output {
    match backend {
        Backend::Scalar => Scalar.run(kernel),
        _ => Neon.run(kernel),
    }
}

/// What every processor has that this is compiled for.
#[inline(always)]
pub(super) fn at_hand() -> impl Simd {
    Neon
}

/// The token of 128 bits.
#[derive(Clone, Copy)]
struct Neon;

/// Four lanes.
#[derive(Clone, Copy)]
struct F4(float32x4_t);

width!(Neon 4 F4 vdupq_n_f32 vld1q_f32);
doubled! {
    Neon 8 of 4 F4,

    #[inline(always)]
    fn corners(self, table: Two<Two<F4>>, list: &[u8; 8]) -> Two<F4> {
        // SAFETY: NEON is there.
        unsafe { named::<0>(bytes(table), list) }
    }
}

doubled! {
    Neon 16 of 8 Two<F4>,

    #[inline(always)]
    fn corners(self, table: Two<Two<F4>>, list: &[u8; 8]) -> Two<Two<F4>> {
        // SAFETY: NEON is there.
        unsafe { Two(named::<0>(bytes(table), list), named::<2>(bytes(table), list)) }
    }
}

/// Sixteen lanes as a table of bytes.
///
/// # Safety
///
/// The processor has NEON.
#[inline(always)]
unsafe fn bytes(Two(Two(a, b), Two(c, d)): Two<Two<F4>>) -> uint8x16x4_t {
    // SAFETY: the caller's promise.
    unsafe {
        let (a, b) = (vreinterpretq_u8_f32(a.0), vreinterpretq_u8_f32(b.0));
        uint8x16x4_t(a, b, vreinterpretq_u8_f32(c.0), vreinterpretq_u8_f32(d.0))
    }
}

/// The lanes of `table` that `list` names for eight lanes, of which the first is `4 FIRST`.
///
/// # Safety
///
/// The processor has NEON.
#[inline(always)]
unsafe fn named<const FIRST: usize>(table: uint8x16x4_t, list: &[u8; 8]) -> Two<F4> {
    // SAFETY: the caller's promise; a row of shifts has four lanes.
    unsafe {
        let all = vreinterpretq_u32_u64(vdupq_n_u64(u64::from_le_bytes(*list)));
        let low = vshlq_u32(all, vld1q_s32(SHIFTS[FIRST].as_ptr()));
        let high = vshlq_u32(all, vld1q_s32(SHIFTS[FIRST + 1].as_ptr()));
        Two(pick(table, low), pick(table, high))
    }
}

/// How far to the left the two words of a list, twice, are shifted for the numbers of lanes `4 i` to `4 i + 3`.
const SHIFTS: [[i32; 4]; 4] =
    [[0, 0, -4, -4], [-8, -8, -12, -12], [-16, -16, -20, -20], [-24, -24, -28, -28]];

/// The lanes of `table` that the lowest nibbles of `numbers` name.
///
/// # Safety
///
/// The processor has NEON.
#[inline(always)]
unsafe fn pick(table: uint8x16x4_t, numbers: uint32x4_t) -> F4 {
    // SAFETY: the caller's promise.
    unsafe {
        let lanes = vandq_u32(numbers, vdupq_n_u32(15));
        // The four bytes of a lane.
        let bytes = vmlaq_u32(vdupq_n_u32(0x0302_0100), lanes, vdupq_n_u32(0x0404_0404));
        F4(vreinterpretq_f32_u8(vqtbl4q_u8(table, vreinterpretq_u8_u32(bytes))))
    }
}

impl Simd for Neon {
    // As with SSE2; not measured here.
    const FEW: u32 = 3;

    doubles_one_by_one!();

    #[inline(never)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}

/// One bit for each lane of a comparison.
///
/// # Safety
///
/// The processor has NEON.
#[inline(always)]
unsafe fn mask(lanes: uint32x4_t) -> u32 {
    const BITS: [u32; 4] = [1, 2, 4, 8];
    // SAFETY: the caller's promise; the array has four words.
    unsafe { vaddvq_u32(vandq_u32(lanes, vld1q_u32(BITS.as_ptr()))) }
}

impl Lanes<4> for F4 {
    pairwise! {
        add: vaddq_f32;
        sub: vsubq_f32;
        mul: vmulq_f32;
        div: vdivq_f32;
    }

    // NEON's own minimum and maximum return NaN for any NaN, and order the zeros.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: NEON is there.
        F4(unsafe { vbslq_f32(vcltq_f32(self.0, other.0), self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: NEON is there.
        F4(unsafe { vbslq_f32(vcgtq_f32(self.0, other.0), self.0, other.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: NEON is there.
        F4(unsafe { vabsq_f32(self.0) })
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        // SAFETY: NEON is there.
        unsafe {
            let sign = vandq_u32(vreinterpretq_u32_f32(sign.0), vdupq_n_u32(1 << 31));
            F4(vreinterpretq_f32_u32(veorq_u32(vreinterpretq_u32_f32(self.0), sign)))
        }
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        // SAFETY: NEON is there.
        F4(unsafe { vbslq_f32(vdupq_n_u32(1 << 31), sign.0, self.0) })
    }

    #[inline(always)]
    fn fast_mul_sub(self, factor: Self, other: Self) -> Self {
        // SAFETY: NEON is there.
        F4(unsafe { vfmaq_f32(vnegq_f32(other.0), self.0, factor.0) })
    }

    #[inline(always)]
    fn fast_mul_add(self, factor: Self, other: Self) -> Self {
        // SAFETY: NEON is there.
        F4(unsafe { vfmaq_f32(other.0, self.0, factor.0) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: NEON is there.
        unsafe { mask(vcltq_f32(self.0, other.0)) }
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        // SAFETY: NEON is there.
        unsafe { mask(vcleq_f32(self.0, other.0)) }
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 4]) {
        // SAFETY: `out` has room for four floats.
        unsafe { vst1q_f32(out.as_mut_ptr(), self.0) }
    }
}

/// Nothing: processors with these instructions fetch ahead by themselves.
#[inline(always)]
pub(super) fn prefetch<T>(_what: &T) {}
