//! Small tools that the families share.

use raykern::Ray;

use crate::make::{self, Random};
use crate::model::{Model, TriangleMesh};
use crate::rays::{Family as Rays, RayMaker, mix};

/// `count` rays of these families, mixed.
pub fn rays(model: &Model, families: &[Rays], random: &mut Random, count: usize) -> Vec<Ray> {
    let mut maker = RayMaker::new(model, random.bits());
    (0..count).map(|_| maker.one(families[random.below(families.len())])).collect()
}

/// A small model of any kind.
pub fn some_model(random: &mut Random, prims: usize) -> Model {
    make::ALL[random.below(make::ALL.len())].1(prims)
}

/// A closed mesh around the origin, which sees all of it from inside.
pub fn closed_mesh(random: &mut Random) -> TriangleMesh {
    let triangles = [12, 48, 108, 300, 768][random.below(5)];
    match random.below(3) {
        0 => make::sphere(triangles),
        1 => make::blob(triangles, random.bits() % 1000),
        _ => make::box_mesh([-1.0, -0.7, -0.9], [0.8, 1.0, 1.1], 1 + random.below(5)),
    }
}

/// A turned, stretched and moved copy, so that nothing is round or parallel.
pub fn turned(mesh: TriangleMesh, random: &mut Random) -> TriangleMesh {
    let [x, y, z] = [0; 3].map(|_| {
        let d = random.direction();
        d.map(|c| c * 1.3)
    });
    let stretch = random.between(0.5, 2.0);
    mesh.mapped(|p| {
        let p = [p[0] * stretch, p[1], p[2]];
        std::array::from_fn(|k| x[k] * p[0] + y[k] * p[1] + z[k] * p[2])
    })
}

/// A mesh of separate triangles.
pub fn soup(triangles: &[[[f32; 3]; 3]]) -> TriangleMesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh { vertices: triangles.concat(), indices }
}

/// A random triangle of the model's meshes, which must have one.
pub fn triangle(model: &Model, random: &mut Random) -> [[f32; 3]; 3] {
    let meshes: Vec<_> = model.meshes.iter().filter(|m| !m.indices.is_empty()).collect();
    let mesh = meshes[random.below(meshes.len())];
    mesh.indices[random.below(mesh.indices.len())].map(|v| mesh.vertices[v as usize])
}

/// A vertex, or a rounded point of an edge or of the face.
pub fn feature(corners: [[f32; 3]; 3], random: &mut Random) -> [f32; 3] {
    let turn = random.below(3);
    let [a, b, c] = [0, 1, 2].map(|i| corners[(i + turn) % 3]);
    match random.below(5) {
        0 | 1 => a,
        2 | 3 => mix(a, b, random.unit()),
        _ => mix(a, mix(b, c, random.unit()), random.unit().sqrt()),
    }
}

/// A whole number from `-bound` to `bound`.
pub fn whole(random: &mut Random, bound: usize) -> f32 {
    random.below(2 * bound + 1) as f32 - bound as f32
}

/// Three whole numbers.
pub fn whole_point(random: &mut Random, bound: usize) -> [f32; 3] {
    [0; 3].map(|_| whole(random, bound))
}

/// Three whole numbers, not all zero.
pub fn whole_direction(random: &mut Random, bound: usize) -> [f32; 3] {
    loop {
        let direction = whole_point(random, bound);
        if direction != [0.0; 3] {
            return direction;
        }
    }
}

/// `10^x` with `x` between the two.
pub fn power(random: &mut Random, low: f64, high: f64) -> f64 {
    10f64.powf(random.between(low, high))
}

/// The float `steps` after `x`.
pub fn nudged(x: f32, steps: i32) -> f32 {
    let step = if steps < 0 { f32::next_down } else { f32::next_up };
    (0..steps.abs()).fold(x, |x, _| step(x))
}

/// With probability one half a float or two off.
pub fn perhaps_nudged(x: f32, random: &mut Random) -> f32 {
    let steps = [0, 0, 0, 0, -1, 1, -2, 2][random.below(8)];
    nudged(x, steps)
}

/// Scaled and moved, rounded once.
pub fn placed(model: &mut Model, scale: f64, offset: [f64; 3]) {
    for vertex in model.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices) {
        *vertex = std::array::from_fn(|k| clipped(f64::from(vertex[k]) * scale + offset[k]));
    }
    for sphere in model.sphere_sets.iter_mut().flatten() {
        for k in 0..3 {
            sphere[k] = clipped(f64::from(sphere[k]) * scale + offset[k]);
        }
        sphere[3] = clipped(f64::from(sphere[3]) * scale);
    }
}

/// The nearest finite float.
pub fn clipped(x: f64) -> f32 {
    (x as f32).clamp(-f32::MAX, f32::MAX)
}
