//! Wavefront OBJ: positions and faces, nothing else.
//!
//! Written here because the crates for it do not say on which line a file is wrong, and split a
//! mesh by material.

use std::path::Path;

use super::{LoadError, fan};
use crate::model::TriangleMesh;

/// Reads the mesh in `bytes`; `path` is for messages.
///
/// Faces count vertices from one, or backwards from the latest with negative numbers. Polygons
/// are split around their first corner; faces of two corners are dropped. Texture coordinates,
/// normals, groups, materials and lines are passed over.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, LoadError> {
    let mut mesh = TriangleMesh::default();
    let mut corners = Vec::new();
    for (number, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let error = |problem: String| LoadError::new(path, number + 1, problem);
        let Ok(line) = std::str::from_utf8(line) else {
            // Names in comments and groups may be in any encoding; numbers are ASCII.
            continue;
        };
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => mesh.vertices.push(position(words).map_err(error)?),
            Some("f") => {
                corners.clear();
                for word in words.take_while(|word| !word.starts_with('#')) {
                    corners.push(corner(word, mesh.vertices.len()).map_err(error)?);
                }
                mesh.indices.extend(fan(&corners));
            }
            _ => {}
        }
    }
    Ok(mesh)
}

fn position<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<[f32; 3], String> {
    let mut position = [0.0; 3];
    for (x, name) in position.iter_mut().zip(["x", "y", "z"]) {
        let word = words.next().ok_or_else(|| format!("vertex without {name}"))?;
        *x = word.parse().map_err(|_| format!("vertex with {name} = `{word}`, not a number"))?;
    }
    Ok(position)
}

/// The vertex that `word`, such as `7`, `7/2` or `-1//3`, names.
fn corner(word: &str, vertices: usize) -> Result<u32, String> {
    let number = word.split('/').next().unwrap_or_default();
    let index: i64 =
        number.parse().map_err(|_| format!("face corner `{word}`: expected a vertex number"))?;
    let from_zero = if index < 0 { vertices as i64 + index } else { index - 1 };
    match u32::try_from(from_zero) {
        Ok(v) if (v as usize) < vertices => Ok(v),
        _ => Err(format!("face corner `{word}`: there are {vertices} vertices so far")),
    }
}
