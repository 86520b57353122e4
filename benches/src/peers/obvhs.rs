//! obvhs: its compressed eight-wide tree, with triangles in the order of the tree.

use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle;
use raykern::Ray;
use raykern_harness::model::Model;

use super::Library;

/// With the preset `medium_build`.
pub struct Medium(Tree);
/// With the preset `slow_build`.
pub struct Slow(Tree);

struct Tree {
    tree: CwBvh,
    triangles: Vec<Triangle>,
}

impl Tree {
    fn build(model: &Model, params: BvhBuildParams) -> Self {
        let given: Vec<Triangle> = super::triangles(model)
            .map(|corners| corners.map(Into::into))
            .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
            .collect();
        let tree = build_cwbvh_from_tris(&given, params, &mut Duration::default());
        let triangles = tree.primitive_indices.iter().map(|&i| given[i as usize]).collect();
        Tree { tree, triangles }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.tree.nodes[..])
            + size_of_val(&self.tree.primitive_indices[..])
            + size_of_val(&self.triangles[..])
    }

    fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
        let mut hit = RayHit::none();
        let found = self
            .tree
            .ray_traverse(theirs(ray), &mut hit, |ray, i| self.triangles[i].intersect(ray));
        found.then(|| (hit.t, self.tree.primitive_indices[hit.primitive_id as usize]))
    }

    fn any(&self, ray: &Ray) -> bool {
        !self.tree.ray_traverse_miss(theirs(ray), |ray, i| self.triangles[i].intersect(ray))
    }
}

fn theirs(ray: &Ray) -> ObvhsRay {
    ObvhsRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}

/// Both presets differ in their build alone.
macro_rules! preset {
    ($name:ident, $params:ident) => {
        impl Library for $name {
            fn build(model: &Model) -> Result<Self, String> {
                Ok($name(Tree::build(model, BvhBuildParams::$params())))
            }

            fn bytes(&self) -> Option<usize> {
                Some(self.0.bytes())
            }

            fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
                self.0.closest(ray)
            }

            fn any(&self, ray: &Ray) -> bool {
                self.0.any(ray)
            }
        }
    };
}

preset!(Medium, medium_build);
preset!(Slow, slow_build);
