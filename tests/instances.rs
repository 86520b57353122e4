//! Instances: against flattened meshes, against the oracle on the rounded rays, and every structure over every other.

#![allow(missing_docs)]

mod common;

use common::{All, agreed, bits};
use raykern::{
    Accel, BuildOptions, Counts, Facing, Hit, Instance, Mesh, NONE, OwnedAccel, PlainList,
    Precision, PrimId, QueryOptions, Ray, Scene,
};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::Oracle;

const DEFAULT: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };

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
    for round in 0..21 {
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
        for _ in 0..100 {
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

/// Rays in the planes of the walls of boxes, and just beside them, at corners that touch these walls, through maps that
/// distort a lot: what rounding moves into the cube is hit, although the ray itself may pass its box by.
#[test]
fn rays_beside_a_box_visit_what_they_hit() {
    let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0f32 } else { -1.0 });
    let vertices: Vec<_> = (0..8).map(corner).collect();
    let faces =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let indices = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let model = Model::from(TriangleMesh { vertices, indices });
    let built = children(&model);
    let mut random = Random::new(21);
    let (mut hits, mut outside) = (0, 0);
    for round in 0..16 {
        let maps: Vec<_> = (0..5)
            .map(|_| {
                let mut m = random_map(&mut random, 0);
                // The third row is nearly the sum of the others.
                let rest = [1.0, 1e-2, 1e-4, 1e-5][round % 4];
                (0..3).for_each(|k| m[8 + k] = m[k] + m[4 + k] + rest * m[8 + k]);
                m
            })
            .collect();
        let instances: Vec<_> = (maps.iter().enumerate())
            .map(|(i, map)| Instance::new(&built[i % built.len()].accel(), *map))
            .collect();
        let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
        let judge = Judge {
            own: Oracle::new(&Model::default()),
            child: Oracle::new(&model),
            masks: vec![0; 5],
        };
        let accels = all.accels();
        for _ in 0..150 {
            let (map, k) = (&maps[random.below(5)], random.below(3));
            let corners = (0..8).map(|i| point(map, corner(i)));
            let to = corners.reduce(|a, b| if b[k] > a[k] { b } else { a }).expect("a corner");
            let away = [1.0, 10.0, 1e3][random.below(3)];
            let mut ray = towards(&mut random, to, away);
            let beside = random.between(-1.0, 1.0) * [1e-7, 1e-6, 1e-5, 1e-4][random.below(4)];
            ray.origin[k] = (to[k] + beside) as f32;
            ray.direction[k] = 0.0;
            let hit = agreed(&accels, &ray, &DEFAULT);
            assert_eq!(named(hit), judge.closest(&accels[0].1, &ray, &DEFAULT), "{ray:?}");
            hits += u32::from(hit.is_some());
            outside += u32::from(hit.is_some() && f64::from(ray.origin[k]) > to[k]);
        }
    }
    println!("{hits} hits, {outside} of them beside the box");
    assert!(hits > 300 && outside > 50, "{hits} {outside}");
}

/// Masks on instances and in them, sides, and skipped primitives, also of one instance among several of one accel.
#[test]
fn options_reach_into_instances() {
    const MASKS: [u32; 3] = [1, 0, 2];
    const INSTANCE_MASKS: [u32; 5] = [0, 1, 2, 3, 1];
    let model = child_model(5);
    let child = model.with_masked_scene(&MASKS, |scene| {
        OwnedAccel::bvh(scene, &BuildOptions::default()).expect("a BVH")
    });
    let mut random = Random::new(2);
    let maps = INSTANCE_MASKS.map(|_| random_map(&mut random, 0));
    let instances = [0, 1, 2, 3, 4]
        .map(|i| Instance::new(&child.accel(), maps[i]).with_mask(INSTANCE_MASKS[i]));
    let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
    let judge = Judge {
        own: Oracle::new(&Model::default()),
        child: Oracle::with_masks(&model, &MASKS),
        masks: INSTANCE_MASKS.to_vec(),
    };
    let accels = all.accels();
    let (mut hits, mut skipped) = (0, 0);
    for _ in 0..2_000 {
        let to = [0, 1, 2].map(|_| random.between(-0.8, 0.8) as f32);
        let to = point(&maps[random.below(5)], to);
        let ray = towards(&mut random, to, 2.0);
        let first = agreed(&accels, &ray, &DEFAULT);
        let skip =
            first.map(|Hit { prim, geometry, instance, .. }| PrimId { prim, geometry, instance });
        let skip = skip.filter(|_| random.below(2) == 0);
        let facing = [Facing::Both, Facing::Front, Facing::Back][random.below(3)];
        let options = QueryOptions { mask: random.below(4) as u32, facing, skip, ..DEFAULT };
        let hit = agreed(&accels, &ray, &options);
        assert_eq!(named(hit), judge.closest(&accels[0].1, &ray, &options), "{ray:?} {options:?}");
        hits += u32::from(hit.is_some());
        skipped += u32::from(skip.is_some());
    }
    assert!(hits > 500 && skipped > 300, "{hits} {skipped}");
}

/// The ray in object space is the inverse map's, to the nearest float but for what `f64` is off.
#[test]
fn object_rays_are_rounded_once() {
    let built = children(&make::plane(2).into());
    let mut random = Random::new(12);
    for _ in 0..300 {
        let map = random_map(&mut random, 0);
        let instances = [Instance::new(&built[0].accel(), map)];
        let scene = Scene::new(&[], &[]).with_instances(&instances);
        let top = OwnedAccel::bvh(&scene, &BuildOptions::default()).expect("a BVH");
        let mut numbers = || [0, 1, 2].map(|_| random.between(-5.0, 5.0) as f32);
        let ray = Ray::new(numbers(), numbers());
        let object = top.accel().object_ray(0, &ray).expect("a ray");
        assert_eq!((object.t_min, object.t_max), (ray.t_min, ray.t_max));
        assert_eq!(top.accel().object_ray(1, &ray), None);
        // Mapped back, each component is off by what rounding moves it by.
        let shift = [3, 7, 11].map(|i| f64::from(map[i]));
        let there = point(&map, object.origin);
        let ahead = point(&map, object.direction);
        for k in 0..3 {
            let row = [0, 1, 2].map(|i| f64::from(map[4 * k + i]).abs());
            let off = |v: [f32; 3]| (0..3).map(|i| row[i] * f64::from(v[i]).abs()).sum::<f64>();
            let unit = f64::from(f32::EPSILON) / 2.0 * 1.001;
            let origin_error = (there[k] - f64::from(ray.origin[k])).abs();
            assert!(origin_error <= unit * off(object.origin) + 1e-9, "{map:?} {ray:?}");
            let direction_error = (ahead[k] - shift[k] - f64::from(ray.direction[k])).abs();
            assert!(direction_error <= unit * off(object.direction) + 1e-9, "{map:?} {ray:?}");
        }
    }
}

/// Corners on a lattice: shifts and scales by powers of two are exact, and rays meet several instances at once.
fn lattice_mesh(random: &mut Random, count: usize) -> TriangleMesh {
    let vertices =
        (0..3 * count).map(|_| [0, 1, 2].map(|_| random.below(9) as f32 / 4.0 - 1.0)).collect();
    let indices = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh { vertices, indices }
}

/// Where everything is exact, a scene of instances and the same scene flattened have the same answers, to the bit.
#[test]
fn exact_maps_answer_as_the_flattened_scene() {
    let mut random = Random::new(8);
    let (mut hits, mut in_instances) = (0, 0);
    for round in 0..12 {
        let parts = [lattice_mesh(&mut random, 12), lattice_mesh(&mut random, 7)];
        let own = lattice_mesh(&mut random, 5);
        let model = Model { meshes: parts.to_vec(), sphere_sets: vec![] };
        let built = children(&model);
        let placed: Vec<_> = (0..6)
            .map(|_| {
                let scale = [0.5f32, 1.0, 1.0, 2.0][random.below(4)];
                (scale, [0, 1, 2].map(|_| random.below(5) as f32 / 2.0 - 1.0))
            })
            .collect();
        let instances: Vec<_> = (placed.iter().enumerate())
            .map(|(i, (s, [x, y, z]))| {
                let map = [*s, 0., 0., *x, 0., *s, 0., *y, 0., 0., *s, *z];
                Instance::new(&built[(i + round) % built.len()].accel(), map)
            })
            .collect();
        let mesh = [Mesh::indexed(&own.vertices, &own.indices)];
        let all = All::build(&Scene::new(&mesh, &[]).with_instances(&instances));
        let mut flat = Model { meshes: vec![own.clone()], sphere_sets: vec![] };
        for (scale, shift) in &placed {
            for part in &parts {
                let mut part = part.clone();
                for vertex in &mut part.vertices {
                    *vertex = [0, 1, 2].map(|k| vertex[k] * scale + shift[k]);
                }
                flat.meshes.push(part);
            }
        }
        let flat = All::of(&flat);
        let flat = flat.accels();
        let accels = all.accels();
        for _ in 0..400 {
            let origin = [0, 1, 2].map(|_| random.below(33) as f32 / 4.0 - 4.0);
            let to = [0, 1, 2].map(|_| random.below(17) as f32 / 4.0 - 2.0);
            let ray = Ray::new(origin, [0, 1, 2].map(|k| to[k] - origin[k]));
            let expected = flat[8].1.intersect(&ray).map(|hit| {
                let (place, geometry) = match hit.geometry.checked_sub(1) {
                    None => (NONE, 0),
                    Some(part) => (part / 2, part % 2),
                };
                Hit { instance: place, geometry, ..hit }
            });
            let hit = agreed(&accels, &ray, &DEFAULT);
            assert_eq!(bits(hit), bits(expected), "round {round} {ray:?} {hit:?} {expected:?}");
            hits += u32::from(hit.is_some());
            in_instances += u32::from(hit.is_some_and(|hit| hit.instance != NONE));
        }
    }
    assert!(hits > 2_000 && in_instances > 1_000, "{hits} {in_instances}");
}

/// The same accel twice at one place, and mirrored in a plane that both share: the first instance is hit.
#[test]
fn ties_go_to_the_first_instance() {
    let mut mesh = make::plane(50);
    mesh.vertices.iter_mut().for_each(|v| v[2] = 0.0);
    let child = Model::from(mesh);
    let child = child.with_scene(|s| OwnedAccel::bvh(s, &BuildOptions::default()).expect("a BVH"));
    // Neither rays nor maps are exact, but both instances see the same ray or its mirror image.
    let map = [0.7, 0.1, 0.2, 0.3, -0.2, 0.9, 0.1, 0.1, 0.3, -0.4, 1.1, 0.2];
    let mut mirrored = map;
    (0..3).for_each(|k| mirrored[4 * k + 2] = -mirrored[4 * k + 2]);
    for pair in [[map, map], [map, mirrored], [mirrored, map]] {
        let instances = pair.map(|map| Instance::new(&child.accel(), map));
        let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
        let mut random = Random::new(4);
        let mut hits = 0;
        for _ in 0..300 {
            let to = [random.between(-0.2, 1.2) as f32, random.between(-0.2, 1.2) as f32, 0.0];
            let ray = towards(&mut random, point(&map, to), 3.0);
            if let Some(hit) = agreed(&all.accels(), &ray, &DEFAULT) {
                assert_eq!(hit.instance, 0, "{ray:?}");
                let skip = Some(PrimId { prim: hit.prim, geometry: 0, instance: 0 });
                let other = agreed(&all.accels(), &ray, &QueryOptions { skip, ..DEFAULT });
                let other = other.expect("the other instance");
                assert_eq!((other.t, other.instance), (hit.t, 1), "{ray:?}");
                hits += 1;
            }
        }
        assert!(hits > 100, "{hits}");
    }
}

/// Of two planes whose distances are one float, the nearer one is hit, whichever instance it is.
#[test]
fn what_rounds_to_one_distance_is_told_apart() {
    let built = [0.0, 1e-9].map(|height| {
        let mut mesh = make::plane(10);
        mesh.vertices.iter_mut().for_each(|v| v[2] = height);
        children(&mesh.into())
    });
    let one = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.];
    for nearer in [0, 1] {
        let [low, high] = built.each_ref().map(|ways| Instance::new(&ways[0].accel(), one));
        let instances = if nearer == 0 { [high, low] } else { [low, high] };
        let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
        for i in 0..20 {
            let x = i as f32 / 20.0;
            let ray = Ray::new([x, 0.5, 3.0], [0.01, 0.02, -1.0]);
            let hit = agreed(&all.accels(), &ray, &DEFAULT).expect("a plane");
            assert_eq!((hit.t, hit.instance), (3.0, nearer), "{ray:?}");
        }
    }
}

/// Rays that hit nothing by definition, and rays at the ends of the floats.
#[test]
fn hostile_rays_get_the_same_answer_from_all() {
    let model = child_model(9);
    let built = children(&model);
    let mut random = Random::new(6);
    let maps: Vec<_> = (0..14).map(|i| random_map(&mut random, [0, 1, 2, 6][i % 4])).collect();
    let instances: Vec<_> = (maps.iter().enumerate())
        .map(|(i, map)| Instance::new(&built[i % built.len()].accel(), *map))
        .collect();
    let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
    let judge = Judge {
        own: Oracle::new(&Model::default()),
        child: Oracle::new(&model),
        masks: vec![0; 14],
    };
    let accels = all.accels();
    const ODD: [f32; 14] = [
        0.0,
        -0.0,
        1e-45,
        -1e-30,
        1e-18,
        -1.0,
        1.0,
        1e18,
        -1e30,
        3e38,
        f32::INFINITY,
        -f32::INFINITY,
        f32::NAN,
        0.5,
    ];
    let mut hits = 0;
    for round in 0..3_000 {
        let mut odd = || ODD[random.below(ODD.len())];
        let mut ray = Ray::new([odd(), odd(), odd()], [odd(), odd(), odd()]);
        if round % 3 == 0 {
            // Towards something, by a direction of any length.
            let length = [2e-45, 1e-44, 1e10, 1e30][random.below(4)];
            let to = [0, 1, 2].map(|_| random.between(-1.2, 1.2) as f32);
            let to = point(&maps[random.below(14)], to);
            ray = towards(&mut random, to, 5.0);
            ray.direction = ray.direction.map(|x| x * length);
        } else if round % 3 == 1 {
            ray = ray.with_limits(odd(), odd());
        }
        let hit = agreed(&accels, &ray, &DEFAULT);
        let finite = ray.origin.iter().chain(&ray.direction).all(|x| x.is_finite());
        let expected = judge.closest(&accels[0].1, &ray, &DEFAULT).filter(|_| finite);
        assert_eq!(named(hit), expected, "{ray:?}");
        hits += u32::from(hit.is_some());
    }
    assert!(hits > 100, "{hits}");
}

/// Three least floats along x and one along y become two and none at half the scale: that ray hits what the given one
/// passes far away from.
#[test]
fn least_directions_are_what_they_are_rounded_to() {
    // So small that `t` is below the largest float.
    const TINY: f32 = 1.0 / (1 << 27) as f32;
    let built = children(&make::blob(120, 1).placed(TINY.into(), [0.0; 3]).into());
    let least = f32::from_bits(1);
    let ray = Ray::new([-100.0 * TINY, 0.0, 0.0], [3.0 * least, least, 0.0]);
    let instances = [0, 1, 2, 3].map(|i| {
        let map = [2., 0., 0., 0., 0., 2., 0., 0., 0., 0., 2., 0.];
        Instance::new(&built[i].accel(), map)
    });
    for instances in [&instances[..1], &instances] {
        let all = All::build(&Scene::new(&[], &[]).with_instances(instances));
        let hit = agreed(&all.accels(), &ray, &DEFAULT);
        assert_eq!(hit.map(|hit| hit.instance), Some(0));
    }
}

/// Nothing that is hit in exact mode is missed, and batches answer as single rays.
#[test]
fn other_ways_to_ask_agree() {
    let model = child_model(4);
    let built = children(&model);
    let mut random = Random::new(3);
    let maps: Vec<_> = (0..20).map(|_| random_map(&mut random, 0)).collect();
    let instances: Vec<_> = (maps.iter().enumerate())
        .map(|(i, map)| Instance::new(&built[i % built.len()].accel(), *map))
        .collect();
    let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
    let rays: Vec<_> = (0..500)
        .map(|_| {
            let to = [0, 1, 2].map(|_| random.between(-1.0, 1.0) as f32);
            let to = point(&maps[random.below(20)], to);
            towards(&mut random, to, 3.0)
        })
        .collect();
    let tight = QueryOptions { precision: Precision::Watertight, ..DEFAULT };
    for (name, accel) in all.accels() {
        let mut batch = vec![Hit::MISS; rays.len()];
        let mut occluded = vec![false; rays.len()];
        accel.intersect_batch(&rays, &mut batch);
        accel.occluded_batch(&rays, &mut occluded);
        for ((ray, hit), occluded) in rays.iter().zip(batch).zip(occluded) {
            let single = accel.intersect(ray);
            assert_eq!(bits(Some(hit)), bits(single.or(Some(Hit::MISS))), "{name} {ray:?}");
            assert_eq!(occluded, single.is_some(), "{name} {ray:?}");
            let mut counts = Default::default();
            let counted = accel.intersect_counted(ray, &DEFAULT, &mut counts);
            assert_eq!(bits(counted), bits(single), "{name} {ray:?}");
            let found = accel.intersect_with(ray, &tight);
            assert_eq!(found.is_some(), accel.occluded_with(ray, &tight), "{name} {ray:?}");
            assert!(found.is_some() || single.is_none(), "{name} {ray:?}");
        }
    }
}

/// The boxes of the index count as those of a child do, but instances are no primitives.
#[test]
fn the_index_is_counted() {
    let model: Model = make::sphere(200).into();
    let child =
        model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()).expect("a BVH"));
    let place = |x: f32| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let instances: Vec<_> =
        (0..50).map(|i| Instance::new(&child.accel(), place(4.0 * i as f32))).collect();
    let all = All::build(&Scene::new(&[], &[]).with_instances(&instances));
    let through = Ray::new([8.1, 0.2, -3.0], [0.0, 0.0, 1.0]);
    let beside = Ray { origin: [10.0, 0.2, -3.0], ..through };
    for (name, accel) in all.accels() {
        let count = |ray: &Ray| {
            let mut counts = [Counts::default(); 2];
            let hit = accel.intersect_counted(ray, &DEFAULT, &mut counts[0]);
            assert_eq!(accel.occluded_counted(ray, &DEFAULT, &mut counts[1]), hit.is_some());
            counts
        };
        let mut alone = Counts::default();
        let ray = accel.object_ray(2, &through).expect("a ray");
        child.accel().intersect_counted(&ray, &DEFAULT, &mut alone);
        let [closest, any] = count(&through);
        assert_eq!((closest.blocks, closest.tests), (alone.blocks, alone.tests), "{name}");
        assert!(closest.steps > alone.steps && any.steps > 0, "{name}: {closest:?} {alone:?}");
        for counts in count(&beside) {
            assert!(counts.steps > 0 && counts.blocks == 0, "{name}: {counts:?}");
        }
    }
}
