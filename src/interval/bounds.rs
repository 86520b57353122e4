//! The bounds of the `f64` filters: a search for what breaks them, and how much of them is used. The
//! judge is the harness's exact arithmetic, which shares no code with the core.

use std::println;

use raykern_harness::make::Random;
use raykern_harness::oracle::dyadic::{Dyadic, Vector, cross, difference, dot, vector};
use raykern_harness::search::{Worst, samples};

use super::sphere::discriminant;
use super::triangle::{volume_error, volumes};
use super::{sphere, triangle};
use crate::exact::Line;
use crate::math::wide;

const RANGES: [[i32; 2]; 6] = [[-149, 127], [-149, -120], [100, 127], [-20, 20], [-2, 2], [-2, 2]];

fn points<const N: usize>(random: &mut Random) -> [[f32; 3]; N] {
    let range = RANGES[random.below(RANGES.len())];
    let middle = [0, 1, 2].map(|_| random.wild(range));
    let spread = 2f32.powi(-(random.below(24) as i32));
    let local = random.below(2) == 0;
    core::array::from_fn(|_| {
        [0, 1, 2].map(|k| {
            let x = random.wild(range);
            let x = if local { middle[k] + middle[k] * spread * random.unit() as f32 } else { x };
            x.clamp(-f32::MAX, f32::MAX)
        })
    })
}

/// A line from the first point to somewhere between the others, or beside them.
fn line(random: &mut Random, origin: [f32; 3], corners: [[f32; 3]; 3]) -> Line {
    let weights = [0, 1, 2].map(|_| [0.0, random.unit(), random.between(-0.1, 1.1)]);
    let weights = weights.map(|w| w[random.below(3)]);
    let sum: f64 = weights.iter().sum();
    let direction = [0, 1, 2].map(|k| {
        let at: f64 = (0..3).map(|i| f64::from(corners[i][k]) * weights[i]).sum();
        let at = if sum == 0.0 { f64::from(corners[0][k]) } else { at / sum };
        ((at - f64::from(origin[k])) as f32).clamp(-f32::MAX, f32::MAX)
    });
    Line { origin, direction }
}

fn ratio(x: &Dyadic) -> f64 {
    x.ratio(&Dyadic::from_f32(1.0))
}

#[test]
fn triangles() {
    const SEED: u64 = 31;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut volume = Worst::new("triangle, f64: volume");
    let mut t = Worst::new("triangle, f64: t");
    let mut weight = Worst::new("triangle, f64: weights");
    for _ in 0..samples(60_000) {
        let [origin, a, b, c] = points(&mut random);
        let corners = [a, b, c];
        let line = line(&mut random, origin, corners);
        if line.direction == [0.0; 3] {
            continue;
        }
        let bound = Dyadic::from_f64(volume_error(&line, corners));
        let d = vector(line.direction);
        let [ra, rb, rc] = corners.map(|p| difference(&vector(p), &vector(origin)));
        let twice = |p: &Vector, q: &Vector| {
            let volume = dot(&d, &cross(p, q));
            &volume + &volume
        };
        let real = [twice(&rc, &ra), twice(&ra, &rb), twice(&rb, &rc)];
        for (computed, real) in volumes(&line, corners).into_iter().zip(&real) {
            let off = &Dyadic::from_f64(computed) - real;
            volume.see(if off.sign() == 0 { 0.0 } else { off.ratio(&bound) }, 1.0);
        }
        let n = cross(&difference(&rb, &ra), &difference(&rc, &ra));
        let (dividend, divisor) = (dot(&ra, &n), dot(&d, &n));
        if divisor.sign() == 0 {
            assert!(triangle::plane(&line, &corners).is_none());
            continue;
        }
        let plane = triangle::plane(&line, &corners).expect("not parallel");
        // Of lines that pass between the edges the side is told, whatever the divisor's error.
        let met = triangle::meet(&line, &corners);
        assert!(met.is_none_or(|(met, _)| met.front == (divisor.sign() < 0)));
        let off = &(&Dyadic::from_f64(plane.t) * &divisor) - &dividend;
        t.see(off.ratio(&divisor), plane.t_error);
        for (computed, real) in plane.weights.into_iter().zip(&real).filter(|_| met.is_some()) {
            let twice = &divisor + &divisor;
            let off = &(&Dyadic::from_f64(computed) * &twice) - real;
            weight.see(off.ratio(&twice), f64::from(f32::EPSILON) / 4.0);
        }
    }
    volume.assert_tight(0.05);
    t.assert_tight(0.05);
    weight.assert_tight(0.002);
}

#[test]
fn spheres() {
    const SEED: u64 = 32;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut square = Worst::new("sphere, f64: discriminant");
    let mut t = Worst::new("sphere, f64: t");
    for _ in 0..samples(60_000) {
        let [origin, centre, b, c] = points(&mut random);
        let line = line(&mut random, origin, [centre, b, c]);
        let radius = (wide(b) - wide(centre)).length() as f32;
        let radius = [radius, radius.next_up(), random.wild([-4, 4]).abs()][random.below(3)];
        if line.direction == [0.0; 3] || !(radius > 0.0 && radius.is_finite()) {
            continue;
        }
        let (v, d, r) =
            (wide(origin) - wide(centre), wide(line.direction), Dyadic::from_f32(radius));
        let (computed, unsure) = discriminant(v, d, f64::from(radius));
        let real_d = vector(line.direction);
        let real_v = difference(&vector(origin), &vector(centre));
        let (a, b) = (dot(&real_d, &real_d), dot(&real_v, &real_d));
        let c = &dot(&real_v, &real_v) - &(&r * &r);
        // r^2 - |l|^2 = (b^2 - a c) / a.
        let real = &(&b * &b) - &(&a * &c);
        let off = &(&Dyadic::from_f64(computed) * &a) - &real;
        square.see(off.ratio(&a), unsure);
        let met = sphere::meet(&line, centre, radius);
        assert_eq!(met.is_some(), real.sign() >= 0);
        // Newton's step from a computed root leads to the real one, unless both are close together.
        let Some(met) = met.filter(|met| !met.exact) else { continue };
        for (x, error) in met.t.into_iter().zip(met.t_error) {
            let at = Dyadic::from_f64(x);
            let slope = &(&a * &at) + &b;
            let value = &(&(&slope + &b) * &at) + &c;
            t.see(ratio(&value) / ratio(&slope) / 2.0, error);
        }
    }
    square.assert_tight(0.05);
    t.assert_tight(0.05);
}
