//! Scenes and meshes from files.
//!
//! | ending | what | module |
//! | --- | --- | --- |
//! | `.xml` | a whole scene of the METU ray tracing courses | [`metu`] |
//! | `.ply` | one mesh, ascii or binary | [`ply`] |
//! | `.obj` | one mesh | [`obj`] |
//!
//! Each may be compressed (`.xz`), and a file that is missing is looked for with `.xz` added.

pub mod metu;
pub mod obj;
pub mod ply;
mod xz;

use std::fmt;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::model::TriangleMesh;
use crate::render::RenderScene;

/// What is wrong with a file, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// The file.
    pub path: PathBuf,
    /// The line, from one, if the trouble has one.
    pub line: Option<usize>,
    /// What was found and what was expected.
    pub problem: String,
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl std::error::Error for LoadError {}

impl LoadError {
    fn new(path: &Path, line: impl Into<Option<usize>>, problem: impl Into<String>) -> Self {
        LoadError { path: path.to_owned(), line: line.into(), problem: problem.into() }
    }
}

/// Loads a scene. A bare mesh becomes a scene of one grey material that is wholly in view.
pub fn load(path: &Path) -> Result<RenderScene, LoadError> {
    if ending(path) == "xml" {
        return metu::load(path);
    }
    let mesh = load_mesh(path)?;
    if mesh.indices.is_empty() {
        return Err(LoadError::new(path, None, "no faces: expected at least one"));
    }
    Ok(RenderScene::portrait(mesh.into(), DVec3::Y, DVec3::new(0.3, 0.25, 1.0)))
}

/// Loads a mesh.
pub fn load_mesh(path: &Path) -> Result<TriangleMesh, LoadError> {
    match ending(path).as_str() {
        "ply" => ply::parse(path, &xz::read(path)?),
        "obj" => obj::parse(path, &xz::read(path)?),
        other => {
            let problem =
                format!("ending `{other}`: expected .xml, .ply or .obj, perhaps with .xz");
            Err(LoadError::new(path, None, problem))
        }
    }
}

/// What a file is, `.xz` left aside, in small letters.
fn ending(path: &Path) -> String {
    let lower = |p: &Path| p.extension().map(|e| e.to_string_lossy().to_lowercase());
    match lower(path) {
        Some(e) if e == "xz" => lower(Path::new(path.file_stem().unwrap_or_default())),
        other => other,
    }
    .unwrap_or_default()
}

/// Splits a polygon into triangles around its first corner; fewer than three corners give none.
///
/// Right for convex polygons, which is what mesh files hold as a rule.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let pairs = corners.get(1..).unwrap_or_default().windows(2);
    pairs.map(|pair| [corners[0], pair[0], pair[1]])
}
