//! A refitted block answers as one that is built anew, to the bit, wherever things went.

#![allow(missing_docs)]

mod common;
#[path = "common/motion.rs"]
mod motion;

use common::{bits, choose_backend, odd_models};
use raykern::{
    Accel, AccelMut, BuildOptions, Counts, Hit, Info, Instance, Layout, Mesh, OwnedAccel,
    PlainList, Quality, QueryOptions, Ray, RefitError, Scene, Strided, Threads, bvh_needs,
};
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::each;
use std::mem::MaybeUninit;

/// A list, and BVHs of every layout and quality, to be refitted.
fn all_options() -> Vec<(String, BuildOptions<'static>)> {
    let never = BuildOptions { refit: true, plain_list: PlainList::Never, ..Default::default() };
    let mut all = vec![("list".into(), BuildOptions { plain_list: PlainList::Always, ..never })];
    for layout in [Layout::Compact, Layout::Wide(4), Layout::Wide(8), Layout::Wide(16)] {
        for quality in [Quality::Fast, Quality::Balanced, Quality::Best] {
            let options = BuildOptions { layout, quality, ..never };
            all.push((format!("{layout:?} {quality:?}"), options));
        }
    }
    all
}

fn models() -> Vec<(&'static str, Model)> {
    let made = make::ALL.map(|(name, make)| (name, make(300)));
    odd_models().into_iter().chain(made).collect()
}

/// Rays of a few families, and some bundles of rays that are alike, which a batch traces together.
fn rays(model: &Model, each: usize) -> Vec<Ray> {
    let families = [Family::Random, Family::AtVertex, Family::AtEdge, Family::Bounce, Family::Far];
    let families = families.into_iter().zip(1..);
    let mut rays: Vec<Ray> =
        families.flat_map(|(family, seed)| RayMaker::new(model, seed).many(family, each)).collect();
    for ray in RayMaker::new(model, 9).many(Family::Random, 6) {
        let [x, y, z] = ray.direction;
        rays.extend((0..64).map(|i| {
            let [a, b] = [i % 8, i / 8].map(|k| 1.0 + 0.02 * k as f32);
            Ray { direction: [a * x, b * y, z], ..ray }
        }));
    }
    rays
}

/// Everything that one structure answers, as bits.
fn answers(accel: &Accel, rays: &[Ray]) -> Vec<Option<[u32; 6]>> {
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.intersect_batch(rays, &mut hits);
    for (ray, batched) in rays.iter().zip(&hits) {
        let hit = accel.intersect(ray);
        assert_eq!(bits(Some(hit.unwrap_or(Hit::MISS))), bits(Some(*batched)), "batch, {ray:?}");
        assert_eq!(accel.occluded(ray), hit.is_some(), "occluded, {ray:?}");
        if let Some(hit) = hit {
            assert!(accel.surface(ray, &hit).is_some(), "surface, {ray:?}");
        }
    }
    hits.into_iter().map(|hit| bits(Some(hit))).collect()
}

/// What an accel says of the scene.
fn census(info: &Info) -> ([f32; 6], [u32; 3]) {
    let ([a, b, c], [d, e, f]) = (info.lower, info.upper);
    ([a, b, c, d, e, f], [info.triangle_count, info.sphere_count, info.ignored_count])
}

fn with_memory<R>(size: usize, f: impl FnOnce(&mut [MaybeUninit<u8>]) -> R) -> R {
    let mut memory = vec![MaybeUninit::new(0xa5u8); size + 64];
    let start = memory.as_ptr().align_offset(64);
    f(&mut memory[start..start + size])
}

#[test]
fn answers_are_those_of_a_structure_built_anew() {
    choose_backend();
    each(models(), |(name, model)| {
        let mut built: Vec<_> = (all_options().into_iter())
            .map(|(kind, options)| {
                let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options));
                let built = built.expect("a structure");
                let original = built.accel().block().to_vec();
                (kind, built, original)
            })
            .collect();
        let motions = motion::ALL.iter().map(|(how, motion)| (*how, motion(&model)));
        for (how, moved) in [("not", model.clone())].into_iter().chain(motions) {
            let rays = rays(&moved, 40);
            let fresh = moved.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()));
            let fresh = fresh.expect("a structure");
            let expected = answers(&fresh.accel(), &rays);
            for (kind, built, original) in &mut built {
                let growth = moved.with_scene(|scene| built.refit(scene, None));
                let growth = growth.unwrap_or_else(|e| panic!("{name} {how} {kind}: {e}"));
                let accel = Accel::open(built.accel().block()).expect("a sound block");
                assert_eq!(accel.info().cost_growth, Some(growth), "{name} {how} {kind}");
                assert!(growth > 0.0 && growth.is_finite(), "{name} {how} {kind}: {growth}");
                let (now, then) = (census(&accel.info()), census(&fresh.accel().info()));
                assert_eq!(now, then, "{name} {how} {kind}");
                assert!(answers(&accel, &rays) == expected, "{name} {how} {kind}");
                // In every place, so that there is a way back from each.
                model.with_scene(|scene| built.refit(scene, None)).expect("the built scene");
                assert!(built.accel().block() == *original, "{name} {how} {kind}: back");
            }
        }
    });
}

/// A structure over what cannot be hit yet.
#[test]
fn what_was_nothing_when_it_was_built_appears() {
    for (name, model) in models() {
        let gone = motion::gone(&model);
        let rays = rays(&model, 40);
        let fresh = model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()));
        let fresh = fresh.expect("a structure");
        for (kind, options) in all_options() {
            let built = gone.with_scene(|scene| OwnedAccel::bvh(scene, &options));
            let mut built = built.unwrap_or_else(|e| panic!("{name} {kind}: {e}"));
            assert!(rays.iter().all(|ray| built.accel().intersect(ray).is_none()));
            model.with_scene(|scene| built.refit(scene, None)).expect("the same meshes");
            let expected = answers(&fresh.accel(), &rays);
            assert!(answers(&built.accel(), &rays) == expected, "{name} {kind}");
        }
    }
}

#[test]
fn any_memory_from_the_minimum_on_will_do() {
    for (name, model) in models() {
        let moved = motion::wild(&model);
        let rays = rays(&moved, 20);
        let fresh = moved.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()));
        let expected = answers(&fresh.expect("a structure").accel(), &rays);
        for (kind, options) in all_options() {
            let need = model.with_scene(|scene| bvh_needs(scene, &options)).expect("a size");
            for size in [need.minimum, need.minimum.midpoint(need.size), need.size] {
                with_memory(size, |memory| {
                    let built = model.with_scene(|scene| AccelMut::bvh(scene, &options, memory));
                    let mut built = built.unwrap_or_else(|e| panic!("{name} {kind}: {e}"));
                    moved.with_scene(|scene| built.refit(scene, None)).expect("the same meshes");
                    assert!(answers(&built.accel(), &rays) == expected, "{name} {kind} {size}");
                });
            }
        }
    }
}

/// Blocks after a refusal, and why.
fn refusal(built: &mut OwnedAccel, scene: &Scene) -> Option<RefitError> {
    let before = built.accel().block().to_vec();
    let error = built.refit(scene, None).err();
    assert!(error.is_none() || built.accel().block() == before, "{error:?}: written");
    error
}

#[test]
fn what_was_not_built_for_it_is_left_as_it_is() {
    let model: Model = make::blob(5000, 1).into();
    let options = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
    let refit = BuildOptions { refit: true, ..options };
    model.with_scene(|scene| {
        let list = BuildOptions { plain_list: PlainList::Always, ..options };
        let compact = BuildOptions { layout: Layout::Compact, ..options };
        for built in [
            OwnedAccel::grid(scene, &refit),
            OwnedAccel::bvh(scene, &options),
            OwnedAccel::bvh(scene, &compact),
            OwnedAccel::bvh(scene, &list),
        ] {
            let mut built = built.expect("a structure");
            assert_eq!(built.accel().info().cost_growth, None);
            assert_eq!(refusal(&mut built, scene), Some(RefitError::NotRefittable));
        }
        // So few rays would make it a grid.
        let few = BuildOptions { rays_per_prim: 0.05, ..refit };
        let mut chosen = OwnedAccel::automatic(scene, &few).expect("a structure");
        assert_eq!(refusal(&mut chosen, scene), None, "no grid was chosen");
    });
}

#[test]
fn other_scenes_are_refused() {
    let mut model: Model = make::blob(300, 1).into();
    model.meshes.push(make::plane(20));
    model.sphere_sets.push(vec![[0.0, 0.0, 2.0, 0.5]; 7]);
    let change = |f: &dyn Fn(&mut Model)| {
        let mut other = model.clone();
        f(&mut other);
        other
    };
    let others = [
        change(&|m| m.meshes[0].indices.truncate(200)),
        change(&|m| m.meshes[1].indices.push([0, 1, 2])),
        change(&|m| m.meshes[1].indices[7][2] ^= 1),
        change(&|m| m.meshes[0].indices[3].rotate_left(1)),
        change(&|m| m.meshes[0].indices.swap(5, 6)),
        change(&|m| m.meshes[0].vertices.truncate(100)),
        change(&|m| m.meshes.push(make::plane(1))),
        change(&|m| m.meshes.swap(0, 1)),
        change(&|m| drop(m.meshes.pop())),
        change(&|m| m.sphere_sets[0].push([0.0; 4])),
        change(&|m| m.sphere_sets.push(vec![])),
        change(&|m| m.sphere_sets.clear()),
        Model::default(),
    ];
    for (kind, options) in all_options() {
        let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options));
        let mut built = built.expect("a structure");
        for (i, other) in others.iter().enumerate() {
            let error = other.with_scene(|scene| refusal(&mut built, scene));
            assert_eq!(error, Some(RefitError::OtherScene), "{kind} {i}");
        }
        // More vertices than are used, or others where nothing is used, are the same meshes.
        let more = change(&|m| m.meshes[0].vertices.push([7.0; 3]));
        assert_eq!(more.with_scene(|scene| refusal(&mut built, scene)), None, "{kind}");
    }
}

/// Two vertices in one place may part: triangles along a band that have no vertex in common, and then rise.
#[test]
fn vertices_are_the_same_by_their_numbers_alone() {
    let point = |i: usize| [(i / 2) as f32, (i % 2) as f32, 0.0];
    let band: Vec<[[f32; 3]; 3]> =
        (0..400).map(|i| [point(i), point(i + 1), point(i + 2)]).collect();
    let height = |i: usize| 0.125 * i as f32;
    let risen: Vec<_> = (0..400).map(|i| band[i].map(|[x, y, _]| [x, y, height(i)])).collect();
    for (kind, options) in all_options() {
        let meshes = [Mesh::soup(&band)];
        let built = OwnedAccel::bvh(&Scene::new(&meshes, &[]), &options);
        let mut built = built.expect("a structure");
        let layout = built.accel().info().layout;
        let list = options.plain_list == PlainList::Always;
        assert!(list || layout == options.layout, "{kind}: {layout:?}, for want of room");
        let moved = [Mesh::soup(&risen)];
        built.refit(&Scene::new(&moved, &[]), None).expect("the same mesh");
        for (i, corners) in band.iter().enumerate() {
            let [x, y] = [0, 1].map(|k| corners.iter().map(|v| v[k]).sum::<f32>() / 3.0);
            let hit = built.accel().intersect(&Ray::new([x, y, 100.0], [0.0, 0.0, -1.0]));
            let hit = hit.map(|hit| (hit.prim as usize, hit.t));
            assert_eq!(hit, Some((i, 100.0 - height(i))), "{kind}");
        }
    }
}

/// Meshes that do not use all of their arrays, before others.
#[test]
fn spare_indices_and_vertices_belong_to_nothing() {
    let plane = make::plane(200);
    let vertices = Strided::new(plane.vertices.as_flattened(), 3, 3, plane.vertices.len());
    let indices = Strided::new(plane.indices.as_flattened(), 3, 3, plane.indices.len());
    let (vertices, indices) = (vertices.expect("vertices"), indices.expect("indices"));
    let blob = make::blob(200, 1);
    let meshes = [
        Mesh::strided(vertices, Some(indices), 20),
        Mesh::indexed(&blob.vertices, &blob.indices),
        Mesh::strided(vertices, None, 5),
        Mesh::indexed(&blob.vertices, &blob.indices),
    ];
    let scene = Scene::new(&meshes, &[]);
    let list = BuildOptions { plain_list: PlainList::Always, ..Default::default() };
    let list = OwnedAccel::bvh(&scene, &list).expect("a list");
    let rays = rays(&blob.clone().into(), 40);
    let expected = answers(&list.accel(), &rays);
    for (kind, options) in all_options() {
        let mut built = OwnedAccel::bvh(&scene, &options).expect("a structure");
        built.refit(&scene, None).expect("the same meshes");
        assert!(answers(&built.accel(), &rays) == expected, "{kind}");
        let plain = BuildOptions { refit: false, ..options };
        let plain = OwnedAccel::bvh(&scene, &plain).expect("a structure");
        assert!(answers(&plain.accel(), &rays) == expected, "{kind}, not to be refitted");
    }
}

#[test]
fn masks_are_those_of_the_moved_scene() {
    let mut model: Model = make::blob(300, 1).into();
    model.meshes.push(make::plane(20));
    for (kind, options) in all_options() {
        let built = model.with_masked_scene(&[1, 2], |scene| OwnedAccel::bvh(scene, &options));
        let mut built = built.expect("a structure");
        model.with_masked_scene(&[4, 2], |scene| built.refit(scene, None)).expect("the same");
        let anew = BuildOptions::default();
        let fresh = model.with_masked_scene(&[4, 2], |scene| OwnedAccel::bvh(scene, &anew));
        let fresh = fresh.expect("a structure");
        for ray in rays(&model, 20) {
            for mask in [1, 2, 4] {
                let options = QueryOptions { mask, ..Default::default() };
                let hit = built.accel().intersect_with(&ray, &options);
                let expected = fresh.accel().intersect_with(&ray, &options);
                assert_eq!(bits(hit), bits(expected), "{kind} {mask}");
            }
        }
    }
}

#[test]
fn costs_grow_with_disorder() {
    let model: Model = make::sphere(5000).into();
    for (kind, options) in all_options().into_iter().skip(1) {
        let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options));
        let mut built = built.expect("a structure");
        let mut growth =
            |moved: Model| moved.with_scene(|s| built.refit(s, None)).expect("the same meshes");
        assert_eq!(growth(model.clone()), 1.0, "{kind}");
        let turned = growth(motion::rigid(&model));
        assert!((0.8..1.3).contains(&turned), "{kind}: {turned}");
        let wild = growth(motion::wild(&model));
        assert!(wild > 4.0, "{kind}: {wild}");
    }
}

/// What is nowhere when the tree is built spoils it for nothing else.
#[test]
fn what_cannot_be_hit_is_in_nobodys_way() {
    let mut model: Model = make::terrain(5000, 1).into();
    for vertex in model.meshes[0].vertices.iter_mut().step_by(60) {
        vertex[0] = f32::INFINITY;
    }
    model.meshes[0].vertices[77] = [-1e30; 3];
    model.meshes[0].indices.extend([[77, 77, 5]; 100]);
    let rays = rays(&make::terrain(5000, 1).into(), 100);
    let steps = |options: &BuildOptions| {
        let built = model.with_scene(|scene| OwnedAccel::bvh(scene, options)).expect("a BVH");
        let mut counts = Counts::default();
        for ray in &rays {
            built.accel().intersect_counted(ray, &QueryOptions::default(), &mut counts);
        }
        counts.steps + counts.blocks
    };
    for (kind, options) in all_options().into_iter().skip(1) {
        let (kept, plain) = (steps(&options), steps(&BuildOptions { refit: false, ..options }));
        assert!(kept as f64 <= 1.5 * plain as f64, "{kind}: {kept} steps, not {plain}");
    }
}

/// Runs tasks from the last to the first.
struct Backwards(usize);

impl Threads for Backwards {
    fn worker_count(&self) -> usize {
        self.0
    }

    fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        (0..count).rev().for_each(task);
    }
}

#[test]
fn threads_do_not_change_the_bytes() {
    let mut model: Model = make::terrain(60_000, 1).into();
    model.sphere_sets.push(vec![[0.0, 0.0, 2.0, 0.5]; 9000]);
    let moved = motion::broken(&motion::rigid(&model));
    for (kind, options) in all_options().into_iter().skip(3).step_by(3) {
        let block = |threads: Option<&dyn Threads>| {
            let options = BuildOptions { threads, ..options };
            let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options));
            let mut built = built.expect("a structure");
            let before = built.accel().block().to_vec();
            moved.with_scene(|scene| built.refit(scene, threads)).expect("the same meshes");
            (before, built.accel().block().to_vec())
        };
        let alone = block(None);
        for workers in [2, 3, 16] {
            assert!(block(Some(&Backwards(workers))) == alone, "{kind} {workers}");
        }
    }
}

/// Of a child that moves, a part may have nothing in it that can be hit: as the first of its root, or as any.
#[test]
fn instances_show_what_is_left_of_a_child() {
    let at = |x: f32| {
        (0..40)
            .map(move |y| [[x, 0.0], [x + 1.0, 0.0], [x, 1.0]].map(|[x, z]| [x, y as f32 + z, 0.0]))
    };
    let there: Vec<_> = [-100.0, 0.0, 100.0].into_iter().flat_map(at).collect();
    let one = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let turned = [0.0, -2.0, 0.0, 7.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0];
    for (name, options) in all_options() {
        for (gone, kept) in [(-100.0, [0.0, 100.0]), (0.0, [-100.0, 100.0]), (100.0, [-100.0, 0.0])]
        {
            let left = |t: &[[f32; 3]; 3]| if t[0][0] == gone { [[f32::NAN; 3]; 3] } else { *t };
            let moved: Vec<_> = there.iter().map(left).collect();
            let (before, after) = ([Mesh::soup(&there)], [Mesh::soup(&moved)]);
            let mut child = OwnedAccel::bvh(&Scene::new(&before, &[]), &options).expect("a child");
            child.refit(&Scene::new(&after, &[]), None).expect("the same scene");
            let child = child.accel();
            let instances = [one, turned, one].map(|map| Instance::new(&child, map));
            for count in 1..=instances.len() {
                let scene = Scene::new(&[], &[]).with_instances(&instances[..count]);
                let structures = common::All::build(&scene);
                for (_, accel) in structures.accels() {
                    let size = accel.pack_needs().expect("a size").size;
                    let mut memory = vec![MaybeUninit::new(0u8); size + 64];
                    let start = memory.as_ptr().align_offset(64);
                    let packed = accel.pack(&mut memory[start..][..size]).expect("enough");
                    assert!(Accel::open(packed.block()).is_ok(), "{name} {gone}");
                }
                for x in kept {
                    let ray = Ray::new([x + 0.25, 0.25, 9.0], [0.0, 0.0, -1.0]);
                    let hit = common::agreed(&structures.accels(), &ray, &QueryOptions::default());
                    assert_eq!(hit.map(|hit| hit.t), Some(9.0), "{name} {gone} {x}");
                }
                let ray = Ray::new([gone + 0.25, 0.25, 9.0], [0.0, 0.0, -1.0]);
                let hit = common::agreed(&structures.accels(), &ray, &QueryOptions::default());
                assert_eq!(hit, None, "{name} {gone}");
            }
        }
    }
}
