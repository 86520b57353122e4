//! Places that a search comes back to, in room that is not written before it is needed.

#![allow(unsafe_code, reason = "a large array is not worth writing before it is needed")]

use core::mem::MaybeUninit;

/// The last pushed comes first. Those below `count` are written.
pub(crate) struct Pending<E, const ROOM: usize> {
    entries: [MaybeUninit<E>; ROOM],
    count: usize,
}

impl<E: Copy, const ROOM: usize> Pending<E, ROOM> {
    pub const NONE: Self = Pending { entries: [const { MaybeUninit::uninit() }; ROOM], count: 0 };

    /// False when there is no room.
    #[inline(always)]
    pub fn push(&mut self, new: E) -> bool {
        let Some(entry) = self.entries.get_mut(self.count) else { return false };
        entry.write(new);
        self.count += 1;
        true
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<E> {
        self.count = self.count.checked_sub(1)?;
        // SAFETY: a push wrote it, and counted it afterwards.
        Some(unsafe { self.entries.get(self.count)?.assume_init() })
    }

    /// Forgets them all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
    }
}
