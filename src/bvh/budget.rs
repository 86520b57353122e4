//! How many leaves and levels a tree over so many refs takes.

/// The fewest leaves that `count` refs can always be brought into by halving, and by parting
/// kinds at the end when both occur.
///
/// By induction: what is at most a leaf is one leaf, or two of different kinds; `leaf_max + 1` refs are two leaves, or
/// four; and the floor of what is in proportion to that is superadditive.
pub(super) fn fewest_leaves(count: usize, mixed: bool, leaf_max: usize) -> usize {
    let two = (leaf_max + 1).max(1);
    match (count, mixed) {
        (0 | 1, _) => count,
        (_, false) => (2 * count / two).max(1),
        (_, true) => (4 * count / two).max(2),
    }
}

/// The fewest leaves of `count` refs of one kind where what is parted without a plane is parted at a multiple of `leaf_max`: all
/// but one are full.
pub(super) fn full_leaves(count: usize, leaf_max: usize) -> usize {
    count.div_ceil(leaf_max.max(1))
}

/// The leaves that a tree over `count` refs may have: `full` is what good trees want, the
/// other bound the least that works.
pub(super) fn leaf_budget(count: usize, mixed: bool, leaf_max: usize, full: bool) -> usize {
    let least = fewest_leaves(count, mixed, leaf_max);
    let wanted = if mixed { count } else { count.div_ceil(2) };
    if full { wanted.max(least) } else { least }
}

/// Levels below a node of `count` refs that is halved down to leaves.
pub(super) fn levels_to_halve(count: usize, leaf_max: usize) -> usize {
    let leaves = count.div_ceil(leaf_max.max(1)).next_power_of_two();
    // One more level, to part kinds.
    leaves.trailing_zeros() as usize + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::MAX_DEPTH;

    #[test]
    fn budgets_are_enough_for_halving() {
        for (mixed, leaf_max) in [2, 4, 5, 6].into_iter().flat_map(|n| [(false, n), (true, n)]) {
            for count in 2..2000 {
                let fewest = |count| fewest_leaves(count, mixed, leaf_max);
                let halves = fewest(count / 2) + fewest(count - count / 2);
                let done = if mixed { 2 } else { 1 };
                let least = if count <= leaf_max { done } else { halves };
                assert!(least <= fewest(count), "{count} {mixed} {leaf_max}");
            }
        }
    }

    #[test]
    fn the_most_primitives_fit_the_depth() {
        assert!(levels_to_halve(1 << 30, 4) < MAX_DEPTH - 32);
        assert_eq!((levels_to_halve(5, 5), levels_to_halve(6, 5)), (1, 2));
        assert_eq!((levels_to_halve(6, 6), levels_to_halve(7, 6)), (1, 2));
    }
}
