//! Speed against accuracy: measures every method, judges every answer, and writes one page that shows both.
//!
//! `cargo run --release -p raykern-bench --features embree,peers --bin report`; how to read the page is in docs/REPORT.md.
//!
//! It measures into CSV files, one a part, and makes the page from these alone; so a page can be made again, or from files of
//! another machine, without measuring.

mod blog;
mod case;
mod families;
mod figures;
mod growth;
mod judge;
mod methods;
mod options;
mod ordinary;
mod page;
mod pictures;
mod rows;
mod sections;
mod structures;
mod summary;
mod timing;
mod worker;

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

use crate::options::Options;
use crate::rows::Fact;

fn main() -> ExitCode {
    let options = Options::parse();
    if options.worker {
        return worker::serve();
    }
    match run(&options) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(wrong) => {
            eprintln!("{wrong} answers of exact methods are wrong");
            ExitCode::from(1)
        }
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::from(2)
        }
    }
}

/// Measures what is asked for and makes the page; returns how many answers of exact methods were wrong.
fn run(options: &Options) -> Result<u64> {
    if options.from.is_none() {
        measure(options)?;
    }
    sections::write(options.data(), &options.out)
}

fn measure(options: &Options) -> Result<()> {
    std::fs::create_dir_all(options.data())?;
    let core = raykern_bench::watch::stay_on(options.core);
    let mut facts = options::machine(options, core);
    if !options.parts.is_empty() {
        // What else is there was measured by other commands.
        let before = rows::read::<Fact>(options.data())?.into_iter();
        let said: Vec<String> = facts.iter().map(|fact| fact.value.clone()).collect();
        facts.extend(before.filter(|fact| fact.key == "command" && !said.contains(&fact.value)));
    }
    rows::write(options.data(), &facts)?;
    for (part, measure) in PARTS {
        if options.wants(part) {
            eprintln!("{part} ...");
            let started = std::time::Instant::now();
            measure(options)?;
            eprintln!("{part}: {:.0} s", started.elapsed().as_secs_f64());
        }
    }
    Ok(())
}

type Part = (&'static str, fn(&Options) -> Result<()>);

/// What can be measured, each into files of its own.
const PARTS: [Part; 8] = [
    ("scenes", ordinary::measure),
    ("families", families::measure),
    ("costs", structures::measure_scenes),
    ("sizes", structures::measure_sizes),
    ("growth", growth::measure_triangles),
    ("instances", growth::measure_instances),
    ("pictures", pictures::measure),
    ("blog", blog::measure),
];
