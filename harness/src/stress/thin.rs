//! Triangles that are hardly there.

use raykern::Ray;

use super::{Case, kit};
use crate::make::Random;
use crate::model::Model;
use crate::rays::{Family as Rays, aimed, round};

/// Needles 1e2 to 1e7 times as long as wide, alone and in fans around a shared tip.
pub fn needles(random: &mut Random, count: usize) -> Case {
    let width = kit::power(random, -7.0, -2.0);
    let mut triangles = Vec::new();
    let mut tip = round(random.point(-1.0, 1.0));
    let mut side = random.point(-1.0, 1.0);
    for _ in 0..10 + random.below(60) {
        let fan = random.below(4) != 0;
        if !fan {
            tip = round(random.point(-1.0, 1.0));
            side = random.point(-1.0, 1.0);
        }
        let step = random.direction();
        let next: [f64; 3] = std::array::from_fn(|k| side[k] + width * step[k]);
        let mut corners = [tip, round(side), round(next)];
        corners.rotate_left(random.below(3));
        triangles.push(corners);
        side = next;
    }
    with_rays(kit::soup(&triangles).into(), random, count)
}

/// Corners on a line up to rounding, or some floats off it.
pub fn slivers(random: &mut Random, count: usize) -> Case {
    let mut triangles = Vec::new();
    for _ in 0..5 + random.below(40) {
        let (a, b) = (random.point(-1.0, 1.0), random.point(-1.0, 1.0));
        let share = [random.unit(), 0.5, 1e-6, random.between(-1.0, 2.0)][random.below(4)];
        let mut c = round(std::array::from_fn(|k| a[k] + share * (b[k] - a[k])));
        for _ in 0..random.below(3) {
            let k = random.below(3);
            c[k] = kit::nudged(c[k], random.below(9) as i32 - 4);
        }
        let mut corners = [round(a), round(b), c];
        corners.rotate_left(random.below(3));
        triangles.push(corners);
    }
    with_rays(kit::soup(&triangles).into(), random, count)
}

fn with_rays(model: Model, random: &mut Random, count: usize) -> Case {
    let near = [Rays::InPlane, Rays::ThroughVertex, Rays::FromVertex, Rays::FromSurface];
    let mut rays = kit::rays(&model, &near, random, count / 4);
    while rays.len() < count {
        let corners = kit::triangle(&model, random);
        let to = kit::feature(corners, random);
        let from = round(random.point(-2.0, 2.0));
        rays.push(match random.below(4) {
            0 => {
                // From one triangle to another: most are next to an edge.
                let other = kit::triangle(&model, random);
                aimed(kit::feature(other, random), to)
            }
            1 => Ray::new(to, round(random.direction())).with_limits(-1.0, f32::INFINITY),
            _ => aimed(from, to),
        });
    }
    Case::new(model, rays)
}
