//! All hits in order: each once, ties by number, and the same list however it is asked for.

#![allow(missing_docs)]

mod common;

use common::{All, bits, odd_models, ray_towards, strewn};
use raykern::{
    Accel, Facing, Hit, HitKey, Mesh, NONE, PrimId, QueryOptions, Ray, Scene, SphereSet,
};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::{ExactHit, Oracle};
use raykern_harness::rays::{Family, RayMaker};

/// The list, fetched `capacity` hits at a time.
fn fetched(accel: &Accel, ray: &Ray, options: &QueryOptions, capacity: usize) -> Vec<Hit> {
    let (mut room, mut last, mut hits) = (vec![Hit::MISS; capacity], None, Vec::new());
    loop {
        let count = accel.more_hits(ray, options, &mut last, &mut room);
        hits.extend_from_slice(&room[..count]);
        assert!(hits.len() < 10_000, "{ray:?} goes on without end");
        if count < capacity {
            return hits;
        }
    }
}

fn all_bits(hits: &[Hit]) -> Vec<Option<[u32; 6]>> {
    hits.iter().map(|hit| bits(Some(*hit))).collect()
}

/// Holds a list against the exact one.
fn check_exact(hits: &[Hit], exact: &[ExactHit], place: &str) {
    let seen: Vec<_> = hits.iter().map(|hit| (hit.geometry, hit.prim, hit.t.to_bits())).collect();
    let expected: Vec<_> = exact
        .iter()
        .map(|hit| (hit.place.geometry, hit.place.prim, hit.t.rounded().to_bits()))
        .collect();
    assert_eq!(seen, expected, "{place}");
    for (hit, exact) in hits.iter().zip(exact) {
        let bound = f64::from(f32::EPSILON);
        let [u, v] = exact.weights;
        assert!((f64::from(hit.u) - u).abs() <= bound, "{place} {hit:?} {u}");
        assert!((f64::from(hit.v) - v).abs() <= bound, "{place} {hit:?} {v}");
        assert!(hit.u >= 0.0 && hit.v >= 0.0 && 1.0 - hit.u - hit.v >= 0.0, "{place} {hit:?}");
        assert_eq!(hit.instance, NONE);
    }
}

/// How many lists were seen, how long they were, and how many of their hits are at the `t` of the one before.
#[derive(Debug, Default)]
struct Seen {
    rays: usize,
    hits: usize,
    ties: usize,
    /// Neighbours that round to one `t` and are not equal.
    close: usize,
}

impl Seen {
    /// Asks every structure for the list of one ray in several ways.
    fn check(&mut self, all: &All, oracle: &Oracle, ray: &Ray, options: &QueryOptions) {
        let exact = oracle.all_hits(ray, options);
        for (i, (name, accel)) in all.accels().iter().enumerate() {
            let place = format!("{name} {ray:?} {options:?}");
            let hits: Vec<_> = accel.hits(ray, options).collect();
            check_exact(&hits, &exact, &place);
            // Each structure gets other capacities than the one before, and over two rays all of them.
            let capacity = [1, 2, 3, 16][(i + self.rays) % 4];
            let same = fetched(accel, ray, options, capacity);
            assert_eq!(all_bits(&same), all_bits(&hits), "{capacity} at a time, {place}");
            let mut room = [Hit::MISS; 5];
            let count = accel.nearest_hits(ray, options, &mut room);
            assert_eq!(count, hits.len().min(5), "{place}");
            assert_eq!(all_bits(&room[..count]), all_bits(&hits[..count]), "{place}");
            let first = accel.intersect_with(ray, options);
            assert_eq!(bits(first), bits(hits.first().copied()), "{place}");
        }
        self.rays += 1;
        self.hits += exact.len();
        for pair in exact.windows(2) {
            let tie = pair[0].t == pair[1].t;
            self.ties += usize::from(tie);
            self.close += usize::from(!tie && pair[0].t.rounded() == pair[1].t.rounded());
        }
    }
}

#[test]
fn made_and_odd_scenes() {
    let models = make::ALL.map(|(name, make)| (name, make(300)));
    for (name, model) in models.into_iter().chain(odd_models()) {
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        let mut seen = Seen::default();
        for (seed, family) in Family::ORDINARY.into_iter().chain(Family::HOSTILE).enumerate() {
            for ray in RayMaker::new(&model, seed as u64).many(family, 25) {
                seen.check(&all, &oracle, &ray, &QueryOptions::default());
            }
        }
        for ray in RayMaker::new(&model, 9).many(Family::Invalid, 50) {
            assert!(
                all.accels().iter().all(|(_, accel)| {
                    accel.hits(&ray, &QueryOptions::default()).next().is_none()
                })
            );
        }
        println!("{name}: {seen:?}");
        assert!(name == "none" || seen.hits > 100, "{name}: {seen:?}");
    }
}

/// Small whole numbers: shared vertices and edges, common planes, spheres that touch, and limits that are
/// the very `t` of a hit.
#[test]
fn lattices() {
    let (mut random, mut seen) = (Random::new(3), Seen::default());
    for _ in 0..60 {
        let number = |r: &mut Random| r.below(5) as f32 - 2.0;
        let model = strewn(&mut random, &number);
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for _ in 0..40 {
            let ray = ray_towards(&mut random, &model.meshes[0].vertices, &number);
            let (prim, geometry) = (random.below(12) as u32, random.below(2) as u32);
            let skip = Some(PrimId { prim, geometry, instance: NONE });
            let facing = [Facing::Both, Facing::Front, Facing::Back][random.below(3)];
            seen.check(&all, &oracle, &ray, &QueryOptions { skip, facing, ..Default::default() });
        }
    }
    println!("{seen:?}");
    assert!(seen.ties > 400, "{seen:?}");
}

/// Every exponent that an `f32` can have.
#[test]
fn the_whole_range_of_floats() {
    const RANGES: [[f64; 2]; 4] =
        [[-149.0, 127.9], [-149.0, -120.0], [100.0, 127.9], [-20.0, 20.0]];
    let (mut random, mut seen) = (Random::new(4), Seen::default());
    for round in 0..40 {
        let [low, high] = RANGES[round % 4];
        let number =
            |r: &mut Random| (r.between(-1.0, 1.0) * 2f64.powf(r.between(low, high))) as f32;
        let model = strewn(&mut random, &number);
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for _ in 0..40 {
            let ray = ray_towards(&mut random, &model.meshes[0].vertices, &number);
            seen.check(&all, &oracle, &ray, &QueryOptions::default());
        }
    }
    println!("{seen:?}");
    assert!(seen.hits > 1_000, "{seen:?}");
}

/// Everything three times over: three hits at each `t`, and lists that end in the middle of them.
#[test]
fn triplicated_meshes() {
    let mut model: Model = make::blob(200, 1).into();
    model.meshes.push(model.meshes[0].clone());
    let twice = model.meshes[0].indices.clone();
    model.meshes[0].indices.extend(twice);
    model.sphere_sets = vec![vec![[0.0, 0.0, 0.0, 0.75]; 3]];
    let (all, oracle) = (All::of(&model), Oracle::new(&model));
    let mut seen = Seen::default();
    for family in [Family::Random, Family::ThroughVertex, Family::AtEdge, Family::FromVertex] {
        for ray in RayMaker::new(&model, 2).many(family, 50) {
            seen.check(&all, &oracle, &ray, &QueryOptions::default());
        }
    }
    println!("{seen:?}");
    assert!(seen.ties > seen.hits / 2, "{seen:?}");
}

#[test]
fn masks_and_sides() {
    const MASKS: [u32; 4] = [1, 2, 0, 3];
    let mut model: Model = make::blob(200, 6).into();
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
    let (mut random, mut seen) = (Random::new(5), Seen::default());
    for ray in RayMaker::new(&model, 7).many(Family::Random, 400) {
        let facing = [Facing::Both, Facing::Front, Facing::Back][random.below(3)];
        let options = QueryOptions { mask: random.below(4) as u32, facing, ..Default::default() };
        seen.check(&all, &oracle, &ray, &options);
    }
    assert!(seen.hits > 500, "{seen:?}");
}

/// Balls within balls and a wall between, so small and far away that all their hits round to one `t`: only
/// the roots tell where a list goes on.
#[test]
fn one_float_for_many_hits() {
    let far = 4096.0f32;
    let balls = [0.25f32, 0.125, 0.0625].map(|r| [far, 0.0, 0.0, r * f32::EPSILON * far]);
    let vertices = vec![[far, -1.0, -1.0], [far, 1.0, -1.0], [far, 0.0, 1.0]];
    let wall = TriangleMesh { vertices, indices: vec![[0, 1, 2], [2, 1, 0]] };
    let model = Model { meshes: vec![wall], sphere_sets: vec![balls.to_vec(), balls.to_vec()] };
    let (all, oracle) = (All::of(&model), Oracle::new(&model));
    let ray = Ray::new([0.0; 3], [1.0, 0.0, 0.0]);
    let options = QueryOptions::default();
    let mut seen = Seen::default();
    for _ in 0..4 {
        seen.check(&all, &oracle, &ray, &options);
    }
    assert_eq!((seen.hits, seen.ties, seen.close), (4 * 14, 4 * 7, 4 * 6));
    for (name, accel) in all.accels() {
        let hits: Vec<_> = accel.hits(&ray, &options).collect();
        assert!(hits.iter().all(|hit| hit.t == far), "{name}");
    }
}

/// A key names a hit wherever it came from; one that the ray does not have is followed by nothing.
#[test]
fn keys_are_hits() {
    let model: Model = make::blob(500, 1).into();
    let all = All::of(&model);
    let ray = Ray::new([0.0, 0.0, -5.0], [0.01, 0.02, 1.0]);
    let options = QueryOptions::default();
    for (name, accel) in all.accels() {
        let hits: Vec<_> = accel.hits(&ray, &options).collect();
        assert!(hits.len() >= 2, "{name}");
        let Hit { prim, geometry, instance, t, .. } = hits[0];
        let key = HitKey { id: PrimId { prim, geometry, instance }, root: 0, t };
        let mut room = [Hit::MISS; 4];
        let count = accel.more_hits(&ray, &options, &mut Some(key), &mut room);
        assert_eq!(all_bits(&room[..count]), all_bits(&hits[1..]), "{name}");
        for wrong in [
            HitKey { t: t.next_up(), ..key },
            HitKey { t: f32::NAN, ..key },
            HitKey { root: 1, ..key },
            HitKey { root: u32::MAX, ..key },
            HitKey { id: PrimId { prim: prim + 1, ..key.id }, ..key },
            HitKey { id: PrimId { geometry: 7, ..key.id }, ..key },
            HitKey { id: PrimId { instance: 0, ..key.id }, ..key },
        ] {
            let mut last = Some(wrong);
            assert_eq!(accel.more_hits(&ray, &options, &mut last, &mut room), 0, "{wrong:?}");
        }
        let mut last = Some(key);
        assert_eq!(accel.more_hits(&ray, &options, &mut last, &mut []), 0);
        assert_eq!(last, Some(key), "nothing was given");
    }
}
