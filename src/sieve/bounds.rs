//! The bounds of the `f32` filters: a search for what breaks them, and how much of them is used.
//!
//! `RAYKERN_SEARCH=100 cargo test --release --lib bounds -- --nocapture` searches a hundred times longer.

use core::cmp::Ordering;
use std::println;

use raykern_harness::make::Random;
use raykern_harness::search::{Worst, samples};

use super::sphere::{chord, sphere};

use super::triangle::single::{Sieved, area, area_error, coordinate_error, sheared, sieve};
use crate::exact::{Distance, Line, Meeting};
use crate::interval;
use crate::math::{Extent, sum_abs, wide};
use crate::ray::{Interval, PreparedRay, Ray};

/// Exponents of coordinates: all, either end, ordinary ones, and nearly one size.
const RANGES: [[i32; 2]; 6] = [[-149, 127], [-149, -120], [100, 127], [-20, 20], [-2, 2], [-2, 2]];

pub(super) fn mix(a: [f32; 3], b: [f32; 3], s: f64) -> [f32; 3] {
    [0, 1, 2].map(|k| (f64::from(a[k]) * (1.0 - s) + f64::from(b[k]) * s) as f32)
}

/// A weight: often 0 or 1 or close to them, at times outside.
pub(super) fn weight(random: &mut Random) -> f64 {
    let near = 2f64.powi(-(random.below(30) as i32)) * random.between(-1.0, 1.0);
    match random.below(4) {
        0 => 0.0,
        1 => near,
        2 => 1.0 + near,
        _ => random.unit(),
    }
}

/// From `origin` about to `target`, with a direction of any length; at times along an axis or nearly.
fn aimed(random: &mut Random, origin: [f32; 3], target: [f32; 3]) -> Ray {
    let length = 2f64.powi([0, 0, 0, random.below(60) as i32 - 30][random.below(4)]);
    let way = |k: usize| f64::from(target[k]) - f64::from(origin[k]);
    let mut direction = [0, 1, 2].map(|k| (way(k) * length) as f32);
    if random.below(6) == 0 {
        let k = random.below(3);
        direction[k] = [0.0, -0.0, 1e-30, direction[k] * 1e-12][random.below(4)];
    }
    Ray::new(origin, direction)
}

/// Coordinates of one case, and how far the rest of its scene reaches.
pub(super) fn points<const N: usize>(random: &mut Random) -> ([[f32; 3]; N], f32) {
    let range = RANGES[random.below(RANGES.len())];
    let middle = [0, 1, 2].map(|_| random.wild(range));
    let spread = 2f64.powi(-(random.below(26) as i32)) as f32;
    let local = random.below(3) == 0;
    let points: [[f32; 3]; N] = core::array::from_fn(|_| {
        [0, 1, 2].map(|k| {
            let x = random.wild(range);
            let x = if local { middle[k] + middle[k] * spread * random.unit() as f32 } else { x };
            x.clamp(-f32::MAX, f32::MAX)
        })
    });
    let reach = points.as_flattened().iter().fold(0f32, |m, x| m.max(x.abs()));
    let more = if random.below(8) == 0 { random.wild([-149, 127]).abs() } else { 0.0 };
    (points, reach.max(more))
}

/// The ray, its limits moved close to the real `t` at times.
fn limited(random: &mut Random, ray: Ray, t: Option<f64>) -> Ray {
    let Some(t) = t.map(|t| t as f32).filter(|t| t.is_finite()) else { return ray };
    let limits = [t, t.next_up(), t.next_down(), t * (1.0 + 1e-6), t * (1.0 - 1e-6)];
    let near = |random: &mut Random| limits[random.below(limits.len())];
    match random.below(4) {
        0 => ray,
        1 => ray.with_limits(f32::NEG_INFINITY, near(random)),
        2 => ray.with_limits(near(random), f32::INFINITY),
        _ => ray.with_limits(-f32::MAX, f32::INFINITY),
    }
}

pub(super) fn is_within(line: &Line, meeting: &Meeting, ray: &PreparedRay) -> bool {
    Distance::new(line, meeting).is_some_and(|t| {
        t.compare_with(ray.given.t_min) != Ordering::Less
            && t.compare_with(ray.given.t_max) != Ordering::Greater
    })
}

struct TriangleWorst {
    coordinate: Worst,
    area: Worst,
    rise: Worst,
    t: Worst,
    part: Worst,
}

/// What the sieve says of one case, against real arithmetic; false where it is wrong.
fn triangle_is_right(random: &mut Random, worst: &mut TriangleWorst) -> bool {
    let ([origin, a, b, c], reach) = points(random);
    let corners = [a, b, c];
    if !interval::triangle::has_area(corners) {
        return true;
    }
    let target = mix(mix(a, b, weight(random)), c, weight(random));
    let ray = aimed(random, origin, target);
    let line = Line { origin, direction: ray.direction };
    let met = ray
        .prepare(Extent::new(reach, 1))
        .and_then(|_| interval::triangle::meet(&line, &corners))
        .map(|(met, _)| met);
    let Some(ray) = limited(random, ray, met.map(|met| met.t)).prepare(Extent::new(reach, 1))
    else {
        return true;
    };
    let far = met.map(|met| ray.t_above(met.t, met.t_error * 1.01));
    let bound = far.filter(|_| random.below(2) == 0).unwrap_or(ray.t_max).min(ray.t_max);
    let sieved = sieve(&ray, bound, corners);
    let hit = || is_within(&line, &Meeting::Triangle(corners), &ray);
    see_triangle(&ray, corners, met.map(|met| met.t), &sieved, worst);
    let right = match met {
        Some(_) if sieved.rejected => !hit(),
        Some(met) => {
            let side = sieved.detail.front.is_none_or(|front| front == met.front);
            let Interval { near, far } = sieved.part;
            let within = sieved.sure && ray.t_min < near && far < ray.t_max;
            side && (!(sieved.inside || within) || hit())
        }
        None => sieved.rejected || !sieved.sure && !sieved.inside,
    };
    if !right {
        println!("{ray:?}\n{corners:?}\n{met:?} bound {bound:e}\n{sieved:?}");
    }
    right
}

/// Errors against an `f64` computation, whose own errors are 2^-29 of the bounds.
fn see_triangle(
    ray: &PreparedRay,
    corners: [[f32; 3]; 3],
    t: Option<f64>,
    sieved: &Sieved,
    worst: &mut TriangleWorst,
) {
    let given = &ray.given;
    let [kx, ky, kz] = ray.shear.axes.map(|axis| axis as usize);
    let scale = f64::from(ray.scale);
    let d = wide(given.direction);
    let real = corners.map(|v| {
        let v = (wide(v) - wide(given.origin)) * scale;
        let steps = v[kz] / d[kz];
        [v[kx] - d[kx] * steps, v[ky] - d[ky] * steps]
    });
    let [p, q, r] = corners.map(|v| sheared(ray, v));
    let all = [&p, &q, &r];
    let size = all.iter().fold(0f32, |m, v| m.max(v.x.abs()).max(v.y.abs()));
    let deepest = all.iter().fold(0f32, |m, v| m.max(v.depth.abs()));
    let shift = coordinate_error(ray, size, deepest);
    for (v, real) in all.into_iter().zip(real) {
        let error = (f64::from(v.x) - real[0]).abs().max((f64::from(v.y) - real[1]).abs());
        // 2^-140: what falls below the least float.
        worst.coordinate.see(error, f64::from(shift) + 2f64.powi(-140));
    }
    let unsure = area_error(ray, size, deepest);
    let areas = [area(&q, &r), area(&r, &p), area(&p, &q)];
    for (i, (j, k)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
        let real = real[j][0] * real[k][1] - real[j][1] * real[k][0];
        worst.area.see(f64::from(areas[i]) - real, f64::from(unsure));
    }
    let Some(t) = t else { return };
    let depth = t * ray.t_scale * f64::from(ray.shear.depth_rate);
    let Sieved { total, rise, error, middle, .. } = sieved;
    let total = f64::from(*total);
    let above_middle = depth + f64::from(ray.shear.origin_depth) - f64::from(*middle);
    // What this computation may be off itself.
    let own = depth.abs() * 2f64.powi(-48) * total;
    if sieved.sure {
        worst.rise.see(f64::from(*rise) - above_middle * total, f64::from(*error) + own);
        let off = (f64::from(sieved.detail.t) * f64::from(ray.shear.depth_rate) - depth).abs();
        let granted = f64::from(*error) / total;
        let rounded = depth.abs() + f64::from(*middle - ray.shear.origin_depth).abs();
        worst.t.see(off, granted + rounded * 2f64.powi(-22) + 2f64.powi(-140));
        let (t, own) = (t * ray.t_scale, depth.abs() * 2f64.powi(-48));
        let (near, far) = (f64::from(sieved.part.near), f64::from(sieved.part.far));
        let (middle, half) = ((near + far) / 2.0, (far - near) / 2.0);
        worst.part.see(t - middle, half + own);
    }
}

#[test]
fn triangles() {
    const SEED: u64 = 11;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = TriangleWorst {
        coordinate: Worst::new("triangle, f32: coordinate"),
        area: Worst::new("triangle, f32: area"),
        rise: Worst::new("triangle, f32: rise"),
        t: Worst::new("triangle, f32: t of the watertight mode"),
        part: Worst::new("triangle, f32: part of the ray"),
    };
    for sample in 0..samples(1_000_000) {
        let before = random.clone();
        let right = triangle_is_right(&mut random, &mut worst);
        assert!(right, "sample {sample} of seed {SEED}: {before:?}");
    }
    worst.coordinate.assert_tight(0.4);
    worst.area.assert_tight(0.1);
    worst.rise.assert_tight(0.02);
    worst.t.assert_tight(0.02);
    worst.part.assert_tight(0.02);
}

struct SphereWorst {
    discriminant: Worst,
    t: Worst,
}

/// What the filter says of a sphere, against real arithmetic; false where it is wrong.
fn sphere_is_right(random: &mut Random, worst: &mut SphereWorst) -> bool {
    let ([mut origin, centre, other], reach) = points(random);
    let radius = match random.below(3) {
        0 => {
            let range = RANGES[random.below(RANGES.len())];
            random.wild(range).abs()
        }
        _ => sum_abs(wide(other) - wide(centre)) as f32,
    };
    if !(radius > 0.0 && radius.is_finite()) {
        return true;
    }
    // A point of the surface, or one beside it, from which the ray may start as well.
    let on = |random: &mut Random| {
        let (away, grow) = (random.direction(), f64::from(radius) * weight(random));
        [0, 1, 2].map(|k| (f64::from(centre[k]) + away[k] * grow) as f32)
    };
    if random.below(3) == 0 {
        origin = on(random).map(|x| x.clamp(-f32::MAX, f32::MAX));
    }
    let target = on(random);
    let ray = aimed(random, origin, target);
    let reach = reach.max(sphere_reach(centre, radius));
    let line = Line { origin, direction: ray.direction };
    let Some(_) = ray.prepare(Extent::new(reach, 1)) else { return true };
    let met = interval::sphere::meet(&line, centre, radius);
    let t = met.map(|met| met.t[random.below(2)]);
    let Some(ray) = limited(random, ray, t).prepare(Extent::new(reach, 1)) else { return true };
    let lane = sphere(&ray, ray.t_max, centre, radius);
    let scale = f64::from(ray.scale);
    let (v, d) = ((wide(origin) - wide(centre)) * scale, wide(ray.given.direction));
    let l = v - d * (v.dot(d) / d.length_squared());
    let r = f64::from(radius) * scale;
    let chord = chord(&ray, centre, radius * ray.scale);
    let off = f64::from(chord.discriminant) - (r * r - l.length_squared());
    worst.discriminant.see(off, f64::from(chord.unsure));
    let Some(met) = met else { return true };
    [0, 1].into_iter().all(|root| match &lane {
        None => !is_within(&line, &Meeting::Sphere { centre, radius, root }, &ray),
        Some(lane) => {
            let off = (f64::from(lane.t[root]) - met.t[root] * ray.t_scale).abs();
            let known = met.t_error[root] * ray.t_scale;
            // Infinite where nothing is promised, NaN where the radius is nothing in the frame.
            let granted = f64::from(lane.t_error);
            !granted.is_finite() || !worst.t.see(off, granted + known)
        }
    })
}

fn sphere_reach(centre: [f32; 3], radius: f32) -> f32 {
    centre.iter().fold(0f32, |reach, x| reach.max((x.abs() + radius).next_up()))
}

#[test]
fn spheres() {
    const SEED: u64 = 12;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = SphereWorst {
        discriminant: Worst::new("sphere, f32: discriminant"),
        t: Worst::new("sphere, f32: t of the watertight mode"),
    };
    for sample in 0..samples(1_000_000) {
        let before = random.clone();
        let right = sphere_is_right(&mut random, &mut worst);
        assert!(right, "sample {sample} of seed {SEED}: {before:?}");
    }
    worst.discriminant.assert_tight(0.05);
    worst.t.assert_tight(0.02);
}

/// A scene of 2^99 in whose frame 2^-49 is the least float: what is rounded to it may move by half of
/// it, ties to even, and the filter must not take the limit at its word.
#[test]
fn below_the_least_float_of_the_frame_nothing_is_rejected() {
    let unit = 2f32.powi(-49);
    let at = |x: f32, y: f32| [x * 2f32.powi(90), y * 2f32.powi(90), 1.5 * unit];
    let corners = [at(-1.0, -1.0), at(1.0, -1.0), at(0.0, 1.0)];
    let ray = Ray::new([0.0, 0.0, 0.5 * unit], [0.0, 0.0, 1.0]);
    let prepared =
        ray.with_limits(0.0, unit).prepare(Extent::new(2f32.powi(99), 1)).expect("a ray");
    let line = Line { origin: ray.origin, direction: ray.direction };
    assert!(is_within(&line, &Meeting::Triangle(corners), &prepared));
    let sieved = sieve(&prepared, prepared.t_max, corners);
    assert!(!sieved.rejected);

    let prepared =
        ray.with_limits(0.0, 0.75 * unit).prepare(Extent::new(2f32.powi(99), 1)).expect("a ray");
    assert!(sphere(&prepared, prepared.t_max, [0.0, 0.0, 1.5 * unit], 0.4 * unit).is_some());
}

/// What is surely hit needs no `f64`, also where the limits are infinite in the frame.
#[test]
fn infinite_limits_are_surely_kept() {
    let corners = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]];
    for direction in [[0.0, 0.0, -1.5], [1e-3, 1e-3, -1.5], [0.0, 0.0, -1e4]] {
        let ray = Ray::new([0.003, 0.003, 0.01], direction);
        for t_min in [0.0, f32::NEG_INFINITY] {
            let ray =
                ray.with_limits(t_min, f32::INFINITY).prepare(Extent::new(0.01, 1)).expect("a ray");
            let sieved = sieve(&ray, ray.t_max, corners);
            assert!(!sieved.rejected && sieved.sure && sieved.inside, "{direction:?} {t_min}");
        }
    }
}
