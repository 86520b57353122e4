//! What fuzzing found, as scenes and damaged blocks; `fuzz/README.md` says how to add one.
//!
//! Cases are checked by the same code that found them: list, grid and BVH agree, the oracle agrees,
//! the watertight mode misses nothing, and damaged blocks are refused or harmless.

#![allow(missing_docs)]

#[path = "../fuzz/src/aim.rs"]
mod aim;
#[path = "../fuzz/src/case.rs"]
mod case;
#[path = "../fuzz/src/damage.rs"]
mod damage;
#[path = "../fuzz/src/scenes.rs"]
mod scenes;

use aim::Aim;
use case::{Case, Subject};
use damage::{Damage, originals};
use raykern::{Facing, NONE, Precision, PrimId, QueryOptions, Ray};
use raykern_harness::make::Random;
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::rays::{Family, RayMaker};

const DEFAULT: QueryOptions =
    QueryOptions { precision: Precision::Exact, mask: 0, facing: Facing::Both, skip: None };

/// A tiny sphere whose centre is far away: the hit point in `f64` is the centre itself.
fn sphere_of_1e_39_at_1e7() -> Case {
    Case {
        model: Model {
            meshes: vec![],
            sphere_sets: vec![vec![[-6815744.0, 2.03e-43, 2.938736e-39, 2.938736e-39]]],
        },
        masks: vec![0],
        questions: vec![(
            Ray::new([-6815744.0, 2.03e-43, 2.938736e-39], [6815744.0, -2.03e-43, -2.938736e-39]),
            DEFAULT,
        )],
    }
}

/// An ordinary sphere, met from so far away that the hit point in `f64` is its centre.
fn sphere_of_1_from_1e36() -> Case {
    let far = 7.892291e35;
    Case {
        model: Model { meshes: vec![], sphere_sets: vec![vec![[0.0, 0.0, 0.0, 1.0]]] },
        masks: vec![0],
        questions: vec![(Ray::new([-far; 3], [far / 2.0; 3]), DEFAULT)],
    }
}

/// Two of three vertices so close, seen from the first, that both edges round to the same in `f64`.
fn edges_that_round_to_the_same() -> Case {
    let mesh = TriangleMesh {
        vertices: vec![[-1.4851396e29; 3], [6.9830928e-9, -8.0, -8.0], [0.0; 3]],
        indices: vec![[0, 1, 2]],
    };
    Case {
        model: mesh.into(),
        masks: vec![0],
        questions: vec![(Ray::new([-1.0, -3.0, 3.0], [0.0, 0.0, -1.0]), DEFAULT)],
    }
}

/// The watertight mode took the rounded area's sign for the side, and left out a front as a back.
fn fronts_that_round_to_backs() -> [Case; 2] {
    let front = QueryOptions { facing: Facing::Front, ..DEFAULT };
    let of = |vertices: Vec<[f32; 3]>, ray: Ray| Case {
        model: TriangleMesh { vertices, indices: vec![[0, 1, 2]] }.into(),
        masks: vec![0],
        questions: vec![(ray, front), (ray, QueryOptions { facing: Facing::Back, ..DEFAULT })],
    };
    let from = [7.061524e35, -3.32307e35, 7.892291e35];
    [
        of(vec![[0.0; 3], [0.0, 3.0, 0.0], [3.0, 0.0, 0.0]], Ray::new(from.map(|x| -x), from)),
        of(
            vec![[1e-45, 3e-45, 4e-45], [0.0, 3e-45, 6e-45], [0.0; 3]],
            Ray::new([0.0; 3], [8e-45, 3.8176e-41, 1e-45]),
        ),
    ]
}

/// Two roots of a sphere that round to one: the watertight mode took the sphere for touched and left out
/// both when one was to be skipped.
fn roots_that_round_to_one() -> [Case; 2] {
    let skip =
        |prim| QueryOptions { skip: Some(PrimId { prim, geometry: 0, instance: NONE }), ..DEFAULT };
    let of = |spheres: Vec<[f32; 4]>, ray: Ray, options| Case {
        model: Model { meshes: vec![], sphere_sets: vec![spheres] },
        masks: vec![0],
        questions: vec![(ray, options)],
    };
    let far = [4.0, 15649651.0, -6973005300.0];
    let beyond = Ray::new([7.0533445e-30, 4.0, 4.0], far).with_limits(1.0, f32::INFINITY);
    let along = Ray::new([1.0, 1.0, 2.0], [0.0, -6.4986845e35, -4.814825e-34]);
    [
        of(vec![[4.0, 15649655.0, -6973005300.0, 3.0]], beyond, skip(0)),
        of(vec![[1.0, 1.0, 0.0, 2.0]], along, QueryOptions { facing: Facing::Back, ..skip(0) }),
    ]
}

/// A scene, and the normal that its first question must find, roughly.
fn normals() -> [(&'static str, Case, [f64; 3]); 3] {
    let third = 3f64.sqrt().recip();
    let half = 2f64.sqrt().recip();
    [
        ("tiny", sphere_of_1e_39_at_1e7(), [1.0, 0.0, 0.0]),
        ("far", sphere_of_1_from_1e36(), [-third; 3]),
        ("edges", edges_that_round_to_the_same(), [0.0, -half, half]),
    ]
}

fn scenes_found() -> Vec<(&'static str, Case)> {
    let normals = normals().into_iter().map(|(name, case, _)| (name, case));
    let fronts = fronts_that_round_to_backs().into_iter().map(|case| ("fronts", case));
    let roots = roots_that_round_to_one().into_iter().map(|case| ("roots", case));
    normals.chain(fronts).chain(roots).collect()
}

fn blocks_found() -> Vec<(&'static str, Damage)> {
    vec![]
}

#[test]
fn scenes_that_were_found() {
    for (name, case) in scenes_found() {
        println!("{name}");
        case.check();
    }
}

/// Damage as a fuzzer may begin with it: words and records in wrong places.
#[test]
fn blocks_that_are_damaged_at_random() {
    const RECORDS: [usize; 8] = [4, 16, 32, 64, 112, 224, 256, 448];
    let originals = originals();
    let mut random = Random::new(3);
    let rays = vec![Ray::new([0.3, 0.4, 5.0], [-0.0, 0.0, -1.0]), Ray::new([0.1; 3], [1.0; 3])];
    let mut accepted = 0;
    for i in 0..4_000 {
        let mut damage = Damage { original: i, rays: rays.clone(), ..Damage::default() };
        for _ in 0..random.below(3) {
            let reach = if random.below(3) == 0 { 64 } else { 1 << 14 };
            let at = 4 * random.below(reach);
            let word = match random.below(4) {
                0 => random.below(8) as u32,
                1 => f32::NAN.to_bits(),
                2 => u32::MAX,
                _ => random.bits() as u32 >> random.below(32),
            };
            damage.words.push((at, word));
        }
        for _ in 0..random.below(3) {
            let size = RECORDS[random.below(RECORDS.len())];
            let mut place = || size.min(64) * random.below(1 << 14);
            damage.copies.push([place(), place(), size]);
        }
        accepted += usize::from(damage.check(&originals));
    }
    assert!((400..3_600).contains(&accepted), "{accepted} of 4000 were accepted");
}

/// What belongs to instances and to refitting.
#[test]
fn blocks_that_are_damaged_where_it_hurts() {
    let originals = originals();
    let mut random = Random::new(5);
    let rays = vec![
        Ray::new([0.3, 0.4, 5.0], [-0.0, 0.0, -1.0]),
        Ray::new([-9.0, 0.2, 0.3], [1.0, 0.0, 0.01]),
    ];
    let (mut accepted, mut refused) = ([0; 6], [0; 6]);
    for original in 0..12_000 {
        let part = random.below(6);
        let word = match random.below(5) {
            0 => random.below(8) as u32,
            1 => [f32::NAN, f32::INFINITY, -f32::MAX, 1e-45][random.below(4)].to_bits(),
            2 => u32::MAX - random.below(2) as u32,
            3 => 1 << random.below(32),
            _ => (random.between(-2.0, 2.0) as f32).to_bits(),
        };
        let aimed = vec![(Aim { part, word: random.below(1 << 12) }, word)];
        let damage = Damage { original, aimed, rays: rays.clone(), ..Damage::default() };
        let counts = if damage.check(&originals) { &mut accepted } else { &mut refused };
        counts[part] += 1;
    }
    println!("{accepted:?} accepted, {refused:?} refused");
    assert!(accepted.iter().chain(&refused).all(|count| *count > 20), "{accepted:?} {refused:?}");
}

#[test]
fn blocks_that_were_found() {
    let originals = originals();
    for (name, damage) in blocks_found() {
        println!("{name}");
        damage.check(&originals);
    }
}

/// Words that are damaged at random: a short run without a fuzzer.
#[test]
fn blocks_full_of_trouble() {
    const ODD: [u32; 6] = [0, 1, u32::MAX, 0x7f80_0000, 0x7fc0_0000, 0x8000_0000];
    let (originals, mut random, mut accepted) = (originals(), Random::new(1), 0);
    let model = Model { meshes: vec![], sphere_sets: vec![vec![[0.5, 0.5, 0.5, 0.8]]] };
    for original in 0..3_000 {
        let mut word = || match random.below(3) {
            0 => ODD[random.below(ODD.len())],
            1 => (random.between(-2.0, 2.0) as f32).to_bits(),
            _ => random.bits() as u32 >> random.below(32),
        };
        // Most of what is accepted has its damage behind the header.
        let words: Vec<_> = (0..2).map(|_| (word() as usize / 4 * 4, word())).collect();
        let rays = RayMaker::new(&model, original as u64).many(Family::Random, 2);
        let damage = Damage { original, words, rays, ..Damage::default() };
        accepted += usize::from(damage.check(&originals));
    }
    assert!(accepted > 1_000, "{accepted}");
}

/// Normals are right for edges of 1e-44 to 1e37, says the header.
#[test]
fn normals_that_were_found() {
    for (name, case, expected) in normals() {
        let subject = Subject::build(&case.model, &case.masks);
        for (structure, accel) in subject.open() {
            let (ray, options) = &case.questions[0];
            let hit = accel.intersect_with(ray, options).expect("a hit");
            let surface = accel.surface(ray, &hit).expect("its surface");
            for (is, should) in surface.normal.into_iter().zip(expected) {
                assert!((f64::from(is) - should).abs() < 1e-5, "{name} {structure}: {surface:?}");
            }
        }
    }
}

/// The scenes of the target `ray` under the families of the harness: a short run without a fuzzer.
#[test]
fn scenes_full_of_trouble() {
    for (name, model) in scenes::all() {
        println!("{name}");
        let mut maker = RayMaker::new(&model, 1);
        let mut questions = Vec::new();
        for family in Family::ORDINARY.into_iter().chain(Family::HOSTILE) {
            questions.extend(maker.many(family, 20).into_iter().map(|ray| (ray, DEFAULT)));
        }
        let skip = Some(PrimId { prim: 0, geometry: 0, instance: NONE });
        let ray = Ray::new([0.5, 0.5, 9.0], [0.0, 0.0, -1.0]);
        questions.push((ray, QueryOptions { facing: Facing::Front, skip, mask: 1, ..DEFAULT }));
        Case { model, masks: vec![1, 2], questions }.check();
    }
}

/// A case is printed as the source it was made of.
#[test]
fn cases_print_as_source() {
    let case = sphere_of_1e_39_at_1e7();
    let text = case.to_string();
    assert!(text.contains("[-6815744.0, 2.03e-43, 2.938736e-39, 2.938736e-39]"), "{text}");
    assert!(text.contains(".with_limits(0.0, f32::INFINITY)"), "{text}");
    let damage = Damage { words: vec![(4, 7)], ..Damage::default() };
    assert!(damage.to_string().contains("words: vec![(4, 7)]"), "{damage}");
}
