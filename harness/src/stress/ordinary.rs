//! Scenes like real ones.

use super::{Case, kit};
use crate::make::Random;
use crate::rays::Family as Rays;

/// Any generated scene of up to two thousand primitives, under the rays of a renderer.
pub fn ordinary(random: &mut Random, count: usize) -> Case {
    let prims = [50, 300, 2_000][random.below(3)];
    let model = kit::some_model(random, prims);
    let rays = kit::rays(&model, &Rays::ORDINARY, random, count);
    Case::new(model, rays)
}

/// The same scenes under rays that look for trouble.
pub fn hostile(random: &mut Random, count: usize) -> Case {
    let prims = [50, 300, 1_000][random.below(3)];
    let model = kit::some_model(random, prims);
    let rays = kit::rays(&model, &Rays::HOSTILE, random, count);
    Case::new(model, rays)
}
