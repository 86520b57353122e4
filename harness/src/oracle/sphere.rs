//! Ray against sphere, in real arithmetic.

use super::dyadic::{Dyadic, Vector, difference, dot, vector};
use super::root::Root;

/// The one or two points where a line meets a sphere: entering, leaving. A line that only touches
/// enters and leaves at once, and has the same point twice.
pub fn meet(origin: &Vector, direction: &Vector, sphere: [f32; 4]) -> Option<[Root; 2]> {
    let [x, y, z, radius] = sphere;
    let radius = Dyadic::from_f32(radius);
    if radius.sign() <= 0 {
        return None;
    }
    // a t^2 + 2 b t + c = 0
    let from_centre = difference(origin, &vector([x, y, z]));
    let a = dot(direction, direction);
    let b = dot(&from_centre, direction);
    let c = &dot(&from_centre, &from_centre) - &(&radius * &radius);
    let discriminant = &(&b * &b) - &(&a * &c);
    if discriminant.sign() < 0 {
        return None;
    }
    let root = |q| Root::quadratic(-b.clone(), q, discriminant.clone(), a.clone());
    Some([root(-1), root(1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shot(origin: [f32; 3], direction: [f32; 3], sphere: [f32; 4]) -> Option<[f32; 2]> {
        let roots = meet(&vector(origin), &vector(direction), sphere)?;
        Some(roots.map(|root| root.rounded()))
    }

    #[test]
    fn known_meetings() {
        let unit = [0.0, 0.0, 0.0, 1.0];
        assert_eq!(shot([0.0, 0.0, 5.0], [0.0, 0.0, -2.0], unit), Some([2.0, 3.0]));
        assert_eq!(shot([0.0; 3], [0.0, 3.0, 4.0], [0.0, 0.0, 0.0, 10.0]), Some([-2.0, 2.0]));
        assert_eq!(shot([1.0, 0.0, -3.0], [0.0, 0.0, 1.0], unit), Some([3.0, 3.0]));
        assert_eq!(shot([1.0f32.next_up(), 0.0, -3.0], [0.0, 0.0, 1.0], unit), None);
    }

    #[test]
    fn spheres_without_radius_are_not_there() {
        for radius in [0.0, -0.0, -1.0] {
            let sphere = [0.0, 0.0, 0.0, radius];
            assert_eq!(shot([0.0, 0.0, 5.0], [0.0, 0.0, -1.0], sphere), None);
        }
        let speck = [0.0, 0.0, 0.0, 1e-45];
        assert_eq!(shot([0.0, 0.0, 5.0], [0.0, 0.0, -1.0], speck), Some([5.0, 5.0]));
    }
}
