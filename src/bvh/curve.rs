//! Refs in the order of a curve that fills space: what is near on it is near in space.

use super::refs::PrimRef;
use super::split::{Box4, Extent, centre, greater, lesser};

/// Cells along each axis, as a power of two: with the number of a ref these are 63 bits.
const BITS: u32 = 11;
/// Bits that one pass sorts by.
const DIGIT: u32 = 11;
const DIGITS: usize = (3 * BITS / DIGIT) as usize;
/// A ref's number stands in so many of the lowest bits, its place on the curve above them.
const NUMBER: u32 = 30;
const _: () = assert!(DIGIT * DIGITS as u32 == 3 * BITS && 3 * BITS + NUMBER <= 64);

/// Writes the refs in the order of their centres along the curve; those of one cell keep their order. `keys` and `spare`
/// have room for as many words.
///
/// Source: \[Lauterbach09\], with cells that are cubes.
pub(super) fn along_curve<'k>(
    refs: &[PrimRef],
    keys: &'k mut [u64],
    spare: &'k mut [u64],
) -> &'k [u64] {
    let mut counts = [[0u32; 1 << DIGIT]; DIGITS];
    let cells = Cells::new(&Extent::around(refs).centres);
    for ((key, r), number) in keys.iter_mut().zip(refs).zip(0..) {
        let place = cells.place(r);
        *key = place << NUMBER | number;
        for (counts, digit) in counts.iter_mut().zip(0..) {
            counts[digit_of(*key, digit)] += 1;
        }
    }
    let (mut from, mut to) = (keys, spare);
    for (counts, digit) in counts.iter_mut().zip(0..) {
        sort_by_digit(from, to, counts, digit);
        (from, to) = (to, from);
    }
    from
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
    use crate::math::Aabb;
    use std::vec::Vec;

    /// The numbers of points in the order of the curve.
    fn order(points: &[[f32; 3]]) -> Vec<usize> {
        let point = |p: &[f32; 3]| PrimRef::new(0, &Aabb { lower: *p, upper: *p }, false);
        let refs: Vec<_> = points.iter().map(point).collect();
        let (mut keys, mut spare) = (std::vec![0; refs.len()], std::vec![0; refs.len()]);
        along_curve(&refs, &mut keys, &mut spare).iter().map(|key| number_of(*key)).collect()
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
