//! The bounds of grid steps: a search for what breaks them, and how much of them is used.

use std::println;

use raykern_harness::make::Random;
use raykern_harness::oracle::dyadic::Dyadic;
use raykern_harness::search::{Worst, samples};

use super::DILATION;
use super::cells::CellRay;
use super::steps::{Real, Steps};
use crate::block::cells::GridHead;
use crate::math::rounding::UNIT;
use crate::math::{Aabb, wide};
use crate::ray::{Interval, PreparedRay, Ray, WideSlab};

/// A grid over a box that may be flat, far from zero, or both.
fn grid(random: &mut Random) -> (GridHead, Aabb) {
    let size = 2f32.powi(random.below(100) as i32 - 80);
    let mut aabb = Aabb::EMPTY;
    for k in 0..3 {
        let far = [[-3, 20], [20, 90]][random.below(2)];
        let middle = [0.0, random.wild(far) * size][random.below(2)];
        let extent = [1.0, 1.0, random.unit() as f32, 2f32.powi(-13), 0.0][random.below(5)] * size;
        (aabb.lower[k], aabb.upper[k]) = (middle, middle + extent);
    }
    // A triangle has area, and the box of a sphere is rounded outwards.
    if (0..3).filter(|k| aabb.lower[*k] < aabb.upper[*k]).count() < 2 {
        return grid(random);
    }
    (GridHead::new(&aabb, 1 + random.below(300) as u32), aabb)
}

fn point_in(random: &mut Random, aabb: &Aabb) -> [f32; 3] {
    [0, 1, 2].map(|k| {
        let s = [0.0, 1.0, random.unit() as f32, random.unit() as f32][random.below(4)];
        let x = aabb.lower[k] + (aabb.upper[k] - aabb.lower[k]) * s;
        x.clamp(aabb.lower[k], aabb.upper[k])
    })
}

/// From within `distance` grids to a point of the box.
fn ray_to(random: &mut Random, aabb: &Aabb, distance: i32) -> Option<PreparedRay> {
    let (from, to) = (point_in(random, aabb), point_in(random, aabb));
    let size = (wide(aabb.upper) - wide(aabb.lower)).max_element();
    let away = 2f64.powi(random.below(distance as usize + 10) as i32 - 9);
    let away = if random.below(4) == 0 { 0.0 } else { away * size };
    let turn = random.direction();
    let origin = [0, 1, 2].map(|k| (f64::from(from[k]) + turn[k] * away) as f32);
    let mut direction = [0, 1, 2].map(|k| (f64::from(to[k]) - f64::from(origin[k])) as f32);
    if random.below(4) == 0 {
        let k = random.below(3);
        direction[k] *= [0.0, 1e-9, 1e-13, 1e-20][random.below(4)];
    }
    Ray::new(origin, direction).prepare(aabb.reach())
}

/// `(o + t d' - lower - wall * cell) / cell`, without error: how far the ray is from a wall at `t`.
fn beyond_wall(head: &GridHead, ray: &PreparedRay, k: usize, t: f64, wall: u32) -> f64 {
    let [o, d] = [ray.given.origin[k], ray.given.direction[k]].map(Dyadic::from_f32);
    let step = &d * &Dyadic::from_f64(t / ray.t_scale);
    let cell = Dyadic::from_f64(head.cell[k]);
    let wall = &Dyadic::from_f64(f64::from(wall)) * &cell;
    let at = &(&o + &step) - &(&Dyadic::from_f64(head.lower[k]) + &wall);
    at.ratio(&cell)
}

/// A walk to its end: where the ray really is when it starts and whenever it changes cells.
fn see_walk<F: Real + Into<f64>>(
    random: &mut Random,
    head: &GridHead,
    ray: &PreparedRay,
    start: &mut Worst,
    wall: &mut Worst,
) -> bool {
    let cell_ray = CellRay::new(head, ray);
    let (lower, upper) = head.corners();
    let part = WideSlab::new(ray).clip(lower, upper, f64::from(ray.t_max));
    if !cell_ray.steps_safely::<F>() || part.is_empty() {
        return true;
    }
    let granted = 6.0 * F::UNIT * cell_ray.extent();
    let mut broken = false;
    for _ in 0..8 {
        // Starts where the ray passes a wall: only there can the cell be another one.
        let k = random.below(3);
        let wall = random.below(head.resolution[k] as usize + 1) as f64;
        let t = (wall - cell_ray.origin[k]) / cell_ray.direction[k];
        let t = t * (1.0 + F::UNIT * random.between(-2.0, 2.0));
        if !(part.near <= t && t <= part.far) {
            continue;
        }
        let steps = Steps::<F>::new(&cell_ray, Interval { near: t, ..part });
        let at = beyond_wall(head, ray, k, t, 0);
        let cell = f64::from(steps.cell[k]);
        let inside = at.max(0.0).min(f64::from(head.resolution[k]));
        broken |= start.see((cell - inside).max(inside - cell - 1.0).max(0.0), granted);
    }
    let mut steps = Steps::<F>::new(&cell_ray, part);
    loop {
        let (cell, t) = (steps.cell, steps.t_next);
        let going = steps.advance(F::INFINITY);
        let Some(k) = (0..3).find(|k| steps.cell[*k] != cell[*k]).filter(|_| going) else {
            return !broken;
        };
        let passed = cell[k].max(steps.cell[k]);
        broken |= wall.see(beyond_wall(head, ray, k, t[k].into(), passed), granted);
    }
}

fn walks<F: Real + Into<f64>>(seed: u64, distance: i32, names: [&'static str; 2], least: f64) {
    println!("seed {seed}");
    let mut random = Random::new(seed);
    let [mut start, mut wall] = names.map(Worst::new);
    for sample in 0..samples(4_000) {
        let before = random.clone();
        let (head, aabb) = grid(&mut random);
        let Some(ray) = ray_to(&mut random, &aabb, distance) else { continue };
        let right = see_walk::<F>(&mut random, &head, &ray, &mut start, &mut wall);
        assert!(right, "sample {sample} of seed {seed}: {before:?}");
    }
    start.assert_tight(least);
    wall.assert_tight(least);
}

#[test]
fn steps_in_f32() {
    walks::<f32>(41, 8, ["grid, f32: start", "grid, f32: wall"], 0.1);
}

#[test]
fn steps_in_f64() {
    walks::<f64>(42, 30, ["grid, f64: start", "grid, f64: wall"], 0.1);
}

/// A primitive is listed in the cells of its box and, on either side, within the dilation less what
/// rounding takes: a quarter of it is left to that.
#[test]
fn insertion() {
    const SEED: u64 = 43;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = Worst::new("grid: cell of a box");
    for _ in 0..samples(100_000) {
        let (head, aabb) = grid(&mut random);
        let point = point_in(&mut random, &aabb);
        let cells = head.cells_of(&Aabb { lower: point, upper: point });
        for k in 0..3 {
            let at = &Dyadic::from_f32(point[k]) - &Dyadic::from_f64(head.lower[k]);
            let at = at.ratio(&Dyadic::from_f64(head.cell[k]));
            let last = f64::from(head.resolution[k] - 1);
            let [first, end] = cells[k].map(f64::from);
            let off = (first.min(last) - (at - DILATION)).max(at + DILATION - end - 1.0);
            // At the ends of the grid the margin takes the place of the dilation.
            let off = if at + DILATION > last + 1.0 { first - (at - DILATION) } else { off };
            worst.see(off.max(0.0), DILATION / 4.0);
        }
    }
    // The bound is for the worst grid there can be, whose cells are 2^-34 of a coordinate.
    worst.assert_tight(0.0);
}

/// All that a block can hold lies inside the walls by more than rounding an exit can take.
#[test]
fn exits_are_behind_the_contents() {
    let mut random = Random::new(44);
    for _ in 0..samples(100_000) {
        let (head, aabb) = grid(&mut random);
        let (lower, upper) = head.corners();
        for k in 0..3 {
            let margin =
                (f64::from(aabb.lower[k]) - lower[k]).min(upper[k] - f64::from(aabb.upper[k]));
            let size = lower[k].abs().max(upper[k].abs());
            assert!(margin >= 64.0 * UNIT * size, "{k} {head:?} {aabb:?}");
            assert!(margin >= DILATION * head.cell[k], "{k} {head:?} {aabb:?}");
        }
    }
}
