//! A scene that moves: each frame refitted, built anew as a BVH, and built anew as a grid.
//!
//! ```text
//! cargo run --release --example animate
//! cargo run --release --example animate -- --triangles 1000000 --frames 20
//! ```
//!
//! For each frame and each way it prints the milliseconds to follow the scene and the speed of the rays that are
//! traced then, all on one thread; and for the refitted BVH how much more a ray costs than when it was built. All
//! ways must give the same answers, to the bit.

use std::time::Instant;

use anyhow::Result;
use clap::Parser;
use raykern::{BuildError, BuildOptions, Hit, OwnedAccel, Quality, Ray, Scene};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;

/// Refits and rebuilds over the frames of an animation: times, and ray speed after each.
#[derive(Debug, Parser)]
struct Options {
    /// About how many triangles
    #[arg(long, default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(100..=20_000_000))]
    triangles: u32,
    /// Frames
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Rays a frame
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    rays: u32,
}

/// From about here on a new tree pays.
const DISORDER: f32 = 2.0;

fn main() -> Result<()> {
    let options = Options::parse();
    let still = still(options.triangles as usize);
    let rays = rays(options.rays as usize);
    println!("{} triangles, {} rays a frame", still.triangle_count(), rays.len());
    println!("{:>5} {:^25} {:^19} {:^19}", "", "refit", "BVH, fast", "grid");
    println!(
        "frame {:>7} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9}",
        "ms", "Mrays/s", "cost", "ms", "Mrays/s", "ms", "Mrays/s"
    );
    let refit = BuildOptions { refit: true, ..BuildOptions::default() };
    let fast = BuildOptions { quality: Quality::Fast, ..BuildOptions::default() };
    let mut followed = still.with_scene(|scene| OwnedAccel::bvh(scene, &refit))?;
    for frame in 1..=options.frames {
        let model = moved(&still, f64::from(frame) / 10.0);
        let (growth, refitted) = timed(|| model.with_scene(|scene| followed.refit(scene, None)));
        let growth = growth?;
        let (expected, traced) = trace(&followed, &rays);
        print!("{frame:>5} {refitted:>7.2} {:>8.2} {growth:>8.2}", speed(&rays, traced));
        for build in [OwnedAccel::bvh as Build, OwnedAccel::grid as Build] {
            let (built, ms) = timed(|| model.with_scene(|scene| build(scene, &fast)));
            let (hits, traced) = trace(&built?, &rays);
            assert!(hits == expected, "frame {frame}: the answers differ");
            print!(" {ms:>9.2} {:>9.2}", speed(&rays, traced));
        }
        println!();
        if growth > DISORDER {
            followed = model.with_scene(|scene| OwnedAccel::bvh(scene, &refit))?;
            println!("      built anew, as rays had become dear");
        }
    }
    Ok(())
}

type Build = fn(&Scene<'_, 'static>, &BuildOptions) -> Result<OwnedAccel<'static>, BuildError>;

/// A sea, and a knot above it.
fn still(triangles: usize) -> Model {
    let mut model: Model = make::plane(triangles / 2).placed(4.0, [-2.0, -2.0, -1.0]).into();
    model.meshes.push(make::knot(triangles / 2));
    model
}

/// Waves on the sea; the knot is wrung.
fn moved(still: &Model, time: f64) -> Model {
    let wave = |[x, y, z]: [f64; 3]| {
        [x, y, z + 0.2 * (3.0 * x + 5.0 * time).sin() * (4.0 * y + 3.0 * time).cos()]
    };
    let wrung = |[x, y, z]: [f64; 3]| {
        let (sine, cosine) = (2.0 * time * z).sin_cos();
        [cosine * x - sine * y, sine * x + cosine * y, z]
    };
    let [sea, knot] = &still.meshes[..] else { unreachable!("two meshes were made") };
    Model {
        meshes: vec![sea.clone().mapped(wave), knot.clone().mapped(wrung)],
        sphere_sets: vec![],
    }
}

/// From above and around into the scene, in any direction.
fn rays(count: usize) -> Vec<Ray> {
    let mut random = Random::new(1);
    let mut point = |low: f64, high: f64| random.point(low, high).map(|x| x as f32);
    (0..count).map(|_| Ray::new(point(-2.0, 2.0), point(-1.0, 1.0))).collect()
}

/// The answers, as bits would compare, and the milliseconds.
fn trace(built: &OwnedAccel, rays: &[Ray]) -> (Vec<Hit>, f64) {
    let mut hits = vec![Hit::MISS; rays.len()];
    let ((), ms) = timed(|| built.accel().intersect_batch(rays, &mut hits));
    (hits, ms)
}

/// Million rays a second.
fn speed(rays: &[Ray], ms: f64) -> f64 {
    rays.len() as f64 / ms / 1e3
}

fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64() * 1e3)
}
