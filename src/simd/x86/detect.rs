//! What this processor and its operating system have.

use core::arch::x86_64::*;

use crate::simd::Backend;

/// The best backend there is. CPUID stops in the hypervisor of a virtual
/// machine, so the answer is kept by [`Backend::current`].
#[allow(unused_unsafe, reason = "reading CPUID is a safe function in newer compilers")]
pub(in crate::simd) fn detect() -> Backend {
    let bit = |word: u32, n: u32| word >> n & 1 == 1;
    // SAFETY: every x86-64 processor has CPUID, and leaf 0 tells which leaves there are.
    let leaves = unsafe { __cpuid(0) }.eax;
    if leaves < 7 {
        return Backend::Bits128;
    }
    // SAFETY: leaf 1 exists.
    let basic = unsafe { __cpuid(1) };
    // SAFETY: leaf 7 exists.
    let extended = unsafe { __cpuid_count(7, 0) };
    // FMA, POPCNT, XGETBV, AVX; of the other leaf BMI1 and BMI2; LZCNT.
    let basics = [12, 23, 27, 28].iter().all(|n| bit(basic.ecx, *n));
    // SAFETY: leaf 0x80000000 exists everywhere, and 0x80000001 on all 64-bit processors.
    let lzcnt = bit(unsafe { __cpuid(0x8000_0001) }.ecx, 5);
    if !(basics && bit(extended.ebx, 3) && bit(extended.ebx, 8) && lzcnt) {
        return Backend::Bits128;
    }
    // SAFETY: bit 27 says that the operating system has enabled XGETBV.
    let saved = unsafe { extended_control() };
    let (ymm, zmm) = (saved & 0x06 == 0x06, saved & 0xe6 == 0xe6);
    let avx2 = bit(extended.ebx, 5);
    // F, DQ, BW, VL.
    let avx512 = [16, 17, 30, 31].iter().all(|n| bit(extended.ebx, *n));
    match (ymm && avx2, zmm && avx512) {
        (true, true) => Backend::Avx512,
        (true, false) => Backend::Avx2,
        _ => Backend::Bits128,
    }
}

/// Which registers the operating system saves.
///
/// # Safety
///
/// CPUID says that XGETBV is there.
#[target_feature(enable = "xsave")]
unsafe fn extended_control() -> u64 {
    // SAFETY: register 0 always exists; the rest is the caller's promise.
    unsafe { _xgetbv(0) }
}
