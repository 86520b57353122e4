//! What becomes of each node of a binary tree: subtrees are decided at the same time, then what is above them.

use core::ops::Range;

use super::collapse::{Grounds, Results};
use crate::block::BvhNode;
use crate::caller::{Caller, PARTS};
use crate::prim::Source;

/// Subtrees of fewer pairs are not parted.
const SMALL: usize = 512;

/// Writes a choice for each inner node, those of pair 1 first, so that the tree of bundles costs least.
///
/// Source: \[Wald08\] for the wide tree, \[Ylitie17\], 3.1, for the dynamic program.
pub(crate) fn choose<const W: usize>(
    grounds: &Grounds,
    source: Source,
    caller: &Caller,
    choices: &mut [u64],
) -> Option<()> {
    let subtrees = Subtrees::of(grounds.nodes, caller.part_count())?;
    let mut jobs = [const { None }; PARTS];
    let (mut free, mut at) = (&mut *choices, 1);
    for (job, pairs) in jobs.iter_mut().zip(subtrees.all()) {
        let rest = core::mem::take(&mut free).split_at_mut_checked(pairs.start - at)?.1;
        let (choices, rest) = rest.split_at_mut_checked(pairs.len())?;
        (free, at) = (rest, pairs.end);
        *job = Some((pairs.clone(), choices, None));
    }
    caller.for_each(&mut jobs, |job| {
        if let Some((pairs, choices, decided)) = job {
            let (mut results, mut shapes) = (Results::<W>::NONE, source.shapes());
            let done = results.decide(grounds, pairs.clone(), &mut shapes, choices);
            *decided = done.and_then(|()| results.only());
        }
    });
    let decided = jobs.map(|job| job.and_then(|(_, _, decided)| decided));
    let (mut results, mut shapes) = (Results::<W>::NONE, source.shapes());
    let mut end = choices.len() + 1;
    for (pairs, decided) in subtrees.all().iter().zip(decided).rev() {
        let between = choices.get_mut(pairs.end - 1..end - 1)?;
        results.decide(grounds, pairs.end..end, &mut shapes, between)?;
        results.push(decided?)?;
        end = pairs.start;
    }
    results.decide(grounds, 1..end, &mut shapes, choices.get_mut(..end - 1)?)
}

/// Subtrees apart from each other, in the order of the tree.
struct Subtrees {
    /// The pairs of children in each: they follow each other, the root's own pair first.
    pairs: [Range<usize>; PARTS],
    count: usize,
}

impl Subtrees {
    /// Parts the largest subtree until there are `wanted` or all are small.
    fn of(nodes: &[BvhNode], wanted: usize) -> Option<Subtrees> {
        let mut pairs = [const { 0..0 }; PARTS];
        pairs[0] = 1..nodes.len() / 2;
        let mut subtrees = Subtrees { pairs, count: 1 };
        while subtrees.count < wanted.min(PARTS) {
            let largest = (0..subtrees.count).max_by_key(|i| subtrees.pairs[*i].len())?;
            if subtrees.pairs[largest].len() <= SMALL {
                break;
            }
            subtrees.part(nodes, largest)?;
        }
        Some(subtrees)
    }

    fn all(&self) -> &[Range<usize>] {
        &self.pairs[..self.count]
    }

    /// Replaces subtree `i` by those of the children of its root.
    fn part(&mut self, nodes: &[BvhNode], i: usize) -> Option<()> {
        let Range { start, end } = self.pairs[i].clone();
        let (left, right) = (nodes.get(2 * start)?, nodes.get(2 * start + 1)?);
        let middle = if right.is_leaf() { end } else { right.first as usize / 2 };
        let children = [(left, start + 1..middle), (right, middle..end)];
        self.pairs[i..self.count].rotate_left(1);
        self.count -= 1;
        let inner = children.into_iter().filter(|(child, _)| !child.is_leaf());
        for (at, (_, pairs)) in (i..).zip(inner) {
            *self.pairs.get_mut(self.count)? = pairs;
            self.count += 1;
            self.pairs[at..self.count].rotate_right(1);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;
    use std::vec::Vec;

    /// A tree with `count` leaves below node `node`, two thirds of them on the left.
    fn grow(nodes: &mut Vec<BvhNode>, node: usize, count: usize) {
        let leaf = BvhNode { lanes: 1, ..BvhNode::inner(&Aabb::EMPTY, 0) };
        if count == 1 {
            nodes[node] = leaf;
            return;
        }
        let pair = nodes.len();
        nodes[node] = BvhNode::inner(&Aabb::EMPTY, pair as u32);
        nodes.extend([leaf; 2]);
        let left = (2 * count / 3).max(1);
        grow(nodes, pair, left);
        grow(nodes, pair + 1, count - left);
    }

    #[test]
    fn subtrees_are_apart_and_whole() {
        let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2];
        grow(&mut nodes, 0, 20_000);
        for wanted in [1, 2, 7, PARTS] {
            let subtrees = Subtrees::of(&nodes, wanted).expect("a tree");
            assert!((wanted.min(30)..=wanted).contains(&subtrees.count), "{}", subtrees.count);
            let mut end = 1;
            for pairs in subtrees.all() {
                assert!(pairs.start >= end, "{pairs:?} begins before {end}");
                end = pairs.end;
                // All children of its pairs are its own.
                for node in &nodes[2 * pairs.start..2 * pairs.end] {
                    let child = node.first as usize / 2;
                    assert!(node.is_leaf() || (pairs.start + 1..pairs.end).contains(&child));
                }
            }
        }
    }
}
