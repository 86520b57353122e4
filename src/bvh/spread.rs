//! How unlike the areas of refs are.

use core::ops::Range;

use super::refs::PrimRef;
use super::split::Areas;
use crate::caller::{Caller, PARTS};
use crate::prim::GRAIN;

/// Sums over the areas of some refs.
#[derive(Clone, Copy, Default)]
struct Sums {
    areas: f64,
    squares: f64,
}

impl Sums {
    fn of(refs: &[PrimRef], areas: Areas) -> Sums {
        let mut sums = Sums::default();
        for r in refs {
            let area = f64::from(areas.of_finite(&r.bounds));
            sums.areas += area;
            sums.squares += area * area;
        }
        sums
    }

    fn add(&mut self, other: Sums) {
        self.areas += other.areas;
        self.squares += other.squares;
    }

    /// NaN when all areas are zero.
    fn unevenness(&self, count: usize) -> f64 {
        self.squares * count as f64 / (self.areas * self.areas)
    }
}

/// 1 where the areas of all refs are alike, about `n / k` where `k` of `n` have most of the area.
pub(super) fn unevenness(refs: &[PrimRef], areas: Areas) -> f64 {
    Sums::of(refs, areas).unevenness(refs.len())
}

/// The same by the caller's threads.
pub(super) fn unevenness_of_all(refs: &[PrimRef], areas: Areas, caller: &Caller) -> f64 {
    let mut all = Sums::default();
    let part = |part: Range<usize>| Sums::of(refs.get(part).unwrap_or_default(), areas);
    caller.for_parts(refs.len(), part_size(refs), part, |sums| all.add(sums));
    all.unevenness(refs.len())
}

/// Parts that do not depend on the threads, as sums are rounded.
pub(super) fn part_size(refs: &[PrimRef]) -> usize {
    refs.len().div_ceil(PARTS).max(GRAIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;

    #[test]
    fn a_few_large_ones_make_refs_uneven() {
        let edges = |large: usize| {
            (0..1000).map(move |i| if i < large { 10.0f32 } else { 0.01 }).enumerate()
        };
        let unevenness = |large| {
            let refs: std::vec::Vec<_> = edges(large)
                .map(|(i, edge)| {
                    let aabb = Aabb { lower: [0.0; 3], upper: [edge; 3] };
                    PrimRef::new(i as u32, &aabb, false)
                })
                .collect();
            let areas = Areas::new(&Aabb { lower: [0.0; 3], upper: [10.0; 3] });
            let apart = unevenness(&refs, areas);
            assert_eq!(apart, unevenness_of_all(&refs, areas, &Caller::new(None, None)));
            apart
        };
        for (large, expected) in [(0, 1.0), (1, 1000.0), (10, 100.0), (1000, 1.0)] {
            assert!((unevenness(large) / expected - 1.0).abs() < 1e-2, "{large}");
        }
    }
}
