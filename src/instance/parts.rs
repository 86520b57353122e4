//! The parts of what instances show: the boxes at the root of its tree.

use glam::DVec3;

use super::map::Map;
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::{Bundles, Finished};

/// Sixteen boxes side by side, around all that is in a block: lower x y z, then upper x y z.
pub(crate) struct Parts {
    walls: [[f64; 16]; 6],
}

impl Parts {
    /// Those of a block in bundles of sixteen, if they are finite.
    pub fn of(block: Finished) -> Option<Self> {
        let Bundles::Sixteen(bundles) = block.parts().bundles else { return None };
        let bounds = &block.header().bounds;
        let finite = bounds.lower.iter().chain(&bounds.upper).all(|x| x.is_finite());
        bundles.first().filter(|_| finite).map(Self::new)
    }

    fn new(root: &Bundle<16>) -> Self {
        // In a block that moves there may be a child of which nothing can be hit now: its box is empty, and infinite
        // along all axes.
        let holds =
            |i: &usize| root.refs[*i] != ChildRef::NONE && root.walls[0][*i] <= root.walls[3][*i];
        let first = (0..16).find(holds).unwrap_or(0);
        // The first once more in lanes without anything.
        let lane = |wall: &[f32; 16], i: usize| f64::from(wall[if holds(&i) { i } else { first }]);
        Parts { walls: root.walls.map(|wall| core::array::from_fn(|i| lane(&wall, i))) }
    }

    /// The box around an instance of these boxes but for [rounding](Map::rounding): no larger than that of the one box around them.
    pub fn bounds(&self, map: &Map) -> [DVec3; 2] {
        let mut bounds = [DVec3::ZERO; 2];
        for (k, row) in map.object_to_world.chunks_exact(4).enumerate() {
            let [lower, upper] = &mut bounds;
            let (mut least, mut most) = ([f64::from(row[3]); 16], [f64::from(row[3]); 16]);
            for (j, x) in row[..3].iter().enumerate() {
                let (first, last) = if *x < 0.0 { (j + 3, j) } else { (j, j + 3) };
                add_multiple(&mut least, f64::from(*x), &self.walls[first]);
                add_multiple(&mut most, f64::from(*x), &self.walls[last]);
            }
            lower[k] = folded(least, |x, y| if y < x { y } else { x });
            upper[k] = folded(most, |x, y| if y > x { y } else { x });
        }
        bounds
    }
}

fn add_multiple(sums: &mut [f64; 16], factor: f64, of: &[f64; 16]) {
    for (sum, x) in sums.iter_mut().zip(of) {
        *sum += factor * x;
    }
}

/// In halves, which compilers make vectors of.
fn folded(mut lanes: [f64; 16], choose: impl Fn(f64, f64) -> f64) -> f64 {
    for half in [8, 4, 2, 1] {
        for i in 0..half {
            lanes[i] = choose(lanes[i], lanes[i + half]);
        }
    }
    lanes[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Aabb, wide};

    #[test]
    fn the_box_around_parts_is_within_that_around_the_whole_and_holds_their_corners() {
        // Along a diagonal: of the box around all a turned one leaves much out.
        let mut root = Bundle::<16>::EMPTY;
        let (mut contents, mut corners) = (Aabb::EMPTY, std::vec![]);
        for i in 0..13 {
            let at = |k: usize, size: f32| (i * (k + 1)) as f32 + size * ((i * i + k) % 7) as f32;
            for k in 0..3 {
                (root.walls[k][i], root.walls[3 + k][i]) = (at(k, -0.3), at(k, 1.1));
            }
            root.refs[i] = ChildRef::bundle(i as u32 + 1);
            for corner in 0..8usize {
                let p = [0, 1, 2].map(|k| root.walls[k + 3 * (corner >> k & 1)][i]);
                corners.push(wide(p));
                contents.add(&Aabb::around(&[p]));
            }
        }
        let parts = Parts::new(&root);
        for linear in [
            [0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0],
            [0.5, -0.5, 0.5, -0.5, 0.5, -0.5, 0.5, -0.5, 0.5],
        ] {
            let mut m = [3.0f32; 12];
            for (i, x) in linear.into_iter().enumerate() {
                m[i / 3 * 4 + i % 3] = x + 0.01 * (i * i) as f32;
            }
            let map = Map::new(m).expect("an inverse");
            let rounding = map.rounding(&contents);
            let ([lower, upper], [least, most]) = (parts.bounds(&map), map.bounds(&contents));
            assert!((lower - rounding).cmpge(least - rounding).all());
            assert!((upper + rounding).cmple(most + rounding).all());
            assert!((upper - lower).element_sum() < (most - least).element_sum());
            for corner in &corners {
                let p = map.point(*corner);
                assert!(p.cmpge(lower - rounding).all() && p.cmple(upper + rounding).all());
            }
        }
    }
}
