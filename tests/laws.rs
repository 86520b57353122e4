//! What must not change when the same surface is described in another way.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, bits};
use raykern::{Facing, Hit, Precision, QueryOptions, Ray};
use raykern_harness::make;
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::rays::{Family, RayMaker};

const ALL: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };

/// Answers of `changed` to `map`ped rays, brought back by `back`, equal those of `model`.
fn law(
    model: &Model,
    changed: &Model,
    map: impl Fn(&Ray) -> Ray,
    options: &QueryOptions,
    back: impl Fn(Hit) -> Hit,
) {
    let (before, after) = (All::of(model), All::of(changed));
    let mut hits = 0;
    for (seed, family) in Family::ORDINARY.into_iter().enumerate() {
        for ray in RayMaker::new(model, seed as u64).many(family, 500) {
            let expected = agreed(&before.accels(), &ray, &ALL);
            let all = agreed(&after.accels(), &map(&ray), options).map(&back);
            assert_eq!(bits(all), bits(expected), "{family:?}, seed {seed}, {ray:?}");
            hits += usize::from(expected.is_some());
        }
    }
    assert!(hits > 500, "{hits}");
}

fn blob() -> Model {
    make::blob(1_500, 4).into()
}

#[test]
fn the_order_of_primitives() {
    let (model, mut reversed) = (blob(), blob());
    reversed.meshes[0].indices.reverse();
    let last = model.triangle_count() as u32 - 1;
    law(&model, &reversed, |ray| *ray, &ALL, |hit| Hit { prim: last - hit.prim, ..hit });
}

#[test]
fn scaling_by_powers_of_two() {
    for power in [-60, -1, 20, 60] {
        let (model, s) = (blob(), 2f32.powi(power));
        let mut scaled = model.clone();
        scaled.meshes[0].vertices.iter_mut().for_each(|v| *v = v.map(|x| x * s));
        let map = |ray: &Ray| Ray {
            origin: ray.origin.map(|x| x * s),
            direction: ray.direction.map(|x| x * s),
            ..*ray
        };
        law(&model, &scaled, map, &ALL, |hit| hit);
    }
}

#[test]
fn translating_by_what_floats_hold() {
    // Coordinates on a lattice of 2^-12, so that adding 8 rounds nothing.
    let lattice = |x: f32| (x * 4096.0).round() / 4096.0;
    let mut model = blob();
    model.meshes[0].vertices.iter_mut().for_each(|v| *v = v.map(lattice));
    let mut moved = model.clone();
    moved.meshes[0].vertices.iter_mut().for_each(|v| *v = v.map(|x| x + 8.0));
    let (before, after) = (All::of(&model), All::of(&moved));
    for mut ray in RayMaker::new(&model, 3).many(Family::Random, 3_000) {
        ray.origin = ray.origin.map(lattice);
        let there = Ray { origin: ray.origin.map(|x| x + 8.0), ..ray };
        let key = |hit: Option<Hit>| hit.map(|hit| (hit.prim, hit.t.to_bits()));
        let expected = agreed(&before.accels(), &ray, &ALL);
        assert_eq!(key(agreed(&after.accels(), &there, &ALL)), key(expected), "{ray:?}");
    }
}

#[test]
fn splitting_into_meshes() {
    let (model, mut split) = (blob(), Model::default());
    for indices in model.meshes[0].indices.chunks(100) {
        let vertices = model.meshes[0].vertices.clone();
        split.meshes.push(TriangleMesh { vertices, indices: indices.to_vec() });
    }
    let back = |hit: Hit| Hit { geometry: 0, prim: hit.geometry * 100 + hit.prim, ..hit };
    law(&model, &split, |ray| *ray, &ALL, back);
}

#[test]
fn flipped_windings_change_sides_and_nothing_else() {
    let (model, mut flipped) = (blob(), blob());
    flipped.meshes[0].indices.iter_mut().for_each(|t| t.swap(1, 2));
    let (before, after) = (All::of(&model), All::of(&flipped));
    let facing = |facing| QueryOptions { facing, ..ALL };
    let sides = [
        (Facing::Both, Facing::Both),
        (Facing::Front, Facing::Back),
        (Facing::Back, Facing::Front),
    ];
    for ray in RayMaker::new(&model, 3).many(Family::Random, 2_000) {
        for (side, other) in sides {
            let key = |hit: Option<Hit>| hit.map(|hit| (hit.prim, hit.t.to_bits()));
            let expected = key(agreed(&before.accels(), &ray, &facing(side)));
            assert_eq!(key(agreed(&after.accels(), &ray, &facing(other))), expected, "{ray:?}");
        }
    }
}
