//! A plain list of leaf blocks: what a handful of primitives needs.

use crate::block::leaf::{SPHERES, TRIANGLES_AT_LEAST};
use crate::block::{Census, Counts, KIND_LIST, LAYOUT_COMPACT};
use crate::error::BuildError;
use crate::prim::{Survey, pack_in_order};
use crate::scene::Scene;

/// Up to this many primitives no structure is faster than testing them all.
pub(crate) const HANDFUL: u32 = 16;

fn counts(survey: &Survey, census: &Census) -> Counts {
    let (triangles, spheres) = (census.triangle_count, census.sphere_count);
    Counts {
        geometries: survey.geometry_count,
        prim_ids: triangles + spheres,
        sphere_blocks: spheres.div_ceil(SPHERES as u32),
        triangle_blocks: triangles.div_ceil(TRIANGLES_AT_LEAST as u32),
        motions: census.refit.into(),
        ..Counts::default()
    }
}

/// The bytes that [`build`] can use, and the least that it needs: the same.
pub(crate) fn needs(survey: &Survey, census: &Census) -> Result<(usize, usize), BuildError> {
    let counts = counts(survey, census);
    counts.offsets().map(|at| (at.end, at.end)).ok_or(BuildError::TooLarge)
}

/// Builds into `bytes`, which are zero and as many as [`needs`] says; returns the size of the block.
pub(crate) fn build(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let mut counts = counts(survey, census);
    let minimum = counts.offsets().map_or(usize::MAX, |at| at.end);
    let short = BuildError::OutOfMemory { minimum };
    let parts = counts.parts_mut(bytes).ok_or(short)?;
    counts.triangle_blocks = pack_in_order(scene, census, parts);
    counts.seal(KIND_LIST, LAYOUT_COMPACT, census, bytes).ok_or(short)
}
