//! Floats taken apart.

/// A float taken apart: `mantissa * 2^exponent`.
///
/// Finite floats are multiples of `2^-149` below `2^128`. Infinity and NaN, from a block of foreign
/// bytes, are read as their bits say, as numbers below `2^129`, so that nothing here lacks meaning.
#[derive(Clone, Copy)]
pub(crate) struct Binary {
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

    /// The largest exponent with which the mantissa is still whole; of zero, the largest number.
    pub fn last_place(self) -> i32 {
        match self.mantissa {
            0 => i32::MAX,
            mantissa => self.exponent + mantissa.trailing_zeros() as i32,
        }
    }
}
