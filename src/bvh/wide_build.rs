//! The wide layouts: from a scene to bundles in the caller's memory.

use super::How;
use super::branch::{Size, grow};
use super::budget::full_leaves;
use super::choose::choose;
use super::collapse::Grounds;
use super::compact;
use super::emit::{Outline, Sizes};
use super::fill::{pack, take_marks_off};
use super::lanes::Chosen;
use super::places::{PAIR, Places};
use super::plan::{Plan, Thrift, leaf_max};
use super::refs::PrimRef;
use super::reinsert::mend;
use super::runs::name_ids;
use super::split::Areas;
use super::tree::{Depth, Limits};
use crate::block::bundle::{Bundle, LANE};
use crate::block::leaf::TRIANGLES_AT_LEAST;
use crate::block::{BvhNode, Census, Counts, Geometry, KIND_BVH, PartsMut};
use crate::caller::Caller;
use crate::error::BuildError;
use crate::prim::{Source, Survey, geometries};
use crate::scene::Scene;
use crate::storage::{self, ALIGNMENT, Plain};

/// What nodes, choice and id of a leaf of one primitive take.
const SCRATCH: u64 = (PAIR + size_of::<u64>() + size_of::<u32>()) as u64;

/// The bytes for a good tree of bundles, and the bytes below which there is no tree at all.
///
/// The first is the larger of two: what growing takes, which is all that a scan or a terrain needs,
/// and the finished block of a soup, in which leaf blocks hold 3.55 triangles. In an index no leaf blocks take the place of
/// what bundles are made from, so it takes both.
pub(crate) fn needs_wide(
    survey: &Survey,
    census: &Census,
    width: u32,
) -> Result<(usize, usize), BuildError> {
    let (compact, minimum) = compact::needs(survey, census)?;
    let [triangle_blocks, leaves] = planned_leaves(census);
    let finished =
        finished(survey, census, [triangle_blocks, leaves], width).ok_or(BuildError::TooLarge)?;
    let prims = u64::from(if census.is_index { census.hittable() } else { 0 });
    // And what is lost between them.
    let beside = (prims * SCRATCH).next_multiple_of(ALIGNMENT as u64) + 4 * ALIGNMENT as u64;
    let beside = usize::try_from(beside).map_err(|_| BuildError::TooLarge)?;
    let size = finished.checked_add(beside).ok_or(BuildError::TooLarge)?;
    Ok((compact.max(size), minimum))
}

/// The bytes of a block with so many leaves over triangles, and over all else.
fn finished(survey: &Survey, census: &Census, leaves: [u32; 2], width: u32) -> Option<usize> {
    let [triangle_blocks, sphere_blocks] = leaves;
    // Three lanes for two leaf blocks.
    let lanes = 3 * u64::from(triangle_blocks + sphere_blocks) / 2;
    let bundles = (2 + lanes / u64::from(width)) as u32;
    let sizes = Sizes { bundles, triangle_blocks, sphere_blocks };
    Some(counts(survey, census, census.hittable(), &sizes, width).offsets()?.end)
}

/// The leaves over triangles, and those over spheres or instances, for which there shall be room.
fn planned_leaves(census: &Census) -> [u32; 2] {
    let triangle_blocks = (u64::from(census.triangle_count) * 20).div_ceil(71) as u32;
    let others = census.sphere_count.div_ceil(if census.is_index { 1 } else { 4 });
    [triangle_blocks, others]
}

/// The parts of the finished block. In an index every leaf is one instance, so its number among the ids says all, and it has no
/// block.
fn counts(survey: &Survey, census: &Census, prim_ids: u32, sizes: &Sizes, width: u32) -> Counts {
    Counts {
        geometries: survey.geometry_count,
        prim_ids,
        bundle_lanes: sizes.bundles.saturating_mul(width),
        sphere_blocks: if census.is_index { 0 } else { sizes.sphere_blocks },
        triangle_blocks: sizes.triangle_blocks,
        motions: census.refit.into(),
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
    let (room, leaf_max) = (bytes.len(), leaf_max(census, 1));
    let places = Places::new(survey, census, leaf_max, room)?;
    how.caller.done(0.1)?;
    let mut built = |places: Places, thrift: Thrift| {
        if thrift != Thrift::Ample {
            bytes.fill(0);
        }
        let scratch = grow_tree(scene, survey, census, (places, thrift), how, bytes)?;
        how.caller.done(0.6)?;
        Some((scratch.finish::<W>(scene, survey, census, how, bytes), scratch.cut))
    };
    let (size, cut) = built(places, Thrift::Ample)?;
    if size.is_some() || how.caller.cancelled() || census.is_index {
        return size;
    }
    // What was cut in two has too many leaves.
    if cut && let (Some(size), _) = built(places, Thrift::Uncut)? {
        return Some(size);
    }
    // Or any tree has, however leaves are put together.
    let [triangles, spheres] = [census.triangle_count, census.sphere_count]
        .map(|count| full_leaves(count as usize, leaf_max) as u32);
    let least = triangles + spheres;
    let mut leaves = planned_leaves(census).into_iter().sum::<u32>();
    while finished(survey, census, [leaves, 0], W as u32)? > room {
        leaves = leaves.checked_sub(1 + leaves / 64).filter(|leaves| *leaves >= least)?;
    }
    // Bundles may be more than was planned for.
    for leaves in [leaves, least.midpoint(leaves)] {
        if how.caller.cancelled() {
            return None;
        }
        let places = Places::with_leaves(survey, census, leaves as usize, room)?;
        if let (Some(size), _) = built(places, Thrift::Full)? {
            return Some(size);
        }
    }
    None
}

/// Grows the binary tree, and moves the ids to the end of the refs' place.
fn grow_tree(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    (places, thrift): (Places, Thrift),
    how: &How,
    bytes: &mut [u8],
) -> Option<Scratch> {
    let table = Counts { geometries: survey.geometry_count, ..Counts::default() };
    geometries(scene, table.parts_mut(bytes)?.geometries);
    let areas = Areas::new(&census.bounds);
    let (front, rest) = bytes.split_at_mut_checked(places.refs)?;
    let geometries: &[Geometry] = table.parts_mut(front)?.geometries;
    let source = Source { scene, geometries, named: false };
    let Plan { places, count, apart, leaf_max, uneven, cut, in_runs } =
        Plan::new(census, (places, thrift), how, source, rest)?;
    let full = thrift == Thrift::Full;
    let (refs, tail) = rest.split_at_mut_checked(places.nodes - places.refs)?;
    let nodes = storage::view_mut::<BvhNode>(tail, 0, 2 * places.leaves)?;
    let slots = storage::view_mut::<PrimRef>(refs, 0, places.room)?;
    let effort = uneven.unwrap_or(how.effort);
    let in_blocks = effort.blocks && !in_runs && !full;
    let limits = Limits {
        leaves: places.leaves,
        source: cut.then_some(source),
        blocks: in_blocks.then_some(source),
        leaf_max,
        apart,
        mixed: census.is_mixed() && !full,
        depth: match uneven {
            _ if full => Depth::Full,
            Some(_) => Depth::Alike,
            None if effort.whole => Depth::Whole,
            None => Depth::Deep,
        },
        effort,
        even: uneven.map(|_| how.effort),
    };
    let size = grow(nodes, slots, count, &limits, how.caller)?;
    let (free, ids) = ids_to_end(refs, &size)?;
    if in_runs {
        name_ids(ids, free, how.caller)?;
    }
    if uneven.is_some() {
        mend(nodes.get_mut(..size.nodes)?, ids, areas, free)?;
    }
    let together = match in_blocks {
        _ if census.is_index || in_runs => 0,
        true => TRIANGLES_AT_LEAST,
        false => usize::MAX,
    };
    Scratch::new(&places, &size, cut, together)
}

/// Moves the ids of all refs to the end of their place; returns what is free before them, and them.
fn ids_to_end<'p>(place: &'p mut [u8], size: &Size) -> Option<(&'p mut [u8], &'p mut [u32])> {
    let words = storage::view_mut::<u32>(place, 0, place.len() / size_of::<u32>())?;
    let mut end = words.len();
    // From the last on, those of each ref go onto refs that are done.
    for at in (0..8 * size.refs).step_by(8).rev() {
        let [id, count] = PrimRef::ids_of(words.get(at..at + 8)?.try_into().ok()?);
        let start = end.checked_sub(count as usize)?;
        for (word, id) in words.get_mut(start..end)?.iter_mut().zip(id..) {
            *word = id;
        }
        end = start;
    }
    let (free, ids) = place.split_at_mut_checked(size_of::<u32>() * end)?;
    Some((free, storage::view_mut(ids, 0, size.prims)?))
}

/// What decides what becomes of nodes, as in [`Grounds`].
#[derive(Clone, Copy)]
struct Worth<'c> {
    areas: Areas,
    price: f32,
    census: &'c Census,
}

/// The tree, its choices and the ids, at the end of the memory.
struct Scratch {
    choices: usize,
    pairs: usize,
    ids: usize,
    prims: usize,
    nodes: usize,
    node_count: usize,
    /// Whether refs may have been cut in two.
    cut: bool,
    /// As in [`Grounds`].
    together: usize,
}

impl Scratch {
    fn new(places: &Places, size: &Size, cut: bool, together: usize) -> Option<Scratch> {
        let pairs = size.nodes / 2 - 1;
        let ids = places.nodes - 4 * size.prims;
        let choices = (ids / 8 * 8).checked_sub(8 * pairs)?;
        let (prims, nodes, node_count) = (size.prims, places.nodes, size.nodes);
        Some(Scratch { choices, pairs, ids, prims, nodes, node_count, cut, together })
    }

    /// Chooses what becomes of nodes, so that the block fits, and writes it; returns its size.
    fn finish<const W: usize>(
        &self,
        scene: &Scene,
        survey: &Survey,
        census: &Census,
        how: &How,
        bytes: &mut [u8],
    ) -> Option<usize>
    where
        Bundle<W>: Plain,
    {
        let prims = self.prims as u32;
        let first_sphere = self.prims - census.sphere_count as usize;
        let areas = Areas::new(&census.bounds);
        let whole = areas.of(&census.bounds);
        let mean = whole / prims as f32;
        for price in [whole / (1u64 << 36) as f32, 8.0 * mean, 64.0 * mean, whole] {
            let worth = Worth { areas, price, census };
            let outline = self.choose::<W>(scene, survey, worth, how.caller, bytes)?;
            let counts = counts(survey, census, prims, &outline.sizes, W as u32);
            let at = counts.offsets()?;
            if at.words <= self.choices && at.end <= bytes.len() {
                how.caller.done(0.85)?;
                self.emit::<W>(&outline, first_sphere, &counts, how.caller, bytes)?;
                let parts = counts.parts_mut(bytes)?;
                match census.is_index {
                    true => take_marks_off(parts.prim_ids),
                    false => pack((scene, census.refit), first_sphere, parts, how.caller)?,
                }
                return counts.seal(KIND_BVH, W as u32, census, bytes);
            }
        }
        None
    }

    fn choose<const W: usize>(
        &self,
        scene: &Scene,
        survey: &Survey,
        Worth { areas, price, census }: Worth,
        caller: &Caller,
        bytes: &mut [u8],
    ) -> Option<Outline> {
        let (front, tail) = bytes.split_at_mut_checked(self.ids)?;
        let ids = storage::view::<u32>(tail, 0, self.prims)?;
        let nodes = storage::view::<BvhNode>(tail, self.nodes - self.ids, self.node_count)?;
        let (front, middle) = front.split_at_mut_checked(self.choices)?;
        let choices = storage::view_mut::<u64>(middle, 0, self.pairs)?;
        let table = Counts { geometries: survey.geometry_count, ..Counts::default() };
        let geometries = table.parts_mut(front)?.geometries;
        let together = self.together;
        let grounds = Grounds { nodes, ids, areas, price, together };
        let source = Source { scene, geometries, named: census.refit };
        choose::<W>(&grounds, source, caller, choices)?;
        Chosen { nodes, choices, ids }.outline::<W>(caller)
    }

    fn emit<const W: usize>(
        &self,
        outline: &Outline,
        first_sphere: usize,
        counts: &Counts,
        caller: &Caller,
        bytes: &mut [u8],
    ) -> Option<()>
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
        chosen.emit(outline, bundles, prim_ids, first_sphere, caller)
    }
}
