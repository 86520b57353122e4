//! Steps from cell to cell of one grid.

use super::ray::CellRay;
use crate::block::cells::CellBox;
use crate::simd::{Lanes, Simd, Width};

/// Where the walk is in one grid: the lanes are the axes, and the fourth means nothing.
///
/// The ray is given in the cells of the grid, turned so that no coordinate falls, as `from + t * speed`, with `t` counted from where it
/// comes into the outermost one: so `f32` tells cells apart however far away the ray comes from. The `t` of a wall comes
/// from its number, `(wall - from) / speed`, and never from adding up steps, so errors do not grow along the ray. At each
/// real `t` the walk is in the cell whose walls have been passed by their computed `t`; at the last cell of an
/// axis it stays, until `exit`.
///
/// With `n` cells along an axis of an outermost grid and `u` the unit of `f32`, the coordinate at which a wall is passed is off by at
/// most `5 u n`: `from`, the difference, the component, its reciprocal, the product. So is the coordinate after a jump: component,
/// product, `from`, sum. `docs/METHODS.md` follows that into grids within grids.
///
/// Source: \[AW87\], in the form that takes `t` from the index.
#[derive(Clone, Copy)]
pub(super) struct Level<V> {
    from: V,
    speed: V,
    /// The reciprocal of `speed`.
    pace: V,
    /// The wall ahead: cell number plus one, or infinity once the walk is in the last cell to stay.
    wall: V,
    /// The wall behind the last cell.
    last: V,
    /// When the walk came into its cell, and when it leaves the grid.
    entered: V,
    exit: V,
    /// The word of the cell.
    pub place: u32,
    /// The word of the cell with the lowest turned coordinates would be one further along each axis: cells are told by their walls ahead.
    pub corner: u32,
    /// From a cell's word to the next one's along each axis; below zero, by wrapping, along turned ones.
    pub strides: [u32; 3],
}

/// An inner grid is left earlier than the cell that it is in by this part of `t`. In that time the ray moves by this part of the way
/// through the outermost grid, which the dilation has to spare; and its walls, whose times are rounded otherwise, rarely come before.
const EARLIER: f32 = 1.0 / (1u64 << 20) as f32;

impl<V: Lanes<4>> Level<V> {
    /// The walk through the outermost grid whose resolution is at word `first`, from `from` to the time `exit`.
    #[inline(always)]
    pub fn outermost<S: Simd + Width<4, V = V>>(
        s: S,
        ray: &CellRay,
        first: u32,
        from: [f32; 3],
        exit: f32,
    ) -> Self {
        let [x, y, z] = from;
        let from = Width::<4>::load(s, &[x, y, z, 0.0]);
        let [x, y, z] = [ray.direction[0] as f32, ray.direction[1] as f32, ray.direction[2] as f32];
        let speed = Width::<4>::load(s, &[x, y, z, 1.0]);
        let pace = Width::<4>::splat(s, 1.0).div(speed);
        let times = [Width::<4>::splat(s, 0.0), Width::<4>::splat(s, exit)];
        let last = whole_floats(s, ray.resolution);
        let line = [from, speed, pace, last];
        Level::new(s, line, from, (first, ray.resolution), ray.turned, times)
    }

    /// The walk through the grid in the cell, whose resolution is at word `first`.
    #[inline(always)]
    pub fn inner<S: Simd + Width<4, V = V>>(
        &self,
        s: S,
        (first, resolution): (u32, [u32; 3]),
        turned: [u32; 3],
    ) -> Self {
        let n = whole_floats(s, resolution);
        let cell = self.wall.min(self.last).sub(Width::<4>::splat(s, 1.0));
        let from = self.from.sub(cell).mul(n);
        let speed = self.speed.mul(n);
        let line = [from, speed, self.pace.div(n), n];
        let leaves = s.least_of_three(self.times()).mul(Width::<4>::splat(s, 1.0 - EARLIER));
        let times = [self.entered, leaves.min(self.exit)];
        let at = speed.mul(self.entered).add(from);
        Level::new(s, line, at, (first, resolution), turned, times)
    }

    /// The walk in the cell in which it comes in, or the nearest.
    #[inline(always)]
    fn new<S: Simd + Width<4, V = V>>(
        s: S,
        [from, speed, pace, last]: [V; 4],
        at: V,
        (first, resolution): (u32, [u32; 3]),
        turned: [u32; 3],
        [entered, exit]: [V; 2],
    ) -> Self {
        let one = Width::<4>::splat(s, 1.0);
        let (mut strides, mut lowest, mut diagonal) = ([0; 3], first.wrapping_add(1), 0u32);
        let mut stride = 1u32;
        for k in 0..3 {
            let n = resolution[k];
            strides[k] = (stride ^ turned[k]).wrapping_sub(turned[k]);
            lowest = lowest.wrapping_add(n.wrapping_sub(1).wrapping_mul(stride) & turned[k]);
            diagonal = diagonal.wrapping_add(strides[k]);
            stride = stride.wrapping_mul(n);
        }
        let cell = s.whole(at.max(Width::<4>::splat(s, 0.0)).min(last.sub(one)));
        let wall = s.floats(cell).add(one);
        let (place, corner) = (word(lowest, strides, cell), lowest.wrapping_sub(diagonal));
        Level { from, speed, pace, wall, last, entered, exit, place, corner, strides }
    }

    /// Of each axis `from`, `speed`, `pace`, `wall` and `last`.
    #[inline(always)]
    pub fn axes(&self) -> [[f32; 5]; 3] {
        let mut columns = [[0.0; 4]; 5];
        let all = [self.from, self.speed, self.pace, self.wall, self.last];
        for (column, v) in columns.iter_mut().zip(all) {
            v.store(column);
        }
        let [from, speed, pace, wall, last] = columns;
        [0, 1, 2].map(|k| [from[k], speed[k], pace[k], wall[k], last[k]])
    }

    /// When the walk came into its cell, and when it leaves the grid.
    #[inline(always)]
    pub fn times_of_grid(&self) -> [f32; 2] {
        let [mut entered, mut exit] = [[0.0; 4]; 2];
        self.entered.store(&mut entered);
        self.exit.store(&mut exit);
        [entered[0], exit[0]]
    }

    /// The walk of which these are the [axes](Self::axes) and the [times](Self::times_of_grid).
    #[inline(always)]
    pub fn of_axes<S: Simd + Width<4, V = V>>(
        s: S,
        [x, y, z]: [[f32; 5]; 3],
        [entered, exit]: [f32; 2],
        (place, corner, strides): (u32, u32, [u32; 3]),
    ) -> Self {
        Level {
            from: Width::<4>::load(s, &[x[0], y[0], z[0], 0.0]),
            speed: Width::<4>::load(s, &[x[1], y[1], z[1], 1.0]),
            pace: Width::<4>::load(s, &[x[2], y[2], z[2], 1.0]),
            wall: Width::<4>::load(s, &[x[3], y[3], z[3], 1.0]),
            last: Width::<4>::load(s, &[x[4], y[4], z[4], 1.0]),
            entered: Width::<4>::splat(s, entered),
            exit: Width::<4>::splat(s, exit),
            place,
            corner,
            strides,
        }
    }

    /// The times at which the walls ahead are passed.
    #[inline(always)]
    fn times(&self) -> V {
        self.wall.sub(self.from).mul(self.pace)
    }

    /// Between which times the ray is in a box in the cell, if it is up to the bound.
    #[inline(always)]
    pub fn times_in<S: Simd + Width<4, V = V>>(
        &self,
        s: S,
        cell_box: CellBox,
        sides: Sides<V>,
        bound: V,
    ) -> Option<[f32; 2]> {
        let [lower, upper] = [cell_box.lower, cell_box.upper].map(|corner| corner.map(i32::from));
        let (lower, upper) = (s.floats(lower), s.floats(upper));
        // Exact, fused or not: few bits are needed for where the box lies from where steps begin.
        let half = upper.sub(lower).mul(Width::<4>::splat(s, CellBox::STEP / 2.0));
        let middle = lower.add(upper);
        let low = middle.fast_mul_sub(sides.half_step, half);
        let high = middle.fast_mul_add(sides.half_step, half);
        // What does not wait for the box.
        let cell = self.wall.min(self.last).sub(Width::<4>::splat(s, 1.0));
        let begin = cell.add(sides.begin).sub(self.from);
        let near = s.largest_of_three(low.add(begin).mul(self.pace));
        let far = s.least_of_three(high.add(begin).mul(self.pace));
        if near.less_or_equal(far.min(bound)) & 1 == 0 {
            return None;
        }
        let [mut begin, mut end] = [[0.0; 4]; 2];
        near.store(&mut begin);
        far.store(&mut end);
        Some([begin[0], end[0]])
    }

    /// Whether the walk came into its cell before the bound.
    #[inline(always)]
    pub fn begins_before(&self, bound: V) -> bool {
        self.entered.less_or_equal(bound) & 1 == 1
    }

    /// Goes through the nearest wall, or all that are equally near; false when that is beyond the exit or the bound.
    #[inline(always)]
    pub fn step<S: Simd + Width<4, V = V>>(&mut self, s: S, bound: V) -> bool {
        let one = Width::<4>::splat(s, 1.0);
        let limit = self.exit.min(bound);
        loop {
            let times = self.times();
            let least = s.least_of_three(times);
            // Written so that a NaN ends the walk.
            if least.less_or_equal(limit) & 1 == 0 {
                return false;
            }
            let moved = times.less_or_equal(least) & 7;
            self.wall = self.wall.add(s.where_less_or_equal(times, least, one));
            self.entered = least;
            let outside = self.last.less(self.wall) & moved;
            self.place = self.place.wrapping_add(self.along(moved & !outside));
            if outside == 0 {
                return true;
            }
            self.stay_inside(s);
            if outside != moved {
                return true;
            }
        }
    }

    /// How far the next words along axes are.
    #[inline(always)]
    fn along(&self, axes: u32) -> u32 {
        let mut sum = 0u32;
        for k in 0..3 {
            sum = sum.wrapping_add(self.strides[k] & (axes >> k & 1).wrapping_neg());
        }
        sum
    }

    /// Stays in the last cell of each axis whose last wall was passed: the next one is never.
    #[inline(always)]
    fn stay_inside<S: Simd + Width<4, V = V>>(&mut self, s: S) {
        let beyond = self.last.add(Width::<4>::splat(s, 1.0));
        let never = Width::<4>::splat(s, f32::INFINITY);
        self.wall = self.wall.add(s.where_less_or_equal(beyond, self.wall, never));
    }

    /// Goes through the cube of empty cells ahead, which reaches so many cells beyond this one; false when it ends beyond the exit or the bound.
    #[inline(always)]
    pub fn jump<S: Simd + Width<4, V = V>>(&mut self, s: S, ahead: f32, bound: V) -> bool {
        let one = Width::<4>::splat(s, 1.0);
        let far = self.wall.add(Width::<4>::splat(s, ahead));
        let times = far.sub(self.from).mul(self.pace);
        let least = s.least_of_three(times);
        if least.less_or_equal(self.exit.min(bound)) & 1 == 0 {
            return false;
        }
        // On other axes to where the ray is then: forwards, and within the cube.
        let at = self.speed.mul(least).add(self.from);
        let along = s.floats(s.whole(at)).add(one).min(far).max(self.wall);
        // Those that leave the cube are at its far wall already, and go through it.
        let along = s.where_less_or_equal(times, least, far).max(along);
        self.wall = along.add(s.where_less_or_equal(times, least, one));
        self.entered = least;
        self.place = word(self.corner, self.strides, s.whole(self.wall.min(self.last)));
        self.stay_inside(s);
        true
    }

    /// The cell, and when the walk came into it and will leave it: the times count from the start of the outermost grid, and the
    /// second is `until` if it leaves the grid then.
    #[cfg(test)]
    pub fn seen<S: Simd + Width<4, V = V>>(&self, s: S, until: f32) -> Seen {
        let [mut wall, mut entered, mut leaves, mut exit] = [[0.0; 4]; 4];
        self.wall.min(self.last).store(&mut wall);
        self.entered.store(&mut entered);
        self.exit.store(&mut exit);
        s.least_of_three(self.times()).store(&mut leaves);
        let end = if leaves[0] <= exit[0] { leaves[0] } else { until };
        let cell = [0, 1, 2].map(|k| wall[k] - 1.0);
        Seen { cell, times: [entered[0], end.max(entered[0])] }
    }
}

/// The word so many cells along each axis from another.
#[inline(always)]
fn word(first: u32, strides: [u32; 3], cells: [i32; 4]) -> u32 {
    let mut word = first;
    for (cells, stride) in cells.into_iter().zip(strides) {
        word = word.wrapping_add((cells as u32).wrapping_mul(stride));
    }
    word
}

/// How boxes in cells are turned with the ray.
#[derive(Clone, Copy)]
pub(super) struct Sides<V> {
    /// Half a step of a box, below zero along a turned axis, and where these steps begin.
    half_step: V,
    begin: V,
}

impl<V: Lanes<4>> Sides<V> {
    /// Of each axis half a step and the beginning.
    #[inline(always)]
    pub fn axes(&self) -> [[f32; 2]; 3] {
        let [mut half_step, mut begin] = [[0.0; 4]; 2];
        self.half_step.store(&mut half_step);
        self.begin.store(&mut begin);
        [0, 1, 2].map(|k| [half_step[k], begin[k]])
    }

    #[inline(always)]
    pub fn new<S: Simd + Width<4, V = V>>(s: S, turned: [u32; 3]) -> Self {
        let [x, y, z] = turned.map(|falls| f32::from_bits(falls & 1 << 31));
        let signs = Width::<4>::load(s, &[x, y, z, 0.0]);
        // From the other wall along a turned axis: both sums are exact.
        let begin = Width::<4>::splat(s, CellBox::BEGIN - 0.5).flipped_by(signs);
        Sides {
            half_step: Width::<4>::splat(s, CellBox::STEP / 2.0).with_sign_of(signs),
            begin: begin.add(Width::<4>::splat(s, 0.5)),
        }
    }
}

/// Numbers of cells.
#[inline(always)]
fn whole_floats<S: Simd>(s: S, [x, y, z]: [u32; 3]) -> <S as Width<4>>::V {
    s.floats([x as i32, y as i32, z as i32, 1])
}

/// What a walk thinks.
#[cfg(test)]
#[derive(Debug)]
pub(super) struct Seen {
    pub cell: [f32; 3],
    pub times: [f32; 2],
}
