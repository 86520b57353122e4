//! Eight doubles, one register of AVX-512 or two of AVX2, and four.

#![allow(
    clippy::multiple_unsafe_ops_per_block,
    reason = "one proof covers all instructions of an operation"
)]

use core::arch::x86_64::*;

use crate::simd::doubles::{Doubles, Halves, Quad};

/// In one register of AVX-512: such a value is made from a token, so the instructions exist.
#[derive(Clone, Copy)]
pub(super) struct D8(__m512d);

/// In two registers of AVX2.
#[derive(Clone, Copy)]
pub(super) struct D44([D4; 2]);

impl D8 {
    /// # Safety
    ///
    /// The processor has AVX-512 F.
    #[inline(always)]
    pub unsafe fn widened(floats: &[f32; 8]) -> Self {
        // SAFETY: the caller's promise; the array has eight floats.
        D8(unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(floats.as_ptr())) })
    }

    /// # Safety
    ///
    /// The processor has AVX-512 F.
    #[inline(always)]
    pub unsafe fn twice(four: &[f64; 4]) -> Self {
        // SAFETY: the caller's promise; the array has four doubles.
        D8(unsafe { _mm512_broadcast_f64x4(_mm256_loadu_pd(four.as_ptr())) })
    }

    #[inline(always)]
    pub fn narrowed(self) -> [f32; 8] {
        let mut floats = [0.0; 8];
        // SAFETY: a value of this type proves AVX-512 F; the array has eight floats.
        unsafe { _mm256_storeu_ps(floats.as_mut_ptr(), _mm512_cvtpd_ps(self.0)) };
        floats
    }
}

impl Doubles for D8 {
    pairwise! {
        add: _mm512_add_pd;
        sub: _mm512_sub_pd;
        mul: _mm512_mul_pd;
        div: _mm512_div_pd;
    }

    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        // SAFETY: a value of this type proves AVX-512 F.
        D8(unsafe { _mm512_mul_pd(self.0, _mm512_set1_pd(factor)) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        D8(unsafe { _mm512_abs_pd(self.0) })
    }

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above, and DQ.
        D8(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }
}

impl Halves for D8 {
    #[inline(always)]
    fn spread(self) -> [Self; 3] {
        // SAFETY: a value of this type proves AVX-512 F.
        unsafe {
            [
                D8(_mm512_permutex_pd::<0x00>(self.0)),
                D8(_mm512_permutex_pd::<0x55>(self.0)),
                D8(_mm512_permutex_pd::<0xAA>(self.0)),
            ]
        }
    }

    #[inline(always)]
    fn beside(self, first: Self, second: f64) -> Self {
        // SAFETY: as above.
        D8(unsafe {
            let one = _mm512_mask_mov_pd(self.0, 1 << 3, first.0);
            _mm512_mask_mov_pd(one, 1 << 7, _mm512_set1_pd(second))
        })
    }
}

/// Operations that are done half by half.
macro_rules! in_halves {
    ($($name:ident)*) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let ([a, b], [c, d]) = (self.0, other.0);
                D44([a.$name(c), b.$name(d)])
            }
        )*
    };
}

impl D44 {
    /// # Safety
    ///
    /// The processor has AVX2.
    #[inline(always)]
    pub unsafe fn widened(floats: &[f32; 8]) -> Self {
        let first = floats.as_ptr();
        // SAFETY: the caller's promise; the array has eight floats.
        D44(unsafe { [D4::from(first), D4::from(first.add(4))] })
    }

    /// # Safety
    ///
    /// The processor has AVX2.
    #[inline(always)]
    pub unsafe fn twice(four: &[f64; 4]) -> Self {
        // SAFETY: the caller's promise; the array has four doubles.
        D44([D4(unsafe { _mm256_loadu_pd(four.as_ptr()) }); 2])
    }

    #[inline(always)]
    pub fn narrowed(self) -> [f32; 8] {
        let (mut floats, [low, high]) = ([0.0; 8], self.0);
        let first: *mut f32 = floats.as_mut_ptr();
        // SAFETY: a value of this type proves AVX2; the array has eight floats.
        unsafe {
            _mm_storeu_ps(first, _mm256_cvtpd_ps(low.0));
            _mm_storeu_ps(first.add(4), _mm256_cvtpd_ps(high.0));
        }
        floats
    }
}

impl Doubles for D44 {
    in_halves!(add sub mul div);

    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        let [low, high] = self.0;
        D44([low.times(factor), high.times(factor)])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        let [low, high] = self.0;
        D44([low.abs(), high.abs()])
    }

    #[inline(always)]
    fn neg(self) -> Self {
        let [low, high] = self.0;
        D44([low.neg(), high.neg()])
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        let ([a, b], [c, d]) = (self.0, other.0);
        a.less(c) | b.less(d) << 4
    }
}

impl Halves for D44 {
    #[inline(always)]
    fn spread(self) -> [Self; 3] {
        let [D4(low), D4(high)] = self.0;
        // SAFETY: a value of this type proves AVX2.
        let [a, b, c, d, e, f] = unsafe {
            [
                _mm256_permute4x64_pd::<0x00>(low),
                _mm256_permute4x64_pd::<0x00>(high),
                _mm256_permute4x64_pd::<0x55>(low),
                _mm256_permute4x64_pd::<0x55>(high),
                _mm256_permute4x64_pd::<0xAA>(low),
                _mm256_permute4x64_pd::<0xAA>(high),
            ]
        };
        [D44([D4(a), D4(b)]), D44([D4(c), D4(d)]), D44([D4(e), D4(f)])]
    }

    #[inline(always)]
    fn beside(self, first: Self, second: f64) -> Self {
        let ([D4(low), D4(high)], [D4(beside), _]) = (self.0, first.0);
        // SAFETY: as above.
        D44(unsafe {
            [
                D4(_mm256_blend_pd::<8>(low, beside)),
                D4(_mm256_blend_pd::<8>(high, _mm256_set1_pd(second))),
            ]
        })
    }
}

/// Four of them, in one register of AVX2: such a value is made from a token, so the instructions exist.
#[derive(Clone, Copy)]
pub(super) struct D4(__m256d);

impl D4 {
    /// # Safety
    ///
    /// The processor has AVX2.
    #[inline(always)]
    pub unsafe fn widened(floats: &[f32; 4]) -> Self {
        // SAFETY: the caller's promise; the array has four floats.
        unsafe { D4::from(floats.as_ptr()) }
    }

    /// # Safety
    ///
    /// The processor has AVX2; there are four floats.
    #[inline(always)]
    unsafe fn from(floats: *const f32) -> Self {
        // SAFETY: the caller's promises.
        D4(unsafe { _mm256_cvtps_pd(_mm_loadu_ps(floats)) })
    }
}

impl Doubles for D4 {
    pairwise! {
        add: _mm256_add_pd;
        sub: _mm256_sub_pd;
        mul: _mm256_mul_pd;
        div: _mm256_div_pd;
    }

    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        // SAFETY: a value of this type proves AVX2.
        D4(unsafe { _mm256_mul_pd(self.0, _mm256_set1_pd(factor)) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        D4(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        D4(unsafe { _mm256_xor_pd(_mm256_set1_pd(-0.0), self.0) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }
}

impl Quad for D4 {
    #[inline(always)]
    fn turned(self) -> Self {
        // SAFETY: a value of this type proves AVX2.
        D4(unsafe { _mm256_permute4x64_pd::<0xC9>(self.0) })
    }

    #[inline(always)]
    fn turned_back(self) -> Self {
        // SAFETY: as above.
        D4(unsafe { _mm256_permute4x64_pd::<0xD2>(self.0) })
    }

    #[inline(always)]
    fn first(self) -> Self {
        // SAFETY: as above.
        D4(unsafe { _mm256_broadcastsd_pd(_mm256_castpd256_pd128(self.0)) })
    }

    #[inline(always)]
    fn sums(vectors: [Self; 4]) -> Self {
        let [x, y, z] = rows(vectors);
        x.add(y).add(z)
    }

    #[inline(always)]
    fn turned_sums(vectors: [Self; 4]) -> Self {
        let [y, z, x] = rows(vectors);
        x.add(y).add(z)
    }

    #[inline(always)]
    fn array(self) -> [f64; 4] {
        let mut array = [0.0; 4];
        // SAFETY: as above; the array has four doubles.
        unsafe { _mm256_storeu_pd(array.as_mut_ptr(), self.0) };
        array
    }
}

/// The first three numbers of four vectors, side by side.
#[inline(always)]
fn rows([a, b, c, d]: [D4; 4]) -> [D4; 3] {
    // SAFETY: a value of this type proves AVX2.
    unsafe {
        let [first, second] = [_mm256_unpacklo_pd(a.0, b.0), _mm256_unpackhi_pd(a.0, b.0)];
        let [third, fourth] = [_mm256_unpacklo_pd(c.0, d.0), _mm256_unpackhi_pd(c.0, d.0)];
        [
            D4(_mm256_permute2f128_pd::<0x20>(first, third)),
            D4(_mm256_permute2f128_pd::<0x20>(second, fourth)),
            D4(_mm256_permute2f128_pd::<0x31>(first, third)),
        ]
    }
}
