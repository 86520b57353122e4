//! The closest point: the same bits from every structure, and nothing closer by more than the bound.

#![allow(missing_docs)]

mod common;

use common::{All, odd_models, strewn};
use raykern::{Mesh, NONE, PointHit, PrimId, QueryOptions, Scene, SphereSet};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;
use raykern_harness::oracle::Oracle;
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::each;

/// What a distance may be off, for each unit of it and of the primitive's size.
const BOUND: f64 = 1.0 / (1u64 << 46) as f64;

fn bits(hit: Option<PointHit>) -> Option<[u32; 9]> {
    let PointHit { distance, point: [x, y, z], u, v, prim, geometry, instance } = hit?;
    let [distance, x, y, z, u, v] = [distance, x, y, z, u, v].map(f32::to_bits);
    Some([distance, x, y, z, u, v, prim, geometry, instance])
}

/// The answer on which all structures agree.
fn agreed(all: &All, point: [f32; 3], radius: f32, options: &QueryOptions) -> Option<PointHit> {
    let accels = all.accels();
    let expected = accels[0].1.closest_point(point, radius, options);
    for (name, accel) in accels {
        let hit = accel.closest_point(point, radius, options);
        assert_eq!(bits(hit), bits(expected), "{name} {point:?} {radius}: {hit:?} {expected:?}");
    }
    expected
}

/// Holds what all answer against the exact distances of all primitives.
fn check(all: &All, oracle: &Oracle, point: [f32; 3], radius: f32, options: &QueryOptions) -> bool {
    let hit = agreed(all, point, radius, options);
    let distances = oracle.distances(point, options);
    // No primitive is closer than the least of these, whatever rounding does.
    let noise = |d: f64, size: f64| 2.0 * BOUND * (d + size);
    let place = format!("{point:?} {radius} {options:?} {hit:?}");
    let Some(hit) = hit else {
        let least = distances.iter().map(|d| d.distance + noise(d.distance, d.size));
        assert!(least.fold(f64::INFINITY, f64::min) >= f64::from(radius), "missed: {place}");
        return false;
    };
    let own =
        distances.iter().find(|d| (d.place.geometry, d.place.prim) == (hit.geometry, hit.prim));
    let own = own.unwrap_or_else(|| panic!("nothing there: {place}"));
    let slack = noise(own.distance, own.size);
    for other in &distances {
        let closest = own.distance <= other.distance + slack + noise(other.distance, other.size);
        assert!(closest, "{other:?} is closer than {own:?}: {place}");
    }
    let unit = f64::from(f32::EPSILON);
    let error = (f64::from(hit.distance) - own.distance).abs();
    assert!(error <= unit * own.distance + slack + 1e-44, "{own:?} {place}");
    assert!(own.distance - slack <= f64::from(radius), "{own:?} {place}");
    assert!(hit.u >= 0.0 && hit.v >= 0.0 && 1.0 - hit.u - hit.v >= 0.0 && hit.instance == NONE);
    // The point is as far as it says, but for its own rounding.
    let away: [f64; 3] = std::array::from_fn(|k| f64::from(hit.point[k]) - f64::from(point[k]));
    let far = away.iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = hit.point.iter().fold(own.distance, |most, x| f64::from(x.abs()).max(most));
    assert!(
        (far - own.distance).abs() <= 2.0 * unit * size + slack + 1e-44,
        "{far} {own:?} {place}"
    );
    true
}

#[test]
fn made_and_odd_scenes() {
    let models = make::ALL.map(|(name, make)| (name, make(300)));
    each(models.into_iter().chain(odd_models()), |(name, model)| {
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        let mut found = 0;
        // Origins of rays are points: around the scene, inside, on surfaces, exactly on vertices, and far away.
        let families =
            [Family::Random, Family::Inside, Family::FromSurface, Family::FromVertex, Family::Far];
        for (seed, family) in families.into_iter().enumerate() {
            for ray in RayMaker::new(&model, seed as u64).many(family, 12) {
                let options = QueryOptions::default();
                if !ray.origin.iter().all(|x| x.is_finite()) {
                    // On a primitive that is not finite.
                    assert_eq!(agreed(&all, ray.origin, f32::INFINITY, &options), None);
                    continue;
                }
                found += usize::from(check(&all, &oracle, ray.origin, f32::INFINITY, &options));
                let first = agreed(&all, ray.origin, f32::INFINITY, &options);
                let Some(PointHit { distance, .. }) = first else { continue };
                // Radii that hold it, are it, and are a little less.
                for radius in [2.0 * distance, distance, distance.next_down(), distance / 2.0] {
                    check(&all, &oracle, ray.origin, radius, &options);
                }
            }
        }
        println!("{name}: {found}");
        assert!(name == "none" || found > 40, "{name}: {found}");
    });
}

/// Small whole numbers, where many primitives are equally close: the first of them wins.
#[test]
fn lattices() {
    let (mut random, mut ties) = (Random::new(3), 0);
    for _ in 0..60 {
        let number = |r: &mut Random| r.below(5) as f32 - 2.0;
        let model = strewn(&mut random, &number);
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for _ in 0..40 {
            let point = [0; 3].map(|_| number(&mut random));
            let (prim, geometry) = (random.below(12) as u32, random.below(2) as u32);
            let skip = Some(PrimId { prim, geometry, instance: NONE });
            let options = QueryOptions { skip, ..Default::default() };
            let radius = random.below(4) as f32;
            check(&all, &oracle, point, radius, &options);
            // On a vertex: the distance is zero to all that have it, of which the first comes, unless one before
            // it passes through by its face.
            let mesh = &model.meshes[0];
            let vertex = mesh.vertices[random.below(mesh.vertices.len())];
            let distances = oracle.distances(vertex, &QueryOptions::default());
            let has = |prim: u32| {
                mesh.indices[prim as usize].iter().any(|v| mesh.vertices[*v as usize] == vertex)
            };
            let on_it = distances.iter().filter(|d| d.place.geometry == 0 && has(d.place.prim));
            let Some(first) = on_it.clone().map(|d| d.place.prim).min() else { continue };
            let hit = agreed(&all, vertex, 0.0, &QueryOptions::default()).expect("a vertex");
            assert!(hit.distance == 0.0 && hit.geometry == 0 && hit.prim <= first, "{vertex:?}");
            ties += usize::from(on_it.count() > 1);
        }
    }
    assert!(ties > 500, "{ties}");
}

/// Every exponent that an `f32` can have.
#[test]
fn the_whole_range_of_floats() {
    const RANGES: [[f64; 2]; 4] =
        [[-149.0, 127.9], [-149.0, -120.0], [100.0, 127.9], [-20.0, 20.0]];
    let (mut random, mut found) = (Random::new(4), 0);
    for round in 0..40 {
        let [low, high] = RANGES[round % 4];
        let number =
            |r: &mut Random| (r.between(-1.0, 1.0) * 2f64.powf(r.between(low, high))) as f32;
        let model = strewn(&mut random, &number);
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for _ in 0..40 {
            let point = [0; 3].map(|_| number(&mut random));
            let options = QueryOptions::default();
            found += usize::from(check(&all, &oracle, point, f32::MAX, &options));
            check(&all, &oracle, point, number(&mut random).abs(), &options);
        }
    }
    assert!(found > 1_000, "{found}");
}

#[test]
fn masks_leave_geometries_out() {
    let mut model: Model = make::blob(200, 6).into();
    model.meshes.push(make::soup(100, 1));
    model.sphere_sets.push(vec![[0.0, 0.0, 0.0, 0.5], [0.5, 0.0, 0.0, 0.75]]);
    const MASKS: [u32; 3] = [1, 2, 3];
    let meshes: Vec<_> = (model.meshes.iter().zip(MASKS))
        .map(|(mesh, mask)| Mesh::indexed(&mesh.vertices, &mesh.indices).with_mask(mask))
        .collect();
    let sets = [SphereSet::new(&model.sphere_sets[0]).with_mask(MASKS[2])];
    let all = All::build(&Scene::new(&meshes, &sets));
    let oracle = Oracle::with_masks(&model, &MASKS);
    let mut seen = [0; 3];
    for (i, ray) in RayMaker::new(&model, 7).many(Family::Inside, 300).iter().enumerate() {
        let options = QueryOptions { mask: i as u32 % 4, ..Default::default() };
        check(&all, &oracle, ray.origin, f32::INFINITY, &options);
        let hit = agreed(&all, ray.origin, f32::INFINITY, &options).expect("something");
        seen[hit.geometry as usize] += 1;
    }
    assert!(seen.iter().all(|count| *count > 10), "{seen:?}");
}

#[test]
fn odd_questions_find_nothing() {
    let model: Model = make::blob(200, 1).into();
    let all = All::of(&model);
    let options = QueryOptions::default();
    for (point, radius) in [
        ([0.0; 3], -1.0),
        ([0.0; 3], f32::NAN),
        ([f32::NAN, 0.0, 0.0], 1e30),
        ([0.0, f32::INFINITY, 0.0], f32::INFINITY),
        ([0.0; 3], 0.0),
        ([1e30, 0.0, 0.0], 1e20),
    ] {
        assert_eq!(agreed(&all, point, radius, &options), None, "{point:?} {radius}");
    }
    // Farther than the largest float.
    let edge = vec![[f32::MAX; 3], [f32::MAX, f32::MAX, 0.0], [0.0, f32::MAX, f32::MAX]];
    let mesh = raykern_harness::model::TriangleMesh { vertices: edge, indices: vec![[0, 1, 2]] };
    let all = All::of(&mesh.into());
    assert_eq!(agreed(&all, [-f32::MAX; 3], f32::INFINITY, &options), None);
    assert!(agreed(&all, [0.0, f32::MAX, 0.0], f32::INFINITY, &options).is_some());
}
