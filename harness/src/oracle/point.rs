//! How far a point is from a triangle or a sphere, in real arithmetic up to the last root.

use raykern::QueryOptions;

use super::Oracle;
use super::dyadic::{Dyadic, Vector, cross, difference, dot, vector};
use super::sieve::{Place, Shape};

/// How far a primitive is from a point.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// Which primitive.
    pub place: Place,
    /// How far, to about 1e-15 of it.
    pub distance: f64,
    /// The longest edge of a triangle, the diameter of a sphere.
    pub size: f64,
}

impl Oracle {
    /// How far `point` is from each primitive that mask and skip of `options` leave.
    pub fn distances(&self, point: [f32; 3], options: &QueryOptions) -> Vec<Distance> {
        let skipped = options.skip.map(|id| Place { geometry: id.geometry, prim: id.prim });
        let mut distances = Vec::new();
        for (place, shape) in self.sieve.all() {
            let (distance, size) = match *shape {
                Shape::Triangle(corners) => (to_triangle(point, corners), longest_edge(corners)),
                Shape::Sphere(sphere) => (to_sphere(point, sphere), 2.0 * f64::from(sphere[3])),
            };
            let seen = self.sees(*place, options) && skipped != Some(*place);
            if let (Some(distance), true) = (distance, seen) {
                distances.push(Distance { place: *place, distance, size });
            }
        }
        distances
    }
}

/// The length of the longest edge, about.
pub fn longest_edge(corners: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let length = |p: [f64; 3], q: [f64; 3]| {
        (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>().sqrt()
    };
    length(a, b).max(length(b, c)).max(length(c, a))
}

/// The distance of a point from a closed triangle, to about 1e-15 of it; none when it has no area.
pub fn to_triangle(point: [f32; 3], corners: [[f32; 3]; 3]) -> Option<f64> {
    let p = vector(point);
    let corners = corners.map(vector);
    let [a, b, c] = &corners;
    let normal = cross(&difference(b, a), &difference(c, a));
    let square = dot(&normal, &normal);
    if square.sign() == 0 {
        return None;
    }
    let edges = [(a, b), (b, c), (c, a)];
    // The foot is inside when it is on the inner side of each edge.
    let inside = edges.iter().all(|(start, end)| {
        dot(&cross(&normal, &difference(end, start)), &difference(&p, start)).sign() >= 0
    });
    if inside {
        let height = dot(&normal, &difference(&p, a));
        // |h| / sqrt(n . n), as a root of squares.
        return Some((&(&height * &height) * &square).sqrt_ratio(&square));
    }
    let nearest = edges.map(|(start, end)| to_edge(&p, start, end)).into_iter();
    nearest.min_by(f64::total_cmp)
}

fn to_edge(p: &Vector, start: &Vector, end: &Vector) -> f64 {
    let (edge, away) = (difference(end, start), difference(p, start));
    let (length, along) = (dot(&edge, &edge), dot(&away, &edge));
    let one = Dyadic::from_f32(1.0);
    if along.sign() <= 0 {
        return dot(&away, &away).sqrt_ratio(&one);
    }
    if along >= length {
        let away = difference(p, end);
        return dot(&away, &away).sqrt_ratio(&one);
    }
    // |away|^2 - (away . edge)^2 / |edge|^2
    let square = &(&dot(&away, &away) * &length) - &(&along * &along);
    (&square * &length).sqrt_ratio(&length)
}

/// The distance of a point from the surface of a sphere, to about 1e-15 of it; none when it has no radius.
pub fn to_sphere(point: [f32; 3], [x, y, z, radius]: [f32; 4]) -> Option<f64> {
    let r = Dyadic::from_f32(radius);
    if r.sign() <= 0 {
        return None;
    }
    let (away, one) = (difference(&vector(point), &vector([x, y, z])), Dyadic::from_f32(1.0));
    let square = dot(&away, &away);
    // |sqrt(s) - r| = |s - r^2| / (sqrt(s) + r)
    let power = (&square - &(&r * &r)).ratio(&one);
    Some(power.abs() / (square.sqrt_ratio(&one) + f64::from(radius)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    #[test]
    fn known_distances() {
        for (point, distance) in [
            ([1.0, 1.0, -2.0], 2.0),
            ([1.0, 1.0, 0.0], 0.0),
            ([-3.0, 1.0, 4.0], 5.0),
            ([2.0, -1.5, 2.0], 2.5),
            ([7.0, -4.0, 0.0], 5.0),
            ([5.0, 5.5, 0.0], 5.0),
            ([0.0, 3.0, 0.0], 0.0),
        ] {
            let found = to_triangle(point, CORNERS).expect("it has area");
            assert!((found - distance).abs() < 1e-14, "{point:?}: {found}");
        }
        assert_eq!(to_triangle([1.0; 3], [[0.0; 3], [1.0; 3], [2.0; 3]]), None);
        assert_eq!(longest_edge(CORNERS), 5.0);
        let ball = [0.0, 0.0, 0.0, 2.0];
        for (point, distance) in [([0.0; 3], 2.0), ([0.0, 3.0, 4.0], 3.0), ([0.0, 0.0, -2.0], 0.0)]
        {
            assert_eq!(to_sphere(point, ball), Some(distance));
        }
        assert_eq!(to_sphere([0.0; 3], [0.0, 0.0, 0.0, -1.0]), None);
    }
}
