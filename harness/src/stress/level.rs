//! Two surfaces at the same distance along the ray: exactly, or a float apart.
//!
//! A whole point on a sphere around a whole centre has a whole distance from it when the three
//! differences and the radius are a Pythagorean quadruple; every surface through that point is met
//! there by every ray through it.

use raykern::Ray;

use super::{Case, kit};
use crate::make::Random;
use crate::model::Model;
use crate::rays::nonzero;

/// `x^2 + y^2 + z^2 = r^2`
const QUADRUPLES: [[f32; 4]; 10] = [
    [1.0, 2.0, 2.0, 3.0],
    [0.0, 3.0, 4.0, 5.0],
    [2.0, 3.0, 6.0, 7.0],
    [1.0, 4.0, 8.0, 9.0],
    [4.0, 4.0, 7.0, 9.0],
    [2.0, 6.0, 9.0, 11.0],
    [0.0, 5.0, 12.0, 13.0],
    [2.0, 10.0, 11.0, 15.0],
    [0.0, 0.0, 1.0, 1.0],
    [12.0, 16.0, 21.0, 29.0],
];

/// Two or more spheres through one point.
pub fn balls(random: &mut Random, count: usize) -> Case {
    meetings(random, count, 0.0, [1.0, 0.0])
}

/// Spheres and triangles through one point.
pub fn mixed(random: &mut Random, count: usize) -> Case {
    meetings(random, count, 0.6, [1.0, 0.0])
}

/// The same, scaled by any power of two that floats allow, and moved away.
pub fn wild(random: &mut Random, count: usize) -> Case {
    // Down to the least float; up to 2^17 away every sum stays exact and finite.
    let scale = 2f64.powi(random.between(-147.0, 108.0) as i32) as f32;
    let offset = [0.0, 64.0, 4096.0, 131_072.0][random.below(4)];
    meetings(random, count, 0.5, [scale, scale * offset])
}

/// Scenes of a few points, each on several surfaces, a share of them flat.
fn meetings(random: &mut Random, count: usize, flat: f64, [scale, offset]: [f32; 2]) -> Case {
    let send = |p: [f32; 3]| p.map(|x| x * scale + offset);
    let (mut triangles, mut spheres, mut points) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..1 + random.below(8) {
        let point = kit::whole_point(random, 10);
        points.push(point);
        for _ in 0..2 + random.below(3) {
            if random.unit() < flat {
                triangles.push(triangle_through(point, random).map(send));
            } else {
                let [x, y, z, r] = sphere_through(point, random);
                let [x, y, z] = send([x, y, z]);
                spheres.push([x, y, z, r * scale]);
            }
        }
    }
    // Half of the scenes are exact; in the others some numbers are a float or two off.
    if random.below(2) == 0 {
        for x in triangles.as_flattened_mut().as_flattened_mut() {
            *x = if random.below(4) == 0 { kit::perhaps_nudged(*x, random) } else { *x };
        }
        for x in spheres.as_flattened_mut() {
            *x = if random.below(4) == 0 { kit::perhaps_nudged(*x, random) } else { *x };
        }
    }
    let rays = (0..count).map(|_| {
        let to = points[random.below(points.len())];
        let way = kit::whole_direction(random, 6);
        let back = [0.0, 1.0, 2.0, 3.0, 5.0][random.below(5)];
        let origin = send(std::array::from_fn(|k| to[k] - back * way[k]));
        let factor = [1.0, scale, 0.25 * scale, 3.0][random.below(4)];
        let direction = nonzero(way.map(|x| f64::from(x) * f64::from(factor)));
        let ray = Ray::new(origin, direction);
        if random.below(3) == 0 { ray.with_limits(f32::NEG_INFINITY, f32::INFINITY) } else { ray }
    });
    let rays = rays.collect();
    Case::new(Model { meshes: vec![kit::soup(&triangles)], sphere_sets: vec![spheres] }, rays)
}

fn sphere_through(point: [f32; 3], random: &mut Random) -> [f32; 4] {
    let [x, y, z, r] = QUADRUPLES[random.below(QUADRUPLES.len())];
    let mut offset = [x, y, z];
    offset.rotate_left(random.below(3));
    if random.below(2) == 0 {
        offset.swap(0, 1);
    }
    let [x, y, z] = std::array::from_fn(|k| {
        if random.below(2) == 0 { point[k] + offset[k] } else { point[k] - offset[k] }
    });
    [x, y, z, r]
}

/// A triangle with the point at a corner, on an edge, or in the face.
fn triangle_through(point: [f32; 3], random: &mut Random) -> [[f32; 3]; 3] {
    let (d, e) = (kit::whole_direction(random, 5), kit::whole_direction(random, 5));
    let at = |s: f32, t: f32| std::array::from_fn(|k| point[k] + s * d[k] + t * e[k]);
    match random.below(3) {
        0 => [point, at(1.0, 0.0), at(0.0, 1.0)],
        1 => [at(-1.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)],
        _ => [at(-1.0, -1.0), at(2.0, -1.0), at(-1.0, 2.0)],
    }
}

/// Spheres whose irrational distances are equal by symmetry, or differ in the last bit of a number;
/// and planes as near to such a distance as a float can be.
pub fn roots(random: &mut Random, count: usize) -> Case {
    let scale = 2f32.powi(random.between(-60.0, 60.0) as i32);
    let mut number = || (random.below(1 << 20) as f32 + 1.0) / 1_048_576.0;
    let [x, y, r] = [number(), number(), 1.5 + number()];
    let mirrored = random.below(2) == 0;
    let mut spheres = Vec::new();
    let mut triangles = Vec::new();
    for layer in 0..4 {
        let z = 5.0 * layer as f32;
        for [x, y] in [[x, y], [-x, y], [y, x], [-y, -x]] {
            if random.below(3) != 0 {
                // A ray along z with x = y sees all alike, but for the nudges.
                let off = |x| if mirrored { x } else { kit::perhaps_nudged(x, random) };
                let sphere = [x, y, z, r].map(off);
                spheres.push(sphere.map(|x| x * scale));
            }
        }
        // Where the line through the origin of x and y enters or leaves.
        let [px, py, pr] = [x, y, r].map(f64::from);
        let depth = (pr * pr - px * px - py * py).max(0.0).sqrt();
        let height = kit::perhaps_nudged((f64::from(z) + depth) as f32, random) * scale;
        let reach = 4.0 * scale;
        triangles.push([[-reach, -reach, height], [reach, -reach, height], [0.0, reach, height]]);
    }
    let rays = (0..count).map(|_| {
        let diagonal = [0.0, 0.0, 0.5, -0.25][random.below(4)] * scale;
        let z = [-8.0, 0.0, 7.0, 30.0][random.below(4)] * scale;
        let away = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let length = [1.0, scale, 3.0][random.below(3)];
        let ray = Ray::new([diagonal, diagonal, z], [0.0, 0.0, away * length]);
        if random.below(3) == 0 { ray.with_limits(f32::NEG_INFINITY, f32::INFINITY) } else { ray }
    });
    let rays = rays.collect();
    Case::new(Model { meshes: vec![kit::soup(&triangles)], sphere_sets: vec![spheres] }, rays)
}
