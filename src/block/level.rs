//! What a block with instances holds behind its own primitives.
//!
//! ```text
//! | own primitives | head | instances | children | index | child | child | ..
//!                                                        +- packed blocks only
//! ```
//!
//! The index is a block in the block: a list, a grid or a BVH over the boxes of the instances, whose primitive numbers are
//! those of the instances. A linked block names the blocks that its instances show by address, and they stay where they
//! are; a packed one holds each of them once, behind the index, and names them by byte offset.

#![allow(
    unsafe_code,
    reason = "promises about the layouts drawn here, and blocks that are known by address"
)]

use super::Finished;
use super::view::At;
use crate::error::OpenError;
use crate::math::Aabb;
use crate::storage::{self, ALIGNMENT, Plain, align_up};

/// ```text
/// byte 0        24          28         32          36     40       44         64
///      | bounds | instances | children | is linked | calm | spread | reserved |
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct LevelHead {
    /// Around everything, instances and own primitives.
    pub bounds: Aabb,
    pub instance_count: u32,
    pub child_count: u32,
    /// 1 if children are named by address.
    pub is_linked: u32,
    /// The boxes in the index are wide enough for rays from no further than this, along each axis.
    pub calm: f32,
    /// For each unit that a ray comes from further away they must be wider by this.
    pub spread: f32,
    pub reserved: [u32; 5],
}
const _: () = assert!(size_of::<LevelHead>() == 64);

// SAFETY: numbers only; 24 + 5 * 4 + 20 = 64, so no padding.
unsafe impl Plain for LevelHead {}

/// One instance.
///
/// ```text
/// byte 0                 72     80      84     88                136      160
///      | world to object | zero | child | mask | object to world | bounds |
/// ```
///
/// What a ray needs comes first.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(8))]
pub(crate) struct InstanceRecord {
    /// The inverse of the linear part of the map, column after column, and a zero, so that each may be read as four.
    pub world_to_object: [f64; 10],
    /// Which of the children.
    pub child: u32,
    pub mask: u32,
    /// Three rows of four; the last column is the shift.
    pub object_to_world: [f32; 12],
    /// The box in the index; empty if there is nothing in it.
    pub bounds: Aabb,
}
const _: () = assert!(size_of::<InstanceRecord>() == 160);

// SAFETY: numbers only; 80 + 4 + 4 + 48 + 24 = 160, so no padding.
unsafe impl Plain for InstanceRecord {}

/// Where the parts behind the own primitives start, in bytes from the front of the block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LevelOffsets {
    pub head: usize,
    pub instances: usize,
    pub children: usize,
    pub index: usize,
}

impl LevelOffsets {
    /// For so many instances and children behind `own` bytes; `None` when the machine cannot address the end.
    pub fn new(own: usize, instances: usize, children: usize) -> Option<LevelOffsets> {
        let after = |start: usize, count: usize, size: usize| -> Option<usize> {
            let end = (start as u64).checked_add((count as u64).checked_mul(size as u64)?)?;
            usize::try_from(align_up(end)?).ok().filter(|end| isize::try_from(*end).is_ok())
        };
        let first = after(own, 1, size_of::<LevelHead>())?;
        let second = after(first, instances, size_of::<InstanceRecord>())?;
        let index = after(second, children, size_of::<u64>())?;
        Some(LevelOffsets { head: own, instances: first, children: second, index })
    }
}

/// The parts behind the own primitives of a block that is being built.
pub(crate) struct LevelMut<'b> {
    pub head: &'b mut LevelHead,
    pub instances: &'b mut [InstanceRecord],
    pub children: &'b mut [u64],
    /// What lies behind the children: room for the index.
    pub rest: &'b mut [u8],
}

impl LevelOffsets {
    /// The parts in `bytes`, which begin with the own primitives; `None` when they do not fit.
    pub fn parts_mut<'b>(
        &self,
        bytes: &'b mut [u8],
        instances: usize,
        children: usize,
    ) -> Option<LevelMut<'b>> {
        let (_, rest) = bytes.split_at_mut_checked(self.head)?;
        let (head, rest) = rest.split_at_mut_checked(self.instances - self.head)?;
        let (records, rest) = rest.split_at_mut_checked(self.children - self.instances)?;
        let (table, rest) = rest.split_at_mut_checked(self.index - self.children)?;
        Some(LevelMut {
            head: storage::view_mut::<LevelHead>(head, 0, 1)?.first_mut()?,
            instances: storage::view_mut(records, 0, instances)?,
            children: storage::view_mut(table, 0, children)?,
            rest,
        })
    }
}

/// The parts behind the own primitives of a finished block.
#[derive(Clone, Copy)]
pub(crate) struct Level<'m> {
    whole: Finished<'m>,
    pub head: &'m LevelHead,
    pub instances: &'m [InstanceRecord],
    pub children: &'m [u64],
    pub index: Finished<'m>,
}

impl<'m> Level<'m> {
    /// Those of a block whose header is right and whose own primitives end at byte `own`; what they hold is not looked at,
    /// but for the header of the index.
    pub fn split(whole: Finished<'m>, own: usize) -> Result<Self, OpenError> {
        let index = |bytes| Finished::split_plain(bytes).ok();
        Self::with_index(whole, own, index).ok_or(OpenError::Corrupt)
    }

    /// The same for a block that was found right before.
    ///
    /// Nothing is checked again: one ray begins here.
    #[allow(clippy::multiple_unsafe_ops_per_block, reason = "one proof covers all parts")]
    #[inline(always)]
    pub(super) fn of(whole: Finished<'m>, own: usize) -> Option<Self> {
        let block = whole.bytes().as_ptr();
        let mut at = At::new(block, own);
        // SAFETY: in such a block the parts follow each other in this order, and the index is whole.
        unsafe {
            let head: &LevelHead = at.part(1).first()?;
            let (instances, children) = (at.part(head.instance_count), at.part(head.child_count));
            let index = Finished::known(at.place())?;
            Some(Level { whole, head, instances, children, index })
        }
    }

    fn with_index(
        whole: Finished<'m>,
        own: usize,
        index: impl FnOnce(&'m [u8]) -> Option<Finished<'m>>,
    ) -> Option<Self> {
        let bytes = whole.bytes();
        let head = storage::view::<LevelHead>(bytes, own, 1)?.first()?;
        let (instances, children) = (head.instance_count as usize, head.child_count as usize);
        let at = LevelOffsets::new(own, instances, children)?;
        Some(Level {
            whole,
            head,
            instances: storage::view(bytes, at.instances, instances)?,
            children: storage::view(bytes, at.children, children)?,
            index: bytes.get(at.index..).filter(|rest| !rest.is_empty()).and_then(index)?,
        })
    }

    /// Whether the children are named by address.
    pub fn is_linked(&self) -> bool {
        self.head.is_linked != 0
    }

    /// The block that an instance shows.
    #[inline]
    pub fn child(&self, instance: &InstanceRecord) -> Option<Finished<'m>> {
        self.child_at(*self.children.get(instance.child as usize)?)
    }

    /// The child that an entry of `children` names.
    #[inline]
    pub fn child_at(&self, entry: u64) -> Option<Finished<'m>> {
        let place = entry as usize;
        let child = match self.is_linked() {
            false => self.whole.bytes().get(place..).filter(|rest| !rest.is_empty())?.as_ptr(),
            true => core::ptr::with_exposed_provenance(place),
        };
        // SAFETY: in a linked block, which no one but a build writes and no one can open, the address is that of a finished
        // block which the build was promised for as long as this one is used. A packed block is written by packing, or was
        // opened: then there is a finished block at each such offset.
        unsafe { Finished::known(child) }
    }

    /// Whether the children lie one after the other behind the index, up to the end of the block, and each passes.
    pub fn are_packed(&self, passes: impl Fn(Finished<'m>) -> bool) -> bool {
        let bytes = self.whole.bytes();
        let mut end = self.index_end();
        for place in self.children {
            let rest = bytes.get(end..).filter(|_| *place == end as u64);
            let child = rest.and_then(|rest| Finished::split_plain(rest).ok());
            let Some(child) = child.filter(|child| passes(*child)) else { return false };
            end += child.bytes().len();
        }
        !self.is_linked() && end == bytes.len()
    }

    /// Where the index ends, in bytes from the front of the block.
    pub fn index_end(&self) -> usize {
        let index = self.index.bytes();
        index.as_ptr().addr() - self.whole.bytes().as_ptr().addr() + index.len()
    }
}

const _: () = assert!(ALIGNMENT.is_multiple_of(align_of::<InstanceRecord>()));
