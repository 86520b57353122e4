//! Which primitives a line may meet at all: a conservative first look in `f64`.

use crate::model::Model;

/// A primitive, by the order in which ties are decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The mesh, or the number of meshes plus the sphere set.
    pub geometry: u32,
    /// The number within it.
    pub prim: u32,
}

/// What is in a place.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Three corners.
    Triangle([[f32; 3]; 3]),
    /// Centre and radius.
    Sphere([f32; 4]),
}

/// All finite primitives in bunches, each bunch in a ball.
#[derive(Debug)]
pub struct Sieve {
    items: Vec<(Place, Shape)>,
    balls: Vec<Ball>,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: [f64; 3],
    radius: f64,
}

const BUNCH: usize = 32;

impl Sieve {
    /// The sieve of all that is finite in `model`.
    pub fn new(model: &Model) -> Self {
        let mut items = Vec::with_capacity(model.triangle_count() + model.sphere_count());
        for (geometry, mesh) in model.meshes.iter().enumerate() {
            for (prim, corners) in mesh.indices.iter().enumerate() {
                let corners = corners.map(|v| mesh.vertices[v as usize]);
                items.push((place(geometry, prim), Shape::Triangle(corners)));
            }
        }
        for (set, spheres) in model.sphere_sets.iter().enumerate() {
            for (prim, sphere) in spheres.iter().enumerate() {
                items.push((place(model.meshes.len() + set, prim), Shape::Sphere(*sphere)));
            }
        }
        items.retain(|(_, shape)| shape.is_finite());
        sort_along_a_curve(&mut items);
        let balls = items.chunks(BUNCH).map(Ball::around).collect();
        Sieve { items, balls }
    }

    /// Every finite primitive, in no order.
    pub fn all(&self) -> &[(Place, Shape)] {
        &self.items
    }

    /// Calls `f` with every primitive that the whole line may meet, and with some others.
    pub fn each_near(
        &self,
        origin: [f32; 3],
        direction: [f32; 3],
        mut f: impl FnMut(Place, Shape),
    ) {
        let (o, d) = (origin.map(f64::from), direction.map(f64::from));
        for (ball, bunch) in self.balls.iter().zip(self.items.chunks(BUNCH)) {
            if ball.certainly_off(o, d) {
                continue;
            }
            for (place, shape) in bunch {
                if !shape.certainly_off(o, d) {
                    f(*place, *shape);
                }
            }
        }
    }
}

fn place(geometry: usize, prim: usize) -> Place {
    Place { geometry: geometry as u32, prim: prim as u32 }
}

impl Shape {
    fn is_finite(&self) -> bool {
        match self {
            Shape::Triangle(corners) => corners.as_flattened().iter().all(|x| x.is_finite()),
            Shape::Sphere(sphere) => sphere.iter().all(|x| x.is_finite()),
        }
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        match *self {
            Shape::Triangle(corners) => {
                let pick = |f: fn(f64, f64) -> f64| {
                    let [a, b, c] = corners.map(|p| p.map(f64::from));
                    std::array::from_fn(|k| f(f(a[k], b[k]), c[k]))
                };
                (pick(f64::min), pick(f64::max))
            }
            Shape::Sphere([x, y, z, radius]) => {
                let (centre, r) = ([x, y, z].map(f64::from), f64::from(radius).abs());
                (centre.map(|x| x - r), centre.map(|x| x + r))
            }
        }
    }

    /// True only when the line misses the shape in real arithmetic too.
    ///
    /// Triangles: the line passes all three edges on sides that differ by more than rounding. A
    /// volume `d . (p x q)` of differences `p`, `q` carries at most ten roundings a term, and its
    /// terms sum to at most `|d| |p| |q|` in 1-norms: 64 units are generous. Nothing over- or
    /// underflows: floats keep products of six within `f64`.
    fn certainly_off(&self, o: [f64; 3], d: [f64; 3]) -> bool {
        match *self {
            Shape::Triangle(corners) => {
                let [a, b, c] = corners.map(|p| std::array::from_fn(|k| f64::from(p[k]) - o[k]));
                let volumes = [dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))];
                let reach = norm(a).max(norm(b)).max(norm(c));
                let noise = 64.0 * f64::EPSILON * norm(d) * reach * reach;
                let least = volumes.into_iter().fold(f64::INFINITY, f64::min);
                let greatest = volumes.into_iter().fold(f64::NEG_INFINITY, f64::max);
                least < -noise && greatest > noise
            }
            Shape::Sphere([x, y, z, radius]) => {
                let centre = [x, y, z].map(f64::from);
                Ball { centre, radius: f64::from(radius).abs() }.certainly_off(o, d)
            }
        }
    }
}

impl Ball {
    fn around(bunch: &[(Place, Shape)]) -> Ball {
        let mut lower = [f64::INFINITY; 3];
        let mut upper = [f64::NEG_INFINITY; 3];
        for (_, shape) in bunch {
            let (low, high) = shape.bounds();
            lower = std::array::from_fn(|k| lower[k].min(low[k]));
            upper = std::array::from_fn(|k| upper[k].max(high[k]));
        }
        let centre = std::array::from_fn(|k| 0.5 * (lower[k] + upper[k]));
        let half: [f64; 3] = std::array::from_fn(|k| upper[k] - lower[k]);
        let magnitude = norm(lower).max(norm(upper));
        // Half the diagonal of the box, and far more than the rounding of its middle.
        Ball { centre, radius: 0.5 * dot(half, half).sqrt() * (1.0 + 1e-9) + 1e-12 * magnitude }
    }

    /// True only when the line passes the centre at more than the radius.
    ///
    /// The distance is `|oc x d| / |d|`; its numerator is off by less than 64 units of
    /// `|oc| |d|` in 1-norms.
    fn certainly_off(&self, o: [f64; 3], d: [f64; 3]) -> bool {
        let to_centre: [f64; 3] = std::array::from_fn(|k| self.centre[k] - o[k]);
        let moment = cross(to_centre, d);
        let noise = 64.0 * f64::EPSILON * (norm(to_centre) + self.radius) * norm(d);
        dot(moment, moment).sqrt() > self.radius * dot(d, d).sqrt() + noise
    }
}

/// Neighbours in space become neighbours in the list (Morton order of the middles).
fn sort_along_a_curve(items: &mut [(Place, Shape)]) {
    let middle = |shape: &Shape| -> [f64; 3] {
        let (lower, upper) = shape.bounds();
        std::array::from_fn(|k| 0.5 * (lower[k] + upper[k]))
    };
    let mut lower = [f64::INFINITY; 3];
    let mut upper = [f64::NEG_INFINITY; 3];
    for (_, shape) in items.iter() {
        let p = middle(shape);
        lower = std::array::from_fn(|k| lower[k].min(p[k]));
        upper = std::array::from_fn(|k| upper[k].max(p[k]));
    }
    items.sort_by_cached_key(|(_, shape)| {
        let p = middle(shape);
        let cell: [u64; 3] = std::array::from_fn(|k| {
            (2_097_151.0 * (p[k] - lower[k]) / (upper[k] - lower[k]).max(1e-300)) as u64
        });
        let bit = |i: usize| cell[i % 3] >> (i / 3) & 1;
        (0..63).fold(0, |key, i| key | bit(i) << i)
    });
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let minor = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

fn norm(a: [f64; 3]) -> f64 {
    a[0].abs() + a[1].abs() + a[2].abs()
}

#[cfg(test)]
mod tests {
    use super::super::dyadic::vector;
    use super::super::{sphere, triangle};
    use super::*;
    use crate::make::{self, Random};

    #[test]
    fn whatever_is_left_out_is_not_met() {
        let mut random = Random::new(1);
        let mut model: Model = make::blob(300, 2).into();
        model.sphere_sets.push(make::spheres(100, 3).sphere_sets[0].clone());
        let sieve = Sieve::new(&model);
        let (mut kept, mut met) = (0, 0);
        for _ in 0..60 {
            let origin = random.point(-2.0, 2.0).map(|x| x as f32);
            // Through a vertex, where the decision is close.
            let vertices = &model.meshes[0].vertices;
            let target = vertices[random.below(vertices.len())];
            let direction: [f32; 3] = std::array::from_fn(|k| target[k] - origin[k]);
            let mut near = Vec::new();
            sieve.each_near(origin, direction, |place, _| near.push(place));
            kept += near.len();
            let (o, d) = (vector(origin), vector(direction));
            for (place, shape) in &sieve.items {
                let hit = match *shape {
                    Shape::Triangle(corners) => triangle::meet(&o, &d, corners).is_some(),
                    Shape::Sphere(sphere) => sphere::meet(&o, &d, sphere).is_some(),
                };
                met += usize::from(hit);
                assert!(!hit || near.contains(place), "{place:?} {origin:?} {direction:?}");
            }
        }
        assert!(met > 100 && kept < 4 * met, "{kept} kept, {met} met");
    }
}
