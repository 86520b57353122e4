//! Two vectors as one of twice the lanes, for widths that a backend has no register for.

use super::Lanes;

/// Two vectors side by side, the lower lanes first.
#[derive(Clone, Copy)]
pub(super) struct Two<V>(pub V, pub V);

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
            fn fast_mul_add(self, factor: Self, other: Self) -> Self {
                let low = self.0.fast_mul_add(factor.0, other.0);
                Two(low, self.1.fast_mul_add(factor.1, other.1))
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
#[allow(clippy::multiple_unsafe_ops_per_block, reason = "one proof covers both halves")]
pub(super) fn halves<const N: usize, const HALF: usize>(lanes: &[f32; N]) -> [&[f32; HALF]; 2] {
    const { assert!(N == 2 * HALF) }
    // SAFETY: the array is `2 * HALF` floats, and arrays of floats are aligned as floats.
    unsafe { [&*lanes.as_ptr().cast(), &*lanes.as_ptr().add(HALF).cast()] }
}

/// A width of two narrower vectors, and what it does otherwise than the trait says.
macro_rules! doubled {
    ($backend:ident $n:literal of $half:literal $v:ty $(, $($other:item)*)?) => {
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

            $($($other)*)?
        }
    };
}
