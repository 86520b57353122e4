//! The bits of a word, one after the other.

/// The numbers of the bits that are set, from the lowest.
pub(crate) struct Bits(pub u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let number = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (number < 32).then_some(number as usize)
    }
}
