//! Rays as a renderer has them, in scenes of ordinary size: how fast, and how often wrong.

use std::collections::BTreeSet;

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
use crate::rows::{self, Build, Judged};
use crate::structures::{Measured, Ready, time};
use crate::timing::{Job, spread};

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
    let mut measured = Measured::default();
    let mut judged = Vec::new();
    for (name, scene) in scenes(options) {
        eprintln!("  {name}");
        judged.extend(measure_scene(&name, &scene, options, &mut measured)?);
    }
    let scenes: BTreeSet<String> = judged.iter().map(|row| row.scene.clone()).collect();
    let ours = |row: &Judged| [FAMILY, SAMPLE].contains(&row.family.as_str());
    rows::replace(options.data(), judged, |row| ours(row) && scenes.contains(&row.scene))?;
    measured.replace(options, FAMILY)
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

fn measure_scene(
    name: &str,
    scene: &Loaded,
    options: &Options,
    measured: &mut Measured,
) -> Result<Vec<Judged>> {
    let reference = raykern_bench::ours::bvh(&scene.model, Layout::Automatic)?;
    let accel = reference.accel();
    let maker = RayMaker::new(scene, &accel, options.ray_count());
    let built = build_all(name, scene, measured);
    let ready: Vec<Ready> = (built.iter())
        .map(|(method, built)| Ready { name: method.name, tracer: built.tracer.clone() })
        .collect();
    let judge = Judge::new(&scene.model);
    let mut judged = Vec::new();
    for kind in KINDS {
        let rays = maker.make(kind);
        let any = kind.question() == Question::Any;
        let job = Job { rays: &rays, any, coherent: kind.is_coherent() };
        time([FAMILY, name, kind.name()], &ready, &job, options, measured);
        let presumed = |ray| Judge::presumed(accel.intersect(ray).unwrap_or(Hit::MISS));
        let truths: Vec<_> = rays.iter().map(presumed).collect();
        let sample = spread(&rays, JUDGED);
        let known: Vec<_> = sample.iter().map(|ray| judge.truth(ray)).collect();
        // Ours come last, when all who contradict have been heard.
        for (method, built) in built.iter().rev() {
            for (family, rays, truths) in [(FAMILY, &rays, &truths), (SAMPLE, &sample, &known)] {
                let tally = judge_answers(&judge, (rays, truths), method, built, any);
                judged.push(Judged::new([family, name, kind.name(), method.name], &tally));
            }
        }
    }
    Ok(judged)
}

/// Every method over a scene, with what its build cost.
fn build_all(name: &str, scene: &Loaded, measured: &mut Measured) -> Vec<(Method, Built)> {
    let mut all = Vec::new();
    for method in methods::all() {
        match method.build(&scene.model) {
            Ok(built) => {
                measured.builds.push(Build {
                    family: FAMILY.to_owned(),
                    scene: name.to_owned(),
                    method: method.name.to_owned(),
                    count: scene.model.triangle_count(),
                    run: 0,
                    seconds: built.seconds,
                    bytes: built.bytes.unwrap_or(0),
                    took: String::new(),
                });
                all.push((method, built));
            }
            Err(reason) => eprintln!("  {}: {reason}", method.name),
        }
    }
    all
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
