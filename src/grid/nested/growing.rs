//! What grows while cells are divided, at one place or at several at once.

use super::lists::{Record, Waiting};
use crate::block::cells::{Cell, cell};
use crate::grid::list::{List, Piece};

/// What grows while cells are divided.
pub(super) struct Growing<'b> {
    /// The words of the finished block, but for lists instead of runs.
    pub words: List<'b, u32>,
    /// The lists of the cells that are not divided, each with a box before it and an [`END`](super::lists::END).
    pub listed: List<'b, u32>,
    /// The lists of the cells that wait for the next round, and these.
    pub next: List<'b, u32>,
    pub queue: List<'b, Record>,
    /// Pairs of a cell and a number, while a grid is filled.
    pub pairs: List<'b, [u32; 2]>,
}

/// What a [`Growing`] grew to.
pub(super) struct Pieces {
    words: Piece,
    listed: Piece,
    next: Piece,
    queue: Piece,
}

impl Growing<'_> {
    /// The same in all the room that is left.
    pub fn free(&mut self) -> Growing<'_> {
        self.pairs.clear();
        Growing {
            words: self.words.free(),
            listed: self.listed.free(),
            next: self.next.free(),
            queue: self.queue.free(),
            pairs: self.pairs.free(),
        }
    }

    /// How far each list reaches.
    pub fn ends(&self) -> [usize; 4] {
        [self.words.end(), self.listed.end(), self.next.end(), self.queue.end()]
    }

    /// Drops what came after that.
    pub fn shrink_to(&mut self, [words, listed, next, queue]: [usize; 4]) {
        self.words.shrink_to(words);
        self.listed.shrink_to(listed);
        self.next.shrink_to(next);
        self.queue.shrink_to(queue);
    }

    /// What has not grown yet in two, the first with a `share` of `all` of the room.
    pub fn split(self, share: u64, all: u64) -> (Self, Self) {
        let (words, more_words) = self.words.split(share, all);
        let (listed, more_listed) = self.listed.split(share, all);
        let (next, more_next) = self.next.split(share, all);
        let (queue, more_queue) = self.queue.split(share, all);
        let (pairs, more_pairs) = self.pairs.split(share, all);
        let rest = Growing {
            words: more_words,
            listed: more_listed,
            next: more_next,
            queue: more_queue,
            pairs: more_pairs,
        };
        (Growing { words, listed, next, queue, pairs }, rest)
    }

    pub fn pieces(&self) -> Pieces {
        Pieces {
            words: self.words.piece(),
            listed: self.listed.piece(),
            next: self.next.piece(),
            queue: self.queue.piece(),
        }
    }

    /// Takes in what grew in the free room when the cells of `divided` were, and writes down what became of them.
    pub fn join(&mut self, pieces: &Pieces, divided: &[Record]) {
        let (first_word, first_waiting) = (self.words.end(), self.queue.end());
        let words_fall = self.words.join(pieces.words);
        let lists_fall = self.listed.join(pieces.listed);
        let next_fall = self.next.join(pieces.next);
        self.queue.join(pieces.queue);
        if lists_fall > 0 {
            for word in self.words.from(first_word) {
                *word -= if let Cell::Boxed(_) = cell(*word) { lists_fall } else { 0 };
            }
        }
        if words_fall | next_fall > 0 {
            for record in self.queue.from(first_waiting) {
                let mut waiting = Waiting::unpacked(*record);
                waiting.word -= words_fall;
                waiting.first -= next_fall;
                *record = waiting.packed();
            }
        }
        for record in divided {
            let Waiting { word, becomes, .. } = Waiting::unpacked(*record);
            let fall = if let Cell::Boxed(_) = cell(becomes) { lists_fall } else { words_fall };
            self.words.all()[word as usize] = becomes - fall;
        }
    }
}
