//! Grid against BVH: the table of the blog post "Ray Tracing From Scratch: Grid & BVH Comparison".
//!
//! ```text
//! cargo run --release --example compare
//! cargo run --release --example compare -- --scene bunny --runs 5 --size 0.5
//! ```
//!
//! Renders each scene several times with each structure, on one thread, the structures taking
//! turns, and writes pictures, heat maps of steps and tests, tables (CSV) and a chart (SVG). Without the collected scenes it
//! takes those that are built in. What does not fit the time budget is shortened, and said so.

mod heat;
mod measure;
mod options;
mod plan;
mod report;
mod subjects;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Parser;
use raykern_harness::shared_scenes;

use crate::options::Options;
use crate::report::Report;

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let start = Instant::now();
    let folder = shared_scenes::folder(options.scenes.as_deref());
    if let (Some(chosen), None) = (&options.scenes, &folder) {
        anyhow::bail!("--scenes {}: no such folder", chosen.display());
    }
    if options.list_scenes {
        subjects::list(folder.as_deref());
        return Ok(());
    }
    let subjects = subjects::choose(&options.scene, folder.as_deref())?;
    let mut report = Report::create(&options.out)?;
    println!("{}", report::preamble(options, folder.as_deref()));
    let budget = Duration::from_secs(options.budget);
    let mut failed = 0;
    for (number, subject) in subjects.iter().enumerate() {
        let left = budget.saturating_sub(start.elapsed());
        let share = left / (subjects.len() - number) as u32;
        match measure::scene(subject, options, Instant::now() + share) {
            Ok(measured) => report.add(measured)?,
            // The other scenes do not suffer for it; the exit code says so at the end.
            Err(error) => {
                eprintln!("error: scene {}: {error:#}", subject.name);
                failed += 1;
            }
        }
    }
    report.finish(start.elapsed())?;
    anyhow::ensure!(failed == 0, "{failed} of {} scenes could not be compared", subjects.len());
    Ok(())
}
