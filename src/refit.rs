//! Refitting: a built block follows primitives that have moved, in its place.

use crate::block::bundle::Bundle;
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES};
use crate::block::{Counts, Finished, Header, KIND_GRID, Motion, PartsMut};
use crate::bvh::{Cost, refit_bundles, refit_nodes};
use crate::caller::Caller;
use crate::error::{OpenError, RefitError};
use crate::kinds::{REFIT, WIDE};
use crate::math::Aabb;
use crate::prim::{self, Leaves, Source, geometry_table, refit_leaves, survey};
use crate::scene::Scene;
use crate::storage::{self, Plain};

/// Brings the block at the front of `bytes` to where the primitives of `moved` are; returns its cost by the surface area
/// heuristic over that when it was built. On an error nothing was written.
///
/// First the leaf blocks are filled anew, on any thread, then the boxes above them from the last to the first. Whatever
/// `bytes` hold, nothing outside is read or written; and a block that may be opened stays one.
pub(crate) fn refit(bytes: &mut [u8], moved: &Scene, caller: &Caller) -> Result<f32, RefitError> {
    if !REFIT {
        return Err(RefitError::NoBlock(OpenError::Layout));
    }
    let block = Finished::split(bytes).map_err(RefitError::NoBlock)?;
    let header = block.parts().header;
    let motion = block.motion().filter(|_| header.kind != KIND_GRID && !block.has_level());
    let motion = *motion.ok_or(RefitError::NotRefittable)?;
    if !is_same_scene(header, block.parts().geometries.iter().map(|g| g.first), moved)
        || prim::digest(moved, caller) != Some(motion.indices)
    {
        return Err(RefitError::OtherScene);
    }
    let cost = renew(bytes, moved, caller).ok_or(RefitError::NotRefittable)?;
    let motion = Motion { cost, ..motion };
    write_motion(bytes, motion).ok_or(RefitError::NotRefittable)?;
    Ok(motion.growth())
}

/// Finishes a block that was built for refitting: what is in it so far says which primitive is where, and which vertices
/// are the same. So whatever moves and comes back leaves the same bytes.
pub(crate) fn finish(bytes: &mut [u8], scene: &Scene, caller: &Caller) -> Option<()> {
    let indices = prim::digest(scene, caller)?;
    let cost = renew(bytes, scene, caller)?;
    write_motion(bytes, Motion { indices, cost_built: cost, cost })
}

/// Whether a scene has the counts of the one that was built.
fn is_same_scene(header: &Header, firsts: impl Iterator<Item = u32>, scene: &Scene) -> bool {
    let Ok(survey) = survey(scene) else { return false };
    let counts = [survey.mesh_count, survey.triangle_limit, survey.prim_limit];
    counts == [header.mesh_count, header.triangle_limit, header.prim_limit]
        && geometry_table(scene).map(|g| g.first).eq(firsts)
}

/// Fills all that depends on where things are; returns the cost.
fn renew(bytes: &mut [u8], scene: &Scene, caller: &Caller) -> Option<f32> {
    let header = header_of(bytes)?;
    let (counts, layout) = (header.counts, header.layout);
    let PartsMut { geometries, prim_ids, nodes, bundles, sphere_blocks, triangle_blocks, .. } =
        counts.parts_mut(bytes)?;
    prim::geometries(scene, geometries);
    let source = Source { scene, geometries, named: false };
    let [triangles, spheres] =
        refit_leaves(source, prim_ids, triangle_blocks, sphere_blocks, caller);
    let leaves = &Leaves { triangle_blocks, sphere_blocks, prim_ids };
    let mut cost = Cost::default();
    let bounds = match layout {
        4 if WIDE => refit_bundles(view::<4>(bundles, &counts)?, leaves, &mut cost),
        8 if WIDE => refit_bundles(view::<8>(bundles, &counts)?, leaves, &mut cost),
        16 if WIDE => refit_bundles(view::<16>(bundles, &counts)?, leaves, &mut cost),
        _ if nodes.is_empty() => box_of_list(leaves, &mut cost),
        _ => refit_nodes(nodes, leaves, &mut cost),
    };
    header_of(bytes)?.renew(bounds, triangles, spheres);
    Some(cost.of(&bounds))
}

/// The box around all leaf blocks.
fn box_of_list(leaves: &Leaves, cost: &mut Cost) -> Aabb {
    let triangles = (0..leaves.triangle_blocks.len()).map(|number| (KIND_TRIANGLES, number));
    let spheres = (0..leaves.sphere_blocks.len()).map(|number| (KIND_SPHERES, number));
    let mut bounds = Aabb::EMPTY;
    for block in triangles.chain(spheres) {
        let aabb = leaves.tight_box_of_block(block, u32::MAX);
        cost.add(&aabb);
        bounds.add(&aabb);
    }
    bounds
}

fn header_of(bytes: &mut [u8]) -> Option<&mut Header> {
    storage::view_mut(bytes, 0, 1)?.first_mut()
}

fn view<'b, const W: usize>(bytes: &'b mut [u8], counts: &Counts) -> Option<&'b mut [Bundle<W>]>
where
    Bundle<W>: Plain,
{
    storage::view_mut(bytes, 0, counts.bundle_lanes as usize / W)
}

fn write_motion(bytes: &mut [u8], motion: Motion) -> Option<()> {
    let counts = header_of(bytes)?.counts;
    *counts.parts_mut(bytes)?.motions.first_mut()? = motion;
    Some(())
}
