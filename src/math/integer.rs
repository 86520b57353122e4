//! Whole numbers of many words, on the stack.

use core::cmp::Ordering;
use core::ops::{Add, Mul, Neg, Sub};

use super::binary::Binary;
use super::float::power_of_two;

/// A number system in which a formula is evaluated without error.
///
/// `i128` where everything fits, which is nearly always; [`Integer`] for the rest. Whoever chooses one
/// has bounded the results beforehand, so no operation overflows.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// The float `x`, a multiple of `2^unit`, as that multiple; for `i128` it is below `2^63` in size.
    fn count(x: f32, unit: i32) -> Self;

    /// The same number.
    fn of<const WORDS: usize>(number: &Integer<WORDS>) -> Self;

    /// The same number.
    fn to_integer<const WORDS: usize>(self) -> Integer<WORDS>;

    /// The number times `2^by`.
    fn shifted(self, by: u32) -> Self;

    /// The order against zero.
    fn sign(&self) -> Ordering;
}

/// A whole number below `2^(64 WORDS)` in size: a sign, and words of which the lowest is the first.
///
/// Operations touch the words in use and no others. What does not fit is dropped; callers prove that
/// everything fits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Integer<const WORDS: usize> {
    /// Zero from `length` on; the last one in use is not zero.
    words: [u64; WORDS],
    length: usize,
    /// Means nothing when the number is zero.
    negative: bool,
}

impl<const WORDS: usize> Integer<WORDS> {
    /// `mantissa * 2^shift`.
    pub fn scaled(mantissa: i32, shift: u32) -> Self {
        let size = u128::from(mantissa.unsigned_abs()) << (shift % 64);
        let mut words = [0; WORDS];
        let place = shift as usize / 64;
        for (word, part) in words.iter_mut().skip(place).zip([size as u64, (size >> 64) as u64]) {
            *word = part;
        }
        Self::trimmed(words, place + 2, mantissa < 0)
    }

    /// The number of bits of the size: zero for zero.
    pub fn bits(&self) -> u32 {
        match self.used() {
            [.., last] => 64 * self.length as u32 - last.leading_zeros(),
            [] => 0,
        }
    }

    /// The number times `2^exponent` in `f64`, while that is in the normal range.
    ///
    /// Within `1.001 UNIT` of it: the bits below the highest 64 are cut off, and 64 are rounded to 53.
    pub fn approximate(&self, exponent: i32) -> f64 {
        let (high, low) = match *self.used() {
            [.., low, high] => (high, low),
            [high] => (high, 0),
            [] => return 0.0,
        };
        let spare = high.leading_zeros();
        let top = ((u128::from(high) << 64 | u128::from(low)) << spare >> 64) as u64;
        let scale = exponent + 64 * (self.length as i32 - 1) - spare as i32;
        let size = top as f64 * power_of_two(scale);
        if self.negative { -size } else { size }
    }

    /// The number times `2^by`.
    fn moved(&self, by: u32) -> Self {
        let mut words = [0; WORDS];
        shift(self.used(), by, &mut words);
        Self::trimmed(words, by as usize / 64 + self.length + 1, self.negative)
    }

    fn used(&self) -> &[u64] {
        self.words.get(..self.length).unwrap_or(&self.words)
    }

    /// The number of these words, of which the first `most` may not be zero.
    fn trimmed(words: [u64; WORDS], most: usize, negative: bool) -> Self {
        let length = length(&words, most);
        Integer { words, length, negative }
    }

    /// `self` plus the size of `other` with the sign `negative`.
    fn plus(&self, other: &Self, negative: bool) -> Self {
        if self.negative == negative {
            return self.joined(other);
        }
        match self.compare_sizes(other) {
            Ordering::Less => other.reduced(self, negative),
            _ => self.reduced(other, self.negative),
        }
    }

    fn compare_sizes(&self, other: &Self) -> Ordering {
        compare(self.used(), other.used())
    }

    /// The sum of both sizes, with the sign of `self`.
    fn joined(&self, other: &Self) -> Self {
        let mut words = [0; WORDS];
        let most = self.length.max(other.length) + 1;
        add(&self.words, &other.words, most, &mut words);
        Self::trimmed(words, most, self.negative)
    }

    /// The size of `self` less that of `other`, which is not larger.
    fn reduced(&self, other: &Self, negative: bool) -> Self {
        let mut words = [0; WORDS];
        subtract(self.used(), &other.words, &mut words);
        Self::trimmed(words, self.length, negative)
    }
}

// What follows is the same code for numbers of any length. `out` is zero before.

/// The words in use of `words`, of which no more than `most` are.
fn length(words: &[u64], most: usize) -> usize {
    let highest = words.iter().take(most).rposition(|word| *word != 0);
    highest.map_or(0, |place| place + 1)
}

/// `x * 2^by`.
fn shift(x: &[u64], by: u32, out: &mut [u64]) {
    let (place, by) = (by as usize / 64, by % 64);
    let mut carry = 0;
    // One word beyond those in use takes the last carry.
    for (word, x) in out.iter_mut().skip(place).zip(x.iter().chain([&0])) {
        let wide = u128::from(*x) << by;
        *word = wide as u64 | carry;
        carry = (wide >> 64) as u64;
    }
}

fn compare(x: &[u64], y: &[u64]) -> Ordering {
    x.len().cmp(&y.len()).then_with(|| x.iter().rev().cmp(y.iter().rev()))
}

/// `x + y`, which has no more words than `most`.
fn add(x: &[u64], y: &[u64], most: usize, out: &mut [u64]) {
    let mut carry = false;
    for ((word, x), y) in out.iter_mut().zip(x).zip(y).take(most) {
        let (sum, over) = x.overflowing_add(*y);
        let (sum, over_again) = sum.overflowing_add(u64::from(carry));
        (*word, carry) = (sum, over | over_again);
    }
}

/// `x - y`, which is not negative; `y` has as many words as `x` or more.
fn subtract(x: &[u64], y: &[u64], out: &mut [u64]) {
    let mut borrow = false;
    for ((word, x), y) in out.iter_mut().zip(x).zip(y) {
        let (rest, under) = x.overflowing_sub(*y);
        let (rest, under_again) = rest.overflowing_sub(u64::from(borrow));
        (*word, borrow) = (rest, under | under_again);
    }
}

/// `x * y`.
fn multiply(x: &[u64], y: &[u64], out: &mut [u64]) {
    for (i, x) in x.iter().enumerate() {
        // Far exponents leave many words empty.
        if *x == 0 {
            continue;
        }
        let mut carry = 0;
        for (place, y) in out.iter_mut().skip(i).zip(y) {
            let sum = u128::from(*x) * u128::from(*y) + u128::from(*place) + u128::from(carry);
            *place = sum as u64;
            carry = (sum >> 64) as u64;
        }
        if let Some(place) = out.get_mut(i + y.len()) {
            *place = carry;
        }
    }
}

impl<const WORDS: usize> Add for Integer<WORDS> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.plus(&other, other.negative)
    }
}

impl<const WORDS: usize> Sub for Integer<WORDS> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.plus(&other, !other.negative)
    }
}

impl<const WORDS: usize> Neg for Integer<WORDS> {
    type Output = Self;
    fn neg(self) -> Self {
        Integer { negative: !self.negative, ..self }
    }
}

impl<const WORDS: usize> Mul for Integer<WORDS> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let mut words = [0; WORDS];
        multiply(self.used(), other.used(), &mut words);
        let most = self.length + other.length;
        Self::trimmed(words, most, self.negative != other.negative)
    }
}

impl<const WORDS: usize> Number for Integer<WORDS> {
    fn count(x: f32, unit: i32) -> Self {
        let Binary { mantissa, exponent } = Binary::of(x);
        let shift = exponent - unit;
        // A unit larger than the mantissa's last place divides the mantissa.
        Self::scaled(mantissa >> shift.min(0).unsigned_abs().min(31), shift.max(0) as u32)
    }

    fn of<const OTHER: usize>(number: &Integer<OTHER>) -> Self {
        let mut words = [0; WORDS];
        words.iter_mut().zip(number.used()).for_each(|(word, x)| *word = *x);
        Integer { words, length: number.length.min(WORDS), negative: number.negative }
    }

    fn to_integer<const OTHER: usize>(self) -> Integer<OTHER> {
        Integer::of(&self)
    }

    #[inline]
    fn shifted(self, by: u32) -> Self {
        if by == 0 { self } else { self.moved(by) }
    }

    fn sign(&self) -> Ordering {
        match (self.length, self.negative) {
            (0, _) => Ordering::Equal,
            (_, true) => Ordering::Less,
            (_, false) => Ordering::Greater,
        }
    }
}

impl Number for i128 {
    fn count(x: f32, unit: i32) -> Self {
        // The exponent of zero alone may be far away, and zero may be shifted by anything.
        let Binary { mantissa, exponent } = Binary::of(x);
        let (mantissa, shift) = (i64::from(mantissa), exponent - unit);
        let by = shift.unsigned_abs();
        i128::from(if shift < 0 { mantissa.wrapping_shr(by) } else { mantissa.wrapping_shl(by) })
    }

    fn of<const WORDS: usize>(number: &Integer<WORDS>) -> Self {
        let word = |i: usize| number.words.get(i).map_or(0, |word| i128::from(*word));
        let size = word(1) << 64 | word(0);
        if number.negative { -size } else { size }
    }

    fn to_integer<const WORDS: usize>(self) -> Integer<WORDS> {
        let size = self.unsigned_abs();
        let mut words = [0; WORDS];
        let parts = [size as u64, (size >> 64) as u64];
        words.iter_mut().zip(parts).for_each(|(word, part)| *word = part);
        Integer::trimmed(words, 2, self < 0)
    }

    fn shifted(self, by: u32) -> Self {
        self << by
    }

    fn sign(&self) -> Ordering {
        self.cmp(&0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raykern_harness::make::Random;

    type Number5 = Integer<5>;

    fn whole(x: i128) -> Number5 {
        x.to_integer()
    }

    fn power(n: u32) -> Number5 {
        Number5::scaled(1, n)
    }

    fn is(p: Number5, q: Number5) -> bool {
        (p - q).sign() == Ordering::Equal && (q - p).sign() == Ordering::Equal
    }

    #[test]
    fn carries_and_borrows_run_through_all_words() {
        let one = whole(1);
        for n in [1, 63, 64, 65, 127, 128, 200, 256] {
            let ones = power(n) - one;
            assert_eq!((ones.bits(), power(n).bits()), (n, n + 1));
            assert!(is(ones + one, power(n)));
            assert!(is(one - power(n), -ones));
            assert!(is(-one + power(n), ones));
            assert_eq!((ones - ones).bits(), 0);
            assert_eq!((-ones).sign(), Ordering::Less);
            assert_eq!((-(ones - ones)).sign(), Ordering::Equal);
        }
        for n in [31, 32, 64, 100, 128] {
            // (2^n - 1)^2 = 2^2n - 2^(n + 1) + 1: all carries at once.
            let ones = power(n) - one;
            assert!(is(ones * ones, power(2 * n) - power(n + 1) + one));
            assert!(is(ones * -ones, power(n + 1) - power(2 * n) - one));
        }
    }

    #[test]
    fn empty_words_between_full_ones_are_kept() {
        let sparse = power(256) + whole(3);
        assert!(is(sparse * whole(-5), -power(258) - power(256) - whole(15)));
        assert!(is((power(128) + whole(1)) * (power(128) - whole(1)), power(256) - whole(1)));
        assert!(is(sparse - power(256), whole(3)));
        assert_eq!((power(192) - sparse).sign(), Ordering::Less);
    }

    #[test]
    fn small_numbers_are_those_of_i128() {
        let mut random = Random::new(1);
        for round in 0..20_000 {
            let mut number = || (random.bits() as i64 >> random.below(64)) as i128;
            let (x, y) = (number(), number());
            let (p, q) = (whole(x), whole(y));
            assert!(is(p + q, whole(x + y)), "{round}: {x} {y}");
            assert!(is(p - q, whole(x - y)), "{round}: {x} {y}");
            assert!(is(p * q, whole(x * y)), "{round}: {x} {y}");
            assert_eq!((p - q).sign(), x.cmp(&y), "{round}: {x} {y}");
            assert_eq!(i128::of(&(p * q)), x * y, "{round}: {x} {y}");
            let by = random.below(190) as u32;
            assert!(is(p.shifted(by), p * power(by)), "{round}: {x} << {by}");
            assert_eq!(p.approximate(0), x as f64, "{round}: {x}");
        }
    }

    #[test]
    fn sizes_are_close_at_every_length() {
        let third = f64::from(u32::MAX / 3);
        for n in 0..250 {
            let number = whole(i128::from(u32::MAX / 3)).shifted(n);
            assert_eq!(number.approximate(-(n as i32)), third);
            assert_eq!((-number).approximate(-(n as i32) - 40), -third / 2f64.powi(40));
        }
        // What is cut off is worth less than a thousandth of a unit.
        let near = power(200) + power(200 - 53) - whole(1);
        let t = near.approximate(-200);
        assert!((1.0..=1.0 + f64::EPSILON).contains(&t), "{t:e}");
        assert_eq!(Number5::scaled(0, 9).approximate(5), 0.0);
    }

    #[test]
    fn floats_are_counted_in_both_numbers_alike() {
        for x in [1.0, -3.0, 0.0, -0.0, 1e-45, 0.75, 12_582_912.0, f32::MIN_POSITIVE] {
            let unit = if x == 0.0 { 100 } else { Binary::last_place(x) };
            let (long, short) = (Number5::count(x, unit), i128::count(x, unit));
            assert_eq!(short & 1, i128::from(x != 0.0), "{x}");
            assert!(is(long, whole(short)), "{x}");
            let finer = (Number5::count(x, unit - 30), i128::count(x, unit - 30));
            assert!(is(finer.0, whole(finer.1)) && finer.1 == short << 30, "{x}");
        }
        assert_eq!(Number5::count(f32::MAX, -149).bits(), 277);
        assert_eq!(Number5::count(f32::INFINITY, -149).bits(), 278);
    }
}
