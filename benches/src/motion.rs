//! Scenes that move: what a frame costs by refitting and by building anew, and what rays cost after it.

use std::mem::MaybeUninit;

use anyhow::{Context, Result, ensure};
use raykern::{
    Accel, BuildError, BuildOptions, GridKind, GridOptions, Hit, Layout, OwnedAccel, Quality, Ray,
    Scene,
};
use raykern_harness::model::{Model, TriangleMesh};

use crate::options::Options;
use crate::ours::{self, each};
use crate::rays::{Kind, RayMaker};
use crate::scenes::{self, Case, Loaded};
use crate::watch::{Watch, median};

/// The scenes, unless others are named.
const SCENES: [&str; 5] = ["chinese_dragon", "sphere", "terrain", "hair", "architecture"];
/// Of so many frames the last one is the most disordered.
const FRAMES: usize = 6;

/// Something that follows a model.
pub trait Follower {
    /// The seconds of following it to where it is now, and of tracing the rays then.
    fn follow(&mut self, model: &Model, rays: &[Ray], hits: &mut [Hit]) -> [f64; 2];
}

/// Measures the scenes that are asked for.
pub fn run(options: &Options) -> Result<()> {
    println!("MOTION: milliseconds a frame, million diffuse rays a second after it.\n");
    for case in scenes::cases(options) {
        let wanted = options.names_scene(&case.name).unwrap_or(SCENES.contains(&&*case.name));
        if !wanted {
            continue;
        }
        match case.load(options) {
            Ok(scene) => measure(&case, scene, options).with_context(|| case.name.clone())?,
            Err(reason) => println!("{}: skipped: {reason}\n", case.name),
        }
    }
    Ok(())
}

/// One mesh, so that everyone has one object to follow.
fn joined(model: &Model) -> Model {
    let mut mesh = TriangleMesh::default();
    model.meshes.iter().for_each(|part| mesh.append(part));
    mesh.into()
}

fn measure(case: &Case, mut scene: Loaded, options: &Options) -> Result<()> {
    let still = joined(&scene.model);
    let mut followers = ours(&still)?;
    #[cfg(feature = "embree")]
    followers.extend(crate::embree::followers(&still, options));
    println!("{}: {} triangles", case.name, still.triangle_count());
    let mut seconds = vec![Vec::new(); followers.len()];
    let mut hits = vec![Hit::MISS; options.ray_count()];
    for frame in 1..=FRAMES {
        scene.model = moved(&still, frame as f64 / FRAMES as f64);
        let reference = ours::bvh(&scene.model, Layout::Automatic)?;
        let accel = reference.accel();
        let rays = RayMaker::new(&scene, &accel, options.ray_count()).make(Kind::Diffuse);
        let mut right = vec![Hit::MISS; rays.len()];
        accel.intersect_batch(&rays, &mut right);
        for ((name, follower), seconds) in followers.iter_mut().zip(&mut seconds) {
            seconds.push(follower.follow(&scene.model, &rays, &mut hits));
            let wrong = hits.iter().zip(&right).filter(|(a, b)| a.prim != b.prim).count();
            let allowed = if name.starts_with("ours") { 0 } else { rays.len() / 100 };
            ensure!(wrong <= allowed, "{name}: {wrong} of {} rays", rays.len());
        }
    }
    println!("  {:<28}{:>10}{:>14}{:>14}", "", "ms", "rays, first", "rays, last");
    for ((name, _), seconds) in followers.iter().zip(&seconds) {
        let updates: Vec<f64> = seconds.iter().map(|[update, _]| 1e3 * update).collect();
        let rays = |frame: usize| 1e-6 * options.ray_count() as f64 / seconds[frame][1];
        let (first, last) = (rays(0), rays(FRAMES - 1));
        println!("  {name:<28}{:>10.2}{first:>14.2}{last:>14.2}", median(&updates));
    }
    println!();
    Ok(())
}

/// The model twisted about a vertical axis and waved, by a part from 0 to 1 of a good deal.
fn moved(still: &Model, part: f64) -> Model {
    let vertices = || still.meshes[0].vertices.iter().map(|v| v.map(f64::from));
    let bound = |k: usize, pick: fn(f64, f64) -> f64| vertices().map(|v| v[k]).reduce(pick);
    let [lower, upper] = [f64::min as fn(f64, f64) -> f64, f64::max]
        .map(|pick| [0, 1, 2].map(|k| bound(k, pick).unwrap_or(0.0)));
    let middle = [0, 1, 2].map(|k| 0.5 * (lower[k] + upper[k]));
    let size = (0..3).map(|k| upper[k] - lower[k]).fold(0.0, f64::max);
    let map = |p: [f64; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| (p[k] - middle[k]) / size);
        let (sine, cosine) = (2.0 * part * z).sin_cos();
        let wave = 0.05 * part * (10.0 * x + 7.0 * y + 6.0 * part).sin();
        let turned = [cosine * x - sine * y, sine * x + cosine * y, z + wave];
        [0, 1, 2].map(|k| middle[k] + size * turned[k])
    };
    still.meshes[0].clone().mapped(map).into()
}

/// Ours: refitted, or built anew with whatever memory that takes.
fn ours(still: &Model) -> Result<Vec<(String, Box<dyn Follower>)>> {
    let mut followers: Vec<(String, Box<dyn Follower>)> = Vec::new();
    for (name, quality) in [("ours refit", Quality::Balanced), ("ours refit, fast", Quality::Fast)]
    {
        let options = BuildOptions { refit: true, quality, ..BuildOptions::default() };
        let built = still.with_scene(|scene| OwnedAccel::bvh(scene, &options))?;
        followers.push((name.to_string(), Box::new(Refitted(built))));
    }
    let with = |quality, kind| {
        let grid = GridOptions { kind, ..GridOptions::default() };
        BuildOptions { quality, grid, ..BuildOptions::default() }
    };
    let anew: [(&str, Build, BuildOptions); 3] = [
        ("ours bvh, fast", OwnedAccel::bvh, with(Quality::Fast, GridKind::Nested)),
        ("ours grid", OwnedAccel::grid, with(Quality::Fast, GridKind::Nested)),
        ("ours grid, uniform", OwnedAccel::grid, with(Quality::Fast, GridKind::Uniform)),
    ];
    for (name, kind) in [("nested", GridKind::Nested), ("uniform", GridKind::Uniform)] {
        let again = Again::new(still, with(Quality::Fast, kind))?;
        followers.push((format!("ours grid, {name}, in place"), Box::new(again)));
    }
    let anew = anew.map(|(name, build, options)| (name.to_string(), Anew { build, options }));
    followers.extend(anew.map(|(name, anew)| (name, Box::new(anew) as Box<dyn Follower>)));
    Ok(followers)
}

struct Refitted(OwnedAccel<'static>);

impl Follower for Refitted {
    fn follow(&mut self, model: &Model, rays: &[Ray], hits: &mut [Hit]) -> [f64; 2] {
        let mut watch = Watch::new();
        model.with_scene(|scene| {
            watch.time(|| self.0.refit(scene, None)).expect("the same mesh");
        });
        let update = watch.take().seconds;
        [update, trace(&self.0.accel(), rays, hits)]
    }
}

type Build = fn(&Scene<'_, 'static>, &BuildOptions) -> Result<OwnedAccel<'static>, BuildError>;

struct Anew {
    build: Build,
    options: BuildOptions<'static>,
}

impl Follower for Anew {
    fn follow(&mut self, model: &Model, rays: &[Ray], hits: &mut [Hit]) -> [f64; 2] {
        let mut watch = Watch::new();
        let built = model.with_scene(|scene| watch.time(|| (self.build)(scene, &self.options)));
        let update = watch.take().seconds;
        [update, trace(&built.expect("a structure").accel(), rays, hits)]
    }
}

/// A grid that is built anew in the same memory, which is what it wants for a still scene and a quarter more.
struct Again {
    memory: Vec<MaybeUninit<u8>>,
    /// Where the block begins, aligned as it must be.
    start: usize,
    options: BuildOptions<'static>,
}

impl Again {
    fn new(still: &Model, options: BuildOptions<'static>) -> Result<Self> {
        let needs = still.with_scene(|scene| raykern::grid_needs(scene, &options))?;
        let size = needs.size / 4 * 5 + needs.alignment;
        let memory = vec![MaybeUninit::new(0); size];
        Ok(Again { start: memory.as_ptr().align_offset(needs.alignment), memory, options })
    }
}

impl Follower for Again {
    fn follow(&mut self, model: &Model, rays: &[Ray], hits: &mut [Hit]) -> [f64; 2] {
        let Again { memory, start, options } = self;
        let mut watch = Watch::new();
        model.with_scene(|scene| {
            let built = watch.time(|| raykern::build_grid(scene, options, &mut memory[*start..]));
            let update = watch.take().seconds;
            [update, trace(&built.expect("enough memory"), rays, hits)]
        })
    }
}

/// The seconds that the rays take.
fn trace(accel: &Accel, rays: &[Ray], hits: &mut [Hit]) -> f64 {
    let mut watch = Watch::new();
    watch.time(|| each(rays, hits, |ray| accel.intersect(ray).unwrap_or(Hit::MISS)));
    watch.take().seconds
}
