//! What the backends' files write most often.

/// Operations of one instruction each.
macro_rules! pairwise {
    ($($name:ident: $instruction:ident;)*) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                // SAFETY: a value of this type proves that its instructions exist.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        )*
    };
}

/// A width of one register, and what it does otherwise than the trait says.
macro_rules! width {
    ($backend:ident $n:literal $v:ident $splat:ident $load:ident $($other:item)*) => {
        impl Width<$n> for $backend {
            type V = $v;

            #[inline(always)]
            fn splat(self, x: f32) -> $v {
                // SAFETY: the token proves that the instruction exists.
                $v(unsafe { $splat(x) })
            }

            #[inline(always)]
            fn load(self, lanes: &[f32; $n]) -> $v {
                // SAFETY: as above, and the array has the lanes.
                $v(unsafe { $load(lanes.as_ptr().cast()) })
            }

            $($other)*
        }
    };
}

/// Operations of a backend that its vector of four, `F4`, has itself.
macro_rules! by_four {
    () => {
        #[inline(always)]
        fn three(self, v: F4) -> F4 {
            v.three()
        }

        #[inline(always)]
        fn largest_of_three(self, v: F4) -> F4 {
            v.largest_of_three()
        }

        #[inline(always)]
        fn least_of_three(self, v: F4) -> F4 {
            v.least_of_three()
        }

        #[inline(always)]
        fn where_less_or_equal(self, a: F4, b: F4, v: F4) -> F4 {
            a.where_less_or_equal(b, v)
        }

        #[inline(always)]
        fn whole(self, v: F4) -> [i32; 4] {
            v.whole()
        }

        #[inline(always)]
        fn floats(self, whole: [i32; 4]) -> F4 {
            F4::from_whole(whole)
        }
    };
}
