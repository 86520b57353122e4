//! How long decisions take: `cargo test --release --lib how_long -- --ignored --nocapture`.

use std::hint::black_box;
use std::println;
use std::time::Instant;
use std::vec::Vec;

use raykern_harness::make::Random;

use super::tests::line;
use super::*;

const COUNT: usize = 200;

/// The mean time of a call over all cases in the best of some rounds, in nanoseconds.
fn time<T>(what: &str, cases: &[T], mut f: impl FnMut(&T)) {
    let best = (0..20).map(|_| {
        let start = Instant::now();
        cases.iter().for_each(&mut f);
        start.elapsed()
    });
    let best = best.min().unwrap_or_default();
    let each = best.as_nanos() as f64 / cases.len() as f64;
    println!("    {what:34} {each:9.0} ns");
}

fn measure(name: &str, number: impl Fn(&mut Random) -> f32) {
    println!("{name}");
    let mut random = Random::new(9);
    let mut point = || [0, 1, 2].map(|_| number(&mut random));
    let (mut triangles, mut mixed, mut spheres) = (Vec::new(), Vec::new(), Vec::new());
    let mut tries = 0;
    while triangles.len().min(mixed.len()).min(spheres.len()) < COUNT && tries < 1_000_000 {
        tries += 1;
        let (o, d) = (point(), point());
        if d == [0.0; 3] {
            continue;
        }
        let ray = line(o, d);
        let corners = [point(), point(), point()];
        let [a, b, c] = corners;
        let (p, q) = (Meeting::Triangle(corners), Meeting::Triangle([b, c, a]));
        let ball = Meeting::Sphere { centre: point(), radius: point()[0].abs(), root: 1 };
        let Meeting::Sphere { radius, .. } = ball else { continue };
        let other = Meeting::Sphere { centre: point(), radius, root: 0 };
        let Some(tp) = Distance::new(&ray, &p) else { continue };
        let tq = Distance::new(&ray, &q).expect("the same plane");
        if triangles.len() < COUNT {
            triangles.push((ray, p, q, tp, tq));
        }
        let Some(tb) = Distance::new(&ray, &ball) else { continue };
        if mixed.len() < COUNT {
            mixed.push((tp, tb));
        }
        let Some(to) = Distance::new(&ray, &other) else { continue };
        if spheres.len() < COUNT {
            spheres.push((ray, ball, tb, to));
        }
    }
    time("triangle: new", &triangles, |c| {
        black_box(Distance::new(&c.0, &c.1));
    });
    time("triangle: volumes", &triangles, |c| {
        let Meeting::Triangle(corners) = c.1 else { return };
        black_box(volumes(&c.0, &corners));
    });
    time("triangle / triangle: two new, compare", &triangles, |c| {
        let (p, q) = (Distance::new(&c.0, &c.1), Distance::new(&c.0, &c.2));
        black_box(p.zip(q).map(|(p, q)| p.compare(&q)));
    });
    time("triangle / triangle: compare", &triangles, |c| {
        black_box(c.3.compare(&c.4));
    });
    time("triangle: round", &triangles, |c| {
        black_box(c.3.round());
    });
    time("triangle: limit", &triangles, |c| {
        black_box(c.3.compare_with(0.75));
    });
    time("sphere: new", &spheres, |c| {
        black_box(Distance::new(&c.0, &c.1));
    });
    time("sphere / triangle: compare", &mixed, |c| {
        black_box(c.0.compare(&c.1));
    });
    time("sphere / sphere: compare", &spheres, |c| {
        black_box(c.2.compare(&c.3));
    });
    time("sphere / itself: compare", &spheres, |c| {
        black_box(c.2.compare(&c.2));
    });
    time("sphere: round", &spheres, |c| {
        black_box(c.2.round());
    });
    time("sphere: limit", &spheres, |c| {
        black_box(c.2.compare_with(0.75));
    });
}

#[test]
#[ignore = "a measurement"]
fn how_long_decisions_take() {
    measure("lattice", |r| r.below(9) as f32 - 4.0);
    measure("ordinary floats", |r| r.between(-1.0, 1.0) as f32);
    measure("every exponent", |r| {
        (r.between(-1.0, 1.0) * 2f64.powf(r.between(-149.0, 127.9))) as f32
    });
}
