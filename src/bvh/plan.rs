//! What a wide tree is grown over: strips of primitives, or runs of these.

use super::How;
use super::bins::Effort;
use super::budget::leaf_budget;
use super::places::Places;
use super::refs::{PrimRef, gather, refs_per_prim};
use super::runs::put_into_runs;
use super::split::Areas;
use super::spread::Spread;
use crate::block::Census;
use crate::block::leaf::{SPHERES, TRIANGLES, TRIANGLES_AT_LEAST};
use crate::prim::Source;
use crate::scene::Scene;
use crate::storage;

/// Primitives of a leaf of the binary tree at most: any five triangles fit into a block.
const LEAF_MAX: usize = TRIANGLES_AT_LEAST;
const _: () = assert!(SPHERES >= LEAF_MAX);

/// Strips of a leaf at most, of `strip` triangles each: such a strip has two vertices more than triangles. In an index
/// every instance is a leaf.
pub(super) fn leaf_max(census: &Census, strip: usize) -> usize {
    match strip {
        _ if census.is_index => 1,
        1 => LEAF_MAX,
        _ => TRIANGLES / (strip + 2),
    }
}

/// What a tree may take of the memory.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Thrift {
    /// All that leaves growing free.
    Ample,
    /// No refs are cut in two.
    Uncut,
    /// And as few leaves as may be.
    Full,
}

/// What a tree is grown over, and where.
pub(super) struct Plan {
    pub places: Places,
    /// Of refs, or of [runs](super::runs).
    pub count: usize,
    /// So many of them, at the front, are much larger than the others, which are even without them.
    pub apart: usize,
    pub leaf_max: usize,
    /// The effort where areas are uneven.
    pub uneven: Option<Effort>,
    /// Whether refs may be cut in two. Spheres are not, nor is what will move.
    pub cut: bool,
    pub in_runs: bool,
}

impl Plan {
    /// Gathers refs at the front of `bytes`, and puts them into runs where that is wanted and goes.
    pub fn new(
        census: &Census,
        (places, thrift): (Places, Thrift),
        how: &How,
        source: Source,
        bytes: &mut [u8],
    ) -> Option<Plan> {
        if thrift == Thrift::Full {
            return Plan::full(census, places, how, source, bytes);
        }
        let (size, areas) = (places.refs + bytes.len(), Areas::new(&census.bounds));
        let refs = storage::view_mut::<PrimRef>(bytes, 0, places.room)?;
        let Gathered { count, strip, leaves } =
            gather_strips(source.scene, census, places.leaves, how, refs);
        let gathered = refs.get_mut(..count)?;
        let spread = Spread::of(gathered, areas, how.caller);
        let uneven = how.effort.for_uneven(spread.unevenness());
        // Not at the best quality: what cuts and mends trees of uneven scenes is to do so.
        let apart = match uneven {
            Some(effort) if !effort.cuts => spread.set_apart(gathered, &how.effort),
            _ => 0,
        };
        let uneven = uneven.filter(|_| apart == 0);
        let (prims, still) = (census.hittable(), census.sphere_count == 0 && !census.refit);
        let cut = uneven.is_some_and(|effort| effort.cuts) && still && thrift == Thrift::Ample;
        if uneven.is_none() && how.effort.blocks && census.triangle_count == prims {
            let refs = (count, apart, prims as usize);
            if let Some(places) = put_into_runs(refs, &places, (source, areas), how.caller, bytes) {
                let count = places.room;
                return Some(Plan {
                    places,
                    count,
                    apart,
                    leaf_max: 1,
                    uneven,
                    cut,
                    in_runs: true,
                });
            }
        }
        let places = match uneven {
            Some(_) => places.for_uneven(count, leaves, cut, size),
            None => Places { leaves, ..places },
        };
        let leaf_max = leaf_max(census, strip);
        Some(Plan { places, count, apart, leaf_max, uneven, cut, in_runs: false })
    }

    /// For as few leaves as may be, since there is no room for those of a better tree. Of two kinds each comes to a side of its
    /// own first of all: refs are in the order of their ids.
    fn full(
        census: &Census,
        places: Places,
        how: &How,
        source: Source,
        bytes: &mut [u8],
    ) -> Option<Plan> {
        let refs = storage::view_mut::<PrimRef>(bytes, 0, places.room)?;
        let count = gather(source.scene, census, 1, how.caller, refs);
        let apart = if census.is_mixed() { census.triangle_count as usize } else { 0 };
        let leaf_max = leaf_max(census, 1);
        Some(Plan { places, count, apart, leaf_max, uneven: None, cut: false, in_runs: false })
    }
}

/// So many refs, of as many as there would be at the least, and strips are not worth it.
const FOLLOWED: f32 = 1.6;

/// Refs of up to `strip` triangles, and the leaves that a tree over them may have.
struct Gathered {
    count: usize,
    strip: usize,
    leaves: usize,
}

/// Gathers refs of the longest strips for which there is room, which is `room` leaves.
fn gather_strips(
    scene: &Scene,
    census: &Census,
    room: usize,
    how: &How,
    refs: &mut [PrimRef],
) -> Gathered {
    let mixed = census.is_mixed();
    let mut strip = if mixed || census.is_index { 1 } else { how.effort.strip };
    // Where few triangles follow a neighbour, strips are but more leaves.
    while strip > 1 && refs_per_prim(scene, census, strip, refs) > FOLLOWED / strip as f32 {
        strip /= 2;
    }
    loop {
        let count = gather(scene, census, strip, how.caller, refs);
        let least = leaf_budget(count, mixed, leaf_max(census, strip), false);
        // Where strips are shorter than they may be, there may be more leaves than room for them.
        if least <= room || strip == 1 {
            let leaves = room.min(count / 2).max(least);
            return Gathered { count, strip, leaves };
        }
        strip /= 2;
    }
}
