//! Floats as whole numbers of a common unit.

use crate::math::binary::Binary;
use crate::math::integer::{Integer, Number};

/// The largest unit `2^exponent` of which all floats of a set are multiples, and the number of bits
/// that the largest of them has in it.
#[derive(Clone, Copy)]
pub(super) struct Unit {
    pub exponent: i32,
    pub bits: u32,
}

impl Unit {
    /// The unit of these floats; of zeros alone, one of no bits. With infinity or NaN among them it is
    /// given as many bits as all floats together need, so that it is never taken for short.
    pub fn of(points: &[[f32; 3]]) -> Self {
        let (mut lowest, mut largest) = (i32::MAX, 0);
        for x in points.as_flattened() {
            lowest = lowest.min(Binary::last_place(*x));
            // The bits of floats are in the order of their sizes, NaN at the end.
            largest = largest.max(x.abs().to_bits());
        }
        let largest = f32::from_bits(largest);
        let Binary { mantissa, exponent } = Binary::of(largest);
        let end = exponent + 32 - mantissa.leading_zeros() as i32;
        match mantissa {
            0 => Unit { exponent: 0, bits: 0 },
            _ if largest.is_finite() => Unit { exponent: lowest, bits: (end - lowest) as u32 },
            _ => Unit { exponent: lowest, bits: 278 },
        }
    }

    /// A point in whole numbers of units.
    #[inline]
    pub fn count<N: Number>(self, [x, y, z]: [f32; 3]) -> [N; 3] {
        let count = |x| N::count(x, self.exponent);
        [count(x), count(y), count(z)]
    }
}

/// The units of a line and what it meets: of points, which scale `t` one way, and of the direction,
/// which scales it the other way.
#[derive(Clone, Copy)]
pub(super) struct Units {
    pub space: Unit,
    pub ahead: Unit,
}

impl Units {
    /// The bits of what is below `2^(space s + ahead d + more)`, and at least twice those of a coordinate,
    /// so that what is said to fit `i128` can be counted in half of it.
    pub fn bits(self, space: u32, ahead: u32, more: u32) -> u32 {
        let (s, d) = (self.space.bits, self.ahead.bits);
        (space * s + ahead * d + more).max(2 * s).max(2 * d)
    }

    /// The exponent of the unit of `t`.
    pub fn of_t(self) -> i32 {
        self.space.exponent - self.ahead.exponent
    }
}

/// Whether formulas are compiled for short numbers as well. They take a fraction of the time; but on a processor of 32 bits
/// `i128` is slow itself, and three copies of the code are more than all the rest of a query.
pub(super) const SHORT: bool = cfg!(target_pointer_width = "64");

/// A name for `Integer<6>`, which nearly everything fits that `i128` does not.
pub(super) type Medium = Integer<6>;

/// The value of a formula, a generic function, in the shortest numbers that hold `bits` bits.
macro_rules! in_shortest {
    ($bits:expr, $long:ty, $formula:ident($($argument:expr),*)) => {
        match $bits {
            0..128 if $crate::exact::units::SHORT => $formula::<i128>($($argument),*),
            128..=384 if $crate::exact::units::SHORT => {
                $formula::<$crate::exact::units::Medium>($($argument),*)
            }
            _ => $formula::<$long>($($argument),*),
        }
    };
}
pub(super) use in_shortest;

pub(super) fn minus<N: Number>(p: &[N; 3], q: &[N; 3]) -> [N; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

pub(super) fn cross<N: Number>(p: &[N; 3], q: &[N; 3]) -> [N; 3] {
    let minor = |i: usize, j: usize| p[i] * q[j] - p[j] * q[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

pub(super) fn dot<N: Number>(p: &[N; 3], q: &[N; 3]) -> N {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}
