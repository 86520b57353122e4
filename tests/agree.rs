//! List, grid and BVH give the same answers, to the bit.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, bits, odd_models};
use proptest::prelude::*;
use raykern::{Facing, Mesh, NONE, Precision, PrimId, QueryOptions, Ray, Scene, SphereSet};
use raykern_harness::load::load;
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::{make, shared_scenes};

/// All families over one model; the seed is the family's place, so a failure can be repeated.
fn check(name: &str, model: &Model, rays_each: usize) -> usize {
    let all = All::of(model);
    let accels = all.accels();
    let families = [Family::ORDINARY.as_slice(), &Family::HOSTILE, &[Family::Invalid]].concat();
    let mut hits = 0;
    for (seed, family) in families.into_iter().enumerate() {
        let seen = std::panic::catch_unwind(|| {
            let rays = RayMaker::new(model, seed as u64).many(family, rays_each);
            rays.iter()
                .filter(|ray| agreed(&accels, ray, &QueryOptions::default()).is_some())
                .count()
        });
        hits += seen.unwrap_or_else(|_| panic!("{name} {family:?}, seed {seed}"));
    }
    hits
}

#[test]
fn made_scenes() {
    for (name, make) in make::ALL {
        assert!(check(name, &make(2_000), 300) > 100, "{name}");
    }
}

/// Scenes from files, where they are at hand: grid against BVH, and the list on fewer rays.
#[test]
fn scenes_from_files() {
    let Some(folder) = shared_scenes::folder(None) else {
        println!("skipped: no folder of scenes (RAYKERN_SCENES)");
        return;
    };
    for file in [
        "metu/simple.xml",
        "metu/two_spheres.xml",
        "metu/bunny.xml",
        "metu/monkey.xml",
        "metu/dragon_lowres.xml",
        "classic/teapot.obj",
        "classic/sponza_part.obj",
    ] {
        let model = load(&folder.join(file)).unwrap_or_else(|error| panic!("{error}")).model.own;
        let all = All::of(&model);
        let [list, rest @ ..] = all.accels();
        let mut hits = 0;
        for (seed, family) in Family::ORDINARY.into_iter().chain(Family::HOSTILE).enumerate() {
            let rays = RayMaker::new(&model, seed as u64).many(family, 300);
            for (i, ray) in rays.iter().enumerate() {
                let options = QueryOptions::default();
                let hit = agreed(&rest, ray, &options);
                hits += usize::from(hit.is_some());
                if i < 10 {
                    let listed = list.1.intersect(ray);
                    assert_eq!(bits(listed), bits(hit), "{file} {family:?}, seed {seed}: {ray:?}");
                }
            }
        }
        assert!(hits > 100, "{file}: {hits} hits");
    }
}

#[test]
fn odd_scenes() {
    for (name, model) in odd_models() {
        check(name, &model, 1_000);
    }
}

/// A few numbers, so that vertices coincide and triangles lie in common planes.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (-4i8..=4).prop_map(|x| f32::from(x) * 0.5),
        1 => -2.0f32..2.0,
    ]
}

fn point() -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(coordinate())
}

fn triangles() -> impl Strategy<Value = Vec<[[f32; 3]; 3]>> {
    prop::collection::vec(prop::array::uniform3(point()), 0..30)
}

fn spheres() -> impl Strategy<Value = Vec<[f32; 4]>> {
    prop::collection::vec((point(), coordinate()).prop_map(|([x, y, z], r)| [x, y, z, r]), 0..8)
}

fn options() -> impl Strategy<Value = QueryOptions> {
    let facing = prop_oneof![Just(Facing::Both), Just(Facing::Front), Just(Facing::Back)];
    let skip = prop::option::of((0u32..30, 0u32..5));
    (0u32..4, facing, skip).prop_map(|(mask, facing, skip)| QueryOptions {
        precision: Precision::Exact,
        mask,
        facing,
        skip: skip.map(|(prim, geometry)| PrimId { prim, geometry, instance: NONE }),
    })
}

fn ray() -> impl Strategy<Value = Ray> {
    (point(), point(), coordinate(), prop_oneof![coordinate(), Just(f32::INFINITY)])
        .prop_map(|(o, d, t_min, t_max)| Ray::new(o, d).with_limits(t_min, t_max))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1_500,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn small_random_scenes(
        meshes in prop::collection::vec((triangles(), 0u32..4), 0..3),
        sets in prop::collection::vec((spheres(), 0u32..4), 0..3),
        rays in prop::collection::vec((ray(), options()), 20),
    ) {
        let meshes: Vec<_> = meshes.iter().map(|(t, mask)| Mesh::soup(t).with_mask(*mask)).collect();
        let sets: Vec<_> = sets.iter().map(|(s, mask)| SphereSet::new(s).with_mask(*mask)).collect();
        let all = All::build(&Scene::new(&meshes, &sets));
        for (ray, options) in &rays {
            agreed(&all.accels(), ray, options);
        }
    }
}
