//! Batches through instances give the bits of single calls, whichever way they go.

#![allow(missing_docs)]

mod common;

use common::All;
use common::batch::{ALL, camera, far, same_in_a_batch, with_odd_ones};
use raykern::{Accel, BuildOptions, Hit, Instance, OwnedAccel, PrimId, QueryOptions, Ray, Scene};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};

/// A mesh and spheres, within about 1 of zero.
fn mixed(seed: u64) -> Model {
    let sphere_sets = vec![vec![[0.6, 0.5, 0.5, 0.4], [-0.6, 0.1, -0.4, 0.3]]];
    Model { sphere_sets, ..make::blob(1_500, seed).into() }
}

fn built(model: &Model) -> OwnedAccel<'static> {
    model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default())).expect("a BVH")
}

/// Sheared and scaled a little, at `step` times the place of number `i` in a square of `side`.
fn place(random: &mut Random, i: usize, side: usize, step: f64) -> [f32; 12] {
    let mut m = [0.0f64; 12].map(|_| random.between(-0.3, 0.3));
    for (k, at) in [(i % side) as f64, 0.5 * side as f64, (i / side) as f64].into_iter().enumerate()
    {
        m[5 * k] += random.between(0.7, 1.2);
        m[4 * k + 3] += step * (at - 0.5 * side as f64);
    }
    m.map(|x| x as f32)
}

/// `count` of the children in turn, in a square about zero.
fn field<'c>(children: &[Accel<'c>], count: usize, step: f64) -> Vec<Instance<'c>> {
    let (mut random, side) = (Random::new(7), (count as f64).sqrt().ceil() as usize);
    let shown = |i: usize| {
        let map = place(&mut random, i, side, step);
        Instance::new(&children[i % children.len()], map).with_mask(1 << (i % 3))
    };
    (0..count).map(shown).collect()
}

/// Random rays between points of a box.
fn strewn_rays(count: usize, size: [f64; 3]) -> Vec<Ray> {
    let mut random = Random::new(3);
    let mut point = || size.map(|size| random.between(-size, size) as f32);
    let mut ray = || {
        let (from, to) = (point(), point());
        Ray::new(from, [0, 1, 2].map(|k| to[k] - from[k]))
    };
    (0..count).map(|_| ray()).collect()
}

/// Several children, each several times, and something in no instance; near and far cameras, so that neighbours meet the
/// same triangles, the same instance or nothing alike.
#[test]
fn a_field_of_instances() {
    let models = [mixed(1), mixed(2), make::soup(40, 3).into()];
    let children: Vec<_> = models.iter().map(built).collect();
    let accels: Vec<_> = children.iter().map(OwnedAccel::accel).collect();
    let instances = field(&accels, 150, 1.7);
    let plane: Model = make::plane(16).placed(30.0, [-15.0, -15.0, -3.0]).into();
    let odd = with_odd_ones(strewn_rays(500, [12.0, 2.0, 12.0]));
    let rays = [
        camera(32, [0.5, 8.0, 30.0], [0.0; 3], 12.0),
        camera(32, [1.5, 3.0, 9.0], [0.2, 0.1, 0.2], 1.0),
        camera(32, [-0.8, 12.0, 1.3], [-0.85, 0.0, 0.85], 0.02),
        odd,
    ];
    for own in [Model::default(), plane] {
        let structures = own.with_scene(|scene| All::build(&scene.with_instances(&instances)));
        for rays in &rays {
            for (name, accel) in &structures.accels()[..] {
                let hits = same_in_a_batch(name, accel, rays);
                assert!(hits > 100, "{name} {hits}");
            }
        }
        let (name, accel) = structures.accels()[0];
        for count in [0, 1, 3, 4, 15, 16, 17, 127, 128, 129, 300] {
            same_in_a_batch(name, &accel, &rays[0][..count]);
            same_in_a_batch(name, &accel, &rays[3][..count]);
        }
    }
}

/// A child so large that rays in it are in flight, few and many instances of it, and rays that begin in one of them.
#[test]
fn instances_of_a_large_child() {
    let large = far(&[make::blob(1_500, 4)], 0.0);
    let child = [large.accel()];
    for count in [12, 200] {
        let instances = field(&child, count, 1.5);
        let scene = Scene::new(&[], &[]).with_instances(&instances);
        let top = OwnedAccel::bvh(&scene, &BuildOptions::default()).expect("a BVH");
        let accel = top.accel();
        let rays = camera(64, [0.5, 12.0, 30.0], [0.0; 3], 4.0);
        let hits: Vec<_> = rays.iter().map(|ray| accel.intersect(ray)).collect();
        let mut random = Random::new(5);
        let onwards = rays.iter().zip(&hits).filter_map(|(ray, hit)| {
            let front = accel.surface(ray, hit.as_ref()?)?.front_origin;
            Some(Ray::new(front, [0.0; 3].map(|_: f32| random.between(-1.0, 1.0) as f32)))
        });
        let onwards: Vec<_> = onwards.collect();
        let random = strewn_rays(1_000, [8.0, 1.0, 8.0]);
        for rays in [&rays, &onwards, &random] {
            let hits = same_in_a_batch("bvh", &accel, rays);
            assert!(hits > 300, "{count}: {hits}");
        }
    }
}

/// More boxes stand in the way of a ray than are remembered, and what it hits is behind all of them or before some.
#[test]
fn many_instances_in_a_row() {
    // Two small triangles at the corners of a box that is empty otherwise, and a wall.
    let corner = |x: f32| [[x, 0.0, x], [x + 0.01, 0.0, x], [x, 0.01, x]];
    let vertices = [corner(-1.0), corner(0.99)].concat();
    let sparse: Model = TriangleMesh { vertices, indices: vec![[0, 1, 2], [3, 4, 5]] }.into();
    let wall: Model = make::plane(2).placed(2.0, [-1.0, -1.0, 0.0]).into();
    let children = [built(&sparse), built(&wall)];
    let rays: Vec<Ray> = (0..300)
        .map(|i| {
            let (x, y) = ((i % 20) as f32 / 12.0 - 0.8, (i / 20) as f32 * 5e-4 + 1e-4);
            Ray::new([x, y, -4.0], [1e-3, 1e-5, 1.0])
        })
        .collect();
    for wall_at in [None, Some(3), Some(8), Some(30)] {
        let instances: Vec<_> = (0..40)
            .map(|i| {
                let map = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.7 * i as f32];
                Instance::new(&children[usize::from(wall_at == Some(i))].accel(), map)
            })
            .collect();
        let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
        for (name, accel) in all.accels() {
            let hits = same_in_a_batch(name, &accel, &rays);
            assert_eq!(hits > 300, wall_at.is_some(), "{name} {wall_at:?} {hits}");
        }
    }
}

/// Instances in the same place, and one where there is the same in no instance: the first of equal hits wins, whoever is
/// asked first.
#[test]
fn ties_of_instances() {
    let model = mixed(1);
    let child = built(&model);
    let same = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let beside = |x: f32| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let rays = camera(32, [0.5, 1.0, 4.0], [0.0; 3], 1.2);
    let mut instances: Vec<_> =
        (0..20).map(|i| Instance::new(&child.accel(), beside(3.0 * i as f32 - 30.0))).collect();
    instances.push(Instance::new(&child.accel(), same));
    instances.push(Instance::new(&child.accel(), same));
    for own in [Model::default(), model.clone()] {
        let all = own.with_scene(|scene| All::build(&scene.with_instances(&instances)));
        for (name, accel) in all.accels() {
            let hits = same_in_a_batch(name, &accel, &rays);
            assert!(hits > 500, "{name} {hits}");
        }
    }
}

/// What is skipped in one instance is there in the others; masks leave instances out; far away boxes are wider.
#[test]
fn options_hold_in_batches() {
    let child = built(&mixed(1));
    let instances = field(&[child.accel()], 60, 1.2);
    let scene = Scene::new(&[], &[]).with_instances(&instances);
    let top = OwnedAccel::bvh(&scene, &BuildOptions::default()).expect("a BVH");
    let accel = top.accel();
    let rays = camera(64, [0.5, 8.0, 20.0], [0.0; 3], 6.0);
    let first = rays.iter().find_map(|ray| accel.intersect(ray)).expect("a hit");
    let Hit { prim, geometry, instance, .. } = first;
    let skip = Some(PrimId { prim, geometry, instance });
    let mut differ = 0;
    for options in [QueryOptions { skip, ..ALL }, QueryOptions { mask: 2, ..ALL }] {
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.intersect_batch_with(&rays, &options, &mut hits);
        for (ray, hit) in rays.iter().zip(hits) {
            let single = accel.intersect_with(ray, &options).unwrap_or(Hit::MISS);
            assert_eq!(common::bits(Some(hit)), common::bits(Some(single)), "{ray:?}");
            differ += usize::from(accel.intersect(ray).unwrap_or(Hit::MISS) != single);
        }
    }
    assert!(differ > 100, "{differ}");
    let distant = camera(64, [5e5, 8e5, 2e6], [0.0; 3], 6.0);
    same_in_a_batch("bvh", &accel, &distant);
}

/// What is behind the shorter of two slices stays as it was, on every way that a batch may go.
#[test]
fn a_batch_ends_with_the_shorter_slice() {
    let models = [mixed(1), make::soup(40, 3).into()];
    let children: Vec<_> = models.iter().map(built).collect();
    let accels: Vec<_> = children.iter().map(OwnedAccel::accel).collect();
    let instances = field(&accels, 20, 1.7);
    let structures = All::build(&Scene::new(&[], &[]).with_instances(&instances));
    let strewn = strewn_rays(500, [12.0, 2.0, 12.0]);
    let alike = camera(32, [0.5, 8.0, 30.0], [0.0; 3], 12.0);
    let mark = Hit { t: 7.0, ..Hit::MISS };
    for (name, accel) in &structures.accels()[..] {
        for rays in [&strewn, &alike] {
            for (given, room) in [(12, 20), (0, 5), (128, 140), (140, 300), (20, 12), (300, 140)] {
                let (mut hits, mut any) = (vec![mark; room], vec![true; room]);
                accel.intersect_batch(&rays[..given], &mut hits);
                accel.occluded_batch(&rays[..given], &mut any);
                for i in 0..room {
                    let hit = if i < given { accel.intersect(&rays[i]) } else { Some(mark) };
                    assert_eq!(hits[i], hit.unwrap_or(Hit::MISS), "{name} {given} {room} {i}");
                    assert_eq!(any[i], hit.is_some(), "{name} {given} {room} {i}");
                }
            }
        }
    }
}
