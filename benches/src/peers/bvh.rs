//! The crate bvh: a binary tree that yields candidates by distance; the triangle test is ours.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use glam::Vec3;
use nalgebra::{Point3, Vector3};
use raykern::Ray;
use raykern_harness::model::Model;

use super::Library;

/// The tree and what it is over.
pub struct Tree {
    tree: Bvh<f32, 3>,
    triangles: Vec<Triangle>,
}

struct Triangle {
    corners: [Vec3; 3],
    number: u32,
    node: usize,
}

impl Bounded<f32, 3> for Triangle {
    fn aabb(&self) -> Aabb<f32, 3> {
        let [a, b, c] = self.corners;
        let point = |v: Vec3| Point3::new(v.x, v.y, v.z);
        Aabb::with_bounds(point(a.min(b).min(c)), point(a.max(b).max(c)))
    }
}

impl BHShape<f32, 3> for Triangle {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Triangle {
    /// Moeller and Trumbore's test.
    fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let [a, b, c] = self.corners;
        let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let inverse = 1.0 / ab.dot(p);
        let s = origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(ab);
        let v = direction.dot(q) * inverse;
        let t = ac.dot(q) * inverse;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.t_min && t <= t_max).then_some(t)
    }
}

/// Their ray, and how many of our `t` are one of theirs: its direction is made a unit vector.
fn theirs(ray: &Ray) -> (bvh::ray::Ray<f32, 3>, f32) {
    let [origin, direction] = [ray.origin, ray.direction].map(Vector3::from);
    (bvh::ray::Ray::new(origin.into(), direction), direction.norm())
}

impl Library for Tree {
    fn build(model: &Model) -> Result<Self, String> {
        let triangle = |(number, corners): (usize, [[f32; 3]; 3])| Triangle {
            corners: corners.map(Vec3::from),
            number: number as u32,
            node: 0,
        };
        let mut triangles: Vec<_> = super::triangles(model).enumerate().map(triangle).collect();
        let tree = Bvh::build(&mut triangles);
        Ok(Tree { tree, triangles })
    }

    fn bytes(&self) -> Option<usize> {
        Some(size_of_val(&self.tree.nodes[..]) + size_of_val(&self.triangles[..]))
    }

    fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
        let (their_ray, length) = theirs(ray);
        let mut best = None;
        let mut t_best = ray.t_max;
        // Candidates come nearest box first: one whose box begins behind the best hit is the end.
        for triangle in self.tree.nearest_traverse_iterator(&their_ray, &self.triangles) {
            if let Some(t) = triangle.intersect(ray, t_best) {
                t_best = t;
                best = Some((t, triangle.number));
            }
            let begins = their_ray.intersection_slice_for_aabb(&triangle.aabb());
            if begins.is_some_and(|(near, _)| near > t_best * length) {
                break;
            }
        }
        best
    }

    fn any(&self, ray: &Ray) -> bool {
        let (their_ray, _) = theirs(ray);
        let mut candidates = self.tree.traverse_iterator(&their_ray, &self.triangles);
        candidates.any(|triangle| triangle.intersect(ray, ray.t_max).is_some())
    }
}
