//! Geometry that the harness owns, and the scene that the core reads from it.

use raykern::{Mesh, Scene, SphereSet};

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub vertices: Vec<[f32; 3]>,
    /// Three vertex numbers a triangle.
    pub indices: Vec<[u32; 3]>,
}

/// Meshes and sphere sets: geometries `0 .. meshes.len()`, then the sphere sets.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The meshes.
    pub meshes: Vec<TriangleMesh>,
    /// Each set of spheres, `[x, y, z, radius]`.
    pub sphere_sets: Vec<Vec<[f32; 4]>>,
}

impl Model {
    /// Calls `f` with the scene that borrows this model.
    pub fn with_scene<R>(&self, f: impl FnOnce(&Scene<'_, 'static>) -> R) -> R {
        self.with_masked_scene(&[], f)
    }

    /// The same with mask `masks[i]` on geometry `i`; missing ones are 0.
    pub fn with_masked_scene<R>(
        &self,
        masks: &[u32],
        f: impl FnOnce(&Scene<'_, 'static>) -> R,
    ) -> R {
        let mut masks = masks.iter().copied().chain(std::iter::repeat(0));
        let mut next = || masks.next().unwrap_or(0);
        let meshes: Vec<Mesh> = (self.meshes.iter())
            .map(|m| Mesh::indexed(&m.vertices, &m.indices).with_mask(next()))
            .collect();
        let sphere_sets: Vec<SphereSet> =
            self.sphere_sets.iter().map(|s| SphereSet::new(s).with_mask(next())).collect();
        f(&Scene::new(&meshes, &sphere_sets))
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.meshes.iter().map(|m| m.indices.len()).sum()
    }

    /// The number of spheres.
    pub fn sphere_count(&self) -> usize {
        self.sphere_sets.iter().map(Vec::len).sum()
    }
}
