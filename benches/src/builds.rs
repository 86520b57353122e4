//! Builds by several threads: how much sooner they are done, and what more threads would make of them.

use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, Result};
use raykern::{BuildOptions, OwnedAccel, Quality, Rayon, Threads};
use raykern_harness::model::Model;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::options::Options;
use crate::scenes;
use crate::watch::median;

/// So many builds of each kind are timed, unless the command line says otherwise.
const ROUNDS: usize = 5;
/// For so many threads it is worked out how long a build would take.
const IMAGINED: [usize; 3] = [4, 8, 16];

/// Something that is built.
pub struct Builder {
    pub name: String,
    pub build: Build,
    /// What it is, if it is ours: then more threads can be imagined.
    pub ours: Option<Way>,
}

/// The seconds that a build takes by so many threads; `None` when it fails.
pub type Build = Box<dyn Fn(&Model, usize) -> Option<f64>>;

/// What is built of ours.
#[derive(Clone, Copy)]
pub enum Way {
    Bvh(Quality),
    Grid,
}

/// Measures the scenes that are asked for.
pub fn run(options: &Options) -> Result<()> {
    let threads = options.thread_count();
    println!("BUILDS: nanoseconds a triangle of wall time, by one thread and by {threads}.");
    println!("For {IMAGINED:?} threads worked out from the time of each task.\n");
    let builders = ours(threads)?.into_iter();
    #[cfg(feature = "embree")]
    let builders = builders.chain(crate::embree::builders(options));
    let builders: Vec<_> = builders.collect();
    for case in scenes::cases(options).iter().filter(|case| !case.fixed_cost) {
        match case.load(options) {
            Ok(scene) => measure(&builders, &scene.model, (&case.name, threads), options)
                .with_context(|| case.name.clone())?,
            Err(reason) => println!("{}: skipped: {reason}\n", case.name),
        }
    }
    Ok(())
}

fn measure(
    builders: &[Builder],
    model: &Model,
    (name, threads): (&str, usize),
    options: &Options,
) -> Result<()> {
    let triangles = model.triangle_count();
    let mut seconds = vec![[Vec::new(), Vec::new()]; builders.len()];
    for _ in 0..options.runs.unwrap_or(ROUNDS) {
        for (builder, seconds) in builders.iter().zip(&mut seconds) {
            for (count, seconds) in [1, threads].into_iter().zip(seconds) {
                // The first one wakes the threads up, and brings them to cores of their own.
                let [_, took] = [(); 2].map(|()| (builder.build)(model, count));
                seconds.push(took.context("a build failed")?);
            }
        }
    }
    println!("{name}: {triangles} triangles");
    let [a, b, c] = IMAGINED;
    println!("  {:<24}{:>8}{threads:>8}{:>9}{a:>12}{b:>8}{c:>8}", "", 1, "times");
    for (builder, seconds) in builders.iter().zip(&seconds) {
        let each = |seconds: f64| 1e9 * seconds / triangles as f64;
        let [one, several] = seconds.each_ref().map(|seconds| each(median(seconds)));
        print!("  {:<24}{one:>8.1}{several:>8.1}{:>9.2}", builder.name, one / several);
        if let Some(way) = builder.ours {
            let [a, b, c] = imagine(model, way).map(each);
            print!("{a:>12.1}{b:>8.1}{c:>8.1}");
        }
        println!();
    }
    println!();
    Ok(())
}

/// Ours, by rayon's threads.
fn ours(threads: usize) -> Result<Vec<Builder>> {
    let pools: Result<Vec<_>, _> =
        [1, threads].map(|n| ThreadPoolBuilder::new().num_threads(n).build()).into_iter().collect();
    let pools: &'static [ThreadPool] = Vec::leak(pools?);
    let builder = |(name, way): (&str, Way)| Builder {
        name: name.to_string(),
        build: Box::new(move |model, count| {
            let pool = &pools[usize::from(count > 1)];
            Some(pool.install(|| build(model, way, &Rayon)))
        }),
        ours: Some(way),
    };
    let ways = [
        ("bvh", Way::Bvh(Quality::Balanced)),
        ("bvh-fast", Way::Bvh(Quality::Fast)),
        ("bvh-best", Way::Bvh(Quality::Best)),
        ("grid", Way::Grid),
    ];
    Ok(ways.map(builder).into())
}

/// The seconds of a build.
fn build(model: &Model, way: Way, threads: &dyn Threads) -> f64 {
    let options = BuildOptions { threads: Some(threads), ..BuildOptions::default() };
    let started = Instant::now();
    let built = model.with_scene(|scene| match way {
        Way::Bvh(quality) => OwnedAccel::bvh(scene, &BuildOptions { quality, ..options }),
        Way::Grid => OwnedAccel::grid(scene, &options),
    });
    let seconds = started.elapsed().as_secs_f64();
    drop(built.expect("a structure"));
    seconds
}

/// The seconds that a build would take by many threads, if none of these were in another's way: what is not shared out, and of each
/// group of tasks the longest that one of the threads has.
fn imagine(model: &Model, way: Way) -> [f64; IMAGINED.len()] {
    let once = |count| {
        let tasks = Imagined { count, saved: Mutex::new(0.0) };
        let whole = build(model, way, &tasks);
        whole - tasks.saved.into_inner().expect("nobody panicked")
    };
    IMAGINED.map(|count| median(&[(); 3].map(|()| once(count))))
}

/// Threads that are but one, and tell how much less so many would need.
struct Imagined {
    count: usize,
    saved: Mutex<f64>,
}

impl Threads for Imagined {
    fn worker_count(&self) -> usize {
        self.count
    }

    fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        let mut busy = vec![0.0f64; self.count];
        let mut whole = 0.0;
        for i in 0..count {
            let started = Instant::now();
            task(i);
            let seconds = started.elapsed().as_secs_f64();
            whole += seconds;
            // The thread that is done first takes it.
            if let Some(least) = busy.iter_mut().min_by(|a, b| a.total_cmp(b)) {
                *least += seconds;
            }
        }
        let longest = busy.into_iter().fold(0.0, f64::max);
        *self.saved.lock().expect("nobody panicked") += whole - longest;
    }
}
