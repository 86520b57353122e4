//! Floats taken apart.

/// A float taken apart: `mantissa * 2^exponent`.
///
/// Finite floats are multiples of `2^-149` below `2^128`. Infinity and NaN, from a block of foreign
/// bytes, are read as their bits say, as numbers below `2^129`, so that nothing here lacks meaning.
#[derive(Clone, Copy, Debug)]
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

    /// The exponent of the last bit of `x` that is set; of zero, the largest number.
    #[inline]
    pub fn last_place(x: f32) -> i32 {
        let bits = x.to_bits();
        let field = (bits >> 23 & 0xff) as i32;
        // Above the bits of the mantissa stands the hidden one, or for the least exponent one that
        // is only seen when the mantissa is zero.
        let zeros = (bits & 0x7f_ffff | 0x80_0000).trailing_zeros() as i32;
        if x == 0.0 { i32::MAX } else { field.max(1) - 150 + zeros }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(x: Binary) -> f64 {
        f64::from(x.mantissa) * 2f64.powi(x.exponent)
    }

    #[test]
    fn parts_make_the_float() {
        for x in [0.0, 1.0, -1.5, 1e-45, -f32::MIN_POSITIVE, f32::MAX, 0.1] {
            assert_eq!(value(Binary::of(x)), f64::from(x));
            if x != 0.0 {
                let odd = f64::from(x) / 2f64.powi(Binary::last_place(x));
                assert_eq!(odd.rem_euclid(2.0), 1.0, "{x}");
            }
        }
        assert_eq!(value(Binary::of(f32::NEG_INFINITY)), -(2f64.powi(128)));
        assert_eq!(Binary::last_place(-0.0), i32::MAX);
    }

    #[test]
    fn middles_lie_between_neighbours() {
        for x in [0.0, 1.0, -1.0, 1e-45, -1e-45, f32::MIN_POSITIVE.next_down(), 1f32.next_down()] {
            let middle = (f64::from(x) + f64::from(x.next_up())) / 2.0;
            assert_eq!(value(Binary::middle_above(x)), middle, "{x}");
        }
        let end = 2f64.powi(128) - 2f64.powi(103);
        assert_eq!(value(Binary::middle_above(f32::MAX)), end);
        assert_eq!(value(Binary::middle_above(f32::NEG_INFINITY)), -end);
    }
}
