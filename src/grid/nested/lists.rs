//! The memory in which a nested grid grows: lists of primitives, words, and cells that wait.

use super::cost::FULL;
use super::growing::Growing;
use crate::block::{Counts, Geometry};
use crate::grid::list::List;
use crate::grid::space::Place;
use crate::prim::{Source, Survey, geometries};
use crate::scene::Scene;
use crate::storage::{ALIGNMENT, view_mut};

/// Marks the last number of a cell's list. Numbers are below 2^30.
pub(super) const END: u32 = 1 << 31;

/// Words before the numbers of a cell's list: its box.
pub(super) const BOX_WORDS: usize = 2;

/// Bytes for each number that the cells may list: four lists of numbers, one of them in pairs, words, a box for each word,
/// and two lists of cells that wait.
const BYTES_A_REF: u64 =
    20 + 8 / WORD_PER_REFS + 4 / WORD_PER_REFS + 2 * WAITING_BYTES / WAITING_PER_REFS + 1;
/// One word for so many numbers, and this many in any case.
const WORD_PER_REFS: u64 = 2;
const WORDS_AT_LEAST: u64 = 256;
/// A cell waits with so many numbers at least.
const WAITING_PER_REFS: u64 = FULL as u64;
const WAITING_BYTES: u64 = size_of::<Record>() as u64;

/// A full cell that waits to be divided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub place: Place,
    /// Its word.
    pub word: u32,
    /// Its list.
    pub first: u32,
    pub count: u32,
    /// What its word shall be, once that is known.
    pub becomes: u32,
}

/// The same as numbers.
///
/// ```text
/// word 0        3       6             7
///      | corner | scale | count, word | first, becomes |    each pair the lower half first
/// ```
pub(super) type Record = [u64; 8];

impl Waiting {
    pub fn packed(&self) -> Record {
        let ([a, b, c], [d, e, f]) = (self.place.corner, self.place.scale);
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(f64::to_bits);
        let pair = |low: u32, high: u32| u64::from(high) << 32 | u64::from(low);
        [a, b, c, d, e, f, pair(self.count, self.word), pair(self.first, self.becomes)]
    }

    pub fn unpacked([a, b, c, d, e, f, g, h]: Record) -> Self {
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(f64::from_bits);
        let place = Place { corner: [a, b, c], scale: [d, e, f] };
        let [word, becomes] = [g, h].map(|pair| (pair >> 32) as u32);
        Waiting { place, word, first: h as u32, count: g as u32, becomes }
    }
}

/// Everything that grows.
pub(super) struct Room<'s, 'a, 'b> {
    /// Where shapes are looked up.
    pub source: Source<'s, 'a>,
    /// The lists of the cells that wait, and these cells in the order of their words.
    pub list: List<'b, u32>,
    pub waiting: List<'b, Record>,
    pub growing: Growing<'b>,
}

/// The bytes in which the block begins: all that is kept there meanwhile are the geometries.
fn front(survey: &Survey) -> Counts {
    Counts { geometries: survey.geometry_count, ..Counts::default() }
}

fn words_for(refs: u64) -> u64 {
    refs / WORD_PER_REFS + WORDS_AT_LEAST
}

fn listed_for(refs: u64) -> u64 {
    refs + BOX_WORDS as u64 * words_for(refs)
}

/// The most numbers that cells can list while they grow in `size` bytes.
pub(super) fn most_refs(survey: &Survey, size: usize) -> u64 {
    let front = front(survey).offsets().map_or(usize::MAX, |at| at.end);
    let taken = front as u64 + 12 * WORDS_AT_LEAST;
    // Seven parts are aligned.
    let left = (size as u64).saturating_sub(taken + 8 * ALIGNMENT as u64);
    (left / BYTES_A_REF).min(u64::from(END / 4))
}

/// Where the words and lists that are kept begin: at the end of the memory.
fn kept_from(most: u64, size: usize) -> Option<usize> {
    let bytes = usize::try_from(4 * (words_for(most) + listed_for(most))).ok()?;
    Some(size.checked_sub(bytes)? / ALIGNMENT * ALIGNMENT)
}

/// Moves what is kept to the end of the memory, words before lists; returns where they begin.
pub(super) fn keep(most: u64, words: usize, listed: usize, bytes: &mut [u8]) -> Option<usize> {
    let from = kept_from(most, bytes.len())?;
    let kept = bytes.get_mut(from..)?;
    let len = kept.len() / 4;
    let kept = view_mut::<u32>(kept, 0, len)?;
    let first = words_for(most) as usize;
    kept.copy_within(first..first + listed, len - listed);
    kept.copy_within(..words, len - listed - words);
    Some(from + 4 * (len - listed - words))
}

impl<'s, 'a, 'b: 's> Room<'s, 'a, 'b> {
    /// Room for `most` numbers.
    pub fn new(
        scene: &'s Scene<'a, 'a>,
        survey: &Survey,
        most: u64,
        bytes: &'b mut [u8],
    ) -> Option<Self> {
        let (scratch, kept) = bytes.split_at_mut_checked(kept_from(most, bytes.len())?)?;
        let parts = front(survey).parts_mut(scratch)?;
        geometries(scene, parts.geometries);
        let geometries: &'b [Geometry] = parts.geometries;
        let most = usize::try_from(most).ok()?;
        let (words, listed) = (words_for(most as u64) as usize, listed_for(most as u64) as usize);
        let (words, listed) =
            view_mut::<u32>(kept, 0, words + listed)?.split_at_mut_checked(words)?;
        let waiting = most / WAITING_PER_REFS as usize + 1;
        let (queues, lists) = parts.rest.split_at_mut_checked(2 * waiting * size_of::<Record>())?;
        let queues = view_mut::<u64>(queues, 0, 16 * waiting)?.as_chunks_mut().0;
        let (waiting, queue) = queues.split_at_mut(waiting);
        let lists = view_mut::<u32>(lists, 0, 4 * most)?;
        let (lists, pairs) = lists.split_at_mut(2 * most);
        let (list, next) = lists.split_at_mut(most);
        let growing = Growing {
            words: List::new(words),
            listed: List::new(listed),
            next: List::new(next),
            queue: List::new(queue),
            pairs: List::new(pairs.as_chunks_mut().0),
        };
        let source = Source { scene, geometries, named: false };
        Some(Room { source, list: List::new(list), waiting: List::new(waiting), growing })
    }
}

impl Room<'_, '_, '_> {
    /// Lets those cells wait that the last round left, with room for the next one's.
    pub fn turn(&mut self) {
        core::mem::swap(&mut self.list, &mut self.growing.next);
        core::mem::swap(&mut self.waiting, &mut self.growing.queue);
        self.growing.next.clear();
        self.growing.queue.clear();
    }
}
