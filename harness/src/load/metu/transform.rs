//! Transformations: their definitions, and words such as `t1 s2 r1` that name them.

use std::collections::HashMap;

use glam::{DAffine3, DMat4, DVec3};
use roxmltree::Node;

use super::xml::{File, child, name};
use crate::load::LoadError;

/// The transformations a scene defines, by the word that names them.
pub struct Transformations(HashMap<String, DAffine3>);

impl Transformations {
    /// Reads `<Transformations>` under `scene`, if it is there.
    pub fn read(file: File, scene: Node) -> Result<Self, LoadError> {
        let mut known = HashMap::new();
        let nodes = child(scene, "Transformations").into_iter().flat_map(|n| n.children());
        for node in nodes.filter(Node::is_element) {
            let (letter, map) = match name(node) {
                "Translation" => ('t', DAffine3::from_translation(file.vector(node)?)),
                "Scaling" => ('s', DAffine3::from_scale(file.vector(node)?)),
                "Rotation" => ('r', rotation(file, node)?),
                "Composite" => ('c', composite(file, node)?),
                _ => continue,
            };
            let id: u32 = file
                .attribute(node, "id")?
                .ok_or_else(|| file.error(node, "expected an attribute `id`"))?;
            if known.insert(format!("{letter}{id}"), map).is_some() {
                return Err(file.error(node, format!("a second one with id {id}")));
            }
        }
        Ok(Transformations(known))
    }

    /// What the child `<Transformations>` of `object` asks for; the first named acts first.
    pub fn of(&self, file: File, object: Node) -> Result<DAffine3, LoadError> {
        let Some(node) = child(object, "Transformations") else { return Ok(DAffine3::IDENTITY) };
        let mut whole = DAffine3::IDENTITY;
        let text: String = node.children().filter_map(|n| n.text()).collect();
        for word in text.split_ascii_whitespace() {
            let next = self.0.get(word).ok_or_else(|| {
                file.error(node, format!("`{word}`: no such transformation is defined"))
            })?;
            whole = *next * whole;
        }
        Ok(whole)
    }
}

fn rotation(file: File, node: Node) -> Result<DAffine3, LoadError> {
    let [angle, x, y, z] = file.numbers(node)?;
    let axis = DVec3::new(x, y, z)
        .try_normalize()
        .ok_or_else(|| file.error(node, "the axis has no length"))?;
    Ok(DAffine3::from_axis_angle(axis, angle.to_radians()))
}

fn composite(file: File, node: Node) -> Result<DAffine3, LoadError> {
    let rows = DMat4::from_cols_array(&file.numbers::<16>(node)?);
    let columns = rows.transpose();
    if columns.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
        return Err(file.error(node, "the last row is not 0 0 0 1: only affine maps are supported"));
    }
    Ok(DAffine3::from_mat4(columns))
}
