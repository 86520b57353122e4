//! The wide layouts: from a scene to bundles in the caller's memory.

use super::How;
use super::branch::grow;
use super::choose::choose;
use super::collapse::Grounds;
use super::compact;
use super::emit::{Chosen, Sizes};
use super::fill::pack;
use super::refs::{PrimRef, gather};
use super::split::Areas;
use super::tree::{Limits, leaf_budget};
use crate::block::bundle::{Bundle, LANE};
use crate::block::leaf::{SPHERES, TRIANGLES, TRIANGLES_AT_LEAST};
use crate::block::{BvhNode, Census, Counts, KIND_BVH, PartsMut};
use crate::caller::Caller;
use crate::error::BuildError;
use crate::prim::{Survey, geometries};
use crate::scene::Scene;
use crate::storage::{self, ALIGNMENT, Plain};

/// Primitives of a leaf of the binary tree at most: any five triangles fit into a block.
const LEAF_MAX: usize = TRIANGLES_AT_LEAST;

/// Strips of a leaf at most, of `strip` triangles each: such a strip has two vertices more than triangles.
fn leaf_max(strip: usize) -> usize {
    if strip == 1 { LEAF_MAX } else { TRIANGLES / (strip + 2) }
}

/// Where the scratch lies while the tree grows: behind all that is finished, at the end of the
/// memory.
///
/// ```text
/// | header | geometries | ...      | refs                | nodes |    growing
/// | header | geometries | ...      | choices | ids       | nodes |    choosing
/// | header | geometries | prim_ids | bundles | choices | ids | nodes | emitting
/// | header | geometries | prim_ids | bundles | spheres | triangles | packing
/// ```
struct Places {
    refs: usize,
    nodes: usize,
    /// Leaves of the binary tree at most.
    leaves: usize,
}

impl Places {
    /// The places in memory of `size` bytes; `None` when they do not fit.
    fn new(survey: &Survey, census: &Census, size: usize) -> Option<Places> {
        let mixed = census.triangle_count > 0 && census.sphere_count > 0;
        let prims = census.hittable() as usize;
        // More leaves, a half of the primitives or all, made no ray faster: the collapse puts them
        // together again.
        let leaves = leaf_budget(prims, mixed, LEAF_MAX, false);
        let nodes = (size / ALIGNMENT * ALIGNMENT)
            .checked_sub(leaves.checked_mul(2 * size_of::<BvhNode>())?)?;
        let refs = nodes.checked_sub(prims.checked_mul(size_of::<PrimRef>())?)?;
        (refs >= front(survey)?).then_some(Places { refs, nodes, leaves })
    }
}

/// The end of header and geometries.
fn front(survey: &Survey) -> Option<usize> {
    let counts = Counts { geometries: survey.geometry_count, ..Counts::default() };
    counts.offsets().map(|at| at.end)
}

/// The bytes for a good tree of bundles, and the bytes below which there is no tree at all.
///
/// The first is the larger of two: what growing takes, which is all that a scan or a terrain needs,
/// and the finished block of a soup, in which leaf blocks hold 3.55 triangles.
pub(crate) fn needs_wide(
    survey: &Survey,
    census: &Census,
    width: u32,
) -> Result<(usize, usize), BuildError> {
    let (compact, minimum) = compact::needs(survey, census)?;
    let triangle_blocks = (u64::from(census.triangle_count) * 20).div_ceil(71) as u32;
    let sphere_blocks = census.sphere_count.div_ceil(4);
    // Three lanes for two leaf blocks.
    let lanes = 3 * u64::from(triangle_blocks + sphere_blocks) / 2;
    let bundles = 2 + lanes / u64::from(width);
    let sizes = Sizes { bundles: bundles as u32, triangle_blocks, sphere_blocks };
    let finished = counts(survey, census, &sizes, width).offsets().ok_or(BuildError::TooLarge)?;
    Ok((compact.max(finished.end), minimum))
}

/// The parts of the finished block.
fn counts(survey: &Survey, census: &Census, sizes: &Sizes, width: u32) -> Counts {
    Counts {
        geometries: survey.geometry_count,
        prim_ids: census.hittable(),
        bundle_lanes: sizes.bundles.saturating_mul(width),
        sphere_blocks: sizes.sphere_blocks,
        triangle_blocks: sizes.triangle_blocks,
        ..Counts::default()
    }
}

/// Builds bundles of `width` lanes into `bytes`, which are zero and at least the minimum of
/// [`needs_wide`]; returns the size of the finished block. At least one primitive can be hit.
///
/// Where memory is short, the leaf blocks become fewer and fuller, at the cost of the rays, and where
/// that is not enough the layout is the compact one.
pub(crate) fn build_wide(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    width: u32,
    how: &How,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let built = match width {
        4 => build::<4>(scene, survey, census, how, bytes),
        8 => build::<8>(scene, survey, census, how, bytes),
        _ => build::<16>(scene, survey, census, how, bytes),
    };
    match built {
        Some(size) => Ok(size),
        None if how.caller.cancelled() => Err(BuildError::Cancelled),
        None => {
            bytes.fill(0);
            compact::build(scene, survey, census, how, bytes)
        }
    }
}

fn build<const W: usize>(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    how: &How,
    bytes: &mut [u8],
) -> Option<usize>
where
    Bundle<W>: Plain,
{
    let places = Places::new(survey, census, bytes.len())?;
    how.caller.done(0.1)?;
    let nodes = grow_tree(scene, survey, census, &places, how, bytes)?;
    how.caller.done(0.6)?;
    let scratch = Scratch::new(census, &places, nodes)?;
    let prims = census.hittable();
    let areas = Areas::new(&census.bounds);
    let whole = areas.of(&census.bounds);
    let mean = whole / prims as f32;
    for price in [whole / (1u64 << 36) as f32, 8.0 * mean, 64.0 * mean, whole] {
        let sizes = scratch.choose::<W>(scene, survey, areas, price, how.caller, bytes)?;
        let counts = counts(survey, census, &sizes, W as u32);
        let at = counts.offsets()?;
        if at.words <= scratch.choices && at.end <= bytes.len() {
            how.caller.done(0.85)?;
            scratch.emit::<W>(census, &counts, bytes)?;
            pack(scene, census.triangle_count as usize, counts.parts_mut(bytes)?, how.caller)?;
            return counts.seal(KIND_BVH, W as u32, census, bytes);
        }
    }
    None
}

/// Grows the binary tree, and moves the ids behind the refs' place; returns the number of nodes.
fn grow_tree(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    places: &Places,
    how: &How,
    bytes: &mut [u8],
) -> Option<usize> {
    let front = Counts { geometries: survey.geometry_count, ..Counts::default() };
    geometries(scene, front.parts_mut(bytes)?.geometries);
    let prims = census.hittable() as usize;
    let (front, tail) = bytes.split_at_mut_checked(places.nodes)?;
    let nodes = storage::view_mut::<BvhNode>(tail, 0, 2 * places.leaves)?;
    let refs = storage::view_mut::<PrimRef>(front, places.refs, prims)?;
    let mixed = census.triangle_count > 0 && census.sphere_count > 0;
    let mut strip = if mixed { 1 } else { how.effort.strip };
    let (ref_count, leaves) = loop {
        let ref_count = gather(scene, census, strip, how.caller, refs);
        let leaves = leaf_budget(ref_count, mixed, leaf_max(strip), false);
        // Where strips are shorter than they may be, there may be more leaves than room for them.
        if leaves <= places.leaves || strip == 1 {
            break (ref_count, leaves);
        }
        strip /= 2;
    };
    let refs = refs.get_mut(..ref_count)?;
    let limits =
        Limits { leaves, leaf_max: leaf_max(strip), mixed, deep: true, effort: how.effort };
    let count = grow(nodes, refs, &limits, how.caller)?;
    spread_ids(storage::view_mut::<u32>(front, places.refs, 8 * prims)?, ref_count)?;
    Some(count)
}

/// From the last on, the ids of each ref go to the end of the refs' place, onto refs that are done.
fn spread_ids(words: &mut [u32], ref_count: usize) -> Option<()> {
    let mut end = words.len();
    for at in (0..8 * ref_count).step_by(8).rev() {
        let [id, count] = PrimRef::ids_of(words.get(at..at + 8)?.try_into().ok()?);
        let start = end.checked_sub(count as usize)?;
        for (word, id) in words.get_mut(start..end)?.iter_mut().zip(id..) {
            *word = id;
        }
        end = start;
    }
    Some(())
}

/// The tree, its choices and the ids, at the end of the memory.
struct Scratch {
    choices: usize,
    pairs: usize,
    ids: usize,
    prims: usize,
    nodes: usize,
    node_count: usize,
}

impl Scratch {
    fn new(census: &Census, places: &Places, node_count: usize) -> Option<Scratch> {
        let prims = census.hittable() as usize;
        let pairs = node_count / 2 - 1;
        let ids = places.nodes - 4 * prims;
        let choices = (ids / 8 * 8).checked_sub(8 * pairs)?;
        Some(Scratch { choices, pairs, ids, prims, nodes: places.nodes, node_count })
    }

    fn choose<const W: usize>(
        &self,
        scene: &Scene,
        survey: &Survey,
        areas: Areas,
        price: f32,
        caller: &Caller,
        bytes: &mut [u8],
    ) -> Option<Sizes> {
        let (front, tail) = bytes.split_at_mut_checked(self.ids)?;
        let ids = storage::view::<u32>(tail, 0, self.prims)?;
        let nodes = storage::view::<BvhNode>(tail, self.nodes - self.ids, self.node_count)?;
        let (front, middle) = front.split_at_mut_checked(self.choices)?;
        let choices = storage::view_mut::<u64>(middle, 0, self.pairs)?;
        let table = Counts { geometries: survey.geometry_count, ..Counts::default() };
        let geometries = table.parts_mut(front)?.geometries;
        let grounds = Grounds { nodes, ids, areas, price };
        choose::<W>(&grounds, scene, geometries, caller, choices)?;
        Chosen { nodes, choices, ids }.sizes::<W>()
    }

    fn emit<const W: usize>(&self, census: &Census, counts: &Counts, bytes: &mut [u8]) -> Option<()>
    where
        Bundle<W>: Plain,
    {
        let (front, tail) = bytes.split_at_mut_checked(self.choices)?;
        let choices = storage::view::<u64>(tail, 0, self.pairs)?;
        let ids = storage::view::<u32>(tail, self.ids - self.choices, self.prims)?;
        let nodes = storage::view::<BvhNode>(tail, self.nodes - self.choices, self.node_count)?;
        let chosen = Chosen { nodes, choices, ids };
        let front_counts = Counts { sphere_blocks: 0, triangle_blocks: 0, ..*counts };
        let PartsMut { prim_ids, bundles, .. } = front_counts.parts_mut(front)?;
        let count = bundles.len() / (W * LANE);
        let bundles = storage::view_mut::<Bundle<W>>(bundles, 0, count)?;
        chosen.emit(bundles, prim_ids, census.triangle_count as usize)
    }
}

const _: () = assert!(SPHERES >= LEAF_MAX);
