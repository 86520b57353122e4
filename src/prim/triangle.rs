//! Ray against triangle: filters in `f64`, and real arithmetic where they are unsure.

use glam::DVec3;

use crate::exact::{self, Distance, Meeting};
use crate::math::rounding::{UNIT, gamma};
use crate::math::{sum_abs, wide};
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
/// Exact: hit or miss and the side are those of real arithmetic, for all finite inputs. `t` is within
/// `t_error`. A ray parallel to the plane misses.
///
/// The sign of `d . (p x q)` says on which side of the edge from `p` to `q`, both relative to the
/// origin, the line passes. It is computed as `d . ((p + q) x (q - p)) / 2`, whose error grows with
/// the edge and not with the distance: eight roundings, of products whose sums are at most
/// `|d| (|p| + |q|) |q - p|` in the norm of absolute sums. What is not larger than that bound is
/// computed again without error.
///
/// Source: \[DEG12\]; the filter after \[She97\].
pub(crate) fn intersect(ray: &PreparedRay, triangle: [[f32; 3]; 3]) -> Option<TriangleHit> {
    let [a, b, c] = triangle.map(wide);
    let o = ray.origin;
    let (ra, rb, rc) = (a - o, b - o, c - o);
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let edge = |p: DVec3, q: DVec3, pq: DVec3| ray.direction.dot((p + q).cross(pq));
    let (u, v, w) = (edge(rc, ra, ca), edge(ra, rb, ab), edge(rb, rc, bc));
    let (least, most) = (u.min(v).min(w), u.max(v).max(w));
    let reach = sum_abs(ra).max(sum_abs(rb)).max(sum_abs(rc));
    let side = sum_abs(ab).max(sum_abs(bc)).max(sum_abs(ca));
    let bound = gamma(10) * ray.direction_size * 2.0 * reach * side;
    if least < -bound && most > bound {
        return None;
    }
    let sure = least > bound || most < -bound;
    let [u, v, w] = if sure { [u, v, w] } else { exact_volumes(ray, triangle)? };
    let (t, t_error) = plane(ray, triangle)?;
    let sum = u + v + w;
    Some(TriangleHit { t, t_error, weights: [u / sum, v / sum], front: sum < 0.0 })
}

/// The volumes, if all that are not zero have one sign; each within one unit in the last place.
fn exact_volumes(ray: &PreparedRay, triangle: [[f32; 3]; 3]) -> Option<[f64; 3]> {
    let volumes = exact::volumes(&ray.line(), triangle);
    let (below, above) = (volumes.iter().any(|v| *v < 0.0), volumes.iter().any(|v| *v > 0.0));
    (below != above).then_some(volumes)
}

/// The `t` at which the ray meets the triangle's plane, and a bound on its error.
fn plane(ray: &PreparedRay, triangle: [[f32; 3]; 3]) -> Option<(f64, f64)> {
    let [a, b, c] = triangle.map(wide);
    let (e1, e2) = (b - a, c - a);
    let n = e1.cross(e2);
    let to_plane = a - ray.origin;
    let along = ray.direction.dot(n);
    // Four roundings in `n`, one in `to_plane`, three in either dot product.
    let size = gamma(8) * sum_abs(e1) * sum_abs(e2);
    let along_error = ray.direction_size * size;
    let t = to_plane.dot(n) / along;
    if 1024.0 * along_error < along.abs() {
        let t_error = (sum_abs(to_plane) * size + t.abs() * along_error) / along.abs();
        // A hundredth for the divisor's own error, and the rounding of the quotient.
        return Some((t, 1.01 * t_error + 2.0 * UNIT * t.abs()));
    }
    Some(Distance::new(&ray.line(), &Meeting::Triangle(triangle))?.approximate())
}

/// Whether the triangle has area. Exact for all finite vertices.
pub(crate) fn has_area(triangle: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = triangle.map(wide);
    let (e1, e2) = (b - a, c - a);
    let surely = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (p, q) = (e1[i] * e2[j], e1[j] * e2[i]);
        // Three roundings a product and one for the difference.
        (p - q).abs() > 2.0 * gamma(4) * (p.abs() + q.abs())
    };
    (0..3).any(surely) || exact::has_area(triangle)
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
