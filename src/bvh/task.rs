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

impl Split {
    pub const NONE: Split =
        Split { counts: [0; 2], least: [0; 2], even: [false; 2], sides: [Known::NONE; 2] };
}

/// The boxes around refs and their centres, if they are kept. They are two thirds of a task, and where room is scarce they are
/// found again.
#[derive(Clone, Copy)]
pub(super) struct Known([Extent; KEPT]);

const KEPT: usize = if SMALL { 0 } else { 1 };

impl Known {
    const NONE: Known = Known([Extent { bounds: Box4::ZERO, centres: Box4::ZERO }; KEPT]);

    /// Become those of one side of a split. Where a plane will be chosen by every `step`-th ref, the centres are those of these and
    /// the box is left open, as every pass over many refs takes its time.
    pub fn become_those_of(&mut self, refs: &[PrimRef], step: usize) {
        for extent in &mut self.0 {
            *extent = Extent::of_sample(refs, step);
            if step > 1 {
                extent.bounds = Box4::EMPTY;
            }
        }
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
    pub const UNUSED: Task = {
        let ([first, count, room], [depth, budget], known) = ([0; 3], [0; 2], Known::NONE);
        Task { node: 0, pairs: 0, first, count, room, depth, budget, even: false, known }
    };

    /// Becomes the task of the right side, and `left` that of the left one; their nodes are the pair at `pair`. The right one's refs
    /// are moved behind the left one's room.
    pub fn part(
        &mut self,
        left: &mut Task,
        split: &Split,
        pair: u32,
        slots: &mut [PrimRef],
    ) -> Option<()> {
        let ([count, right_count], budget) = (split.counts, share(self, split));
        // Each side has its part of the free slots.
        let free = self.room.checked_sub(count + right_count)?;
        let room = count + part_of(free, count, count + right_count);
        // Compact trees are not cut.
        if WIDE && free > 0 {
            slots.get(..room + right_count)?;
            slots.copy_within(count..count + right_count, room);
        }
        self.depth += 1;
        (left.node, left.pairs, left.first, left.depth) = (pair, pair + 2, self.first, self.depth);
        (left.count, left.room, left.budget) = (count, room, budget);
        (left.even, left.known) = (split.even[0], split.sides[0]);
        // A subtree has a pair for each of its leaves but one.
        self.pairs = left.pairs + 2 * (budget as u32).saturating_sub(1);
        self.node = pair + 1;
        (self.first, self.count) = (self.first + room, right_count);
        (self.room, self.budget) = (self.room - room, self.budget - budget);
        (self.even, self.known) = (split.even[1], split.sides[1]);
        Some(())
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

    /// The task that is next.
    pub fn last(&self) -> Option<&Task> {
        self.tasks.get(self.count.checked_sub(1)?)
    }

    /// Takes it away.
    pub fn pop(&mut self) {
        self.count -= 1;
    }

    /// Replaces it by those of its sides, the left one last: where they stand.
    pub fn part_last(&mut self, split: &Split, pair: u32, slots: &mut [PrimRef]) -> Option<()> {
        let last = self.tasks.get_mut(self.count.checked_sub(1)?..)?;
        let [task, left, ..] = last else { return None };
        task.part(left, split, pair, slots)?;
        self.count += 1;
        Some(())
    }
}
