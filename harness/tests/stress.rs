//! The stress suite, cut short, and its own reliability: planted faults are found and shrunk.
//!
//! Failures that `cargo run --release -p raykern-harness --bin stress` prints go to the end.

#![allow(missing_docs)]

use raykern::{Hit, Ray};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::Oracle;
use raykern_harness::rays::{self, RayMaker};
use raykern_harness::stress::run::{Outcome, Plan, assert_right, run};
use raykern_harness::stress::score::Complaint;
use raykern_harness::stress::shrink::shrunk;
use raykern_harness::stress::subject::{Answers, Build, Structures, Subject};
use raykern_harness::stress::{ALL, Family, Scenery, Shot, as_test, table};

fn stress(families: &[Family], rays: usize, build: Build, threads: usize) -> Outcome {
    run(&Plan { families, rays, seed: 7, build, embree: None, threads })
}

#[test]
fn every_family_is_answered_right() {
    let outcome = stress(&ALL, 60_000, &Structures::boxed, 2);
    println!("{}", table(&ALL, &outcome.rows, false));
    for failure in &outcome.failures {
        println!("{failure:?}");
    }
    for (family, row) in ALL.iter().zip(&outcome.rows) {
        assert!(row.is_right(), "{}", family.name);
        assert!(row.hits > row.rays / 20, "{} hits nothing", family.name);
    }
    assert!(outcome.failures.is_empty());
}

#[test]
fn a_seed_and_a_number_name_a_case_for_good() {
    for family in ALL {
        // Debug text tells NaN from NaN as little as it must, and -0 from 0.
        let text = |seed, number| format!("{:?}", family.case(seed, number));
        assert_eq!(text(1, 2), text(1, 2), "{}", family.name);
        assert_ne!(text(1, 2), text(1, 3), "{}", family.name);
        assert_ne!(text(1, 2), text(2, 2), "{}", family.name);
    }
}

#[test]
fn threads_do_not_change_the_outcome() {
    let [mut one, mut three] =
        [1, 3].map(|threads| stress(&ALL[..6], 6_000, &Structures::boxed, threads));
    for row in one.rows.iter_mut().chain(&mut three.rows) {
        row.seconds = 0.0;
    }
    assert_eq!(one.rows, three.rows);
}

/// Changes an answer whose hit is one of every third triangle.
struct Liar {
    honest: Structures,
    triangles: Vec<Vec<[[f32; 3]; 3]>>,
    lie: fn(&mut Answers),
}

impl Subject for Liar {
    fn ask(&self, shot: &Shot) -> Answers {
        let mut answers = self.honest.ask(shot);
        // By its corners: numbers change while a scene shrinks.
        let hit = answers.exact[0];
        let corners =
            hit.and_then(|h| self.triangles.get(h.geometry as usize)?.get(h.prim as usize));
        let bits = corners.map_or(1, |c| c.as_flattened().iter().map(|x| x.to_bits() >> 9).sum());
        if bits.is_multiple_of(3) {
            (self.lie)(&mut answers);
        }
        answers
    }
}

fn liar(scenery: &Scenery, lie: fn(&mut Answers)) -> Box<dyn Subject> {
    let corners = |mesh: &TriangleMesh| {
        mesh.indices.iter().map(|t| t.map(|v| mesh.vertices[v as usize])).collect()
    };
    let triangles = scenery.model.meshes.iter().map(corners).collect();
    Box::new(Liar { honest: Structures::new(scenery), triangles, lie })
}

fn each(answers: &mut Answers, change: impl Fn(&mut Hit)) {
    answers.exact.iter_mut().flatten().for_each(change);
}

fn misses(answers: &mut Answers) {
    (answers.exact, answers.occluded) = ([None; 3], [false; 3]);
}

/// Every lie is found, is told apart from the others, and shrinks to one primitive.
#[test]
fn planted_faults_are_found_and_shrunk() {
    let lies: [(&str, Build); 9] = [
        ("false miss", &|s| liar(s, misses)),
        ("false hit", &|s| liar(s, |a| each(a, |hit| hit.prim += 1_000_000))),
        ("t is not the nearest float", &|s| liar(s, |a| each(a, |hit| hit.t = hit.t.next_up()))),
        ("weights out of their bound", &|s| liar(s, |a| each(a, |hit| hit.u += 0.01))),
        ("list, grid and BVH differ", &|s| {
            liar(s, |a| a.exact[2].iter_mut().for_each(negate_zero))
        }),
        ("occluded contradicts intersect", &|s| liar(s, |a| a.occluded[1] = false)),
        ("watertight misses", &|s| liar(s, |a| a.watertight.0 = None)),
        ("watertight misses", &|s| liar(s, |a| a.watertight.1 = false)),
        ("panic", &|s| liar(s, |_| panic!("planted"))),
    ];
    let family = [Family::by_name("closed-outside").expect("a family")];
    for (name, build) in lies {
        let outcome = stress(&family, 500, build, 1);
        assert!(!outcome.rows[0].is_right(), "{name}");
        let failure = outcome.failures.first().expect("a failure");
        let found = if name.starts_with("list") { "list, grid and BVH differ" } else { name };
        assert_eq!(failure.complaint, Complaint(found));
        let (scenery, shot) = shrunk(&failure.scenery, &failure.shot, &failure.complaint, build);
        assert_eq!(scenery.model.triangle_count(), 1, "{name}");
        assert_eq!(scenery.model.meshes[0].vertices.len(), 3, "{name}");
        assert_eq!((shot.ray.t_min, shot.ray.t_max), (0.0, f32::INFINITY), "{name}");
        let bits = |numbers: &[f32]| -> u32 {
            numbers.iter().map(|x| 24 - (x.to_bits() | 1 << 24).trailing_zeros().min(24)).sum()
        };
        assert!(2 * bits(&shot.ray.direction) < bits(&failure.shot.ray.direction), "{name}");
        let text = as_test("planted", &scenery, &shot);
        assert!(text.lines().count() < 20 && text.contains("assert_right"), "{text}");
    }
}

/// u is rarely a negative zero: it differs in one bit and compares equal.
fn negate_zero(hit: &mut Hit) {
    hit.u = if hit.u == 0.0 { -0.0 } else { f32::from_bits(hit.u.to_bits() ^ 1) };
}

/// The first of equal ones is lost: a fault that needs two primitives, and keeps them.
#[test]
fn a_wrong_tie_keeps_both_primitives() {
    let square = TriangleMesh {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        indices: vec![[0, 1, 2]; 20],
    };
    let last = |scenery: &Scenery| -> Box<dyn Subject> {
        let indices = scenery.model.meshes.first().map_or(0, |mesh| mesh.indices.len());
        Box::new(Last(Structures::new(scenery), indices as u32))
    };
    let model = Model { meshes: vec![square], sphere_sets: vec![vec![[0.0, 0.0, 9.0, 1.0]]] };
    let scenery = Scenery { model, masks: vec![1, 2] };
    let ray = Ray::new([0.75, 0.25, 1.0], [0.0, 0.0, -1.0]).with_limits(-2.0, 5.0);
    let shot = Shot { ray, options: Default::default() };
    let (small, shot) = shrunk(&scenery, &shot, &Complaint("wrong primitive"), &last);
    assert_eq!(small.model.meshes[0].indices.len(), 2);
    assert_eq!((small.model.sphere_sets.len(), small.masks.len()), (0, 0));
    assert_eq!(shot.ray.t_max, f32::INFINITY);
    assert_right(&small, &shot);
}

/// Names the last triangle instead of the first.
struct Last(Structures, u32);

impl Subject for Last {
    fn ask(&self, shot: &Shot) -> Answers {
        let mut answers = self.0.ask(shot);
        each(&mut answers, |hit| hit.prim = self.1 - 1);
        answers
    }
}

#[test]
fn what_does_not_fail_is_not_shrunk() {
    let scenery = Scenery { model: raykern_harness::make::sphere(50).into(), masks: vec![] };
    let ray = RayMaker::new(&scenery.model, 1).one(rays::Family::Random);
    let shot = Shot { ray, options: Default::default() };
    let (same, _) = shrunk(&scenery, &shot, &Complaint("false miss"), &Structures::boxed);
    assert_eq!(same.model.triangle_count(), scenery.model.triangle_count());
}

/// The families hold what they say: rays that pass exactly through edges are ties, tangents touch.
#[test]
fn exact_families_are_exact() {
    let share_of_ties = |name: &str| {
        let case = Family::by_name(name).expect("a family").case(3, 5);
        let oracle = Oracle::with_masks(&case.scenery.model, &case.scenery.masks);
        let tie = |shot: &&Shot| !oracle.closest(&shot.ray, &shot.options).equal_t.is_empty();
        case.shots.iter().filter(tie).count() as f64 / case.shots.len() as f64
    };
    assert!(share_of_ties("closed-exact") > 0.3, "{}", share_of_ties("closed-exact"));
    let level = ["level-balls", "level-mixed", "layers"].map(share_of_ties);
    assert!(level.iter().sum::<f64>() > 0.2, "{level:?}");
}

/// Nothing leaves a closed mesh: a check of the oracle and of the family at once.
#[test]
fn no_ray_leaves_a_closed_mesh() {
    let family = Family::by_name("closed-inside").expect("a family");
    for number in 0..12 {
        let case = family.case(11, number);
        let oracle = Oracle::new(&case.scenery.model);
        for Shot { ray, .. } in case.shots {
            assert!(oracle.closest(&ray, &Default::default()).hit.is_some(), "{ray:?}");
        }
    }
}
