//! The axes of space by name, of which compilers know that there are no others.

/// An axis: what is indexed by one needs no check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Axis {
    X = 0,
    Y = 1,
    Z = 2,
}

impl Axis {
    /// The axes x, y and depth of a space whose depth is along this one: an even permutation.
    #[inline(always)]
    pub fn as_depth(self) -> [Axis; 3] {
        match self {
            Axis::X => [Axis::Y, Axis::Z, Axis::X],
            Axis::Y => [Axis::Z, Axis::X, Axis::Y],
            Axis::Z => [Axis::X, Axis::Y, Axis::Z],
        }
    }
}
