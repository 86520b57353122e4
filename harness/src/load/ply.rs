//! PLY meshes: ascii or binary, faces or triangle strips.

use std::path::Path;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Header, Property, PropertyAccess, PropertyAccessResult,
    PropertyType,
};

use super::{LoadError, fan};
use crate::model::TriangleMesh;

/// Reads the mesh in `bytes`; `path` is for messages.
///
/// Wants an element `vertex` with scalars `x y z`; takes an element `face` or `tristrips` with a
/// list of whole numbers `vertex_indices` or `vertex_index`. Other elements and properties are
/// passed over. Faces of fewer than three corners are dropped; in strips, -1 starts a new strip.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, LoadError> {
    let error = |e: ParseError| LoadError::new(path, e.line(), first_line(&e));
    let mut reader = Reader::new(bytes);
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(error)?;
    let mut mesh = TriangleMesh::default();
    let mut lists: Vec<(&str, Vec<List>)> = Vec::new();
    for (name, element) in &header.elements {
        check(element).map_err(|problem| LoadError::new(path, None, problem))?;
        match name.as_str() {
            "vertex" => {
                let vertices: Vec<Vertex> =
                    payload(&mut reader, element, &header).map_err(error)?;
                mesh.vertices = vertices.into_iter().map(|v| v.0).collect();
            }
            "face" | "tristrips" => {
                lists.push((name, payload(&mut reader, element, &header).map_err(error)?));
            }
            _ => drop(payload::<DefaultElement>(&mut reader, element, &header).map_err(error)?),
        }
    }
    for (name, elements) in lists {
        for (number, List(list)) in elements.iter().enumerate() {
            let bad = |v| {
                let count = mesh.vertices.len();
                let problem = format!("{name} {number} names vertex {v}: there are {count}");
                LoadError::new(path, None, problem)
            };
            let strips = name == "tristrips";
            let runs = list.split(|&v| strips && v == -1);
            for run in runs {
                let run = vertex_numbers(run, mesh.vertices.len()).map_err(bad)?;
                if strips {
                    mesh.indices.extend(strip(&run));
                } else {
                    mesh.indices.extend(fan(&run));
                }
            }
        }
    }
    Ok(mesh)
}

/// Whether `element`, if it is one we read, has what we need.
fn check(element: &ElementDef) -> Result<(), String> {
    let scalar = |name: &str| {
        let p = element.properties.iter().find(|(key, _)| key.as_str() == name);
        p.is_some_and(|(_, p)| matches!(p.data_type, PropertyType::Scalar(_)))
    };
    let list = |name: &str| {
        let p = element.properties.iter().find(|(key, _)| key.as_str() == name);
        p.is_some_and(|(_, p)| matches!(p.data_type, PropertyType::List(..)))
    };
    match element.name.as_str() {
        "vertex" if !["x", "y", "z"].into_iter().all(scalar) => {
            Err("element `vertex` without the scalar properties x, y and z".into())
        }
        name @ ("face" | "tristrips")
            if !["vertex_indices", "vertex_index"].into_iter().any(list) =>
        {
            Err(format!("element `{name}` without a list `vertex_indices` or `vertex_index`"))
        }
        _ => Ok(()),
    }
}

fn payload<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, ParseError> {
    Parser::<E>::new().read_payload_for_element(reader, element, header)
}

/// The numbers as they index, or the first one that is out of range.
fn vertex_numbers(list: &[i64], count: usize) -> Result<Vec<u32>, i64> {
    let number = |&v: &i64| match u32::try_from(v) {
        Ok(index) if (index as usize) < count => Ok(index),
        _ => Err(v),
    };
    list.iter().map(number).collect()
}

/// The triangles of a strip, every second one turned so that all face the same side.
fn strip(run: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    run.windows(3).enumerate().map(
        |(i, t)| {
            if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
        },
    )
}

/// The parser's message without the quoted line, which may be megabytes of binary.
fn first_line(error: &ParseError) -> String {
    let text = error.to_string();
    let reason = text.lines().rev().find_map(|line| line.trim().strip_prefix("Error: "));
    let line = reason.unwrap_or_else(|| text.lines().next().unwrap_or_default());
    format!("not a readable PLY file: {}", line.chars().take(160).collect::<String>())
}

struct Vertex([f32; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex([0.0; 3])
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        match value.to_f32_lossy() {
            Some(x) => self.0[axis] = x,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

struct List(Vec<i64>);

impl PropertyAccess for List {
    fn new() -> Self {
        List(Vec::new())
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match value {
            Property::ListChar(v) => wide(v),
            Property::ListUChar(v) => wide(v),
            Property::ListShort(v) => wide(v),
            Property::ListUShort(v) => wide(v),
            Property::ListInt(v) => wide(v),
            Property::ListUInt(v) => wide(v),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

fn wide<T: Into<i64>>(list: Vec<T>) -> Vec<i64> {
    list.into_iter().map(Into::into).collect()
}
