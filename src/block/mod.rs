//! The block: what a build leaves in the caller's memory.
//!
//! ```text
//! | header | geometries | prim_ids | grids | nodes | bundles | words |
//! | sphere blocks | triangle blocks | runs | motion | instances ..
//! ```
//!
//! Every part starts at a multiple of 64 bytes and is empty in blocks that have no use for it. There
//! are no pointers and no stored offsets: the counts in the header say where each part is, so a
//! block can be copied, written to a file or placed in ROM. The order lets a build finish a part
//! before it must know the size of the next. What follows in a block with instances, and may
//! refer to other blocks, is drawn in [`level`].

pub(crate) mod bundle;
pub(crate) mod cells;
pub(crate) mod leaf;
pub(crate) mod level;
mod motion;
mod node;
mod view;

pub(crate) use bundle::Bundles;
pub(crate) use leaf::Geometry;
pub(crate) use motion::Motion;
pub(crate) use node::BvhNode;
pub(crate) use view::{Block, Finished};

use bundle::LANE;
use cells::{GridHead, Run};
use leaf::{SphereBlock, TriangleBlock};

use crate::kinds::{BALLS, GRID, REFIT, WIDE};
use crate::math::{Aabb, Extent};
use crate::storage::{self, ALIGNMENT, Plain, align_up};

const MAGIC: [u8; 8] = *b"raykern\0";
const BYTE_ORDER: u32 = 0x0102_0304;
/// Counted up whenever the bytes of a block change their meaning.
const VERSION: u32 = 6;

pub(crate) const KIND_LIST: u32 = 1;
pub(crate) const KIND_GRID: u32 = 2;
pub(crate) const KIND_BVH: u32 = 3;
/// Binary nodes of 32 bytes, or no nodes at all. Other layouts are the width of their bundles: 4, 8
/// or 16.
pub(crate) const LAYOUT_COMPACT: u32 = 1;

/// The number of elements in each part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub(crate) struct Counts {
    pub geometries: u32,
    pub prim_ids: u32,
    pub grids: u32,
    pub nodes: u32,
    pub words: u32,
    pub sphere_blocks: u32,
    pub triangle_blocks: u32,
    pub runs: u32,
    /// Lanes of bundles: their number times their width.
    pub bundle_lanes: u32,
    /// 1 if the block may be refitted, else 0.
    pub motions: u32,
}

/// The first 128 bytes.
///
/// ```text
/// byte 0        8            12        16     24     28       32      56
///      | magic | byte order | version | size | kind | layout | bounds | ...
/// byte 56           60               64           68          72        76        80      84
///      | mesh count | triangle limit | prim limit | triangles | spheres | ignored | reach | level |
/// byte 88       128
///      | counts |
/// ```
///
/// Flat primitive numbers run through the meshes and then through the sphere sets: below
/// `triangle_limit` they are triangles, from there to `prim_limit` spheres.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Header {
    magic: [u8; 8],
    byte_order: u32,
    version: u32,
    pub size: u64,
    pub kind: u32,
    pub layout: u32,
    pub bounds: Aabb,
    pub mesh_count: u32,
    pub triangle_limit: u32,
    pub prim_limit: u32,
    pub triangle_count: u32,
    pub sphere_count: u32,
    pub ignored_count: u32,
    /// The largest coordinate of `bounds`, infinite where it is not representable.
    pub reach: f32,
    /// Where what belongs to instances begins, in lines of 64 bytes; 0 if there are none.
    pub level: u32,
    pub counts: Counts,
}
const _: () = assert!(size_of::<Header>() == 128);

// SAFETY: numbers only; 8 + 4 + 4 + 8 + 4 + 4 + 24 + 24 + 8 + 40 = 128, so no padding.
#[allow(unsafe_code, reason = "a promise about the layout drawn above")]
unsafe impl Plain for Header {}

/// Where each part starts, in bytes; the last entry is the size of the block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Offsets {
    pub geometries: usize,
    pub prim_ids: usize,
    pub grids: usize,
    pub nodes: usize,
    pub bundles: usize,
    pub words: usize,
    pub sphere_blocks: usize,
    pub triangle_blocks: usize,
    pub runs: usize,
    pub motions: usize,
    pub end: usize,
}

impl Counts {
    /// Where parts of these sizes lie; `None` when the machine cannot address the end.
    pub fn offsets(&self) -> Option<Offsets> {
        let mut end = size_of::<Header>() as u64;
        // Both the start of the part and the start of what follows must be a `usize`.
        let mut part = |count: u32, size: usize| -> Option<usize> {
            let start = end;
            end = align_up(start.checked_add(u64::from(count).checked_mul(size as u64)?)?)?;
            isize::try_from(end).ok()?;
            usize::try_from(start).ok()
        };
        let known = |is: bool, count: u32| if is { count } else { 0 };
        let offsets = Offsets {
            geometries: part(self.geometries, size_of::<Geometry>())?,
            prim_ids: part(self.prim_ids, size_of::<u32>())?,
            grids: part(known(GRID, self.grids), size_of::<GridHead>())?,
            nodes: part(self.nodes, size_of::<BvhNode>())?,
            bundles: part(known(WIDE, self.bundle_lanes), LANE)?,
            words: part(known(GRID, self.words), size_of::<u32>())?,
            sphere_blocks: part(known(BALLS, self.sphere_blocks), size_of::<SphereBlock>())?,
            triangle_blocks: part(self.triangle_blocks, size_of::<TriangleBlock>())?,
            runs: part(known(GRID, self.runs), size_of::<Run>())?,
            motions: part(self.motions, size_of::<Motion>())?,
            end: 0,
        };
        Some(Offsets { end: usize::try_from(end).ok()?, ..offsets })
    }
}

/// The parts of a block that is being built.
pub(crate) struct PartsMut<'b> {
    pub geometries: &'b mut [Geometry],
    pub prim_ids: &'b mut [u32],
    pub grids: &'b mut [GridHead],
    pub nodes: &'b mut [BvhNode],
    /// Room for the bundles, as bytes.
    pub bundles: &'b mut [u8],
    pub words: &'b mut [u32],
    pub sphere_blocks: &'b mut [SphereBlock],
    pub triangle_blocks: &'b mut [TriangleBlock],
    pub runs: &'b mut [Run],
    pub motions: &'b mut [Motion],
    /// What lies behind the last part.
    pub rest: &'b mut [u8],
}

impl Counts {
    /// Parts of these sizes in `bytes`, with whatever stands there; `None` when they do not fit.
    pub fn parts_mut<'b>(&self, bytes: &'b mut [u8]) -> Option<PartsMut<'b>> {
        let at = self.offsets()?;
        let (_, rest) = bytes.split_at_mut_checked(at.geometries)?;
        let (geometries, rest) = part(rest, self.geometries, at.prim_ids - at.geometries)?;
        let (prim_ids, rest) = part(rest, self.prim_ids, at.grids - at.prim_ids)?;
        let (grids, rest) = part_if(GRID, rest, self.grids, at.nodes - at.grids)?;
        let (nodes, rest) = part(rest, self.nodes, at.bundles - at.nodes)?;
        let (bundles, rest) = rest.split_at_mut_checked(at.words - at.bundles)?;
        let (words, rest) = part_if(GRID, rest, self.words, at.sphere_blocks - at.words)?;
        let spheres = at.triangle_blocks - at.sphere_blocks;
        let (sphere_blocks, rest) = part_if(BALLS, rest, self.sphere_blocks, spheres)?;
        let triangles = at.runs - at.triangle_blocks;
        let (triangle_blocks, rest) = part(rest, self.triangle_blocks, triangles)?;
        let (runs, rest) = part_if(GRID, rest, self.runs, at.motions - at.runs)?;
        let (motions, rest) = part_if(REFIT, rest, self.motions, at.end - at.motions)?;
        Some(PartsMut {
            geometries,
            prim_ids,
            grids,
            nodes,
            bundles,
            words,
            sphere_blocks,
            triangle_blocks,
            runs,
            motions,
            rest,
        })
    }

    /// Finishes a block whose parts are in place: zeros between them, and the header. Returns its
    /// size.
    pub fn seal(&self, kind: u32, layout: u32, census: &Census, bytes: &mut [u8]) -> Option<usize> {
        let at = self.offsets()?;
        let mut fill = |start, count, size| end_part(bytes, start, count, size);
        fill(at.geometries, self.geometries, size_of::<Geometry>())?;
        fill(at.prim_ids, self.prim_ids, size_of::<u32>())?;
        fill(at.nodes, self.nodes, size_of::<BvhNode>())?;
        fill(at.triangle_blocks, self.triangle_blocks, size_of::<TriangleBlock>())?;
        if WIDE {
            fill(at.bundles, self.bundle_lanes, LANE)?;
        }
        if BALLS {
            fill(at.sphere_blocks, self.sphere_blocks, size_of::<SphereBlock>())?;
        }
        if GRID {
            fill(at.grids, self.grids, size_of::<GridHead>())?;
            fill(at.words, self.words, size_of::<u32>())?;
            fill(at.runs, self.runs, size_of::<Run>())?;
        }
        if REFIT {
            fill(at.motions, self.motions, size_of::<Motion>())?;
        }
        let header = Header::new(kind, layout, census, *self, at.end);
        *storage::view_mut::<Header>(bytes, 0, 1)?.first_mut()? = header;
        Some(at.end)
    }
}

/// Says in the header of a block, whose own primitives are finished, that it has instances as well and ends at byte `size`;
/// `None` if it is too large for that.
pub(crate) fn seal_level(bytes: &mut [u8], size: usize) -> Option<()> {
    let header = storage::view_mut::<Header>(bytes, 0, 1)?.first_mut()?;
    header.level = u32::try_from(header.size / ALIGNMENT as u64).ok()?;
    header.size = size as u64;
    Some(())
}

/// Says in the header of a block that was packed that it ends at byte `size`.
pub(crate) fn seal_packed(bytes: &mut [u8], size: usize) -> Option<()> {
    storage::view_mut::<Header>(bytes, 0, 1)?.first_mut()?.size = size as u64;
    Some(())
}

/// Fills what lies behind `count` things of `size` bytes, up to the next part, with zeros.
#[inline(never)]
fn end_part(bytes: &mut [u8], start: usize, count: u32, size: usize) -> Option<()> {
    let end = start + count as usize * size;
    let next = storage::align_up(end as u64)? as usize;
    bytes.get_mut(end..next)?.fill(0);
    Some(())
}

/// `count` elements at the front of `bytes`, and what follows after `size` bytes.
fn part<T: Plain>(bytes: &mut [u8], count: u32, size: usize) -> Option<(&mut [T], &mut [u8])> {
    let (part, rest) = bytes.split_at_mut_checked(size)?;
    Some((storage::view_mut(part, 0, count as usize)?, rest))
}

/// The same for parts of a kind that this build may not know: it then makes none.
#[inline(always)]
fn part_if<T: Plain>(
    known: bool,
    bytes: &mut [u8],
    count: u32,
    size: usize,
) -> Option<(&mut [T], &mut [u8])> {
    if known { part(bytes, count, size) } else { Some((&mut [], bytes)) }
}

/// What the header says of the scene, apart from sizes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Census {
    pub bounds: Aabb,
    /// The longest edge of a primitive's box, rounded.
    pub longest: f32,
    pub mesh_count: u32,
    pub triangle_limit: u32,
    pub prim_limit: u32,
    pub triangle_count: u32,
    pub sphere_count: u32,
    pub ignored_count: u32,
    /// Whether what is counted as spheres are the boxes of instances.
    pub is_index: bool,
    /// Whether the block shall be refitted: then everything counts as if it could be hit, as it may some day, and
    /// vertices are the same if their numbers are.
    pub refit: bool,
}

impl Header {
    /// How far the scene reaches, for rays.
    #[inline(always)]
    pub fn extent(&self) -> Extent {
        Extent::new(self.reach, self.counts.prim_ids)
    }

    /// The header of a finished block.
    pub fn new(kind: u32, layout: u32, census: &Census, counts: Counts, size: usize) -> Header {
        Header {
            magic: MAGIC,
            byte_order: BYTE_ORDER,
            version: VERSION,
            size: size as u64,
            kind,
            layout,
            bounds: census.bounds.without_minus_zero(),
            mesh_count: census.mesh_count,
            triangle_limit: census.triangle_limit,
            prim_limit: census.prim_limit,
            triangle_count: census.triangle_count,
            sphere_count: census.sphere_count,
            ignored_count: census.ignored_count,
            reach: census.bounds.reach(),
            level: 0,
            counts,
        }
    }

    /// What has moved can be hit, or not, at other places.
    pub fn renew(&mut self, bounds: Aabb, triangle_count: u32, sphere_count: u32) {
        self.bounds = bounds.without_minus_zero();
        self.reach = bounds.reach();
        self.triangle_count = triangle_count;
        self.sphere_count = sphere_count;
        self.ignored_count =
            self.prim_limit.saturating_sub(triangle_count.saturating_add(sphere_count));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_on_cache_lines() {
        let counts = Counts { geometries: 3, prim_ids: 17, nodes: 2, ..Counts::default() };
        let at = counts.offsets().unwrap();
        assert_eq!((at.geometries, at.prim_ids, at.grids), (128, 192, 320));
        assert_eq!((at.nodes, at.words, at.end), (320, 384, 384));
    }

    #[test]
    fn no_counts_overflow() {
        let most = u32::MAX;
        let counts = Counts {
            geometries: most,
            prim_ids: most,
            grids: most,
            nodes: most,
            words: most,
            sphere_blocks: most,
            triangle_blocks: most,
            runs: most,
            bundle_lanes: most,
            motions: most,
        };
        // Two terabytes: addressable with 64 bits, refused with 32.
        assert_eq!(counts.offsets().is_some(), usize::BITS == 64);
    }
}
