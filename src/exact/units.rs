//! Floats as whole numbers of a common unit.

use crate::math::integer::Number;

/// A float taken apart: `mantissa * 2^exponent`.
///
/// Finite floats are multiples of `2^-149` below `2^128`. Infinity and NaN, from a block of foreign
/// bytes, are read as their bits say, as numbers below `2^129`, so that nothing here lacks meaning.
#[derive(Clone, Copy)]
pub(super) struct Binary {
    pub mantissa: i32,
    pub exponent: i32,
}

impl Binary {
    /// The parts as they are stored: a mantissa of 24 bits, whatever its last ones are.
    pub fn of(x: f32) -> Self {
        let bits = x.to_bits();
        let (field, fraction) = ((bits >> 23 & 0xff) as i32, (bits & 0x7f_ffff) as i32);
        let size = if field == 0 { fraction } else { fraction | 0x80_0000 };
        let mantissa = if x.is_sign_negative() { -size } else { size };
        Binary { mantissa, exponent: field.max(1) - 150 }
    }

    /// The middle of `x` and the next float above. Above the largest float that is `2^128`, as which
    /// infinity counts in rounding.
    pub fn middle_above(x: f32) -> Self {
        let (x, y) = (Self::of(x), Self::of(x.next_up()));
        let exponent = x.exponent.min(y.exponent);
        // The exponents of neighbours differ by one at most.
        let mantissa = |z: Binary| z.mantissa << (z.exponent - exponent);
        Binary { mantissa: mantissa(x) + mantissa(y), exponent: exponent - 1 }
    }

    /// The same number with an odd mantissa, so that the unit is as large as can be; zero as it is.
    fn reduced(self) -> Self {
        let spare = if self.mantissa == 0 { 0 } else { self.mantissa.trailing_zeros() };
        Binary { mantissa: self.mantissa >> spare, exponent: self.exponent + spare as i32 }
    }
}

/// The largest unit `2^exponent` of which all floats of a set are multiples, and the number of bits
/// that the largest of them has in it.
#[derive(Clone, Copy)]
pub(super) struct Unit {
    pub exponent: i32,
    pub bits: u32,
}

impl Unit {
    /// The unit of these floats; of zeros alone, one of no bits.
    pub fn of(points: &[[f32; 3]]) -> Self {
        let (mut lowest, mut end) = (i32::MAX, i32::MIN);
        for x in points.as_flattened() {
            let Binary { mantissa, exponent } = Binary::of(*x);
            if mantissa != 0 {
                lowest = lowest.min(exponent + mantissa.trailing_zeros() as i32);
                end = end.max(exponent + 32 - mantissa.unsigned_abs().leading_zeros() as i32);
            }
        }
        if lowest > end {
            return Unit { exponent: 0, bits: 0 };
        }
        Unit { exponent: lowest, bits: (end - lowest) as u32 }
    }

    /// One of the floats as a whole number of units.
    pub fn count<N: Number>(self, x: f32) -> N {
        let Binary { mantissa, exponent } = Binary::of(x).reduced();
        // Zero alone may have an exponent below the unit's.
        N::scaled(mantissa, (exponent - self.exponent).max(0) as u32 * u32::from(mantissa != 0))
    }

    /// [`count`](Self::count) for each coordinate.
    pub fn vector<N: Number>(self, point: [f32; 3]) -> [N; 3] {
        point.map(|x| self.count(x))
    }

    /// The vector from `q` to `p`: one bit more.
    pub fn difference<N: Number>(self, p: [f32; 3], q: [f32; 3]) -> [N; 3] {
        [0, 1, 2].map(|k| self.count::<N>(p[k]) - self.count::<N>(q[k]))
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
    /// The exponent of the unit of `t`.
    pub fn of_t(self) -> i32 {
        self.space.exponent - self.ahead.exponent
    }
}

/// Whether whole numbers below `2^bits` fit `i128`.
pub(super) fn is_short(bits: u32) -> bool {
    bits < 128
}

pub(super) fn cross<N: Number>(p: &[N; 3], q: &[N; 3]) -> [N; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| p[i] * q[j] - p[j] * q[i])
}

pub(super) fn dot<N: Number>(p: &[N; 3], q: &[N; 3]) -> N {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}
