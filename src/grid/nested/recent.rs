//! Where triangles were packed a moment ago.

use super::lists::END;
use crate::block::leaf::TRIANGLES;

/// Blocks of which the triangles are known: the one being filled, and those before it.
const BLOCKS: u32 = u64::BITS;
/// Twice as many as such blocks hold, so that few want one slot.
const SLOTS: usize = 2 * BLOCKS as usize * TRIANGLES;
/// Numbers of a list that are looked at together.
pub(super) const TOGETHER: usize = 64;

const NOWHERE: u32 = u32::MAX;

/// The last place of each of the triangles that were packed a moment ago, unless another has taken its slot.
pub(super) struct Recent {
    ids: [u32; SLOTS],
    /// Block and lane, the latter in the lowest four bits.
    places: [u32; SLOTS],
}

/// What known blocks hold of some numbers, by how many blocks there are behind them.
pub(super) struct Held {
    /// Where each of the numbers is; nothing for those that are to be packed.
    ages: [u8; TOGETHER],
    lanes: [u16; BLOCKS as usize],
    /// The blocks that hold any.
    blocks: u64,
    /// How many numbers there are.
    count: u32,
}

impl Recent {
    pub const NONE: Self = Recent { ids: [NOWHERE; SLOTS], places: [0; SLOTS] };

    /// Writes down where a triangle is packed.
    #[inline]
    pub fn put(&mut self, id: u32, block: u32, lane: u32) {
        let slot = id as usize % SLOTS;
        (self.ids[slot], self.places[slot]) = (id, block << 4 | lane & 15);
    }

    /// Finds what is known of some numbers while block `open` is filled.
    #[inline]
    pub fn hold(&self, ids: &[u32], open: u32, held: &mut Held) {
        (held.lanes, held.blocks, held.count) = ([0; BLOCKS as usize], 0, ids.len() as u32);
        for (id, age_of_id) in ids.iter().zip(&mut held.ages) {
            let id = id & !END;
            let slot = id as usize % SLOTS;
            let age = open.wrapping_sub(self.places[slot] >> 4);
            // No branches, since nobody could guess them.
            let is_known = (self.ids[slot] == id) & (age < BLOCKS);
            *age_of_id = if is_known { age as u8 } else { u8::MAX };
            held.lanes[age as usize % BLOCKS as usize] |=
                u16::from(is_known) << (self.places[slot] & 15);
            held.blocks |= u64::from(is_known) << (age % BLOCKS);
        }
    }
}

impl Held {
    pub const NONE: Self =
        Held { ages: [u8::MAX; TOGETHER], lanes: [0; BLOCKS as usize], blocks: 0, count: 0 };

    /// Keeps the blocks that hold at least `least` of the numbers, or all, and the one being filled whatever it holds. The others hold
    /// nothing from now on.
    #[inline]
    pub fn keep(&mut self, least: u32) {
        let least = least.min(self.count);
        for age in Bits64(self.blocks & !1) {
            if self.lanes[age as usize % BLOCKS as usize].count_ones() < least {
                self.blocks &= !(1 << age);
            }
        }
    }

    /// The blocks that hold any of the numbers, the oldest first: by age, and with the lanes of these.
    #[inline]
    pub fn blocks(&self) -> impl Iterator<Item = (u32, u32)> {
        Bits64(self.blocks).map(|age| (age, u32::from(self.lanes[age as usize % BLOCKS as usize])))
    }

    /// Writes those of the numbers that are in no block that was kept; returns how many these are.
    #[inline]
    pub fn left(&self, ids: &[u32], left: &mut [u32; TOGETHER]) -> usize {
        let mut count = 0;
        for (id, age) in ids.iter().zip(self.ages) {
            left[count % TOGETHER] = *id;
            let age = u32::from(age);
            count += usize::from((age >= BLOCKS) | (self.blocks >> (age % BLOCKS) & 1 == 0));
        }
        count
    }
}

/// The places of bits, the highest first.
struct Bits64(u64);

impl Iterator for Bits64 {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        let place = self.0.checked_ilog2()?;
        self.0 &= !(1 << place);
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn hold(recent: &Recent, ids: &[u32], open: u32) -> Held {
        // What was held before does not matter.
        let mut held =
            Held { ages: [3; TOGETHER], lanes: [9; BLOCKS as usize], blocks: 9, count: 9 };
        recent.hold(ids, open, &mut held);
        held
    }

    fn kept(held: &mut Held, least: u32) -> Vec<(u32, u32)> {
        held.keep(least);
        held.blocks().collect()
    }

    #[test]
    fn blocks_that_hold_enough_are_kept() {
        let mut recent = Recent::NONE;
        for (id, block, lane) in [(7, 3, 0), (8, 3, 2), (9, 4, 1), (10, 5, 15), (11, 3, 4)] {
            recent.put(id, block, lane);
        }
        let ids = [7, 8, 9, 10, 11 | END, 12];
        let mut held = hold(&recent, &ids, 5);
        assert_eq!(kept(&mut held, 2), [(2, 0b10101), (0, 1 << 15)]);
        let mut left = [0; TOGETHER];
        let count = held.left(&ids, &mut left);
        assert_eq!(left[..count], [9, 12]);
        let mut held = hold(&recent, &ids[..2], 5);
        assert_eq!(kept(&mut held, 9), [(2, 0b101)], "all of them");
        let mut held = hold(&recent, &ids[..2], 3 + BLOCKS);
        assert_eq!(kept(&mut held, 1), [], "too long ago");
    }

    #[test]
    fn the_last_place_counts() {
        let mut recent = Recent::NONE;
        recent.put(5, 0, 3);
        recent.put(5, 1, 0);
        assert_eq!(kept(&mut hold(&recent, &[5], 1), 9), [(0, 1)]);
        recent.put(5 + SLOTS as u32, 1, 1);
        assert_eq!(kept(&mut hold(&recent, &[5], 1), 1), [], "another took its slot");
    }
}
