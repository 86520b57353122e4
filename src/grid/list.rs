//! Lists that grow in memory of a given size, at one place or at several at once.

use core::mem::take;

/// A list that grows in memory of a given size.
///
/// Its elements are numbered from `first` on: one that grows in the free room of another numbers them as that one would if it
/// reached so far.
pub(crate) struct List<'b, T> {
    memory: &'b mut [T],
    first: usize,
    len: usize,
}

/// The numbers that the elements of such a list had.
#[derive(Clone, Copy)]
pub(crate) struct Piece {
    first: usize,
    len: usize,
}

impl<'b, T: Copy> List<'b, T> {
    pub fn new(memory: &'b mut [T]) -> Self {
        List { memory, first: 0, len: 0 }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// The number of the next element.
    pub fn end(&self) -> usize {
        self.first + self.len
    }

    /// The elements, to be written to too.
    pub fn all(&mut self) -> &mut [T] {
        &mut self.memory[..self.len]
    }

    /// The elements from a number on.
    pub fn from(&mut self, number: usize) -> &mut [T] {
        &mut self.memory[number - self.first..self.len]
    }

    /// Makes room for `count` more and returns the number of the first.
    pub fn grow(&mut self, count: usize) -> Option<usize> {
        let number = self.end();
        self.len = self.len.checked_add(count).filter(|len| *len <= self.memory.len())?;
        Some(number)
    }

    pub fn push(&mut self, x: T) -> Option<()> {
        *self.memory.get_mut(self.len)? = x;
        self.len += 1;
        Some(())
    }

    /// Drops the elements from a number on.
    pub fn shrink_to(&mut self, number: usize) {
        self.len = self.len.min(number - self.first);
    }

    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The room that is left.
    pub fn rest(&mut self) -> &mut [T] {
        &mut self.memory[self.len..]
    }

    /// A list in the room that is left.
    pub fn free(&mut self) -> List<'_, T> {
        let first = self.end();
        List { memory: &mut self.memory[self.len..], first, len: 0 }
    }

    /// An empty list in two, the first with a `share` of `all` of its room.
    pub fn split(self, share: u64, all: u64) -> (Self, Self) {
        let room = self.memory.len() as u128 * u128::from(share) / u128::from(all.max(1));
        let room = (room as usize).min(self.memory.len());
        let (one, other) = self.memory.split_at_mut(room);
        (List::new(one).at(self.first), List::new(other).at(self.first + room))
    }

    fn at(self, first: usize) -> Self {
        List { first, ..self }
    }

    pub fn piece(&self) -> Piece {
        Piece { first: self.first, len: self.len }
    }

    /// Takes in what grew in its free room; returns by how much the numbers of that fall.
    pub fn join(&mut self, piece: Piece) -> u32 {
        let (from, fall) = (piece.first - self.first, piece.first - self.end());
        if fall > 0 {
            self.memory.copy_within(from..from + piece.len, self.len);
        }
        self.len += piece.len;
        fall as u32
    }
}

/// Takes the first elements off a slice.
pub(crate) fn front<'b, T>(slice: &mut &'b mut [T], count: usize) -> Option<&'b mut [T]> {
    let (front, rest) = take(slice).split_at_mut_checked(count)?;
    *slice = rest;
    Some(front)
}
