//! Which structure suits a scene and what is done with it.

use crate::block::Census;
use crate::math::float::cube_root;
use crate::math::wide;
use crate::prim::{for_each_counted, for_each_prim_in};
use crate::scene::Scene;
use glam::DVec3;

/// Below this many rays for each primitive a uniform grid saves more time while it is built than its rays lose, if primitives are
/// compact and not crowded.
const FEW_RAYS: f32 = 0.6;
/// The same where they are in order, as trees are built faster then.
const FEW_IN_ORDER: f32 = 0.5;
/// The same where they are not in order and [thick](Spread::is_thick).
const FEW_IF_THICK: f32 = 0.2;
/// The same where they are not compact or, in order, thick.
const FEW_IN_SLOW_CELLS: f32 = 0.06;

/// So [crowded](Spread::crowd), half as many rays are few.
const CROWD: f32 = 250.0;

/// Lists of more are long.
const LONG: f32 = 200.0;

/// Primitives are compact if the box of one lies in up to this many cells, in the harmonic mean: a few may be long.
const COMPACT: f64 = 3.0;

/// Primitives are in order if this share of them is near the one before: along each axis by this part of the box.
const IN_ORDER: f64 = 0.975;
const NEAR: f64 = 1.0 / 32.0;

/// Whether a uniform grid is likely to take less time than a BVH, with so many rays for each primitive until it is built again.
pub(crate) fn suits_grid(scene: &Scene, census: &Census, rays_per_prim: f32) -> bool {
    if !(0.0 < rays_per_prim && rays_per_prim < FEW_RAYS) {
        return false;
    }
    let spread = Spread::of(scene, census);
    let few = match () {
        () if spread.cells > COMPACT => FEW_IN_SLOW_CELLS,
        () if spread.in_order < IN_ORDER && spread.is_thick() => FEW_IF_THICK,
        () if spread.in_order < IN_ORDER => FEW_RAYS,
        () if spread.is_thick() => FEW_IN_SLOW_CELLS,
        () => FEW_IN_ORDER,
    };
    rays_per_prim * (1.0 + spread.crowd / CROWD) < few
}

/// How primitives lie in the box around them, in a grid with as many cells along each axis as the cube root of their number.
struct Spread {
    /// How many are in the cell in which one of them is, on average.
    mean: f32,
    /// That times the share of all that it is: what a ray has to test there, as likely as it is to come there.
    crowd: f32,
    /// The cells in which the box of one lies, in the harmonic mean.
    cells: f64,
    /// The share of them that is near the one before.
    in_order: f64,
}

impl Spread {
    fn of(scene: &Scene, census: &Census) -> Spread {
        let grid = Grid::over(census);
        let mut lists = Lists::NONE;
        for i in 0..SAMPLES {
            let id = (u64::from(census.prim_limit) * i / SAMPLES) as u32;
            for_each_prim_in(scene, id..id + 1, false, |prim| {
                let aabb = prim.shape.aabb();
                lists.begin(grid.cell(wide(aabb.lower), wide(aabb.upper)));
            });
        }
        let (mut of_cells, mut near, mut before) = (0.0, 0u32, DVec3::INFINITY);
        for_each_counted(scene, census, |prim| {
            let aabb = prim.shape.aabb();
            let (from, to) = (wide(aabb.lower), wide(aabb.upper));
            lists.count(grid.cell(from, to));
            // Not NaN, as in a flat axis.
            let sides = ((to - from) * grid.per_length).to_array().map(|side| 1.0 + side.max(0.0));
            of_cells += 1.0 / (sides[0] * sides[1] * sides[2]);
            let moved = (from - before).abs();
            near += u32::from(!moved.cmpgt(grid.near).any());
            before = from;
        });
        let (all, mean) = (f64::from(census.hittable()), lists.mean());
        let crowd = mean * mean / all as f32;
        Spread { mean, crowd, cells: all / of_cells, in_order: f64::from(near) / all }
    }

    /// Whether cells are full all over large objects, so that many rays come to them: lists are long, and in more cells than
    /// a list is long.
    fn is_thick(&self) -> bool {
        self.mean > LONG && self.crowd < 1.0
    }
}

/// Where cells lie.
struct Grid {
    lower: DVec3,
    per_length: DVec3,
    /// How many there are along each axis.
    count: u32,
    /// How far apart what is near may be.
    near: DVec3,
}

impl Grid {
    fn over(census: &Census) -> Grid {
        let lower = wide(census.bounds.lower);
        let extent = wide(census.bounds.upper) - lower;
        let count = cube_root(f64::from(census.hittable()));
        Grid { lower, per_length: count / extent, count: 1 + count as u32, near: extent * NEAR }
    }

    /// The cell of the centre of a box.
    fn cell(&self, from: DVec3, to: DVec3) -> u32 {
        let centre = ((from + to) / 2.0 - self.lower) * self.per_length;
        // The casts saturate, and NaN, as in a flat axis, goes to 0.
        let [i, j, k] = centre.to_array().map(|x| (x as u32).min(self.count - 1));
        i + self.count * (j + self.count * k)
    }
}

/// So many primitives are a sample: one of them is likely to be where there is a hundredth of all in one cell.
const SAMPLES: u64 = 128;
const SLOTS: usize = 256;

/// No cell: there are fewer.
const NOWHERE: u32 = u32::MAX;

/// How many centres are in some cells, which are found by a hash; half of the slots at most are in use.
struct Lists {
    cells: [u32; SLOTS],
    counts: [u32; SLOTS],
    /// How many of the sample are in each.
    samples: [u32; SLOTS],
}

impl Lists {
    const NONE: Self = Lists { cells: [NOWHERE; SLOTS], counts: [0; SLOTS], samples: [0; SLOTS] };

    /// The slot of a cell, or where it would be.
    fn slot(&self, cell: u32) -> usize {
        // The upper bits of the golden ratio's multiples are spread well.
        let mut slot = (cell.wrapping_mul(0x9E37_79B9) >> 24) as usize;
        while self.cells[slot % SLOTS] != cell && self.cells[slot % SLOTS] != NOWHERE {
            slot += 1;
        }
        slot % SLOTS
    }

    /// Counts what is in this cell, in which one of the sample is, from now on.
    fn begin(&mut self, cell: u32) {
        let slot = self.slot(cell);
        self.cells[slot] = cell;
        self.samples[slot] += 1;
    }

    fn count(&mut self, cell: u32) {
        let slot = self.slot(cell);
        self.counts[slot] += u32::from(self.cells[slot] == cell);
    }

    /// Of the counts, each as often as the sample is in it.
    fn mean(&self) -> f32 {
        let counts = self.counts.iter().zip(&self.samples);
        let sum: f32 = counts.map(|(count, samples)| *count as f32 * *samples as f32).sum();
        sum / self.samples.iter().sum::<u32>().max(1) as f32
    }
}
