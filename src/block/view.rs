//! A finished block as typed slices.

use super::bundle::Bundles;
use super::cells::{GridHead, Run};
use super::leaf::{Geometry, SphereBlock, TriangleBlock};
use super::{BYTE_ORDER, BvhNode, Header, LAYOUT_COMPACT, MAGIC, Offsets, VERSION};
use crate::error::OpenError;
use crate::storage;

/// A block as typed slices.
#[derive(Clone, Copy)]
pub(crate) struct Block<'m> {
    pub bytes: &'m [u8],
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

impl<'m> Block<'m> {
    /// The parts of a block that was found right before; `None` when it does not even begin as one. One
    /// call for one ray ends here, so nothing is checked again.
    ///
    /// # Safety
    ///
    /// `block` points to a header, aligned as one. If that begins as a block does, it is the header of a
    /// finished block, all of which is there, and nobody writes to it during `'m`.
    #[cfg(feature = "capi")]
    #[allow(unsafe_code, reason = "C passes a pointer to the block and nothing else")]
    #[allow(clippy::multiple_unsafe_ops_per_block, reason = "one proof covers all parts")]
    #[inline(always)]
    pub unsafe fn known(block: *const u8) -> Option<Self> {
        // SAFETY: the caller's promise.
        let header: &'m Header = unsafe { &*block.cast() };
        let begins_right = header.magic == MAGIC && header.byte_order == BYTE_ORDER;
        if !(begins_right && header.version == VERSION) {
            return None;
        }
        let super::Counts { prim_ids, grids, nodes, words, bundle_lanes, .. } = header.counts;
        let super::Counts { geometries, sphere_blocks, triangle_blocks, runs, .. } = header.counts;
        // SAFETY: the parts of a finished block follow each other in this order, all within `size`.
        unsafe {
            let mut at = At { block, offset: size_of::<Header>() };
            let (geometries, prim_ids) = (at.part(geometries), at.part(prim_ids));
            let (grids, nodes) = (at.part(grids), at.part(nodes));
            let bundles = match header.layout {
                4 => Bundles::Four(at.part(bundle_lanes / 4)),
                8 => Bundles::Eight(at.part(bundle_lanes / 8)),
                16 => Bundles::Sixteen(at.part(bundle_lanes / 16)),
                _ => Bundles::None,
            };
            let (words, sphere_blocks) = (at.part(words), at.part(sphere_blocks));
            let (triangle_blocks, runs) = (at.part(triangle_blocks), at.part(runs));
            let bytes = core::slice::from_raw_parts(block, header.size as usize);
            Some(Block {
                bytes,
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
            })
        }
    }

    /// The parts of a block whose header is right. `bytes` may be longer than the block; what the
    /// parts hold is not looked at.
    ///
    /// Checked are: alignment, magic, byte order, version, layout, and that the counts give just
    /// the size that the header names, which is no more than there is.
    pub fn split(bytes: &'m [u8]) -> Result<Self, OpenError> {
        if !bytes.as_ptr().cast::<Header>().is_aligned() {
            return Err(OpenError::Misaligned);
        }
        let Some(header) = storage::view::<Header>(bytes, 0, 1).and_then(<[_]>::first) else {
            let begins_right = MAGIC.starts_with(bytes.get(..8).unwrap_or(bytes));
            return Err(if begins_right { OpenError::Truncated } else { OpenError::NotABlock });
        };
        if header.magic != MAGIC {
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
        if !matches!(header.layout, LAYOUT_COMPACT | 4 | 8 | 16) {
            return Err(OpenError::Layout);
        }
        let offsets = header.counts.offsets().ok_or(OpenError::Corrupt)?;
        if header.size != offsets.end as u64 {
            return Err(OpenError::Corrupt);
        }
        let bytes = bytes.get(..offsets.end).ok_or(OpenError::Truncated)?;
        Self::parts(bytes, header, &offsets).ok_or(OpenError::Corrupt)
    }

    fn parts(bytes: &'m [u8], header: &'m Header, at: &Offsets) -> Option<Self> {
        let counts = &header.counts;
        let view_u32 = |offset, count: u32| storage::view::<u32>(bytes, offset, count as usize);
        Some(Block {
            bytes,
            header,
            geometries: storage::view(bytes, at.geometries, counts.geometries as usize)?,
            prim_ids: view_u32(at.prim_ids, counts.prim_ids)?,
            grids: storage::view(bytes, at.grids, counts.grids as usize)?,
            nodes: storage::view(bytes, at.nodes, counts.nodes as usize)?,
            bundles: Bundles::view(bytes, at.bundles, header.layout, counts.bundle_lanes)?,
            words: view_u32(at.words, counts.words)?,
            sphere_blocks: storage::view(bytes, at.sphere_blocks, counts.sphere_blocks as usize)?,
            triangle_blocks: storage::view(
                bytes,
                at.triangle_blocks,
                counts.triangle_blocks as usize,
            )?,
            runs: storage::view(bytes, at.runs, counts.runs as usize)?,
        })
    }
}

/// The way through the parts of a finished block.
#[cfg(feature = "capi")]
struct At {
    block: *const u8,
    offset: usize,
}

#[cfg(feature = "capi")]
impl At {
    /// The next part, of `count` elements.
    ///
    /// # Safety
    ///
    /// The elements are there, and nobody writes to them during `'m`.
    #[allow(unsafe_code, reason = "C passes a pointer to the block and nothing else")]
    #[inline(always)]
    unsafe fn part<'m, T: storage::Plain>(&mut self, count: u32) -> &'m [T] {
        // SAFETY: within the block, by the caller's promise.
        let first = unsafe { self.block.add(self.offset) }.cast::<T>();
        let size = (count as usize * size_of::<T>()).next_multiple_of(storage::ALIGNMENT);
        self.offset += size;
        // SAFETY: parts start at multiples of 64, `T` is plain, and the caller promises the rest.
        unsafe { core::slice::from_raw_parts(first, count as usize) }
    }
}
