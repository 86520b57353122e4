//! Sums of products of three floats without error, in fixed point: little code and little stack, for processors of 32 bits.

use core::cmp::Ordering;

use super::binary::Binary;
use super::float::power_of_two;

/// The last place: that of the product of three of the least floats.
const LAST: i32 = 3 * -149;

/// A sum of up to 24 products of three floats, a multiple of `2^-447` below `2^392`, whatever the bits of the floats.
///
/// ```text
/// word | 0            | 1            | .. | 26          |
///      | from 2^-447  | from 2^-415  | .. | .. and sign |     two's complement
/// ```
#[derive(Clone, Copy)]
pub(crate) struct Fixed {
    words: [u32; 27],
    /// Words in use: those beyond are zero, and stand for the sign of the last one in use.
    length: usize,
}

impl Fixed {
    pub const ZERO: Self = Fixed { words: [0; 27], length: 0 };

    /// Adds `x`, whose exponent is -447 at least.
    pub fn add_float(&mut self, x: Binary) {
        self.add(u64::from(x.mantissa.unsigned_abs()), 1, x.exponent, x.mantissa < 0);
    }

    /// Adds the product of three floats, or subtracts it.
    #[inline(never)]
    pub fn add_product(&mut self, x: &f32, y: &f32, z: &f32, minus: bool) {
        let (x, y, z) = (Binary::of(*x), Binary::of(*y), Binary::of(*z));
        let minus = minus ^ ((x.mantissa ^ y.mantissa ^ z.mantissa) < 0);
        let size = u64::from(x.mantissa.unsigned_abs()) * u64::from(y.mantissa.unsigned_abs());
        let exponent = x.exponent + y.exponent + z.exponent;
        self.add(size, z.mantissa.unsigned_abs(), exponent, minus);
    }

    /// Adds `p * q * 2^exponent`, or subtracts it.
    #[inline(never)]
    fn add(&mut self, p: u64, q: u32, exponent: i32, minus: bool) {
        let low = (p & WORD) * u64::from(q);
        let high = (p >> 32) * u64::from(q) + (low >> 32);
        let size = [low as u32, high as u32, (high >> 32) as u32];
        let shift = (exponent - LAST) as u32;
        let (place, by) = (shift as usize / 32, shift % 32);
        // The product's 72 bits and those of the shift, five for sums of 24 of them, and the sign.
        self.lengthen(place + 4);
        // Less a number is plus its flipped bits and one.
        let (flip, mut carry) = (if minus { u32::MAX } else { 0 }, minus);
        let mut below = 0;
        let words = self.words.iter_mut().take(self.length).skip(place);
        for (i, word) in words.enumerate() {
            let part = size.get(i).copied().unwrap_or(0);
            let shifted = part << by | below >> 1 >> (31 - by);
            below = part;
            let (sum, over) = word.overflowing_add(shifted ^ flip);
            let (sum, over_again) = sum.overflowing_add(u32::from(carry));
            (*word, carry) = (sum, over | over_again);
            // Then nothing changes any more.
            if i >= 3 && carry == minus {
                break;
            }
        }
    }

    /// Takes words into use, so that there are `length` at least.
    fn lengthen(&mut self, length: usize) {
        let is_negative = is_negative(self.used());
        while self.length < length.min(27) {
            if is_negative && let Some(word) = self.words.get_mut(self.length) {
                *word = u32::MAX;
            }
            self.length += 1;
        }
    }

    fn used(&self) -> &[u32] {
        self.words.get(..self.length).unwrap_or(&self.words)
    }

    /// The order against zero.
    pub fn sign(&self) -> Ordering {
        sign(self.used())
    }

    /// Becomes its size; its order against zero before.
    pub fn take_sign(&mut self) -> Ordering {
        let sign = self.sign();
        if sign == Ordering::Less {
            let mut carry = true;
            for word in self.words.iter_mut().take(self.length) {
                (*word, carry) = (!*word).overflowing_add(u32::from(carry));
            }
        }
        sign
    }

    /// The number in `f64`, within `1.001 UNIT` of it: the bits below the highest 64 are cut off, and 64 are rounded to 53.
    /// It becomes its size.
    pub fn approximate(&mut self) -> f64 {
        let sign = self.take_sign();
        let Some(highest) = self.words.iter().rposition(|word| *word != 0) else { return 0.0 };
        let word = |below: usize| match highest.checked_sub(below) {
            Some(place) => self.words.get(place).map_or(0, |word| u64::from(*word)),
            None => 0,
        };
        let spare = word(0).leading_zeros() - 32;
        let top = (word(0) << 32 | word(1)) << spare | word(2) << spare >> 32;
        let x = top as f64 * power_of_two(LAST + 32 * (highest as i32 - 1) - spare as i32);
        if sign == Ordering::Less { -x } else { x }
    }
}

const WORD: u64 = u32::MAX as u64;

fn is_negative(words: &[u32]) -> bool {
    words.last().is_some_and(|last| last >> 31 != 0)
}

/// The order against zero of a number in two's complement.
fn sign(words: &[u32]) -> Ordering {
    match () {
        () if is_negative(words) => Ordering::Less,
        () if words.iter().all(|word| *word == 0) => Ordering::Equal,
        () => Ordering::Greater,
    }
}

/// A difference of products of two sums, a multiple of `2^-894`, in two's complement.
pub(crate) struct Product {
    words: [u32; 54],
}

impl Product {
    pub const ZERO: Self = Product { words: [0; 54] };

    /// Adds `x * y`, neither negative.
    #[inline(never)]
    pub fn add(&mut self, x: &Fixed, y: &Fixed) {
        for (i, x) in x.used().iter().enumerate() {
            // Most words of both are empty.
            if *x == 0 {
                continue;
            }
            let mut carry = 0;
            let mut rest = y.used().iter();
            for word in self.words.iter_mut().skip(i) {
                let y = rest.next();
                if y.is_none() && carry == 0 {
                    break;
                }
                let y = y.copied().unwrap_or(0);
                let sum = u64::from(*x) * u64::from(y) + u64::from(*word) + carry;
                *word = sum as u32;
                carry = sum >> 32;
            }
        }
    }

    /// The order against zero.
    pub fn sign(&self) -> Ordering {
        sign(&self.words)
    }

    /// Flips all bits.
    pub fn flip(&mut self) {
        for word in &mut self.words {
            *word = !*word;
        }
    }
}
