//! Ray against triangle: filters in `f64`, and real arithmetic where they are unsure.

use glam::DVec3;

use super::plane::{self, PlaneMeeting};
use crate::exact::{self, Line};
use crate::math::float::SLOW_F64;
use crate::math::rounding::{UNIT32, gamma};
use crate::math::wide::{cross, dot, minus};
use crate::math::{sum_abs, wide};

/// Where a ray's line meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleMeeting {
    pub t: f64,
    pub t_error: f64,
    /// The weights of the second and the third vertex, not yet between 0 and 1. Within 2^-25 if the line meets the triangle.
    pub weights: [f64; 2],
    pub front: bool,
    /// Whether it took real arithmetic to know.
    pub exact: bool,
}

/// A part of a triangle that a line was found to pass through.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Feature {
    /// Any point.
    Face,
    /// A point of the edge between two vertices.
    Edge([[f32; 3]; 2]),
    /// A vertex.
    Vertex([f32; 3]),
}

impl Feature {
    /// Whether one line through both meets both at the same `t`: where neighbours share a vertex or
    /// an edge. False says nothing.
    pub fn is_same(&self, other: &Feature) -> bool {
        match (self, other) {
            (Feature::Vertex(p), Feature::Vertex(q)) => p == q,
            (Feature::Edge([a, b]), Feature::Edge([c, d])) => {
                (a == c && b == d) || (a == d && b == c)
            }
            _ => false,
        }
    }

    /// Whether a triangle with these corners has it: then a line through it meets the triangle there or,
    /// parallel to it, nowhere.
    pub fn is_part_of(&self, corners: &[[f32; 3]; 3]) -> bool {
        match self {
            Feature::Face => false,
            Feature::Edge(ends) => ends.iter().all(|end| corners.contains(end)),
            Feature::Vertex(vertex) => corners.contains(vertex),
        }
    }
}

/// The meeting of the line with the closed triangle, whatever its `t`, and where on it, as far as that was asked.
///
/// Exact: hit or miss and the side are those of real arithmetic, for all finite inputs. `t` is within
/// `t_error`. A line parallel to the plane misses.
///
/// The sign of `d . (p x q)` says on which side of the edge from `p` to `q`, both relative to the
/// origin, the line passes. It is computed as `d . ((p + q) x (q - p)) / 2`, whose error grows with
/// the edge and not with the distance: eight roundings, of products whose sums are at most
/// `|d| (|p| + |q|) |q - p|` in the norm of absolute sums. What is not larger than that bound is
/// computed again without error; or all of it at once, where `f64` takes longer than integers.
///
/// Source: \[DEG12\]; the filter after \[She97\].
#[inline(always)]
pub(crate) fn meet(line: &Line, triangle: &[[f32; 3]; 3]) -> Option<(TriangleMeeting, Feature)> {
    let (feature, exact) = passed(line, triangle)?;
    let meeting = plane(line, triangle)?;
    Some((TriangleMeeting { exact: meeting.exact || exact, ..meeting }, feature))
}

/// Where on the triangle the line passes, and whether it took real arithmetic to know; `None` beside it.
#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
fn passed(line: &Line, triangle: &[[f32; 3]; 3]) -> Option<(Feature, bool)> {
    let sure = if SLOW_F64 { Some(false) } else { surely_met(line, *triangle) }?;
    Some(if sure { (Feature::Face, false) } else { (exactly_met(line, triangle)?, true) })
}

/// Whether the line surely passes between the edges; `None` when it surely does not.
#[inline(always)]
fn surely_met(line: &Line, triangle: [[f32; 3]; 3]) -> Option<bool> {
    let [u, v, w] = volumes(line, triangle);
    let (least, most) = (u.min(v).min(w), u.max(v).max(w));
    let bound = volume_error(line, triangle);
    let outside = least < -bound && most > bound;
    (!outside).then_some(least > bound || most < -bound)
}

/// Twice the volumes over the edges opposite to the second, the third and the first vertex.
pub(super) fn volumes(line: &Line, triangle: [[f32; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = triangle.map(wide);
    let (o, d) = (wide(line.origin), wide(line.direction));
    let (ra, rb, rc) = (minus(a, o), minus(b, o), minus(c, o));
    let edge = |p: DVec3, q: DVec3, pq: DVec3| dot(d, cross(p + q, pq));
    [edge(rc, ra, minus(a, c)), edge(ra, rb, minus(b, a)), edge(rb, rc, minus(c, b))]
}

/// What they may be off.
pub(super) fn volume_error(line: &Line, triangle: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = triangle.map(wide);
    let length = |p, q| sum_abs(minus(p, q));
    let [ra, rb, rc] = [a, b, c].map(|p| length(p, wide(line.origin)));
    let side = length(b, a).max(length(c, b)).max(length(a, c));
    let reach = ra.max(rb).max(rc);
    gamma(10) * sum_abs(wide(line.direction)) * 2.0 * reach * side
}

/// Which part of the triangle the line meets: it does when all volumes that are not zero have one sign.
fn exactly_met(line: &Line, triangle: &[[f32; 3]; 3]) -> Option<Feature> {
    let volumes = exact::volumes(line, triangle);
    let met = volumes.iter().any(|v| *v < 0.0) != volumes.iter().any(|v| *v > 0.0);
    // The line passes through the edge opposite to a vertex whose volume is zero.
    let [b, c, a] = volumes.map(|volume| volume == 0.0);
    let [p, q, r] = *triangle;
    met.then_some(match (a, b, c) {
        (false, false, false) => Feature::Face,
        (true, false, false) => Feature::Edge([q, r]),
        (false, true, false) => Feature::Edge([r, p]),
        (false, false, true) => Feature::Edge([p, q]),
        (_, true, true) => Feature::Vertex(p),
        (true, _, true) => Feature::Vertex(q),
        (true, true, _) => Feature::Vertex(r),
    })
}

/// In line where room is no matter.
#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
fn plane_meeting(line: &Line, [a, b, c]: &[[f32; 3]; 3]) -> PlaneMeeting<f64> {
    let wide = |[x, y, z]: [f32; 3]| [f64::from(x), f64::from(y), f64::from(z)];
    let apart = |p: &[f32; 3], q: &[f32; 3]| plane::minus(wide(*p), wide(*q));
    PlaneMeeting::new(wide(line.direction), apart(a, &line.origin), [apart(b, a), apart(c, a)])
}

/// The meeting of the line with the triangle's plane: all that is left to ask for a line that surely
/// passes between the edges. `None` when it is parallel.
#[cfg_attr(target_pointer_width = "64", inline)]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
pub(crate) fn plane(line: &Line, triangle: &[[f32; 3]; 3]) -> Option<TriangleMeeting> {
    clear_plane(line, triangle).or_else(|| exact_plane(line, triangle))
}

/// The same, or `None` where `f64` does not tell `t` and the weights.
#[inline(always)]
pub(crate) fn clear_plane(line: &Line, triangle: &[[f32; 3]; 3]) -> Option<TriangleMeeting> {
    let PlaneMeeting { t, t_error, weights, along, clear } = plane_meeting(line, triangle);
    let exact = false;
    (clear != 0).then_some(TriangleMeeting { t, t_error, weights, front: along < 0.0, exact })
}

/// The meeting with the plane, from numbers without error.
#[cold]
#[inline(never)]
fn exact_plane(line: &Line, triangle: &[[f32; 3]; 3]) -> Option<TriangleMeeting> {
    let (t, t_error) = exact::to_plane(line, triangle)?;
    // Where the triangle is met none of the volumes is of the other sign, so nothing cancels in their sum.
    let [u, v, w] = exact::volumes(line, triangle);
    let all = u + v + w;
    Some(TriangleMeeting { t, t_error, weights: [u / all, v / all], front: all < 0.0, exact: true })
}

/// Whether the triangle has area. Exact for all finite vertices.
#[inline]
pub(crate) fn has_area(triangle: [[f32; 3]; 3]) -> bool {
    surely_has_area(triangle) || has_area_in_doubt(triangle)
}

/// True only if the triangle has area, and if not then hardly ever: in single precision, without a branch.
#[inline]
fn surely_has_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    // Products that underflow are off by 2^-150 each, which this is far above.
    const TINY: f32 = f32::MIN_POSITIVE;
    let minus = |[px, py, pz]: [f32; 3], [qx, qy, qz]: [f32; 3]| [px - qx, py - qy, pz - qz];
    let ([px, py, pz], [qx, qy, qz]) = (minus(b, a), minus(c, a));
    // As below, with the roundings of single precision and half of that again. False where products overflow.
    let apart = |p: f32, q: f32| (p - q).abs() > 16.0 * UNIT32 * (p.abs() + q.abs()) + TINY;
    apart(py * qz, pz * qy) | apart(pz * qx, px * qz) | apart(px * qy, py * qx)
}

#[inline(never)]
fn has_area_in_doubt(triangle: [[f32; 3]; 3]) -> bool {
    if SLOW_F64 {
        return exact::has_area(triangle);
    }
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

/// The unit normal `(b - a) x (c - a)`, each component within 2^-30 of the real one: where it is short for
/// its edges, it is computed without error.
pub(crate) fn normal(triangle: [[f32; 3]; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(wide);
    let (e1, e2) = (b - a, c - a);
    let n = e1.cross(e2);
    let size = sum_abs(e1) * sum_abs(e2);
    // Four roundings of `size` are then less than 2^-31 of the normal.
    let clear = n.abs().max_element() > size / (1u64 << 20) as f64;
    let n = if clear { n } else { exact::normal(triangle).into() };
    n.normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn shot(origin: [f32; 3], direction: [f32; 3]) -> Option<(f64, [f64; 2], bool)> {
        let line = Line { origin, direction };
        let (meeting, _) = meet(&line, &TRIANGLE)?;
        Some((meeting.t, meeting.weights, meeting.front))
    }

    #[test]
    fn weights_belong_to_the_second_and_third_vertex() {
        let hit = shot([0.5, 0.125, 2.0], [0.0, 0.0, -0.5]);
        assert_eq!(hit, Some((4.0, [0.5, 0.125], true)));
        let behind = shot([0.5, 0.125, -2.0], [0.0, 0.0, 1.0]);
        assert_eq!(behind, Some((2.0, [0.5, 0.125], false)));
    }

    #[test]
    fn the_boundary_belongs_to_the_triangle() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.25, 0.0)] {
            assert!(shot([x, y, 1.0], [0.0, 0.0, -1.0]).is_some(), "{x} {y}");
        }
        assert!(shot([0.5, 0.5f32.next_up(), 1.0], [0.0, 0.0, -1.0]).is_none());
        assert!(shot([0.25, -1e-30, 1.0], [0.0, 0.0, -1.0]).is_none());
    }

    #[test]
    fn vertices_and_edges_are_told() {
        let feature = |x: f32, y: f32| {
            let line = Line { origin: [x, y, 1.0], direction: [0.0, 0.0, -1.0] };
            meet(&line, &TRIANGLE).expect("a hit").1
        };
        let [a, b, c] = TRIANGLE;
        for (x, y, expected) in [
            (0.0, 0.0, Feature::Vertex(a)),
            (1.0, 0.0, Feature::Vertex(b)),
            (0.0, 1.0, Feature::Vertex(c)),
            (0.5, 0.0, Feature::Edge([b, a])),
            (0.5, 0.5, Feature::Edge([c, b])),
            (0.0, 0.25, Feature::Edge([a, c])),
        ] {
            assert!(feature(x, y).is_same(&expected), "{x} {y}: {:?}", feature(x, y));
        }
        assert!(matches!(feature(0.25, 0.25), Feature::Face));
        assert!(!feature(0.5, 0.0).is_same(&Feature::Edge([a, c])));
        assert!(!feature(0.0, 0.0).is_same(&Feature::Vertex(b)));
        let beside = [a, b, [0.0, -1.0, 0.0]];
        assert!(feature(0.0, 0.0).is_part_of(&beside) && feature(0.5, 0.0).is_part_of(&beside));
        assert!(!feature(0.0, 1.0).is_part_of(&beside) && !feature(0.5, 0.5).is_part_of(&beside));
        assert!(!feature(0.25, 0.25).is_part_of(&TRIANGLE));
    }

    #[test]
    fn a_ray_in_the_plane_misses() {
        assert!(shot([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]).is_none());
        assert!(shot([-1.0, 0.25, 1.0], [1.0, 0.0, 0.0]).is_none());
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
