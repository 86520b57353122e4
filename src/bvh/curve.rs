//! Refs in the order of a curve that fills space: what is near on it is near in space.

use super::branch::whole;
use super::refs::PrimRef;
use super::split::{Box4, centre, greater, lesser};
use crate::caller::{Caller, PARTS};

/// Cells along each axis, as a power of two: with the number of a ref these are 63 bits.
const BITS: u32 = 11;
/// Bits that one pass sorts by.
const DIGIT: u32 = 11;
const DIGITS: usize = (3 * BITS / DIGIT) as usize;
/// A ref's number stands in so many of the lowest bits, its place on the curve above them.
const NUMBER: u32 = 30;
const _: () = assert!(DIGIT * DIGITS as u32 == 3 * BITS && 3 * BITS + NUMBER <= 64);

/// Fewer refs are not shared out.
const LEAST: usize = 4096;

/// Writes the refs in the order of their centres along the curve: those of one cell keep their order, and the first `apart` stay
/// in front whatever their centres. `keys` and `spare` have room for as many words, of which one is returned.
///
/// Each thread sorts a part, then two and two are merged until there is one: the keys differ, so it does not matter how they
/// came into their order.
///
/// Source: \[Lauterbach09\], with cells that are cubes; merging by parts after \[Green12\].
pub(super) fn along_curve<'k>(
    refs: &[PrimRef],
    apart: usize,
    (keys, spare): (&'k mut [u64], &'k mut [u64]),
    caller: &Caller,
) -> Option<&'k mut [u64]> {
    let cells = Cells::new(&whole(refs.get(apart..)?, caller)?.centres);
    let size = refs.len().div_ceil(caller.worker_count()).max(LEAST);
    let mut parts = [const { None }; PARTS];
    let places = refs.chunks(size).zip(keys.chunks_mut(size)).zip(spare.chunks_mut(size));
    for (i, (part, ((refs, keys), spare))) in parts.iter_mut().zip(places).enumerate() {
        *part = Some((i * size, refs, keys, spare));
    }
    caller.for_each(&mut parts, |part| {
        let Some((first, refs, keys, spare)) = part else { return };
        for ((key, r), number) in keys.iter_mut().zip(*refs).zip(*first..) {
            let place = if number < apart { 0 } else { cells.place(r) };
            *key = place << NUMBER | number as u64;
        }
        sort(keys, spare);
    });
    let (mut from, mut to, mut width) = (spare, keys, size);
    while width < refs.len() {
        let mut parts = [const { None }; PARTS];
        for (i, (part, to)) in parts.iter_mut().zip(to.chunks_mut(size)).enumerate() {
            let (at, pair) =
                (i * size % (2 * width), from.get(i * size / (2 * width) * 2 * width..)?);
            let (left, right) = pair.split_at(width.min(pair.len()));
            *part = Some((left, right.get(..width).unwrap_or(right), at, to));
        }
        caller.for_each(&mut parts, |part| {
            if let Some((left, right, at, to)) = part {
                merge(left, right, *at, to);
            }
        });
        (from, to) = (to, from);
        width *= 2;
    }
    Some(from)
}

/// Writes what begins at place `at` of both together; each is sorted, and all differ.
fn merge(left: &[u64], right: &[u64], at: usize, to: &mut [u64]) {
    // How many are from the left before that place: as few as leave none there that belong before one from the right.
    let (mut i, mut end) = (at.saturating_sub(right.len()), at.min(left.len()));
    while i < end {
        let middle = i.midpoint(end);
        if left[middle] < right[at - middle - 1] { i = middle + 1 } else { end = middle }
    }
    let mut j = at - i;
    for to in to {
        let next = |keys: &[u64], i: usize| keys.get(i).copied().unwrap_or(u64::MAX);
        let (one, other) = (next(left, i), next(right, j));
        *to = one.min(other);
        i += usize::from(one < other);
        j += usize::from(one >= other);
    }
}

/// The number of the ref that has this key.
#[inline(always)]
pub(super) fn number_of(key: u64) -> usize {
    (key & ((1 << NUMBER) - 1)) as usize
}

#[inline(always)]
fn digit_of(key: u64, digit: u32) -> usize {
    (key >> (NUMBER + DIGIT * digit)) as usize % (1 << DIGIT)
}

/// Sorts keys, which go to `to` in the end.
fn sort(keys: &mut [u64], to: &mut [u64]) {
    let mut counts = [[0u32; 1 << DIGIT]; DIGITS];
    for key in keys.iter() {
        for (counts, digit) in counts.iter_mut().zip(0..) {
            counts[digit_of(*key, digit)] += 1;
        }
    }
    let (mut from, mut to) = (keys, to);
    for (counts, digit) in counts.iter_mut().zip(0..) {
        sort_by_digit(from, to, counts, digit);
        (from, to) = (to, from);
    }
}
const _: () = assert!(DIGITS % 2 == 1);

/// One pass of a radix sort, from the lowest digit on; `counts` is how often each value occurs.
fn sort_by_digit(from: &[u64], to: &mut [u64], counts: &mut [u32; 1 << DIGIT], digit: u32) {
    let mut start = 0;
    for count in counts.iter_mut() {
        (*count, start) = (start, start + *count);
    }
    for key in from {
        let place = &mut counts[digit_of(*key, digit)];
        if let Some(to) = to.get_mut(*place as usize) {
            *to = *key;
        }
        *place += 1;
    }
}

/// Cubes over the box around all centres.
struct Cells {
    lower: [f32; 4],
    scale: f32,
}

/// Above 2^23 the lowest bits of a float are those of an integer.
const INTEGER: f32 = (1 << 23) as f32;

impl Cells {
    fn new(centres: &Box4) -> Cells {
        let k = centres.widest() % 4;
        let scale = (1 << BITS) as f32 / (centres.upper[k] - centres.lower[k]);
        Cells { lower: centres.lower, scale }
    }

    /// The place on the curve: the bits of the cell's three numbers in turn.
    #[inline(always)]
    fn place(&self, r: &PrimRef) -> u64 {
        let (centre, last) = (centre(r), ((1 << BITS) - 1) as f32);
        let mut cell = [0u32; 4];
        for k in 0..4 {
            let at = (centre[k] - self.lower[k]) * self.scale - 0.5;
            // NaN is in cell 0.
            cell[k] = (lesser(greater(at, 0.0), last) + INTEGER).to_bits();
        }
        let [x, y, z, _] = cell.map(|n| spread(u64::from(n % (1 << BITS))));
        x | y << 1 | z << 2
    }
}

/// The lowest 21 bits, with room for two more after each.
#[inline(always)]
fn spread(bits: u64) -> u64 {
    let bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    let bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    let bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    let bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::caller::tests::Tasks;
    use crate::math::Aabb;
    use raykern_harness::make::Random;
    use std::vec::Vec;

    /// The numbers of points in the order of the curve.
    fn order(points: &[[f32; 3]]) -> Vec<usize> {
        sorted(points, 0, &Caller::new(None, None))
    }

    fn sorted(points: &[[f32; 3]], apart: usize, caller: &Caller) -> Vec<usize> {
        let point = |p: &[f32; 3]| PrimRef::new(0, &Aabb { lower: *p, upper: *p }, false);
        let refs: Vec<_> = points.iter().map(point).collect();
        let (mut keys, mut spare) = (std::vec![0; refs.len()], std::vec![0; refs.len()]);
        let keys = along_curve(&refs, apart, (&mut keys, &mut spare), caller).expect("a curve");
        keys.iter().map(|key| number_of(*key)).collect()
    }

    #[test]
    fn parts_that_are_merged_are_as_if_sorted_at_once() {
        let mut random = Random::new(5);
        // Many have a cell in common.
        let mut point = || random.point(0.0, 1.0).map(|x| (64.0 * x) as u8 as f32);
        for count in [LEAST - 1, LEAST, 2 * LEAST + 1, 50_001] {
            let points: Vec<_> = (0..count).map(|_| point()).collect();
            let alone = order(&points);
            for workers in [2, 3, 5, 8, 64, 100] {
                let (tasks, caller) = (Tasks(workers), |tasks| Caller::new(Some(tasks), None));
                assert!(sorted(&points, 0, &caller(&tasks)) == alone, "{count} {workers}");
                let apart = sorted(&points, 7, &caller(&tasks));
                assert!(apart[..7] == [0, 1, 2, 3, 4, 5, 6], "{count} {workers}");
                let others = alone.iter().filter(|number| **number >= 7);
                assert!(apart[7..].iter().eq(others), "{count} {workers}");
            }
        }
    }

    #[test]
    fn the_curve_fills_one_octant_after_the_other() {
        let corners: Vec<_> =
            (0..64u32).rev().map(|i| [i % 4, i / 4 % 4, i / 16].map(|x| x as f32)).collect();
        let order = order(&corners);
        for (octant, points) in order.chunks_exact(8).enumerate() {
            let of = |i: &usize| corners[*i].map(|x| usize::from(x >= 2.0));
            assert!(points.iter().map(of).all(|[x, y, z]| x + 2 * y + 4 * z == octant));
        }
        let mut all = order;
        all.sort_unstable();
        assert!(all.iter().copied().eq(0..64), "each once");
    }

    #[test]
    fn points_of_one_cell_keep_their_order() {
        let points: Vec<_> = (0..5000).map(|i| [if i % 7 == 0 { 1e30 } else { 1.0 }; 3]).collect();
        let order = order(&points);
        let (near, far) = order.split_at(5000 - 715);
        assert!(near.is_sorted() && far.is_sorted() && far.iter().all(|i| i % 7 == 0));
        assert!(order_of_nothing_known());
    }

    /// Infinite boxes and boxes in one point have no cell of their own, but a place.
    fn order_of_nothing_known() -> bool {
        let infinite = [f32::INFINITY, f32::NEG_INFINITY, 0.0];
        order(&[infinite, [0.0; 3], infinite]).len() == 3 && order(&[[1.0; 3]; 3]) == [0, 1, 2]
    }
}
