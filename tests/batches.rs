//! Batches give the bits of single calls, whichever way they go: as one, as a stream, in flight, or one by one.

#![allow(missing_docs)]

mod common;

use common::batch::{camera, far, same_in_a_batch, with_odd_ones};
use common::{All, odd_models};
use raykern::{Backend, BuildOptions, OwnedAccel, Quality, Ray};
use raykern_harness::make;
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::each;

fn same_in_all(model: &Model, rays: &[Ray]) -> usize {
    let all = All::of(model);
    all.accels().iter().map(|(name, accel)| same_in_a_batch(name, accel, rays)).sum()
}

#[test]
fn incoherent_rays() {
    let model: Model = make::blob(1_500, 4).into();
    let rays = with_odd_ones(RayMaker::new(&model, 3).many(Family::Random, 1_000));
    for count in [0, 1, 2, 11, 12, 13, 40, 1_000] {
        same_in_all(&model, &rays[..count]);
    }
    let near = make::blob(1_500, 4);
    let rays = with_odd_ones(RayMaker::new(&near.clone().into(), 3).many(Family::Random, 1_000));
    // Several in flight where they begin apart, and as streams where they begin together.
    for away in [3.0, 100.0] {
        let far = far(std::slice::from_ref(&near), away);
        for count in [2, 11, 12, 13, 31, 32, 33, 40, 1_000] {
            let hits = same_in_a_batch("far", &far.accel(), &rays[..count]);
            assert!(count < 1_000 || hits > 100, "{hits}");
        }
    }
}

/// Grids are walked through side by side: all sorts of rays in one batch, through all sorts of scenes.
#[test]
fn rays_of_all_families() {
    let made = make::ALL.into_iter().map(|(name, make)| (name, make(2_000)));
    each(odd_models().into_iter().chain(made), |(name, model)| {
        let families = [Family::ORDINARY.as_slice(), &Family::HOSTILE, &[Family::Invalid]].concat();
        let rays: Vec<Vec<Ray>> = (0..)
            .zip(&families)
            .map(|(seed, family)| RayMaker::new(&model, seed).many(*family, 60))
            .collect();
        // One of each after the other.
        let rays: Vec<Ray> = (0..60).flat_map(|i| rays.iter().map(move |rays| rays[i])).collect();
        let all = All::of(&model);
        for (kind, accel) in &all.accels() {
            same_in_a_batch(&format!("{name} {kind}"), accel, &rays);
        }
    });
}

#[test]
fn rays_that_leave_a_surface() {
    let mesh = make::blob(20_000, 4);
    let model: Model = mesh.clone().into();
    let mut around = RayMaker::new(&model, 5);
    // From the same places one after the other, some inwards and some outwards.
    let rays: Vec<Ray> = around
        .many(Family::Random, 600)
        .into_iter()
        .enumerate()
        .map(|(i, ray)| {
            let [a, _, _] = mesh.indices[i / 40].map(|v| mesh.vertices[v as usize]);
            Ray { origin: a, ..ray }.with_limits(0.0, if i % 3 == 0 { 0.3 } else { f32::INFINITY })
        })
        .collect();
    assert!(same_in_all(&model, &with_odd_ones(rays)) > 1_000);
}

#[test]
fn rays_with_much_to_come_back_to() {
    // Each triangle a little larger and further away than the one before, so that a ray from the smallest end leaves
    // the others behind at every level of the tree.
    let mut mesh = TriangleMesh { vertices: Vec::new(), indices: Vec::new() };
    for i in 0..1_500 {
        let (size, first) = (1.03f32.powi(i - 750), 3 * i as u32);
        mesh.vertices.extend([
            [-size, -size, size],
            [2.0 * size, -size, size],
            [-size, 2.0 * size, size],
        ]);
        mesh.indices.push([first, first + 1, first + 2]);
    }
    // By turns to either side, so that no packet holds them.
    let rays: Vec<Ray> = (0..50)
        .map(|i| {
            let side = if i % 2 == 0 { 0.001 } else { -0.001 };
            Ray::new([0.0; 3], [side * i as f32, 0.002 * i as f32, 1.0])
        })
        .collect();
    // Every second from further away, so that they begin apart.
    let apart: Vec<Ray> =
        (0..50).map(|i| Ray { origin: [0.0, 0.0, -1e9 * (i % 2) as f32], ..rays[i] }).collect();
    let far = far(std::slice::from_ref(&mesh), 100.0);
    for rays in [&rays, &apart] {
        assert!(same_in_a_batch("far", &far.accel(), rays) > 40);
        assert!(same_in_all(&mesh.clone().into(), rays) > 100);
    }
}

#[test]
fn rays_of_a_camera() {
    let blob: Model = make::blob(1_500, 4).into();
    let mixed = Model {
        sphere_sets: vec![
            (0..40)
                .map(|i| [0.1 * (i % 7) as f32 - 0.3, 0.1 * (i % 5) as f32 - 0.2, 1.5, 0.06])
                .collect(),
        ],
        ..blob.clone()
    };
    // To either side of all three axes, so that walls are passed in every order.
    for from in [[3.0, 2.5, 4.0], [-3.0, 2.5, -4.0], [3.0, -2.5, 4.0], [0.1, 0.2, 5.0]] {
        let rays = camera(32, from, [0.0; 3], 1.5);
        for model in [&blob, &mixed] {
            let hits = same_in_all(model, &rays);
            assert!(hits > 1_000, "{hits}");
        }
        // Packets that are not full, and packets with holes.
        for count in [7, 8, 9, 63, 64, 65, 100] {
            same_in_all(&mixed, &rays[..count]);
        }
        // Rays of a packet that hit nothing by definition.
        let mut lost = rays.clone();
        for ray in lost.iter_mut().skip(2).step_by(7) {
            ray.origin[1] = f32::NAN;
        }
        same_in_all(&mixed, &lost);
        same_in_all(&mixed, &with_odd_ones(rays));
    }
}

/// Packets of which each ray comes to strands of its own, so that streams follow them; and no packets after them.
#[test]
fn rays_that_share_little_on_their_way() {
    let hair: Model = make::hair(40_000, 1).into();
    let (mut rays, odd) =
        (camera(64, [3.0, 0.5, 1.0], [0.0; 3], 1.0), camera(24, [-3.0, 1.0, 0.3], [0.0; 3], 1.0));
    rays.extend(with_odd_ones(odd));
    // Through other structures they go one by one, or as packets to the end.
    let options = BuildOptions { quality: Quality::Best, ..BuildOptions::default() };
    let built = hair.with_scene(|scene| OwnedAccel::bvh(scene, &options)).expect("a BVH");
    let hits = same_in_a_batch("wide 16 best", &built.accel(), &rays);
    assert!(hits > 1_000, "{hits}");
}

/// Single floats do not tell on which side of the triangle they start or end.
#[test]
fn rays_that_leave_a_large_triangle() {
    let mut mesh = make::blob(1_500, 4);
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend([[-900.0, -700.0, 0.0], [900.0, -700.0, 0.0], [0.0, 1300.0, 0.0]]);
    mesh.indices.push([first, first + 1, first + 2]);
    let rays: Vec<Ray> = (0..640)
        .map(|i| {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let height = side * 2f32.powi(-(i / 2 % 24) - 4);
            let ray = Ray::new([5.0 + 0.01 * i as f32, 8.0, height], [1.0, 0.25, -0.03125]);
            // Below the plane nothing is met, but just before it.
            let t_min = if i % 3 == 0 { 33.0 * height } else { 0.0 };
            let t_max = if i % 5 == 0 { 32.0 * height } else { 50.0 };
            ray.with_limits(t_min.min(t_max), t_max)
        })
        .collect();
    let hits = same_in_all(&mesh.into(), &rays);
    assert!(hits > 1_000, "{hits}");
}

#[test]
fn rays_to_a_light() {
    let model: Model = make::blob(3_000, 5).into();
    let all = All::of(&model);
    let (_, accel) = all.accels()[0];
    let light = [4.0, 5.0, 6.0];
    let shadow = |ray: &Ray| {
        let t = accel.intersect(ray)?.t;
        let at = |k: usize| ray.origin[k] + ray.direction[k] * t;
        let way = |k: usize| light[k] - at(k);
        Some(Ray::new([at(0), at(1), at(2)], [way(0), way(1), way(2)]).with_limits(1e-4, 1.0))
    };
    let rays: Vec<Ray> =
        camera(64, [1.0, 1.5, 4.0], [0.0; 3], 0.7).iter().filter_map(shadow).collect();
    assert!(rays.len() > 1_000);
    let hits = same_in_all(&model, &rays);
    assert!(hits > 500, "{hits}");
}

/// A square of `side` by `side` cells of an eighth at height `z`, two triangles each.
fn lattice(side: u32, z: f32) -> TriangleMesh {
    let across = side + 1;
    let vertices = (0..across * across)
        .map(|i| [(i % across) as f32 / 8.0, (i / across) as f32 / 8.0, z])
        .collect();
    let cells = (0..side * side).map(|i| i / side * across + i % side);
    let indices =
        cells.flat_map(|a| [[a, a + 1, a + across + 1], [a, a + across + 1, a + across]]).collect();
    TriangleMesh { vertices, indices }
}

/// Every ray goes through a vertex, an edge or close to one, of layers of which two are the same and others closer than
/// `f32` tells apart; and limits are where the layers are.
#[test]
fn rays_that_single_floats_cannot_decide() {
    let layers = [0.0, 0.0, 2f32.powi(-22), 2f32.powi(-18), -0.25];
    // The last one is far away, so that origins are close for the scene.
    let mut meshes: Vec<TriangleMesh> = layers.iter().map(|z| lattice(8, *z)).collect();
    let mut beside = lattice(1, 0.0);
    beside.vertices.iter_mut().for_each(|v| v[0] += 100.0);
    meshes.push(beside);
    let model = Model { meshes, ..Model::default() };
    let towards = [0.125, 0.25, -1.0];
    let limits = [f32::INFINITY, 4.0, 4.0f32.next_down(), 4.25, 3.0];
    let rays: Vec<Ray> = (0..1024)
        .map(|i| {
            let at = [(i % 32) as f32 / 32.0, (i / 32) as f32 / 32.0, 0.0];
            let aside = [0.0, 2f32.powi(-20), 0.0, 2f32.powi(-14)][i % 4];
            let origin = [0, 1, 2].map(|k| at[k] + aside - 4.0 * towards[k]);
            let ray = Ray::new(origin, towards).with_limits(0.0, limits[i / 7 % 5]);
            if i % 50 == 3 { ray.with_limits(1.0, 0.5) } else { ray }
        })
        .collect();
    // Whatever other tests of this process use meanwhile gives the same bits.
    for backend in Backend::ALL {
        backend.force();
        let hits = same_in_all(&model, &rays);
        assert!(hits > 1_000, "{hits}");
    }
    Backend::detected().force();
}
