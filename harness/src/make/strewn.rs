//! Many separate parts: soups, hair, buildings, spheres, and dense objects in wide surroundings.

use glam::DVec3;

use super::random::Random;
use super::solid::{blob, box_mesh};
use crate::model::{Model, TriangleMesh};

/// Random triangles in the unit cube, of a size at which a few overlap each other anywhere.
pub fn soup(triangles: usize, seed: u64) -> TriangleMesh {
    let mut random = Random::new(seed);
    let size = (triangles.max(1) as f64).cbrt().recip();
    let mut mesh = TriangleMesh::default();
    for _ in 0..triangles {
        let center = random.point(0.0, 1.0);
        push_triangle(
            &mut mesh,
            [(); 3].map(|()| {
                let offset = random.point(-size, size);
                std::array::from_fn(|k| center[k] + offset[k])
            }),
        );
    }
    mesh
}

/// Curved strands on a unit sphere, each of 16 thin triangles in a zigzag band.
pub fn hair(triangles: usize, seed: u64) -> TriangleMesh {
    const SEGMENTS: usize = 16;
    let mut random = Random::new(seed);
    let mut mesh = TriangleMesh::default();
    for _ in 0..triangles.div_ceil(SEGMENTS) {
        let root = DVec3::from(random.direction());
        let side =
            root.cross(DVec3::from(random.direction())).normalize_or(root.any_orthogonal_vector());
        let (length, bend) = (random.between(0.2, 0.4), random.between(-2.0, 2.0));
        let base = mesh.vertices.len() as u32;
        for i in 0..SEGMENTS + 2 {
            let s = i as f64 / (SEGMENTS + 1) as f64;
            let width = 0.002 * (1.0 - 0.9 * s) * if i % 2 == 0 { 1.0 } else { -1.0 };
            let fall = DVec3::new(0.0, 0.0, -0.3 * s * s);
            let curl = root.cross(side) * (bend * length * s * s * 0.5);
            let p = root * (1.0 + length * s) + fall + curl + side * width;
            mesh.vertices.push(p.to_array().map(|x| x as f32));
        }
        mesh.indices.extend((0..SEGMENTS as u32).map(|i| [base + i, base + i + 1, base + i + 2]));
    }
    mesh
}

/// A hall of pillars and crates: large, long and small axis-aligned boxes of 12 triangles each,
/// on one floor of two triangles' worth of box.
pub fn architecture(triangles: usize, seed: u64) -> TriangleMesh {
    let mut random = Random::new(seed);
    let mut mesh = box_mesh([0.0, 0.0, -0.5], [40.0, 20.0, 0.0], 1);
    while mesh.indices.len() < triangles {
        let [x, y] = [random.between(0.0, 40.0), random.between(0.0, 20.0)];
        let (low, size) = match random.below(10) {
            0 => ([x, y, 0.0], [0.4, 0.4, 8.0]),
            1 => ([x, 0.0, random.between(4.0, 8.0)], [0.3, 20.0, 0.3]),
            2 => ([0.0, y, random.between(4.0, 8.0)], [40.0, 0.3, 0.3]),
            _ => {
                let size = random.between(0.05, 0.5);
                ([x, y, random.below(8) as f64 * 0.5], [size, random.between(0.05, 0.5), size])
            }
        };
        let high = std::array::from_fn(|k| low[k] + size[k]);
        mesh.append(&box_mesh(low, high, 1));
    }
    mesh
}

/// A wrinkled ball 0.2 wide on a floor of two triangles 100 wide: geometry 0 is the floor.
///
/// A regular grid over the whole box puts the ball into a handful of cells.
pub fn dense_on_floor(triangles: usize) -> Model {
    let floor = TriangleMesh {
        vertices: vec![
            [-50.0, -50.0, 0.0],
            [50.0, -50.0, 0.0],
            [50.0, 50.0, 0.0],
            [-50.0, 50.0, 0.0],
        ],
        indices: vec![[0, 1, 2], [0, 2, 3]],
    };
    let ball = blob(triangles, 1).placed(0.1, [0.0, 0.0, 0.12]);
    Model { meshes: vec![floor, ball], sphere_sets: Vec::new() }
}

/// Spheres in the unit cube, large and small, touching and overlapping now and then.
pub fn spheres(count: usize, seed: u64) -> Model {
    let mut random = Random::new(seed);
    let size = (count.max(1) as f64).cbrt().recip();
    let sphere = |random: &mut Random| {
        let [x, y, z] = random.point(0.0, 1.0);
        [x, y, z, random.between(0.05, 0.6) * size].map(|x| x as f32)
    };
    let set = (0..count).map(|_| sphere(&mut random)).collect();
    Model { meshes: Vec::new(), sphere_sets: vec![set] }
}

fn push_triangle(mesh: &mut TriangleMesh, corners: [[f64; 3]; 3]) {
    let base = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners.map(|p| p.map(|x| x as f32)));
    mesh.indices.push([base, base + 1, base + 2]);
}
