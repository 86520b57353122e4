//! What is still to be split while a tree grows.

use super::MAX_DEPTH;
use super::refs::PrimRef;
use super::split::{Box4, Extent};
use crate::kinds::WIDE;
use crate::simd::SMALL;

/// A subtree to build: the refs `first .. first + count` under node `node`.
#[derive(Clone, Copy)]
pub(super) struct Task {
    pub node: u32,
    /// Where the nodes below it begin.
    pub pairs: u32,
    pub first: usize,
    pub count: usize,
    /// Slots for its refs, from `first` on: more than there are, where refs may be cut.
    pub room: usize,
    pub depth: usize,
    /// Leaves it may have.
    pub budget: usize,
    /// Whether the areas of its refs are known to be alike.
    pub even: bool,
    pub known: Known,
}

/// Where a node's refs are parted, the fewest leaves that either side needs, and their boxes.
pub(super) struct Split {
    pub counts: [usize; 2],
    pub least: [usize; 2],
    pub even: [bool; 2],
    pub sides: [Known; 2],
}

/// The boxes around refs and their centres, if they are kept. They are two thirds of a task, and where room is scarce they are
/// found again.
#[derive(Clone, Copy)]
pub(super) struct Known([Extent; KEPT]);

const KEPT: usize = if SMALL { 0 } else { 1 };

impl Known {
    /// Those of one side of a split. Where a plane will be chosen by every `step`-th ref, the centres are those of these and
    /// the box is left open, as every pass over many refs takes its time.
    pub fn of_side(refs: &[PrimRef], step: usize) -> Known {
        let mut known = Known([Extent::EMPTY; KEPT]);
        for extent in &mut known.0 {
            *extent = Extent::of_sample(refs, step);
            if step > 1 {
                extent.bounds = Box4::EMPTY;
            }
        }
        known
    }

    pub fn of(extent: Extent) -> Known {
        Known([extent; KEPT])
    }

    /// The same boxes, of the same refs.
    pub fn extent(&self, refs: &[PrimRef], step: usize) -> Extent {
        let again = || {
            let Extent { bounds, .. } = Extent::around(refs);
            Extent { bounds, ..Extent::of_sample(refs, step) }
        };
        self.0.first().copied().unwrap_or_else(again)
    }
}

impl Task {
    /// All zero, as that takes no room in a program.
    const UNUSED: Task = {
        let zero = Extent { bounds: Box4::ZERO, centres: Box4::ZERO };
        let ([first, count, room], [depth, budget], known) = ([0; 3], [0; 2], Known([zero; KEPT]));
        Task { node: 0, pairs: 0, first, count, room, depth, budget, even: false, known }
    };

    /// The tasks of the sides, whose nodes are the pair at `pair`. The right one's refs are moved behind
    /// the left one's room.
    pub fn children(&self, split: &Split, pair: u32, slots: &mut [PrimRef]) -> Option<[Task; 2]> {
        let depth = self.depth + 1;
        let ([count, right_count], budget) = (split.counts, share(self, split));
        let ([left, right], [even, right_even]) = (split.sides, split.even);
        let (first, pairs) = (self.first, pair + 2);
        // Each side has its part of the free slots.
        let free = self.room.checked_sub(count + right_count)?;
        let room = count + part_of(free, count, count + right_count);
        // Compact trees are not cut.
        if WIDE && free > 0 {
            slots.get(..room + right_count)?;
            slots.copy_within(count..count + right_count, room);
        }
        let left = Task { node: pair, pairs, first, count, room, depth, budget, even, known: left };
        // A subtree has a pair for each of its leaves but one.
        let pairs = pairs + 2 * (budget as u32).saturating_sub(1);
        let (first, count, room) = (first + room, right_count, self.room - room);
        let budget = self.budget - budget;
        let (node, even) = (pair + 1, right_even);
        Some([left, Task { node, pairs, first, count, room, depth, budget, even, known: right }])
    }
}

/// The leaves that the left child may have: its share by count, but enough for either side.
fn share(task: &Task, split: &Split) -> usize {
    let ([least, least_right], [left, right]) = (split.least, split.counts);
    let most = task.budget.saturating_sub(least_right).max(least);
    part_of(task.budget, left, left + right).max(least).min(most).min(task.budget)
}

/// As much of `all` as `part` is of `whole`, rounded down. Both are below 2^30.
fn part_of(all: usize, part: usize, whole: usize) -> usize {
    if SMALL {
        return long_division(all, part, whole);
    }
    (all as u64 * part as u64).checked_div(whole as u64).unwrap_or(0) as usize
}

/// The same bit by bit: processors of 32 bits have no division of 64.
fn long_division(all: usize, part: usize, whole: usize) -> usize {
    let (mut quotient, mut rest) = (0, 0);
    for bit in (0..30).rev() {
        (quotient, rest) = (2 * quotient, 2 * rest + if all >> bit & 1 == 1 { part } else { 0 });
        // Twice at most, as `part` is no more than `whole`.
        while rest >= whole && whole > 0 {
            (quotient, rest) = (quotient + 1, rest - whole);
        }
    }
    quotient
}

/// Tasks to come back to: one a level at most.
pub(super) struct Tasks {
    tasks: [Task; MAX_DEPTH],
    count: usize,
}

impl Tasks {
    pub const NONE: Self = Tasks { tasks: [Task::UNUSED; MAX_DEPTH], count: 0 };

    /// `None` when there is no room.
    pub fn push(&mut self, task: &Task) -> Option<()> {
        *self.tasks.get_mut(self.count)? = *task;
        self.count += 1;
        Some(())
    }

    /// The task pushed last.
    pub fn pop(&mut self) -> Option<Task> {
        self.count = self.count.checked_sub(1)?;
        self.tasks.get(self.count).copied()
    }
}
