//! Asks list, grid and BVH many rays that look for trouble, and judges every answer exactly.
//!
//! Exits with 1 when an exact answer is wrong, when the three structures differ, or when watertight
//! precision misses what is hit; each failure is shrunk and printed as a test.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use raykern_harness::stress::embree::compiled;
use raykern_harness::stress::run::{Failure, Plan, run};
use raykern_harness::stress::subject::{Build, Structures};
use raykern_harness::stress::{ALL, Family, as_test, csv, markdown, shrink, table};

/// Stress raykern, judge every answer exactly, and print a table by family.
#[derive(Parser)]
struct Options {
    /// About how many rays, all families together.
    #[arg(long, default_value_t = 2_000_000)]
    rays: usize,
    /// Another seed gives other scenes and rays.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only this family; may be given several times.
    #[arg(long = "family", value_name = "NAME")]
    families: Vec<String>,
    /// Ask Embree 3 as well (Debian: libembree-dev), by default and with its robust flag.
    #[arg(long)]
    embree: bool,
    /// Write all counts to this file.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the table of docs/ACCURACY.md to this file.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// How many threads [default: one for each processor].
    #[arg(long)]
    threads: Option<usize>,
    /// How many failures are shrunk and printed.
    #[arg(long, default_value_t = 5)]
    show: usize,
    /// List the families and stop.
    #[arg(long)]
    list: bool,
}

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        ALL.iter().for_each(|family| println!("{:18} {}", family.name, family.about));
        return ExitCode::SUCCESS;
    }
    match stress(&options) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

/// Whether all went well.
fn stress(options: &Options) -> Result<bool, String> {
    let families = families(&options.families)?;
    let folder = std::env::temp_dir().join(format!("raykern-stress-{}", std::process::id()));
    let program = if options.embree { Some(compiled(&folder)?) } else { None };
    let processors = || std::thread::available_parallelism().map_or(1, |n| n.get());
    let build: Build = &Structures::boxed;
    let plan = Plan {
        families: &families,
        rays: options.rays,
        seed: options.seed,
        build,
        embree: program.as_deref(),
        threads: options.threads.unwrap_or_else(processors),
    };
    let started = Instant::now();
    let outcome = run(&plan);
    if program.is_some() {
        std::fs::remove_dir_all(&folder).map_err(|error| error.to_string())?;
    }
    print!("{}", table(&families, &outcome.rows, options.embree));
    println!("seed {}, {:.0} s", options.seed, started.elapsed().as_secs_f64());
    write(options.csv.as_deref(), &csv(&families, &outcome.rows))?;
    write(options.markdown.as_deref(), &markdown(&families, &outcome.rows))?;
    outcome.failures.iter().take(options.show).for_each(|failure| show(failure, options, build));
    Ok(outcome.rows.iter().all(|row| row.is_right()) && outcome.failures.is_empty())
}

fn families(names: &[String]) -> Result<Vec<Family>, String> {
    if names.is_empty() {
        return Ok(ALL.to_vec());
    }
    let find = |name: &String| Family::by_name(name).ok_or(format!("no family {name}: see --list"));
    names.iter().map(find).collect()
}

/// Writes to the file, if one is wanted.
fn write(file: Option<&Path>, text: &str) -> Result<(), String> {
    let Some(file) = file else { return Ok(()) };
    std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))
}

/// Shrinks and prints.
fn show(failure: &Failure, options: &Options, build: Build) {
    let Failure { complaint, family, case, number, scenery, shot } = failure;
    println!(
        "\n{}: family {family}, seed {}, case {case}, ray {number}",
        complaint.0, options.seed
    );
    let (scenery, shot) = shrink::shrunk(scenery, shot, complaint, build);
    println!("{}", as_test(&format!("{family}_{}_{case}_{number}", options.seed), &scenery, &shot));
}
