//! Where to part the few refs of a small node: SAH over every place between two of them.

use super::refs::PrimRef;
use super::split::{Areas, Box4, Extent, lesser, middle};

/// Of at most this many refs every split along an axis is looked at.
pub(crate) const FEW: usize = 8;

/// The split of least cost along the axis on which the centres are furthest apart.
pub(crate) struct Sweep {
    pub left_count: usize,
    /// The areas of the sides, each times its primitives.
    pub work: f32,
}

/// Sorts the refs, two to [`FEW`] of them, and finds the best split of those with an `allowed` number on the left.
pub(crate) fn sweep(
    refs: &mut [PrimRef],
    areas: Areas,
    allowed: impl Fn(usize) -> bool,
) -> Option<Sweep> {
    let count = refs.len().min(FEW);
    let refs = refs.get_mut(..count)?;
    sort(refs);
    // What lies right of each place, from the right; then what lies left.
    let mut rights = [Box4::EMPTY; FEW];
    let mut right = Box4::EMPTY;
    for (place, r) in rights.iter_mut().zip(&*refs).rev() {
        right.add(&r.bounds);
        *place = right;
    }
    // The bits of floats that are not negative are in their order. What is no number, as it comes of infinite boxes, is infinite: its
    // bits are not the same on all machines.
    let (mut left, mut works) = (Box4::EMPTY, [u32::MAX; FEW]);
    for (((r, right), i), work) in refs.iter().zip(&rights[1..]).zip(1..count).zip(&mut works) {
        left.add(&r.bounds);
        let sum = areas.of_finite(&left) * i as f32 + areas.of_finite(right) * (count - i) as f32;
        *work = lesser(sum, f32::INFINITY).to_bits();
    }
    // Almost always the first is allowed.
    loop {
        let (mut least, mut at) = (u32::MAX, 0);
        for (work, i) in works.iter().zip(0..) {
            (least, at) = if *work < least { (*work, i) } else { (least, at) };
        }
        if least == u32::MAX {
            return None;
        }
        let left_count = at + 1;
        if allowed(left_count) {
            return Some(Sweep { left_count, work: f32::from_bits(least) });
        }
        *works.get_mut(at)? = u32::MAX;
    }
}

/// Sorts by the centres on the axis on which they are furthest apart.
fn sort(refs: &mut [PrimRef]) {
    let axis = Extent::around(refs).centres.widest() % 4;
    sort_few(refs, |r| {
        let bits = middle(r.bounds.lower[axis], r.bounds.upper[axis]).to_bits() as i32;
        // In the order of the floats, and NaN has a place too.
        bits ^ (bits >> 31 & i32::MAX)
    });
}

/// Sorts up to [`FEW`] refs by their keys; equal ones stay in order.
///
/// Each goes behind all that belong before it, which are counted without a branch: nobody could guess it.
pub(super) fn sort_few(refs: &mut [PrimRef], key: impl Fn(&PrimRef) -> i32) {
    let mut keys = [i32::MAX; FEW];
    let mut before = [PrimRef::NONE; FEW];
    for ((place, key_of_r), r) in before.iter_mut().zip(&mut keys).zip(&*refs) {
        (*place, *key_of_r) = (*r, key(r));
    }
    let mut places = [0u8; FEW];
    for (i, key) in keys.iter().enumerate() {
        for (j, other) in keys.iter().enumerate().take(i) {
            let stays = u8::from(other <= key);
            places[i] += stays;
            places[j] += 1 - stays;
        }
    }
    for (r, place) in before.iter().zip(places).take(refs.len()) {
        if let Some(to) = refs.get_mut(usize::from(place)) {
            *to = *r;
        }
    }
}
