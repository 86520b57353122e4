//! Answers against the exact oracle, counted by family of rays.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, odd_models, ray_towards, strewn};
use raykern::{Facing, Hit, Mesh, NONE, Precision, PrimId, QueryOptions, Ray, Scene, SphereSet};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
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

const TRIANGLE: [[f32; 3]; 3] = [[-0.9, -0.7, 0.3], [1.1, -0.4, -0.2], [-0.1, 1.3, 0.1]];

/// Holds rays against triangles, by themselves and as a batch, with the positions of the hits: the number of hits.
fn judge_weights(model: &Model, rays: &[Ray]) -> usize {
    let (all, oracle) = (All::of(model), Oracle::new(model));
    let options = QueryOptions::default();
    let single: Vec<_> = rays.iter().map(|ray| agreed(&all.accels(), ray, &options)).collect();
    for (name, accel) in all.accels() {
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.intersect_batch(rays, &mut hits);
        for (i, hit) in hits.into_iter().enumerate() {
            let hit = Some(hit).filter(|hit| hit.prim != NONE);
            assert_eq!(common::bits(hit), common::bits(single[i]), "{name} {:?}", rays[i]);
        }
    }
    for (ray, hit) in rays.iter().zip(&single) {
        let judgement = oracle.judge(ray, &options, *hit);
        assert_eq!(judgement, Judgement::Right, "{ray:?} {hit:?} {:?}", model.meshes);
        let Some(hit) = hit else { continue };
        let exact = oracle.closest(ray, &options).hit.expect("the same hit");
        let TriangleMesh { vertices, indices } = &model.meshes[0];
        let [a, b, c] = indices[hit.prim as usize].map(|v| vertices[v as usize].map(f64::from));
        let surface = all.accels()[0].1.surface(ray, hit).expect("the hit is there");
        for k in 0..3 {
            let [u, v] = exact.weights;
            let (e1, e2) = (b[k] - a[k], c[k] - a[k]);
            let off = (f64::from(surface.position[k]) - (a[k] + u * e1 + v * e2)).abs();
            let weights = (e1.abs() + e2.abs()) / f64::from(1 << 24);
            let bound = f64::from(surface.position_error) + weights;
            assert!(off <= bound, "{ray:?} {hit:?} {surface:?}: {off}");
        }
    }
    single.iter().flatten().count()
}

fn one(corners: [[f32; 3]; 3]) -> Model {
    TriangleMesh { vertices: corners.to_vec(), indices: vec![[0, 1, 2]] }.into()
}

/// From far away, from a vertex, and along a thin triangle: where products of `f64` cancel.
#[test]
fn weights_hold_where_doubles_lose_them() {
    for size in [1e10f32, 1e12, 1e15, 1e18] {
        let origin = [1.3, 0.7, 2.1].map(|x: f32| x * size);
        let ray = Ray::new(origin, origin.map(|x| -x)).with_limits(0.0, 2.0);
        assert_eq!(judge_weights(&one(TRIANGLE), &[ray; 40]), 40);
    }
    let sliver = [
        [-0.024049548, 0.9761148, -0.17821544],
        [-0.98203206, 0.32642, -0.8250965],
        [-0.9820321, 0.32641992, -0.8250966],
    ];
    let ray = Ray::new(sliver[2], [-0.7550919, -0.5120963, -0.50987846]);
    assert_eq!(judge_weights(&one(sliver), &[ray; 40]), 40);
    let edge_on = [
        [-0.6365854, 0.091890134, -0.25734165],
        [-0.010555989, 0.8219509, -0.94096243],
        [-0.044015292, 0.78293127, -0.90442497],
    ];
    let origin = [-0.53228015, 0.21352853, -0.37124246];
    let ray = Ray::new(origin, [0.13821691, 0.16118525, -0.1509321]);
    assert_eq!(judge_weights(&one(edge_on), &[ray; 40]), 40);
}

/// The same at random: triangles or slivers, and rays from one origin towards points of one of them.
#[test]
fn weights_of_slivers_and_of_rays_from_afar_along_planes_and_from_vertices() {
    let (mut random, mut hits) = (Random::new(17), [0; 4]);
    for round in 0..240 {
        let thin = [0, 1, 20, 23, 25][random.below(5)];
        let triangle = |random: &mut Random| {
            let [a, b, c] = [0; 3].map(|_| random.direction());
            let (part, aside) = (random.unit(), 0.5f64.powi(thin));
            // As thin as floats allow, where that is so.
            let c = [0, 1, 2].map(|k| match thin {
                0 => c[k],
                _ => a[k] + part * (b[k] - a[k]) + aside * c[k],
            });
            [a, b, c].map(|p| p.map(|x| x as f32))
        };
        let corners: [_; 4] = std::array::from_fn(|_| triangle(&mut random));
        let within = |random: &mut Random| {
            let (u, v) = (random.unit(), random.unit());
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let [a, b, c] = corners[0].map(|p| p.map(f64::from));
            [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]))
        };
        let start: [f64; 3] = match round % 4 {
            0 => random.direction().map(|x| x * 4.0),
            1 => {
                let far = 10f64.powf(random.between(5.0, 18.0));
                random.direction().map(|x| x * far)
            }
            // Beside the triangle, in its plane but for rounding.
            2 => {
                let (p, q) = (within(&mut random), within(&mut random));
                [0, 1, 2].map(|k| p[k] + 3.0 * (q[k] - p[k]))
            }
            _ => corners[0][random.below(3)].map(f64::from),
        };
        let origin = start.map(|x| x as f32);
        let rays: Vec<_> = (0..40)
            .map(|_| {
                let to = within(&mut random);
                Ray::new(origin, [0, 1, 2].map(|k| (to[k] - f64::from(origin[k])) as f32))
            })
            .collect();
        let vertices = corners.as_flattened().to_vec();
        let indices = (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        hits[round % 4] += judge_weights(&TriangleMesh { vertices, indices }.into(), &rays);
    }
    println!("{hits:?} hits: thin, from afar, along the plane, from a vertex");
    assert!(hits.iter().all(|hits| *hits > 200), "{hits:?}: too easy");
}
