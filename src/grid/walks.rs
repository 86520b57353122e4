//! Sixteen walks side by side, for rays that have nothing to do with each other.
//!
//! Each lane does what a walk by itself does, by the same operations in the same order, so the same bounds hold. Cells are passed
//! all at once, a step being a jump of one cell; coming into a grid in a cell and out of it is done lane by lane.

use super::steps::Level;
use super::walk::Cells;
use super::way::{Listed, Outer, Way, inner, next_outer, time_above};
use crate::block::cells::{Cell, CellBox, EMPTY, cell};
use crate::math::Bits;
use crate::ray::Sixteen;
use crate::simd::{Lanes, Simd, Width};

/// A word of each walk.
type Words = [u32; 16];

/// Where the walks are: a column for each number of a [`Way`] and of its [`Level`].
pub(crate) struct Walks<S: Simd> {
    from: [Sixteen; 3],
    speed: [Sixteen; 3],
    pace: [Sixteen; 3],
    wall: [Sixteen; 3],
    last: [Sixteen; 3],
    entered: Sixteen,
    exit: Sixteen,
    bound: Sixteen,
    half_step: [Sixteen; 3],
    begin: [Sixteen; 3],
    place: Words,
    corner: Words,
    strides: [Words; 3],
    /// Where in an empty cell's word the cube ahead is named.
    shift: Words,
    start: [f64; 16],
    t_bound: Sixteen,
    turned: [[u32; 3]; 16],
    outer: [Outer<S>; 16],
}

/// What walks find in their cells, a bit for each.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub words: Words,
    /// A grid.
    pub grids: u32,
    /// Something that the ray may meet.
    pub listed: u32,
    /// The times between which it may, for those with a box.
    times: [Sixteen; 2],
}

impl<S: Simd> Walks<S> {
    /// Nowhere.
    pub const NOWHERE: Self = Walks {
        from: [[0.0; 16]; 3],
        speed: [[0.0; 16]; 3],
        pace: [[0.0; 16]; 3],
        wall: [[0.0; 16]; 3],
        last: [[0.0; 16]; 3],
        entered: [0.0; 16],
        exit: [0.0; 16],
        bound: [0.0; 16],
        half_step: [[0.0; 16]; 3],
        begin: [[0.0; 16]; 3],
        place: [0; 16],
        corner: [0; 16],
        strides: [[0; 16]; 3],
        shift: [0; 16],
        start: [0.0; 16],
        t_bound: [0.0; 16],
        turned: [[0; 3]; 16],
        outer: [const { Outer::<S>::NONE }; 16],
    };

    /// A walk begins.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, way: &Way<S>) {
        let lane = lane % 16;
        self.put(lane, &way.level);
        for (k, side) in way.sides.axes().into_iter().enumerate() {
            [self.half_step[k][lane], self.begin[k][lane]] = side;
        }
        self.shift[lane] = 3 * way.octant;
        self.start[lane] = way.start;
        self.turned[lane] = way.turned;
        self.outer[lane].clear();
        self.t_bound[lane] = way.t_bound;
        self.bound[lane] = time_above(f64::from(way.t_bound), way.start);
    }

    /// Writes where a walk is.
    #[inline(always)]
    fn put(&mut self, lane: usize, level: &Level<<S as Width<4>>::V>) {
        for (k, axis) in level.axes().into_iter().enumerate() {
            [
                self.from[k][lane],
                self.speed[k][lane],
                self.pace[k][lane],
                self.wall[k][lane],
                self.last[k][lane],
            ] = axis;
            self.strides[k][lane] = level.strides[k];
        }
        [self.entered[lane], self.exit[lane]] = level.times_of_grid();
        self.place[lane] = level.place;
        self.corner[lane] = level.corner;
    }

    /// Where a walk is.
    #[inline(always)]
    fn level(&self, s: S, lane: usize) -> Level<<S as Width<4>>::V> {
        let mut axes = [[0.0; 5]; 3];
        let mut strides = [0; 3];
        for k in 0..3 {
            axes[k] = [
                self.from[k][lane],
                self.speed[k][lane],
                self.pace[k][lane],
                self.wall[k][lane],
                self.last[k][lane],
            ];
            strides[k] = self.strides[k][lane];
        }
        let times = [self.entered[lane], self.exit[lane]];
        Level::of_axes(s, axes, times, (self.place[lane], self.corner[lane], strides))
    }

    /// What the cells of the walks of `lanes` say.
    #[inline(always)]
    pub fn look(&self, s: S, cells: &Cells, lanes: u32) -> Found {
        let mut words = [EMPTY; 16];
        for (word, place) in words.iter_mut().zip(self.place) {
            *word = cells.words.get(place as usize).copied().unwrap_or(EMPTY);
        }
        // The two bits of the tag, by which a cell is empty, a run, a grid, or a run with a box.
        let (mut low, mut high) = ([0; 16], [0; 16]);
        for (i, word) in words.iter().enumerate() {
            (low[i], high[i]) = (word & 1 << 30, word & 1 << 31);
        }
        let low = lanes & Width::<16>::used_words(s, &low);
        let high = lanes & Width::<16>::used_words(s, &high);
        let (grids, boxed) = (high & !low, high & low);
        let mut found = Found { words, grids, listed: low & !high, times: [[0.0; 16]; 2] };
        if boxed != 0 {
            found.listed |= self.look_at_boxes(s, cells, boxed, &mut found);
        }
        found
    }

    /// Which of the walks of `lanes` are in the boxes in their cells up to their bounds.
    #[inline(always)]
    fn look_at_boxes(&self, s: S, cells: &Cells, lanes: u32, found: &mut Found) -> u32 {
        let mut corners = [[0; 16]; 2];
        for lane in Bits(lanes) {
            if let Cell::Boxed(first) = cell(found.words[lane % 16])
                && let Some(run) = cells.runs.get(first)
            {
                [corners[0][lane % 16], corners[1][lane % 16]] = run.cell_box().words();
            }
        }
        let one = Width::<16>::splat(s, 1.0);
        let half_step = Width::<16>::splat(s, CellBox::STEP / 2.0);
        let mut near = Width::<16>::splat(s, f32::NEG_INFINITY);
        let mut far = Width::<16>::splat(s, f32::INFINITY);
        for k in 0..3 {
            let lower = Width::<16>::load(s, &bytes(&corners[0], k));
            let upper = Width::<16>::load(s, &bytes(&corners[1], k));
            let pace = Width::<16>::load(s, &self.pace[k]);
            let half = upper.sub(lower).mul(half_step);
            let middle = lower.add(upper).mul(Width::<16>::load(s, &self.half_step[k]));
            let cell = self.wall_ahead(s, k).sub(one);
            let begin = cell.add(Width::<16>::load(s, &self.begin[k]));
            let begin = begin.sub(Width::<16>::load(s, &self.from[k]));
            near = middle.sub(half).add(begin).mul(pace).max(near);
            far = middle.add(half).add(begin).mul(pace).min(far);
        }
        near.store(&mut found.times[0]);
        far.store(&mut found.times[1]);
        lanes & near.less_or_equal(far.min(Width::<16>::load(s, &self.bound)))
    }

    /// The walls ahead along an axis, the last one where a walk stays.
    #[inline(always)]
    fn wall_ahead(&self, s: S, k: usize) -> <S as Width<16>>::V {
        Width::<16>::load(s, &self.wall[k]).min(Width::<16>::load(s, &self.last[k]))
    }

    /// What a walk that has found something listed may meet.
    #[inline(always)]
    pub fn listed(&self, found: &Found, lane: usize) -> Listed {
        let lane = lane % 16;
        let first = match cell(found.words[lane]) {
            Cell::Boxed(first) => first,
            Cell::Run(first) => return Listed::always(first),
            _ => return Listed::always(usize::MAX),
        };
        let times = [found.times[0][lane], found.times[1][lane]];
        Listed::between(first + 1, times, self.start[lane])
    }

    /// Nothing beyond `t_bound` is of interest to a walk any more.
    #[inline(always)]
    pub fn heed(&mut self, lane: usize, t_bound: f32) {
        let lane = lane % 16;
        if t_bound < self.t_bound[lane] {
            self.t_bound[lane] = t_bound;
            self.bound[lane] = time_above(f64::from(t_bound), self.start[lane]);
        }
    }

    /// Brings a walk into the grid that it has found.
    #[inline(always)]
    pub fn enter(&mut self, s: S, cells: &Cells, found: &Found, lane: usize) {
        let lane = lane % 16;
        let Cell::Grid(first) = cell(found.words[lane]) else { return };
        let mut level = self.level(s, lane);
        let bound = Width::<4>::splat(s, self.bound[lane]);
        self.put(lane, &inner(s, &level, cells, first, self.turned[lane]));
        if level.step(s, bound) {
            self.outer[lane].push(level);
        }
    }

    /// Brings a walk out of an inner grid; false when nothing follows up to the bound.
    #[inline(always)]
    pub fn leave(&mut self, s: S, lane: usize) -> bool {
        let lane = lane % 16;
        let bound = Width::<4>::splat(s, self.bound[lane]);
        let Some(next) = next_outer::<S>(&mut self.outer[lane], bound) else { return false };
        self.put(lane, &next);
        true
    }

    /// Moves the walks of `lanes` through the empty cubes ahead, or by a cell; those that go on, as the others leave their grids or
    /// come to their bounds.
    #[inline(always)]
    pub fn advance(&mut self, s: S, found: &Found, lanes: u32) -> u32 {
        let one = Width::<16>::splat(s, 1.0);
        let ahead = Width::<16>::load(s, &self.cells_beyond(&found.words));
        let (mut far, mut times) = ([one; 3], [one; 3]);
        for k in 0..3 {
            far[k] = Width::<16>::load(s, &self.wall[k]).add(ahead);
            let from = Width::<16>::load(s, &self.from[k]);
            times[k] = far[k].sub(from).mul(Width::<16>::load(s, &self.pace[k]));
        }
        let least = times[0].min(times[1]).min(times[2]);
        let limit = Width::<16>::load(s, &self.exit).min(Width::<16>::load(s, &self.bound));
        let goes = lanes & least.less_or_equal(limit);
        let entered = Width::<16>::load(s, &self.entered);
        Width::<16>::select(s, goes, least, entered).store(&mut self.entered);
        let mut place = self.corner;
        for k in 0..3 {
            let passed = times[k].less_or_equal(least);
            self.move_along(s, k, (least, far[k]), (goes, passed));
            let mut wall = [0.0; 16];
            self.wall_ahead(s, k).add(Width::<16>::splat(s, WHOLE)).store(&mut wall);
            for (i, place) in place.iter_mut().enumerate() {
                let wall = wall[i].to_bits() & (WHOLE as u32 - 1);
                *place = place.wrapping_add(wall.wrapping_mul(self.strides[k][i]));
            }
        }
        for (i, place) in place.into_iter().enumerate() {
            self.place[i] = if goes >> i & 1 == 1 { place } else { self.place[i] };
        }
        goes
    }

    /// Moves walks along an axis to where they are at the times `least`, forwards and to the cell before the wall `far` at most; those
    /// that come to that wall go through it.
    #[inline(always)]
    fn move_along(
        &mut self,
        s: S,
        k: usize,
        (least, far): (<S as Width<16>>::V, <S as Width<16>>::V),
        (goes, passed): (u32, u32),
    ) {
        let one = Width::<16>::splat(s, 1.0);
        let wall = Width::<16>::load(s, &self.wall[k]);
        let at = Width::<16>::load(s, &self.speed[k]).mul(least);
        let at = at.add(Width::<16>::load(s, &self.from[k]));
        // Rounded to a whole number, which is right while it is not clear of the walls anyway, and then down.
        let whole = Width::<16>::splat(s, WHOLE);
        let near = at.add(whole).sub(whole);
        let below = Width::<16>::select(s, at.less(near), near.sub(one), near);
        let along = below.add(one).min(far).max(wall);
        let along = Width::<16>::select(s, passed, far.add(one), along);
        let last = Width::<16>::load(s, &self.last[k]);
        // In the last cell walks stay: the next wall is never.
        let stays = last.add(one).less_or_equal(along);
        let never = Width::<16>::splat(s, f32::INFINITY);
        let along = Width::<16>::select(s, stays, never, along);
        Width::<16>::select(s, goes, along, wall).store(&mut self.wall[k]);
    }

    /// How many cells behind their own the empty cubes ahead reach: none where a cell is not empty.
    #[inline(always)]
    fn cells_beyond(&self, words: &Words) -> Sixteen {
        let mut beyond = [0.0; 16];
        for (i, beyond) in beyond.iter_mut().enumerate() {
            let word = words[i];
            let number = if word >> 30 == 0 { word >> self.shift[i] & 7 } else { 0 };
            *beyond = side_of(number) - 1.0;
        }
        beyond
    }
}

/// Whole numbers below it are the lowest bits of their sums with it.
const WHOLE: f32 = (1u32 << 23) as f32;

/// Byte `k` of each word.
#[inline(always)]
fn bytes(words: &Words, k: usize) -> Sixteen {
    let mut bytes = [0.0; 16];
    for (byte, word) in bytes.iter_mut().zip(words) {
        *byte = (word >> (8 * k) & 255) as i32 as f32;
    }
    bytes
}

/// What stands in [`SIDES`](crate::block::cells::SIDES) at a number, without memory: powers of two and once and a half them.
#[inline(always)]
fn side_of(number: u32) -> f32 {
    let half = if number == 0 { 0 } else { ((number + 1) & 1) << 22 };
    f32::from_bits(((127 + number.div_ceil(2)) << 23) | half)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use raykern_harness::make::Random;
    use raykern_harness::search::samples;

    use super::super::bounds::{bounds, ray_to};
    use super::super::ray::CellRay;
    use super::super::space::Space;
    use super::*;
    use crate::block::cells::{AHEAD, Run, SIDES, box_word};
    use crate::math::Aabb;
    use crate::prim::Leaves;
    use crate::simd::Scalar;

    #[test]
    fn sides_are_computed_as_they_stand() {
        for (number, side) in SIDES.into_iter().enumerate() {
            assert_eq!(side_of(number as u32), f32::from(side));
        }
    }

    /// A ray in a grid over a box, if the one that is tried comes into it.
    fn way_through(random: &mut Random, space: &Space, aabb: &Aabb) -> Option<Way<Scalar>> {
        let ray = ray_to(random, aabb)?;
        let cell_ray = CellRay::new(&space.head(0, 1), space.resolution, &ray);
        let part = cell_ray.part([0.0, 10.0]);
        let comes = cell_ray.is_near(1) && part[0] <= part[1];
        comes.then(|| Way::begin(Scalar, &cell_ray, 0, part, 8.0))
    }

    /// Whether both are in the same cell by the same numbers.
    fn are_equal(a: &Level<[f32; 4]>, b: &Level<[f32; 4]>) -> bool {
        let bits = |level: &Level<[f32; 4]>| {
            let numbers = level.axes().into_iter().flatten().chain(level.times_of_grid());
            let numbers: Vec<u32> = numbers.map(f32::to_bits).collect();
            (numbers, level.place, level.corner, level.strides)
        };
        bits(a) == bits(b)
    }

    fn seen(listed: Listed) -> (usize, u32, u32) {
        (listed.first, listed.begin.to_bits(), listed.end.to_bits())
    }

    /// What is found and where it is gone, side by side and alone, to the bit.
    #[test]
    fn each_walk_goes_where_it_goes_alone() {
        let mut random = Random::new(46);
        let (mut steps, mut boxes) = (0, 0);
        for _ in 0..samples(200) {
            let aabb = bounds(&mut random);
            let space = Space::over(&aabb, [0; 3].map(|_| 1 + random.below(300) as u32));
            let tried = (0..40).filter_map(|_| way_through(&mut random, &space, &aabb));
            let mut ways = Vec::from_iter(tried.take(16));
            let mut walks = Walks::NOWHERE;
            ways.iter().enumerate().for_each(|(lane, way)| walks.set(lane, way));
            let mut going = (1 << ways.len()) - 1;
            while going != 0 {
                let runs: [Run; 16] = core::array::from_fn(|_| {
                    let [lower, upper] = [random.point(-0.1, 0.6), random.point(0.4, 1.1)];
                    Run::of_box(CellBox::around(lower, upper))
                });
                let leaves = Leaves { triangle_blocks: &[], sphere_blocks: &[], prim_ids: &[] };
                let cells = Cells { grids: &[], words: &[], runs: &runs, leaves };
                let mut found =
                    Found { words: [0; 16], grids: 0, listed: 0, times: [[0.0; 16]; 2] };
                found.words = core::array::from_fn(|lane| box_word(lane as u32));
                found.listed = walks.look_at_boxes(Scalar, &cells, going, &mut found);
                for lane in Bits(going) {
                    let alone = ways[lane].listed(Scalar, &cells, lane).map(seen);
                    let is_in = found.listed >> lane & 1 == 1;
                    assert_eq!(is_in.then(|| seen(walks.listed(&found, lane))), alone);
                    boxes += u32::from(is_in);
                }
                let sides: [usize; 16] = core::array::from_fn(|_| random.below(8));
                for lane in Bits(going) {
                    found.words[lane] = (sides[lane] as u32) << (3 * ways[lane].octant);
                }
                let goes = walks.advance(Scalar, &found, going);
                for lane in Bits(going) {
                    let bound = ways[lane].bound;
                    let level = &mut ways[lane].level;
                    let alone = level.jump(Scalar, AHEAD[sides[lane]], bound);
                    assert_eq!(goes >> lane & 1 == 1, alone);
                    assert!(!alone || are_equal(level, &walks.level(Scalar, lane)));
                    steps += u32::from(alone);
                }
                going &= goes;
            }
        }
        assert!(steps > 10_000 && boxes > 1_000, "{steps} {boxes}");
    }
}
