//! Grid and BVH against Embree on a million rays a scene; the oracle judges each disagreement.
//!
//! Needs Embree 3, so it stands behind the feature `embree`:
//! `cargo test --release -p raykern-harness --features embree --test compare_embree -- --nocapture`

#![cfg(feature = "embree")]
#![allow(missing_docs)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use raykern::{BuildOptions, Hit, NONE, OwnedAccel, QueryOptions, Ray};
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::oracle::{Judgement, Oracle, ulps_apart};
use raykern_harness::rays::{Family, RayMaker};

/// Two right primitives with `t` this close count as agreement.
const ULPS: u64 = 64;

const RAYS: usize = 1_000_000;

/// Mixed rays: one in fifty is aimed at a vertex or an edge.
fn rays(model: &Model) -> Vec<Ray> {
    let share = |family, share: usize| (family, RAYS * share / 100);
    let shares = [
        share(Family::Primary, 34),
        share(Family::Random, 32),
        share(Family::Bounce, 32),
        share(Family::AtVertex, 1),
        share(Family::AtEdge, 1),
    ];
    let mut maker = RayMaker::new(model, 11);
    shares.into_iter().flat_map(|(family, count)| maker.many(family, count)).collect()
}

fn compiled(folder: &Path) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let program = folder.join("compare_embree");
    let mut compiler = Command::new(std::env::var_os("CC").unwrap_or("cc".into()));
    let source = root.join("c_tests/compare_embree.c");
    compiler.args(["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror"]).arg(source);
    compiler.arg("-o").arg(&program).args(["-lembree3", "-lm"]);
    assert!(compiler.status().expect("a C compiler").success(), "the program does not compile");
    program
}

fn scene_bytes(model: &Model) -> Vec<u8> {
    let mut bytes = (model.meshes.len() as u32).to_ne_bytes().to_vec();
    for mesh in &model.meshes {
        for count in [mesh.vertices.len(), mesh.indices.len()] {
            bytes.extend((count as u32).to_ne_bytes());
        }
        bytes.extend(mesh.vertices.as_flattened().iter().flat_map(|x| x.to_ne_bytes()));
        bytes.extend(mesh.indices.as_flattened().iter().flat_map(|i| i.to_ne_bytes()));
    }
    bytes
}

fn ray_bytes(rays: &[Ray]) -> Vec<u8> {
    let words = |ray: &Ray| {
        let ([a, b, c], [d, e, f]) = (ray.origin, ray.direction);
        [a, b, c, ray.t_min, d, e, f, ray.t_max]
    };
    rays.iter().flat_map(words).flat_map(|x| x.to_ne_bytes()).collect()
}

/// What Embree hits; it gives no weights that could be compared.
fn embree(program: &Path, folder: &Path, model: &Model, rays: &[Ray]) -> Vec<Option<Hit>> {
    let [scene, ray_file, hits] = ["scene", "rays", "hits"].map(|name| folder.join(name));
    fs::write(&scene, scene_bytes(model)).expect("the scene is written");
    fs::write(&ray_file, ray_bytes(rays)).expect("the rays are written");
    let run = Command::new(program).args([&scene, &ray_file, &hits]).status();
    assert!(run.expect("the program starts").success(), "Embree failed");
    let bytes = fs::read(&hits).expect("the hits are there");
    assert_eq!(bytes.len(), 12 * rays.len());
    let (words, _) = bytes.as_chunks::<4>();
    let (answers, _) = words.as_chunks::<3>();
    let answer = |[t, prim, geometry]: &[[u8; 4]; 3]| {
        let (prim, geometry) = (u32::from_ne_bytes(*prim), u32::from_ne_bytes(*geometry));
        let t = f32::from_ne_bytes(*t);
        (geometry != NONE).then_some(Hit { t, u: 0.0, v: 0.0, prim, geometry, instance: NONE })
    };
    answers.iter().map(answer).collect()
}

fn agree(a: Option<Hit>, b: Option<Hit>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            (a.prim, a.geometry) == (b.prim, b.geometry) && ulps_apart(a.t, b.t) <= ULPS
        }
        _ => false,
    }
}

#[derive(Default)]
struct Row {
    disagreements: usize,
    false_misses: usize,
    false_hits: usize,
    wrong_prims: usize,
    ties: usize,
    t_only: usize,
    ours_wrong: usize,
}

fn compare(model: &Model, rays: &[Ray], theirs: &[Option<Hit>]) -> Row {
    let (oracle, options) = (Oracle::new(model), QueryOptions::default());
    let built = model.with_scene(|scene| {
        [OwnedAccel::grid, OwnedAccel::bvh].map(|build| build(scene, &BuildOptions::default()))
    });
    let built = built.map(|accel| accel.expect("it is built"));
    let accels = [built[0].accel(), built[1].accel()];
    let mut row = Row::default();
    for (ray, theirs) in rays.iter().zip(theirs) {
        let ours = accels.map(|accel| accel.intersect(ray));
        if ours.iter().all(|hit| agree(*hit, *theirs)) {
            continue;
        }
        row.disagreements += 1;
        let verdict = oracle.closest(ray, &options);
        for hit in ours {
            let judgement = oracle.judge_by(&verdict, ray, &options, hit);
            if judgement != Judgement::Right {
                println!("ours {judgement:?}: {ray:?} {hit:?}");
                row.ours_wrong += 1;
            }
        }
        match oracle.judge_by(&verdict, ray, &options, *theirs) {
            Judgement::FalseMiss => row.false_misses += 1,
            Judgement::FalseHit => row.false_hits += 1,
            Judgement::WrongPrim => {
                let tie = theirs.is_some_and(|hit| {
                    let same = |p: &raykern_harness::oracle::Place| {
                        (p.geometry, p.prim) == (hit.geometry, hit.prim)
                    };
                    verdict.equal_t.iter().any(same)
                });
                *(if tie { &mut row.ties } else { &mut row.wrong_prims }) += 1;
            }
            _ => row.t_only += 1,
        }
    }
    row
}

#[test]
fn every_disagreement_with_embree_is_embrees() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compare_embree");
    fs::create_dir_all(&folder).expect("a folder for files");
    let program = compiled(&folder);
    let mut wrong = 0;
    println!(
        "scene             rays  disagree   f.miss    f.hit     prim |  ties   t only | ours wrong"
    );
    for (name, make) in make::ALL {
        // A regular grid puts the dense object into a few cells and tests all of it.
        let triangles = if name == "dense_on_floor" { 2_000 } else { 100_000 };
        let mut model = make(triangles);
        if model.meshes.is_empty() {
            continue;
        }
        model.sphere_sets.clear();
        let rays = rays(&model);
        let theirs = embree(&program, &folder, &model, &rays);
        let row = compare(&model, &rays, &theirs);
        println!(
            "{name:14} {:8} {:9} {:8} {:8} {:8} {:7} {:8} {:10}",
            rays.len(),
            row.disagreements,
            row.false_misses,
            row.false_hits,
            row.wrong_prims,
            row.ties,
            row.t_only,
            row.ours_wrong
        );
        wrong += row.ours_wrong;
    }
    fs::remove_dir_all(&folder).expect("the folder is removed");
    assert_eq!(wrong, 0);
}
