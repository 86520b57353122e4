//! Words of a block by what they mean: those that belong to instances and to refitting, which words anywhere hardly ever meet.
//!
//! Also compiled into `tests/fuzz_cases.rs`.

/// A word: of which part of a block, and which of its words; modulo what there is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aim {
    /// Refitting, the head of instances, a child and a mask, a record, the table of children, the header of the index.
    pub part: usize,
    /// Which word of it.
    pub word: usize,
}

/// As `src/block/mod.rs` and `src/block/level.rs` draw them, in bytes.
const LINE: usize = 64;
const LEVEL: usize = 84;
const MOTIONS: usize = 124;
const HEAD_COUNTS: usize = 24;
const RECORD: usize = 160;
const HEADER: usize = 128;
const MOTION: usize = 16;

impl Aim {
    /// The place of the word in a sound block, if that has such a part.
    pub fn place(&self, block: &[u8]) -> Option<usize> {
        let word = |at: usize| -> Option<usize> {
            Some(u32::from_le_bytes(*block.get(at..)?.first_chunk()?) as usize)
        };
        let up = |size: usize| size.next_multiple_of(LINE);
        let level = word(LEVEL)? * LINE;
        if level == 0 || self.part.is_multiple_of(6) {
            let end = if level == 0 { block.len() } else { level };
            let (at, size) = match word(MOTIONS)? {
                0 => (LEVEL, 4),
                _ => (end.checked_sub(up(MOTION))?, MOTION),
            };
            return Some(self.within(at, size));
        }
        let [instances, children] = [word(level + HEAD_COUNTS)?, word(level + HEAD_COUNTS + 4)?];
        let records = level + LINE;
        let table = records + up(instances * RECORD);
        let index = table + up(children * 8);
        Some(match self.part % 6 {
            1 => self.within(level, LINE),
            // Which child an instance shows, and its mask.
            2 => records + self.word % instances * RECORD + 80 + self.word / instances % 2 * 4,
            3 => self.within(records, instances * RECORD),
            4 => self.within(table, children * 8),
            _ => self.within(index, HEADER),
        })
    }

    fn within(&self, at: usize, size: usize) -> usize {
        at + self.word % (size / 4) * 4
    }
}
