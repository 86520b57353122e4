//! Spheres at both ends of the floats: roots that are equal or nearly so, against the exact oracle.

#![allow(missing_docs)]

mod common;

use common::{All, agreed};
use raykern::{QueryOptions, Ray};
use raykern_harness::make::Random;
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::{Judgement, Oracle};

/// Spheres on a lattice of `unit` with every one doubled in part: once with its centre and once with
/// its radius one float aside, and squares across the z axis that touch them.
fn scene(random: &mut Random, unit: f32) -> Model {
    let number = |r: &mut Random| (r.below(5) as f32 - 2.0) * unit;
    let mut spheres = Vec::new();
    for _ in 0..3 {
        let [x, y, z] = [0; 3].map(|_| number(random));
        let r = (1 + random.below(3)) as f32 * unit;
        spheres.extend([[x, y, z, r], [x, y, z.next_up(), r], [x, y, z, r.next_up()]]);
    }
    let mesh = (0..2).map(|_| number(random)).flat_map(|z| {
        let end = 2.0 * unit;
        [[-end, -end, z], [end, -end, z], [end, end, z], [-end, end, z]]
    });
    let indices = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let mesh = TriangleMesh { vertices: mesh.collect(), indices };
    Model { meshes: vec![mesh], sphere_sets: vec![spheres] }
}

/// Rays through the lattice, most of them along an axis or towards a point of it, with limits that
/// are often the very distance.
fn judge(name: &str, unit: f32, rounds: u64) {
    let options = QueryOptions::default();
    let [mut rays, mut hits, mut ties] = [0; 3];
    for seed in 0..rounds {
        let mut random = Random::new(seed);
        let model = scene(&mut random, unit);
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for _ in 0..60 {
            let mut number = || (random.below(5) as f32 - 2.0) * unit;
            let origin = [number(), number(), number()];
            let [x, y, z] = [number(), number(), number()];
            let direction = if rays % 2 == 0 { [0.0, 0.0, unit] } else { [x, y, z] };
            let mut ray = Ray::new(origin, direction);
            match random.below(4) {
                0 => ray = ray.with_limits(-4.0, 4.0),
                1 => ray = ray.with_limits(random.below(4) as f32 - 1.0, 3.0),
                _ => {}
            }
            let hit = agreed(&all.accels(), &ray, &options);
            let judgement = oracle.judge(&ray, &options, hit);
            assert_eq!(judgement, Judgement::Right, "{name}, seed {seed}: {ray:?} {hit:?}");
            rays += 1;
            hits += usize::from(hit.is_some());
            ties += usize::from(!oracle.closest(&ray, &options).equal_t.is_empty());
        }
    }
    println!("{name}: {rays} rays, {hits} hits, {ties} ties");
    assert!(hits > rays / 3 && ties > rays / 100, "{rays} rays, {hits} hits, {ties} ties");
}

#[test]
fn the_least_floats() {
    for (name, power) in [("2^-149", -149), ("2^-140", -140), ("2^-120", -120), ("2^-111", -111)] {
        judge(name, 2f64.powi(power) as f32, 40);
    }
}

#[test]
fn the_largest_floats() {
    for (name, power) in [("2^119", 119), ("2^123", 123), ("2^125", 125)] {
        judge(name, 2f32.powi(power), 40);
    }
}

/// Spheres of 2^125 of which the centres differ by 2^-149, seen along that difference: the roots
/// differ in their 274th bit, and so do a root and a plane.
#[test]
fn one_least_float_between_the_largest() {
    let (unit, least) = (2f32.powi(125), f32::from_bits(1));
    let ball = |x: f32| [x, unit, 0.0, 2.0 * unit];
    let wall = |x: f32| {
        let vertices = vec![[x, 0.0, -unit], [x, 2.0 * unit, -unit], [x, unit, 2.0 * unit]];
        TriangleMesh { vertices, indices: vec![[0, 1, 2]] }
    };
    let ray = Ray::new([-3.0 * unit, unit, 0.0], [unit, 0.0, 0.0]);
    for (first, second) in [(0.0, least), (least, 0.0), (0.0, -least), (least, least)] {
        let model = Model {
            // A plane through the near side, where the line meets the sphere at right angles.
            meshes: vec![wall(-2.0 * unit)],
            sphere_sets: vec![vec![ball(first), ball(second)]],
        };
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        let hit = agreed(&all.accels(), &ray, &QueryOptions::default());
        let judgement = oracle.judge(&ray, &QueryOptions::default(), hit);
        assert_eq!(judgement, Judgement::Right, "{first:e} {second:e} {hit:?}");
        // The wall comes first among equals, unless a sphere is nearer by the least float.
        let hit = hit.expect("three shapes in the way");
        let nearer = if second < 0.0 { (1, 1) } else { (0, 0) };
        assert_eq!((hit.geometry, hit.prim), nearer, "{first:e} {second:e}");
    }
}
