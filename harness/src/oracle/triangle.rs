//! Ray against triangle, in real arithmetic.

use super::dyadic::{Vector, cross, difference, dot, vector};
use super::root::Root;

/// Where a line meets a triangle.
#[derive(Clone, Debug)]
pub struct TriangleMeeting {
    /// The parameter of the point.
    pub t: Root,
    /// The weights of the second and the third vertex, to about 1e-15.
    pub weights: [f64; 2],
    /// Whether the line comes from the side where the vertices run counter-clockwise.
    pub front: bool,
}

/// The point where the line `origin + t * direction` crosses the closed triangle; none when the
/// triangle has no area or the line is parallel to it.
pub fn meet(
    origin: &Vector,
    direction: &Vector,
    corners: [[f32; 3]; 3],
) -> Option<TriangleMeeting> {
    let [a, b, c] = corners.map(|v| difference(&vector(v), origin));
    let normal = cross(&difference(&b, &a), &difference(&c, &a));
    let slope = dot(direction, &normal);
    if slope.sign() == 0 {
        return None;
    }
    // Thrice the same volume: of the line and the edge opposite to each vertex.
    let volume = |p: &Vector, q: &Vector| dot(direction, &cross(p, q));
    let weights = [volume(&b, &c), volume(&c, &a), volume(&a, &b)];
    if weights.iter().any(|w| w.sign() * slope.sign() < 0) {
        return None;
    }
    Some(TriangleMeeting {
        weights: [weights[1].ratio(&slope), weights[2].ratio(&slope)],
        front: slope.sign() < 0,
        t: Root::rational(dot(&a, &normal), slope),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn shot(origin: [f32; 3], direction: [f32; 3]) -> Option<TriangleMeeting> {
        meet(&vector(origin), &vector(direction), CORNERS)
    }

    #[test]
    fn a_known_meeting() {
        let hit = shot([0.5, 0.125, 2.0], [0.0, 0.0, -0.5]).expect("a hit");
        assert_eq!(hit.t, Root::float(4.0));
        assert_eq!((hit.weights, hit.front), ([0.5, 0.125], true));
        assert!(!shot([0.5, 0.125, -2.0], [0.0, 0.0, 0.5]).expect("a hit").front);
    }

    #[test]
    fn the_boundary_belongs_to_the_triangle_and_nothing_beyond_it() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.25, 0.75)] {
            assert!(shot([x, y, 1.0], [0.0, 0.0, -1.0]).is_some(), "{x} {y}");
        }
        for (x, y) in [(0.5, 0.5f32.next_up()), (-1e-45, 0.5), (0.5, -1e-45)] {
            assert!(shot([x, y, 1.0], [0.0, 0.0, -1.0]).is_none(), "{x} {y}");
        }
    }

    #[test]
    fn parallel_lines_and_flat_triangles_never_meet() {
        assert!(shot([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]).is_none());
        assert!(shot([-1.0, 0.25, 1e-45], [1.0, 0.0, 0.0]).is_none());
        assert!(shot([-1.0, 0.25, 1e-45], [1.0, 0.0, -1e-45]).is_some());
        let down = vector([0.0, 0.0, -1.0]);
        let line = [[0.0; 3], [1e-3, 2e-3, 3e-3], [2e-3, 4e-3, 6e-3]];
        assert!(meet(&vector([1e-3, 2e-3, 1.0]), &down, line).is_none());
        assert!(meet(&vector([0.1, 0.2, 1.0]), &down, [[0.1, 0.2, 0.3]; 3]).is_none());
    }
}
