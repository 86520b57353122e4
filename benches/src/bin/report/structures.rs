//! What each structure of ours costs: memory, build and rays, over scenes and over soups of a few triangles.

use std::collections::BTreeSet;
use std::rc::Rc;

use anyhow::{Result, anyhow};
use raykern::{GridKind, Kind as Took, OwnedAccel, Quality, Ray};
use raykern_bench::lineup::Tracer;
use raykern_bench::ours::Single;
use raykern_bench::rays::{Kind, Question, RayMaker};
use raykern_bench::watch::thread_seconds;
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker as Maker};

use crate::methods::Structure;
use crate::options::Options;
use crate::ordinary;
use crate::rows::{self, Build, Run};
use crate::timing::{Job, in_turns};

/// What these runs are called.
pub const COSTS: &str = "costs";
/// Likewise, over a few triangles.
pub const SIZES: &str = "sizes";
/// The two automatic choices: for many rays, and for so few that a plain grid may suit.
pub const AUTOMATIC: [&str; 2] = ["automatic", "automatic, 0.05 rays"];

/// Every structure by name.
pub const ALL: [(&str, Structure); 9] = [
    ("list", Structure::List),
    ("plain grid", Structure::Grid(GridKind::Uniform)),
    ("nested grid", Structure::Grid(GridKind::Nested)),
    ("binary BVH", Structure::Binary),
    ("BVH fast", Structure::Wide(Quality::Fast)),
    ("BVH", Structure::Wide(Quality::Balanced)),
    ("BVH best", Structure::Wide(Quality::Best)),
    (AUTOMATIC[0], Structure::Automatic(0.0)),
    (AUTOMATIC[1], Structure::Automatic(0.05)),
];

/// A build that takes longer is not repeated as often.
const LONG: f64 = 0.5;
const SIZE_STEPS: [usize; 17] =
    [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128, 256, 1024, 4096, 16_384];

/// What was learnt about some structures over one model.
#[derive(Default)]
pub struct Measured {
    pub builds: Vec<Build>,
    pub runs: Vec<Run>,
}

/// Measures every structure over every scene.
pub fn measure_scenes(options: &Options) -> Result<()> {
    let mut measured = Measured::default();
    for (name, scene) in ordinary::scenes(options) {
        eprintln!("  {name}");
        let built = build_all([COSTS, &name], &scene.model, &ALL, options, &mut measured)?;
        let reference = raykern_bench::ours::bvh(&scene.model, raykern::Layout::Automatic)?;
        let accel = reference.accel();
        let maker = RayMaker::new(&scene, &accel, options.ray_count().min(20_000));
        for kind in ordinary::KINDS {
            let rays = maker.make(kind);
            let any = kind.question() == Question::Any;
            let job = Job { rays: &rays, any, coherent: kind.is_coherent() };
            time([COSTS, &name, kind.name()], &built, &job, options, &mut measured);
        }
    }
    measured.replace(options, COSTS)
}

/// Measures every structure over a few triangles.
pub fn measure_sizes(options: &Options) -> Result<()> {
    let mut measured = Measured::default();
    let most = if options.quick { 64 } else { usize::MAX };
    for count in SIZE_STEPS.into_iter().filter(|count| *count <= most) {
        let model: Model = make::soup(count, 1).into();
        let name = count.to_string();
        let built = build_all([SIZES, &name], &model, &ALL, options, &mut measured)?;
        let rays = random_rays(&model, 2_000);
        let job = Job { rays: &rays, any: false, coherent: false };
        time([SIZES, &name, Kind::Random.name()], &built, &job, options, &mut measured);
    }
    measured.replace(options, SIZES)
}

impl Measured {
    /// Puts these in the place of what was measured before under the name, over the same scenes.
    pub fn replace(self, options: &Options, family: &str) -> Result<()> {
        let scenes: BTreeSet<String> = self.runs.iter().map(|run| run.scene.clone()).collect();
        let old = |of: &str, scene: &str| of == family && scenes.contains(scene);
        rows::replace(options.data(), self.builds, |row: &Build| old(&row.family, &row.scene))?;
        rows::replace(options.data(), self.runs, |row: &Run| old(&row.family, &row.scene))
    }
}

/// Through the box of a model, from around it.
pub fn random_rays(model: &Model, count: usize) -> Vec<Ray> {
    Maker::new(model, 5).many(Family::Random, count)
}

/// A structure, ready to be asked.
pub struct Ready {
    pub name: &'static str,
    pub tracer: Rc<dyn Tracer>,
}

/// Builds each structure some times, in turns.
pub fn build_all(
    [family, scene]: [&str; 2],
    model: &Model,
    structures: &[(&'static str, Structure)],
    options: &Options,
    measured: &mut Measured,
) -> Result<Vec<Ready>> {
    let mut kept: Vec<Option<OwnedAccel>> = structures.iter().map(|_| None).collect();
    let mut slowest: f64 = 0.0;
    for run in 0..options.run_count() {
        if run > 0 && slowest > LONG || run > 2 && slowest > LONG / 10.0 {
            break;
        }
        for (kept, (name, structure)) in kept.iter_mut().zip(structures) {
            // Given back first, so that memory is not twice what is needed.
            *kept = None;
            let begun = thread_seconds();
            let built = structure.build(model);
            let seconds = thread_seconds() - begun;
            slowest = slowest.max(seconds);
            let accel = built.map_err(|error| anyhow!("{name}: {error}"))?;
            measured.builds.push(Build {
                family: family.to_owned(),
                scene: scene.to_owned(),
                method: (*name).to_owned(),
                count: model.triangle_count(),
                run,
                seconds,
                bytes: accel.accel().block().len(),
                took: took(&accel),
            });
            *kept = Some(accel);
        }
    }
    let ready = |(accel, (name, _)): (Option<OwnedAccel<'static>>, &(&'static str, Structure))| {
        let single = Single::new(&Rc::new(accel?), raykern::Precision::Exact);
        Some(Ready { name, tracer: Rc::new(single) })
    };
    Ok(kept.into_iter().zip(structures).filter_map(ready).collect())
}

fn took(accel: &OwnedAccel) -> String {
    match accel.accel().info().kind {
        Took::List => "list",
        Took::Grid => "grid",
        Took::Bvh => "BVH",
    }
    .to_owned()
}

/// Times all that is ready.
pub fn time(
    [family, scene, kind]: [&str; 3],
    ready: &[Ready],
    job: &Job,
    options: &Options,
    measured: &mut Measured,
) {
    let tracers: Vec<_> = ready.iter().map(|ready| ready.tracer.as_ref()).collect();
    for timed in in_turns(&tracers, job, options.run_count()) {
        measured.runs.push(Run {
            family: family.to_owned(),
            scene: scene.to_owned(),
            kind: kind.to_owned(),
            method: ready[timed.method].name.to_owned(),
            run: timed.run,
            rays: timed.rays,
            seconds: timed.seconds,
        });
    }
}
