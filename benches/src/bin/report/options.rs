//! The command line, and what is known of the machine.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Parser;

use crate::rows::Fact;

/// Speed against accuracy: measures every method, judges every answer, and writes one page that shows both.
#[derive(Parser)]
#[command(version, about)]
pub struct Options {
    /// The folder for the page, its figures and the numbers.
    #[arg(long, value_name = "DIR", default_value = "target/report")]
    pub out: PathBuf,
    /// Make the page from the numbers in this folder, without measuring.
    #[arg(long, value_name = "DIR")]
    pub from: Option<PathBuf>,
    /// Small scenes and few rays, under two minutes: shows that answers are right, says little about speed.
    #[arg(long)]
    pub quick: bool,
    /// Only this part, keeping the numbers of the others; may be repeated.
    #[arg(long = "part", value_name = "NAME")]
    pub parts: Vec<String>,
    /// Only scenes whose name begins so; may be repeated.
    #[arg(long = "scene", value_name = "NAME")]
    pub scenes: Vec<String>,
    /// Rays of each kind.
    #[arg(long, value_name = "N")]
    pub rays: Option<usize>,
    /// Timed runs of each method.
    #[arg(long, value_name = "R")]
    pub runs: Option<usize>,
    /// Cases of each stress family, 250 rays each.
    #[arg(long, value_name = "N")]
    pub cases: Option<usize>,
    /// How many triangles the largest of the growing scenes has.
    #[arg(long, value_name = "N")]
    pub largest: Option<usize>,
    /// How many instances, likewise.
    #[arg(long, value_name = "N")]
    pub instances: Option<usize>,
    /// The core to stay on; else the one the program starts on.
    #[arg(long, value_name = "NUMBER")]
    pub core: Option<usize>,
    /// Answers cases on the standard input: how the program asks those who may abort.
    #[arg(long, hide = true)]
    pub worker: bool,
}

impl Options {
    /// Where the numbers are.
    pub fn data(&self) -> &Path {
        self.from.as_deref().unwrap_or(&self.out)
    }

    /// Whether a part is to be measured.
    pub fn wants(&self, part: &str) -> bool {
        self.parts.is_empty() || self.parts.iter().any(|wanted| wanted == part)
    }

    /// Whether a scene is to be measured.
    pub fn wants_scene(&self, name: &str) -> bool {
        self.scenes.is_empty() || self.scenes.iter().any(|wanted| name.starts_with(wanted.as_str()))
    }

    /// How many rays of each kind are traced.
    pub fn ray_count(&self) -> usize {
        self.rays.unwrap_or(if self.quick { 4_000 } else { 50_000 }).max(100)
    }

    /// How many timed runs.
    pub fn run_count(&self) -> usize {
        self.runs.unwrap_or(if self.quick { 3 } else { 7 }).max(2)
    }

    /// How many triangles scenes grow to.
    pub fn largest(&self) -> usize {
        self.largest.unwrap_or(if self.quick { 32_000 } else { 10_000_000 })
    }

    /// How many instances they grow to.
    pub fn most_instances(&self) -> usize {
        self.instances.unwrap_or(if self.quick { 1_000 } else { 1_000_000 })
    }

    /// How many cases of each stress family.
    pub fn case_count(&self) -> usize {
        self.cases.unwrap_or(if self.quick { 2 } else { 40 }).max(1)
    }
}

/// What the numbers were measured on, and how.
pub fn machine(options: &Options, core: Option<usize>) -> Vec<Fact> {
    // All of them, not those that the program may use.
    let cores = said("nproc", &["--all"]);
    let on = core.map_or("not kept on one core".to_owned(), |core| format!("kept on core {core}"));
    let features = [("embree", cfg!(feature = "embree")), ("peers", cfg!(feature = "peers"))];
    let features: Vec<_> = features.iter().filter(|f| f.1).map(|f| f.0).collect();
    let words: Vec<String> = std::env::args().skip(1).collect();
    let command = format!(
        "cargo run --release -p raykern-bench --features {} --bin report -- {}",
        features.join(","),
        words.join(" ")
    );
    let facts = [
        ("processor", raykern_bench::report::processor()),
        ("threads", format!("one, {on}; {cores} cores")),
        ("best vector instructions", format!("{:?}", raykern::Backend::detected())),
        ("system", said("uname", &["-sr"])),
        ("date", said("date", &["-u", "+%Y-%m-%d %H:%M UTC"])),
        (
            "raykern",
            format!(
                "{} {}",
                env!("CARGO_PKG_VERSION"),
                said("git", &["describe", "--always", "--dirty"])
            ),
        ),
        ("compiler", said("rustc", &["--version"])),
        ("Embree", crate::methods::embree_version()),
        ("command", command),
        (
            "runs",
            format!(
                "{} of {} rays a kind; {} cases a family",
                options.run_count(),
                options.ray_count(),
                options.case_count()
            ),
        ),
    ];
    facts.map(|(key, value)| Fact { key: key.to_owned(), value }).to_vec()
}

/// The first line a program says; nothing where there is no such program.
fn said(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output();
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    text.unwrap_or_default().lines().next().unwrap_or_default().to_owned()
}
