//! Which structure suits a scene and what is done with it.

use crate::block::Census;
use crate::math::wide;
use crate::prim::for_each_counted;
use crate::scene::Scene;

/// Below this many rays for each primitive a uniform grid saves more time while it is built than its rays lose, if the
/// scene is even.
const FEW_RAYS: f32 = 0.15;

/// A scene is even if a primitive has up to this many times as many others in its part of space as it would if all were spread over
/// the whole box.
const EVEN: f64 = 16.0;

/// Parts of the box along each axis.
const PARTS: usize = 8;

/// Whether a uniform grid is likely to take less time than a BVH, with so many rays for each primitive until it is built again.
pub(crate) fn suits_grid(scene: &Scene, census: &Census, rays_per_prim: f32) -> bool {
    0.0 < rays_per_prim && rays_per_prim < FEW_RAYS && unevenness(scene, census) <= EVEN
}

/// How many primitives share a part of space with one of them on average, over how many would if they were spread evenly.
fn unevenness(scene: &Scene, census: &Census) -> f64 {
    let mut counts = [0u32; PARTS * PARTS * PARTS];
    let lower = wide(census.bounds.lower);
    let per_part = PARTS as f64 / (wide(census.bounds.upper) - lower);
    for_each_counted(scene, census, |prim| {
        let aabb = prim.shape.aabb();
        let centre = (wide(aabb.lower) + wide(aabb.upper)) / 2.0;
        // The casts saturate, and NaN, as in a flat axis, goes to 0.
        let [i, j, k] =
            ((centre - lower) * per_part).to_array().map(|x| (x as usize).min(PARTS - 1));
        counts[i + PARTS * (j + PARTS * k)] += 1;
    });
    let squares: f64 = counts.iter().map(|n| f64::from(*n) * f64::from(*n)).sum();
    let all = f64::from(census.hittable());
    squares * counts.len() as f64 / (all * all)
}
