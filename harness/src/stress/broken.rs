//! Input that is not geometry, and floats of any bits.

use raykern::Ray;

use super::{Case, kit};
use crate::make::Random;
use crate::model::Model;
use crate::rays::{Family as Rays, aimed};

/// Sound scenes with some corners NaN or infinite, triangles without area, spheres without radius.
/// A fifth of the rays is invalid.
pub fn broken(random: &mut Random, count: usize) -> Case {
    const ODD: [f32; 6] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -f32::MAX, 1e-45];
    let mut model = kit::some_model(random, 60);
    if random.below(2) == 0 {
        model.sphere_sets.push(vec![[0.0, 0.0, 0.0, 0.5], [0.3, 0.2, 0.1, 0.4]]);
    }
    for mesh in &mut model.meshes {
        for _ in 0..random.below(4) {
            let vertex = random.below(mesh.vertices.len());
            mesh.vertices[vertex][random.below(3)] = ODD[random.below(6)];
        }
        for _ in 0..random.below(12) {
            let [a, b, c] = mesh.indices[random.below(mesh.indices.len())];
            let flat = [[a, a, b], [a, b, b], [b, a, b], [c, c, c], [a, b, c]][random.below(5)];
            let at = random.below(mesh.indices.len());
            mesh.indices.insert(at, flat);
        }
        // Three corners exactly on a line.
        let base = mesh.vertices.len() as u32;
        let [a, d] = [kit::whole_point(random, 2), kit::whole_point(random, 2)];
        let on_line = |s: f32| std::array::from_fn(|k| a[k] + s * d[k]);
        mesh.vertices.extend([0.0, 1.0, 3.0].map(on_line));
        mesh.indices.push([base, base + 1, base + 2]);
    }
    for sphere in model.sphere_sets.iter_mut().flatten() {
        match random.below(12) {
            0 => sphere[3] = [0.0, -0.0, -1.0, f32::NAN, f32::INFINITY][random.below(5)],
            1 => sphere[random.below(3)] = ODD[random.below(6)],
            _ => {}
        }
    }
    let mut rays = kit::rays(&model, &[Rays::Invalid], random, count / 5);
    rays.extend(kit::rays(&model, &Rays::HOSTILE, random, count / 5));
    rays.extend(kit::rays(&model, &Rays::ORDINARY, random, count - 2 * (count / 5)));
    Case::new(model, rays)
}

/// Floats of any bits, in the scene and in half of the rays; the others aim at what is there.
pub fn bits(random: &mut Random, count: usize) -> Case {
    from_numbers(random, count, |random| f32::from_bits(random.bits() as u32))
}

/// Finite floats whose exponents lie anywhere, near one another, or near either end.
pub fn exponents(random: &mut Random, count: usize) -> Case {
    const RANGES: [[f64; 2]; 5] =
        [[-149.0, 127.9], [-149.0, -120.0], [100.0, 127.9], [-20.0, 20.0], [120.0, 127.99]];
    let [low, high] = RANGES[random.below(5)];
    let number = move |random: &mut Random| {
        (random.between(-1.0, 1.0) * 2f64.powf(random.between(low, high))) as f32
    };
    from_numbers(random, count, number)
}

fn from_numbers(random: &mut Random, count: usize, number: impl Fn(&mut Random) -> f32) -> Case {
    let point = |random: &mut Random| [0; 3].map(|_| number(random));
    let triangles: Vec<_> =
        (0..1 + random.below(40)).map(|_| [0; 3].map(|_| point(random))).collect();
    let spheres = (0..random.below(10)).map(|_| {
        let [x, y, z] = point(random);
        [x, y, z, number(random).abs()]
    });
    let spheres = spheres.collect();
    let model = Model { meshes: vec![kit::soup(&triangles)], sphere_sets: vec![spheres] };
    let rays = (0..count).map(|_| {
        let from = point(random);
        let to = kit::feature(triangles[random.below(triangles.len())], random);
        let ray = match random.below(4) {
            0 => Ray::new(from, point(random)),
            _ => aimed(from, to),
        };
        match random.below(3) {
            0 => ray.with_limits(number(random), number(random)),
            1 => ray.with_limits(f32::NEG_INFINITY, f32::INFINITY),
            _ => ray,
        }
    });
    let rays = rays.collect();
    Case::new(model, rays)
}
