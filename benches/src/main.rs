//! Measures raykern against its peers: the same rays, in turns, on one thread of one core.
//!
//! `cargo run --release -p raykern-bench --features embree,peers -- --help`; what the numbers mean
//! is in docs/SPEED.md.

use anyhow::{Context, Result};
use clap::Parser;

use raykern_bench::options::Options;
use raykern_bench::watch::Watch;
use raykern_bench::{
    builds, grids, instances, measure, motion, points, ratios, report, scenes, watch,
};

fn main() -> Result<()> {
    let options = Options::parse();
    if options.builds {
        println!("raykern {} on {}", env!("CARGO_PKG_VERSION"), report::processor());
        return builds::run(&options);
    }
    report::machine(watch::stay_on(options.core), &options);
    if let Some(backend) = options.backend {
        println!("ours with {:?}", backend.force());
    }
    if options.motion {
        return motion::run(&options);
    }
    if options.points {
        return points::run(&options);
    }
    let mut watch = Watch::new();
    if !watch.counts_events() {
        println!("no processor events: this machine does not count them\n");
    }
    if options.instances {
        let results = instances::run(&options, &mut watch)?;
        ratios::print(&results);
        return Ok(());
    }
    if options.grids {
        let results = grids::run(&options, &mut watch)?;
        ratios::print(&results);
        return Ok(());
    }
    let mut results = Vec::new();
    for case in scenes::cases(&options) {
        let scene = match case.load(&options) {
            Ok(scene) => scene,
            Err(reason) => {
                println!("{}: skipped: {reason}\n", case.name);
                continue;
            }
        };
        let result = measure::measure(&case, &scene, &options, &mut watch)
            .with_context(|| case.name.clone())?;
        report::scene(&result);
        results.push(result);
    }
    if options.growth {
        report::growth(&results);
    }
    ratios::print(&results);
    if let Some(file) = &options.csv {
        report::csv(&results, file).with_context(|| file.display().to_string())?;
    }
    Ok(())
}
