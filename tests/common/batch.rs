//! Batches against single calls, and rays for them.

use raykern::{
    Accel, BuildOptions, Facing, Hit, Mesh, NONE, OwnedAccel, Precision, PrimId, QueryOptions, Ray,
    Scene,
};
use raykern_harness::make;
use raykern_harness::model::TriangleMesh;

use super::bits;

/// Nothing left out.
pub const ALL: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };

/// Batches of these rays give the bits of single calls, whatever is asked; returns how many hit.
pub fn same_in_a_batch(name: &str, accel: &Accel, rays: &[Ray]) -> usize {
    let watertight = QueryOptions { precision: Precision::Watertight, ..ALL };
    let fronts = QueryOptions { facing: Facing::Front, ..ALL };
    let skip = Some(PrimId { prim: 0, geometry: 0, instance: NONE });
    let others = QueryOptions { skip, ..ALL };
    let mut hit_count = 0;
    for options in [ALL, watertight, fronts, others] {
        // What stands there before shows what is not written.
        let mut hits = vec![Hit { t: -7.0, ..Hit::MISS }; rays.len()];
        let mut occluded = vec![true; rays.len()];
        accel.intersect_batch_with(rays, &options, &mut hits);
        accel.occluded_batch_with(rays, &options, &mut occluded);
        for ((ray, hit), occluded) in rays.iter().zip(hits).zip(occluded) {
            let single = accel.intersect_with(ray, &options);
            let expected = bits(Some(single.unwrap_or(Hit::MISS)));
            assert_eq!(bits(Some(hit)), expected, "{name} {ray:?}");
            assert_eq!(occluded, accel.occluded_with(ray, &options), "{name} {ray:?}");
            hit_count += usize::from(single.is_some());
        }
    }
    hit_count
}

/// A mesh of more bytes than are near, beside others, which are large in the scene or, if it is far `away`, small.
pub fn far(meshes: &[TriangleMesh], away: f32) -> OwnedAccel<'static> {
    let mut large = make::sphere(600_000);
    large.vertices.iter_mut().for_each(|v| v[0] += away);
    let meshes: Vec<Mesh> = meshes
        .iter()
        .chain([&large])
        .map(|mesh| Mesh::indexed(&mesh.vertices, &mesh.indices))
        .collect();
    let built = OwnedAccel::bvh(&Scene::new(&meshes, &[]), &BuildOptions::default());
    let built = built.expect("a structure");
    assert!(built.accel().block().len() > 16 << 20);
    built
}

/// Replaces some by rays that hit nothing by definition, and some by rays too far out for boxes in `f32`.
pub fn with_odd_ones(mut rays: Vec<Ray>) -> Vec<Ray> {
    for (i, ray) in rays.iter_mut().enumerate() {
        match i % 9 {
            2 => ray.direction = [0.0; 3],
            5 => ray.origin[0] = f32::NAN,
            7 => ray.origin[1] = 3e38,
            _ => (),
        }
    }
    rays
}

/// Rays through the pixels of `side` by `side`, tile by tile, from a point to a square around another.
pub fn camera(side: usize, from: [f32; 3], to: [f32; 3], half: f32) -> Vec<Ray> {
    let tiles = side / 8;
    let pixels = (0..side * side).map(|i| {
        let (tile, within) = (i / 64, i % 64);
        (tile % tiles * 8 + within % 8, tile / tiles * 8 + within / 8)
    });
    let at = |i: usize| (2.0 * i as f32 / side as f32 - 1.0) * half;
    let way = |k: usize| to[k] - from[k];
    pixels.map(|(x, y)| Ray::new(from, [way(0) + at(x), way(1) + at(y), way(2)])).collect()
}
