//! Rays as a renderer has them, in scenes of ordinary size: how fast, and how often wrong.

use anyhow::Result;
use clap::Parser;
use raykern::{Hit, Layout, Ray};
use raykern_bench::rays::{Kind, Question, RayMaker};
use raykern_bench::scenes::{self, Loaded};
use raykern_bench::watch::Watch;

use crate::case::merged;
use crate::judge::{Judge, Tally, Truth};
use crate::methods::{self, Built, Method};
use crate::options::Options;
use crate::rows::{self, Judged, Run, SceneSize};
use crate::timing::{Job, in_turns, spread};

/// As these rays are called beside the stress families, one of which is "ordinary", in small scenes.
pub const FAMILY: &str = "scenes";
/// What is asked.
pub const KINDS: [Kind; 4] = [Kind::Primary, Kind::Diffuse, Kind::Random, Kind::Shadow];
/// Unless others are asked for: some generated, and some that must be at hand.
const SCENES: [&str; 5] = ["sphere", "hair", "architecture", "chinese_dragon", "sponza_part"];
/// As some of them are called, of which every answer is judged, whatever our exact methods say.
pub const SAMPLE: &str = "scenes, sample";
/// How many of a kind.
const JUDGED: usize = 2_000;
/// A method that is slow gets fewer rays judged.
const JUDGED_SECONDS: f64 = 1.0;

/// Measures every scene.
pub fn measure(options: &Options) -> Result<()> {
    let (mut judged, mut runs, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
    for (name, scene) in scenes(options) {
        eprintln!("  {name}");
        sizes.push(SceneSize { scene: name.clone(), triangles: scene.model.triangle_count() });
        let (some, timed) = measure_scene(&name, &scene, options)?;
        judged.extend(some);
        runs.extend(timed);
    }
    rows::write(options.data(), &sizes)?;
    rows::replace(options.data(), judged, |row: &Judged| {
        [FAMILY, SAMPLE].contains(&row.family.as_str())
    })?;
    rows::replace(options.data(), runs, |row: &Run| row.family == FAMILY)
}

/// The scenes asked for that can be had, by name.
pub fn scenes(options: &Options) -> Vec<(String, Loaded)> {
    let mut words = vec![String::new()];
    if options.quick {
        words.push("--quick".to_owned());
    }
    let wanted: Vec<&str> = match options.scenes.is_empty() {
        false => options.scenes.iter().map(String::as_str).collect(),
        true if options.quick => vec!["sphere", "architecture"],
        true => SCENES.to_vec(),
    };
    words.extend(wanted.iter().flat_map(|name| ["--scene".to_owned(), (*name).to_owned()]));
    let options = raykern_bench::options::Options::parse_from(words);
    let cases = scenes::cases(&options);
    let load = |case: &scenes::Case| match case.load(&options) {
        Ok(mut scene) => {
            scene.model = merged(&scene.model);
            Some((case.name.clone(), scene))
        }
        Err(reason) => {
            eprintln!("  {}: left out: {reason}", case.name);
            None
        }
    };
    cases.iter().filter_map(load).collect()
}

fn measure_scene(name: &str, scene: &Loaded, options: &Options) -> Result<(Vec<Judged>, Vec<Run>)> {
    let reference = raykern_bench::ours::bvh(&scene.model, Layout::Automatic)?;
    let accel = reference.accel();
    let maker = RayMaker::new(scene, &accel, options.ray_count());
    let mut built: Vec<(Method, Built)> = Vec::new();
    for method in methods::all() {
        match method.build(&scene.model) {
            Ok(structure) => built.push((method, structure)),
            Err(reason) => eprintln!("  {}: {reason}", method.name),
        }
    }
    let tracers: Vec<_> = built.iter().map(|(_, built)| built.tracer.as_ref()).collect();
    let judge = Judge::new(&scene.model);
    let (mut judged, mut runs) = (Vec::new(), Vec::new());
    for kind in KINDS {
        let rays = maker.make(kind);
        let job = Job {
            rays: &rays,
            any: kind.question() == Question::Any,
            coherent: kind.is_coherent(),
        };
        for timed in in_turns(&tracers, &job, options.run_count()) {
            runs.push(Run {
                family: FAMILY.to_owned(),
                scene: name.to_owned(),
                kind: kind.name().to_owned(),
                method: built[timed.method].0.name.to_owned(),
                run: timed.run,
                rays: timed.rays,
                seconds: timed.seconds,
            });
        }
        let presumed = |ray| Judge::presumed(accel.intersect(ray).unwrap_or(Hit::MISS));
        let truths: Vec<_> = rays.iter().map(presumed).collect();
        let sample = spread(&rays, JUDGED);
        let known: Vec<_> = sample.iter().map(|ray| judge.truth(ray)).collect();
        // Ours come last, when all who contradict have been heard.
        for (method, structure) in built.iter().rev() {
            let name_of = |family| [family, name, kind.name(), method.name];
            let tally = judge_answers(&judge, (&rays, &truths), method, structure, job.any);
            judged.push(Judged::new(name_of(FAMILY), &tally));
            let tally = judge_answers(&judge, (&sample, &known), method, structure, job.any);
            judged.push(Judged::new(name_of(SAMPLE), &tally));
        }
    }
    Ok((judged, runs))
}

fn judge_answers(
    judge: &Judge,
    (rays, truths): (&[Ray], &[Truth]),
    method: &Method,
    Built { tracer, .. }: &Built,
    any: bool,
) -> Tally {
    let (mut watch, mut tally) = (Watch::new(), Tally::default());
    let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    // In parts, until it has taken too long.
    for first in (0..rays.len()).step_by(100) {
        let part = first..(first + 100).min(rays.len());
        match any {
            true => tracer.any(&rays[part.clone()], &mut occluded[part.clone()], false, &mut watch),
            false => {
                tracer.closest(&rays[part.clone()], &mut hits[part.clone()], false, &mut watch)
            }
        }
        for i in part {
            match any {
                true => judge.judge_any(&mut tally, &rays[i], &truths[i], occluded[i]),
                false => judge.judge(&mut tally, &rays[i], &truths[i], &hits[i], method.names),
            }
        }
        let spent = watch.take();
        if spent.seconds * tally.asked as f64 / 100.0 > JUDGED_SECONDS {
            break;
        }
    }
    tally
}
