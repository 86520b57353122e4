//! Instances: against flattened meshes, against the oracle on the rounded rays, and every structure over every other.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, bits};
use raykern::{
    Accel, BuildError, BuildOptions, Facing, Hit, Instance, Mesh, NONE, OpenError, OwnedAccel,
    PlainList, PrimId, QueryOptions, Ray, Scene, SphereSet,
};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::Oracle;

const DEFAULT: QueryOptions = QueryOptions {
    precision: raykern::Precision::Exact,
    mask: 0,
    facing: Facing::Both,
    skip: None,
};

fn point(m: &[f32; 12], p: [f32; 3]) -> [f64; 3] {
    let p = p.map(f64::from);
    [0, 1, 2].map(|i| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| f64::from(m[4 * i + k]));
        a * p[0] + b * p[1] + c * p[2] + d
    })
}

/// A ray from about `distance` times the size of the target's surroundings, towards a point.
fn towards(random: &mut Random, to: [f64; 3], away: f64) -> Ray {
    let origin = to.map(|x| (x + away * random.between(-1.0, 1.0)) as f32);
    let direction = [0, 1, 2].map(|k| (to[k] - f64::from(origin[k])) as f32);
    Ray::new(origin, direction)
}

/// A closed mesh, loose triangles and spheres, all within 1 of zero.
fn child_model(seed: u64) -> Model {
    let mut model: Model = make::blob(120, seed).into();
    model.meshes.push(make::soup(30, seed).placed(0.7, [-0.3; 3]));
    model.sphere_sets.push(vec![
        [0.5, 0.5, 0.5, 0.4],
        [-0.6, 0.1, -0.2, 0.3],
        [0.0, 0.0, 0.9, 0.2],
    ]);
    model
}

/// An affine map of the given kind; all but the last are moderate.
fn random_map(random: &mut Random, kind: usize) -> [f32; 12] {
    let mut number = || random.between(-1.0, 1.0);
    let mut m = [0.0f64; 12].map(|_| number());
    match kind {
        // Sheared, and often mirrored.
        0 => {}
        // Nearly singular: the third row is the sum of the others, and a little more.
        1 => (0..3).for_each(|k| m[8 + k] = m[k] + m[4 + k] + 1e-4 * m[8 + k]),
        // Very uneven.
        2 => (0..3).for_each(|k| {
            m[k] *= 1e-3;
            m[4 + k] *= 30.0;
        }),
        // Far away.
        3 => (0..3).for_each(|k| m[4 * k + 3] *= 1e5),
        4 => m = m.map(|x| x * 1e12),
        5 => m = m.map(|x| x * 1e-12),
        // So nearly singular that its box is all of space.
        6 => (0..3).for_each(|k| m[8 + k] = m[k]),
        _ => unreachable!("a kind of map"),
    }
    let spread = if (4..7).contains(&kind) { 0.0 } else { 4.0 };
    let mut m = m.map(|x| x as f32);
    for k in 0..3 {
        m[4 * k + 3] += (spread * random.between(-1.0, 1.0)) as f32;
    }
    if kind == 6 {
        m[10] = m[10].next_up();
    }
    m
}

/// The structures that a child may be.
fn children(model: &Model) -> Vec<OwnedAccel<'static>> {
    let never = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
    let always = BuildOptions { plain_list: PlainList::Always, ..never };
    let compact = BuildOptions { layout: raykern::Layout::Compact, ..never };
    model.with_scene(|scene| {
        vec![
            OwnedAccel::bvh(scene, &never).expect("a BVH"),
            OwnedAccel::bvh(scene, &always).expect("a list"),
            OwnedAccel::grid(scene, &never).expect("a grid"),
            OwnedAccel::bvh(scene, &compact).expect("a BVH"),
        ]
    })
}

/// What is hit in real arithmetic, instance by instance, each on its rounded ray.
struct Judge {
    own: Oracle,
    child: Oracle,
    masks: Vec<u32>,
}

impl Judge {
    fn closest(&self, accel: &Accel, ray: &Ray, options: &QueryOptions) -> Option<[u32; 4]> {
        let in_instance = |instance| {
            let skip = options.skip.filter(|id| id.instance == instance);
            let skip = skip.map(|id| PrimId { instance: NONE, ..id });
            QueryOptions { skip, ..*options }
        };
        let own = self.own.closest(ray, &in_instance(NONE)).hit.map(|hit| (NONE, hit));
        let others = (0..self.masks.len() as u32).filter_map(|i| {
            let mask = self.masks[i as usize];
            let seen = mask == 0 || options.mask == 0 || mask & options.mask != 0;
            let ray = accel.object_ray(i, ray).filter(|_| seen)?;
            self.child.closest(&ray, &in_instance(i)).hit.map(|hit| (i, hit))
        });
        // The first of equal ones stays.
        let best =
            own.into_iter().chain(others).reduce(|a, b| if b.1.t < a.1.t { b } else { a })?;
        let (instance, hit) = best;
        Some([hit.t.rounded().to_bits(), hit.place.prim, hit.place.geometry, instance])
    }
}

fn named(hit: Option<Hit>) -> Option<[u32; 4]> {
    hit.map(|hit| [hit.t.to_bits(), hit.prim, hit.geometry, hit.instance])
}

/// Affine maps of every kind and far origins: hit, primitive, instance and `t` are those of the oracle, from every structure.
#[test]
fn answers_are_exact_for_the_rounded_rays() {
    let model = child_model(3);
    let own_model: Model = make::plane(8).placed(8.0, [-4.0, -4.0, -1.0]).into();
    let built = children(&model);
    let mut random = Random::new(11);
    let (mut rays, mut hits, mut wrong) = (0, 0, 0);
    for round in 0..30 {
        let kind = round % 7;
        let maps: Vec<_> =
            (0..3 + random.below(12)).map(|_| random_map(&mut random, kind)).collect();
        let instances: Vec<_> = (maps.iter().enumerate())
            .map(|(i, map)| Instance::new(&built[(i + round) % built.len()].accel(), *map))
            .collect();
        let has_own = round % 2 == 0;
        let own_model = if has_own { own_model.clone() } else { Model::default() };
        let judge = Judge {
            own: Oracle::new(&own_model),
            child: Oracle::new(&model),
            masks: vec![0; maps.len()],
        };
        let meshes: Vec<_> =
            own_model.meshes.iter().map(|m| Mesh::indexed(&m.vertices, &m.indices)).collect();
        let all = All::build(&Scene::new(&meshes, &[]).with_instances(&instances));
        let accels = all.accels();
        for _ in 0..150 {
            let to = [0, 1, 2].map(|_| random.between(-0.8, 0.8) as f32);
            let map = &maps[random.below(maps.len())];
            let size = map.iter().fold(0.0f32, |m, x| m.max(x.abs()));
            let away = f64::from(size) * [0.3, 3.0, 1e2, 1e5][random.below(4)];
            let ray = towards(&mut random, point(map, to), away);
            let hit = agreed(&accels, &ray, &DEFAULT);
            let expected = judge.closest(&accels[0].1, &ray, &DEFAULT);
            if named(hit) != expected {
                println!("round {round}: {ray:?} {hit:?} {expected:?}");
                wrong += 1;
            }
            rays += 1;
            hits += u32::from(hit.is_some());
        }
    }
    println!("{rays} rays, {hits} hits, {wrong} wrong");
    assert!(hits > rays / 3);
    assert_eq!(wrong, 0);
}
