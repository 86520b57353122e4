//! Limits at the very distance of a hit, and everything a query may leave out.

use raykern::{QueryOptions, Ray};

use super::{Case, kit};
use crate::make::{self, Random};
use crate::model::Model;
use crate::oracle::Oracle;
use crate::rays::Family as Rays;

/// Limits equal to the rounded t of the first hit, a float beside it, and at the ends of the line.
///
/// Limits are compared with the real t, so the rounded one is inside or outside, as it was rounded.
pub fn limits(random: &mut Random, count: usize) -> Case {
    let model = some_mixed(random);
    let oracle = Oracle::new(&model);
    let families = [Rays::Random, Rays::AtVertex, Rays::AtEdge, Rays::ThroughVertex, Rays::Inside];
    let mut rays = kit::rays(&model, &families, random, count);
    for ray in &mut rays {
        let start = if random.below(3) == 0 { f32::NEG_INFINITY } else { 0.0 };
        let free = Ray { t_min: start, ..*ray };
        let hit = oracle.closest(&free, &QueryOptions::default()).hit;
        let t = hit.map_or(1.0, |hit| hit.t.rounded());
        let (low, high) = (t.next_down(), t.next_up());
        let pairs = [
            (t, t),
            (t, f32::INFINITY),
            (start.min(t), t),
            (high, f32::INFINITY),
            (start.min(low), low),
            (low, high),
            (low, low),
            (high, high),
            (f32::NEG_INFINITY, t),
            (f32::NEG_INFINITY, f32::INFINITY),
            (-f32::MAX, f32::MAX),
            (f32::NEG_INFINITY, low),
            (f32::INFINITY, f32::INFINITY),
            (f32::NEG_INFINITY, -0.0),
            (0.0, -0.0),
            (-1.0, -0.5),
        ];
        (ray.t_min, ray.t_max) = pairs[random.below(pairs.len())];
    }
    Case::new(model, rays)
}

/// Masks, sides and skipped primitives on all rays.
pub fn options(random: &mut Random, count: usize) -> Case {
    let model = some_mixed(random);
    let families = [Rays::Random, Rays::Inside, Rays::FromSurface, Rays::AtEdge, Rays::Limited];
    let rays = kit::rays(&model, &families, random, count);
    let mut case = Case::new(model, rays);
    case.mix_options(random, 1.0);
    case
}

/// Two meshes, doubled in part, and two sets of spheres.
fn some_mixed(random: &mut Random) -> Model {
    let first = kit::closed_mesh(random);
    let mut second = kit::closed_mesh(random);
    if random.below(2) == 0 {
        second = first.clone();
    }
    second.append(&make::soup(20, random.bits()).placed(2.0, [-1.0; 3]));
    let mut ball = || {
        let [x, y, z] = kit::whole_point(random, 4).map(|x| x / 4.0);
        [x, y, z, 0.25 * (1 + random.below(6)) as f32]
    };
    let sphere_sets = vec![vec![ball(), ball(), ball()], vec![ball(), ball()]];
    Model { meshes: vec![first, second], sphere_sets }
}
