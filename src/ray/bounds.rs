//! The padding of boxes: a search for what breaks it, and how much of it is used.

use std::println;

use raykern_harness::make::Random;
use raykern_harness::oracle::dyadic::Dyadic;
use raykern_harness::search::{Worst, samples};

use super::{FrameSlab, NarrowSlab, PreparedRay, Ray, Slab, WideSlab};
use crate::math::rounding::{f32_above, f32_below};
use crate::math::{Aabb, Extent, wide};
use crate::simd::Scalar;

/// As in a large scene, where rays are soonest far outside.
const PRIMS: u32 = u32::MAX;

const RANGES: [[i32; 2]; 5] = [[-149, 127], [-149, -120], [60, 127], [-20, 20], [-2, 2]];

/// A ray and how far its scene reaches.
fn ray(random: &mut Random) -> Option<(PreparedRay, f32)> {
    let range = RANGES[random.below(RANGES.len())];
    let origin = [0, 1, 2].map(|_| random.wild(range));
    let mut direction = [0, 1, 2].map(|_| random.wild([-4, 4]));
    let k = random.below(3);
    match random.below(4) {
        0 => direction[k] = [0.0, -0.0][random.below(2)],
        1 => direction[k] = random.wild([-149, 4]),
        _ => {}
    }
    let length = 2f32.powi(random.below(200) as i32 - 100);
    let ray = Ray::new(origin, direction.map(|x| x * length));
    let reach = random.wild(range).abs();
    let reach = if random.below(2) == 0 { reach } else { 0.0 };
    let ray =
        ray.with_limits(f32::NEG_INFINITY, f32::INFINITY).prepare(Extent::new(reach, PRIMS))?;
    let reach = ray.given.origin.iter().fold(reach, |m, x| m.max(x.abs()));
    Some((ray, reach))
}

/// The ray for boxes in `f32`, if it is an ordinary one.
fn narrow(ray: &PreparedRay, reach: f32) -> Option<NarrowSlab> {
    ray.given.prepare_with(Scalar, Extent::new(reach, PRIMS)).map(|(_, slab)| slab)
}

/// A wall within reach, of any exponent.
fn wall(random: &mut Random, reach: f32) -> f32 {
    let part = random.unit() as f32 * 2f32.powi(-(random.below(30) as i32));
    if random.below(2) == 0 { reach * part } else { -reach * part }
}

/// The distances to walls, against an `f64` computation.
fn see_walls(random: &mut Random, ray: &PreparedRay, reach: f32, worst: &mut Worst) -> bool {
    let Some(slab) = narrow(ray, reach) else { return true };
    let k = random.below(3);
    let d = f64::from(ray.given.direction[k]);
    if d == 0.0 {
        return true;
    }
    let wall = wall(random, reach);
    let real = (f64::from(wall) - f64::from(ray.given.origin[k])) / d * ray.t_scale;
    // Where there can be no hit, the distance only has to stay on its side.
    if real.abs() > 2.0 * f64::from(reach * ray.scale) {
        return true;
    }
    let product = wall * slab.reciprocal[k];
    let (near, far) = (product + slab.near_shift[k], product + slab.far_shift[k]);
    let pad = (f64::from(slab.far_shift[k]) - f64::from(slab.near_shift[k])) / 2.0;
    worst.see(f64::from(near) + pad - real, pad);
    worst.see(f64::from(far) - pad - real, pad);
    f64::from(near) <= real && real <= f64::from(far)
}

/// Boxes around a point of the ray, as small as floats allow or thick: both slabs must hold its `t`.
fn boxes_hold(random: &mut Random, ray: &PreparedRay, reach: f32) -> bool {
    let fastest = (0..3).map(|k| ray.given.direction[k].abs()).fold(0.0, f32::max);
    let t = f64::from(reach) / f64::from(fastest) * random.between(-2.0, 2.0);
    let t = t * 2f64.powi(-(random.below(40) as i32));
    if t == 0.0 || !(t.abs() < f64::from(f32::MAX)) {
        return true;
    }
    let (o, d) = (wide(ray.given.origin), wide(ray.given.direction));
    let mut aabb = Aabb::EMPTY;
    for k in 0..3 {
        let step = d[k] * t;
        let off = (o[k].abs() + step.abs()) * 2f64.powi(-51);
        // A component of zero leaves the point where it is.
        let off = if step == 0.0 { 0.0 } else { off };
        let thick = [0.0, f64::from(reach) * random.unit()];
        aabb.lower[k] = f32_below(o[k] + step - off - thick[random.below(2)]);
        aabb.upper[k] = f32_above(o[k] + step + off + thick[random.below(2)]);
    }
    if aabb.reach() > reach {
        return true;
    }
    let t = t * ray.t_scale;
    let holds = |slab: &dyn Fn(f32) -> super::Interval<f32>| {
        let bound = f32_above(t);
        [bound, ray.t_max].into_iter().all(|bound| {
            let part = slab(bound);
            f64::from(part.near) <= t && t <= f64::from(part.far)
        })
    };
    let narrow = narrow(ray, reach);
    let framed = FrameSlab::new(ray, Extent::new(reach, PRIMS));
    holds(&|bound| WideSlab::new(ray).part(aabb.corners(), bound))
        && holds(&|bound| framed.part(aabb.corners(), bound))
        && narrow.is_none_or(|slab| holds(&|bound| slab.part(aabb.corners(), bound)))
}

#[test]
fn narrow_boxes() {
    const SEED: u64 = 21;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = Worst::new("box, f32: distance of a wall");
    for sample in 0..samples(1_500_000) {
        let before = random.clone();
        let Some((ray, reach)) = ray(&mut random) else { continue };
        let right = see_walls(&mut random, &ray, reach, &mut worst);
        assert!(right, "wall, sample {sample} of seed {SEED}: {before:?}");
        let right = boxes_hold(&mut random, &ray, reach);
        assert!(right, "box, sample {sample} of seed {SEED}: {before:?}");
    }
    worst.assert_tight(0.3);
}

/// A ray that begins far outside, and a point on it in a scene that reaches not much farther than that.
fn far_ray(random: &mut Random) -> Option<(PreparedRay, Extent, [f64; 3], f64)> {
    let axis = random.below(3);
    let mut direction = [0, 1, 2].map(|_| random.wild([-2, 2]));
    let mut origin = [0, 1, 2].map(|_| random.wild([-2, 2]));
    // Aimed at the middle, where the direction is not along an axis.
    let distance = 2f32.powi(random.below(100) as i32);
    match random.below(3) {
        0 => {
            (0..3).filter(|k| *k != axis).for_each(|k| direction[k] = [0.0, -0.0][random.below(2)])
        }
        1 => direction[axis] = 0.0,
        _ => {}
    }
    for k in 0..3 {
        origin[k] = if direction[k] == 0.0 { origin[k] } else { -direction[k] * distance };
    }
    let (o, d) = (wide(origin), wide(direction));
    let t = -o.dot(d) / d.dot(d);
    let t = t * (1.0 + random.between(-1.0, 1.0) * 2f64.powi(-(20 + random.below(30) as i32)));
    let point = [0, 1, 2].map(|k| o[k] + d[k] * t);
    let reach = point.iter().fold(0.0, |m: f64, x| m.max(x.abs())) * random.between(1.0, 90.0);
    let ray = Ray::new(origin, direction).with_limits(f32::NEG_INFINITY, f32::INFINITY);
    let extent = Extent::new(reach as f32, PRIMS);
    Some((ray.prepare(extent)?, extent, point, t))
}

/// Boxes around such points, as small as floats allow.
#[test]
fn boxes_of_far_rays() {
    const SEED: u64 = 23;
    println!("seed {SEED}");
    let (mut random, mut far, mut beside) = (Random::new(SEED), 0, 0);
    for sample in 0..samples(300_000) {
        let Some((ray, extent, point, t)) = far_ray(&mut random) else { continue };
        far += u32::from(ray.given.prepare_with(Scalar, extent).is_none());
        let mut aabb = Aabb::EMPTY;
        for (k, x) in point.into_iter().enumerate() {
            let step = f64::from(ray.given.direction[k]) * t;
            let off = if step == 0.0 { 0.0 } else { step.abs() * 2f64.powi(-51) };
            (aabb.lower[k], aabb.upper[k]) = (f32_below(x - off), f32_above(x + off));
        }
        let t = t * ray.t_scale;
        let reach = extent.scene.max(aabb.reach());
        let framed = FrameSlab::new(&ray, Extent::new(reach, PRIMS));
        for bound in [f32_above(t), ray.t_max] {
            let part = framed.part(aabb.corners(), bound);
            let holds = f64::from(part.near) <= t && t <= f64::from(part.far);
            assert!(holds, "sample {sample} of seed {SEED}: {ray:?} {aabb:?} {t} {part:?}");
        }
        // What is clearly beside the ray is left out, or all of this would be in vain.
        if far_enough(&ray, extent) && aabb.reach() < 0.1 * extent.scene {
            for k in 0..3 {
                let mut moved = aabb;
                (moved.lower[k], moved.upper[k]) = (extent.scene, extent.scene);
                let Aabb { lower, upper } = moved;
                if WideSlab::new(&ray).part([&lower, &upper], ray.t_max).is_empty() {
                    let part = framed.part([&lower, &upper], ray.t_max);
                    assert!(part.is_empty(), "{ray:?} {moved:?}");
                    beside += 1;
                }
            }
        }
    }
    assert!(beside > 10_000, "{beside} boxes beside");
    assert!(far > 10_000, "{far} rays from far outside");
}

/// Whether a ray begins far outside, but not so far that its own numbers tell less than a hundredth of the scene.
fn far_enough(ray: &PreparedRay, extent: Extent) -> bool {
    let farthest = ray.given.origin.iter().fold(0f32, |m, x| m.max(x.abs()));
    farthest > extent.near && farthest < 1e12 * extent.scene
}

/// `(wall - o) * inverse` against the quotient, without error: `x d` against `(wall - o) t_scale`.
#[test]
fn wide_boxes() {
    const SEED: u64 = 22;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = Worst::new("box, f64: distance of a wall");
    for _ in 0..samples(100_000) {
        let Some((ray, reach)) = ray(&mut random) else { continue };
        let (k, wall) = (random.below(3), wall(&mut random, reach));
        let (o, d) = (ray.given.origin[k], ray.given.direction[k]);
        if d == 0.0 || wall == o {
            continue;
        }
        let x = (f64::from(wall) - f64::from(o)) * WideSlab::new(&ray).inverse[k];
        let real = &Dyadic::from_f32(wall) - &Dyadic::from_f32(o);
        let real = &real * &Dyadic::from_f64(ray.t_scale);
        let product = &Dyadic::from_f64(x) * &Dyadic::from_f32(d);
        worst.see((&product - &real).ratio(&product), WideSlab::PAD);
    }
    worst.assert_tight(0.3);
}
