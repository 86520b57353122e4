//! The bounds of the filter for sixteen rays: a search for what breaks them.

use std::println;

use raykern_harness::make::Random;
use raykern_harness::search::{Worst, samples};

use super::abreast::{Aim, Opened};
use super::bounds::{is_within, mix, points, weight};
use crate::block::leaf::TriangleBlock;
use crate::exact::{Line, Meeting};
use crate::interval;
use crate::math::{Aabb, Extent};
use crate::ray::{Alike, Ray, RayPacket};
use crate::simd::Scalar;

/// A packet of rays from nearly one place, each to somewhere on the triangle or beside it, not far from each other.
fn packet(random: &mut Random, origin: [f32; 3], corners: [[f32; 3]; 3]) -> [Ray; 16] {
    let [a, b, c] = corners;
    let away = 2f32.powi(-(random.below(12) as i32 + 3));
    let apart = 2f64.powi(-(random.below(8) as i32));
    let middle = mix(mix(a, b, weight(random)), c, weight(random));
    core::array::from_fn(|_| {
        let origin = origin.map(|x| x + x * away * random.unit() as f32);
        let target = mix(mix(a, b, weight(random)), c, weight(random));
        let target = mix(middle, target, apart);
        let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
        let t = [1.0, 1f32.next_up(), 1f32.next_down(), f32::INFINITY][random.below(4)];
        Ray::new(origin, direction).with_limits(0.0, t)
    })
}

/// What the filter says of sixteen rays, against real arithmetic; how many of them hit.
fn packet_is_right(random: &mut Random, worst: &mut Worst) -> Result<u32, u32> {
    let ([origin, a, b, c], reach) = points(random);
    let corners = [a, b, c];
    let rays = packet(random, origin, corners);
    let Some((alike, 16)) = Alike::first_of(Scalar, &rays, Extent::new(reach, 1)) else {
        return Ok(0);
    };
    if !interval::triangle::has_area(corners) {
        return Ok(0);
    }
    let mut block =
        TriangleBlock { count: 1, live: 1, aabb: Aabb::around(&corners), ..TriangleBlock::EMPTY };
    for (v, vertex) in corners.into_iter().enumerate() {
        block.set_corner(0, v, v);
        for (column, x) in block.vertices.iter_mut().zip(vertex) {
            column[v] = x;
        }
    }
    let (mut packet, mut room) = (RayPacket::new(alike), [[[0.0; 16]; 2]; 16]);
    let [sound, ..] = packet.set(Scalar, alike, &rays);
    let (mut first, mut last) = (block.aabb.lower, block.aabb.upper);
    for k in 0..3 {
        if alike.backwards[k] {
            (first[k], last[k]) = (last[k], first[k]);
        }
    }
    let entered = packet.group(0).entered(Scalar, first, last);
    let opened = Opened::new(Scalar, &alike, &packet.spread, &block);
    let aim = Aim::new(Scalar, packet.group(0), &opened, &mut room);
    let lanes = sound & aim.within(Scalar);
    let passed = aim.passed(Scalar, &opened, lanes) != 0;
    let found = aim.look(Scalar, &opened, 0, lanes);
    let [near, far] = aim.span(Scalar, &found);
    let mut hits = 0;
    for (i, ray) in rays.iter().enumerate() {
        let line = Line { origin: ray.origin, direction: ray.direction };
        let Some(prepared) = ray.prepare(Extent::new(reach, 1)) else { continue };
        let met = interval::triangle::meet(&line, &corners)
            .map(|(met, _)| met)
            .filter(|_| is_within(&line, &Meeting::Triangle(corners), &prepared));
        let (candidate, clear) = (found.candidates >> i & 1 == 1, found.clear >> i & 1 == 1);
        let right = match met {
            Some(_) => candidate && passed && entered >> i & 1 == 1,
            None => !clear,
        };
        if !right {
            println!("{ray:?} {corners:?} {met:?} {candidate} {clear} {entered:x}");
            return Err(hits);
        }
        let Some(met) = met else { continue };
        hits |= 1 << i;
        if clear {
            let rate = f64::from(ray.direction[alike.axes[2]].abs()) * f64::from(alike.scale);
            let (depth, middle) = (met.t * rate, f64::from(near[i]).midpoint(f64::from(far[i])));
            let known = met.t_error * rate;
            if worst.see(depth - middle, f64::from(far[i]) - middle + known) {
                return Err(hits);
            }
        }
    }
    Ok(hits)
}

#[test]
fn packets() {
    const SEED: u64 = 13;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = Worst::new("triangle, f32: depth for a packet");
    let mut hits = 0;
    for sample in 0..samples(200_000) {
        let before = random.clone();
        match packet_is_right(&mut random, &mut worst) {
            Ok(more) => hits += more.count_ones(),
            Err(_) => panic!("sample {sample} of seed {SEED}: {before:?}"),
        }
    }
    assert!(hits > 20_000, "{hits}");
    worst.assert_tight(0.02);
}
