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
