//! The surface at a hit: its normal, its error bound, and origins that really have left it.

#![allow(missing_docs)]

mod common;

use common::All;
use raykern::{Accel, Hit, Ray, Surface};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};

type Vector = [f64; 3];

fn wide(p: [f32; 3]) -> Vector {
    p.map(f64::from)
}

fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn unit(a: Vector) -> Vector {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

/// A point of the surface, and the unit normal there.
fn expected(model: &Model, hit: &Hit, near: Vector) -> (Vector, Vector) {
    let (g, prim) = (hit.geometry as usize, hit.prim as usize);
    if let Some(mesh) = model.meshes.get(g) {
        let [a, b, c] = mesh.indices[prim].map(|v| wide(mesh.vertices[v as usize]));
        let (p, q) = (minus(b, a), minus(c, a));
        let cross = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| p[i] * q[j] - p[j] * q[i]);
        (a, unit(cross))
    } else {
        let [x, y, z, r] = model.sphere_sets[g - model.meshes.len()][prim].map(f64::from);
        let normal = unit(minus(near, [x, y, z]));
        ([x + r * normal[0], y + r * normal[1], z + r * normal[2]], normal)
    }
}

/// How far the origins are off the surface, to the side they are meant to be on.
fn check(model: &Model, hit: &Hit, surface: &Surface) {
    let (point, normal) = expected(model, hit, wide(surface.position));
    let turned = dot(normal, wide(surface.normal));
    assert!((turned - 1.0).abs() < 1e-6, "{hit:?} {surface:?} {normal:?}");
    let height = |p: [f32; 3]| dot(minus(wide(p), point), normal);
    let reach = normal.iter().map(|x| x.abs()).sum::<f64>() * f64::from(surface.position_error);
    assert!(height(surface.position).abs() <= reach, "{hit:?} {surface:?}");
    assert!(surface.position_error > 0.0);
    assert!(height(surface.front_origin) > 0.0, "{hit:?} {surface:?}");
    assert!(height(surface.back_origin) < 0.0, "{hit:?} {surface:?}");
    assert!(height(surface.front_origin) <= 4.0 * reach, "{hit:?} {surface:?}");
}

/// Rays that leave a triangle to one side do not meet it again.
fn leave(accel: &Accel, hit: &Hit, surface: &Surface, random: &mut Random) {
    for (origin, side) in [(surface.front_origin, 1.0), (surface.back_origin, -1.0)] {
        let way = random.direction();
        let up = side * dot(way, wide(surface.normal)).signum();
        let again = accel.intersect(&Ray::new(origin, way.map(|x| (x * up) as f32)));
        let same = again.filter(|h| (h.prim, h.geometry) == (hit.prim, hit.geometry));
        assert!(same.is_none(), "{hit:?} {surface:?} {same:?}");
    }
}

#[test]
fn origins_have_left_the_surface() {
    let mut models: Vec<Model> = vec![
        make::blob(2_000, 1).into(),
        make::architecture(2_000, 1).into(),
        make::spheres(200, 1),
    ];
    for scale in [1e-30f32, 1e30] {
        let mut scaled = models[0].clone();
        let vertices = scaled.meshes[0].vertices.iter_mut();
        vertices.for_each(|v| *v = v.map(|x| x * scale));
        models.push(scaled);
    }
    for model in &models {
        let (all, mut random, mut hits) = (All::of(model), Random::new(9), 0);
        for family in [Family::Random, Family::Inside, Family::AtEdge, Family::Far] {
            for ray in RayMaker::new(model, 2).many(family, 500) {
                let [(_, list), rest @ ..] = all.accels();
                let Some(hit) = list.intersect(&ray) else { continue };
                let surface = list.surface(&ray, &hit).expect("the hit is there");
                for (name, accel) in rest {
                    assert_eq!(accel.surface(&ray, &hit), Some(surface), "{name}");
                }
                check(model, &hit, &surface);
                if (hit.geometry as usize) < model.meshes.len() {
                    leave(&list, &hit, &surface, &mut random);
                }
                hits += 1;
            }
        }
        assert!(hits > 400, "{hits}");
    }
}

#[test]
fn a_hit_that_is_not_there_has_no_surface() {
    let model: Model = make::blob(500, 1).into();
    let all = All::of(&model);
    for (_, accel) in all.accels() {
        let ray = Ray::new([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let hit = accel.intersect(&ray).expect("from inside");
        assert!(accel.surface(&ray, &hit).is_some());
        for wrong in [
            Hit { prim: (hit.prim + 250) % 500, ..hit },
            // Beyond what either precision answers for this triangle.
            Hit { t: hit.t * (1.0 + 1e-5), ..hit },
            Hit { geometry: 1, ..hit },
            Hit { instance: 0, ..hit },
            Hit::MISS,
        ] {
            assert_eq!(accel.surface(&ray, &wrong), None, "{wrong:?}");
        }
    }
}
