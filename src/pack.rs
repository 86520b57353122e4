//! Packing: a block that refers to others, and these, as one block.

use core::mem::MaybeUninit;

use crate::accel::Accel;
use crate::block::level::{LevelMut, LevelOffsets};
use crate::block::seal_packed;
use crate::build::Memory;
use crate::error::BuildError;
use crate::storage::{self, ALIGNMENT};

/// No child has this number yet.
const UNUSED: u32 = u32::MAX;

impl Accel<'_> {
    /// The memory that [`pack`](Self::pack) needs.
    pub fn pack_needs(&self) -> Result<Memory, BuildError> {
        let mut size = self.block().len();
        if let Some(level) = self.level().filter(|level| level.is_linked()) {
            for entry in level.children {
                let child = level.child_at(*entry).map_or(0, |child| child.bytes().len());
                size = size.checked_add(child).ok_or(BuildError::TooLarge)?;
            }
        }
        let size = Some(size).filter(|size| isize::try_from(*size).is_ok());
        let size = size.ok_or(BuildError::TooLarge)?;
        Ok(Memory { size, minimum: size, alignment: ALIGNMENT })
    }

    /// Writes the block with all that it refers to as one block to the front of `memory`, which starts at a multiple of 64
    /// bytes: what instances show once each, in the order of the first that shows it. A block that is not
    /// [linked](Self::is_linked) is copied. The answers are the same.
    pub fn pack<'p>(&self, memory: &'p mut [MaybeUninit<u8>]) -> Result<Accel<'p>, BuildError> {
        let Memory { size: minimum, alignment, .. } = self.pack_needs()?;
        let short = BuildError::OutOfMemory { minimum };
        if !memory.as_ptr().addr().is_multiple_of(alignment) {
            return Err(BuildError::Misaligned);
        }
        self.pack_into(storage::zeroed(memory.get_mut(..minimum).ok_or(short)?))
    }

    /// The same into as many bytes as it needs, aligned as blocks are.
    pub(crate) fn pack_into<'p>(&self, bytes: &'p mut [u8]) -> Result<Accel<'p>, BuildError> {
        let short = BuildError::OutOfMemory { minimum: bytes.len() };
        self.write_packed(bytes).ok_or(short)?;
        Accel::recognise(bytes).map_err(|_| short)
    }

    fn write_packed(&self, bytes: &mut [u8]) -> Option<()> {
        let block = self.block();
        copy(block, bytes.get_mut(..block.len())?);
        let Some(level) = self.level().filter(|level| level.is_linked()) else { return Some(()) };
        let own = self.own_size();
        let (instances, count) = (level.instances.len(), level.children.len());
        let at = LevelOffsets::new(own, instances, count)?;
        // The index is copied, and behind it lies what follows.
        let LevelMut { head, instances: records, children, rest } =
            at.parts_mut(bytes, instances, count)?;
        let (_, free) = rest.split_at_mut_checked(level.index.bytes().len())?;
        let order = storage::view_mut::<u32>(free, 0, count)?;
        order.fill(UNUSED);
        let mut next = 0;
        for record in records {
            let number = order.get_mut(record.child as usize)?;
            if *number == UNUSED {
                // For now the place of the child among the packed ones.
                *number = next;
                next += 1;
            }
            *children.get_mut(*number as usize)? = *level.children.get(record.child as usize)?;
            record.child = *number;
        }
        let (mut free, mut end) = (free, block.len());
        for place in children {
            let child = level.child_at(*place)?.bytes();
            let (own, rest) = core::mem::take(&mut free).split_at_mut_checked(child.len())?;
            copy(child, own);
            *place = end as u64;
            end += child.len();
            free = rest;
        }
        head.is_linked = 0;
        seal_packed(bytes, end)
    }
}

/// For slices of one length, without a panic for those of two.
fn copy(from: &[u8], to: &mut [u8]) {
    for (from, to) in from.iter().zip(to) {
        *to = *from;
    }
}
