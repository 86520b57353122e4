//! The command line.

use std::path::PathBuf;

use clap::Parser;
use raykern::{Backend, Layout};

use crate::rays::Kind;

/// Measures raykern against its peers: the same rays, in turns, on one thread of one core.
#[derive(Parser)]
#[command(version, about)]
pub struct Options {
    /// Only scenes whose name begins so; may be repeated.
    #[arg(long = "scene", value_name = "NAME")]
    pub scenes: Vec<String>,
    /// Only this kind of ray; may be repeated.
    #[arg(long = "kind", value_name = "NAME", value_parser = Kind::parse)]
    pub kinds: Vec<Kind>,
    /// Only peers whose name begins so; may be repeated. `none` leaves ours alone.
    #[arg(long = "peer", value_name = "NAME")]
    pub peers: Vec<String>,
    /// A layout of our BVH: automatic, compact, wide4, wide8 or wide16; may be repeated.
    #[arg(long = "layout", value_name = "NAME", value_parser = parse_layout)]
    pub layouts: Vec<(String, Layout)>,
    /// The instructions that ours may use at most: scalar, bits128, avx2 or avx512.
    #[arg(long, value_name = "NAME", value_parser = parse_backend)]
    pub backend: Option<Backend>,
    /// Rays of each kind.
    #[arg(long, value_name = "N")]
    pub rays: Option<usize>,
    /// Timed runs of each method, after one that warms up and is checked.
    #[arg(long, value_name = "R")]
    pub runs: Option<usize>,
    /// Also write every number to this file.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Small scenes, few rays: shows that answers agree, says little about speed.
    #[arg(long)]
    pub quick: bool,
    /// Instead of scenes: spheres of a thousand to ten million triangles.
    #[arg(long)]
    pub growth: bool,
    /// Instead of still scenes: some that move, what a frame costs by refitting or building anew, and rays after it.
    #[arg(long)]
    pub motion: bool,
    /// Instead of rays: builds by one thread and by several.
    #[arg(long)]
    pub builds: bool,
    /// With --builds: how many; else as many as there are cores.
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Instead of still scenes: one model many times, by instances.
    #[arg(long)]
    pub instances: bool,
    /// Instead of the peers: grids against BVHs, also in scenes of mixed sizes, and what the choice between them costs.
    #[arg(long)]
    pub grids: bool,
    /// Instead of rays: the closest point of a scene, for many points.
    #[arg(long)]
    pub points: bool,
    /// The folder of scene files; else RAYKERN_SCENES, else shared/scenes beside the workspace.
    #[arg(long, value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// The core to stay on; else the one the program starts on.
    #[arg(long, value_name = "NUMBER")]
    pub core: Option<usize>,
}

/// The layouts by name; the first is measured unless others are asked for.
const LAYOUTS: [(&str, Layout); 5] = [
    ("automatic", Layout::Automatic),
    ("compact", Layout::Compact),
    ("wide4", Layout::Wide(4)),
    ("wide8", Layout::Wide(8)),
    ("wide16", Layout::Wide(16)),
];

fn parse_layout(name: &str) -> Result<(String, Layout), String> {
    let found = LAYOUTS.iter().find(|(known, _)| *known == name);
    found.map(|(name, layout)| (name.to_string(), *layout)).ok_or_else(|| {
        let known: Vec<_> = LAYOUTS.iter().map(|(known, _)| *known).collect();
        format!("expected one of {}", known.join(", "))
    })
}

fn parse_backend(name: &str) -> Result<Backend, String> {
    match name {
        "scalar" => Ok(Backend::Scalar),
        "bits128" => Ok(Backend::Bits128),
        "avx2" => Ok(Backend::Avx2),
        "avx512" => Ok(Backend::Avx512),
        _ => Err("expected one of scalar, bits128, avx2, avx512".to_string()),
    }
}

impl Options {
    /// How many rays of each kind.
    pub fn ray_count(&self) -> usize {
        self.rays.unwrap_or(if self.quick { 5_000 } else { 100_000 }).max(1)
    }

    /// How many timed runs.
    pub fn run_count(&self) -> usize {
        self.runs.unwrap_or(if self.quick { 3 } else { 7 }).max(1)
    }

    /// How many threads build.
    pub fn thread_count(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        self.threads.unwrap_or_else(cores).max(1)
    }

    /// Whether a scene is asked for by name; `None` when no scene is named at all.
    pub fn names_scene(&self, name: &str) -> Option<bool> {
        (!self.scenes.is_empty()).then(|| begins_with_one(name, &self.scenes))
    }

    /// Whether a peer takes part.
    #[cfg(any(feature = "embree", feature = "peers"))]
    pub fn wants_peer(&self, name: &str) -> bool {
        self.peers.is_empty() || begins_with_one(name, &self.peers)
    }

    /// The kinds of rays to trace.
    pub fn kinds(&self) -> Vec<Kind> {
        let wanted = |kind: &Kind| self.kinds.is_empty() || self.kinds.contains(kind);
        Kind::ALL.into_iter().filter(wanted).collect()
    }

    /// The layouts to build, with their names.
    pub fn layouts(&self) -> Vec<(String, Layout)> {
        if self.layouts.is_empty() {
            return vec![(LAYOUTS[0].0.to_string(), LAYOUTS[0].1)];
        }
        self.layouts.clone()
    }
}

fn begins_with_one(name: &str, beginnings: &[String]) -> bool {
    beginnings.iter().any(|beginning| name.starts_with(beginning.as_str()))
}
