//! The point of a triangle or of a sphere that is closest to a given one.

use glam::DVec3;

use crate::math::float::sqrt;
use crate::math::wide;

/// A point of a primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    /// The square of its distance.
    pub square: f64,
    /// The weights of a triangle's second and third vertex.
    pub weights: [f64; 2],
    pub point: DVec3,
}

/// The closest point of a triangle, with its distance within 2^-46 of the distance and the longest edge.
///
/// The closest of four: one on each edge, and the foot of the perpendicular when it is inside. Each of them is a point of the triangle
/// but for rounding, so none can be closer than the closest real one; and where the foot of a thin triangle
/// is far off, an edge is close to the real one. The third vertex and the point are taken across the first edge before they
/// are compared, so what remains of a thin triangle is not lost against its length.
pub(super) fn on_triangle(point: DVec3, [a, b, c]: [DVec3; 3]) -> Foot {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let at = |[v, w]: [f64; 2]| {
        let along = v * ab + w * ac;
        Foot { square: (ap - along).length_squared(), weights: [v, w], point: a + along }
    };
    let on_bc = along_edge(point - b, c - b);
    let mut best = at([along_edge(ap, ab), 0.0]);
    for weights in [[0.0, along_edge(ap, ac)], [1.0 - on_bc, on_bc]] {
        best = closer(best, at(weights));
    }
    let length = ab.length_squared();
    let (c_along, p_along) = (ac.dot(ab) / length, ap.dot(ab) / length);
    let (c_across, p_across) = (ac - c_along * ab, ap - p_along * ab);
    let w = p_across.dot(c_across) / c_across.length_squared();
    let v = p_along - w * c_along;
    // A NaN is outside.
    let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
    if inside { closer(best, at([v, w])) } else { best }
}

fn closer(best: Foot, other: Foot) -> Foot {
    if other.square < best.square { other } else { best }
}

/// How far along an edge its closest point lies, from 0 to 1.
fn along_edge(from_start: DVec3, edge: DVec3) -> f64 {
    (from_start.dot(edge) / edge.length_squared()).clamp(0.0, 1.0)
}

/// The closest point of a sphere's surface, with its distance within 2^-46 of the distance and the diameter. For the
/// centre it is the one along x.
pub(super) fn on_sphere(point: DVec3, centre: [f32; 3], radius: f32) -> Foot {
    let (centre, radius) = (wide(centre), f64::from(radius));
    let away = point - centre;
    let length = sqrt(away.length_squared());
    let unit = if length > 0.0 { away / length } else { DVec3::X };
    let distance = length - radius;
    Foot { square: distance * distance, weights: [0.0; 2], point: centre + radius * unit }
}
