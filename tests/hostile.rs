//! Rays and scenes that look for trouble, with answers known beforehand.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, odd_models};
use raykern::{
    Accel, BuildOptions, Counts, Facing, Hit, Instance, Layout, Mesh, NONE, OwnedAccel, PlainList,
    Precision, PrimId, QueryOptions, Ray, Scene, SphereSet,
};
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::each;

const ALL: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };
const DOWN: [f32; 3] = [0.0, 0.0, -1.0];

fn ask(all: &All, ray: Ray) -> Option<Hit> {
    agreed(&all.accels(), &ray, &ALL)
}

#[test]
fn invalid_rays_hit_nothing() {
    for (name, model) in odd_models() {
        let all = All::of(&model);
        for ray in RayMaker::new(&model, 1).many(Family::Invalid, 1_000) {
            assert_eq!(ask(&all, ray), None, "{name} {ray:?}");
        }
    }
}

#[test]
fn nothing_is_hit_where_nothing_is() {
    let all = All::build(&Scene::new(&[], &[]));
    assert_eq!(ask(&all, Ray::new([0.0; 3], DOWN)), None);
    let flat = [[[0.0; 3]; 3], [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]];
    let broken = [[f32::NAN, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, -1.0], [0.0; 4]];
    let (meshes, sets) = ([Mesh::soup(&flat)], [SphereSet::new(&broken)]);
    let all = All::build(&Scene::new(&meshes, &sets));
    for (name, accel) in all.accels() {
        assert_eq!(accel.info().ignored_count, 5, "{name}");
    }
    assert_eq!(ask(&all, Ray::new([0.0, 0.0, 3.0], DOWN)), None);
    assert_eq!(ask(&all, Ray::new([-1.0; 3], [1.0; 3])), None);
}

#[test]
fn one_triangle_at_every_scale() {
    for power in (-147..=120).step_by(3) {
        // Powers of two, so that the answers are exact: 1e-44 to 1e36.
        let s = f32::from_bits(1).max(2f64.powi(power) as f32);
        let mesh = [[[0.0; 3], [4.0 * s, 0.0, 0.0], [0.0, 4.0 * s, 0.0]]];
        let meshes = [Mesh::soup(&mesh)];
        let all = All::build(&Scene::new(&meshes, &[]));
        let hit = ask(&all, Ray::new([s, s, 2.0 * s], [0.0, 0.0, -s])).expect("a hit");
        assert_eq!((hit.t, hit.u, hit.v), (2.0, 0.25, 0.25), "2^{power}");
        let beside = Ray::new([3.0 * s, 3.0 * s, 2.0 * s], [0.0, 0.0, -s]);
        assert_eq!(ask(&all, beside), None, "2^{power}");
    }
}

#[test]
fn edges_vertices_and_planes_of_a_square() {
    let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let meshes = [Mesh::indexed(&vertices, &[[0, 1, 2], [0, 2, 3]])];
    let all = All::build(&Scene::new(&meshes, &[]));
    for (x, y, prim) in
        [(0.0, 0.0, 0), (1.0, 0.0, 0), (1.0, 1.0, 0), (0.0, 1.0, 1), (0.5, 0.5, 0), (0.0, 0.5, 1)]
    {
        let hit = ask(&all, Ray::new([x, y, 1.0], DOWN)).expect("the boundary belongs to it");
        assert_eq!((hit.prim, hit.t), (prim, 1.0), "{x} {y}");
    }
    for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, -0.0, 0.0]] {
        assert_eq!(ask(&all, Ray::new([0.5, 0.5, 0.0], direction)), None, "{direction:?}");
    }
    let behind = Ray::new([0.5, 0.25, -1.0], DOWN);
    assert_eq!(ask(&all, behind), None);
    let hit = ask(&all, behind.with_limits(-2.0, 0.0)).expect("negative limits are honoured");
    assert_eq!(hit.t, -1.0);
    assert_eq!(ask(&all, behind.with_limits(0.0, -2.0)), None);
}

#[test]
fn equal_hits_go_to_the_first_in_order() {
    let triangle = [[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]; 40];
    let meshes = [Mesh::soup(&triangle[..0]), Mesh::soup(&triangle), Mesh::soup(&triangle)];
    let all = All::build(&Scene::new(&meshes, &[]));
    let hit = ask(&all, Ray::new([1.0, 1.0, 1.0], DOWN)).expect("a hit");
    assert_eq!((hit.geometry, hit.prim), (1, 0));
}

#[test]
fn a_teapot_in_a_stadium() {
    let mut model: Model = make::sphere(2_000).into();
    model.meshes.push(make::plane(200).placed(1e6, [-5e5, -5e5, -2.0]));
    let all = All::of(&model);
    let down = |x: f32, y: f32| ask(&all, Ray::new([x, y, 4.0], DOWN)).map(|hit| hit.geometry);
    assert_eq!(down(0.1, 0.2), Some(0));
    assert_eq!(down(1.1, 0.2), Some(1));
    assert_eq!(down(4e5, -4e5), Some(1));
    assert_eq!(down(6e5, 0.0), None);
}

/// Cells so small against the coordinates that `t` underflows `f32` while a ray crosses them.
#[test]
fn a_speck_far_from_zero() {
    let places = [(1e38, 1e-40), (1e38, 1e-30), (1e30, 1e-10), (1e30, 1e14), (1e6, 1e-6)];
    each(places, |(height, size)| {
        let model: Model = make::plane(500).placed(size, [0.0, 0.0, height]).into();
        let all = All::of(&model);
        let mut hits = 0;
        for i in 0..400 {
            let [x, y] = [i % 20, i / 20].map(|i| ((f64::from(i) / 19.0 - 0.1) * size) as f32);
            for direction in
                [[1.0, 0.5, 1.0], [-1.0, 0.25, -2.0], [0.0, 0.0, 1.0], [1e-3, 1.0, -1e-9]]
            {
                let ray = Ray::new([x, y, height as f32], direction);
                hits += usize::from(ask(&all, ray).is_some());
            }
            let above = Ray::new([x, y, (height as f32).next_up()], DOWN);
            hits += usize::from(ask(&all, above).is_some());
        }
        assert!(hits > 400, "{height} {size}: {hits}");
    });
}

/// No panic, no hang, and agreement: all families over odd scenes at extreme scales.
#[test]
fn extreme_scales() {
    for power in [-140, -100, -30, 30, 100, 120] {
        let s = 2f64.powi(power);
        let model: Model = make::soup(100, 3).placed(s, [s, -s, 0.0]).into();
        let all = All::of(&model);
        for family in Family::HOSTILE {
            for ray in RayMaker::new(&model, 2).many(family, 100) {
                ask(&all, ray);
            }
        }
    }
}

#[test]
fn a_tangent_has_two_sides_and_is_skipped_whole() {
    let model = Model { meshes: vec![], sphere_sets: vec![vec![[0.0, 0.0, -5.0, 1.0]]] };
    let all = All::of(&model);
    let ray = Ray::new([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let skip = Some(PrimId { prim: 0, geometry: 0, instance: NONE });
    for (_, accel) in all.accels() {
        for facing in [Facing::Both, Facing::Front, Facing::Back] {
            let options = QueryOptions { facing, ..Default::default() };
            assert_eq!(accel.intersect_with(&ray, &options).map(|hit| hit.t), Some(5.0));
        }
        let options = QueryOptions { skip, ..Default::default() };
        assert_eq!(accel.intersect_with(&ray, &options), None);
    }
}

/// Where no float is: the sphere's far side is at twice the largest one's distance.
#[test]
fn spheres_are_met_beyond_the_largest_float() {
    let model = Model { meshes: vec![], sphere_sets: vec![vec![[0.0, 3e38, 0.0, 3e38]]] };
    let all = All::of(&model);
    for k in 0..3 {
        // From the centre; across, the far side is within the floats.
        let way = [0, 1, 2].map(|i| if i == k { 1e38 } else { 0.0 });
        let ray = Ray::new([0.0, 3e38, 0.0], way).with_limits(2.0, 4.0);
        assert_eq!(ask(&all, ray).map(|hit| hit.t), Some(3.0), "{k}");
        let back = Ray::new([0.0, 3e38, 0.0], way.map(|x| -x)).with_limits(2.0, 4.0);
        assert_eq!(ask(&all, back).map(|hit| hit.t), Some(3.0), "{k}");
    }
}

/// Hits that round to one `t`, in a block of foreign bytes in which two of their triangles have one number.
#[test]
fn lists_end_where_a_number_is_there_twice() {
    const COUNT: u32 = 24;
    let depths = (0..COUNT).map(|i| 0.24 - 0.01 * i as f32);
    let corners = |z: f32| [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]];
    let triangles: Vec<[[f32; 3]; 3]> = depths.map(corners).collect();
    let meshes = [Mesh::soup(&triangles)];
    let ids: Vec<u8> = (0..COUNT).flat_map(u32::to_ne_bytes).collect();
    let list = BuildOptions { plain_list: PlainList::Always, ..BuildOptions::default() };
    let built = OwnedAccel::bvh(&Scene::new(&meshes, &[]), &list).expect("builds");
    let child = built.accel();
    let one = [Instance::new(&child, [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.])];
    let scene = Scene::new(&[], &[]).with_instances(&one);
    let packed = OwnedAccel::bvh(&scene, &list).expect("builds").packed().expect("fits");
    let ray = Ray::new([0.0, 0.0, 16_777_216.0], [0.0, 0.0, -1.0]);
    for block in [child.block(), packed.accel().block()] {
        let mut memory = vec![0; block.len() + 64];
        let start = memory.as_ptr().align_offset(64);
        let memory = &mut memory[start..][..block.len()];
        memory.copy_from_slice(block);
        let at = block.windows(ids.len()).position(|window| window == ids).expect("all numbers");
        memory[at + ids.len() - 4..][..4].copy_from_slice(&7u32.to_ne_bytes());
        let accel = Accel::open(memory).expect("its numbers are those of triangles");
        let most = 2 * COUNT as usize;
        let options = QueryOptions::default();
        assert!(accel.hits(&ray, &options).take(most + 1).count() <= most);
        assert!(accel.nearest_hits(&ray, &options, &mut [Hit::MISS; 100]) <= most);
    }
}

/// From wherever a ray comes, it looks at what is on its way and not at everything.
#[test]
fn far_rays_do_not_look_at_everything() {
    let model: Model = make::sphere(20_000).into();
    for layout in [Layout::Automatic, Layout::Wide(4), Layout::Compact] {
        let options = BuildOptions { layout, ..BuildOptions::default() };
        let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options)).expect("builds");
        let accel = built.accel();
        for distance in [1e3, 1e5, 1e7, 1e9, 1e11] {
            for way in [[0.6f32, 0.3, 0.2], [-0.1, 0.0, 0.7], [0.0, -1.0, 0.0]] {
                let ray = Ray::new(way.map(|x| -x * distance), way);
                let mut counts = Counts::default();
                let options = QueryOptions::default();
                let hit = accel.intersect_counted(&ray, &options, &mut counts);
                assert_eq!(hit, accel.intersect(&ray), "{distance:e} {way:?}");
                let (steps, tests) = (counts.steps, counts.tests);
                assert!(
                    steps + tests < 3_000,
                    "{distance:e} {way:?}: {steps} steps, {tests} tests"
                );
                let mut hits = [Hit::MISS; 64];
                accel.intersect_batch(&[ray; 64], &mut hits);
                assert!(hits.iter().all(|h| *h == hit.unwrap_or(Hit::MISS)));
            }
        }
    }
}
