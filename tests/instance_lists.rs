//! Lists of hits and closest points in scenes with instances.

#![allow(missing_docs)]

mod common;

use common::{All, bits};
use raykern::{Accel, Hit, Instance, Layout, NONE, OwnedAccel, PointHit, QueryOptions, Ray};
use raykern::{BuildOptions, PlainList};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::Oracle;

/// Every structure over instances of `child`, which is of every structure in turn, beside `own`.
fn with_all(
    own: &Model,
    child: &Model,
    maps: &[[f32; 12]],
    check: impl FnOnce(&[(&'static str, Accel)]),
) {
    let never = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
    let compact = BuildOptions { layout: Layout::Compact, ..never };
    let built = child.with_scene(|scene| {
        [
            OwnedAccel::bvh(scene, &never).expect("a BVH"),
            OwnedAccel::grid(scene, &never).expect("a grid"),
            OwnedAccel::bvh(scene, &compact).expect("a BVH"),
        ]
    });
    let shown = built.each_ref().map(OwnedAccel::accel);
    let instances: Vec<_> =
        maps.iter().enumerate().map(|(i, map)| Instance::new(&shown[i % 3], *map)).collect();
    own.with_scene(|scene| check(&All::build(&scene.with_instances(&instances)).accels()));
}

/// The list, fetched `capacity` hits at a time.
fn fetched(accel: &Accel, ray: &Ray, options: &QueryOptions, capacity: usize) -> Vec<Hit> {
    let (mut room, mut last, mut hits) = (vec![Hit::MISS; capacity], None, Vec::new());
    loop {
        let count = accel.more_hits(ray, options, &mut last, &mut room);
        hits.extend_from_slice(&room[..count]);
        if count < capacity {
            return hits;
        }
    }
}

fn random_map(random: &mut Random) -> [f32; 12] {
    let mut map = [0.0; 12].map(|_: f32| random.between(-1.0, 1.0) as f32);
    (0..3).for_each(|k| map[4 * k + 3] *= 2.0);
    map
}

const SAME: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Scaled by a power of two, mirrored or not, and shifted by whole numbers.
fn whole_map(random: &mut Random) -> [f32; 12] {
    let mut map = SAME.map(|x| x * [0.5, 1.0, 2.0][random.below(3)]);
    if random.below(2) == 0 {
        map[0] = -map[0];
    }
    (0..3).for_each(|k| map[4 * k + 3] = random.below(5) as f32 - 2.0);
    map
}

/// The lists of all structures are those of the oracle, instance by instance on the rounded rays, in the order of real `t`.
#[test]
fn lists_are_exact_across_instances() {
    let mut child: Model = make::blob(60, 5).into();
    child.sphere_sets.push(vec![[0.2, 0.1, 0.0, 0.9], [-0.6, 0.1, -0.2, 0.3]]);
    let own: Model = make::soup(40, 9).into();
    let oracles = [Oracle::new(&own), Oracle::new(&child)];
    let mut random = Random::new(21);
    let (mut hits_seen, mut ties) = (0, 0);
    for round in 0..10 {
        let mut maps: Vec<_> = (0..4)
            .map(|_| if round % 2 == 0 { whole_map(&mut random) } else { random_map(&mut random) })
            .collect();
        // The same thing twice at one place, so that everything in it is met twice at one `t`.
        maps.push(maps[0]);
        with_all(&own, &child, &maps, |accels| {
            for _ in 0..20 {
                let target = child.meshes[0].vertices[random.below(20)];
                let origin = [0; 3].map(|_| random.between(-4.0, 4.0) as f32);
                let ray = Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]));
                let options = QueryOptions::default();
                let mut exact: Vec<_> = oracles[0]
                    .all_hits(&ray, &options)
                    .into_iter()
                    .map(|hit| (NONE, hit))
                    .collect();
                for i in 0..maps.len() as u32 {
                    if let Some(ray) = accels[0].1.object_ray(i, &ray) {
                        exact.extend(
                            oracles[1].all_hits(&ray, &options).into_iter().map(|hit| (i, hit)),
                        );
                    }
                }
                // Stable, so equal ones stay in the order of instances.
                exact.sort_by(|a, b| a.1.t.cmp(&b.1.t));
                let expected: Vec<_> = exact
                    .iter()
                    .map(|(i, hit)| {
                        [hit.t.rounded().to_bits(), *i, hit.place.geometry, hit.place.prim]
                    })
                    .collect();
                for (i, (name, accel)) in accels.iter().enumerate() {
                    let hits: Vec<_> = accel.hits(&ray, &options).collect();
                    let seen: Vec<_> = hits
                        .iter()
                        .map(|h| [h.t.to_bits(), h.instance, h.geometry, h.prim])
                        .collect();
                    assert_eq!(seen, expected, "{name} {ray:?}");
                    assert!(hits.iter().all(|hit| hit.u >= 0.0), "{name}: a mark was left");
                    let same = fetched(accel, &ray, &options, [1, 2, 3, 16][i % 4]);
                    assert!(
                        same.iter().map(|h| bits(Some(*h))).eq(hits.iter().map(|h| bits(Some(*h))))
                    );
                    let first = accel.intersect_with(&ray, &options);
                    assert_eq!(bits(first), bits(hits.first().copied()), "{name} {ray:?}");
                }
                hits_seen += expected.len();
                ties += expected.windows(2).filter(|pair| pair[0][0] == pair[1][0]).count();
            }
        });
    }
    assert!(hits_seen > 600 && ties > 100, "{hits_seen} hits, {ties} ties: too easy");
}

fn point_bits(found: Option<PointHit>) -> Option<[u32; 9]> {
    let hit = found?;
    let [x, y, z] = hit.point.map(f32::to_bits);
    let weights = [hit.distance, hit.u, hit.v].map(f32::to_bits);
    Some([x, y, z, weights[0], weights[1], weights[2], hit.prim, hit.geometry, hit.instance])
}

/// Where maps are exact, the closest point is to the bit that of the flattened scene.
#[test]
fn closest_points_are_those_of_the_flattened_scene() {
    let (mut child, own): (Model, Model) = (make::blob(80, 5).into(), make::soup(20, 9).into());
    // Few bits, so that nothing is lost by moving it.
    for x in child.meshes[0].vertices.as_flattened_mut() {
        *x = (*x * 1024.0).round() / 1024.0;
    }
    let mut random = Random::new(22);
    let mut instanced = 0;
    for round in 0..10 {
        // Some rounds with so many that an index is deep, all twice: of the same place the first instance is closest.
        let count = if round < 8 { 5 } else { 60 };
        let mut maps: Vec<_> = (0..count).map(|_| whole_map(&mut random)).collect();
        if round >= 8 {
            maps.extend_from_within(..);
        }
        let mut flat = own.clone();
        for map in &maps {
            let TriangleMesh { vertices, indices } = child.meshes[0].clone();
            let moved = |v: [f32; 3]| [0, 1, 2].map(|k| map[5 * k] * v[k] + map[4 * k + 3]);
            let vertices = vertices.into_iter().map(moved).collect();
            flat.meshes.push(TriangleMesh { vertices, indices });
        }
        let flat = flat
            .with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()).expect("a BVH"));
        with_all(&own, &child, &maps, |accels| {
            for _ in 0..40 {
                let point = [0; 3].map(|_| random.between(-4.0, 4.0) as f32);
                let radius = if random.below(4) == 0 { 0.3 } else { f32::INFINITY };
                let options = QueryOptions::default();
                let expected = flat.accel().closest_point(point, radius, &options).map(|hit| {
                    match hit.geometry {
                        0 => hit,
                        geometry => PointHit { geometry: 0, instance: geometry - 1, ..hit },
                    }
                });
                for (name, accel) in accels {
                    let found = accel.closest_point(point, radius, &options);
                    assert_eq!(point_bits(found), point_bits(expected), "{name} {point:?}");
                }
                instanced += usize::from(expected.is_some_and(|hit| hit.instance != NONE));
            }
        });
    }
    assert!(instanced > 100, "{instanced}: too easy");
}

/// Through uneven maps spheres are ellipsoids: no point of one that is tried is closer than the answer.
#[test]
fn closest_points_of_ellipsoids() {
    let spheres = vec![[0.3, 0.0, 0.1, 0.5], [-0.4, 0.2, 0.0, 0.25]];
    let child = Model { meshes: vec![], sphere_sets: vec![spheres.clone()] };
    let own = Model::default();
    let mut random = Random::new(23);
    for _ in 0..10 {
        let maps: Vec<_> = (0..3).map(|_| random_map(&mut random)).collect();
        with_all(&own, &child, &maps, |accels| {
            let point = [0; 3].map(|_| random.between(-3.0, 3.0) as f32);
            let all = accels.iter().map(|(_, accel)| {
                point_bits(accel.closest_point(point, f32::INFINITY, &QueryOptions::default()))
            });
            let all: Vec<_> = all.collect();
            assert!(all.iter().all(|bits| *bits == all[0]), "{all:?}");
            let found = accels[0].1.closest_point(point, f32::INFINITY, &QueryOptions::default());
            let found = found.expect("an ellipsoid");
            let distance_to = |p: [f64; 3]| {
                (0..3).map(|k| (p[k] - f64::from(point[k])).powi(2)).sum::<f64>().sqrt()
            };
            let distance = f64::from(found.distance);
            assert!((distance_to(found.point.map(f64::from)) - distance).abs() < 1e-5);
            for map in &maps {
                for [x, y, z, radius] in &spheres {
                    for _ in 0..300 {
                        let n = random.direction();
                        let p = [*x, *y, *z];
                        let p = [0, 1, 2].map(|k| f64::from(p[k]) + f64::from(*radius) * n[k]);
                        let image = [0, 1, 2].map(|i| {
                            let row: [f64; 4] = [0, 1, 2, 3].map(|k| f64::from(map[4 * i + k]));
                            row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]
                        });
                        assert!(distance_to(image) > distance - 1e-6, "{found:?}");
                    }
                }
            }
        });
    }
}

/// Through maps that make squares of distances overflow, all structures find what is closest.
#[test]
fn closest_points_through_extreme_maps() {
    let mut random = Random::new(24);
    let mut vertices = Vec::new();
    for _ in 0..40 {
        let middle = [0; 3].map(|_| random.between(-0.9, 0.9));
        for _ in 0..3 {
            vertices.push(middle.map(|x| (x + random.between(-0.1, 0.1)) as f32));
        }
    }
    let indices = (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let child: Model = TriangleMesh { vertices, indices }.into();
    for (e, b) in [(1e-33, 3e27), (1e-38, 1e20), (1e-30, 1e32)] {
        let map = [e, b, 0.0, 0.0, 0.0, e, b, 0.0, 0.0, 0.0, e, 0.0];
        let never =
            |layout| BuildOptions { plain_list: PlainList::Never, layout, ..Default::default() };
        let list = BuildOptions { plain_list: PlainList::Always, ..Default::default() };
        let built = child.with_scene(|scene| {
            let bvh = |options| OwnedAccel::bvh(scene, &options).expect("a BVH");
            [
                bvh(list),
                bvh(never(Layout::Compact)),
                bvh(never(Layout::Wide(4))),
                bvh(never(Layout::Wide(8))),
                bvh(never(Layout::Wide(16))),
                OwnedAccel::grid(scene, &never(Layout::Compact)).expect("a grid"),
            ]
        });
        let found = built.each_ref().map(|child| {
            let child = child.accel();
            let instances = [Instance::new(&child, map)];
            Model::default().with_scene(|scene| {
                let all = All::build(&scene.with_instances(&instances));
                let options = QueryOptions::default();
                all.accels().map(|(_, accel)| {
                    point_bits(accel.closest_point([1.0, 2.0, 3.0], f32::INFINITY, &options))
                })
            })
        });
        let first = found[0][0];
        assert!(first.is_some(), "{e} {b}");
        assert!(found.as_flattened().iter().all(|bits| *bits == first), "{e} {b}: {found:?}");
    }
}
