//! A plain list of leaf blocks: what a handful of primitives needs.

use crate::block::leaf::{SPHERES, TRIANGLES_AT_LEAST};
use crate::block::{Census, Counts, KIND_LIST, LAYOUT_COMPACT, PartsMut};
use crate::error::BuildError;
use crate::prim::{Packer, Shape, Survey, for_each_prim, geometries};
use crate::scene::Scene;

/// Up to this many primitives no structure is faster than testing them all.
pub(crate) const HANDFUL: u32 = 16;

fn counts(geometries: u32, triangles: u32, spheres: u32) -> Counts {
    Counts {
        geometries,
        prim_ids: triangles + spheres,
        sphere_blocks: spheres.div_ceil(SPHERES as u32),
        triangle_blocks: triangles.div_ceil(TRIANGLES_AT_LEAST as u32),
        ..Counts::default()
    }
}

/// The bytes that [`build`] can use, and the least that it needs: the same.
pub(crate) fn needs(survey: &Survey, census: &Census) -> Result<(usize, usize), BuildError> {
    let counts = counts(survey.geometry_count, census.triangle_count, census.sphere_count);
    counts.offsets().map(|at| (at.end, at.end)).ok_or(BuildError::TooLarge)
}

/// Builds into `bytes`, which are zero and as many as [`needs`] says; returns the size of the block.
pub(crate) fn build(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let mut counts = counts(survey.geometry_count, census.triangle_count, census.sphere_count);
    let minimum = counts.offsets().map_or(usize::MAX, |at| at.end);
    let short = BuildError::OutOfMemory { minimum };
    let parts = counts.parts_mut(bytes).ok_or(short)?;
    counts.triangle_blocks = pack(scene, census, parts) as u32;
    counts.seal(KIND_LIST, LAYOUT_COMPACT, census, bytes).ok_or(short)
}

/// Packs the primitives in the order of their numbers; returns the number of triangle blocks.
fn pack(scene: &Scene, census: &Census, parts: PartsMut) -> usize {
    geometries(scene, parts.geometries);
    let mut packer =
        Packer::new(parts.triangle_blocks, parts.sphere_blocks, 0, census.triangle_count);
    let (triangle_ids, sphere_ids) = parts.prim_ids.split_at_mut(census.triangle_count as usize);
    let (mut triangle_ids, mut sphere_ids) = (triangle_ids.iter_mut(), sphere_ids.iter_mut());
    for_each_prim(scene, |prim| {
        let ids = match prim.shape {
            Shape::Triangle(_) => &mut triangle_ids,
            Shape::Sphere { .. } => &mut sphere_ids,
        };
        if let (Some(id), Some(_)) = (ids.next(), packer.push(&prim.shape)) {
            *id = prim.id;
        }
    });
    packer.triangle_block_count()
}
