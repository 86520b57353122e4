//! Makers of geometry: deterministic models of any size, for tests, benchmarks and pictures.
//!
//! Every maker takes about how many triangles are wanted and returns a [`TriangleMesh`] or a
//! [`Model`] with that number up to a factor that its comment names. The same arguments give the
//! same bits on one machine; makers that need sines may differ in the last bit between systems.

mod noise;
mod random;
mod solid;
mod strewn;

pub use noise::{fractal, noise};
pub use random::Random;
pub use solid::{blob, box_mesh, knot, plane, sphere, terrain};
pub use strewn::{architecture, dense_on_floor, hair, soup, spheres};

use crate::model::{Model, TriangleMesh};

impl TriangleMesh {
    /// The same mesh with every vertex sent through `map`.
    pub fn mapped(mut self, map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        for vertex in &mut self.vertices {
            *vertex = map(vertex.map(f64::from)).map(|x| x as f32);
        }
        self
    }

    /// The same mesh, scaled about the origin and then moved.
    pub fn placed(self, scale: f64, offset: [f64; 3]) -> Self {
        self.mapped(|p| std::array::from_fn(|k| p[k] * scale + offset[k]))
    }

    /// Adds the triangles of `other`.
    ///
    /// # Panics
    ///
    /// When the sum of the vertex counts exceeds 32 bits.
    pub fn append(&mut self, other: &TriangleMesh) {
        let base = u32::try_from(self.vertices.len()).expect("vertex count within 32 bits");
        self.vertices.extend_from_slice(&other.vertices);
        self.indices.extend(other.indices.iter().map(|t| t.map(|v| v + base)));
    }
}

impl From<TriangleMesh> for Model {
    fn from(mesh: TriangleMesh) -> Self {
        Model { meshes: vec![mesh], sphere_sets: Vec::new() }
    }
}

/// A named maker that takes about how many triangles (or spheres) are wanted.
pub type Maker = fn(usize) -> Model;

/// One model of each kind, by name: the list that tests and benchmarks walk.
pub const ALL: [(&str, Maker); 10] = [
    ("sphere", |n| sphere(n).into()),
    ("blob", |n| blob(n, 1).into()),
    ("knot", |n| knot(n).into()),
    ("terrain", |n| terrain(n, 1).into()),
    ("soup", |n| soup(n, 1).into()),
    ("hair", |n| hair(n, 1).into()),
    ("architecture", |n| architecture(n, 1).into()),
    ("dense_on_floor", dense_on_floor),
    ("plane", |n| plane(n).into()),
    ("spheres", |n| spheres(n, 1)),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_maker_is_valid_repeatable_and_of_the_size_asked_for() {
        for (name, make) in ALL {
            for wanted in [1, 100, 5_000] {
                let model = make(wanted);
                let count = model.triangle_count() + model.sphere_count();
                assert!(count >= wanted, "{name}: {count} < {wanted}");
                assert!(count <= 2 * wanted + 200, "{name}: {count} of {wanted}");
                for mesh in &model.meshes {
                    let vertices = mesh.vertices.len() as u32;
                    assert!(mesh.indices.as_flattened().iter().all(|&v| v < vertices), "{name}");
                    assert!(mesh.vertices.as_flattened().iter().all(|x| x.is_finite()), "{name}");
                }
                let again = make(wanted);
                assert!(
                    model
                        .meshes
                        .iter()
                        .zip(&again.meshes)
                        .all(|(a, b)| { a.vertices == b.vertices && a.indices == b.indices })
                );
                assert_eq!(model.sphere_sets, again.sphere_sets, "{name}");
            }
        }
    }

    #[test]
    fn closed_meshes_have_every_edge_twice_in_opposite_directions() {
        for (name, mesh) in [
            ("sphere", sphere(3_000)),
            ("blob", blob(3_000, 7)),
            ("knot", knot(3_000)),
            ("box", box_mesh([0.0; 3], [1.0, 2.0, 3.0], 4)),
        ] {
            let mut edges = std::collections::HashMap::new();
            for &[a, b, c] in &mesh.indices {
                for edge in [[a, b], [b, c], [c, a]] {
                    *edges.entry(edge).or_insert(0) += 1;
                }
            }
            for (&[a, b], &count) in &edges {
                assert_eq!((count, edges.get(&[b, a])), (1, Some(&1)), "{name}: edge {a} {b}");
            }
        }
    }

    #[test]
    fn a_sphere_faces_outward() {
        let mesh = sphere(1_000);
        for t in &mesh.indices {
            let [a, b, c] = t.map(|v| glam::Vec3::from(mesh.vertices[v as usize]));
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
    }
}
