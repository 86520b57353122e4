//! The numbers, as they lie in CSV files: one type a file.

use std::path::Path;

use anyhow::{Context, Result};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::judge::Tally;

/// A line of a file.
pub trait Row: Serialize + DeserializeOwned {
    /// The file's name.
    const FILE: &'static str;
}

/// What the rest was measured on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fact {
    pub key: String,
    pub value: String,
}

/// One timed run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Run {
    /// `scenes`, or a stress family.
    pub family: String,
    /// The scene, or the number of the case.
    pub scene: String,
    /// The kind of ray.
    pub kind: String,
    pub method: String,
    pub run: usize,
    /// How many rays it answered.
    pub rays: usize,
    pub seconds: f64,
}

/// The judged answers of a method to some rays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Judged {
    /// As in [`Run`].
    pub family: String,
    pub scene: String,
    pub kind: String,
    pub method: String,
    pub asked: u64,
    pub false_misses: u64,
    pub false_hits: u64,
    pub wrong_prims: u64,
    /// By the rules for exact methods.
    pub not_exact: u64,
    /// Rays that were not answered since the method gave up.
    pub gave_up: u64,
    /// The greatest distance of a `t`, in floats.
    pub ulps_max: u64,
    /// How many `t` are off by 0, 1, 2, up to 4, up to 8, ... floats.
    pub ulps: String,
}

impl Judged {
    /// Of what was counted.
    pub fn new([family, scene, kind, method]: [&str; 4], tally: &Tally) -> Self {
        Judged {
            family: family.to_owned(),
            scene: scene.to_owned(),
            kind: kind.to_owned(),
            method: method.to_owned(),
            asked: tally.asked,
            false_misses: tally.false_misses,
            false_hits: tally.false_hits,
            wrong_prims: tally.wrong_prims,
            not_exact: tally.not_exact,
            gave_up: tally.gave_up,
            ulps_max: tally.ulps.max,
            ulps: tally.ulps.text(),
        }
    }

    /// What was counted.
    pub fn tally(&self) -> Tally {
        Tally {
            asked: self.asked,
            false_misses: self.false_misses,
            false_hits: self.false_hits,
            wrong_prims: self.wrong_prims,
            not_exact: self.not_exact,
            gave_up: self.gave_up,
            ulps: crate::judge::Ulps::parse(&self.ulps, self.ulps_max),
        }
    }
}

/// One build.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Build {
    /// As in [`Run`].
    pub family: String,
    pub scene: String,
    pub method: String,
    /// Of triangles, or of instances.
    pub count: usize,
    pub run: usize,
    pub seconds: f64,
    /// What is kept; zero when the library does not say.
    pub bytes: usize,
    /// Which structure it became.
    pub took: String,
}

/// A square of a picture.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Square {
    pub picture: String,
    pub method: String,
    pub x: usize,
    pub y: usize,
    /// The number of one of the picture's outcomes.
    pub outcome: usize,
}

impl Row for Fact {
    const FILE: &'static str = "machine.csv";
}

impl Row for Run {
    const FILE: &'static str = "runs.csv";
}

impl Row for Build {
    const FILE: &'static str = "builds.csv";
}

impl Row for Square {
    const FILE: &'static str = "pictures.csv";
}

impl Row for Judged {
    const FILE: &'static str = "judged.csv";
}

/// Writes a file anew.
pub fn write<R: Row>(folder: &Path, rows: &[R]) -> Result<()> {
    let file = folder.join(R::FILE);
    let mut out = csv::Writer::from_path(&file).with_context(|| file.display().to_string())?;
    rows.iter().try_for_each(|row| out.serialize(row))?;
    Ok(out.flush()?)
}

/// Reads a file; one that is not there has no lines.
pub fn read<R: Row>(folder: &Path) -> Result<Vec<R>> {
    let file = folder.join(R::FILE);
    if !file.exists() {
        return Ok(Vec::new());
    }
    let mut reader = csv::Reader::from_path(&file).with_context(|| file.display().to_string())?;
    let rows: Result<Vec<R>, csv::Error> = reader.deserialize().collect();
    rows.with_context(|| file.display().to_string())
}

/// Puts `rows` in the place of those for which `old` holds.
pub fn replace<R: Row>(folder: &Path, rows: Vec<R>, old: impl Fn(&R) -> bool) -> Result<()> {
    let mut all = read::<R>(folder)?;
    all.retain(|row| !old(row));
    all.extend(rows);
    write(folder, &all)
}
