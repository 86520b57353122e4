//! Every decision against the harness's oracle, which shares no code with this crate: big integers
//! of any size, and another way to order roots.

use std::vec::Vec;

use raykern_harness::make::Random;
use raykern_harness::oracle::Root as RealRoot;
use raykern_harness::oracle::dyadic::{Dyadic, cross, difference, dot, vector};

use super::*;
use crate::math::rounding::UNIT;

/// Where the line meets it, by the oracle's arithmetic.
fn oracle_root(line: &Line, meeting: &Meeting) -> Option<RealRoot> {
    let (o, d) = (vector(line.origin), vector(line.direction));
    match *meeting {
        Meeting::Triangle(corners) => {
            let [a, b, c] = corners.map(vector);
            let n = cross(&difference(&b, &a), &difference(&c, &a));
            let divisor = dot(&d, &n);
            let dividend = dot(&difference(&a, &o), &n);
            (divisor.sign() != 0).then(|| RealRoot::rational(dividend, divisor))
        }
        Meeting::Sphere { centre, radius, root } => {
            let (v, r) = (difference(&o, &vector(centre)), Dyadic::from_f32(radius));
            let (a, b) = (dot(&d, &d), dot(&v, &d));
            let c = &dot(&v, &v) - &(&r * &r);
            let discriminant = &(&b * &b) - &(&a * &c);
            let sign = if root == 1 { 1 } else { -1 };
            (discriminant.sign() >= 0).then(|| RealRoot::quadratic(-b, sign, discriminant, a))
        }
    }
}

/// What was compared, and how much of it was a tie.
#[derive(Debug, Default)]
struct Seen {
    distances: usize,
    pairs: usize,
    ties: usize,
    sphere_ties: usize,
    limit_ties: usize,
}

/// Judges everything that can be asked of some lines and what they meet.
fn judge(seen: &mut Seen, lines: &[Line], meetings: &[Meeting], limits: &[f32], seed: &str) {
    let mut met = Vec::new();
    for (line, meeting) in lines.iter().flat_map(|l| meetings.iter().map(move |m| (l, m))) {
        let (ours, real) = (Distance::new(line, meeting), oracle_root(line, meeting));
        assert_eq!(ours.is_some(), real.is_some(), "{seed}: {line:?} {meeting:?}");
        if let Some((ours, real)) = ours.zip(real) {
            let limits = limits.iter().copied().chain(neighbours(ours.round()));
            judge_one(seen, &ours, &real, limits, &std::format!("{seed}: {line:?} {meeting:?}"));
            met.push((ours, real, line, meeting));
        }
    }
    judge_compact(lines, meetings, limits, seed);
    for (i, (p, p_real, line, meeting)) in met.iter().enumerate() {
        for (q, q_real, other_line, other) in &met[i..] {
            let order = p_real.cmp(q_real);
            let place = || std::format!("{seed}: {line:?} {meeting:?} {other_line:?} {other:?}");
            assert_eq!(p.compare(q), order, "{}", place());
            assert_eq!(q.compare(p), order.reverse(), "{}", place());
            let one_line = std::ptr::eq(*line, *other_line);
            assert!(!(one_line && meeting.surely_equal(other)) || order.is_eq(), "{}", place());
            let round = |m: &Meeting| matches!(m, Meeting::Sphere { .. });
            seen.pairs += 1;
            let tie = order.is_eq() && !std::ptr::eq(*meeting, *other);
            seen.ties += usize::from(tie);
            seen.sphere_ties += usize::from(tie && (round(meeting) || round(other)));
        }
    }
}

/// A number as processors of 32 bits have it.
enum Compact {
    Quotient(compact::Quotient),
    Root(compact::Root),
}

impl Compact {
    fn new(line: &Line, meeting: &Meeting) -> Option<Self> {
        match *meeting {
            Meeting::Triangle(corners) => {
                compact::Quotient::new(line, corners).map(Compact::Quotient)
            }
            Meeting::Sphere { centre, radius, root } => {
                compact::Root::new(line, centre, radius, root).map(Compact::Root)
            }
        }
    }

    fn approximate(&self) -> (f64, f64) {
        match self {
            Compact::Quotient(t) => t.approximate(),
            Compact::Root(t) => t.approximate(),
        }
    }

    fn compare_with_float(&self, x: Binary) -> Ordering {
        match self {
            Compact::Quotient(t) => t.compare_with_float(x),
            Compact::Root(t) => t.compare_with_float(x),
        }
    }

    fn compare(&self, other: &Compact) -> Ordering {
        match (self, other) {
            (Compact::Quotient(p), Compact::Quotient(q)) => p.compare(q),
            (Compact::Quotient(p), Compact::Root(q)) => q.compare_with(p).reverse(),
            (Compact::Root(p), Compact::Quotient(q)) => p.compare_with(q),
            (Compact::Root(p), Compact::Root(q)) => p.compare(q),
        }
    }
}

/// The same of these numbers.
fn judge_compact(lines: &[Line], meetings: &[Meeting], limits: &[f32], seed: &str) {
    let mut met = Vec::new();
    for (line, meeting) in lines.iter().flat_map(|l| meetings.iter().map(move |m| (l, m))) {
        let place = std::format!("compact, {seed}: {line:?} {meeting:?}");
        let (ours, real) = (Compact::new(line, meeting), oracle_root(line, meeting));
        assert_eq!(ours.is_some(), real.is_some(), "{place}");
        let Some((ours, real)) = ours.zip(real) else { continue };
        for limit in limits {
            let order = real.cmp(&RealRoot::float(*limit));
            let found = ours.compare_with_float(Binary::of(*limit));
            assert_eq!(found, order, "limit {limit:e}, {place}");
        }
        judge_size(ours.approximate(), &real, &place);
        for (_, _, other, other_real) in &met {
            assert_eq!(ours.compare(other), real.cmp(other_real), "{place}");
        }
        for (_, other, _, other_real) in met.iter().filter(|(of, ..)| core::ptr::eq(*of, line)) {
            let order = compact::order(line, meeting, other);
            assert_eq!(order, Some(real.cmp(other_real)), "{place}");
        }
        judge_lent(line, meeting, &real, limits, &place);
        met.push((line, *meeting, ours, real));
    }
}

/// What is asked of a meeting that is lent.
fn judge_lent(line: &Line, meeting: &Meeting, real: &RealRoot, limits: &[f32], place: &str) {
    let ends = [f32::NEG_INFINITY, f32::INFINITY];
    let limits = || limits.iter().chain(&ends).chain(limits).copied();
    for (low, high) in limits().zip(limits().skip(1)) {
        let order = |limit: f32| match limit.is_finite() {
            true => real.cmp(&RealRoot::float(limit)),
            false => 0.0f32.total_cmp(&limit),
        };
        let expected = order(low).is_ge() && order(high).is_le();
        let within = compact::is_within(line, meeting, [low, high]);
        assert_eq!(within, expected, "within {low:e} and {high:e}, {place}");
    }
    if let Meeting::Triangle(corners) = meeting {
        judge_size(compact::to_plane(line, corners).expect("it is met"), real, place);
    }
}

/// A `t` in `f64`, and its bound.
fn judge_size((t, error): (f64, f64), real: &RealRoot, place: &str) {
    let one = Dyadic::from_f32(1.0);
    let float = |x: f64| RealRoot::rational(Dyadic::from_f64(x), one.clone());
    assert!(error <= 5.0 * UNIT * t.abs(), "{t:e} +- {error:e}, {place}");
    // The sums round, by less than one unit in the last place of `t`.
    let (low, high) = (float((t - error).next_down()), float((t + error).next_up()));
    assert!(low <= *real && *real <= high, "{t:e} +- {error:e}, {place}");
}

fn neighbours(x: f32) -> impl Iterator<Item = f32> {
    [x, x.next_down(), x.next_up()].into_iter().filter(|x| x.is_finite())
}

fn judge_one(
    seen: &mut Seen,
    ours: &Distance,
    real: &RealRoot,
    limits: impl Iterator<Item = f32>,
    place: &str,
) {
    seen.distances += 1;
    for limit in limits {
        let order = real.cmp(&RealRoot::float(limit));
        assert_eq!(ours.compare_with(limit), order, "limit {limit:e}, {place}");
        seen.limit_ties += usize::from(order.is_eq());
    }
    let one = Dyadic::from_f32(1.0);
    let float = |x: f64| RealRoot::rational(Dyadic::from_f64(x), one.clone());
    judge_size(ours.approximate(), real, place);
    // Beyond the middle of the largest float and 2^128 lies infinity.
    let end = 2f64.powi(128) - 2f64.powi(103);
    let rounded = match (real.cmp(&float(end)), real.cmp(&float(-end))) {
        (Ordering::Less, Ordering::Greater) => real.rounded(),
        (Ordering::Less, _) => f32::NEG_INFINITY,
        _ => f32::INFINITY,
    };
    assert_eq!(ours.round().to_bits(), rounded.to_bits(), "{rounded:e}, {place}");
}

/// Signs of volumes, and whether there is area.
fn judge_triangle(line: &Line, triangle: Triangle, seed: &str) {
    let (o, d) = (vector(line.origin), vector(line.direction));
    let [a, b, c] = triangle.map(|p| difference(&vector(p), &o));
    let real = [(&c, &a), (&a, &b), (&b, &c)].map(|(p, q)| dot(&d, &cross(p, q)));
    let [short, long] = [compact::volumes(line, &triangle), volumes(line, &triangle)];
    for (ours, real) in long.into_iter().chain(short).zip(real.iter().cycle()) {
        let ours = Dyadic::from_f64(ours);
        assert_eq!(ours.sign(), real.sign(), "{seed}: {line:?} {triangle:?}");
        let error = &(&ours - real).abs() * &Dyadic::from_f64(0.99 / UNIT);
        assert!(error <= real.clone().abs(), "{seed}: {line:?} {triangle:?}");
    }
    let n = cross(&difference(&b, &a), &difference(&c, &a));
    for ours in [has_area(triangle), compact::has_area(triangle)] {
        assert_eq!(ours, n.iter().any(|x| x.sign() != 0), "{seed}: {triangle:?}");
    }
    assert_eq!(compact::normal(triangle), normal(triangle), "{seed}: {triangle:?}");
}

/// Two lines from one point, and what they may meet.
struct Case {
    lines: [Line; 2],
    triangles: Vec<Triangle>,
    balls: Vec<([f32; 3], f32)>,
}

impl Case {
    /// Shapes of such numbers. Some are like others but for one number, which is the next float.
    fn new(
        r: &mut Random,
        number: &impl Fn(&mut Random) -> f32,
        step: &impl Fn(&mut Random) -> f32,
    ) -> Self {
        let point = |r: &mut Random| [0, 1, 2].map(|_| number(r));
        let nudge = |x: &mut f32| *x = if x.next_up().is_finite() { x.next_up() } else { 1.0 };
        let mut triangles: Vec<_> = (0..3).map(|_| [point(r), point(r), point(r)]).collect();
        // The same plane by other corners, and almost the same triangle.
        let [a, b, c] = triangles[0];
        let mut close = [a, b, c];
        nudge(&mut close[r.below(3)][r.below(3)]);
        triangles.extend([[c, a, b], close]);
        // The larger of some radii, since most spheres are missed otherwise.
        let radius = |r: &mut Random| (0..3).map(|_| number(r).abs()).fold(0.0, f32::max);
        let mut balls: Vec<_> = (0..3).map(|_| (point(r), radius(r))).collect();
        let [mut close, mut wide] = [balls[0], balls[1]];
        nudge(&mut close.0[r.below(3)]);
        nudge(&mut wide.1);
        balls.extend([close, wide]);
        // Any direction, and one towards a sphere.
        let (origin, to) = (point(r), balls[0].0);
        let towards = [0, 1, 2].map(|k| to[k] / 2.0 - origin[k] / 2.0);
        let ahead = [0, 1, 2].map(|_| step(r));
        let lines = [ahead, towards].map(|d| {
            let direction = if d == [0.0; 3] { [1.0, 0.0, 0.0] } else { d };
            Line { origin, direction }
        });
        Case { lines, triangles, balls }
    }

    fn meetings(&self) -> Vec<Meeting> {
        let balls = self.balls.iter().flat_map(|(centre, radius)| {
            [0, 1].map(|root| Meeting::Sphere { centre: *centre, radius: *radius, root })
        });
        self.triangles.iter().map(|t| Meeting::Triangle(*t)).chain(balls).collect()
    }
}

/// Judges cases of such numbers.
fn judge_family(name: &str, rounds: u64, number: impl Fn(&mut Random) -> f32) -> Seen {
    judge_mixed(name, rounds, &number, &number)
}

/// Judges cases of which the points and half of the directions are made of different numbers.
fn judge_mixed(
    name: &str,
    rounds: u64,
    number: &impl Fn(&mut Random) -> f32,
    step: &impl Fn(&mut Random) -> f32,
) -> Seen {
    let mut seen = Seen::default();
    for round in 0..rounds {
        let mut random = Random::new(round);
        let case = Case::new(&mut random, number, step);
        let limits = [number(&mut random), 0.0, f32::MAX, f32::from_bits(1)];
        let seed = std::format!("{name}, seed {round}");
        judge(&mut seen, &case.lines, &case.meetings(), &limits, &seed);
        case.triangles.iter().for_each(|t| judge_triangle(&case.lines[0], *t, &seed));
    }
    std::println!("{name}: {seen:?}");
    seen
}

/// A float whose exponent lies anywhere between two.
fn wild(r: &mut Random, [low, high]: [f64; 2]) -> f32 {
    (r.between(-1.0, 1.0) * 2f64.powf(r.between(low, high))) as f32
}

#[test]
fn lattices_of_every_size() {
    // The least unit makes numbers subnormal, the largest reaches 2^127.
    for (name, power) in [("least", -149), ("small", -120), ("whole", 0), ("large", 125)] {
        let unit = 2f64.powi(power) as f32;
        let seen = judge_family(name, 500, |r| (r.below(5) as f32 - 2.0) * unit);
        assert!(seen.ties > 2_000 && seen.sphere_ties > 300 && seen.limit_ties > 2_000, "{seen:?}");
    }
}

#[test]
fn lattices_of_both_ends_at_once() {
    // Ties in large numbers that the least ones break.
    let ends = |r: &mut Random| match r.below(12) {
        0 => f32::from_bits(1),
        1 => -f32::from_bits(3),
        _ => (r.below(5) as f32 - 2.0) * 2f32.powi(125),
    };
    let seen = judge_family("both ends", 1_000, ends);
    assert!(seen.ties > 2_000 && seen.sphere_ties > 200, "{seen:?}");
}

#[test]
fn floats_of_every_exponent() {
    for range in [[-149.0, 127.9], [-149.0, -120.0], [100.0, 127.9], [-3.0, 0.0], [-30.0, 30.0]] {
        let seen = judge_family(&std::format!("2^{range:?}"), 200, |r| wild(r, range));
        assert!(seen.pairs > 20_000, "{seen:?}");
    }
}

/// Units are chosen for points and for directions by themselves.
#[test]
fn long_directions_among_short_points() {
    let ranges = [[-60.0, 0.0], [-30.0, 30.0], [-90.0, 10.0], [-149.0, 127.9]];
    let lattice = |r: &mut Random| r.below(5) as f32 - 2.0;
    for range in ranges {
        let any = |r: &mut Random| wild(r, range);
        let seen = judge_mixed(&std::format!("steps in 2^{range:?}"), 200, &lattice, &any);
        assert!(seen.ties > 300, "{seen:?}");
        let seen = judge_mixed(&std::format!("points in 2^{range:?}"), 200, &any, &lattice);
        assert!(seen.pairs > 20_000, "{seen:?}");
    }
}
