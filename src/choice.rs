//! Which structure suits a scene, by what each is likely to cost: building it, and tracing the rays until it is built again.

use crate::block::Census;
use crate::math::float::{cube_root, sqrt};
use crate::math::wide;
use crate::scene::Scene;
use glam::DVec3;

/// What may suit a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Suited {
    Uniform,
    Nested,
    Bvh,
}

/// Below this many rays for each primitive a fast build of a BVH saves more time than its rays lose.
const FEW: f32 = 6.0;

/// Whether what is built had better be built fast.
pub(crate) fn are_few(rays_per_prim: f32) -> bool {
    0.0 < rays_per_prim && rays_per_prim < FEW
}

/// What takes the least time with [few](are_few) rays for each primitive, if a BVH is built fast, or with great care.
pub(crate) fn suited(
    scene: &Scene,
    census: &Census,
    rays_per_prim: f32,
    with_care: bool,
) -> Suited {
    let spread = Spread::of(scene, census);
    let time = |Cost { build, ray }| build + f64::from(rays_per_prim) * ray;
    let (uniform, nested) = (time(spread.uniform()), time(NESTED));
    let bvh = time(spread.bvh(with_care));
    match () {
        () if uniform < nested.min(bvh) => Suited::Uniform,
        () if nested < bvh => Suited::Nested,
        () => Suited::Bvh,
    }
}

/// Nanoseconds for each primitive to build, and for a ray: those that docs/methods/grid.md has of some thirty scenes, in round numbers.
/// Nothing but their ratios matters.
#[derive(Clone, Copy)]
struct Cost {
    build: f64,
    ray: f64,
}

/// Much the same everywhere.
const NESTED: Cost = Cost { build: 250.0, ray: 300.0 };

/// How primitives lie in the box around them, in a grid with as many cells along each axis as the cube root of their number.
struct Spread {
    /// That cube root.
    across: f64,
    /// How many are in the cell in which one of them is, on average.
    mean: f64,
    /// The cells in which the box of one lies, in the harmonic mean.
    cells: f64,
    /// The share of them that is near the next one.
    in_order: f64,
    /// How unlike the areas of their boxes are, by a sample, without one that has most of it: 1 if they are all alike, about `n / k` if `k` of `n` have most of the area.
    unevenness: f64,
}

impl Spread {
    fn of(scene: &Scene, census: &Census) -> Spread {
        let grid = Grid::over(census);
        let mut sample = Sample::of(census.hittable());
        sample.take(scene, &grid);
        let (all, taken) = (f64::from(census.hittable()), sample.count as f64);
        let share = all / taken;
        // A few that are much larger than all others stand apart in a BVH: if one of them is in the sample, it stands for no others.
        let apart = if 2.0 * sample.largest > sample.areas { sample.largest } else { 0.0 };
        let areas = share * (sample.areas - apart);
        let squares = share * (sample.squares - apart * apart);
        Spread {
            across: cube_root(all),
            mean: 1.0 + sample.pairs() * all / (taken * (taken - 1.0)),
            cells: taken / sample.per_cell,
            in_order: f64::from(sample.near) / taken,
            unevenness: squares * all / (areas * areas),
        }
    }

    /// A ray goes through cells as many as there are across, and in each tests what lies there: as little as there is room for, or as much
    /// as where most are. How often it comes there nobody knows who has not seen the rays; it is taken to be half way.
    fn uniform(&self) -> Cost {
        let tests = self.across * sqrt(self.mean) * self.cells;
        Cost { build: 70.0 + 15.0 * self.cells, ray: 130.0 + 0.8 * tests }
    }

    /// Leaves are runs of primitives if these are even, and soon found if they are in order.
    fn bvh(&self, with_care: bool) -> Cost {
        let build = match self.unevenness {
            _ if with_care => 450.0,
            unevenness if unevenness > VERY_UNEVEN && self.in_order < IN_ORDER => 350.0,
            unevenness if unevenness > UNEVEN => 250.0,
            _ => 180.0 - 35.0 * self.in_order,
        };
        Cost { build, ray: 130.0 }
    }
}

/// What is near the next one is within this part of the box along each axis; if so many are, they are in order.
const NEAR: f64 = 1.0 / 32.0;
const IN_ORDER: f64 = 0.975;

/// Above this [unevenness](Spread::unevenness) a BVH is built with more effort, above the other with much more unless primitives are in
/// order.
const UNEVEN: f64 = 64.0;
const VERY_UNEVEN: f64 = 700.0;

/// Where cells lie.
struct Grid {
    lower: DVec3,
    per_length: DVec3,
    /// How many there are along each axis.
    count: u32,
    /// How far apart what is near may be.
    near: DVec3,
    /// The reciprocal of the longest edge of the box.
    per_longest: f64,
}

impl Grid {
    fn over(census: &Census) -> Grid {
        let lower = wide(census.bounds.lower);
        let extent = wide(census.bounds.upper) - lower;
        let count = cube_root(f64::from(census.hittable()));
        Grid {
            lower,
            per_length: count / extent,
            count: 1 + count as u32,
            near: extent * NEAR,
            per_longest: 1.0 / extent.max_element(),
        }
    }

    /// The cell of the centre of a box.
    fn cell(&self, from: DVec3, to: DVec3) -> u32 {
        let centre = ((from + to) / 2.0 - self.lower) * self.per_length;
        // The casts saturate, and NaN, as in a flat axis, goes to 0.
        let [i, j, k] = centre.to_array().map(|x| (x as u32).min(self.count - 1));
        i + self.count * (j + self.count * k)
    }
}

/// At most so many primitives are looked at, of fewer every eighth, but 256 at least: so that it takes no time to speak of.
const SAMPLES: usize = 2048;
const SHARE: u32 = 8;
const LEAST: u32 = 256;

/// What is known of some primitives.
struct Sample {
    /// The largest distance from one to the next, which is one to twice as much less one: of equal distances none would find two in a cell, where
    /// primitives are in order.
    most: u32,
    random: u64,
    /// The cells of their centres.
    cells: [u32; SAMPLES],
    count: usize,
    /// The sum of `1 / n`, where the box of one lies in `n` cells.
    per_cell: f64,
    /// How many are near the one that follows them.
    near: u32,
    /// The areas of their boxes, and the squares of these; half of them, in squares of the scene's longest edge.
    areas: f64,
    squares: f64,
    /// The largest of these areas.
    largest: f64,
}

/// The corners of a box.
type Corners = [DVec3; 2];

impl Sample {
    /// An empty sample of so many primitives.
    fn of(count: u32) -> Self {
        // Room for more than are to be expected.
        let distance = (count / (SAMPLES as u32 / 8 * 7)).max(SHARE).min(count / LEAST).max(1);
        Sample {
            most: 2 * distance - 1,
            random: 1,
            cells: [0; SAMPLES],
            count: 0,
            per_cell: 0.0,
            near: 0,
            areas: 0.0,
            squares: 0.0,
            largest: 0.0,
        }
    }

    /// Looks at primitives, whether they can be hit or not: few cannot.
    fn take(&mut self, scene: &Scene, grid: &Grid) {
        // Not the first ones of all: scenes often begin with a floor.
        let mut left = self.step() - 1;
        for mesh in (0..scene.mesh_count()).filter_map(|m| scene.mesh(m)) {
            left = self.take_from(grid, mesh.triangle_count(), left, |i| {
                let [a, b, c] = mesh.triangle(i)?.map(wide);
                Some([a.min(b).min(c), a.max(b).max(c)])
            });
        }
        for set in (0..scene.sphere_set_count()).filter_map(|s| scene.sphere_set(s)) {
            left = self.take_from(grid, set.sphere_count(), left, |i| {
                let [x, y, z, radius] = set.sphere(i)?;
                let (centre, radius) = (wide([x, y, z]), f64::from(radius));
                Some([centre - radius, centre + radius])
            });
        }
    }

    /// The same of those of one geometry, of which the first `left` are left out; returns how many of the next one are to be.
    fn take_from(
        &mut self,
        grid: &Grid,
        count: usize,
        left: usize,
        corners: impl Fn(usize) -> Option<Corners>,
    ) -> usize {
        let mut i = left;
        while i < count {
            if let Some(of_this) = corners(i) {
                self.add(grid, of_this, corners(i + 1));
            }
            i += self.step();
        }
        i - count
    }

    /// How far it is to the next one.
    fn step(&mut self) -> usize {
        self.random = self.random.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
        1 + (((self.random >> 32) * u64::from(self.most)) >> 32) as usize
    }

    fn add(&mut self, grid: &Grid, [from, to]: Corners, next: Option<Corners>) {
        let Some(cell) = self.cells.get_mut(self.count) else { return };
        *cell = grid.cell(from, to);
        self.count += 1;
        // Not NaN, as in a flat axis.
        let sides = ((to - from) * grid.per_length).to_array().map(|side| 1.0 + side.max(0.0));
        self.per_cell += 1.0 / (sides[0] * sides[1] * sides[2]);
        let is_near = |next: Corners| !(from - next[0]).abs().cmpgt(grid.near).any();
        self.near += u32::from(next.is_some_and(is_near));
        let edges = (to - from) * grid.per_longest;
        let area = edges.dot(DVec3::new(edges.y, edges.z, edges.x));
        // Not so where the box is none, or larger than that of the scene.
        if area <= 4.0 {
            self.areas += area;
            self.squares += area * area;
            self.largest = self.largest.max(area);
        }
    }

    /// How often one has the cell of another.
    fn pairs(&mut self) -> f64 {
        let cells = &mut self.cells[..self.count];
        cells.sort_unstable();
        let pairs = |same: &[u32]| (same.len() * (same.len() - 1)) as f64;
        cells.chunk_by(|a, b| a == b).map(pairs).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;
    use crate::scene::SphereSet;
    use std::vec::Vec;

    /// Twenty small spheres at each of `17^3` places, those of a place one after the other or each place's after 4,912 others'.
    fn spread(together: bool) -> Spread {
        const PLACES: u32 = 17 * 17 * 17;
        let place = |i: u32| if together { i / 20 } else { i % PLACES };
        let at = |place: u32| [place % 17, place / 17 % 17, place / 289].map(|k| k as f32);
        let spheres: Vec<_> =
            (0..20 * PLACES).map(|i| at(place(i))).map(|[x, y, z]| [x, y, z, 0.01]).collect();
        spread_of(&spheres, Aabb { lower: [-0.01; 3], upper: [16.01; 3] })
    }

    fn spread_of(spheres: &[[f32; 4]], bounds: Aabb) -> Spread {
        let count = spheres.len() as u32;
        let census = Census {
            bounds,
            longest: 0.02,
            mesh_count: 0,
            triangle_limit: 0,
            prim_limit: count,
            triangle_count: 0,
            sphere_count: count,
            ignored_count: 0,
            is_index: false,
            refit: false,
        };
        Spread::of(&Scene::new(&[], &[SphereSet::new(spheres)]), &census)
    }

    /// Small spheres in a row, and a large one of that number.
    #[test]
    fn one_that_is_much_larger_makes_no_scene_uneven() {
        for large in 0..40 {
            let sphere = |i: u32| [i as f32, 0.0, 0.0, if i == large { 900.0 } else { 0.25 }];
            let spheres: Vec<_> = (0..4_000).map(sphere).collect();
            let bounds = Aabb { lower: [-900.0; 3], upper: [4_900.0; 3] };
            let Spread { unevenness, .. } = spread_of(&spheres, bounds);
            assert!((0.99..1.1).contains(&unevenness), "{large}: {unevenness}");
        }
    }

    #[test]
    fn a_sample_tells_how_long_lists_are_in_any_order() {
        for together in [true, false] {
            let Spread { mean, cells, in_order, unevenness, .. } = spread(together);
            assert!((7.0..30.0).contains(&mean), "{mean} {together}");
            assert!((1.0..1.5).contains(&cells), "{cells}");
            assert!((0.99..1.1).contains(&unevenness), "{unevenness}");
            let near = if together { 0.9..0.99 } else { 0.0..0.01 };
            assert!(near.contains(&in_order), "{in_order} {together}");
        }
    }
}
