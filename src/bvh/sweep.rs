//! Where to part the few refs of a small node: SAH over every place between two of them.

use super::refs::PrimRef;
use super::split::{Areas, Box4, Extent, centre};

/// Of at most this many refs every split along an axis is looked at.
pub(crate) const FEW: usize = 8;

/// The split of least cost along the axis on which the centres are furthest apart.
pub(crate) struct Sweep {
    pub left_count: usize,
    pub sides: [Extent; 2],
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
    let refs = &mut refs[..count];
    sort(refs);
    // What lies right of each place, from the right; then what lies left.
    let mut right = [Box4::EMPTY; FEW + 1];
    for (i, r) in refs.iter().enumerate().rev() {
        right[i] = right[i + 1];
        right[i].add(&r.bounds);
    }
    let mut left = Box4::EMPTY;
    let mut best: Option<Sweep> = None;
    for (r, i) in refs.iter().zip(1..count) {
        left.add(&r.bounds);
        let right = &right[i];
        let work = areas.of_finite(&left) * i as f32 + areas.of_finite(right) * (count - i) as f32;
        if allowed(i) && best.as_ref().is_none_or(|best| work < best.work) {
            let side = |bounds: &Box4| Extent { bounds: *bounds, centres: Box4::EMPTY };
            best = Some(Sweep { left_count: i, sides: [side(&left), side(right)], work });
        }
    }
    best
}

/// Sorts by the centres on the axis on which they are furthest apart; equal ones stay in order.
fn sort(refs: &mut [PrimRef]) {
    let mut centres = Box4::EMPTY;
    for r in refs.iter() {
        centres.add(&Box4::at(centre(r)));
    }
    let axis = centres.widest();
    let mut keys = [0.0; FEW];
    for i in 0..refs.len() {
        let (r, key) = (refs[i], centre(&refs[i])[axis]);
        let mut at = i;
        while at > 0 && key < keys[at - 1] {
            keys[at] = keys[at - 1];
            refs[at] = refs[at - 1];
            at -= 1;
        }
        keys[at] = key;
        refs[at] = r;
    }
}
