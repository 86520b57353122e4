//! Connected surfaces: spheres, blobs, knots, terrains, boxes.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::DVec3;

use super::noise::fractal;
use crate::model::TriangleMesh;

/// The unit square in z = 0, facing +z, with at least `triangles` triangles in a regular raster.
pub fn plane(triangles: usize) -> TriangleMesh {
    raster(triangles, |u, v| [u, v, 0.0])
}

/// A landscape over the unit square, z up: at least `triangles` triangles, even in x and y.
pub fn terrain(triangles: usize, seed: u64) -> TriangleMesh {
    raster(triangles, |u, v| [u, v, 0.08 * fractal([5.0 * u, 5.0 * v, 0.5], 6, seed)])
}

/// A closed unit sphere around the origin, facing outward: at least `triangles` triangles.
pub fn sphere(triangles: usize) -> TriangleMesh {
    let side = (triangles as f64 / 12.0).sqrt().ceil().max(1.0) as usize;
    box_mesh([-1.0; 3], [1.0; 3], side).mapped(|p| {
        // Equal angles instead of equal steps along the cube's face even out the triangles.
        let p = DVec3::from(p.map(|x| (x * std::f64::consts::FRAC_PI_4).tan()));
        p.normalize().to_array()
    })
}

/// A closed wrinkled ball of radius about one: the stand-in for a dense scan.
pub fn blob(triangles: usize, seed: u64) -> TriangleMesh {
    sphere(triangles).mapped(|p| {
        let wrinkles = 0.35 * fractal(p.map(|x| 1.7 * x + 9.0), 6, seed);
        p.map(|x| x * (1.0 + wrinkles))
    })
}

/// A closed tube along the (2, 3) torus knot with a rough skin, about one in radius.
pub fn knot(triangles: usize) -> TriangleMesh {
    const RADIUS: f64 = 0.17;
    let around = ((triangles as f64 / 24.0).sqrt().ceil() as usize).max(3);
    let along = triangles.div_ceil(2 * around).max(24);
    let center = |s: f64| {
        let (a, b) = (2.0 * TAU * s, 3.0 * TAU * s);
        let r = 0.62 + 0.25 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), -0.3 * b.sin())
    };
    let mut vertices = Vec::with_capacity(around * along);
    for i in 0..along {
        let s = i as f64 / along as f64;
        let forward = (center(s + 1e-4) - center(s - 1e-4)).normalize();
        // The knot turns about z, so the direction away from z is never along the tube.
        let out = (center(s) * DVec3::new(1.0, 1.0, 0.0)).normalize();
        let right = forward.cross(out).normalize();
        let up = right.cross(forward);
        for j in 0..around {
            let angle = TAU * j as f64 / around as f64;
            let skin = right * angle.cos() + up * angle.sin();
            let p = center(s) + skin * RADIUS;
            let rough = 1.0 + 0.12 * fractal((p * 9.0).to_array(), 4, 3);
            vertices.push((center(s) + skin * RADIUS * rough).to_array().map(|x| x as f32));
        }
    }
    let number = |i: usize, j: usize| ((i % along) * around + j % around) as u32;
    let mut indices = Vec::with_capacity(2 * around * along);
    for i in 0..along {
        for j in 0..around {
            let [a, b] = [number(i, j), number(i + 1, j)];
            let [c, d] = [number(i + 1, j + 1), number(i, j + 1)];
            indices.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleMesh { vertices, indices }
}

/// A closed box from `lower` to `upper`, facing outward, each face cut into `side * side` squares
/// of two triangles.
pub fn box_mesh(lower: [f64; 3], upper: [f64; 3], side: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    // Faces share the vertices of their edges: lattice points are looked up by their numbers.
    let mut known = HashMap::new();
    for axis in 0..3 {
        for end in [0, side] {
            for i in 0..side {
                for j in 0..side {
                    let mut corner = |di: usize, dj: usize| {
                        let mut at = [end; 3];
                        at[(axis + 1) % 3] = i + di;
                        at[(axis + 2) % 3] = j + dj;
                        *known.entry(at).or_insert_with(|| {
                            mesh.vertices.push(lattice_point(lower, upper, at, side));
                            mesh.vertices.len() as u32 - 1
                        })
                    };
                    let [a, b] = [corner(0, 0), corner(1, 0)];
                    let [c, d] = [corner(1, 1), corner(0, 1)];
                    let outward = end == side;
                    mesh.indices.push(if outward { [a, b, c] } else { [a, c, b] });
                    mesh.indices.push(if outward { [a, c, d] } else { [a, d, c] });
                }
            }
        }
    }
    mesh
}

fn lattice_point(lower: [f64; 3], upper: [f64; 3], at: [usize; 3], side: usize) -> [f32; 3] {
    std::array::from_fn(|k| {
        let share = at[k] as f64 / side as f64;
        (lower[k] * (1.0 - share) + upper[k] * share) as f32
    })
}

/// A raster over the unit square, sent to space by `point(u, v)`.
fn raster(triangles: usize, point: impl Fn(f64, f64) -> [f64; 3]) -> TriangleMesh {
    let side = (triangles as f64 / 2.0).sqrt().ceil().max(1.0) as usize;
    let mut vertices = Vec::with_capacity((side + 1) * (side + 1));
    for j in 0..=side {
        for i in 0..=side {
            let [u, v] = [i, j].map(|x| x as f64 / side as f64);
            vertices.push(point(u, v).map(|x| x as f32));
        }
    }
    let mut indices = Vec::with_capacity(2 * side * side);
    for j in 0..side {
        for i in 0..side {
            let a = (j * (side + 1) + i) as u32;
            let (b, d) = (a + 1, a + side as u32 + 1);
            indices.extend([[a, b, d + 1], [a, d + 1, d]]);
        }
    }
    TriangleMesh { vertices, indices }
}
