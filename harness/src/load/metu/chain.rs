//! Meshes and instances of them, before anything is loaded: which mesh each object shows, and where.

use std::collections::HashMap;

use glam::DAffine3;
use roxmltree::Node;

use super::transform::Transformations;
use super::xml::{File, child, name};
use crate::load::LoadError;

/// A `<Mesh>` or a `<MeshInstance>`.
pub struct Object<'a, 'i> {
    pub node: Node<'a, 'i>,
    own: DAffine3,
    base: Option<Base>,
}

/// What an instance is an instance of.
struct Base {
    id: u32,
    reset: bool,
}

/// Which object an id means; `None` when several have it.
type Ids = HashMap<u32, Option<usize>>;

/// All meshes and instances in the order of the file, and for each the number of the mesh that it shows, and where.
///
/// An instance of an instance shows a mesh like any other, at the product of their maps: so one level of instances is
/// enough for chains of any length, and costs no memory.
pub fn read<'a, 'i>(
    file: File,
    scene: Node<'a, 'i>,
    transformations: &Transformations,
) -> Result<Vec<(Object<'a, 'i>, usize, DAffine3)>, LoadError> {
    let objects = objects(file, scene, transformations)?;
    let ids = ids(file, &objects)?;
    let shown = (0..objects.len()).map(|number| resolve(file, &objects, &ids, number));
    let shown = shown.collect::<Result<Vec<_>, _>>()?;
    Ok(objects.into_iter().zip(shown).map(|(object, (mesh, map))| (object, mesh, map)).collect())
}

fn objects<'a, 'i>(
    file: File,
    scene: Node<'a, 'i>,
    transformations: &Transformations,
) -> Result<Vec<Object<'a, 'i>>, LoadError> {
    let nodes = child(scene, "Objects").into_iter().flat_map(|n| n.children());
    nodes
        .filter(|n| matches!(name(*n), "Mesh" | "MeshInstance"))
        .map(|node| {
            let own = transformations.of(file, node)?;
            let base = (name(node) == "MeshInstance").then(|| base(file, node)).transpose()?;
            Ok(Object { node, own, base })
        })
        .collect()
}

fn base(file: File, node: Node) -> Result<Base, LoadError> {
    let missing = || file.error(node, "expected an attribute `baseMeshId`");
    let reset = match node.attribute("resetTransform") {
        None | Some("false") => false,
        Some("true") => true,
        Some(other) => {
            let problem = format!("resetTransform=\"{other}\": expected true or false");
            return Err(file.error(node, problem));
        }
    };
    let id = file.attribute(node, "baseMeshId")?.ok_or_else(missing)?;
    Ok(Base { id, reset })
}

fn ids(file: File, objects: &[Object]) -> Result<Ids, LoadError> {
    let mut ids = Ids::new();
    for (number, object) in objects.iter().enumerate() {
        if let Some(id) = file.attribute::<u32>(object.node, "id")? {
            ids.entry(id).and_modify(|known| *known = None).or_insert(Some(number));
        }
    }
    Ok(ids)
}

/// The mesh that object `number` shows, and where: follows the chain of instances.
fn resolve(
    file: File,
    objects: &[Object],
    ids: &Ids,
    number: usize,
) -> Result<(usize, DAffine3), LoadError> {
    let mut map = DAffine3::IDENTITY;
    let (mut at, mut reset) = (number, false);
    for _ in 0..=objects.len() {
        let object = &objects[at];
        if !reset {
            map *= object.own;
        }
        let Some(base) = &object.base else { return Ok((at, map)) };
        reset |= base.reset;
        let error = |what| file.error(object.node, format!("baseMeshId {}: {what}", base.id));
        at = match ids.get(&base.id) {
            Some(Some(next)) => *next,
            Some(None) => return Err(error("several meshes have this id")),
            None => return Err(error("no mesh has this id")),
        };
    }
    Err(file.error(objects[number].node, "the instances refer to each other in a circle"))
}
