//! Answers against the exact oracle, counted by family of rays.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, odd_models, ray_towards, strewn};
use raykern::{Facing, Hit, Mesh, NONE, Precision, PrimId, QueryOptions, Scene, SphereSet};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;
use raykern_harness::oracle::{Judgement, Oracle, Tally};
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::map;

/// Judges `count` rays of a family in the widest BVH; `agree.rs` answers for the others.
fn tally(model: &Model, family: Family, count: usize, seed: u64) -> Tally {
    let (all, oracle) = (All::of(model), Oracle::new(model));
    let (_, accel) = all.accels()[5];
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
    println!("{:32} {}", "", Tally::COLUMNS);
    let models = make::ALL.map(|(name, make)| (name, make(1_000)));
    let wrong = map(models.into_iter().chain(odd_models()), |(name, model)| {
        let mut wrong = 0;
        for (seed, family) in Family::HOSTILE.into_iter().enumerate() {
            let tally = tally(&model, family, 200, seed as u64);
            println!("{:32} {tally}", format!("{name} {family:?}"));
            wrong += tally.wrong();
        }
        wrong
    });
    assert_eq!(wrong.into_iter().sum::<u64>(), 0);
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
            let options = QueryOptions { precision: Precision::Exact, mask, facing, skip };
            let hit = common::agreed(&all.accels(), &ray, &options);
            let judgement = oracle.judge(&ray, &options, hit);
            assert_eq!(judgement, Judgement::Right, "{ray:?} {options:?} {hit:?}");
            hits += usize::from(hit.is_some());
        }
    }
    assert!(hits > 1_000, "{hits}");
}

/// A float with a random exponent between two powers of two.
fn wild(random: &mut Random, [low, high]: [f64; 2]) -> f32 {
    (random.between(-1.0, 1.0) * 2f64.powf(random.between(low, high))) as f32
}

/// Triangles and spheres from `number`, and rays towards what is there: all of them judged.
fn judge_all(rounds: usize, number: impl Fn(&mut Random, usize) -> f32) -> [u64; 3] {
    const SEED: u64 = 5;
    let mut random = Random::new(SEED);
    let [mut rays, mut ties, mut wrong] = [0; 3];
    for round in 0..rounds {
        let number = |r: &mut Random| number(r, round);
        let model = strewn(&mut random, &number);
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for _ in 0..200 {
            let ray = ray_towards(&mut random, &model.meshes[0].vertices, &number);
            // Half of the rays leave out a sphere, if it exists.
            let (prim, geometry) = (random.below(12) as u32, random.below(2) as u32);
            let skip = (geometry == 1).then_some(PrimId { prim, geometry, instance: NONE });
            let options = QueryOptions { skip, ..Default::default() };
            let hit = agreed(&all.accels(), &ray, &options);
            let judgement = oracle.judge(&ray, &options, hit);
            if judgement != Judgement::Right {
                println!("round {round}: {judgement:?} {ray:?} {hit:?}");
                wrong += 1;
            }
            rays += 1;
            ties += u64::from(!oracle.closest(&ray, &options).equal_t.is_empty());
        }
    }
    [rays, ties, wrong]
}

/// Small whole numbers: rays through vertices and edges, tangents, spheres and planes met at once.
#[test]
fn lattices_are_full_of_ties() {
    let [rays, ties, wrong] = judge_all(150, |r, _| r.below(5) as f32 - 2.0);
    println!("{rays} rays, {ties} of them with ties, {wrong} wrong");
    assert!(ties > rays / 20);
    assert_eq!(wrong, 0);
}

/// Every exponent that an `f32` can have, all at once or near either end.
#[test]
fn the_whole_range_of_floats() {
    const RANGES: [[f64; 2]; 4] =
        [[-149.0, 127.9], [-149.0, -120.0], [100.0, 127.9], [-20.0, 20.0]];
    let [rays, _, wrong] = judge_all(120, |r, round| wild(r, RANGES[round % 4]));
    println!("{rays} rays, {wrong} wrong");
    assert_eq!(wrong, 0);
}
