//! x86-64: SSE2 always, AVX2 and AVX-512 where [`detect`] finds them.

mod avx2;
mod avx512;
mod detect;
mod doubles;
mod sort;
mod sse2;

pub(super) use detect::detect;

use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

use super::{Backend, Kernel, Scalar, Simd};
use avx2::Avx2;
use avx512::Avx512;
use sse2::Sse2;

/// Runs `kernel` with the instructions of `backend`.
///
/// # Safety
///
/// `backend` is not above what `detect` finds.
#[inline(always)]
pub(super) unsafe fn run_with<K: Kernel>(backend: Backend, kernel: K) -> K::Output {
    match backend {
        Backend::Scalar => Scalar.run(kernel),
        Backend::Bits128 => Sse2.run(kernel),
        // SAFETY: as the caller promises.
        Backend::Avx2 => unsafe { Avx2::assume() }.run(kernel),
        // SAFETY: as above.
        Backend::Avx512 => unsafe { Avx512::assume() }.run(kernel),
    }
}

/// What every processor has that this is compiled for.
#[inline(always)]
pub(super) fn at_hand() -> impl Simd {
    Sse2
}

/// Asks for each cache line of `what`.
#[inline(always)]
pub(super) fn prefetch<T>(what: &T) {
    let first = core::ptr::from_ref(what).cast();
    (0..size_of::<T>().div_ceil(64)).for_each(|line| prefetch_line(first, line));
}

/// Asks for a cache line.
#[inline(always)]
fn prefetch_line(first: *const u8, line: usize) {
    // SAFETY: SSE is part of x86-64, and a prefetch reads nothing.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(first.wrapping_add(64 * line).cast()) };
}
