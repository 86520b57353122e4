//! Many surfaces in one place, and small whole numbers.

use raykern::Ray;

use super::{Case, kit};
use crate::make::Random;
use crate::model::{Model, TriangleMesh};
use crate::rays::{Family as Rays, aimed, round};

/// A mesh several times, within a mesh and across meshes, each copy some floats off or not at all.
pub fn layers(random: &mut Random, count: usize) -> Case {
    let base = match random.below(3) {
        0 => {
            let mesh = kit::closed_mesh(random);
            if random.below(2) == 0 { mesh } else { kit::turned(mesh, random) }
        }
        // Coplanar and overlapping, with whole corners or tilted.
        1 => flat(random),
        _ => {
            let mesh = flat(random);
            kit::turned(mesh, random)
        }
    };
    let mut model = Model::default();
    for _ in 0..1 + random.below(6) {
        let mut copy = base.clone();
        let steps = [0, 0, 1, -1, 3][random.below(5)];
        let axis = random.below(3);
        copy.vertices.iter_mut().for_each(|v| v[axis] = kit::nudged(v[axis], steps));
        if random.below(3) == 0 {
            copy.indices.iter_mut().for_each(|t| t.rotate_left(1));
        }
        if random.below(4) == 0 {
            copy.indices.iter_mut().for_each(|t| t.swap(0, 1));
        }
        match model.meshes.last_mut() {
            Some(last) if random.below(2) == 0 => last.append(&copy),
            _ => model.meshes.push(copy),
        }
    }
    let families = [Rays::AtVertex, Rays::AtEdge, Rays::ThroughVertex, Rays::FromSurface];
    let mut rays = kit::rays(&model, &families, random, count / 2);
    while rays.len() < count {
        let to = kit::feature(kit::triangle(&model, random), random);
        let far = random.between(0.0, 5.0);
        rays.push(aimed(round(random.direction().map(|x| x * far)), to));
    }
    Case::new(model, rays)
}

/// Triangles with whole corners in the plane z = 0.
fn flat(random: &mut Random) -> TriangleMesh {
    let mut triangle = || {
        [0; 3].map(|_| {
            let [x, y, _] = kit::whole_point(random, 4);
            [x, y, 0.0]
        })
    };
    let triangles: Vec<_> = (0..30).map(|_| triangle()).collect();
    kit::soup(&triangles)
}

/// Whole numbers from -2 to 2, or to 8: vertices, edges and tangents met exactly, and ties.
pub fn lattice(random: &mut Random, count: usize) -> Case {
    let bound = [2, 2, 3, 8][random.below(4)];
    let triangles: Vec<_> = (0..1 + random.below(40))
        .map(|_| [0; 3].map(|_| kit::whole_point(random, bound)))
        .collect();
    // One scene in four has radii that are zero or negative too.
    let odd = random.below(4) == 0;
    let mut ball = || {
        let [x, y, z] = kit::whole_point(random, bound);
        let radius = if odd { kit::whole(random, bound) } else { 1.0 + random.below(bound) as f32 };
        [x, y, z, radius]
    };
    let (first, second) = ((0..6).map(|_| ball()).collect(), (0..3).map(|_| ball()).collect());
    let model = Model { meshes: vec![kit::soup(&triangles)], sphere_sets: vec![first, second] };
    let rays = (0..count).map(|_| {
        let origin = kit::whole_point(random, bound + 2);
        let ray = Ray::new(origin, kit::whole_direction(random, bound));
        match random.below(4) {
            0 => {
                let (a, b) = (kit::whole(random, 4), kit::whole(random, 4));
                ray.with_limits(a.min(b), a.max(b))
            }
            1 => ray.with_limits(f32::NEG_INFINITY, f32::INFINITY),
            _ => ray,
        }
    });
    let rays = rays.collect();
    Case::new(model, rays)
}
