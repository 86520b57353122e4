//! Cases with known answers, and laws.

use raykern::{Hit, NONE, Precision, PrimId};

use super::*;
use crate::make::{self, Random};
use crate::model::TriangleMesh;

/// Two triangles that share the edge from (0, 0, 0) to (1, 1, 0), and a unit sphere 5 behind them.
fn model() -> Model {
    Model {
        meshes: vec![TriangleMesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            indices: vec![[0, 1, 2], [0, 2, 3], [0, 1, 1]],
        }],
        sphere_sets: vec![vec![[0.0, 0.0, -5.0, 1.0]]],
    }
}

const ALL: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };
const DOWN: [f32; 3] = [0.0, 0.0, -1.0];

fn answer(ray: Ray, options: QueryOptions) -> Option<(u32, u32, f32)> {
    let hit = Oracle::with_masks(&model(), &[1, 2]).closest(&ray, &options).hit?;
    Some((hit.place.geometry, hit.place.prim, hit.t.rounded()))
}

#[test]
fn least_t_and_then_the_first_in_order() {
    assert_eq!(answer(Ray::new([0.75, 0.25, 1.0], DOWN), ALL), Some((0, 0, 1.0)));
    assert_eq!(answer(Ray::new([0.25, 0.75, 1.0], DOWN), ALL), Some((0, 1, 1.0)));
    let shared = Ray::new([0.5, 0.5, 1.0], DOWN);
    let verdict = Oracle::new(&model()).closest(&shared, &ALL);
    assert_eq!(verdict.hit.expect("a hit").place, Place { geometry: 0, prim: 0 });
    assert_eq!(verdict.equal_t, [Place { geometry: 0, prim: 1 }]);
    let negative = Ray::new([0.0; 3], DOWN).with_limits(f32::NEG_INFINITY, f32::INFINITY);
    assert_eq!(answer(negative, ALL), Some((0, 0, 0.0)));
    let through = Ray { origin: [0.0, 0.0, -20.0], ..negative };
    assert_eq!(answer(through, ALL), Some((0, 0, -20.0)));
}

#[test]
fn limits_are_inclusive_and_compared_with_the_real_t() {
    let ray = Ray::new([0.75, 0.25, 1.0], DOWN);
    assert!(answer(ray.with_limits(1.0, 1.0), ALL).is_some());
    assert!(answer(ray.with_limits(1.0f32.next_up(), 3.0), ALL).is_none());
    assert!(answer(ray.with_limits(0.0, 1.0f32.next_down()), ALL).is_none());
    // t is exactly 1/3, which rounds up: the rounded t lies beyond the real one.
    let third = Ray::new([0.75, 0.25, 1.0], [0.0, 0.0, -3.0]);
    let t = answer(third, ALL).expect("a hit").2;
    assert!(f64::from(t) > 1.0 / 3.0);
    assert!(answer(third.with_limits(t, 1.0), ALL).is_none());
    assert!(answer(third.with_limits(0.0, t), ALL).is_some());
    // Beyond the largest float.
    let slow = Ray::new([0.75, 0.25, 1.0], [0.0, 0.0, -1e-39]);
    assert!(answer(slow, ALL).is_none());
}

#[test]
fn options_leave_out() {
    let ray = Ray::new([0.0, 0.0, 1.0], DOWN);
    let with = |mask, facing| answer(ray, QueryOptions { mask, facing, ..ALL });
    assert_eq!(with(2, Facing::Both), Some((1, 0, 5.0)));
    assert_eq!(with(4, Facing::Both), None);
    assert_eq!(with(3, Facing::Front), Some((0, 0, 1.0)));
    assert_eq!(with(0, Facing::Back), Some((1, 0, 7.0)));
    let first = Some(PrimId { prim: 0, geometry: 0, instance: NONE });
    assert_eq!(answer(ray, QueryOptions { skip: first, ..ALL }), Some((0, 1, 1.0)));
    let only_sphere = |ray, skip| answer(ray, QueryOptions { skip, mask: 2, ..ALL });
    let sphere = Some(PrimId { prim: 0, geometry: 1, instance: NONE });
    assert_eq!(only_sphere(ray, sphere), Some((1, 0, 7.0)));
    let inside = Ray::new([0.0, 0.0, -5.5], DOWN);
    assert_eq!(only_sphere(inside, sphere), None);
    let below = Ray::new([0.0, 0.0, -7.0], DOWN).with_limits(-9.0, 9.0);
    assert_eq!(only_sphere(below, None), Some((1, 0, -3.0)));
    assert_eq!(only_sphere(below, sphere), Some((1, 0, -3.0)));
    let tangent = Ray::new([1.0, 0.0, 0.0], DOWN);
    assert_eq!(only_sphere(tangent, None), Some((1, 0, 5.0)));
    assert_eq!(only_sphere(tangent, sphere), None);
}

#[test]
fn rays_that_hit_nothing_by_definition() {
    let good = Ray::new([0.75, 0.25, 1.0], DOWN);
    for bad in [
        Ray { origin: [f32::NAN, 0.25, 1.0], ..good },
        Ray { direction: [0.0; 3], ..good },
        Ray { direction: [0.0, 0.0, f32::NEG_INFINITY], ..good },
        good.with_limits(f32::NAN, 2.0),
        good.with_limits(0.0, f32::NAN),
        good.with_limits(2.0, 0.5),
        good.with_limits(f32::INFINITY, f32::INFINITY),
        good.with_limits(f32::NEG_INFINITY, f32::NEG_INFINITY),
    ] {
        assert_eq!(answer(bad, ALL), None, "{bad:?}");
    }
    let mut broken = model();
    broken.meshes[0].vertices[2][1] = f32::INFINITY;
    let hit = Oracle::new(&broken).closest(&good, &ALL).hit.expect("the sphere");
    assert_eq!(hit.place.geometry, 1);
}

#[test]
fn every_kind_of_wrong_answer_is_told_apart() {
    let oracle = Oracle::new(&model());
    let ray = Ray::new([0.5, 0.5, 1.0], DOWN);
    let right = Hit { t: 1.0, u: 0.0, v: 0.5, prim: 0, geometry: 0, instance: NONE };
    let judge = |hit| oracle.judge(&ray, &ALL, hit);
    assert_eq!(judge(Some(right)), Judgement::Right);
    assert_eq!(judge(None), Judgement::FalseMiss);
    assert_eq!(judge(Some(Hit { prim: 1, ..right })), Judgement::WrongPrim);
    assert_eq!(judge(Some(Hit { prim: 2, ..right })), Judgement::FalseHit);
    let late = Hit { t: 1.0f32.next_up(), ..right };
    assert_eq!(judge(Some(late)), Judgement::WrongT { ulps: 1 });
    for bad in [Hit { u: 0.001, ..right }, Hit { v: f32::NAN, ..right }, Hit { u: -0.1, ..right }] {
        assert!(matches!(judge(Some(bad)), Judgement::WrongWeights { .. }), "{bad:?}");
    }
    let aside = Ray::new([-2.0, 0.5, 1.0], DOWN);
    assert_eq!(oracle.judge(&aside, &ALL, Some(right)), Judgement::FalseHit);
    assert_eq!(oracle.judge(&aside, &ALL, None), Judgement::Right);
}

/// Scaling everything by a power of two scales nothing but the numbers: `t` stays.
#[test]
fn laws_of_scaling_and_permuting() {
    let mut random = Random::new(7);
    let mut model: Model = make::blob(200, 5).into();
    model.sphere_sets.push(vec![[0.0, 0.0, 0.0, 0.5], [0.5, 0.25, 0.0, 0.75]]);
    let mut scaled = model.clone();
    let power = 2f32.powi(-40);
    let grow = |p: &mut [f32]| p.iter_mut().for_each(|x| *x *= power);
    scaled.meshes[0].vertices.iter_mut().for_each(|p| grow(p));
    scaled.sphere_sets[0].iter_mut().for_each(|p| grow(p));
    let mut reversed = model.clone();
    reversed.meshes[0].indices.reverse();
    let count = model.meshes[0].indices.len() as u32;
    let oracles = [&model, &scaled, &reversed].map(Oracle::new);
    let mut hits = 0;
    for _ in 0..200 {
        let ray = Ray::new(
            random.point(-2.0, 2.0).map(|x| x as f32),
            random.direction().map(|x| x as f32),
        );
        let small = Ray {
            origin: ray.origin.map(|x| x * power),
            direction: ray.direction.map(|x| x * power),
            ..ray
        };
        let [a, b, c] = [(0, ray), (1, small), (2, ray)].map(|(i, ray): (usize, _)| {
            oracles[i].closest(&ray, &ALL).hit.map(|hit| (hit.place, hit.t.rounded(), hit.weights))
        });
        hits += usize::from(a.is_some());
        assert_eq!(a, b, "{ray:?}");
        let back = c.map(|(place, t, weights)| {
            let prim = if place.geometry == 0 { count - 1 - place.prim } else { place.prim };
            (Place { prim, ..place }, t, weights)
        });
        assert_eq!(a, back, "{ray:?}");
    }
    assert!(hits > 20, "{hits}");
}
