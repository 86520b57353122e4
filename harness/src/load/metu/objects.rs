//! Meshes, instances of meshes, lone triangles and spheres.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use glam::{DAffine3, DVec3};
use roxmltree::Node;

use super::transform::{Transformations, even_scale};
use super::xml::{File, child, group, name};
use crate::load::{LoadError, load_mesh};
use crate::model::{Model, TriangleMesh};

/// What all objects refer to.
struct Context<'a> {
    file: File<'a>,
    vertices: Vec<[f32; 3]>,
    transformations: Transformations,
    material_count: usize,
}

/// A `<Mesh>` or a `<MeshInstance>` before it is flattened.
struct Object<'a, 'i> {
    node: Node<'a, 'i>,
    own: DAffine3,
    base: Option<Base>,
}

/// What an instance is an instance of.
struct Base {
    id: u32,
    reset: bool,
}

/// The geometry under `scene`, and for each geometry of it the number of its material.
///
/// Geometries: every mesh and instance in the order of the file, then the lone triangles of each
/// material as one mesh, then the spheres of each material as one set.
pub fn read(
    file: File,
    scene: Node,
    material_count: usize,
) -> Result<(Model, Vec<usize>), LoadError> {
    let context = Context {
        file,
        vertices: vertex_data(file, scene)?,
        transformations: Transformations::read(file, scene)?,
        material_count,
    };
    let mut model = Model::default();
    let mut geometry_material = Vec::new();
    context.meshes(scene, &mut model, &mut geometry_material)?;
    for (material, triangles) in context.triangles(scene)? {
        model.meshes.push(triangles);
        geometry_material.push(material);
    }
    for (material, spheres) in context.spheres(scene)? {
        model.sphere_sets.push(spheres);
        geometry_material.push(material);
    }
    Ok((model, geometry_material))
}

fn vertex_data(file: File, scene: Node) -> Result<Vec<[f32; 3]>, LoadError> {
    let Some(node) = child(scene, "VertexData") else { return Ok(Vec::new()) };
    let numbers = file.list::<f32>(node)?;
    let (vertices, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(file.error(node, format!("{} numbers: expected threes", numbers.len())));
    }
    Ok(vertices.to_vec())
}

impl Context<'_> {
    fn meshes(
        &self,
        scene: Node,
        model: &mut Model,
        geometry_material: &mut Vec<usize>,
    ) -> Result<(), LoadError> {
        let objects = self.objects(scene)?;
        let ids = ids(self.file, &objects)?;
        let mut loaded: HashMap<usize, TriangleMesh> = HashMap::new();
        for number in 0..objects.len() {
            let (source, map) = self.resolve(&objects, &ids, number)?;
            let mesh = match loaded.entry(source) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(self.faces(objects[source].node)?),
            };
            model.meshes.push(moved(mesh, &map));
            geometry_material.push(self.material(objects[number].node)?);
        }
        Ok(())
    }

    fn objects<'a, 'i>(&self, scene: Node<'a, 'i>) -> Result<Vec<Object<'a, 'i>>, LoadError> {
        let nodes = child(scene, "Objects").into_iter().flat_map(|n| n.children());
        nodes
            .filter(|n| matches!(name(*n), "Mesh" | "MeshInstance"))
            .map(|node| {
                let own = self.transformations.of(self.file, node)?;
                let base = (name(node) == "MeshInstance").then(|| self.base(node)).transpose()?;
                Ok(Object { node, own, base })
            })
            .collect()
    }

    fn base(&self, node: Node) -> Result<Base, LoadError> {
        let missing = || self.file.error(node, "expected an attribute `baseMeshId`");
        let reset = match node.attribute("resetTransform") {
            None | Some("false") => false,
            Some("true") => true,
            Some(other) => {
                let problem = format!("resetTransform=\"{other}\": expected true or false");
                return Err(self.file.error(node, problem));
            }
        };
        let id = self.file.attribute(node, "baseMeshId")?.ok_or_else(missing)?;
        Ok(Base { id, reset })
    }

    /// The mesh that object `number` shows, and where: follows the chain of instances.
    fn resolve(
        &self,
        objects: &[Object],
        ids: &HashMap<u32, Option<usize>>,
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
            let error =
                |what| self.file.error(object.node, format!("baseMeshId {}: {what}", base.id));
            at = match ids.get(&base.id) {
                Some(Some(next)) => *next,
                Some(None) => return Err(error("several meshes have this id")),
                None => return Err(error("no mesh has this id")),
            };
        }
        Err(self.file.error(objects[number].node, "the instances refer to each other in a circle"))
    }

    /// The triangles of a `<Mesh>`, with the vertices they use, as they are before any map.
    fn faces(&self, mesh: Node) -> Result<TriangleMesh, LoadError> {
        let node = self.file.child(mesh, "Faces")?;
        if let Some(relative) = node.attribute("plyFile") {
            let folder = self.file.0.parent().unwrap_or_else(|| "".as_ref());
            return load_mesh(&folder.join(relative)).map_err(|mut e| {
                e.problem += &format!(" (named in {})", self.file.0.display());
                e
            });
        }
        let numbers = self.file.list::<i64>(node)?;
        let (faces, rest) = numbers.as_chunks::<3>();
        if !rest.is_empty() {
            let problem = format!("{} vertex numbers: expected threes", numbers.len());
            return Err(self.file.error(node, problem));
        }
        let mut renumbered: HashMap<usize, u32> = HashMap::new();
        let mut result = TriangleMesh::default();
        let offset = self.file.attribute::<i64>(node, "vertexOffset")?.unwrap_or(0);
        for face in faces {
            let mut triangle = [0; 3];
            for (corner, number) in triangle.iter_mut().zip(face) {
                let vertex = self.vertex(node, number.saturating_add(offset))?;
                *corner = *renumbered.entry(vertex).or_insert_with(|| {
                    result.vertices.push(self.vertices[vertex]);
                    result.vertices.len() as u32 - 1
                });
            }
            result.indices.push(triangle);
        }
        Ok(result)
    }

    /// The lone triangles, by material.
    fn triangles(&self, scene: Node) -> Result<BTreeMap<usize, TriangleMesh>, LoadError> {
        let mut meshes: BTreeMap<usize, TriangleMesh> = BTreeMap::new();
        for object in group(scene, "Objects", "Triangle") {
            let node = self.file.child(object, "Indices")?;
            let numbers = self.file.list::<i64>(node)?;
            let offset = self.file.attribute::<i64>(node, "vertexOffset")?.unwrap_or(0);
            let [a, b, c] = numbers.as_slice() else {
                let problem = format!("{} vertex numbers: expected 3", numbers.len());
                return Err(self.file.error(node, problem));
            };
            let mut triangle = TriangleMesh { indices: vec![[0, 1, 2]], ..Default::default() };
            for number in [a, b, c] {
                let vertex = self.vertex(node, number.saturating_add(offset))?;
                triangle.vertices.push(self.vertices[vertex]);
            }
            let map = self.transformations.of(self.file, object)?;
            meshes.entry(self.material(object)?).or_default().append(&moved(&triangle, &map));
        }
        Ok(meshes)
    }

    /// The spheres, by material.
    fn spheres(&self, scene: Node) -> Result<BTreeMap<usize, Vec<[f32; 4]>>, LoadError> {
        let mut sets: BTreeMap<usize, Vec<[f32; 4]>> = BTreeMap::new();
        for object in group(scene, "Objects", "Sphere") {
            let node = self.file.child(object, "Center")?;
            let numbers = self.file.list::<i64>(node)?;
            let [number] = numbers.as_slice() else {
                let problem = format!("{} numbers: expected one vertex number", numbers.len());
                return Err(self.file.error(node, problem));
            };
            let center = self.vertices[self.vertex(node, *number)?];
            let radius = self.file.number(self.file.child(object, "Radius")?)?;
            let map = self.transformations.of(self.file, object)?;
            let sphere = moved_sphere(center, radius, &map).ok_or_else(|| {
                self.file.error(object, "not supported yet: ellipsoid (unevenly scaled sphere)")
            })?;
            sets.entry(self.material(object)?).or_default().push(sphere);
        }
        Ok(sets)
    }

    /// The number from zero of the vertex that `number` names.
    fn vertex(&self, node: Node, number: i64) -> Result<usize, LoadError> {
        let count = self.vertices.len();
        match usize::try_from(number) {
            Ok(n) if (1..=count).contains(&n) => Ok(n - 1),
            _ => Err(self.file.error(node, format!("vertex {number}: expected 1 to {count}"))),
        }
    }

    /// The number from zero of the material of `object`.
    fn material(&self, object: Node) -> Result<usize, LoadError> {
        let node = self.file.child(object, "Material")?;
        let [number] = self.file.whole::<1>(node)?;
        let count = self.material_count;
        match number as usize {
            n if (1..=count).contains(&n) => Ok(n - 1),
            _ => Err(self.file.error(node, format!("material {number}: expected 1 to {count}"))),
        }
    }
}

/// Which object an id means; `None` when several have it.
fn ids(file: File, objects: &[Object]) -> Result<HashMap<u32, Option<usize>>, LoadError> {
    let mut ids = HashMap::new();
    for (number, object) in objects.iter().enumerate() {
        if let Some(id) = file.attribute::<u32>(object.node, "id")? {
            ids.entry(id).and_modify(|known| *known = None).or_insert(Some(number));
        }
    }
    Ok(ids)
}

/// The mesh with every vertex mapped in f64 and rounded; unchanged bits under the identity.
fn moved(mesh: &TriangleMesh, map: &DAffine3) -> TriangleMesh {
    if *map == DAffine3::IDENTITY {
        return mesh.clone();
    }
    mesh.clone().mapped(|p| map.transform_point3(DVec3::from(p)).to_array())
}

/// The sphere `map` makes of a sphere, unless that is an ellipsoid.
fn moved_sphere(center: [f32; 3], radius: f64, map: &DAffine3) -> Option<[f32; 4]> {
    let scale = even_scale(map)?;
    let center = map.transform_point3(DVec3::from(center.map(f64::from)));
    let [x, y, z] = center.as_vec3().to_array();
    Some([x, y, z, (radius * scale) as f32])
}
