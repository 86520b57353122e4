//! Grid and BVH, through the C interface, against Embree on a million rays a scene; the oracle judges
//! each disagreement. Scenes that are not generated are skipped where they are not at hand.
//!
//! Needs Embree 3 and minutes, so it is asked for by name:
//! `cargo test -p raykern-harness --test compare_embree -- --ignored --nocapture`

#![cfg(unix)]
#![allow(missing_docs)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use raykern::{Hit, NONE, QueryOptions, Ray};
use raykern_harness::load::load;
use raykern_harness::model::Model;
use raykern_harness::oracle::{Judgement, Oracle, Place, Verdict};
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::map;
use raykern_harness::{make, shared_scenes};

/// The files of scenes.
const SHARED: [&str; 8] = [
    "metu/bunny.xml",
    "metu/monkey.xml",
    "metu/chinese_dragon.xml",
    "metu/scienceTree_glass.xml",
    "classic/sponza_part.obj",
    "classic/japanese_maple.obj",
    "classic/teapot_stadium.xml",
    "classic/samurai_monastry.obj",
];

/// The grid gets each ray but here, where each tests thousands of triangles: a regular grid puts the
/// dense object into a few cells.
const GRID_STRIDE: [(&str, usize); 4] = [
    ("dense_on_floor", 10),
    ("scienceTree_glass", 10),
    ("teapot_stadium", 10),
    ("samurai_monastry", 10),
];

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

fn run(command: &mut Command) {
    let status = command.status().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(status.success(), "{command:?}: {status}");
}

/// The program, against the header and the static library of raykern.
fn compiled(folder: &Path) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a folder within another");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(&root).env("CARGO_TARGET_DIR", target);
    run(cargo.args(["--locked", "build", "--release", "-p", "raykern-c"]));
    let host = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut build = cc::Build::new();
    build.target(&host).host(&host).opt_level(2).cargo_metadata(false).out_dir(folder);
    let program = folder.join("compare_embree");
    let mut compiler = build.get_compiler().to_command();
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"]).arg(root.join("include"));
    compiler.arg(root.join("c_tests/compare_embree.c")).arg(target.join("release/libraykern.a"));
    run(compiler.args(["-lembree3", "-lpthread", "-lm", "-ldl", "-o"]).arg(&program));
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

/// What the three answered to one ray.
struct Disagreement {
    ray: usize,
    grid: Option<Hit>,
    bvh: Option<Hit>,
    embree: Option<Hit>,
}

struct Traced {
    grid_rays: u32,
    /// Rays on which grid and BVH differ in any byte.
    differences: u32,
    disagreements: Vec<Disagreement>,
}

fn hit(words: &[u32]) -> Option<Hit> {
    let [t, u, v] = [0, 1, 2].map(|i| f32::from_bits(words[i]));
    let (prim, geometry, instance) = (words[3], words[4], words[5]);
    (geometry != NONE).then_some(Hit { t, u, v, prim, geometry, instance })
}

fn trace(program: &Path, folder: &Path, model: &Model, rays: &[Ray], stride: usize) -> Traced {
    let [scene, ray_file, output] = ["scene", "rays", "output"].map(|name| folder.join(name));
    fs::write(&scene, scene_bytes(model)).expect("the scene is written");
    fs::write(&ray_file, ray_bytes(rays)).expect("the rays are written");
    let mut command = Command::new(program);
    run(command.args([&scene, &ray_file]).arg(stride.to_string()).arg(&output));
    let bytes = fs::read(&output).expect("the output is there");
    let (words, _) = bytes.as_chunks::<4>();
    let words: Vec<u32> = words.iter().map(|word| u32::from_ne_bytes(*word)).collect();
    let (counts, records) = words.split_at(4);
    assert_eq!(counts[0] as usize, rays.len());
    assert_eq!(counts[1] as usize, rays.len().div_ceil(stride));
    assert_eq!(counts[3] as usize * 16, records.len());
    let record = |w: &[u32; 16]| Disagreement {
        ray: w[0] as usize,
        grid: hit(&w[1..7]),
        bvh: hit(&w[7..13]),
        // It gives no weights that could be compared.
        embree: hit(&[w[13], 0, 0, w[14], w[15], NONE]),
    };
    let disagreements = records.as_chunks().0.iter().map(record).collect();
    Traced { grid_rays: counts[1], differences: counts[2], disagreements }
}

#[derive(Default)]
struct Row {
    false_misses: usize,
    false_hits: usize,
    wrong_prims: usize,
    ties: usize,
    t_only: usize,
    ours_wrong: usize,
}

impl Row {
    fn add(&mut self, oracle: &Oracle, ray: &Ray, found: &Disagreement) {
        let options = QueryOptions::default();
        let verdict = oracle.closest(ray, &options);
        for hit in [found.grid, found.bvh] {
            let judgement = oracle.judge_by(&verdict, ray, &options, hit);
            if judgement != Judgement::Right {
                println!("ours {judgement:?}: {ray:?} {hit:?}");
                self.ours_wrong += 1;
            }
        }
        match oracle.judge_by(&verdict, ray, &options, found.embree) {
            Judgement::FalseMiss => self.false_misses += 1,
            Judgement::FalseHit => self.false_hits += 1,
            Judgement::WrongPrim if is_tie(&verdict, found.embree) => self.ties += 1,
            Judgement::WrongPrim => self.wrong_prims += 1,
            _ => self.t_only += 1,
        }
    }
}

fn is_tie(verdict: &Verdict, hit: Option<Hit>) -> bool {
    let place = hit.map(|hit| Place { geometry: hit.geometry, prim: hit.prim });
    place.is_some_and(|place| verdict.equal_t.contains(&place))
}

/// Each disagreement, judged.
fn judged(model: &Model, rays: &[Ray], found: &[Disagreement]) -> Row {
    let oracle = Oracle::new(model);
    let mut row = Row::default();
    found.iter().for_each(|one| row.add(&oracle, &rays[one.ray], one));
    row
}

/// The generated scenes with triangles, and those from files.
fn scenes() -> Vec<(String, Model)> {
    let made = make::ALL.iter().map(|(name, make)| (name.to_string(), make(100_000)));
    let mut scenes: Vec<_> = made.collect();
    match shared_scenes::folder(None) {
        None => println!("skipped: no folder of scenes (RAYKERN_SCENES)"),
        Some(folder) => scenes.extend(SHARED.map(|file| {
            let scene = load(&folder.join(file)).unwrap_or_else(|error| panic!("{error}"));
            let name = Path::new(file).file_stem().unwrap_or_default();
            (name.to_string_lossy().into_owned(), scene.model.flattened().expect("no ellipsoids"))
        })),
    }
    scenes.iter_mut().for_each(|(_, model)| model.sphere_sets.clear());
    scenes.retain(|(_, model)| model.triangle_count() > 0);
    scenes
}

#[test]
#[ignore = "needs Embree 3, and minutes"]
fn every_disagreement_with_embree_is_embrees() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compare_embree");
    fs::create_dir_all(&folder).expect("a folder for files");
    let program = compiled(&folder);
    println!(
        "scene                 rays     grid  disagree   f.miss    f.hit     prim |  ties   t only \
         | ours wrong  grid != bvh    trace s  judge s"
    );
    let counts = map(scenes(), |(name, model)| {
        let folder = folder.join(&name);
        fs::create_dir_all(&folder).expect("a folder for files");
        let stride = GRID_STRIDE.iter().find(|(slow, _)| *slow == name).map_or(1, |slow| slow.1);
        let rays = rays(&model);
        let started = Instant::now();
        let traced = trace(&program, &folder, &model, &rays, stride);
        let tracing = started.elapsed().as_secs_f64();
        let row = judged(&model, &rays, &traced.disagreements);
        println!(
            "{name:17} {:8} {:8} {:9} {:8} {:8} {:8} {:7} {:8} {:12} {:12} {tracing:10.1} {:8.1}",
            rays.len(),
            traced.grid_rays,
            traced.disagreements.len(),
            row.false_misses,
            row.false_hits,
            row.wrong_prims,
            row.ties,
            row.t_only,
            row.ours_wrong,
            traced.differences,
            started.elapsed().as_secs_f64() - tracing
        );
        fs::remove_dir_all(&folder).expect("the folder is removed");
        (row.ours_wrong, traced.differences)
    });
    fs::remove_dir_all(&folder).expect("the folder is removed");
    assert!(counts.iter().all(|found| *found == (0, 0)), "ours wrong, grid != bvh");
}
