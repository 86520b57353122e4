//! Scenes of a few hundred primitives, made of whole numbers, so that they are the same everywhere.

use raykern::{Mesh, Scene, SphereSet};

/// How many scenes there are.
pub const SHAPES: u32 = 3;
const SIDE: usize = 11;
const VERTICES: usize = SIDE * SIDE;
const TRIANGLES: usize = 2 * (SIDE - 1) * (SIDE - 1) + 2;
const SPHERES: usize = 40;

/// A mesh and spheres.
pub struct Made {
    vertices: [[f32; 3]; VERTICES],
    indices: [[u32; 3]; TRIANGLES],
    spheres: [[f32; 4]; SPHERES],
    sphere_count: usize,
}

/// A number from 0 to 255 for each pair of numbers.
fn scattered(i: usize, k: u32) -> f32 {
    let x = (i as u32).wrapping_mul(0x9E37_79B1) ^ k.wrapping_mul(0x85EB_CA77);
    ((x ^ x >> 15).wrapping_mul(0x2C1B_3C6D) >> 24) as f32
}

impl Made {
    /// 0: a flat lattice with bumps, on which rays meet edges and vertices, two of its triangles there twice. 1: the same without
    /// any order, and spheres. 2: large and small, far from the origin, with spheres that touch.
    pub fn fill(&mut self, shape: u32) {
        for (i, vertex) in self.vertices.iter_mut().enumerate() {
            let [x, y] = [(i % SIDE) as f32 - 5.0, (i / SIDE) as f32 - 5.0];
            let rough = [1, 2, 3].map(|k| scattered(i, k) / 256.0 - 0.5);
            *vertex = match shape {
                0 => [x, y, (i % 5) as f32 / 4.0],
                1 => rough.map(|r| 10.0 * r),
                _ => [1000.0 + x * x * x, y + rough[1], 100.0 * rough[2]],
            };
        }
        let squares = (0..SIDE - 1).flat_map(|j| (0..SIDE - 1).map(move |i| (j * SIDE + i) as u32));
        let corners = squares.flat_map(|a| {
            let (b, c) = (a + SIDE as u32, a + 1);
            [[a, c, b], [b + 1, b, c]]
        });
        for (triangle, corners) in
            self.indices.iter_mut().zip(corners.chain([[0, 1, 11], [60, 61, 71]]))
        {
            *triangle = corners;
        }
        self.sphere_count = if shape == 0 { 0 } else { SPHERES };
        for (i, sphere) in self.spheres.iter_mut().enumerate() {
            let [x, y, z] = [4, 5, 6].map(|k| scattered(i, k) / 32.0 - 4.0);
            *sphere = match shape {
                1 => [x, y, z, 0.25 + scattered(i, 7) / 512.0],
                _ => [1000.0 + (i % 8) as f32, (i / 8) as f32, 2.0, 0.5],
            };
        }
    }

    /// Moves everything, some of it more.
    pub fn shift(&mut self) {
        for (i, vertex) in self.vertices.iter_mut().enumerate() {
            vertex[2] += 0.25 + scattered(i, 8) / 1024.0;
        }
        for sphere in &mut self.spheres {
            sphere[0] -= 0.5;
        }
    }

    /// Calls `f` with the scene that borrows this.
    pub fn with_scene<'m, R>(&self, f: impl FnOnce(&Scene<'_, 'm>) -> R) -> R {
        let meshes = [Mesh::indexed(&self.vertices, &self.indices)];
        let spheres = [SphereSet::new(&self.spheres[..self.sphere_count])];
        f(&Scene::new(&meshes, &spheres))
    }
}
