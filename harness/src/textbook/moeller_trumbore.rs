//! Moeller and Trumbore's test, in `f32` and in `f64`.
//!
//! Without the paper's epsilon for the determinant, 1e-6, which would lose every triangle smaller than a thousandth.

use glam::{DVec3, Vec3};
use raykern::Ray;

use super::{TriangleTest, within};

/// The test in `f32`: a corner and two edges.
#[derive(Debug)]
pub struct MoellerTrumbore {
    corner: Vec3,
    edges: [Vec3; 2],
}

impl TriangleTest for MoellerTrumbore {
    type Line = (Vec3, Vec3);

    fn new(corners: [[f32; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3::from);
        MoellerTrumbore { corner: a, edges: [b - a, c - a] }
    }

    fn line(ray: &Ray) -> Self::Line {
        (ray.origin.into(), ray.direction.into())
    }

    fn meet(&self, &(origin, direction): &Self::Line, t_min: f32, t_max: f32) -> Option<f32> {
        let [e1, e2] = self.edges;
        let p = direction.cross(e2);
        let determinant = e1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let s = origin - self.corner;
        let u = s.dot(p) * inverse;
        let q = s.cross(e1);
        let v = direction.dot(q) * inverse;
        if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
            return None;
        }
        within(e2.dot(q) * inverse, t_min, t_max)
    }
}

/// The test in `f64`; the limits are held against its `f64` `t`, which is then rounded.
#[derive(Debug)]
pub struct MoellerTrumboreF64 {
    corner: DVec3,
    edges: [DVec3; 2],
}

impl TriangleTest for MoellerTrumboreF64 {
    type Line = (DVec3, DVec3);

    fn new(corners: [[f32; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(|v| DVec3::from(v.map(f64::from)));
        MoellerTrumboreF64 { corner: a, edges: [b - a, c - a] }
    }

    fn line(ray: &Ray) -> Self::Line {
        (DVec3::from(ray.origin.map(f64::from)), DVec3::from(ray.direction.map(f64::from)))
    }

    fn meet(&self, &(origin, direction): &Self::Line, t_min: f32, t_max: f32) -> Option<f32> {
        let [e1, e2] = self.edges;
        let p = direction.cross(e2);
        let determinant = e1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let s = origin - self.corner;
        let u = s.dot(p) * inverse;
        let q = s.cross(e1);
        let v = direction.dot(q) * inverse;
        let t = e2.dot(q) * inverse;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        (inside && t >= f64::from(t_min) && t <= f64::from(t_max)).then_some(t as f32)
    }
}
