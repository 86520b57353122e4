//! How much of its bound the computed distance uses up.

use raykern_harness::make::Random;
use raykern_harness::oracle::point::{longest_edge, to_sphere, to_triangle};

use super::*;

/// The bound on a distance, for each unit of the distance and the size of the primitive.
const BOUND: f64 = 1.0 / (1u64 << 46) as f64;

/// The error of a computed square as a part of the bound.
fn used(foot: &Foot, distance: f64, size: f64) -> f64 {
    (sqrt(foot.square) - distance).abs() / (BOUND * (distance + size))
}

/// A triangle whose third vertex is about `thin` of the first edge from that, and another edge may be
/// as much shorter.
fn thin(random: &mut Random, exponents: [f64; 2]) -> [[f32; 3]; 3] {
    let mut shrink = || 2f64.powf(exponents[0] + (exponents[1] - exponents[0]) * random.unit());
    let (thin, short) = (shrink(), shrink());
    let [a, e, f] = [0; 3].map(|_| random.direction());
    let along = if random.below(2) == 0 { short } else { random.unit() };
    let b = [0, 1, 2].map(|k| a[k] + e[k]);
    let c = [0, 1, 2].map(|k| a[k] + along * e[k] + thin * f[k]);
    let turn = random.below(3);
    let corners = [a, b, c].map(|p| p.map(|x| x as f32));
    [0, 1, 2].map(|i| corners[(i + turn) % 3])
}

/// A point at about `far` from a point of the triangle or of the line through an edge.
fn beside(random: &mut Random, corners: [[f32; 3]; 3], far: f64) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let [v, w] = [random.between(-0.2, 1.2), random.between(-0.2, 1.2)];
    let away = random.direction();
    [0, 1, 2].map(|k| (a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k]) + far * away[k]) as f32)
}

#[test]
fn triangles_keep_their_bound() {
    let mut random = Random::new(1);
    let mut most = 0.0f64;
    for round in 0..60_000 {
        let exponents = [[-2.0, 0.0], [-24.0, 0.0], [-24.0, -20.0]][round % 3];
        let corners = thin(&mut random, exponents);
        let far = if random.below(5) == 0 { 0.0 } else { 2f64.powf(random.between(-40.0, 20.0)) };
        let point = beside(&mut random, corners, far);
        let Some(distance) = to_triangle(point, corners) else { continue };
        let foot = shape::on_triangle(wide(point), corners.map(wide));
        let part = used(&foot, distance, longest_edge(corners));
        assert!(part <= 1.0, "{part}: {point:?} {corners:?} {foot:?} {distance:e}");
        most = most.max(part);
    }
    std::println!("triangles use {most:.3} of the bound");
    assert!(most > 0.005, "{most}: too easy");
}

#[test]
fn spheres_keep_their_bound() {
    let mut random = Random::new(2);
    let mut most = 0.0f64;
    for _ in 0..60_000 {
        let [x, y, z] = random.direction().map(|x| x as f32);
        let radius = 2f64.powf(random.between(-20.0, 10.0));
        let far =
            radius + radius * 2f64.powf(random.between(-30.0, 20.0)) * random.between(-1.0, 1.0);
        let (centre, away) = ([x, y, z], random.direction());
        let point = [0, 1, 2].map(|k| (f64::from(centre[k]) + far * away[k]) as f32);
        let distance = to_sphere(point, [x, y, z, radius as f32]).expect("a radius");
        let foot = shape::on_sphere(wide(point), centre, radius as f32);
        let part = used(&foot, distance, 2.0 * radius);
        assert!(part <= 1.0, "{part}: {point:?} {centre:?} {radius} {foot:?} {distance:e}");
        most = most.max(part);
    }
    std::println!("spheres use {most:.3} of the bound");
    assert!(most > 0.01, "{most}: too easy");
}

#[test]
fn known_feet() {
    let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    for (point, square, weights) in [
        ([1.0, 1.0, -2.0], 4.0, [0.25, 0.25]),
        ([2.0, -3.0, 4.0], 25.0, [0.5, 0.0]),
        ([-3.0, 1.0, 0.0], 9.0, [0.0, 0.25]),
        ([3.0, 3.0, 0.0], 2.0, [0.5, 0.5]),
        ([7.0, 0.0, 4.0], 25.0, [1.0, 0.0]),
        ([0.0, 8.0, 3.0], 25.0, [0.0, 1.0]),
    ] {
        let foot = shape::on_triangle(wide(point), corners.map(wide));
        assert_eq!((foot.square, foot.weights), (square, weights), "{point:?}");
    }
    let centre = shape::on_sphere(wide([1.0; 3]), [1.0; 3], 2.0);
    assert_eq!((centre.square, centre.point), (4.0, DVec3::new(3.0, 1.0, 1.0)));
}

/// The columns of a map that stretches by up to 2^10 times as much along one axis as along another.
fn columns(random: &mut Random) -> [DVec3; 3] {
    let turned = [0; 3].map(|_| DVec3::from(random.direction()));
    turned.map(|column| 2f64.powf(random.between(-5.0, 5.0)) * column)
}

#[test]
fn no_point_of_an_ellipsoid_is_closer() {
    let mut random = Random::new(3);
    for round in 0..3_000 {
        let axes = columns(&mut random);
        let image = |n: DVec3| axes[0] * n.x + axes[1] * n.y + axes[2] * n.z;
        let centre = DVec3::from(random.direction());
        // Anywhere, on the surface, at the centre, and across one of the axes.
        let n = DVec3::from(random.direction());
        let point = match round % 4 {
            0 => centre + 2f64.powf(random.between(-10.0, 10.0)) * DVec3::from(random.direction()),
            1 => centre + image(n),
            2 => centre,
            _ => centre + random.between(-2.0, 2.0) * axes[0].cross(axes[1]),
        };
        let foot = ellipsoid::on_ellipsoid(point, centre, axes);
        let size = axes.iter().map(|axis| axis.length()).fold(0.0, f64::max);
        let distance = sqrt(foot.square);
        let allowed = (distance + size) * 2f64.powi(-40);
        let away = foot.point - centre;
        let inverse = glam::DMat3::from_cols(axes[0], axes[1], axes[2]).inverse();
        let unit = (inverse * away).normalize();
        assert!((image(unit) - away).length() <= size * 1e-9, "{round}: not on it");
        for _ in 0..200 {
            let near = 2f64.powf(random.between(-24.0, 1.0));
            let other = (unit + near * DVec3::from(random.direction())).normalize();
            let there = (centre + image(other) - point).length();
            assert!(there >= distance - allowed, "{round}: {there:e} {distance:e} {axes:?}");
        }
    }
}

#[test]
fn a_round_ellipsoid_is_a_sphere() {
    let mut random = Random::new(4);
    for _ in 0..1_000 {
        let (centre, radius) = (random.direction().map(|x| x as f32), random.between(0.1, 3.0));
        let point = 3.0 * DVec3::from(random.direction());
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| f64::from(radius as f32) * axis);
        let foot = ellipsoid::on_ellipsoid(point, wide(centre), axes);
        let expected = shape::on_sphere(point, centre, radius as f32);
        assert!((sqrt(foot.square) - sqrt(expected.square)).abs() < 1e-12);
        assert!((foot.point - expected.point).length() < 1e-9, "{foot:?} {expected:?}");
    }
}
