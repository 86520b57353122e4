//! Each operation of each backend of this processor against the portable code, bit for bit.

use core::fmt::Debug;
use core::mem::MaybeUninit;
use std::prelude::v1::*;

use super::{Backend, Kernel, Lanes, Quad, Scalar, Simd, Width, native};

/// Both zeros, infinities, ones, least and greatest, subnormals, and NaN of both signs, one with a payload.
const SPECIAL: [u32; 20] = [
    0,
    0x8000_0000,
    0x7f80_0000,
    0xff80_0000,
    0x3f80_0000,
    0xbf80_0000,
    1,
    0x8000_0001,
    0x007f_ffff,
    0x807f_ffff,
    0x0080_0000,
    0x8080_0000,
    0x7f7f_ffff,
    0xff7f_ffff,
    0x7fc0_0000,
    0xffc0_0000,
    0x7fc1_2345,
    0x3f80_0001,
    0x4000_0000,
    0x3eaa_aaab,
];

/// What all operations give, by name.
struct Answers<const N: usize> {
    /// Defined to the bit, also for NaN.
    moved: [(&'static str, [f32; N]); 6],
    /// Where these are NaN, any NaN will do.
    computed: [(&'static str, [f32; N]); 4],
    fast_mul_sub: [f32; N],
    fast_mul_add: [f32; N],
    less: u32,
    less_or_equal: u32,
    /// What compressing left at the front.
    front_words: Vec<u32>,
    /// Both columns of two lanes at least, sorted, and the last word.
    sorted: Option<(Vec<u32>, Vec<u32>, u32)>,
    /// The nearest of the lanes of a mask, if that has any.
    nearest: Option<(usize, u32)>,
}

/// What goes in: three vectors, and bits for masks and lists.
#[derive(Clone, Copy)]
struct Input {
    lanes: [[f32; 16]; 3],
    bits: u64,
}

/// Compares a backend with the portable code.
struct Compare(Input);

impl Kernel for Compare {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        same::<4, S>(s, &self.0);
        same::<8, S>(s, &self.0);
        same::<16, S>(s, &self.0);
        let (table, list) = (&self.0.lanes[0], self.0.bits.to_le_bytes());
        corners::<8, S>(s, table, &list);
        corners::<16, S>(s, table, &list);
        assert_eq!(kept(s, &self.0), kept(Scalar, &self.0), "keep_up_to");
        masked(s, &self.0);
    }
}

/// What a list names for `N` lanes.
#[inline(always)]
fn corners<const N: usize, S: Width<16> + Width<N>>(s: S, table: &[f32; 16], list: &[u8; 8]) {
    let picked = stored(Width::<N>::corners(s, Width::<16>::load(s, table), list));
    let expected: [f32; N] = Width::<N>::corners(Scalar, *table, list);
    assert_eq!(picked.map(f32::to_bits), expected.map(f32::to_bits), "{table:x?} {list:x?}");
}

/// What a mask says of sixteen lanes.
#[inline(always)]
fn masked<S: Width<16>>(s: S, input: &Input) {
    let ([a, b, _], mask) = (&input.lanes, input.bits as u32 & 0xFFFF);
    let picked = stored(s.select(mask, s.load(a), s.load(b))).map(f32::to_bits);
    assert_eq!(picked, Scalar.select(mask, *a, *b).map(f32::to_bits), "select {mask:x}");
    let numbers = a.map(|x| if x.is_nan() { 0.5 } else { x });
    let (largest, expected) = (s.largest(s.load(&numbers)), Scalar.largest(numbers));
    // Zeros of both signs are equally large.
    assert_eq!(largest, expected, "largest of {numbers:?}");
    let (mut words, mut expected) = (b.map(f32::to_bits), b.map(f32::to_bits));
    s.set_words(mask, 7, &mut words);
    Scalar.set_words(mask, 7, &mut expected);
    assert_eq!(words, expected, "set_words {mask:x}");
    let rows = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|i| a[i..].first_chunk::<8>().expect("eight"));
    let rows = core::array::from_fn(|i| rows[i * 5 % 9]);
    let bits = |table: [[f32; 16]; 8]| table.map(|column| column.map(f32::to_bits));
    assert_eq!(bits(s.columns(&rows)), bits(Scalar.columns(&rows)), "columns");
    let bits_of = |v: [f32; 16]| v.map(f32::to_bits);
    let mut portable = words;
    let least = bits_of(noted_by(s, &input.lanes, &mut words));
    let expected = bits_of(noted_by(Scalar, &input.lanes, &mut portable));
    assert_eq!((words, least), (portable, expected), "note");
    s.set_words(mask, 0, &mut words);
    assert_eq!(s.used_words(&words), Scalar.used_words(&words), "used_words {words:x?}");
}

/// The words and the least lanes after a ray is noted that enters where the first lanes are not above the second ones.
#[inline(always)]
fn noted_by<S: Width<16>>(s: S, [a, b, c]: &[[f32; 16]; 3], words: &mut [u32; 16]) -> [f32; 16] {
    let span = [Width::<16>::load(s, a), Width::<16>::load(s, b)];
    stored(Width::<16>::note(s, span, 1 << 20, words, Width::<16>::load(s, c)))
}

#[inline(always)]
fn stored<const N: usize, V: Lanes<N>>(v: V) -> [f32; N] {
    let mut lanes = [0.0; N];
    v.store(&mut lanes);
    lanes
}

fn written<T: Copy>(front: &[MaybeUninit<T>]) -> Vec<T> {
    // SAFETY: compressing and sorting write as many as the mask has bits.
    front.iter().map(|x| unsafe { x.assume_init() }).collect()
}

#[inline(always)]
fn answers<const N: usize, S: Width<N>>(s: S, input: &Input) -> Answers<N> {
    let lanes = input.lanes.map(|lanes| *lanes.first_chunk::<N>().expect("16 lanes are enough"));
    let (a, b, c) = (s.load(&lanes[0]), s.load(&lanes[1]), s.load(&lanes[2]));
    let mask = input.bits as u32 & ((1 << N) - 1);
    let words = lanes[1].map(f32::to_bits);
    let (mut near, mut front) = ([MaybeUninit::uninit(); N], [MaybeUninit::uninit(); N]);
    s.compress_words(mask, &words, &mut front);
    let count = mask.count_ones() as usize;
    let front_words = written(&front[..count]);
    let sorted = (count > 1).then(|| {
        let last = s.sort(mask, a, &words, &mut near, &mut front);
        let near = written(&near[..count]).into_iter().map(f32::to_bits).collect();
        (near, written(&front[..count]), last)
    });
    Answers {
        moved: [
            ("min", stored(a.min(b))),
            ("max", stored(a.max(b))),
            ("abs", stored(a.abs())),
            ("flipped_by", stored(a.flipped_by(b))),
            ("with_sign_of", stored(a.abs().with_sign_of(b))),
            ("splat", stored(s.splat(lanes[2][0]))),
        ],
        computed: [
            ("add", stored(a.add(b))),
            ("sub", stored(a.sub(b))),
            ("mul", stored(a.mul(b))),
            ("div", stored(a.div(b))),
        ],
        fast_mul_sub: stored(a.fast_mul_sub(b, c)),
        fast_mul_add: stored(a.fast_mul_add(b, c)),
        less: a.less(b),
        less_or_equal: a.less_or_equal(b),
        front_words,
        sorted,
        nearest: (mask != 0).then(|| s.nearest(mask, a, &lanes[1].map(f32::to_bits))),
    }
}

/// What stays of two columns up to a bound.
#[inline(always)]
fn kept<S: Simd>(s: S, input: &Input) -> (Vec<u32>, Vec<u32>) {
    let [near, more, refs] = input.lanes;
    let count = input.bits as usize % 32;
    let near = [near, more].concat();
    let refs: Vec<u32> =
        [refs, near[..16].try_into().expect("16")].concat().iter().map(|x| x.to_bits()).collect();
    let mut near: Vec<_> = near[..count].iter().map(|x| MaybeUninit::new(*x)).collect();
    let mut refs: Vec<_> = refs[..count].iter().map(|x| MaybeUninit::new(*x)).collect();
    let bound = more[input.bits as usize / 32 % 16];
    // SAFETY: all entries are written, and as many in both columns.
    let count = unsafe { s.keep_up_to(&mut near, &mut refs, bound) };
    // SAFETY: moving entries unwrites none.
    let near = near[..count].iter().map(|x| unsafe { x.assume_init() }.to_bits()).collect();
    // SAFETY: as above.
    (near, refs[..count].iter().map(|x| unsafe { x.assume_init() }).collect())
}

#[inline(always)]
fn same<const N: usize, S: Width<N>>(s: S, input: &Input) {
    compare(&answers::<N, S>(s, input), &answers::<N, Scalar>(Scalar, input), &input.lanes);
}

fn compare<const N: usize>(got: &Answers<N>, expected: &Answers<N>, lanes: &[[f32; 16]; 3]) {
    let [a, b, c] = lanes;
    let context = || format!("{N} lanes of {:x?}", lanes.map(|l| l.map(f32::to_bits)));
    for ((name, got), (_, expected)) in got.moved.iter().zip(&expected.moved) {
        assert_eq!(got.map(f32::to_bits), expected.map(f32::to_bits), "{name}, {}", context());
    }
    for ((name, got), (_, expected)) in got.computed.iter().zip(&expected.computed) {
        let equal = got.iter().zip(expected).all(|(got, expected)| alike(*got, *expected));
        assert!(equal, "{name}: {got:?}, not {expected:?}, {}", context());
    }
    for (i, got) in got.fast_mul_sub.into_iter().enumerate() {
        let (twice, once) = (a[i] * b[i] - c[i], a[i].mul_add(b[i], -c[i]));
        let right = alike(got, twice) || alike(got, once);
        assert!(right, "fast_mul_sub: {got}, neither {twice} nor {once}, {}", context());
    }
    for (i, got) in got.fast_mul_add.into_iter().enumerate() {
        let (twice, once) = (a[i] * b[i] + c[i], a[i].mul_add(b[i], c[i]));
        let right = alike(got, twice) || alike(got, once);
        assert!(right, "fast_mul_add: {got}, neither {twice} nor {once}, {}", context());
    }
    assert_eq!(got.less, expected.less, "less, {}", context());
    assert_eq!(got.less_or_equal, expected.less_or_equal, "less_or_equal, {}", context());
    assert_eq!(got.sorted, expected.sorted, "sort, {}", context());
    assert_eq!(got.front_words, expected.front_words, "compress_words, {}", context());
    assert_eq!(got.nearest, expected.nearest, "nearest, {}", context());
}

/// The same bits, or both NaN.
fn alike(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Numbers from a counter. Source: SplitMix64.
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ *state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

fn special(i: usize) -> f32 {
    f32::from_bits(SPECIAL[i % SPECIAL.len()])
}

/// A lane: special, any bits, or near one so that sums cancel and quotients round.
fn lane(state: &mut u64) -> f32 {
    let bits = random(state);
    let low = bits as u32;
    f32::from_bits(match bits >> 62 {
        0 => return special(low as usize),
        1 => 0x3f80_0000 | low & 0x8000_0007,
        2 => 0x3f00_0000 | low & 0x80ff_ffff,
        _ => low,
    })
}

#[test]
fn every_operation_means_what_the_portable_one_does() {
    let best = Backend::detected();
    for backend in Backend::ALL.into_iter().filter(|backend| *backend <= best) {
        let compare = |lanes, bits| {
            let kernel = Compare(Input { lanes, bits });
            // SAFETY: `detected` says that there is this one.
            unsafe { native::run_with(backend, kernel) }
        };
        let mut state = 1;
        // All pairs of special values.
        for i in 0..SPECIAL.len() * SPECIAL.len() {
            let at = |step| core::array::from_fn(|lane| special((i + lane) / step));
            compare([at(1), at(SPECIAL.len()), at(7)], random(&mut state));
        }
        for _ in 0..20_000 {
            let lanes = [(); 3].map(|()| [(); 16].map(|()| lane(&mut state)));
            compare(lanes, random(&mut state));
        }
    }
}

/// What is done with three coordinates.
#[derive(Debug, PartialEq)]
struct OfThree {
    three: [u32; 4],
    least: bool,
    chosen: [u32; 4],
    whole: [i32; 4],
    floats: [u32; 4],
}

/// What portable code answers, and each backend of this processor.
fn answer_of_all<K: Kernel<Output: PartialEq + Debug> + Copy + Debug>(kernel: K) -> K::Output {
    let (best, expected) = (Backend::detected(), kernel.run(Scalar));
    for backend in Backend::ALL.into_iter().filter(|backend| *backend <= best) {
        // SAFETY: `detected` says that there is this one.
        let found = unsafe { native::run_with(backend, kernel) };
        assert_eq!(found, expected, "{backend:?}: {kernel:?}");
    }
    expected
}

/// The operations on four lanes of which three count.
#[derive(Clone, Copy, Debug)]
struct WithThree([[f32; 4]; 3]);

impl Kernel for WithThree {
    type Output = OfThree;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> OfThree {
        let Self([a, b, c]) = self;
        let [mut three, mut least, mut chosen, mut floats] = [[0.0; 4]; 4];
        let (va, vb) = (Width::<4>::load(s, &a), Width::<4>::load(s, &b));
        s.three(va).store(&mut three);
        s.least_of_three(va).store(&mut least);
        s.where_less_or_equal(va, vb, Width::<4>::load(s, &c)).store(&mut chosen);
        let whole = s.whole(va);
        s.floats(whole).store(&mut floats);
        OfThree {
            three: three.map(f32::to_bits),
            // A zero may have either sign.
            least: least[..3].iter().all(|x| *x == a[0].min(a[1]).min(a[2])),
            chosen: chosen.map(f32::to_bits),
            whole,
            floats: floats.map(f32::to_bits),
        }
    }
}

#[test]
fn three_coordinates_are_treated_alike() {
    let mut state = 2;
    for _ in 0..20_000 {
        // Whole numbers of up to 31 bits, large and small, of both signs, some equal.
        let mut lane = || {
            let bits = random(&mut state);
            (bits as i32 >> 1 >> (bits >> 32 & 31)) as f32 / [1.0, 4.0][(bits >> 40 & 1) as usize]
        };
        let lanes = [(); 3].map(|()| [(); 4].map(|()| lane()));
        assert!(answer_of_all(WithThree(lanes)).least);
    }
}

/// What is done with four vectors of three doubles.
#[derive(Clone, Copy, Debug)]
struct Quads([[f32; 4]; 4]);

impl Kernel for Quads {
    /// The bits of what comes out, without what is beside three numbers.
    type Output = ([[u64; 3]; 2], [u64; 4], [[u64; 4]; 2]);

    fn run<S: Simd>(self, s: S) -> Self::Output {
        let vectors = self.0.each_ref().map(|floats| s.quad(floats));
        let bits = |quad: S::Quad| quad.array().map(f64::to_bits);
        let three = |quad: S::Quad| {
            let [x, y, z, _] = bits(quad);
            [x, y, z]
        };
        (
            [three(vectors[0].turned()), three(vectors[0].turned_back())],
            bits(vectors[1].first()),
            [bits(Quad::sums(vectors)), bits(Quad::turned_sums(vectors))],
        )
    }
}

#[test]
fn four_doubles_are_treated_alike() {
    let mut state = 3;
    for _ in 0..20_000 {
        // Of all sizes, so that it matters in which order they are added.
        let mut float = || {
            let bits = random(&mut state);
            (bits as i32) as f32 * 2f32.powi((bits >> 32) as i32 % 40)
        };
        let vectors = [(); 4].map(|()| [(); 4].map(|()| float()));
        answer_of_all(Quads(vectors));
    }
}
