//! Closed meshes, hit where their triangles meet.

use raykern::Ray;

use super::{Case, kit};
use crate::make::{self, Random};
use crate::model::{Model, TriangleMesh};
use crate::rays::{aimed, round};

/// From around a closed mesh at its vertices and edges; directions are rounded.
pub fn outside(random: &mut Random, count: usize) -> Case {
    let mesh = kit::closed_mesh(random);
    let model: Model = kit::turned(mesh, random).into();
    let rays = (0..count).map(|_| {
        let far = random.between(3.0, 9.0);
        let from = round(random.direction().map(|x| x * far));
        aimed(from, kit::feature(kit::triangle(&model, random), random))
    });
    let rays = rays.collect();
    Case::new(model, rays)
}

/// From near the middle, which sees every face from inside: whatever the direction, the ray hits.
pub fn inside(random: &mut Random, count: usize) -> Case {
    let mesh = kit::closed_mesh(random);
    let model: Model = kit::turned(mesh, random).into();
    let rays = (0..count).map(|_| {
        let from = round(random.point(-0.02, 0.02));
        let to = kit::feature(kit::triangle(&model, random), random);
        // Each of the three is rounded differently.
        match random.below(3) {
            0 => aimed([0.0; 3], to),
            1 => aimed(from, to),
            _ => Ray::new(from, unit(from, to)),
        }
    });
    let rays = rays.collect();
    Case::new(model, rays)
}

/// Lattice meshes: the rays pass exactly through vertices, points of edges and of faces.
pub fn exact(random: &mut Random, count: usize) -> Case {
    let model: Model = match random.below(3) {
        0 => {
            let side = 1 << random.below(4);
            make::box_mesh([-8.0; 3], [8.0; 3], side)
        }
        1 => octahedron(random),
        _ => {
            let seed = random.bits();
            make::box_mesh([-4.0; 3], [4.0; 3], 4).mapped(|p| p.map(|x| x + bump(p, x, seed)))
        }
    }
    .into();
    let rays = (0..count).map(|_| {
        let [a, b, c] = kit::triangle(&model, random);
        // Whole multiples of a quarter, so that every sum here is exact.
        let weights = [[4, 0, 0], [4, 0, 0], [2, 2, 0], [1, 3, 0], [2, 1, 1], [0, 1, 3]];
        let [i, j, k] = weights[random.below(6)].map(|w| w as f32 / 4.0);
        let to: [f32; 3] = std::array::from_fn(|x| i * a[x] + j * b[x] + k * c[x]);
        let reach = [2, 20][random.below(2)];
        let from = kit::whole_point(random, reach);
        let way: [f32; 3] = std::array::from_fn(|x| to[x] - from[x]);
        if way == [0.0; 3] {
            return Ray::new(from, kit::whole_direction(random, 3));
        }
        let factor = [1.0, 1.0, 0.25, 64.0, 3.0][random.below(5)];
        Ray::new(from, way.map(|x| x * factor))
    });
    let rays = rays.collect();
    Case::new(model, rays)
}

fn unit(from: [f32; 3], to: [f32; 3]) -> [f32; 3] {
    let way: [f64; 3] = std::array::from_fn(|k| f64::from(to[k]) - f64::from(from[k]));
    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
    round(way.map(|x| x / length))
}

/// Eight faces with whole corners at different distances.
fn octahedron(random: &mut Random) -> TriangleMesh {
    let mut tip = |axis: usize, sign: f32| {
        let mut p = [0.0; 3];
        p[axis] = sign * (3 + random.below(6)) as f32;
        p
    };
    let vertices = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)]
        .map(|(axis, sign)| tip(axis, sign))
        .to_vec();
    let indices = (0..8u32).map(|i| {
        let [x, y, z] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)];
        if i.count_ones() % 2 == 0 { [x, y, z] } else { [x, z, y] }
    });
    TriangleMesh { vertices, indices: indices.collect() }
}

/// 0 or 1 outwards, the same for the same point.
fn bump(p: [f64; 3], x: f64, seed: u64) -> f64 {
    let key = p.iter().fold(seed, |h, x| Random::new(h ^ x.to_bits()).bits());
    if key & 1 == 0 { 0.0 } else { x.signum() }
}
