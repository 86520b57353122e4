//! The closest point of a scene, by the structure at hand.

use crate::block::level::Level;
use crate::block::{Block, Bundles, Finished, KIND_BVH, KIND_GRID};
use crate::bvh;
use crate::grid::{self, Cells};
use crate::kinds::{GRID, WIDE};
use crate::levels::Shown;
use crate::math::float::sqrt;
use crate::point::{Image, NearInstances, Nearest, Seek};
use crate::prim::Leaves;
use crate::query::{Filter, QueryOptions, clamped_weights, geometry_of};
use crate::ray::NONE;
use crate::simd::{self, Kernel, Simd};

/// The point of a scene that is closest to a given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointHit {
    /// How far it is, rounded to nearest.
    pub distance: f32,
    /// Where it is, rounded to nearest.
    pub point: [f32; 3],
    /// The weight of the triangle's second vertex there; 0 on spheres.
    pub u: f32,
    /// The weight of the triangle's third vertex there; 0 on spheres.
    pub v: f32,
    /// The number of the triangle or sphere within its geometry.
    pub prim: u32,
    /// The number of the mesh, or the number of meshes plus the number of the sphere set.
    pub geometry: u32,
    /// The number of the instance, [`NONE`] outside instances.
    pub instance: u32,
}

/// The closest point within `radius` of `point` on what `options` leave.
pub(crate) fn closest_point(
    block: Finished,
    point: [f32; 3],
    radius: f32,
    options: &QueryOptions,
) -> Option<PointHit> {
    // A NaN is within no radius.
    if !(radius >= 0.0) || !point.iter().all(|x| x.is_finite()) {
        return None;
    }
    let radius = f64::from(if radius > f32::MAX { f32::MAX } else { radius });
    let own = Shown::own(block);
    let mut best = closest_in(&own, Image::SAME, point, radius * radius, options);
    if let Some(level) = block.level() {
        closest_instance(&level, point, radius * radius, options, &mut best);
    }
    best.map(|(_, hit)| hit)
}

/// A closest point and the square of its distance.
type Found = (f64, PointHit);

/// Looks for something closer than `best` in instances.
fn closest_instance(
    level: &Level,
    point: [f32; 3],
    farthest: f64,
    options: &QueryOptions,
    best: &mut Option<Found>,
) {
    let limit = |best: &Option<Found>| best.as_ref().map_or(farthest, |(square, _)| *square);
    let start = limit(best);
    let mut visit = |number| {
        let found = Shown::of(level, number, options).and_then(|(shown, record)| {
            closest_in(&shown, Image::new(record.map()), point, limit(best), options)
        });
        if let Some(found) = found
            && best.as_ref().is_none_or(|best| is_before(&found, best))
        {
            *best = Some(found);
        }
        limit(best)
    };
    let mut near = NearInstances::new(level, point, start, &mut visit);
    let index = &level.index.parts();
    // Maps that are beyond all bounds make boxes that no cell or wall is right for.
    if index.header.reach < VAST {
        search(index, &mut near);
    } else {
        (0..level.instances.len() as u32).for_each(|number| near.consider(number));
    }
}

/// No instances that are farther away have an index that can be searched.
const VAST: f32 = (1u128 << 126) as f32;

/// The closer comes first, of equally close ones that of the first instance; [`NONE`] is before all numbers.
fn is_before((square, hit): &Found, (least, best): &Found) -> bool {
    let first = hit.instance.wrapping_add(1) < best.instance.wrapping_add(1);
    square < least || (square == least && first)
}

/// The closest point in one instance, or in none, no farther than the root of `limit`; and the square of its distance.
fn closest_in(
    shown: &Shown,
    image: Image,
    point: [f32; 3],
    limit: f64,
    options: &QueryOptions,
) -> Option<Found> {
    let (choice, block) = (shown.choice(options), &shown.block.parts());
    let filter = Filter::new(choice, block.whole);
    let leaves = Leaves::of(block);
    let mut nearest = Nearest::new(image, point, limit, block.header.reach, filter, leaves);
    search(block, &mut nearest);
    let (number, foot) = nearest.best()?;
    let (geometry, first) =
        geometry_of(number, block.geometries).map_or((NONE, 0), |(place, g)| (place, g.first));
    let [u, v] = clamped_weights(foot.weights.map(|weight| weight as f32));
    let hit = PointHit {
        distance: sqrt(foot.square) as f32,
        // Adding +0 turns -0 into +0.
        point: foot.point.to_array().map(|x| x as f32 + 0.0),
        u,
        v,
        prim: number - first,
        geometry,
        instance: shown.instance,
    };
    Some((foot.square, hit))
}

/// Offers what is near.
fn search(block: &Block, nearest: &mut impl Seek) {
    match block.bundles {
        Bundles::None => {}
        _ => return simd::dispatch(InBundles { block, nearest }),
    }
    match block.header.kind {
        KIND_BVH => bvh::search(block.nodes, nearest),
        KIND_GRID if GRID => {
            let Block { grids, words, runs, .. } = *block;
            let leaves = Leaves::of(block);
            grid::search(&Cells { grids, words, runs, leaves }, nearest);
        }
        _ => nearest.all(),
    }
}

/// A search in a tree of bundles, waiting for a backend.
struct InBundles<'b, 'm, N> {
    block: &'b Block<'m>,
    nearest: &'b mut N,
}

impl<N: Seek> Kernel for InBundles<'_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let InBundles { block, nearest } = self;
        match block.bundles {
            Bundles::Sixteen(bundles) if WIDE => bvh::search_wide(s, bundles, nearest),
            Bundles::Eight(bundles) if WIDE => bvh::search_wide(s, bundles, nearest),
            Bundles::Four(bundles) if WIDE => bvh::search_wide(s, bundles, nearest),
            _ => {}
        }
    }
}
