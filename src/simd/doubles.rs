//! Doubles side by side: what is computed for one is computed for several by the same operations.

/// One double, four or eight.
pub(crate) trait Doubles: Copy {
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// Each of them times `factor`.
    fn times(self, factor: f64) -> Self;
    fn abs(self) -> Self;
    fn neg(self) -> Self;
    /// One bit for each lane in which `self < other`, the first the lowest; none for NaN.
    fn less(self, other: Self) -> u32;
}

/// Eight doubles as two halves of four: three numbers each, and one beside them.
pub(crate) trait Halves: Doubles {
    /// The first, the second and the third number of each half, each in all of its lanes.
    fn spread(self) -> [Self; 3];
    /// With what is beside the first three in `first`, and with `second` beside the other three.
    fn beside(self, first: Self, second: f64) -> Self;
}

impl Doubles for f64 {
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self / other
    }

    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        self * factor
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::from_bits(self.to_bits() & !(1 << 63))
    }

    #[inline(always)]
    fn neg(self) -> Self {
        -self
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        u32::from(self < other)
    }
}

macro_rules! each {
    ($($name:ident)*) => {
        $(
            fn $name(self, other: Self) -> Self {
                core::array::from_fn(|i| self[i].$name(other[i]))
            }
        )*
    };
}

/// Portable: the definition of the others.
impl<const N: usize> Doubles for [f64; N] {
    each!(add sub mul div);

    fn times(self, factor: f64) -> Self {
        self.map(|x| x * factor)
    }

    fn abs(self) -> Self {
        self.map(Doubles::abs)
    }

    fn neg(self) -> Self {
        self.map(|x| -x)
    }

    fn less(self, other: Self) -> u32 {
        (0..N).fold(0, |bits, i| bits | self[i].less(other[i]) << i)
    }
}

impl Halves for [f64; 8] {
    fn spread(self) -> [Self; 3] {
        [0, 1, 2].map(|k| core::array::from_fn(|i| self[i / 4 * 4 + k]))
    }

    fn beside(self, first: Self, second: f64) -> Self {
        let [a, b, c, _, d, e, f, _] = self;
        [a, b, c, first[3], d, e, f, second]
    }
}

/// Four doubles: the three numbers of a vector, and one beside it.
pub(crate) trait Quad: Doubles {
    /// Its second, third and first number, and what is beside them.
    fn turned(self) -> Self;
    /// Its third, first and second number, and what is beside them.
    fn turned_back(self) -> Self;
    /// Its first number in all lanes.
    fn first(self) -> Self;
    /// Of each vector the sum of its first two numbers, and of that and the third. What is beside them does not count.
    fn sums(vectors: [Self; 4]) -> Self;
    /// The same of vectors that are turned: of the third number and the first, and of that and the second.
    fn turned_sums(vectors: [Self; 4]) -> Self;
    fn array(self) -> [f64; 4];
}

impl Quad for [f64; 4] {
    fn turned(self) -> Self {
        let [x, y, z, w] = self;
        [y, z, x, w]
    }

    fn turned_back(self) -> Self {
        let [x, y, z, w] = self;
        [z, x, y, w]
    }

    fn first(self) -> Self {
        [self[0]; 4]
    }

    fn sums(vectors: [Self; 4]) -> Self {
        vectors.map(|[x, y, z, _]| x + y + z)
    }

    fn turned_sums(vectors: [Self; 4]) -> Self {
        vectors.map(|[y, z, x, _]| x + y + z)
    }

    fn array(self) -> [f64; 4] {
        self
    }
}

/// The doubles of a backend that has none of its own.
macro_rules! doubles_one_by_one {
    () => {
        type Doubles = [f64; 8];
        type Quad = [f64; 4];

        fn quad(self, floats: &[f32; 4]) -> [f64; 4] {
            floats.map(f64::from)
        }

        fn widened(self, floats: &[f32; 8]) -> [f64; 8] {
            floats.map(f64::from)
        }

        fn narrowed(self, doubles: [f64; 8]) -> [f32; 8] {
            doubles.map(|x| x as f32)
        }

        fn twice(self, four: &[f64; 4]) -> [f64; 8] {
            core::array::from_fn(|i| four[i % 4])
        }
    };
}
