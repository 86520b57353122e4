//! A finished block as typed slices.

#![allow(unsafe_code, reason = "parts are found once for each ray, and checked before")]

use super::bundle::Bundles;
use super::cells::{GridHead, Run};
use super::leaf::{Geometry, SphereBlock, TriangleBlock};
use super::level::Level;
use super::{
    BYTE_ORDER, BvhNode, Counts, Header, KIND_GRID, LAYOUT_COMPACT, MAGIC, Motion, VERSION,
};
use crate::error::OpenError;
use crate::kinds::{BALLS, GRID, INSTANCES, WIDE};
use crate::storage::{self, ALIGNMENT};

/// A block as typed slices.
#[derive(Clone, Copy)]
pub(crate) struct Block<'m> {
    pub whole: Finished<'m>,
    pub header: &'m Header,
    pub geometries: &'m [Geometry],
    pub prim_ids: &'m [u32],
    pub grids: &'m [GridHead],
    pub nodes: &'m [BvhNode],
    pub bundles: Bundles<'m>,
    pub words: &'m [u32],
    pub sphere_blocks: &'m [SphereBlock],
    pub triangle_blocks: &'m [TriangleBlock],
    pub runs: &'m [Run],
}

/// The bytes of a finished block: header and sizes are right.
#[derive(Clone, Copy)]
pub(crate) struct Finished<'m>(&'m [u8]);

impl<'m> Finished<'m> {
    /// A block that was found right before; `None` when it does not even begin as one. One call for one ray
    /// ends here, so nothing is checked again.
    ///
    /// # Safety
    ///
    /// `block` points to a header, aligned as one. If that begins as a block does, it is the header of a
    /// finished block, all of which is there, and nobody writes to it during `'m`.
    #[inline(always)]
    pub unsafe fn known(block: *const u8) -> Option<Self> {
        // SAFETY: the caller's promise.
        let header: &'m Header = unsafe { &*block.cast() };
        let begins_right = header.magic == MAGIC && header.byte_order == BYTE_ORDER;
        let size = header.size as usize;
        // SAFETY: the caller's promise.
        (begins_right && header.version == VERSION)
            .then(|| Finished(unsafe { core::slice::from_raw_parts(block, size) }))
    }

    /// The block at the front of `bytes`; what its parts hold is not looked at.
    ///
    /// Checked are: alignment, magic, byte order, version, layout, and that the counts give just
    /// the size that the header names, which is no more than there is; or, if there are instances, no more than that size, and
    /// that what belongs to them is there.
    pub fn split(bytes: &'m [u8]) -> Result<Self, OpenError> {
        let (header, end) = front(bytes)?;
        let has_level = INSTANCES && header.level != 0;
        let ends = match has_level {
            true => u64::from(header.level) * ALIGNMENT as u64 == end as u64,
            false => header.size == end as u64,
        };
        let size = usize::try_from(header.size).map_err(|_| OpenError::Corrupt)?;
        if !ends || size < end {
            return Err(OpenError::Corrupt);
        }
        let whole = bytes.get(..size).map(Finished).ok_or(OpenError::Truncated)?;
        if has_level {
            Level::split(whole, end)?;
        }
        Ok(whole)
    }

    /// The same for a block without instances.
    pub fn split_plain(bytes: &'m [u8]) -> Result<Self, OpenError> {
        let (header, end) = front(bytes)?;
        if header.level != 0 || header.size != end as u64 {
            return Err(OpenError::Corrupt);
        }
        bytes.get(..end).map(Finished).ok_or(OpenError::Truncated)
    }

    /// Whether it has instances.
    #[inline(always)]
    pub fn has_level(self) -> bool {
        INSTANCES && self.header().level != 0
    }

    /// What belongs to its instances, if it has any.
    pub fn level(self) -> Option<Level<'m>> {
        match self.header().level {
            0 => None,
            _ if !INSTANCES => None,
            lines => Level::of(self, lines as usize * ALIGNMENT),
        }
    }

    /// Its header.
    #[inline(always)]
    pub fn header(self) -> &'m Header {
        // SAFETY: whoever made this has found an aligned header in front.
        unsafe { &*self.0.as_ptr().cast() }
    }

    /// What it keeps for refitting, if it may be.
    pub fn motion(self) -> Option<&'m Motion> {
        let counts = &self.header().counts;
        let at = counts.offsets()?.motions;
        storage::view(self.0, at, counts.motions as usize)?.first()
    }

    /// All of it.
    #[inline(always)]
    pub fn bytes(self) -> &'m [u8] {
        self.0
    }

    /// Its parts. Those that are not used cost nothing: this is done for each ray.
    #[allow(clippy::multiple_unsafe_ops_per_block, reason = "one proof covers all parts")]
    #[inline(always)]
    pub fn parts(self) -> Block<'m> {
        let block = self.0.as_ptr();
        // SAFETY: whoever made this has found an aligned header in front, whose counts fit into the bytes: the
        // parts follow each other in this order.
        unsafe {
            let header: &'m Header = &*block.cast();
            let Counts { geometries, prim_ids, grids, nodes, bundle_lanes, .. } = header.counts;
            let Counts { words, sphere_blocks, triangle_blocks, runs, .. } = header.counts;
            // What this build does not know no block has that it opens.
            let [grids, words, runs] = [grids, words, runs].map(|n| if GRID { n } else { 0 });
            let sphere_blocks = if BALLS { sphere_blocks } else { 0 };
            let mut at = At::new(block, size_of::<Header>());
            let (geometries, prim_ids) = (at.part(geometries), at.part(prim_ids));
            // Either bundles or nodes and grids: see `has_one_structure`.
            let (mut narrow, mut bundles) = ((&[][..], &[][..], &[][..]), Bundles::None);
            match header.layout {
                4 if WIDE => bundles = Bundles::Four(at.part(bundle_lanes / 4)),
                8 if WIDE => bundles = Bundles::Eight(at.part(bundle_lanes / 8)),
                16 if WIDE => bundles = Bundles::Sixteen(at.part(bundle_lanes / 16)),
                _ => narrow = (at.part(grids), at.part(nodes), at.part(words)),
            }
            let (grids, nodes, words) = narrow;
            let sphere_blocks = at.part(sphere_blocks);
            let (triangle_blocks, runs) = (at.part(triangle_blocks), at.part(runs));
            Block {
                whole: self,
                header,
                geometries,
                prim_ids,
                grids,
                nodes,
                bundles,
                words,
                sphere_blocks,
                triangle_blocks,
                runs,
            }
        }
    }
}

/// The header at the front of a block, if all but its size is right, and where its own primitives end.
fn front(bytes: &[u8]) -> Result<(&Header, usize), OpenError> {
    if !bytes.as_ptr().cast::<Header>().is_aligned() {
        return Err(OpenError::Misaligned);
    }
    let Some(header) = storage::view::<Header>(bytes, 0, 1).and_then(<[_]>::first) else {
        let right = |(i, letter): (usize, &u8)| bytes.get(i).is_none_or(|byte| byte == letter);
        let begins_right = MAGIC.iter().enumerate().all(right);
        return Err(if begins_right { OpenError::Truncated } else { OpenError::NotABlock });
    };
    // As numbers: else it would be a call.
    if u64::from_ne_bytes(header.magic) != u64::from_ne_bytes(MAGIC) {
        return Err(OpenError::NotABlock);
    }
    if header.byte_order == BYTE_ORDER.swap_bytes() {
        return Err(OpenError::ByteOrder);
    }
    if header.byte_order != BYTE_ORDER {
        return Err(OpenError::Corrupt);
    }
    if header.version != VERSION {
        return Err(OpenError::Version);
    }
    if !is_known(header) {
        return Err(OpenError::Layout);
    }
    let counts = &header.counts;
    let width = if header.layout == LAYOUT_COMPACT { u32::MAX } else { header.layout };
    let end = counts.offsets().ok_or(OpenError::Corrupt)?.end;
    if !has_one_structure(header)
        || (WIDE && counts.bundle_lanes % width.max(1) != 0)
        || counts.motions > 1
    {
        return Err(OpenError::Corrupt);
    }
    Ok((header, end))
}

/// Whether a block has the parts of one structure: bundles, or what else there is.
#[inline]
fn has_one_structure(header: &Header) -> bool {
    let Counts { grids, nodes, words, bundle_lanes, .. } = header.counts;
    match header.layout {
        LAYOUT_COMPACT => bundle_lanes == 0,
        _ => grids | nodes | words == 0,
    }
}

/// Whether this build of the library reads what is in a block.
#[inline]
fn is_known(header: &Header) -> bool {
    let Counts { grids, words, runs, bundle_lanes, sphere_blocks, .. } = header.counts;
    (header.layout == LAYOUT_COMPACT || WIDE && matches!(header.layout, 4 | 8 | 16))
        && (GRID || header.kind != KIND_GRID)
        && (GRID || grids | words | runs == 0)
        && (WIDE || bundle_lanes == 0)
        // The index over instances holds their boxes as if they were spheres.
        && (BALLS || sphere_blocks == 0)
        && (INSTANCES || header.level == 0)
}

/// The way through the parts of a finished block.
pub(super) struct At {
    block: *const u8,
    offset: usize,
}

impl At {
    /// At byte `offset`.
    #[inline(always)]
    pub fn new(block: *const u8, offset: usize) -> Self {
        At { block, offset }
    }

    /// Where what follows lies.
    ///
    /// # Safety
    ///
    /// That is within the block, or at its end.
    #[inline(always)]
    pub unsafe fn place(&self) -> *const u8 {
        // SAFETY: the caller's promise.
        unsafe { self.block.add(self.offset) }
    }

    /// The next part, of `count` elements.
    ///
    /// # Safety
    ///
    /// The elements are there, and nobody writes to them during `'m`.
    #[inline(always)]
    pub unsafe fn part<'m, T: storage::Plain>(&mut self, count: u32) -> &'m [T] {
        // SAFETY: within the block, by the caller's promise.
        let first = unsafe { self.place() }.cast::<T>();
        // It ends within the block, so this does not overflow.
        let size = count as usize * size_of::<T>() + (ALIGNMENT - 1);
        self.offset += size & !(ALIGNMENT - 1);
        // SAFETY: parts start at multiples of 64, `T` is plain, and the caller promises the rest.
        unsafe { core::slice::from_raw_parts(first, count as usize) }
    }
}
