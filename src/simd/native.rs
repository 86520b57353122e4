//! A processor without vector instructions that this library knows.

use super::{Backend, Kernel, Scalar, Simd};

pub(super) fn detect() -> Backend {
    Backend::Scalar
}

/// Runs `kernel` with portable code, whichever backend is asked for.
///
/// # Safety
///
/// None is needed here; other processors need `backend` to be no more than `detect` finds.
#[inline(always)]
pub(super) unsafe fn run_with<K: Kernel>(_backend: Backend, kernel: K) -> K::Output {
    Scalar.run(kernel)
}

/// What every processor has that this is compiled for.
#[inline(always)]
pub(super) fn at_hand() -> impl Simd {
    Scalar
}

/// Nothing.
#[inline(always)]
pub(super) fn prefetch<T>(_what: &T) {}
