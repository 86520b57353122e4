//! Rays in the planes of faces and of cells, and from surfaces.

use raykern::Ray;

use super::{Case, kit};
use crate::make::{self, Random};
use crate::model::Model;
use crate::rays::{Family as Rays, aimed, mix, round};

/// In the plane of a face: exactly on boxes and lattices, up to rounding elsewhere.
pub fn in_plane(random: &mut Random, count: usize) -> Case {
    let model = angular(random);
    let mut rays = kit::rays(&model, &[Rays::InPlane], random, count / 4);
    while rays.len() < count {
        let [a, b, c] = kit::triangle(&model, random);
        let along: [f32; 3] = std::array::from_fn(|k| b[k] - a[k]);
        let back: [f32; 3] = std::array::from_fn(|k| a[k] - 2.0 * along[k]);
        if along == [0.0; 3] {
            continue;
        }
        rays.push(match random.below(4) {
            // Along an edge, from before it and from its first vertex.
            0 => Ray::new(back, along),
            1 => Ray::new(a, along),
            2 => aimed(back, mix(a, c, random.unit())),
            _ => aimed(mix(a, b, random.unit()), c),
        });
    }
    Case::new(model, rays)
}

/// Parallel to an axis or to a face diagonal, in box faces and cell walls, with zeros of both signs.
pub fn axes(random: &mut Random, count: usize) -> Case {
    let model = angular(random);
    let families = [Rays::AxisParallel, Rays::InBoxFace, Rays::ThroughVertex];
    let mut rays = kit::rays(&model, &families, random, count);
    for ray in &mut rays {
        if random.below(4) == 0 {
            let axis = random.below(3);
            ray.direction[axis] = [1.0, -1.0, 1e-30, -1e-45][random.below(4)];
        }
        if random.below(4) == 0 {
            ray.t_min = f32::NEG_INFINITY;
        }
    }
    Case::new(model, rays)
}

/// From points of faces, edges and vertices, in all directions and to other such points.
pub fn on_surface(random: &mut Random, count: usize) -> Case {
    let model = if random.below(2) == 0 { angular(random) } else { kit::some_model(random, 100) };
    let mut rays = kit::rays(&model, &[Rays::FromSurface, Rays::FromVertex], random, count / 2);
    while rays.len() < count && model.triangle_count() > 0 {
        let from = kit::feature(kit::triangle(&model, random), random);
        let to = kit::feature(kit::triangle(&model, random), random);
        let ray = if random.below(2) == 0 {
            aimed(from, to)
        } else {
            Ray::new(from, round(random.direction()))
        };
        rays.push(match random.below(4) {
            0 => ray.with_limits(-10.0, 10.0),
            1 => ray.with_limits(f32::from_bits(1), f32::INFINITY),
            _ => ray,
        });
    }
    Case::new(model, rays)
}

/// Boxes, rasters and lattice soups.
fn angular(random: &mut Random) -> Model {
    let side = 1 + random.below(8);
    match random.below(5) {
        0 => make::box_mesh([-1.0; 3], [1.0; 3], side).into(),
        1 => make::architecture(150, random.bits()).into(),
        2 => make::plane(2 * side * side).into(),
        3 => {
            let mut triangle = || [0; 3].map(|_| kit::whole_point(random, 4));
            let triangles: Vec<_> = (0..60).map(|_| triangle()).collect();
            kit::soup(&triangles).into()
        }
        _ => kit::turned(make::box_mesh([0.0; 3], [1.0; 3], side), random).into(),
    }
}
