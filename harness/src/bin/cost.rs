//! What exactness costs: the exact mode against the watertight one, on the same structure.
//!
//! ```text
//! cargo run --release -p raykern-harness --bin cost -- [--rays N] [--runs R] [--csv FILE]
//!                                                      [--only NAME] [--grid]
//! ```
//!
//! One thread. For each scene and kind of rays both modes run over all rays in turns, `--runs` times
//! each; the ratio is the geometric mean of the pairs' ratios with its interval of 95 % confidence.
//! Before that, list, grid and BVH must give the same bits on a sample. The table goes to the
//! standard output, progress to the standard error; scenes whose files are absent are left out.

#[path = "../cost/clock.rs"]
mod clock;
#[path = "../cost/measure.rs"]
mod measure;
#[path = "../cost/subjects.rs"]
mod subjects;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clock::Clock;
use measure::Line;
use raykern::{BuildOptions, OwnedAccel, PlainList};
use subjects::Subject;

const USAGE: &str = "cost [--rays N] [--runs R] [--csv FILE] [--only NAME] [--grid]";
const CSV: &str = "scene,rays,structure,exact_ns,watertight_ns,ratio,ratio_low,ratio_high,target,\
    exact_mrays,watertight_mrays,hits_percent,steps,blocks,tests,intervals,exact,roundings,\
    watertight_misses,watertight_extra\n";

struct Arguments {
    rays: usize,
    runs: usize,
    csv: Option<PathBuf>,
    /// Only scenes whose name holds this.
    only: String,
    /// The grid as well.
    grid: bool,
}

fn main() -> ExitCode {
    match arguments().and_then(|arguments| run(&arguments)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(problem) => {
            eprintln!("{problem}\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

fn arguments() -> Result<Arguments, String> {
    let mut arguments =
        Arguments { rays: 100_000, runs: 9, csv: None, only: String::new(), grid: false };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} wants a value"));
        let number = |text: String| match text.parse() {
            Ok(0) | Err(_) => Err(format!("`{text}`: expected a number above zero")),
            Ok(number) => Ok(number),
        };
        match word.as_str() {
            "--rays" => arguments.rays = number(value()?)?,
            "--runs" => arguments.runs = number(value()?)?,
            "--csv" => arguments.csv = Some(value()?.into()),
            "--only" => arguments.only = value()?,
            "--grid" => arguments.grid = true,
            _ => return Err(format!("`{word}` is unknown")),
        }
    }
    Ok(arguments)
}

/// Measures everything; false when a target was missed for certain.
fn run(arguments: &Arguments) -> Result<bool, String> {
    let mut clock = Clock::new();
    let Arguments { rays, runs, .. } = arguments;
    println!("{rays} rays, {runs} runs, {}; work in units a ray\n", clock.name());
    println!(
        "{:24} {:14} {:4} {:>8} {:>8} {:>20} {:>7} {:>6} {:>6} {:>5} {:>6} {:>6} {:>6} {:>7} {:>7} {:>7} {:>5} {:>5}",
        "scene",
        "rays",
        "",
        "exact",
        "watert.",
        "ratio",
        "target",
        "exact",
        "watert",
        "hits",
        "steps",
        "blocks",
        "tests",
        "t f64",
        "exact",
        "round",
        "wmiss",
        "wmore"
    );
    println!("{:44} {:>8} {:>8} {:>20} {:>7} {:>13} {:>5}", "", "ns", "ns", "", "", "Mrays/s", "%");
    let (mut csv, mut met) = (CSV.to_owned(), true);
    for (name, make) in subjects::all() {
        if !name.contains(&arguments.only) {
            continue;
        }
        eprintln!("{name} ...");
        match make(arguments.rays) {
            Some(subject) => met &= measure_all(&subject, arguments, &mut clock, &mut csv)?,
            None => println!("{name:24} absent: left out"),
        }
    }
    if let Some(path) = &arguments.csv {
        std::fs::write(path, csv).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(met)
}

fn measure_all(
    subject: &Subject,
    arguments: &Arguments,
    clock: &mut Clock,
    csv: &mut String,
) -> Result<bool, String> {
    let with = |plain_list| BuildOptions { plain_list, ..Default::default() };
    let never = with(PlainList::Never);
    let built = subject.model.with_scene(|scene| {
        let list = OwnedAccel::bvh(scene, &with(PlainList::Always))?;
        Ok([list, OwnedAccel::grid(scene, &never)?, OwnedAccel::bvh(scene, &never)?])
    });
    let built = built.map_err(|error: raykern::BuildError| format!("{}: {error}", subject.name))?;
    let [list, grid, bvh] = built.each_ref().map(OwnedAccel::accel);
    let prims = subject.model.triangle_count() + subject.model.sphere_count();
    let mut met = true;
    for rays in &subject.rays {
        eprintln!("    {}", rays.kind);
        measure::check(&subject.name, [&list, &grid, &bvh], rays, prims);
        for (structure, accel) in [("bvh", &bvh), ("grid", &grid)] {
            if structure == "bvh" || arguments.grid {
                let line = measure::measure(accel, rays, arguments.runs, clock);
                met &= report(subject, rays.kind, structure, &line, csv);
            }
        }
    }
    Ok(met)
}

/// Prints a line; false when the target is missed for certain.
fn report(subject: &Subject, kind: &str, structure: &str, line: &Line, csv: &mut String) -> bool {
    let [exact, watertight] = line.nanoseconds;
    let ratio = line.ratio.mean;
    let (low, high) = line.ratio.interval.unwrap_or((ratio, ratio));
    let missed = subject.target.is_some_and(|target| low > target);
    let target = subject.target.map_or(String::new(), |target| {
        let verdict = if missed {
            "MISSED"
        } else if high > target {
            "open"
        } else {
            "met"
        };
        format!("{target} {verdict}")
    });
    let [steps, blocks, tests, intervals, decided, roundings] = line.work;
    let Line { hits, misses, extra, .. } = line;
    println!(
        "{:24} {kind:14} {structure:4} {exact:8.0} {watertight:8.0} {ratio:6.3} [{low:5.3}, {high:5.3}] \
         {target:>7} {:6.2} {:6.2} {hits:5.1} {steps:6.1} {blocks:6.1} {tests:6.1} {intervals:7.3} \
         {decided:7.4} {roundings:7.4} {misses:5} {extra:5}",
        subject.name,
        1e3 / exact,
        1e3 / watertight,
    );
    let _ = writeln!(
        csv,
        "{},{kind},{structure},{exact:.2},{watertight:.2},{ratio:.4},{low:.4},{high:.4},{},{:.4},{:.4},\
         {hits:.2},{steps:.3},{blocks:.3},{tests:.3},{intervals:.5},{decided:.6},{roundings:.6},{misses},{extra}",
        subject.name,
        subject.target.map_or(String::new(), |target| target.to_string()),
        1e3 / exact,
        1e3 / watertight,
    );
    !missed
}
