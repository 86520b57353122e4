//! WebAssembly that is compiled with `simd128`: a module with it does not load where it is missing.

#![allow(unused_unsafe, reason = "instructions are safe functions here, and not elsewhere")]

use core::arch::wasm32::*;

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
        _ => Simd128.run(kernel),
    }
}

/// What every processor has that this is compiled for.
#[inline(always)]
pub(super) fn at_hand() -> impl Simd {
    Simd128
}

/// The token of 128 bits.
#[derive(Clone, Copy)]
struct Simd128;

/// Four lanes.
#[derive(Clone, Copy)]
struct F4(v128);

width!(Simd128 4 F4 f32x4_splat v128_load);
doubled!(Simd128 8 of 4 F4);
doubled!(Simd128 16 of 8 Two<F4>);

impl Simd for Simd128 {
    // As with SSE2; not measured here.
    const FEW: u32 = 3;

    doubles_one_by_one!();

    #[inline(never)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}

impl Lanes<4> for F4 {
    pairwise! {
        add: f32x4_add;
        sub: f32x4_sub;
        mul: f32x4_mul;
        div: f32x4_div;
    }

    // `pmin(a, b)` is `if b < a { b } else { a }`, `pmax(a, b)` likewise: the operands change places.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        F4(f32x4_pmin(other.0, self.0))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        F4(f32x4_pmax(other.0, self.0))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        F4(f32x4_abs(self.0))
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        F4(v128_xor(self.0, v128_and(sign.0, f32x4_splat(-0.0))))
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        F4(v128_or(self.0, v128_and(sign.0, f32x4_splat(-0.0))))
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
        u32::from(i32x4_bitmask(f32x4_lt(self.0, other.0)))
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        u32::from(i32x4_bitmask(f32x4_le(self.0, other.0)))
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 4]) {
        // SAFETY: `out` has room for four floats.
        unsafe { v128_store(out.as_mut_ptr().cast(), self.0) }
    }
}

/// Nothing: processors with these instructions fetch ahead by themselves.
#[inline(always)]
pub(super) fn prefetch<T>(_what: &T) {}
