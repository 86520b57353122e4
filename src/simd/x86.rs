//! SSE2, AVX2 with FMA, and AVX-512.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::x86_64::*;
use core::mem::MaybeUninit;

use super::{Backend, Kernel, Lanes, Simd, Width, corner, scalar};

/// What this processor and its operating system have. CPUID stops in the hypervisor of a virtual
/// machine, so the answer is kept by [`Backend::current`].
#[allow(unused_unsafe, reason = "reading CPUID is a safe function in newer compilers")]
pub(super) fn detect() -> Backend {
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

/// 128 bits: every x86-64 processor has them.
#[derive(Clone, Copy)]
pub(super) struct Sse2;

/// Proof that this processor runs AVX2 and FMA.
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

/// Proof that this processor runs AVX-512 F, VL, DQ and BW.
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

impl Avx2 {
    /// # Safety
    ///
    /// The processor has AVX2 and FMA.
    pub unsafe fn assume() -> Self {
        Avx2(())
    }
}

impl Avx512 {
    /// # Safety
    ///
    /// The processor has AVX-512 F, VL, DQ and BW, and so AVX2 and FMA.
    pub unsafe fn assume() -> Self {
        Avx512(())
    }
}

/// Four lanes of SSE2.
#[derive(Clone, Copy)]
pub(super) struct F4(__m128);
/// Eight lanes of AVX2: such a value is made from a token, so the instructions exist.
#[derive(Clone, Copy)]
pub(super) struct F8(__m256);
/// Sixteen lanes of AVX-512: as above.
#[derive(Clone, Copy)]
pub(super) struct F16(__m512);
/// Two vectors side by side, the lower lanes first.
#[derive(Clone, Copy)]
pub(super) struct Two<V>(V, V);

/// An operation of one instruction.
macro_rules! one {
    ($self:ident $(, $other:ident)? => $instruction:ident) => {
        // SAFETY: a value of this type proves that its instructions exist.
        Self(unsafe { $instruction($self.0 $(, $other.0)?) })
    };
}

macro_rules! arithmetic {
    ($add:ident $sub:ident $mul:ident $div:ident $min:ident $max:ident) => {
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            one!(self, other => $add)
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            one!(self, other => $sub)
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            one!(self, other => $mul)
        }

        #[inline(always)]
        fn div(self, other: Self) -> Self {
            one!(self, other => $div)
        }

        // These two return their second operand when either is a NaN, and for zeros of two signs.
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            one!(self, other => $min)
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            one!(self, other => $max)
        }
    };
}

/// `compress` without an instruction for it.
macro_rules! compress_by_hand {
    ($n:literal) => {
        #[inline(always)]
        fn compress(self, mask: u32, out: &mut [MaybeUninit<f32>; $n]) {
            let mut lanes = [0.0; $n];
            self.store(&mut lanes);
            scalar::compress(&lanes, mask, out);
        }
    };
}

impl Lanes<4> for F4 {
    arithmetic!(_mm_add_ps _mm_sub_ps _mm_mul_ps _mm_div_ps _mm_min_ps _mm_max_ps);
    compress_by_hand!(4);

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn flipped_by(self, sign: Self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_xor_ps(self.0, _mm_and_ps(_mm_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        // SAFETY: SSE2 is there.
        F4(unsafe { _mm_or_ps(self.0, _mm_and_ps(_mm_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn fast_mul_sub(self, factor: Self, other: Self) -> Self {
        self.mul(factor).sub(other)
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: SSE2 is there.
        unsafe { _mm_movemask_ps(_mm_cmplt_ps(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        // SAFETY: SSE2 is there.
        unsafe { _mm_movemask_ps(_mm_cmple_ps(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 4]) {
        // SAFETY: `out` has room for four floats.
        unsafe { _mm_storeu_ps(out.as_mut_ptr(), self.0) }
    }
}

impl Lanes<8> for F8 {
    arithmetic!(_mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_min_ps _mm256_max_ps);
    compress_by_hand!(8);

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
    fn less(self, other: Self) -> u32 {
        // SAFETY: a value of this type proves AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        // SAFETY: a value of this type proves AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn store(self, out: &mut [f32; 8]) {
        // SAFETY: `out` has room for eight floats.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) }
    }
}

impl Lanes<16> for F16 {
    arithmetic!(_mm512_add_ps _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_min_ps _mm512_max_ps);

    #[inline(always)]
    fn abs(self) -> Self {
        one!(self => _mm512_abs_ps)
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

macro_rules! both {
    ($($name:ident)*) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Two(self.0.$name(other.0), self.1.$name(other.1))
            }
        )*
    };
}

macro_rules! two {
    ($n:literal of $half:literal) => {
        impl<V: Lanes<$half>> Lanes<$n> for Two<V> {
            both!(add sub mul div min max flipped_by with_sign_of);
            compress_by_hand!($n);

            #[inline(always)]
            fn abs(self) -> Self {
                Two(self.0.abs(), self.1.abs())
            }

            #[inline(always)]
            fn fast_mul_sub(self, factor: Self, other: Self) -> Self {
                let low = self.0.fast_mul_sub(factor.0, other.0);
                Two(low, self.1.fast_mul_sub(factor.1, other.1))
            }

            #[inline(always)]
            fn less(self, other: Self) -> u32 {
                self.0.less(other.0) | self.1.less(other.1) << $half
            }

            #[inline(always)]
            fn less_or_equal(self, other: Self) -> u32 {
                self.0.less_or_equal(other.0) | self.1.less_or_equal(other.1) << $half
            }

            #[inline(always)]
            fn store(self, out: &mut [f32; $n]) {
                let ([low, high], _) = out.as_chunks_mut::<$half>() else { return };
                self.0.store(low);
                self.1.store(high);
            }
        }
    };
}

two!(8 of 4);
two!(16 of 8);

/// The halves of an array.
fn halves<const N: usize, const HALF: usize>(lanes: &[f32; N]) -> [&[f32; HALF]; 2] {
    const { assert!(N == 2 * HALF) }
    // SAFETY: the array is `2 * HALF` floats, and arrays of floats are aligned as floats.
    unsafe { [&*lanes.as_ptr().cast(), &*lanes.as_ptr().add(HALF).cast()] }
}

macro_rules! width {
    ($backend:ident $n:literal $v:ident $splat:ident $load:ident) => {
        impl Width<$n> for $backend {
            type V = $v;

            #[inline(always)]
            fn splat(self, x: f32) -> $v {
                // SAFETY: the token proves that the instruction exists.
                $v(unsafe { $splat(x) })
            }

            #[inline(always)]
            fn load(self, lanes: &[f32; $n]) -> $v {
                // SAFETY: as above, and the array has the lanes.
                $v(unsafe { $load(lanes.as_ptr()) })
            }

            #[inline(always)]
            fn compress_words(
                self,
                mask: u32,
                words: &[u32; $n],
                out: &mut [MaybeUninit<u32>; $n],
            ) {
                self.compress_all(mask, words, out);
            }
        }
    };
}

/// A width of two narrower vectors.
macro_rules! doubled {
    ($backend:ident $n:literal of $half:literal $v:ty) => {
        impl Width<$n> for $backend {
            type V = Two<$v>;

            #[inline(always)]
            fn splat(self, x: f32) -> Two<$v> {
                let half = Width::<$half>::splat(self, x);
                Two(half, half)
            }

            #[inline(always)]
            fn load(self, lanes: &[f32; $n]) -> Two<$v> {
                let [low, high] = halves::<$n, $half>(lanes);
                Two(self.load(low), self.load(high))
            }

            #[inline(always)]
            fn compress_words(
                self,
                mask: u32,
                words: &[u32; $n],
                out: &mut [MaybeUninit<u32>; $n],
            ) {
                self.compress_all(mask, words, out);
            }
        }
    };
}

width!(Sse2 4 F4 _mm_set1_ps _mm_loadu_ps);
doubled!(Sse2 8 of 4 F4);
doubled!(Sse2 16 of 8 Two<F4>);
width!(Avx2 4 F4 _mm_set1_ps _mm_loadu_ps);
width!(Avx2 8 F8 _mm256_set1_ps _mm256_loadu_ps);
doubled!(Avx2 16 of 8 F8);
width!(Avx512 4 F4 _mm_set1_ps _mm_loadu_ps);
width!(Avx512 8 F8 _mm256_set1_ps _mm256_loadu_ps);
width!(Avx512 16 F16 _mm512_set1_ps _mm512_loadu_ps);

/// How a backend compresses words: one after the other unless it says otherwise.
trait CompressWords: Copy {
    #[inline(always)]
    fn compress_all<const N: usize>(
        self,
        mask: u32,
        words: &[u32; N],
        out: &mut [MaybeUninit<u32>; N],
    ) {
        scalar::compress(words, mask, out);
    }
}

impl CompressWords for Sse2 {}
impl CompressWords for Avx2 {}
impl CompressWords for Avx512 {
    #[inline(always)]
    fn compress_all<const N: usize>(
        self,
        mask: u32,
        words: &[u32; N],
        out: &mut [MaybeUninit<u32>; N],
    ) {
        // SAFETY: the token proves AVX-512 F and VL; both arrays have N words, whichever N it is.
        unsafe {
            let (from, to) = (words.as_ptr().cast(), out.as_mut_ptr().cast());
            match N {
                16 => {
                    let front =
                        _mm512_maskz_compress_epi32(mask as __mmask16, _mm512_loadu_si512(from));
                    _mm512_storeu_si512(to, front);
                }
                8 => {
                    let all = _mm256_loadu_si256(from.cast());
                    let front = _mm256_maskz_compress_epi32(mask as __mmask8, all);
                    _mm256_storeu_si256(to.cast(), front);
                }
                _ => scalar::compress(words, mask, out),
            }
        }
    }
}

impl Simd for Sse2 {
    const FEW: u32 = 3;

    #[inline(always)]
    fn corners(self, table: Two<Two<F4>>, list: &[u8; 8]) -> Two<Two<F4>> {
        let mut lanes = [0.0; 16];
        table.store(&mut lanes);
        self.load(&core::array::from_fn::<f32, 16, _>(|i| lanes[corner(list, i)]))
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
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

/// How far the numbers of eight lanes, the first four bytes for even ones, are to be shifted.
const SHIFTS: [i32; 8] = [0, 0, 4, 4, 8, 8, 12, 12];

impl Simd for Avx2 {
    const FEW: u32 = 0;

    #[inline(always)]
    fn corners(self, table: Two<F8>, list: &[u8; 8]) -> Two<F8> {
        // SAFETY: the token proves AVX2.
        unsafe {
            let all = _mm256_set1_epi64x(i64::from_le_bytes(*list));
            let shifts = _mm256_loadu_si256(SHIFTS.as_ptr().cast());
            let low = _mm256_srlv_epi32(all, shifts);
            let high = _mm256_srlv_epi32(all, _mm256_add_epi32(shifts, _mm256_set1_epi32(16)));
            Two(pick(table, low), pick(table, high))
        }
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn with<K: Kernel>(s: Avx2, kernel: K) -> K::Output {
            kernel.run(s)
        }
        // SAFETY: the token proves AVX2 and FMA; processors with these have the rest, which is
        // checked where the token is made.
        unsafe { with(self, kernel) }
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
