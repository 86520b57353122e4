//! Answers against the exact oracle, counted by family of rays.

#![allow(missing_docs)]

mod common;

use common::{All, odd_models};
use raykern::QueryOptions;
use raykern_harness::make;
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
