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
    let mut left = Box4::EMPTY;
    let mut best: Option<(usize, f32)> = None;
    for ((r, right), i) in refs.iter().zip(&rights[1..]).zip(1..count) {
        left.add(&r.bounds);
        let work = areas.of_finite(&left) * i as f32 + areas.of_finite(right) * (count - i) as f32;
        if allowed(i) && best.is_none_or(|best| work < best.1) {
            best = Some((i, work));
        }
    }
    best.map(|(left_count, work)| Sweep { left_count, work })
}

/// Sorts by the centres on the axis on which they are furthest apart.
fn sort(refs: &mut [PrimRef]) {
    let axis = Extent::around(refs).centres.widest() % 4;
    sort_few(refs, |r| middle(r.bounds.lower[axis], r.bounds.upper[axis]));
}

/// Sorts up to [`FEW`] refs by their keys; equal ones stay in order.
pub(super) fn sort_few<K: PartialOrd + Copy>(refs: &mut [PrimRef], key: impl Fn(&PrimRef) -> K) {
    let Some(first) = refs.first() else { return };
    let mut order = [(key(first), 0); FEW];
    for (i, r) in refs.iter().enumerate().take(FEW) {
        let (mut at, key) = (i, key(r));
        while at > 0 && key < order[(at - 1) % FEW].0 {
            order[at % FEW] = order[(at - 1) % FEW];
            at -= 1;
        }
        order[at % FEW] = (key, i);
    }
    let mut before = [*first; FEW];
    for (before, r) in before.iter_mut().zip(&*refs) {
        *before = *r;
    }
    for (r, (_, i)) in refs.iter_mut().zip(&order) {
        *r = before[i % FEW];
    }
}
