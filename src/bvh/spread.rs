//! How unlike the areas of refs are.

use core::ops::Range;

use super::bins::Effort;
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
            sums.add_area(areas.of_finite(&r.bounds));
        }
        sums
    }

    #[inline(always)]
    fn add_area(&mut self, area: f32) {
        let area = f64::from(area);
        self.areas += area;
        self.squares += area * area;
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

/// So many refs may stand apart from all others: the floor that something stands on, or the walls of the room around it.
const APART: usize = 8;

/// What is left must be so many times as even as a scene that is even by itself: without its walls a building is even by that, and is still
/// traced faster if all refs are looked at.
const LEFT: f64 = 4.0;

/// How unlike the areas of many refs are, with the largest ones and without.
#[derive(Clone, Copy)]
pub(super) struct Spread {
    count: usize,
    /// Of all but the largest.
    sums: Sums,
    /// Areas and places of these, the largest first.
    largest: [(f32, usize); APART],
}

impl Spread {
    /// By the caller's threads.
    pub fn of(refs: &[PrimRef], areas: Areas, caller: &Caller) -> Spread {
        let mut all = Spread::NOTHING;
        let part = |part: Range<usize>| {
            let (mut spread, first) = (Spread::NOTHING, part.start);
            for (r, place) in refs.get(part).unwrap_or_default().iter().zip(first..) {
                spread.take((areas.of_finite(&r.bounds), place));
            }
            spread
        };
        caller.for_parts(refs.len(), part_size(refs), part, |part| all.add(&part));
        Spread { count: refs.len(), ..all }
    }

    const NOTHING: Spread = Spread {
        count: 0,
        sums: Sums { areas: 0.0, squares: 0.0 },
        largest: [(0.0, usize::MAX); APART],
    };

    #[inline(always)]
    fn take(&mut self, one: (f32, usize)) {
        let mut rest = one;
        if rest.0 > self.largest[APART - 1].0 {
            for place in &mut self.largest {
                if rest.0 > place.0 {
                    core::mem::swap(place, &mut rest);
                }
            }
        }
        self.sums.add_area(rest.0);
    }

    fn add(&mut self, other: &Spread) {
        self.sums.add(other.sums);
        for one in other.largest {
            self.take(one);
        }
    }

    /// That of all refs.
    pub fn unevenness(&self) -> f64 {
        self.without(0)
    }

    /// That of all but some of the largest.
    fn without(&self, few: usize) -> f64 {
        let mut sums = self.sums;
        for (area, _) in &self.largest[few..] {
            sums.add_area(*area);
        }
        sums.unevenness(self.count - few.min(self.count))
    }

    /// Brings the fewest refs to the front without which the others are [even enough](LEFT), and returns their number; 0 where that takes more.
    pub fn set_apart(&self, refs: &mut [PrimRef], effort: &Effort) -> usize {
        let few = (0..=APART).find(|few| effort.is_even(LEFT * self.without(*few))).unwrap_or(0);
        let mut places = [usize::MAX; APART];
        for (place, (_, at)) in places.iter_mut().zip(&self.largest[..few]) {
            *place = *at;
        }
        // None of them is where another one goes to before it.
        places.sort_unstable();
        for (to, from) in places.into_iter().take(few).enumerate() {
            if from < refs.len() {
                refs.swap(to, from);
            }
        }
        few
    }
}

/// Parts that do not depend on the threads, as sums are rounded.
pub(super) fn part_size(refs: &[PrimRef]) -> usize {
    refs.len().div_ceil(PARTS).max(GRAIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;
    use std::vec;
    use std::vec::Vec;

    /// Boxes of which some are large: those at `places`.
    fn refs(count: usize, places: &[usize]) -> Vec<PrimRef> {
        let refs = (0..count).map(|i| {
            let large = places.iter().position(|place| *place == i);
            let edge = large.map_or(0.01, |nth| 10.0 - nth as f32);
            PrimRef::new(i as u32, &Aabb { lower: [0.0; 3], upper: [edge; 3] }, false)
        });
        refs.collect()
    }

    fn areas() -> Areas {
        Areas::new(&Aabb { lower: [0.0; 3], upper: [10.0; 3] })
    }

    fn spread(refs: &[PrimRef]) -> Spread {
        Spread::of(refs, areas(), &Caller::new(None, None))
    }

    #[test]
    fn a_few_large_ones_make_refs_uneven() {
        for (large, expected) in [(0, 1.0), (1, 1000.0), (10, 171.0)] {
            let all = refs(1000, &(0..large).collect::<Vec<_>>());
            let apart = unevenness(&all, areas());
            assert!((apart / expected - 1.0).abs() < 0.1, "{large} {apart}");
            let caller = Caller::new(None, None);
            assert_eq!(unevenness_of_all(&all, areas(), &caller), apart);
            let together = spread(&all).unevenness();
            assert!((apart / together - 1.0).abs() < 1e-12, "{large} {apart} {together}");
        }
    }

    #[test]
    fn the_fewest_are_set_apart() {
        // In several parts, and where some of them go to the places of others.
        for places in [vec![], vec![7], vec![20_000, 1, 0], vec![1, 2, 30_000, 29_999, 3]] {
            let mut all = refs(40_000, &places);
            assert_eq!(spread(&all).set_apart(&mut all, &Effort::FAST), places.len());
            let (front, rest) = all.split_at(places.len());
            assert!(front.iter().all(|r| places.contains(&(r.id() as usize))), "{places:?}");
            let mut ids: Vec<_> = all.iter().map(PrimRef::id).collect();
            ids.sort_unstable();
            assert!(ids.into_iter().eq(0..40_000), "{places:?}");
            assert!(Effort::FAST.is_even(unevenness(rest, areas())), "{places:?}");
        }
        let many: Vec<_> = (0..APART + 1).collect();
        let mut all = refs(40_000, &many);
        assert_eq!(spread(&all).set_apart(&mut all, &Effort::FAST), 0);
    }
}
