//! parry: its triangle mesh with a tree inside.

use parry3d::math::Vector;
use parry3d::query::{Ray as ParryRay, RayCast};
use parry3d::shape::TriMesh;
use raykern::Ray;
use raykern_harness::model::Model;

use super::Library;

/// All meshes as one.
pub struct Mesh(TriMesh);

fn vector([x, y, z]: [f32; 3]) -> Vector {
    Vector::new(x, y, z)
}

fn theirs(ray: &Ray) -> ParryRay {
    ParryRay::new(vector(ray.origin), vector(ray.direction))
}

impl Library for Mesh {
    fn build(model: &Model) -> Result<Self, String> {
        let mut vertices = Vec::new();
        let mut indices = Vec::new();
        for mesh in &model.meshes {
            let base = vertices.len() as u32;
            vertices.extend(mesh.vertices.iter().copied().map(vector));
            indices.extend(mesh.indices.iter().map(|triangle| triangle.map(|v| v + base)));
        }
        TriMesh::new(vertices, indices).map(Mesh).map_err(|error| error.to_string())
    }

    fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
        self.0.cast_local_ray(&theirs(ray), ray.t_max, false).map(|t| (t, 0))
    }

    fn any(&self, ray: &Ray) -> bool {
        self.0.intersects_local_ray(&theirs(ray), ray.t_max)
    }
}
