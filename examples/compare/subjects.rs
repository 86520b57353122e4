//! Which scenes there are, and which of them to measure.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use raykern_harness::load::load;
use raykern_harness::render::RenderScene;
use raykern_harness::scenes::{self, SceneMaker};

/// A scene to measure.
pub struct Subject {
    /// As in tables and file names.
    pub name: String,
    source: Source,
    /// Whether what is shown in several places is copied there.
    flat: bool,
}

enum Source {
    File(PathBuf),
    BuiltIn(SceneMaker),
}

/// The blog post's scenes, light ones first, and their files under `metu/`.
///
/// The mesh of its dragon_metal was not found; another dragon of a like size stands in. The last one is the one before it with a copy
/// of the dragon at each place, as the post had it.
const BLOG: [(&str, &str); 9] = [
    ("simple", "simple.xml"),
    ("two_spheres", "two_spheres.xml"),
    ("bunny", "bunny.xml"),
    ("monkey", "monkey.xml"),
    ("scienceTree_glass", "scienceTree_glass.xml"),
    ("chinese_dragon", "chinese_dragon.xml"),
    ("dragon_metal", "dragon_metal_standin.xml"),
    ("marching_dragons", "marching_dragons.xml"),
    ("marching_dragons_flat", "marching_dragons.xml"),
];

/// A name that ends so means the scene before it, flattened.
const FLAT: &str = "_flat";

impl Subject {
    /// Loads or makes the scene.
    pub fn load(&self) -> Result<RenderScene> {
        let scene = match &self.source {
            Source::File(path) => load(path)?,
            Source::BuiltIn(make) => make(),
        };
        match self.flat {
            true => scene.flattened().context("ellipsoids cannot be flattened"),
            false => Ok(scene),
        }
    }

    /// Where it is from.
    pub fn origin(&self) -> String {
        match &self.source {
            Source::File(path) => {
                path.file_name().unwrap_or_default().to_string_lossy().into_owned()
            }
            Source::BuiltIn(_) => "built in".into(),
        }
    }
}

/// The scenes called for; with none called for the blog post's, or else the built-in ones.
pub fn choose(wanted: &[String], folder: Option<&Path>) -> Result<Vec<Subject>> {
    if !wanted.is_empty() {
        return wanted.iter().map(|text| find(text, folder)).collect();
    }
    let blog = folder.map(|folder| folder.join("metu")).filter(|metu| metu.is_dir());
    Ok(match blog {
        Some(metu) => {
            let subject = |(name, file): &(&str, &str)| {
                let flat = name.ends_with(FLAT);
                Subject { flat, ..from_file(name, metu.join(file)) }
            };
            BLOG.iter().map(subject).collect()
        }
        None => {
            let flat = format!("{}{FLAT}", scenes::ALL[scenes::ALL.len() - 1].0);
            let all = scenes::ALL.iter().map(|&(name, make)| built_in(name, make));
            all.chain([find(&flat, None)?]).collect()
        }
    })
}

/// Prints what [`choose`] knows by name.
pub fn list(folder: Option<&Path>) {
    println!("built in:");
    scenes::ALL.iter().for_each(|(name, _)| println!("  {name}"));
    match folder {
        None => println!("no folder of collected scenes (--scenes DIR or RAYKERN_SCENES)"),
        Some(folder) => {
            println!("in {}:", folder.display());
            collected(folder).iter().for_each(|(name, _)| println!("  {name}"));
        }
    }
}

fn find(text: &str, folder: Option<&Path>) -> Result<Subject> {
    let path = Path::new(text);
    if path.is_file() {
        return Ok(from_file(stem(path), path.to_owned()));
    }
    if let Some((name, make)) = scenes::ALL.iter().find(|(name, _)| *name == text) {
        return Ok(built_in(name, *make));
    }
    if let Some(name) = text.strip_suffix(FLAT) {
        let scene = find(name, folder)?;
        return Ok(Subject { name: text.to_owned(), flat: true, ..scene });
    }
    let collected = folder.map(collected).unwrap_or_default();
    match collected.into_iter().find(|(name, _)| name == text) {
        Some((name, path)) => Ok(from_file(&name, path)),
        None => bail!("--scene {text}: neither a file nor a known scene (see --list-scenes)"),
    }
}

/// Every scene and mesh in the folder: the blog post's by its names, the others by file name.
fn collected(folder: &Path) -> Vec<(String, PathBuf)> {
    let metu = folder.join("metu");
    let blog = BLOG.iter().map(|(name, file)| ((*name).to_owned(), metu.join(file)));
    let mut known: Vec<_> = blog.filter(|(_, path)| path.is_file()).collect();
    for group in [metu, folder.join("classic")] {
        let entries = std::fs::read_dir(group).into_iter().flatten().flatten();
        let mut paths: Vec<_> = entries.map(|entry| entry.path()).filter(|p| p.is_file()).collect();
        paths.sort();
        for path in paths {
            let name = stem(&path).to_owned();
            if !known.iter().any(|(other, _)| *other == name) {
                known.push((name, path));
            }
        }
    }
    known
}

fn from_file(name: &str, path: PathBuf) -> Subject {
    Subject { name: name.to_owned(), source: Source::File(path), flat: false }
}

fn built_in(name: &str, make: SceneMaker) -> Subject {
    Subject { name: name.to_owned(), source: Source::BuiltIn(make), flat: false }
}

/// The file's name up to the first dot.
fn stem(path: &Path) -> &str {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("scene");
    name.split('.').next().unwrap_or(name)
}
