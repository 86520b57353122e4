//! The watertight mode: nothing that real arithmetic hits is missed, and what is answered lies within
//! the stated bounds.

#![allow(missing_docs)]

mod common;

use common::{All, odd_models};
use raykern::{
    Accel, Facing, Hit, Mesh, NONE, Precision, PrimId, QueryOptions, Ray, Scene, SphereSet,
};
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::oracle::Oracle;
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::each;

const EXACT: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };
const WATERTIGHT: QueryOptions = QueryOptions { precision: Precision::Watertight, ..EXACT };

/// What a table of answers says.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    rays: u64,
    hits: u64,
    misses: u64,
    /// Hits where there is none.
    false_hits: u64,
    /// Hits with a `t` beyond the real one and its bound.
    far: u64,
}

impl Seen {
    fn add(&mut self, other: Seen) {
        self.rays += other.rays;
        self.hits += other.hits;
        self.misses += other.misses;
        self.false_hits += other.false_hits;
        self.far += other.far;
    }
}

/// The largest coordinate of the model's finite parts.
fn reach(model: &Model) -> f64 {
    let vertices = model.meshes.iter().flat_map(|m| m.vertices.iter().flatten());
    let spheres = model.sphere_sets.iter().flatten().flatten();
    let finite = vertices.chain(spheres).filter(|x| x.is_finite());
    finite.fold(0.0, |m, x| f64::from(x.abs()).max(m))
}

/// The `t` at which the ray passes the nearest and the farthest vertex of a triangle along the axis on
/// which it moves most; `None` for spheres.
fn depth_range(model: &Model, ray: &Ray, hit: &Hit) -> Option<[f64; 2]> {
    let mesh = model.meshes.get(hit.geometry as usize)?;
    let length = |k: &usize| ray.direction[*k].abs();
    let k = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let depths = mesh.indices[hit.prim as usize].map(|v| {
        let way = f64::from(mesh.vertices[v as usize][k]) - f64::from(ray.origin[k]);
        way / f64::from(ray.direction[k])
    });
    Some([depths.into_iter().reduce(f64::min)?, depths.into_iter().reduce(f64::max)?])
}

/// The answer of one ray and structure in both precisions, in a scene that reaches as far as `size`.
fn compare(model: &Model, accel: &Accel, ray: &Ray, size: f64, seen: &mut Seen) {
    let (exact, hit) = (accel.intersect(ray), accel.intersect_with(ray, &WATERTIGHT));
    let occluded = accel.occluded_with(ray, &WATERTIGHT);
    assert_eq!((accel.intersect_watertight(ray), accel.occluded_watertight(ray)), (hit, occluded));
    seen.rays += 1;
    seen.hits += u64::from(exact.is_some());
    seen.false_hits += u64::from(hit.is_some() && exact.is_none());
    seen.misses += u64::from(exact.is_some() && !(hit.is_some() && occluded));
    let Some(hit) = hit else { return };
    assert!(hit.t >= ray.t_min && hit.t <= ray.t_max, "{ray:?} {hit:?}");
    let [u, v] = [hit.u, hit.v];
    assert!(u >= 0.0 && v >= 0.0 && 1.0 - u - v >= 0.0, "{ray:?} {hit:?}");
    // A few roundings of the distance, and what falls below the least float of the frame.
    let length = ray.direction.iter().fold(0f64, |m, x| f64::from(x.abs()).max(m));
    let slack = |t: f64| t.abs() * 2f64.powi(-20) + (size * 2f64.powi(-90)) / length + 1e-44;
    let t = f64::from(hit.t);
    if let Some([near, far]) = depth_range(model, ray, &hit) {
        // Or at a limit of the ray, which was just beyond.
        let inside = near - slack(near) <= t && t <= far + slack(far);
        assert!(inside || hit.t == ray.t_min || hit.t == ray.t_max, "{ray:?} {hit:?}");
    }
    if let Some(exact) = exact {
        // Not beyond the first thing that is met: by more than a grazed sphere or, for a triangle, its
        // last vertex. The bounds of single meetings are tested beside the code.
        let real = f64::from(exact.t);
        let last = depth_range(model, ray, &exact).map_or(real + 1e-2 * size / length, |r| r[1]);
        seen.far += u64::from(t > last.max(real) + slack(last));
    }
}

fn families() -> impl Iterator<Item = Family> {
    Family::ORDINARY.into_iter().chain(Family::HOSTILE)
}

/// All families over one model, in each structure.
fn table(name: &str, model: &Model, rays: usize) -> Seen {
    let (all, oracle) = (All::of(model), Oracle::new(model));
    let mut sum = Seen::default();
    for (seed, family) in families().enumerate() {
        let mut seen = Seen::default();
        for ray in RayMaker::new(model, seed as u64).many(family, rays) {
            let real = oracle.closest(&ray, &EXACT).hit.is_some();
            for (_, accel) in all.accels() {
                let hit = accel.intersect_with(&ray, &WATERTIGHT).is_some();
                seen.misses += u64::from(real && !hit);
            }
            let from = ray.origin.iter().fold(reach(model), |m, x| f64::from(x.abs()).max(m));
            all.accels().iter().for_each(|(_, accel)| compare(model, accel, &ray, from, &mut seen));
        }
        println!("{:32} {seen:?}", format!("{name} {family:?}"));
        assert_eq!((seen.misses, seen.far), (0, 0), "{name} {family:?}, seed {seed}");
        sum.add(seen);
    }
    println!("{:32} {sum:?}", format!("{name}, all"));
    sum
}

#[test]
fn made_scenes_are_never_missed() {
    each(make::ALL, |(name, make)| {
        let seen = table(name, &make(1_000), 150);
        assert!(seen.hits > 1_000, "{name}");
    });
}

#[test]
fn odd_scenes_are_never_missed() {
    each(odd_models(), |(name, model)| {
        table(name, &model, 150);
    });
}

/// Nothing stands behind a single triangle or sphere: what is missed at its edge is missed. The judge
/// is the oracle, as both precisions share the filter.
#[test]
fn single_primitives_are_never_missed() {
    const FAMILIES: [Family; 5] = [
        Family::AtVertex,
        Family::AtEdge,
        Family::ThroughVertex,
        Family::FromVertex,
        Family::Limited,
    ];
    let mut seen = Seen::default();
    for seed in 0..400 {
        let triangle = make::soup(1, seed).into();
        let model = if seed % 4 == 0 { make::spheres(1, seed) } else { triangle };
        let (all, oracle) = (All::of(&model), Oracle::new(&model));
        for family in FAMILIES {
            for ray in RayMaker::new(&model, seed).many(family, 20) {
                let from = ray.origin.iter().fold(reach(&model), |m, x| f64::from(x.abs()).max(m));
                let (_, accel) = all.accels()[seed as usize % 3];
                compare(&model, &accel, &ray, from, &mut seen);
                let real = oracle.closest(&ray, &EXACT).hit.is_some();
                let hit = accel.intersect_with(&ray, &WATERTIGHT).is_some();
                let occluded = accel.occluded_with(&ray, &WATERTIGHT);
                assert!(!real || (hit && occluded), "seed {seed}: {ray:?}");
            }
        }
    }
    println!("{seen:?}");
    assert_eq!((seen.misses, seen.far), (0, 0));
    assert!(seen.hits > 5_000);
}

/// Scenes at the ends of the range of floats.
#[test]
fn scenes_of_any_size_are_never_missed() {
    for power in [-148, -140, -60, 60, 120] {
        let s = 2f64.powi(power);
        let model: Model = make::blob(300, 3).placed(s, [s, -s, 0.0]).into();
        table(&format!("blob 2^{power}"), &model, 60);
    }
}

/// From inside, a closed mesh is hit whatever the ray, at vertices and edges as well.
#[test]
fn no_ray_leaves_a_closed_mesh() {
    let mut rays = 0;
    for model in [make::sphere(2_000), make::blob(2_000, 3)] {
        let model = Model::from(model);
        let all = All::of(&model);
        for vertex in &model.meshes[0].vertices {
            for origin in [[0.0; 3], vertex.map(|x| -0.1 * x)] {
                let towards = [0, 1, 2].map(|k| vertex[k] - origin[k]);
                for direction in [*vertex, towards] {
                    let ray = Ray::new(origin, direction);
                    for (name, accel) in all.accels() {
                        let hit = accel.intersect_with(&ray, &WATERTIGHT);
                        assert!(hit.is_some(), "{name} {ray:?}");
                        assert!(accel.occluded_with(&ray, &WATERTIGHT), "{name} {ray:?}");
                        rays += 1;
                    }
                }
            }
        }
    }
    println!("{rays} rays");
}

/// Masks, sides and skipped primitives: what is answered is what the options leave, and a ray that hits
/// it well inside is not missed.
#[test]
fn options_are_honoured() {
    const MASKS: [u32; 3] = [1, 2, 3];
    let mut model: Model = make::blob(300, 6).into();
    model.meshes.push(make::soup(200, 7));
    model.sphere_sets.push(vec![[0.0, 0.0, 0.0, 1.0], [0.5, 0.0, 0.0, 0.75]]);
    let meshes: Vec<_> = (model.meshes.iter().zip(MASKS))
        .map(|(mesh, mask)| Mesh::indexed(&mesh.vertices, &mesh.indices).with_mask(mask))
        .collect();
    let sets = [SphereSet::new(&model.sphere_sets[0]).with_mask(MASKS[2])];
    let all = All::build(&Scene::new(&meshes, &sets));
    let oracle = Oracle::with_masks(&model, &MASKS);
    let mut hits = 0;
    for family in [Family::Random, Family::Inside, Family::FromSurface] {
        for ray in RayMaker::new(&model, 8).many(family, 400) {
            let first = all.accels()[2].1.intersect(&ray);
            let skip =
                first.map(|hit| PrimId { prim: hit.prim, geometry: hit.geometry, instance: NONE });
            for (mask, facing, skip) in [
                (1, Facing::Both, None),
                (2, Facing::Front, None),
                (0, Facing::Back, None),
                (0, Facing::Both, skip),
            ] {
                let exact = QueryOptions { mask, facing, skip, ..EXACT };
                let options = QueryOptions { mask, facing, skip, ..WATERTIGHT };
                let expected = oracle.closest(&ray, &exact).hit;
                for (name, accel) in all.accels() {
                    let hit = accel.intersect_with(&ray, &options);
                    let occluded = accel.occluded_with(&ray, &options);
                    assert_eq!(hit.is_some(), occluded, "{name} {ray:?}");
                    assert!(hit.is_some() || expected.is_none(), "{name} {ray:?} {options:?}");
                    let Some(hit) = hit else { continue };
                    let seen = MASKS[hit.geometry as usize] & mask != 0 || mask == 0;
                    assert!(seen, "{name} {ray:?} {options:?} {hit:?}");
                    let skipped =
                        skip.is_some_and(|s| (s.prim, s.geometry) == (hit.prim, hit.geometry));
                    assert!(!skipped || hit.geometry == 2, "{name} {ray:?} {options:?} {hit:?}");
                    hits += 1;
                }
            }
        }
    }
    assert!(hits > 2_000, "{hits}");
}
