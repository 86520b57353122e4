//! Ray against triangle in `f64`.

use core::cmp::Ordering;

use glam::DVec3;

use crate::math::expansion::sign_of_sum;
use crate::math::rounding::{UNIT, gamma};
use crate::math::wide;
use crate::ray::PreparedRay;

/// Where a ray's line meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleHit {
    pub t: f64,
    pub t_error: f64,
    /// Weights of the second and the third vertex.
    pub weights: [f64; 2],
    pub front: bool,
}

/// The meeting of the ray's line with the closed triangle, whatever its `t`.
///
/// Best effort for this version: signs are those of `f64` arithmetic. They are computed from each
/// edge's two vertices in a form that only changes its sign when the vertices change places, so a
/// ray cannot pass between two triangles that share an edge. `t` depends on the set of the three
/// vertices alone, not on their order, and triangles in one axis-parallel plane get the same `t`.
///
/// Weights: `d . (p x q)` for the edge from `p` to `q`, both relative to the origin, as
/// `d . ((p + q) x (q - p)) / 2`, whose error grows with the edge and not with the distance.
/// Source: \[DEG12\]; the antisymmetric form is that of Pluecker coordinates.
pub(crate) fn intersect(ray: &PreparedRay, triangle: [[f32; 3]; 3]) -> Option<TriangleHit> {
    let [a, b, c] = triangle.map(wide);
    let o = ray.origin;
    let (ra, rb, rc) = (a - o, b - o, c - o);
    let edge = |p: DVec3, q: DVec3, pq: DVec3| ray.direction.dot((p + q).cross(pq));
    let u = edge(rc, ra, a - c);
    let v = edge(ra, rb, b - a);
    let w = edge(rb, rc, c - b);
    let outside = u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0;
    let sum = u + v + w;
    if outside || sum == 0.0 {
        return None;
    }
    let (t, t_error) = plane(ray, triangle)?;
    Some(TriangleHit { t, t_error, weights: [u / sum, v / sum], front: sum < 0.0 })
}

/// The `t` at which the ray meets the triangle's plane, and a bound on its error.
fn plane(ray: &PreparedRay, mut triangle: [[f32; 3]; 3]) -> Option<(f64, f64)> {
    // The same arithmetic for every order of the vertices: least first.
    let less = |p: &[f32; 3], q: &[f32; 3]| p.partial_cmp(q).unwrap_or(Ordering::Equal);
    triangle.sort_unstable_by(less);
    let [a, b, c] = triangle.map(wide);
    let (e1, e2) = (b - a, c - a);
    let n = e1.cross(e2);
    let to_plane = a - ray.origin;
    // In an axis-parallel plane two components are exactly zero, and the third cancels.
    let axis = (0..3).find(|&k| n[(k + 1) % 3] == 0.0 && n[(k + 2) % 3] == 0.0);
    if let Some(k) = axis {
        let t = to_plane[k] / ray.direction[k];
        return t.is_finite().then_some((t, gamma(3) * t.abs()));
    }
    let along = ray.direction.dot(n);
    let t = to_plane.dot(n) / along;
    // Each of the two dot products has a relative error of a few units of its largest terms.
    let size = sum_abs(e1) * sum_abs(e2);
    let reach = sum_abs(to_plane) + t.abs() * sum_abs(ray.direction);
    let t_error = 16.0 * UNIT * size * reach / along.abs();
    t.is_finite().then_some((t, t_error))
}

fn sum_abs(v: DVec3) -> f64 {
    let v = v.abs();
    v.x + v.y + v.z
}

/// Whether the triangle has area. Exact for all finite vertices.
pub(crate) fn has_area(triangle: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = triangle.map(wide);
    let (e1, e2) = (b - a, c - a);
    (0..3).any(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (p, q) = (e1[i] * e2[j], e1[j] * e2[i]);
        // Three roundings a product and one for the difference.
        if (p - q).abs() > 2.0 * gamma(4) * (p.abs() + q.abs()) {
            return true;
        }
        // Every product of two floats is exact in f64; `a[i] * a[j]` cancels.
        let terms =
            [b[i] * c[j], -(b[i] * a[j]), -(a[i] * c[j]), -(b[j] * c[i]), b[j] * a[i], a[j] * c[i]];
        sign_of_sum(terms) != Ordering::Equal
    })
}

/// The unit normal `(b - a) x (c - a)`, within a few ulp for triangles that are not slivers.
pub(crate) fn normal(triangle: [[f32; 3]; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(wide);
    (b - a).cross(c - a).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;

    const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn meet(origin: [f32; 3], direction: [f32; 3]) -> Option<TriangleHit> {
        intersect(&Ray::new(origin, direction).prepare().expect("a valid ray"), TRIANGLE)
    }

    #[test]
    fn weights_belong_to_the_second_and_third_vertex() {
        let hit = meet([0.5, 0.125, 2.0], [0.0, 0.0, -0.5]).expect("a hit");
        assert_eq!((hit.t, hit.weights, hit.front), (4.0, [0.5, 0.125], true));
        let behind = meet([0.5, 0.125, -2.0], [0.0, 0.0, 1.0]).expect("a hit");
        assert_eq!((behind.t, behind.weights, behind.front), (2.0, [0.5, 0.125], false));
    }

    #[test]
    fn the_boundary_belongs_to_the_triangle() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.25, 0.0)] {
            assert!(meet([x, y, 1.0], [0.0, 0.0, -1.0]).is_some(), "{x} {y}");
        }
        assert!(meet([0.5, 0.5f32.next_up(), 1.0], [0.0, 0.0, -1.0]).is_none());
        assert!(meet([0.25, -1e-30, 1.0], [0.0, 0.0, -1.0]).is_none());
    }

    #[test]
    fn a_ray_in_the_plane_misses() {
        assert!(meet([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]).is_none());
        assert!(meet([-1.0, 0.25, 1.0], [1.0, 0.0, 0.0]).is_none());
    }

    #[test]
    fn area_is_decided_exactly() {
        assert!(has_area(TRIANGLE));
        assert!(!has_area([[0.1, 0.2, 0.3]; 3]));
        assert!(!has_area([[0.0; 3], [1e-3, 2e-3, 3e-3], [2e-3, 4e-3, 6e-3]]));
        // One ulp beside the line, far from the origin.
        let far = [[1e6, 1e6, 0.0], [1e6 + 1.0, 1e6 + 1.0, 0.0], [1e6 + 2.0, 1e6 + 2.0, 0.0]];
        assert!(!has_area(far));
        let mut beside = far;
        beside[2][1] = beside[2][1].next_up();
        assert!(has_area(beside));
        assert!(has_area([[0.0; 3], [1e-44, 0.0, 0.0], [0.0, 1e-44, 0.0]]));
        assert!(has_area([[-3e38, 0.0, 0.0], [3e38, 0.0, 0.0], [0.0, 3e38, 0.0]]));
    }
}
