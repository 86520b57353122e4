//! Vector instructions, and the choice of them: the only place that knows a processor.
//!
//! A *backend* is a token that can only be made where its instructions exist; vectors come from tokens, so
//! whatever holds one may use them, and kernels are safe. Every operation means what [`Scalar`] does, special
//! values included, so all backends compute the same bits.

#![allow(unsafe_code, reason = "vector instructions are functions that need them")]

#[macro_use]
#[allow(unused_macros, reason = "not every processor has vectors")]
mod macros;
#[macro_use]
#[allow(unused_macros, dead_code, reason = "as above")]
mod doubled;
#[macro_use]
mod doubles;
/// What this processor has: `detect` and `run_with`. With `--cfg raykern_portable` nothing but [`Scalar`], which compiles
/// in a fraction of the time.
#[cfg_attr(all(not(raykern_portable), target_arch = "x86_64"), path = "x86/mod.rs")]
#[cfg_attr(
    all(
        not(raykern_portable),
        target_arch = "aarch64",
        target_feature = "neon",
        target_endian = "little"
    ),
    path = "neon.rs"
)]
#[cfg_attr(
    all(not(raykern_portable), target_arch = "wasm32", target_feature = "simd128"),
    path = "wasm.rs"
)]
mod native;
mod scalar;
#[cfg(test)]
mod tests;

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU8, Ordering};

pub(crate) use doubles::{Doubles, Halves, Quad};
pub(crate) use scalar::Scalar;

/// Whether code had better be small than fast: where there are no vectors, lanes go one by one and questions share their
/// code. Not where compilers make vectors of portable code.
pub(crate) const SMALL: bool =
    !cfg!(any(target_feature = "sse2", target_feature = "neon", target_feature = "simd128"));

/// The number of each of sixteen lanes.
pub(crate) const NUMBERS: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// `N` floats side by side.
pub(crate) trait Lanes<const N: usize>: Copy {
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// Correctly rounded.
    fn div(self, other: Self) -> Self;
    /// `if self < other { self } else { other }`: a NaN in `self` gives `other`.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: a NaN in `self` gives `other`.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// `self`, with the other sign where `sign` is negative.
    fn flipped_by(self, sign: Self) -> Self;
    /// `self`, whose sign bit is clear, with that of `sign`.
    fn with_sign_of(self, sign: Self) -> Self;
    /// `self * factor - other`, with one rounding or two: not the same bits from every backend, so
    /// only where the bound allows for both and nothing of it is answered.
    fn fast_mul_sub(self, factor: Self, other: Self) -> Self;
    /// `self * factor + other`, likewise.
    fn fast_mul_add(self, factor: Self, other: Self) -> Self;
    /// One bit for each lane in which `self < other`, the first the lowest; none for NaN.
    fn less(self, other: Self) -> u32;
    /// One bit for each lane in which `self <= other`; none for NaN.
    fn less_or_equal(self, other: Self) -> u32;
    fn store(self, out: &mut [f32; N]);
}

/// `a * b - c`, fused where that is faster if `FUSED` says that the bits need not be those of others.
#[inline(always)]
pub(crate) fn mul_sub<V: Lanes<N>, const FUSED: bool, const N: usize>(a: V, b: V, c: V) -> V {
    if FUSED { a.fast_mul_sub(b, c) } else { a.mul(b).sub(c) }
}

/// `a * b + c`, likewise.
#[inline(always)]
pub(crate) fn mul_add<V: Lanes<N>, const FUSED: bool, const N: usize>(a: V, b: V, c: V) -> V {
    if FUSED { a.fast_mul_add(b, c) } else { a.mul(b).add(c) }
}

/// A backend's vectors of `N` lanes.
pub(crate) trait Width<const N: usize>: Copy {
    type V: Lanes<N>;
    fn splat(self, x: f32) -> Self::V;
    fn load(self, lanes: &[f32; N]) -> Self::V;

    /// `chosen` in the lanes of `mask`, `other` in the rest.
    #[inline(always)]
    fn select(self, mask: u32, chosen: Self::V, other: Self::V) -> Self::V {
        let (mut lanes, mut others) = ([0.0; N], [0.0; N]);
        chosen.store(&mut lanes);
        other.store(&mut others);
        for (i, (lane, other)) in lanes.iter_mut().zip(others).enumerate() {
            *lane = if mask >> i & 1 == 1 { *lane } else { other };
        }
        self.load(&lanes)
    }

    /// Lane `i` of the result is the lane of `table` that `list` names for it: the numbers of even lanes in
    /// the nibbles of the first four bytes, the lower nibble first, those of odd lanes in the others.
    #[inline(always)]
    fn corners(self, table: <Self as Width<16>>::V, list: &[u8; 8]) -> <Self as Width<N>>::V
    where
        Self: Width<16>,
    {
        let mut lanes = [0.0; 16];
        table.store(&mut lanes);
        Width::<N>::load(self, &core::array::from_fn(|i| lanes[corner(list, i)]))
    }

    /// The same for three lists.
    #[inline(always)]
    fn of_corners(
        self,
        table: <Self as Width<16>>::V,
        [a, b, c]: [&[u8; 8]; 3],
    ) -> [<Self as Width<N>>::V; 3]
    where
        Self: Width<16>,
    {
        let (a, b) = (Width::<N>::corners(self, table, a), Width::<N>::corners(self, table, b));
        [a, b, Width::<N>::corners(self, table, c)]
    }

    /// One lane.
    #[inline(always)]
    fn lane(self, v: Self::V, lane: u32) -> f32 {
        let mut lanes = [0.0; N];
        v.store(&mut lanes);
        lanes[lane as usize % N]
    }

    /// The largest lane, of which none is a NaN.
    #[inline(always)]
    fn largest(self, v: Self::V) -> f32 {
        let mut lanes = [0.0; N];
        v.store(&mut lanes);
        lanes
            .into_iter()
            .fold(f32::NEG_INFINITY, |largest, x| if x > largest { x } else { largest })
    }

    /// Writes `word` into the lanes of `mask`.
    #[inline(always)]
    fn set_words(self, mask: u32, word: u32, words: &mut [u32; N]) {
        for (i, place) in words.iter_mut().enumerate() {
            *place = if mask >> i & 1 == 1 { word } else { *place };
        }
    }

    /// Columns of eight rows of numbers each: lane `i` of column `k` is `rows[i][k]`.
    #[inline(always)]
    fn columns(self, rows: &[&[f32; 8]; N]) -> [[f32; N]; 8] {
        core::array::from_fn(|k| core::array::from_fn(|i| rows[i][k]))
    }

    /// Where `near <= far`: sets the bits of `bits` in the words, and takes `near` where it is less than the lane of `least`.
    #[inline(always)]
    fn note(
        self,
        [near, far]: [Self::V; 2],
        bits: u32,
        words: &mut [u32; N],
        least: Self::V,
    ) -> Self::V {
        let mask = near.less_or_equal(far);
        for (i, place) in words.iter_mut().enumerate() {
            *place |= if mask >> i & 1 == 1 { bits } else { 0 };
        }
        self.select(mask, near.min(least), least)
    }

    /// One bit for each word that is not zero.
    #[inline(always)]
    fn used_words(self, words: &[u32; N]) -> u32 {
        let mut used = 0;
        for (i, word) in words.iter().enumerate() {
            used |= u32::from(*word != 0) << i;
        }
        used
    }

    /// Writes the words of `mask` in order to the front of `out`, and anything behind them.
    #[inline(always)]
    fn compress_words(self, mask: u32, words: &[u32; N], out: &mut [MaybeUninit<u32>; N]) {
        scalar::compress(words, mask, out);
    }

    /// Writes the words of `mask`, two lanes at least, and their `near` to the front of the columns, far ones first, and
    /// anything behind them. Returns the word of the last, which is nearest.
    ///
    /// They are in the order of keys: `near` as integers whose lowest bits are replaced by the number of the lane
    /// among those of `mask`; two bits for up to four of them, three for up to eight, otherwise four.
    #[inline(always)]
    fn sort(
        self,
        mask: u32,
        near: Self::V,
        words: &[u32; N],
        near_out: &mut [MaybeUninit<f32>; N],
        words_out: &mut [MaybeUninit<u32>; N],
    ) -> u32 {
        let mut lanes = [0.0; N];
        near.store(&mut lanes);
        scalar::sort(mask, &lanes, words, near_out, words_out)
    }

    /// Of the lanes of `mask`, counted from the lowest, the number of one in which `near` is nearly least, and
    /// its word: the first of the least as integers, when their number replaces the lowest bits.
    #[inline(always)]
    fn nearest(self, mask: u32, near: Self::V, words: &[u32; N]) -> (usize, u32) {
        let mut lanes = [0.0; N];
        near.store(&mut lanes);
        scalar::nearest(mask, &lanes, words)
    }
}

/// A backend: a proof that its instructions exist.
pub(crate) trait Simd: Width<16> + Width<8> + Width<4> {
    /// So few lanes of 16 are faster one by one.
    const FEW: u32;

    /// Whether eight lanes take less time than sixteen: where these are two vectors. What a search waits for is mostly one
    /// instruction after another, and not how wide they are.
    const IN_HALVES: bool = true;

    /// Whether batches trace rays together and keep several in flight: where vectors are fast enough to wait for memory. Elsewhere it
    /// would only be one more copy of the code.
    const FLIES: bool = false;

    /// Eight doubles.
    type Doubles: Halves;

    /// Four doubles.
    type Quad: Quad;

    /// Four floats as doubles.
    fn quad(self, floats: &[f32; 4]) -> Self::Quad;

    /// The same four in both halves.
    fn twice(self, four: &[f64; 4]) -> Self::Doubles;

    /// Floats as doubles.
    fn widened(self, floats: &[f32; 8]) -> Self::Doubles;

    /// The floats nearest to doubles.
    fn narrowed(self, doubles: Self::Doubles) -> [f32; 8];

    /// The first three lanes, and zero.
    #[inline(always)]
    fn three(self, v: <Self as Width<4>>::V) -> <Self as Width<4>>::V {
        let mut lanes = [0.0; 4];
        v.store(&mut lanes);
        lanes[3] = 0.0;
        self.load(&lanes)
    }

    /// In the first three lanes the largest of them; any number if one is NaN.
    #[inline(always)]
    fn largest_of_three(self, v: <Self as Width<4>>::V) -> <Self as Width<4>>::V {
        let mut lanes = [0.0; 4];
        v.store(&mut lanes);
        let [x, y, z, _] = lanes;
        let larger = if x > y { x } else { y };
        Width::<4>::splat(self, if larger > z { larger } else { z })
    }

    /// In the first three lanes the least of them; any number if one is NaN, and a zero of either sign.
    #[inline(always)]
    fn least_of_three(self, v: <Self as Width<4>>::V) -> <Self as Width<4>>::V {
        let mut lanes = [0.0; 4];
        v.store(&mut lanes);
        let [x, y, z, _] = lanes;
        let smaller = if x < y { x } else { y };
        Width::<4>::splat(self, if smaller < z { smaller } else { z })
    }

    /// `v` in the lanes in which `a <= b`, otherwise zero.
    #[inline(always)]
    fn where_less_or_equal(
        self,
        a: <Self as Width<4>>::V,
        b: <Self as Width<4>>::V,
        v: <Self as Width<4>>::V,
    ) -> <Self as Width<4>>::V {
        let (mut lanes, chosen) = ([0.0; 4], a.less_or_equal(b));
        v.store(&mut lanes);
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = if chosen >> i & 1 == 1 { *lane } else { 0.0 };
        }
        self.load(&lanes)
    }

    /// Each lane rounded towards zero, while it is below 2^31 in size.
    #[inline(always)]
    fn whole(self, v: <Self as Width<4>>::V) -> [i32; 4] {
        let mut lanes = [0.0; 4];
        v.store(&mut lanes);
        lanes.map(|lane| lane as i32)
    }

    /// The floats nearest to whole numbers.
    #[inline(always)]
    fn floats(self, whole: [i32; 4]) -> <Self as Width<4>>::V {
        self.load(&whole.map(|lane| lane as f32))
    }

    /// Moves those entries whose `near` is not above `t_bound` to the front of both columns, in
    /// their order, and returns how many these are.
    ///
    /// # Safety
    ///
    /// All entries are written; both columns are equally long.
    #[inline(always)]
    unsafe fn keep_up_to(
        self,
        near: &mut [MaybeUninit<f32>],
        refs: &mut [MaybeUninit<u32>],
        t_bound: f32,
    ) -> usize {
        // SAFETY: the caller's promise.
        unsafe { scalar::keep_up_to(near, refs, t_bound) }
    }

    /// Lets the processor fetch `what`, which will be read soon.
    #[inline(always)]
    fn prefetch<T>(self, _what: &T) {}

    /// The same for `LINES` cache lines from `first` on, wherever that points to.
    #[inline(always)]
    fn prefetch_lines<const LINES: usize>(self, _first: *const u8) {}

    /// Runs `kernel` with the backend's instructions, in a function of its own; all that it inlines may use them.
    fn run<K: Kernel>(self, kernel: K) -> K::Output;
}

/// The vector instructions that queries use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Backend {
    /// Portable code.
    Scalar = 1,
    /// 128 bits: SSE2, NEON on AArch64, or `simd128` in WebAssembly that is compiled for it.
    Bits128 = 2,
    /// 256 bits: AVX2 and FMA.
    Avx2 = 3,
    /// 512 bits: AVX-512 F, VL, DQ and BW.
    Avx512 = 4,
}

impl Backend {
    /// All of them, the lowest first.
    pub const ALL: [Backend; 4] =
        [Backend::Scalar, Backend::Bits128, Backend::Avx2, Backend::Avx512];

    /// The best that this processor has.
    pub fn detected() -> Backend {
        native::detect()
    }

    /// What queries use now.
    #[inline]
    pub fn current() -> Backend {
        if !CHOOSES {
            return Backend::detected();
        }
        match CHOICE.load(Ordering::Relaxed) {
            1 => Backend::Scalar,
            2 => Backend::Bits128,
            3 => Backend::Avx2,
            4 => Backend::Avx512,
            _ => {
                let best = Backend::detected();
                CHOICE.store(best as u8, Ordering::Relaxed);
                best
            }
        }
    }

    /// Lets queries of the whole process use this backend, or the best there is if it is less. For
    /// tests and measurements: all backends give the same bits. Without std, only on x86-64.
    pub fn force(self) -> Backend {
        let choice = self.min(Backend::detected());
        CHOICE.store(choice as u8, Ordering::Relaxed);
        Backend::current()
    }
}

/// Whether there is anything to choose at run time: a microcontroller has no memory for what is known before.
const CHOOSES: bool = cfg!(any(target_arch = "x86_64", feature = "std"));

/// The one global of the library, where it [chooses](CHOOSES): asking the processor takes longer than a ray.
static CHOICE: AtomicU8 = AtomicU8::new(0);

/// Something to run with a backend. Not a closure: `run`, and all that it calls, must be inlined always,
/// or it is compiled without the instructions.
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, s: S) -> Self::Output;
}

/// Runs `kernel` with the best instructions there are.
#[inline]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: `current` is never above what `detected` found on this processor.
    unsafe { native::run_with(Backend::current(), kernel) }
}

/// The vectors that every processor has which this is compiled for: for code that is not compiled once for each backend.
#[inline(always)]
pub(crate) fn at_hand() -> impl Simd {
    native::at_hand()
}

/// Lets the processor fetch `what`, if it can be told to.
#[inline(always)]
pub(crate) fn prefetch<T>(what: &T) {
    native::prefetch(what);
}

/// The lane that `list` names for lane `i`: see [`Width::corners`].
fn corner(list: &[u8; 8], i: usize) -> usize {
    let place = i % 2 * 8 + i / 2 % 8;
    usize::from(list[place / 2] >> (4 * (place % 2)) & 15)
}
