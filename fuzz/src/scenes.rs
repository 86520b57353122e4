//! Small scenes in which every ray meets trouble.

use raykern_harness::make;
use raykern_harness::model::{Model, TriangleMesh};

/// All of them by name. Each has few enough primitives for the oracle.
pub fn all() -> Vec<(&'static str, Model)> {
    vec![
        ("duplicated", duplicated()),
        ("coplanar", coplanar()),
        ("lattice", lattice()),
        ("needles", needles()),
        ("planet and pebble", planet_and_pebble()),
        ("tangent spheres", tangent_spheres()),
        ("both ends", both_ends()),
        ("closed", make::box_mesh([-1.0; 3], [1.0; 3], 1).into()),
    ]
}

/// The same tetrahedron three times, twice inside out, and its twin one float to the side.
fn duplicated() -> Model {
    let one = TriangleMesh {
        vertices: vec![[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]],
        indices: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let mut inside_out = one.clone();
    inside_out.indices.iter_mut().for_each(|t| t.swap(1, 2));
    let mut both = one.clone();
    both.append(&inside_out);
    let mut beside = one.clone();
    beside.vertices.iter_mut().flatten().for_each(|x| *x = x.next_up());
    Model { meshes: vec![one, both, inside_out, beside], sphere_sets: vec![] }
}

/// Overlapping triangles in three planes, one of them slanted, and layers a float apart.
fn coplanar() -> Model {
    let mut mesh = TriangleMesh::default();
    let mut add = |corners: [[f32; 3]; 3]| {
        let base = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners);
        mesh.indices.push([base, base + 1, base + 2]);
    };
    for i in 0..6 {
        let x = i as f32;
        add([[x, 0.0, 1.0], [x + 3.0, 0.0, 1.0], [x, 5.0, 1.0]]);
        add([[0.0, x, 2.0 + x], [4.0, x, 6.0 + x], [0.0, x + 3.0, 5.0 + x]]);
        let layer = f32::from_bits(1f32.to_bits() + i);
        add([[-1.0, -1.0, layer], [7.0, -1.0, layer], [-1.0, 7.0, layer]]);
    }
    mesh.into()
}

/// Squares over whole numbers, and spheres around their corners.
fn lattice() -> Model {
    let square = make::plane(18).mapped(|[x, y, _]| [3.0 * x, 3.0 * y, 0.0]);
    let spheres = vec![[0.0, 0.0, 0.0, 1.0], [2.0, 1.0, 0.0, 1.0], [1.0, 1.0, 0.0, 2.0]];
    let upright = square.clone().mapped(|[x, y, z]| [z, x, y]);
    Model { meshes: vec![square, upright], sphere_sets: vec![spheres] }
}

/// Triangles far longer than wide, sharing corners and edges, some without area.
fn needles() -> Model {
    let mut mesh = TriangleMesh::default();
    for i in 0..10u32 {
        let thin = 2f32.powi(-12 * i as i32);
        let (base, x) = (mesh.vertices.len() as u32, i as f32);
        mesh.vertices.extend([[x, 0.0, 0.0], [x + 1.0, 1000.0, 1.0], [x, thin, thin]]);
        mesh.indices.extend([[base, base + 1, base + 2], [base, base + 1, (i % 3) * 3]]);
    }
    mesh.into()
}

/// A large sphere and a large triangle with small ones on top of them, 2^36 times smaller.
fn planet_and_pebble() -> Model {
    let (large, small) = (2f32.powi(18), 2f32.powi(-18));
    let spheres = vec![
        [0.0, 0.0, -large, large],
        [0.0, 0.0, small, small],
        [2.0 * small, 0.0, small, small],
        [0.0, 0.0, 2.0 * large, large],
    ];
    let vertices = vec![
        [-large, -large, 0.0],
        [large, -large, 0.0],
        [0.0, large, 0.0],
        [0.0, 0.0, 0.0],
        [small, 0.0, small],
        [0.0, small, small],
    ];
    let mesh = TriangleMesh { vertices, indices: vec![[0, 1, 2], [3, 4, 5], [0, 1, 4]] };
    Model { meshes: vec![mesh], sphere_sets: vec![spheres] }
}

/// Spheres that touch each other, hold each other and touch a square from either side.
fn tangent_spheres() -> Model {
    let spheres = vec![
        [0.0, 0.0, 1.0, 1.0],
        [0.0, 0.0, 2.0, 2.0],
        [2.0, 0.0, 1.0, 1.0],
        [0.0, 0.0, -1.0, 1.0],
        [0.0, 0.0, 1.0, 1f32.next_up()],
        [0.0, 0.0, 1.0, 1.0],
        [3.0, 4.0, 0.0, 5.0],
    ];
    let mesh = make::plane(2).mapped(|[x, y, _]| [8.0 * x - 4.0, 8.0 * y - 4.0, 0.0]);
    Model { meshes: vec![mesh], sphere_sets: vec![spheres] }
}

/// Triangles and spheres at either end of the range of floats.
fn both_ends() -> Model {
    let mut mesh = TriangleMesh::default();
    for size in [1e-45, 1e-40, f32::MIN_POSITIVE, 1e-20, 1.0, 1e20, 3e38, f32::MAX] {
        let base = mesh.vertices.len() as u32;
        mesh.vertices.extend([[-size, -size, size], [size, -size, size], [0.0, size, size]]);
        mesh.indices.push([base, base + 1, base + 2]);
    }
    let spheres = [1e-45, 1e-38, 1e-10, 1.0, 1e30, f32::MAX].map(|r| [0.0, 0.0, -r, r]).to_vec();
    Model { meshes: vec![mesh], sphere_sets: vec![spheres] }
}
