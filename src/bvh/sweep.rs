//! Where to part the few refs of a small node: SAH over every place between two of them.

use super::refs::PrimRef;
use super::split::{Areas, Box4, Extent, middle};

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
    let (mut left, mut works) = (Box4::EMPTY, [f32::INFINITY; FEW]);
    for (((r, right), i), work) in refs.iter().zip(&rights[1..]).zip(1..count).zip(&mut works) {
        left.add(&r.bounds);
        *work = areas.of_finite(&left) * i as f32 + areas.of_finite(right) * (count - i) as f32;
    }
    // The bits of floats that are not negative are in their order.
    let key = |i: usize| u64::from(works[i - 1].to_bits()) << 8 | i as u64;
    let all = || 1..count;
    let least = all().map(key).min().filter(|key| allowed((key & 0xFF) as usize));
    let least = least.or_else(|| all().filter(|i| allowed(*i)).map(key).min())?;
    Some(Sweep { left_count: (least & 0xFF) as usize, work: f32::from_bits((least >> 8) as u32) })
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
    let mut places = [0; FEW];
    for i in 1..FEW {
        for j in 0..i {
            let stays = usize::from(keys[j] <= keys[i]);
            places[i] += stays;
            places[j] += 1 - stays;
        }
    }
    for (r, place) in before.iter().zip(places).take(refs.len()) {
        if let Some(to) = refs.get_mut(place) {
            *to = *r;
        }
    }
}
