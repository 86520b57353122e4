//! Spheres: touched, entered, left, as large as a world and as small as dust.

use raykern::Ray;

use super::{Case, kit};
use crate::make::{self, Random};
use crate::model::Model;
use crate::rays::{Family as Rays, aimed, round};

/// Overlapping spheres from outside, from inside, from points of them, in all directions.
pub fn balls(random: &mut Random, count: usize) -> Case {
    let mut model = make::spheres([2, 10, 60][random.below(3)], random.bits());
    if random.below(2) == 0 {
        let copy = model.sphere_sets[0].clone();
        model.sphere_sets.push(copy);
    }
    let families = [Rays::Random, Rays::Inside, Rays::FromSurface, Rays::AtVertex, Rays::Shadow];
    let mut rays = kit::rays(&model, &families, random, count);
    for ray in &mut rays {
        if random.below(5) == 0 {
            ray.t_min = f32::NEG_INFINITY;
        }
    }
    Case::new(model, rays)
}

/// Lines that touch: exactly with whole numbers, else some floats to either side.
pub fn tangents(random: &mut Random, count: usize) -> Case {
    let mut spheres = Vec::new();
    let mut rays = Vec::new();
    while rays.len() < count {
        let sphere @ [x, y, z, r] = {
            let [x, y, z] = kit::whole_point(random, 20);
            [x, y, z, (1 + random.below(9)) as f32]
        };
        spheres.push(sphere);
        for _ in 0..30 {
            rays.push(if random.below(2) == 0 {
                whole_tangent([x, y, z], r, random)
            } else {
                rounded_tangent([x, y, z], r, random)
            });
        }
    }
    let model = Model { meshes: Vec::new(), sphere_sets: vec![spheres] };
    Case::new(model, rays)
}

/// At distance `r` along one axis, in a lattice direction across it.
fn whole_tangent(centre: [f32; 3], r: f32, random: &mut Random) -> Ray {
    let axis = random.below(3);
    let mut touch = centre;
    touch[axis] += if random.below(2) == 0 { r } else { -r };
    let mut direction = kit::whole_direction(random, 3);
    direction[axis] = 0.0;
    direction[(axis + 1) % 3] += if direction == [0.0; 3] { 1.0 } else { 0.0 };
    let back = kit::whole(random, 5);
    let mut origin: [f32; 3] = std::array::from_fn(|k| touch[k] - back * direction[k]);
    origin[axis] = kit::perhaps_nudged(origin[axis], random);
    Ray::new(origin, direction).with_limits([0.0, -10.0][random.below(2)], f32::INFINITY)
}

/// In any direction at distance `r`, rounded.
fn rounded_tangent(centre: [f32; 3], r: f32, random: &mut Random) -> Ray {
    let (out, other) = (random.direction(), random.direction());
    let along: f64 = (0..3).map(|k| out[k] * other[k]).sum();
    let across: [f64; 3] = std::array::from_fn(|k| other[k] - along * out[k]);
    let back = random.between(-1.0, 30.0);
    let origin =
        std::array::from_fn(|k| f64::from(centre[k]) + f64::from(r) * out[k] - back * across[k]);
    Ray::new(round(origin), round(across))
}

/// A ground sphere of radius 1e3 to 1e30 under a small scene near the origin.
pub fn ground(random: &mut Random, count: usize) -> Case {
    let radius = match random.below(3) {
        0 => 1e7,
        1 => kit::power(random, 3.0, 9.0),
        _ => kit::power(random, 9.0, 30.0),
    };
    let mut model = make::spheres(8, random.bits());
    model.sphere_sets.push(vec![[0.5, 0.5, -radius as f32, radius as f32]]);
    if random.below(2) == 0 {
        model.meshes.push(make::blob(48, 3).placed(0.4, [0.5, 0.5, 0.3]));
    }
    let rays = (0..count).map(|_| {
        let from = round(random.point(-1.0, 2.0));
        match random.below(4) {
            0 => Ray::new(from, round(random.direction())),
            1 => Ray::new([from[0], from[1], 0.0], round(random.direction())),
            2 => Ray::new(from, [0.0, -0.0, -1.0]),
            // Grazing: towards the horizon.
            _ => {
                let [x, y, z] = random.direction();
                Ray::new(from, round([x, y, z * kit::power(random, -9.0, -1.0)]))
            }
        }
    });
    let rays = rays.collect();
    Case::new(model, rays)
}

/// Spheres 1e3 to 1e30 times smaller than their distance, aimed at as well as floats can.
pub fn specks(random: &mut Random, count: usize) -> Case {
    let distance = kit::power(random, -3.0, 10.0);
    let spheres = (0..20).map(|_| {
        let [x, y, z] = match random.below(2) {
            0 => kit::whole_point(random, 8).map(|x| x * distance as f32),
            _ => round(random.direction().map(|x| x * distance)),
        };
        [x, y, z, (distance / kit::power(random, 3.0, 30.0)) as f32]
    });
    let spheres: Vec<[f32; 4]> = spheres.collect();
    let rays = (0..count).map(|_| {
        let [x, y, z, r] = spheres[random.below(spheres.len())];
        let axis = random.below(3);
        match random.below(4) {
            // From whole multiples of the distance the direction is often exact.
            0 | 1 => aimed([0.0; 3], [x, y, z]),
            2 => aimed(round(random.direction().map(|x| x * distance)), [x, y, z]),
            _ => {
                let mut from = [x, y, z];
                from[axis] -= distance as f32;
                from[(axis + 1) % 3] += [0.0, r, -r, 0.5 * r][random.below(4)];
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                Ray::new(from, direction)
            }
        }
    });
    let rays = rays.collect();
    Case::new(Model { meshes: Vec::new(), sphere_sets: vec![spheres] }, rays)
}
