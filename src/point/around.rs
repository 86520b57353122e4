//! What surrounds a point: how far boxes are, and up to where they are of interest.

use glam::DVec3;

use crate::block::leaf::TriangleBlock;
use crate::math::rounding::{UNIT32, f32_above, f32_below};
use crate::math::{Aabb, wide};
use crate::simd::{Kernel, Lanes, Simd, Width};

/// What distances may be off for each unit of the largest coordinates.
///
/// A computed distance is within 2^-46 of the distance and the longest edge, of which the sum is less than eight of these units;
/// boxes and cells take a few roundings.
const SLACK: f64 = 1.0 / (1u64 << 42) as f64;

/// The same in `f32`: the rounding of the point, of differences, squares and sums comes to less than seven units of roundoff.
const NARROW_SLACK: f64 = 16.0 * UNIT32 as f64;
/// What squares lose or gain where they are below all normal floats.
const LEAST: f64 = 1.0 / (1u128 << 126) as f64 / (1u64 << 14) as f64;
/// Between these, the largest coordinates of a scene have squares that `f32` can tell apart.
const ORDINARY: core::ops::Range<f64> = 1.0 / (1u64 << 50) as f64..(1u64 << 60) as f64;

/// A point, and the distance up to which boxes are of interest to it.
pub(crate) struct Around {
    pub point: DVec3,
    /// What computed distances to primitives and boxes may be off, together.
    slack: f64,
    /// The square of the distance beyond which no box is of interest.
    bound: f64,
    /// The point, the slack and the bound for boxes side by side. The slack is infinite where these are not told apart in `f32`.
    narrow_point: [f32; 3],
    narrow_slack: f64,
    narrow_bound: f32,
}

impl Around {
    /// Nothing is of interest yet. `size` is the largest coordinate of the point and all boxes.
    pub fn new(point: DVec3, size: f64) -> Self {
        let is_ordinary = ORDINARY.contains(&size);
        Around {
            point,
            slack: size * SLACK,
            bound: 0.0,
            narrow_point: point.to_array().map(|x| x as f32),
            narrow_slack: if is_ordinary { size * NARROW_SLACK } else { f64::INFINITY },
            narrow_bound: 0.0,
        }
    }

    /// From now on what is not farther than this is of interest.
    pub fn limit_to(&mut self, distance: f64) {
        let widened = distance + self.slack;
        self.bound = widened * widened;
        let square = match self.is_narrow() {
            true => (widened + self.narrow_slack) * (widened + self.narrow_slack) + LEAST,
            false => self.bound,
        };
        self.narrow_bound = f32_above(square).min(f32::MAX);
    }

    #[inline(always)]
    fn is_narrow(&self) -> bool {
        self.narrow_slack < f64::INFINITY
    }

    /// Whether something in a box at this distance, squared, may be of interest. True for a NaN.
    #[inline(always)]
    pub fn is_within(&self, square: f64) -> bool {
        !(square > self.bound)
    }

    /// The square of the distance to a box; infinite to an empty one.
    #[inline(always)]
    pub fn square_to(&self, aabb: &Aabb) -> f64 {
        let (below, above) = (wide(aabb.lower) - self.point, self.point - wide(aabb.upper));
        let gap = |a: f64, b: f64| {
            let gap = if a > b { a } else { b };
            if gap > 0.0 { gap * gap } else { 0.0 }
        };
        gap(below.x, above.x) + gap(below.y, above.y) + gap(below.z, above.z)
    }

    /// No box whose square is above this is of interest: of those that [`boxes`](Self::boxes) gives.
    #[inline(always)]
    pub fn narrow_bound(&self) -> f32 {
        self.narrow_bound
    }

    /// The lanes whose boxes may be of interest, and about the squares of their distances. `walls` are lower x y z, then upper
    /// x y z.
    ///
    /// If a box is within the bound in real arithmetic, it is among them. Empty ones are not.
    #[inline(always)]
    pub fn boxes<S: Width<N>, const N: usize>(&self, s: S, walls: &[[f32; N]; 6]) -> (u32, S::V) {
        if !self.is_narrow() {
            let (mask, squares) = self.boxes_of_any_size(walls);
            return (mask, s.load(&squares));
        }
        let zero = s.splat(0.0);
        let gap = |k: usize| {
            let at = s.splat(self.narrow_point[k]);
            let (below, above) = (s.load(&walls[k]).sub(at), at.sub(s.load(&walls[k + 3])));
            below.max(above).max(zero)
        };
        let [x, y, z] = [gap(0), gap(1), gap(2)];
        let square = z.fast_mul_add(z, y.fast_mul_add(y, x.mul(x)));
        (square.less_or_equal(s.splat(self.narrow_bound)), square)
    }

    /// The same box by box, in `f64`.
    #[cold]
    #[inline(never)]
    fn boxes_of_any_size<const N: usize>(&self, walls: &[[f32; N]; 6]) -> (u32, [f32; N]) {
        let (mut mask, mut squares) = (0, [0.0; N]);
        for (lane, narrow) in squares.iter_mut().enumerate() {
            let wall = |k: usize| walls[k][lane];
            let (lower, upper) = ([wall(0), wall(1), wall(2)], [wall(3), wall(4), wall(5)]);
            let square = self.square_to(&Aabb { lower, upper });
            // Through an extreme map the square of a box that is not empty may be infinite, as the bound is then.
            let is_empty = lower[0] > upper[0];
            mask |= u32::from(!is_empty && self.is_within(square)) << lane;
            *narrow = f32_below(square).min(f32::MAX);
        }
        (mask, squares)
    }
}

/// The triangles of a block whose boxes may be of interest, waiting for a backend.
pub(super) struct Sift<'a>(pub &'a Around, pub &'a TriangleBlock);

impl Kernel for Sift<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> u32 {
        let Sift(around, block) = self;
        let mut walls = [[0.0; 16]; 6];
        let [a, b, c] = &block.corners;
        for (k, column) in block.vertices.iter().enumerate() {
            let column = s.load(column);
            let [x, y, z] = Width::<16>::of_corners(s, column, [a, b, c]);
            x.min(y).min(z).store(&mut walls[k]);
            x.max(y).max(z).store(&mut walls[k + 3]);
        }
        around.boxes::<S, 16>(s, &walls).0
    }
}

#[cfg(test)]
mod tests {
    use raykern_harness::make::Random;

    use super::*;
    use crate::simd::{self, Scalar};

    /// Points as boxes, in all lanes.
    struct Reached<'a>(&'a Around, [[f32; 3]; 16]);

    impl Kernel for Reached<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> u32 {
            let walls = core::array::from_fn(|k| self.1.map(|p| p[k % 3]));
            self.0.boxes::<S, 16>(s, &walls).0
        }
    }

    /// Of every size, those of which `f32` has no squares included: what is no farther than the bound is found, and little else.
    #[test]
    fn what_is_within_the_bound_is_found() {
        let (mut random, mut beyond) = (Random::new(1), 0);
        for round in 0..20_000 {
            let size = 2f64.powi([0, -49, 58, -120, 120, -149][round % 6]);
            let mut place = || random.direction().map(|x| (x * size) as f32);
            let (point, boxes) = (wide(place()), [0; 16].map(|_| place()));
            let (far, mut around) =
                (|p: &[f32; 3]| wide(*p).distance(point), Around::new(point, size));
            let distance = far(&boxes[round % 16]);
            around.limit_to(distance);
            for mask in
                [simd::dispatch(Reached(&around, boxes)), Scalar.run(Reached(&around, boxes))]
            {
                for (lane, p) in boxes.iter().enumerate() {
                    let is_found = mask >> lane & 1 == 1;
                    assert!(is_found || far(p) > distance, "{round}: {lane} {point} {p:?}");
                    assert!(
                        !is_found || far(p) <= distance + 1e-5 * size,
                        "{round}: {lane} is far"
                    );
                    beyond += u32::from(far(p) > distance);
                }
            }
        }
        assert!(beyond > 100_000, "{beyond}");
    }

    #[test]
    fn nothing_is_in_empty_boxes() {
        for size in [1.0, f64::from(f32::MAX)] {
            let mut around = Around::new(DVec3::ONE, size);
            around.limit_to(f64::INFINITY);
            let Aabb { lower: [a, b, c], upper: [x, y, z] } = Aabb::EMPTY;
            let walls = [a, b, c, x, y, z].map(|wall| [wall; 16]);
            assert_eq!(around.boxes::<Scalar, 16>(Scalar, &walls).0, 0);
        }
    }
}
