//! Which structure suits a scene and what is done with it.

use crate::block::Census;
use crate::math::float::cube_root;
use crate::math::wide;
use crate::prim::for_each_counted;
use crate::scene::Scene;

/// Below this many rays for each primitive a uniform grid saves more time while it is built than its rays lose, if the
/// scene is even and its primitives are compact.
const FEW_RAYS: f32 = 0.08;

/// A scene is even if a primitive has up to this many times as many others in its part of space as it would if all were spread over
/// the whole box.
const EVEN: f64 = 16.0;

/// Primitives are compact if the box of one lies in up to this many cells on average.
const COMPACT: f64 = 3.0;

/// Parts of the box along each axis.
const PARTS: usize = 8;

/// Whether a uniform grid is likely to take less time than a BVH, with so many rays for each primitive until it is built again.
pub(crate) fn suits_grid(scene: &Scene, census: &Census, rays_per_prim: f32) -> bool {
    if !(0.0 < rays_per_prim && rays_per_prim < FEW_RAYS) {
        return false;
    }
    let Spread { unevenness, cells } = Spread::of(scene, census);
    unevenness <= EVEN && cells <= COMPACT
}

/// How primitives lie in the box around them.
struct Spread {
    /// How many primitives share a part of space with one of them on average, over how many would if they were spread evenly.
    unevenness: f64,
    /// The cells in which the box of one lies on average, if there are as many along each axis as the cube root of their number.
    cells: f64,
}

impl Spread {
    fn of(scene: &Scene, census: &Census) -> Spread {
        let (mut counts, mut cells) = ([0u32; PARTS * PARTS * PARTS], 0.0);
        let lower = wide(census.bounds.lower);
        let extent = wide(census.bounds.upper) - lower;
        let per_part = PARTS as f64 / extent;
        let all = f64::from(census.hittable());
        let per_cell = cube_root(all) / extent;
        for_each_counted(scene, census, |prim| {
            let aabb = prim.shape.aabb();
            let (from, to) = (wide(aabb.lower), wide(aabb.upper));
            let centre = (from + to) / 2.0;
            // Not NaN, as in a flat axis.
            let sides = ((to - from) * per_cell).to_array().map(|cells| 1.0 + cells.max(0.0));
            cells += sides[0] * sides[1] * sides[2];
            // The casts saturate, and NaN goes to 0.
            let [i, j, k] =
                ((centre - lower) * per_part).to_array().map(|x| (x as usize).min(PARTS - 1));
            counts[i + PARTS * (j + PARTS * k)] += 1;
        });
        let squares: f64 = counts.iter().map(|n| f64::from(*n) * f64::from(*n)).sum();
        Spread { unevenness: squares * counts.len() as f64 / (all * all), cells: cells / all }
    }
}
