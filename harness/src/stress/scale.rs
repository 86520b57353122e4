//! Sizes and distances that floats can hold and cameras do not see.

use raykern::Ray;

use super::{Case, kit};
use crate::make::{self, Random};
use crate::model::Model;
use crate::rays::{Family as Rays, aimed, round};

/// A pebble on a planet 1e6 to 1e8 times as large, the planet a mesh or a sphere.
pub fn planet(random: &mut Random, count: usize) -> Case {
    let ratio = kit::power(random, 6.0, 8.0);
    let pebble = make::blob(48, random.bits() % 1000);
    let mut model = Model::default();
    let mut ground = [0.0, 0.0, ratio];
    if random.below(2) == 0 {
        model.sphere_sets.push(vec![[0.0, 0.0, 0.0, ratio as f32]]);
    } else {
        let mesh = make::sphere([108, 300][random.below(2)]).placed(ratio, [0.0; 3]);
        // Its middle of a face, an edge or a vertex may carry the pebble.
        let corners = kit::triangle(&Model::from(mesh.clone()), random);
        ground = kit::feature(corners, random).map(f64::from);
        model.meshes.push(mesh);
    }
    if random.below(2) == 0 {
        // The origin moves to the pebble: small coordinates beside large ones.
        kit::placed(&mut model, 1.0, ground.map(|x| -x));
        ground = [0.0; 3];
    }
    model.meshes.push(pebble.placed(1.0, ground));
    let rays = (0..count).map(|_| {
        let spot = |random: &mut Random, reach: f64| {
            let around = random.direction();
            round(std::array::from_fn(|k| ground[k] + reach * around[k]))
        };
        let reach = [0.5, 3.0, 100.0, 2.0 * ratio][random.below(4)];
        let from = spot(random, reach);
        match random.below(4) {
            0 => Ray::new(from, round(random.direction())),
            1 => aimed(from, spot(random, 1.0)),
            _ => aimed(from, kit::feature(kit::triangle(&model, random), random)),
        }
    });
    let rays = rays.collect();
    Case::new(model, rays)
}

/// Detail of a millimetre, 1e4 to 1e6 from the origin: coordinates have a few bits left for it.
pub fn far_off(random: &mut Random, count: usize) -> Case {
    let detail = kit::power(random, -3.0, 0.0);
    let reach = kit::power(random, 4.0, 6.0);
    let mut model = kit::some_model(random, 100);
    kit::placed(&mut model, detail, random.direction().map(|x| x * reach));
    let mut families = Rays::ORDINARY.to_vec();
    families.extend([Rays::AtVertex, Rays::AtEdge, Rays::FromSurface, Rays::AxisParallel]);
    let rays = kit::rays(&model, &families, random, count);
    Case::new(model, rays)
}

/// Everything times 1e-44 to 1e37, seldom a power of two.
pub fn scales(random: &mut Random, count: usize) -> Case {
    let mut model = kit::some_model(random, 60);
    let scale = kit::power(random, -44.0, 37.0);
    kit::placed(&mut model, scale, [0.0; 3]);
    let mut rays = kit::rays(&model, &Rays::ORDINARY, random, count / 2);
    rays.extend(kit::rays(&model, &Rays::HOSTILE, random, count / 2));
    if random.below(2) == 0 {
        // Directions in proportion, so that t is near one.
        for ray in &mut rays {
            let small = ray.direction.map(|x| kit::clipped(f64::from(x) * scale));
            ray.direction = if small == [0.0; 3] { ray.direction } else { small };
        }
    }
    Case::new(model, rays)
}

/// Directions of length 1e-20 to 1e20, and at the ends of what a float can be.
pub fn lengths(random: &mut Random, count: usize) -> Case {
    let model = kit::some_model(random, 60);
    let families = [Rays::Random, Rays::AtVertex, Rays::AtEdge, Rays::AxisParallel, Rays::InPlane];
    let mut rays = kit::rays(&model, &families, random, count);
    for ray in &mut rays {
        let factor = match random.below(4) {
            0 => kit::power(random, -44.5, -36.0),
            1 => kit::power(random, 36.0, 38.5),
            _ => kit::power(random, -20.0, 20.0),
        };
        let direction = ray.direction.map(|x| kit::clipped(f64::from(x) * factor));
        if direction != [0.0; 3] {
            ray.direction = direction;
        }
    }
    Case::new(model, rays)
}

/// Origins 1e3 to 1e30 sizes away, so far that cells cannot be told apart.
pub fn far_origins(random: &mut Random, count: usize) -> Case {
    let mut model = kit::some_model(random, 60);
    let scale = kit::power(random, -6.0, 3.0);
    kit::placed(&mut model, scale, [0.0; 3]);
    let rays = (0..count).map(|_| {
        let distance = scale * kit::power(random, 3.0, 30.0);
        let corners = match model.triangle_count() {
            0 => [round(random.point(0.0, scale)); 3],
            _ => kit::triangle(&model, random),
        };
        let to = kit::feature(corners, random);
        if random.below(2) == 0 {
            return aimed(round(random.direction().map(|x| x * distance)), to);
        }
        // Along an axis or a diagonal of a face the target is met whatever the distance is.
        let axis = random.below(3);
        let (mut from, mut direction) = (to, [0.0, -0.0, 0.0]);
        from[axis] = kit::clipped(distance);
        direction[axis] = -1.0;
        Ray::new(from, direction)
    });
    let rays = rays.collect();
    Case::new(model, rays)
}

/// Coordinates that are small multiples of the least float.
pub fn denormals(random: &mut Random, count: usize) -> Case {
    let bits = [2, 5, 12, 22, 24][random.below(5)];
    let number = move |random: &mut Random| {
        let x = f32::from_bits(random.below(1 << bits) as u32);
        if random.below(2) == 0 { x } else { -x }
    };
    let point = |random: &mut Random| [0; 3].map(|_| number(random));
    let triangles: Vec<_> =
        (0..1 + random.below(30)).map(|_| [0; 3].map(|_| point(random))).collect();
    let spheres = (0..random.below(10)).map(|_| {
        let [x, y, z] = point(random);
        [x, y, z, number(random).abs()]
    });
    let spheres = spheres.collect();
    let model = Model { meshes: vec![kit::soup(&triangles)], sphere_sets: vec![spheres] };
    let rays = (0..count).map(|_| {
        let from = point(random);
        let to = kit::feature(kit::triangle(&model, random), random);
        let small = Ray::new(from, std::array::from_fn(|k| to[k] - from[k]));
        match random.below(3) {
            0 if small.direction != [0.0; 3] => small,
            1 => {
                let factor = 2f32.powi(140);
                let large = small.direction.map(|x| x * factor);
                if large == [0.0; 3] {
                    Ray::new(from, [1.0, 0.0, 0.0])
                } else {
                    Ray::new(from, large)
                }
            }
            _ => Ray::new(from, round(random.direction())).with_limits(-1.0, f32::INFINITY),
        }
    });
    let rays = rays.collect();
    Case::new(model, rays)
}
