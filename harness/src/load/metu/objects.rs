//! What there is to hit: meshes, instances of meshes, lone triangles and spheres.

use std::collections::{BTreeMap, HashMap};

use glam::{DAffine3, DVec3};
use roxmltree::Node;

use super::chain;
use super::transform::Transformations;
use super::xml::{File, child, group};
use crate::assembly::{Assembly, Place, moved_sphere};
use crate::load::{LoadError, load_mesh};
use crate::model::{Model, TriangleMesh};

/// The geometry of a scene, and the numbers of its materials.
///
/// Geometries: each mesh that is shown once in the order of the file, then the lone triangles of each
/// material as one mesh, then the spheres of each material as one set. Places: those of meshes in the order of the file, then
/// ellipsoids.
#[derive(Default)]
pub struct Objects {
    pub model: Assembly,
    pub geometry_material: Vec<usize>,
    pub place_material: Vec<usize>,
}

/// What all objects refer to.
struct Context<'a> {
    file: File<'a>,
    vertices: Vec<[f32; 3]>,
    transformations: Transformations,
    material_count: usize,
}

/// A mesh that may be shown more than once.
enum Shared {
    /// By instances of this child.
    Child(usize),
    /// By copies: it has few triangles, or is shown once.
    Copied(TriangleMesh),
}

/// With fewer triangles copies take little more memory than instances, some 210 bytes each, and are faster.
const FEW: usize = 16;

/// The geometry under `scene`.
pub fn read(file: File, scene: Node, material_count: usize) -> Result<Objects, LoadError> {
    let context = Context {
        file,
        vertices: vertex_data(file, scene)?,
        transformations: Transformations::read(file, scene)?,
        material_count,
    };
    let mut objects = Objects::default();
    context.meshes(scene, &mut objects)?;
    for (material, triangles) in context.triangles(scene)? {
        objects.mesh(triangles, material);
    }
    context.spheres(scene, &mut objects)?;
    Ok(objects)
}

impl Objects {
    fn mesh(&mut self, mesh: TriangleMesh, material: usize) {
        self.model.own.meshes.push(mesh);
        self.geometry_material.push(material);
    }

    fn child(&mut self, child: Model) -> usize {
        self.model.children.push(child);
        self.model.children.len() - 1
    }

    fn place(&mut self, place: Place, material: usize) {
        self.model.places.push(place);
        self.place_material.push(material);
    }

    /// Keeps a mesh that will be shown so many times.
    fn share(&mut self, mesh: TriangleMesh, times: usize) -> Shared {
        match times == 1 || mesh.indices.len() < FEW {
            true => Shared::Copied(mesh),
            false => Shared::Child(self.child(mesh.into())),
        }
    }

    /// Shows a mesh once more.
    fn show(&mut self, shared: &Shared, map: &DAffine3, material: usize) {
        match shared {
            Shared::Copied(mesh) => self.mesh(mesh.placed_by(map), material),
            Shared::Child(child) => match Place::new(*child, map) {
                Some(place) => self.place(place, material),
                // Flat ones have no place.
                None => {
                    let flat = self.model.children[*child].meshes[0].placed_by(map);
                    self.mesh(flat, material);
                }
            },
        }
    }
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
    fn meshes(&self, scene: Node, objects: &mut Objects) -> Result<(), LoadError> {
        let shown = chain::read(self.file, scene, &self.transformations)?;
        let mut times = HashMap::<usize, usize>::new();
        shown.iter().for_each(|(_, mesh, _)| *times.entry(*mesh).or_default() += 1);
        let mut shared = HashMap::<usize, Shared>::new();
        for (object, mesh, map) in &shown {
            let material = self.material(object.node)?;
            let known = match shared.remove(mesh) {
                Some(known) => known,
                None => objects.share(self.faces(shown[*mesh].0.node)?, times[mesh]),
            };
            objects.show(&known, map, material);
            shared.insert(*mesh, known);
        }
        Ok(())
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
            meshes.entry(self.material(object)?).or_default().append(&triangle.placed_by(&map));
        }
        Ok(meshes)
    }

    /// The spheres, those of each material as one set, and ellipsoids at places of one unit sphere.
    fn spheres(&self, scene: Node, objects: &mut Objects) -> Result<(), LoadError> {
        let mut sets: BTreeMap<usize, Vec<[f32; 4]>> = BTreeMap::new();
        let mut unit = None;
        for object in group(scene, "Objects", "Sphere") {
            let (centre, radius) = self.sphere(object)?;
            let map = self.transformations.of(self.file, object)?;
            let material = self.material(object)?;
            if let Some(sphere) = moved_sphere(centre, radius, &map) {
                sets.entry(material).or_default().push(sphere);
                continue;
            }
            let one = || Model { meshes: vec![], sphere_sets: vec![vec![[0.0, 0.0, 0.0, 1.0]]] };
            let unit = *unit.get_or_insert_with(|| objects.child(one()));
            let centre = DAffine3::from_translation(DVec3::from(centre.map(f64::from)));
            let grown = map * centre * DAffine3::from_scale(DVec3::splat(radius));
            let place = Place::new(unit, &grown)
                .ok_or_else(|| self.file.error(object, "an ellipsoid without volume"))?;
            objects.place(place, material);
        }
        for (material, spheres) in sets {
            objects.model.own.sphere_sets.push(spheres);
            objects.geometry_material.push(material);
        }
        Ok(())
    }

    /// Centre and radius of a `<Sphere>`, before any map.
    fn sphere(&self, object: Node) -> Result<([f32; 3], f64), LoadError> {
        let node = self.file.child(object, "Center")?;
        let numbers = self.file.list::<i64>(node)?;
        let [number] = numbers.as_slice() else {
            let problem = format!("{} numbers: expected one vertex number", numbers.len());
            return Err(self.file.error(node, problem));
        };
        let centre = self.vertices[self.vertex(node, *number)?];
        Ok((centre, self.file.number(self.file.child(object, "Radius")?)?))
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
