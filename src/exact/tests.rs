//! Small cases with known answers.

use super::*;

pub(super) fn line(origin: [f32; 3], direction: [f32; 3]) -> Line {
    Line { origin, direction }
}

/// The `t` of the plane `z`, or one with a slope along x, along a direction of length 3.
fn third(z: f32, slope: f32) -> Distance {
    let triangle = [[0.0, 0.0, z], [1.0, 0.0, z + slope], [0.0, 1.0, z]];
    let meeting = Meeting::Triangle(triangle);
    Distance::new(&line([0.0; 3], [0.0, 0.0, 3.0]), &meeting).expect("not parallel")
}

fn ball(z: f32, radius: f32, root: usize) -> Meeting {
    Meeting::Sphere { centre: [0.0, 0.0, z], radius, root }
}

#[test]
fn thirds_are_ordered_and_rounded() {
    let t = third(1.0, 0.0);
    assert_eq!(t.compare(&third(1.0, 0.5)), Ordering::Equal);
    assert_eq!(t.compare(&third(1.0f32.next_up(), 0.5)), Ordering::Less);
    assert_eq!(t.compare_with(1.0 / 3.0), Ordering::Less);
    assert_eq!(t.compare_with((1.0f32 / 3.0).next_down()), Ordering::Greater);
    assert_eq!(t.round(), 1.0 / 3.0);
    assert_eq!(t.compare_with(f32::INFINITY), Ordering::Less);
    assert_eq!(t.compare_with(f32::NEG_INFINITY), Ordering::Greater);
    assert_eq!(third(-0.0, 0.0).round().to_bits(), 0);
}

#[test]
fn middles_go_to_even() {
    // `t = 1 + z`, in the middle of two floats, and just beside it.
    let from = line([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]);
    let at = |z: f32| {
        let triangle = [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        Distance::new(&from, &Meeting::Triangle(triangle)).expect("not parallel")
    };
    let middle = f32::EPSILON / 2.0;
    assert_eq!(at(middle).round(), 1.0);
    assert_eq!(at(middle.next_up()).round(), 1.0f32.next_up());
    assert_eq!(at(3.0 * middle).round(), 1.0f32.next_up().next_up());
    assert_eq!(at((3.0 * middle).next_down()).round(), 1.0f32.next_up());
}

#[test]
fn rounding_knows_both_ends_of_the_floats() {
    // Half of the least float, and the middle of the largest float and 2^128.
    let along = |z: f32, step: f32| {
        let triangle = [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        Distance::new(&line([0.0; 3], [0.0, 0.0, step]), &Meeting::Triangle(triangle))
    };
    let round = |z, step| along(z, step).expect("not parallel").round();
    assert_eq!(round(1e-45, 2.0).to_bits(), 0);
    assert_eq!(round(-1e-45, 2.0).to_bits(), 0);
    assert_eq!(round(3.0 * 1e-45, 2.0), 2.0 * 1e-45);
    assert_eq!(round(1e-45, 1.5), 1e-45);
    let odd = (1 << 24) as f32 - 1.0;
    assert_eq!(round(f32::MAX, 1.0), f32::MAX);
    assert_eq!(round(f32::MAX, odd / (odd + 1.0)), f32::INFINITY);
    assert_eq!(round(-f32::MAX, 1e-45), f32::NEG_INFINITY);
}

#[test]
fn spheres_of_either_end_of_the_floats_are_ordered() {
    // Two spheres that the line leaves at one point, and one whose radius is the next float.
    let tiny = f32::from_bits(1);
    for unit in [tiny, 1.0, 2f32.powi(120)] {
        let up = line([0.0; 3], [0.0, 0.0, 3.0 * unit]);
        let at = |z: f32, r: f32, root| {
            let sphere = ball(z * unit, r * unit, root);
            Distance::new(&up, &sphere).expect("the line passes the centre")
        };
        assert_eq!(at(2.0, 3.0, 1).compare(&at(4.0, 1.0, 1)), Ordering::Equal);
        assert_eq!(at(2.0, 3.0, 1).compare(&at(9.0, 4.0, 0)), Ordering::Equal);
        assert_eq!(at(2.0, 3.0, 0).compare(&at(-4.0, 3.0, 1)), Ordering::Equal);
        assert_eq!(at(2.0, 4.0, 1).compare(&at(9.0, 4.0, 0)), Ordering::Greater);
        assert_eq!(at(2.0, 3.0, 1).round(), 5.0 / 3.0);
        let plane = [[0.0, 0.0, 5.0 * unit], [unit, 0.0, 5.0 * unit], [0.0, unit, 5.0 * unit]];
        let plane = Distance::new(&up, &Meeting::Triangle(plane)).expect("not parallel");
        assert_eq!(plane.compare(&at(2.0, 3.0, 1)), Ordering::Equal);
        assert_eq!(plane.compare(&at(2.0, 4.0, 1)), Ordering::Less);
    }
}

#[test]
fn distances_on_two_lines_are_ordered() {
    let meet = |step: f32, sphere| {
        Distance::new(&line([0.0; 3], [0.0, 0.0, step]), &sphere).expect("the line passes it")
    };
    // 5 / 3 and 10 / 6; and a sphere that is met off its centre.
    assert_eq!(
        meet(3.0, ball(2.0, 3.0, 1)).compare(&meet(6.0, ball(7.0, 3.0, 1))),
        Ordering::Equal
    );
    assert_eq!(meet(3.0, ball(2.0, 3.0, 1)).compare(&meet(5.0, ball(7.0, 3.0, 1))), Ordering::Less);
    let aside = |x: f32| Meeting::Sphere { centre: [x, 0.0, 2.0], radius: 5.0, root: 1 };
    // 2 + sqrt(25 - 9) = 6 along a step of 3, 6 * 2 along one of 6 with all lengths doubled.
    let double = Meeting::Sphere { centre: [6.0, 0.0, 4.0], radius: 10.0, root: 1 };
    assert_eq!(meet(3.0, aside(3.0)).compare(&meet(6.0, double)), Ordering::Equal);
    assert_eq!(meet(3.0, aside(2.0)).compare(&meet(6.0, double)), Ordering::Greater);
}

#[test]
fn equal_surfaces_are_seen_without_arithmetic() {
    let [a, b, c] = [[0.0, 0.0, 1.0], [1.0, -0.0, 2.0], [0.0, 1.0, 1.0f32]];
    let triangle = |p, q, r| Meeting::Triangle([p, q, r]);
    let same = |p: Meeting, q: Meeting| p.surely_equal(&q) && q.surely_equal(&p);
    assert!(same(triangle(a, b, c), triangle(c, [1.0, 0.0, 2.0], a)));
    assert!(!same(triangle(a, b, c), triangle(a, b, [0.0, 1.0, 1.5])));
    let flat = |y: f32| triangle([0.0, y, 0.0], [1.0, y, 0.0], [0.0, y, 1.0]);
    assert!(same(flat(0.0), triangle([5.0, -0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 0.0, 1.0])));
    assert!(!same(flat(0.0), flat(1.0)));
    assert!(same(ball(1.0, 2.0, 1), ball(1.0, 2.0, 1)));
    for other in [ball(1.0, 2.0, 0), ball(1.5, 2.0, 1), ball(1.0, 1.0, 1), flat(0.0)] {
        assert!(!same(ball(1.0, 2.0, 1), other));
    }
    assert!(!same(flat(f32::NAN), flat(f32::NAN)));
}

/// Whatever the bits, an answer comes.
#[test]
fn foreign_bits_are_answered() {
    let mut random = raykern_harness::make::Random::new(3);
    const ODD: [f32; 6] =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::from_bits(1), 0.0];
    let number = |r: &mut raykern_harness::make::Random| match r.below(3) {
        0 => f32::from_bits(r.bits() as u32),
        1 => f32::from_bits(r.bits() as u32 | 0x7f80_0000),
        _ => ODD[r.below(6)],
    };
    let mut last = third(1.0, 0.0);
    for _ in 0..20_000 {
        let mut point = || [0, 1, 2].map(|_| number(&mut random));
        let line = line(point(), point());
        let corners = [point(), point(), point()];
        volumes(&line, &corners);
        has_area(corners);
        let [centre, [radius, limit, _], _] = corners;
        for meeting in [0, 1, 2].map(|root| match root {
            2 => Meeting::Triangle(corners),
            _ => Meeting::Sphere { centre, radius, root },
        }) {
            if let Some(t) = Distance::new(&line, &meeting) {
                t.round();
                t.compare_with(limit);
                assert_eq!(t.compare(&last).reverse(), last.compare(&t));
                assert_eq!(t.compare(&t), Ordering::Equal);
                last = t;
            }
        }
    }
}
