//! Models shown in places: what a scene with instances is made of, and the same scene without them.

use glam::{DAffine3, DMat3, DVec3};
use raykern::{BuildError, Instance, Mesh, OwnedAccel, Scene, SphereSet};

use crate::model::{Model, TriangleMesh};

/// A model, and others that are stored once each and shown in any number of places.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// What stands where it is.
    pub own: Model,
    /// What is shown elsewhere.
    pub children: Vec<Model>,
    /// Where, in the order of the instances.
    pub places: Vec<Place>,
}

/// One child at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The number of the child.
    pub child: usize,
    /// Three rows of four, as the core takes them.
    pub object_to_world: [f32; 12],
}

impl From<Model> for Assembly {
    fn from(own: Model) -> Self {
        Assembly { own, ..Default::default() }
    }
}

impl Place {
    /// Child `child`, mapped by `map` with each number rounded; `None` if that leaves no volume, or hardly any, which no
    /// instance can have.
    pub fn new(child: usize, map: &DAffine3) -> Option<Self> {
        let [a, b, c] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
        let most = a.length() * b.length() * c.length();
        let rows = [0, 1, 2].map(|k| [a[k], b[k], c[k], map.translation[k]].map(|x| x as f32));
        let object_to_world = *rows.as_flattened().first_chunk()?;
        let finite = object_to_world.iter().all(|x| x.is_finite());
        // Written so that a NaN is refused.
        let spacious = map.matrix3.determinant().abs() > 1e-6 * most;
        (finite && spacious).then_some(Place { child, object_to_world })
    }

    /// The map, as it was rounded.
    pub fn map(&self) -> DAffine3 {
        let m = self.object_to_world.map(f64::from);
        let column = |k: usize| DVec3::new(m[k], m[4 + k], m[8 + k]);
        DAffine3::from_mat3_translation(
            DMat3::from_cols(column(0), column(1), column(2)),
            column(3),
        )
    }
}

impl Assembly {
    /// Builds each child and all over them with `build`, as one block that borrows nothing.
    pub fn build(
        &self,
        build: impl for<'c> Fn(&Scene<'_, 'c>) -> Result<OwnedAccel<'c>, BuildError>,
    ) -> Result<OwnedAccel<'static>, BuildError> {
        if self.places.is_empty() {
            return self.own.with_scene(&build);
        }
        let children = self.children.iter().map(|child| child.with_scene(&build));
        let children = children.collect::<Result<Vec<_>, _>>()?;
        self.with_scene_over(&children, |scene| build(scene)?.packed())
    }

    /// Calls `f` with the scene that shows `children`, built over the models of this name.
    pub fn with_scene_over<'c, R>(
        &self,
        children: &'c [OwnedAccel],
        f: impl FnOnce(&Scene<'_, 'c>) -> R,
    ) -> R {
        let shown =
            |place: &Place| Instance::new(&children[place.child].accel(), place.object_to_world);
        let instances: Vec<_> = self.places.iter().map(shown).collect();
        let meshes: Vec<_> =
            self.own.meshes.iter().map(|m| Mesh::indexed(&m.vertices, &m.indices)).collect();
        let sphere_sets: Vec<_> = self.own.sphere_sets.iter().map(|s| SphereSet::new(s)).collect();
        f(&Scene::new(&meshes, &sphere_sets).with_instances(&instances))
    }

    /// The number of triangles that are stored.
    pub fn triangle_count(&self) -> usize {
        self.all().map(Model::triangle_count).sum()
    }

    /// The number of spheres that are stored.
    pub fn sphere_count(&self) -> usize {
        self.all().map(Model::sphere_count).sum()
    }

    fn all(&self) -> impl Iterator<Item = &Model> {
        [&self.own].into_iter().chain(&self.children)
    }

    /// The number of triangles that are seen.
    pub fn shown_triangle_count(&self) -> usize {
        let shown = self.places.iter().map(|place| self.children[place.child].triangle_count());
        self.own.triangle_count() + shown.sum::<usize>()
    }

    /// The same without places, every vertex mapped in `f64` and rounded once: its own meshes and those of each place, then its
    /// own sphere sets and those of each place. `None` if one of them is an ellipsoid.
    pub fn flattened(&self) -> Option<Model> {
        let mut flat = self.own.clone();
        for place in &self.places {
            let Model { meshes, sphere_sets } = self.children[place.child].placed(&place.map())?;
            flat.meshes.extend(meshes);
            flat.sphere_sets.extend(sphere_sets);
        }
        Some(flat)
    }
}

impl Model {
    /// The same model elsewhere; `None` if that makes an ellipsoid of a sphere.
    fn placed(&self, map: &DAffine3) -> Option<Model> {
        let meshes = self.meshes.iter().map(|mesh| mesh.placed_by(map)).collect();
        let moved = |&[x, y, z, r]: &[f32; 4]| moved_sphere([x, y, z], f64::from(r), map);
        let set = |spheres: &Vec<_>| spheres.iter().map(moved).collect();
        let sphere_sets = self.sphere_sets.iter().map(set).collect::<Option<_>>()?;
        Some(Model { meshes, sphere_sets })
    }
}

impl TriangleMesh {
    /// The mesh with every vertex mapped in `f64` and rounded; unchanged bits under the identity.
    pub fn placed_by(&self, map: &DAffine3) -> TriangleMesh {
        if *map == DAffine3::IDENTITY {
            return self.clone();
        }
        self.clone().mapped(|p| map.transform_point3(DVec3::from(p)).to_array())
    }
}

/// The sphere that `map` makes of a sphere, unless that is an ellipsoid.
pub fn moved_sphere(centre: [f32; 3], radius: f64, map: &DAffine3) -> Option<[f32; 4]> {
    let scale = even_scale(map)?;
    let centre = map.transform_point3(DVec3::from(centre.map(f64::from)));
    let [x, y, z] = centre.as_vec3().to_array();
    Some([x, y, z, (radius * scale) as f32])
}

/// The factor by which `map` scales all lengths, or `None` when it scales unevenly.
///
/// "Evenly" leaves room for the rounding of rotations to `f32`: 1e-6 of the square of the factor.
fn even_scale(map: &DAffine3) -> Option<f64> {
    let product = map.matrix3.transpose() * map.matrix3;
    let square = product.x_axis.x;
    let error = product - DMat3::from_diagonal(DVec3::splat(square));
    let worst = error.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    (worst <= 1e-6 * square).then(|| square.sqrt())
}
