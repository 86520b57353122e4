//! Answers against the exact oracle, counted by family of rays.

#![allow(missing_docs)]

mod common;

use common::{All, odd_models};
use raykern::{Facing, Hit, Mesh, NONE, PrimId, QueryOptions, Scene, SphereSet};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;
use raykern_harness::oracle::{Judgement, Oracle, Tally};
use raykern_harness::rays::{Family, RayMaker};

/// Judges `count` rays of a family in the BVH; `agree.rs` answers for the others.
fn tally(model: &Model, family: Family, count: usize, seed: u64) -> Tally {
    let (all, oracle) = (All::of(model), Oracle::new(model));
    let (_, accel) = all.accels()[2];
    let options = QueryOptions::default();
    let mut tally = Tally::default();
    let mut shown = 0;
    for ray in RayMaker::new(model, seed).many(family, count) {
        let hit = accel.intersect(&ray);
        let judgement = tally.add(&oracle, &ray, &options, hit);
        if judgement != Judgement::Right && shown < 2 {
            println!("    {family:?} {judgement:?} {ray:?} {hit:?}");
            shown += 1;
        }
    }
    tally
}

#[test]
fn ordinary_rays_are_answered_exactly() {
    let mut wrong = 0;
    println!("{:32} {}", "", Tally::COLUMNS);
    for (name, make) in make::ALL {
        let model = make(5_000);
        for (seed, family) in Family::ORDINARY.into_iter().enumerate() {
            let tally = tally(&model, family, 500, seed as u64);
            println!("{:32} {tally}", format!("{name} {family:?}"));
            wrong += tally.wrong();
        }
    }
    assert_eq!(wrong, 0);
}

/// Hostile rays are answered exactly as well: the ceiling of every family is zero.
#[test]
fn hostile_rays_are_answered_exactly() {
    let mut wrong = 0;
    println!("{:32} {}", "", Tally::COLUMNS);
    let models = make::ALL.map(|(name, make)| (name, make(1_000)));
    for (name, model) in models.into_iter().chain(odd_models()) {
        for (seed, family) in Family::HOSTILE.into_iter().enumerate() {
            let tally = tally(&model, family, 200, seed as u64);
            println!("{:32} {tally}", format!("{name} {family:?}"));
            wrong += tally.wrong();
        }
    }
    assert_eq!(wrong, 0);
}

/// Masks, sides and skipped primitives, over meshes and spheres that are doubled in part.
#[test]
fn options_are_answered_exactly() {
    const MASKS: [u32; 4] = [1, 2, 0, 3];
    let mut model: Model = make::blob(300, 6).into();
    model.meshes.push(model.meshes[0].clone());
    model.sphere_sets.push(vec![[0.0, 0.0, 0.0, 1.0], [0.5, 0.0, 0.0, 0.75]]);
    model.sphere_sets.push(vec![[0.0, 0.0, 0.0, 1.0], [-0.5, 0.25, 0.0, 1.0]]);
    let meshes: Vec<_> = (model.meshes.iter().zip(MASKS))
        .map(|(mesh, mask)| Mesh::indexed(&mesh.vertices, &mesh.indices).with_mask(mask))
        .collect();
    let sets: Vec<_> = (model.sphere_sets.iter().zip(&MASKS[2..]))
        .map(|(set, mask)| SphereSet::new(set).with_mask(*mask))
        .collect();
    let all = All::build(&Scene::new(&meshes, &sets));
    let oracle = Oracle::with_masks(&model, &MASKS);
    let (mut random, mut hits) = (Random::new(5), 0);
    for family in [Family::Random, Family::Inside, Family::FromSurface, Family::Limited] {
        for ray in RayMaker::new(&model, 7).many(family, 1_000) {
            let facing = [Facing::Both, Facing::Front, Facing::Back][random.below(3)];
            let mask = random.below(4) as u32;
            let first = common::agreed(&all.accels(), &ray, &QueryOptions::default());
            let skip = first.filter(|_| random.below(2) == 0);
            let skip =
                skip.map(|Hit { prim, geometry, .. }| PrimId { prim, geometry, instance: NONE });
            let options = QueryOptions { mask, facing, skip };
            let hit = common::agreed(&all.accels(), &ray, &options);
            let judgement = oracle.judge(&ray, &options, hit);
            assert_eq!(judgement, Judgement::Right, "{ray:?} {options:?} {hit:?}");
            hits += usize::from(hit.is_some());
        }
    }
    assert!(hits > 1_000, "{hits}");
}
