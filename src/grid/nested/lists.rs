//! The memory in which a nested grid grows: lists of primitives, words, and cells that wait.

use crate::block::{Counts, Geometry};
use crate::grid::space::Place;
use crate::prim::Survey;
use crate::storage::{ALIGNMENT, view_mut};

/// Marks the last number of a cell's list. Numbers are below 2^30.
pub(super) const END: u32 = 1 << 31;

/// Words before the numbers of a cell's list: its box.
pub(super) const BOX_WORDS: usize = 2;

/// The numbers of all lists, without what is before each.
pub(super) fn numbers(listed: &[u32]) -> impl Iterator<Item = u32> {
    let mut skipped = 0;
    listed.iter().copied().filter(move |word| {
        let is_number = skipped == BOX_WORDS;
        skipped = match is_number {
            false => skipped + 1,
            true if word & END != 0 => 0,
            true => BOX_WORDS,
        };
        is_number
    })
}

/// Bytes for each number that the cells may list: four lists of numbers, one of them in pairs, words, a box for each word,
/// and two lists of cells that wait.
const BYTES_A_REF: u64 =
    20 + 8 / WORD_PER_REFS + 4 / WORD_PER_REFS + 2 * WAITING_BYTES / WAITING_PER_REFS + 1;
/// One word for so many numbers, and this many in any case.
const WORD_PER_REFS: u64 = 2;
const WORDS_AT_LEAST: u64 = 256;
/// A cell waits with so many numbers at least.
const WAITING_PER_REFS: u64 = 16;
const WAITING_BYTES: u64 = 8 * Waiting::WORDS as u64;

/// A full cell that waits to be divided.
///
/// ```text
/// word 0        3       6              7
///      | corner | scale | word, count | first |
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub place: Place,
    /// Its word.
    pub word: u32,
    /// Its list.
    pub first: u32,
    pub count: u32,
}

impl Waiting {
    const WORDS: usize = 8;

    fn packed(&self) -> [u64; Self::WORDS] {
        let ([a, b, c], [d, e, f]) = (self.place.corner, self.place.scale);
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(f64::to_bits);
        let word = u64::from(self.word) << 32 | u64::from(self.count);
        [a, b, c, d, e, f, word, u64::from(self.first)]
    }

    fn unpacked([a, b, c, d, e, f, word, first]: [u64; Self::WORDS]) -> Self {
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(f64::from_bits);
        let place = Place { corner: [a, b, c], scale: [d, e, f] };
        Waiting { place, word: (word >> 32) as u32, first: first as u32, count: word as u32 }
    }
}

/// A list that grows in memory of a given size.
pub(super) struct List<'b> {
    memory: &'b mut [u32],
    len: usize,
}

impl<'b> List<'b> {
    fn new(memory: &'b mut [u32]) -> Self {
        List { memory, len: 0 }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// The elements, to be written to too.
    pub fn all(&mut self) -> &mut [u32] {
        &mut self.memory[..self.len]
    }

    /// Makes room for `count` more and returns where they begin.
    pub fn grow(&mut self, count: usize) -> Option<usize> {
        let first = self.len;
        self.len = first.checked_add(count).filter(|len| *len <= self.memory.len())?;
        Some(first)
    }

    pub fn push(&mut self, x: u32) -> Option<()> {
        let first = self.grow(1)?;
        self.memory[first] = x;
        Some(())
    }

    pub fn shrink_to(&mut self, len: usize) {
        self.len = self.len.min(len);
    }
}

/// Cells that wait, in the order of their words.
pub(super) struct Queue<'b> {
    memory: &'b mut [u64],
    len: usize,
}

impl Queue<'_> {
    pub fn push(&mut self, cell: &Waiting) -> Option<()> {
        let chunk = self.memory.as_chunks_mut::<{ Waiting::WORDS }>().0.get_mut(self.len)?;
        *chunk = cell.packed();
        self.len += 1;
        Some(())
    }

    pub fn get(&self, i: usize) -> Option<Waiting> {
        let chunks = self.memory.as_chunks::<{ Waiting::WORDS }>().0;
        chunks.get(i).filter(|_| i < self.len).map(|chunk| Waiting::unpacked(*chunk))
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn clear(&mut self) {
        self.len = 0;
    }
}

/// Everything that grows.
pub(super) struct Room<'b> {
    pub geometries: &'b mut [Geometry],
    /// The words of the finished block, but for lists instead of runs.
    pub words: List<'b>,
    /// The lists of the cells that are not divided, each with a box before it and an [`END`].
    pub listed: List<'b>,
    /// The lists of cells that wait, and the lists of those that wait for the next round.
    pub lists: [List<'b>; 2],
    pub waiting: [Queue<'b>; 2],
    /// Pairs of a cell and a number, while a grid is filled.
    pub pairs: List<'b>,
}

/// The bytes in which the block begins: all that is kept there meanwhile are the geometries.
fn front(survey: &Survey) -> Option<usize> {
    let counts = Counts { geometries: survey.geometry_count, ..Counts::default() };
    Some(counts.offsets()?.end)
}

fn words_for(refs: u64) -> u64 {
    refs / WORD_PER_REFS + WORDS_AT_LEAST
}

fn listed_for(refs: u64) -> u64 {
    refs + BOX_WORDS as u64 * words_for(refs)
}

impl<'b> Room<'b> {
    /// The most numbers that cells can list while they grow in `size` bytes.
    pub fn most_refs(survey: &Survey, size: usize) -> u64 {
        let taken = front(survey).unwrap_or(usize::MAX) as u64 + 12 * WORDS_AT_LEAST;
        // Seven parts are aligned.
        let left = (size as u64).saturating_sub(taken + 8 * ALIGNMENT as u64);
        (left / BYTES_A_REF).min(u64::from(END / 4))
    }

    /// Where the words and lists that are kept begin: at the end of the memory.
    pub fn kept_from(most: u64, size: usize) -> Option<usize> {
        let bytes = usize::try_from(4 * (words_for(most) + listed_for(most))).ok()?;
        Some(size.checked_sub(bytes)? / ALIGNMENT * ALIGNMENT)
    }

    /// Moves what is kept to the end of the memory, words before lists; returns where they begin.
    pub fn keep(most: u64, words: usize, listed: usize, bytes: &mut [u8]) -> Option<usize> {
        let from = Self::kept_from(most, bytes.len())?;
        let kept = bytes.get_mut(from..)?;
        let len = kept.len() / 4;
        let kept = view_mut::<u32>(kept, 0, len)?;
        let first = words_for(most) as usize;
        kept.copy_within(first..first + listed, len - listed);
        kept.copy_within(..words, len - listed - words);
        Some(from + 4 * (len - listed - words))
    }

    /// Room for `most` numbers.
    pub fn new(survey: &Survey, most: u64, bytes: &'b mut [u8]) -> Option<Self> {
        let counts = Counts { geometries: survey.geometry_count, ..Counts::default() };
        let (scratch, kept) = bytes.split_at_mut_checked(Self::kept_from(most, bytes.len())?)?;
        let parts = counts.parts_mut(scratch)?;
        let most = usize::try_from(most).ok()?;
        let (words, listed) = (words_for(most as u64) as usize, listed_for(most as u64) as usize);
        let (words, listed) =
            view_mut::<u32>(kept, 0, words + listed)?.split_at_mut_checked(words)?;
        let waiting = (most / WAITING_PER_REFS as usize + 1) * Waiting::WORDS;
        let (queues, lists) = parts.rest.split_at_mut_checked(16 * waiting)?;
        let (first, second) = view_mut::<u64>(queues, 0, 2 * waiting)?.split_at_mut(waiting);
        let lists = view_mut::<u32>(lists, 0, 4 * most)?;
        let (lists, pairs) = lists.split_at_mut(2 * most);
        let (current, next) = lists.split_at_mut(most);
        Some(Room {
            geometries: parts.geometries,
            words: List::new(words),
            listed: List::new(listed),
            lists: [List::new(current), List::new(next)],
            waiting: [Queue { memory: first, len: 0 }, Queue { memory: second, len: 0 }],
            pairs: List::new(pairs),
        })
    }
}
