//! Steps from cell to cell of one grid.

use super::ray::CellRay;
use crate::simd::{Lanes, Simd, Width};

/// Where the walk is in one grid: the lanes are the axes, and the fourth means nothing.
///
/// The ray is given anew for each grid, in its cells, turned so that no coordinate falls, and as `from + (t - start) *
/// speed` from where it enters: so `f32` tells cells apart however far away the ray comes from. The `t` of a wall comes
/// from its number, `(wall - from) / speed`, and never from adding up steps, so errors do not grow along the ray. At each
/// real `t` the walk is in the cell whose walls have been passed by their computed `t`; at the last cell of an
/// axis it stays, until `exit`.
///
/// With `n` cells along an axis and `u` the unit of `f32`, the coordinate at which a wall is passed is off by at most `5 u n`:
/// `from`, the difference, the component, its reciprocal, the product. So is the coordinate after a jump: component,
/// product, `from`, sum. `docs/METHODS.md` follows that through grids within grids.
///
/// Source: \[AW87\], in the form that takes `t` from the index.
#[derive(Clone, Copy)]
pub(super) struct Level<V> {
    /// The ray in cells of this grid, as in [`CellRay`].
    origin: [f64; 3],
    direction: [f64; 3],
    /// The `t` at which this begins and ends; `t` below is counted from the first.
    start: f64,
    exit: f64,
    from: V,
    speed: V,
    /// The reciprocal of `speed`.
    pace: V,
    /// The wall ahead: cell number plus one.
    wall: V,
    /// The wall behind the last cell.
    last: V,
    /// When the walk came into its cell.
    entered: V,
    /// Nothing beyond is of interest: the exit, or the bound if that is nearer.
    limit: V,
    /// The word of the cell.
    pub place: u32,
    /// The word of the cell with the lowest turned coordinates.
    corner: u32,
    /// From a cell's word to the next one's along each axis; below zero, by wrapping, along turned ones.
    strides: [u32; 3],
}

/// A part of a ray, by its ends.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub start: f64,
    pub exit: f64,
}

/// The time from `start` to `t`, rounded up if it is not negative.
#[inline(always)]
fn time_above(t: f64, start: f64) -> f32 {
    ((t - start) * (1.0 + 1.0 / (1u64 << 22) as f64)) as f32
}

/// Stays in range: a cell's walls are passed at no finite time.
const STOPPED: f32 = f32::NEG_INFINITY;

impl<V: Lanes<4>> Level<V> {
    /// The walk through the outermost grid whose resolution is at word `first`.
    #[inline(always)]
    pub fn outermost<S: Simd + Width<4, V = V>>(
        s: S,
        ray: &CellRay,
        first: u32,
        part: Part,
        t_bound: f32,
    ) -> Self {
        let grid = (first, ray.resolution);
        Level::new(s, [ray.origin, ray.direction], grid, ray.turned, part, t_bound)
    }

    #[inline(always)]
    fn new<S: Simd + Width<4, V = V>>(
        s: S,
        [origin, direction]: [[f64; 3]; 2],
        (first, resolution): (u32, [u32; 3]),
        turned: [u32; 3],
        Part { start, exit }: Part,
        t_bound: f32,
    ) -> Self {
        let (mut from, mut speed) = ([STOPPED; 4], [1.0; 4]);
        let (mut strides, mut corner) = ([0; 3], first.wrapping_add(1));
        let mut stride = 1u32;
        for k in 0..3 {
            from[k] = (origin[k] + start * direction[k]) as f32;
            speed[k] = direction[k] as f32;
            let n = resolution[k];
            strides[k] = (stride ^ turned[k]).wrapping_sub(turned[k]);
            corner = corner.wrapping_add(n.wrapping_sub(1).wrapping_mul(stride) & turned[k]);
            stride = stride.wrapping_mul(n);
        }
        let [x, y, z] = resolution.map(|n| n as i32);
        let one = Width::<4>::splat(s, 1.0);
        let (from, last) = (Width::<4>::load(s, &from), s.floats([x, y, z, 1]));
        let speed = Width::<4>::load(s, &speed);
        // The cell where it is now, or the nearest.
        let cell = s.whole(from.max(Width::<4>::splat(s, 0.0)).min(last.sub(one)));
        let mut level = Level {
            origin,
            direction,
            start,
            exit,
            from,
            speed,
            pace: one.div(speed),
            wall: s.floats(cell).add(one),
            last,
            entered: Width::<4>::splat(s, 0.0),
            limit: Width::<4>::splat(s, 0.0),
            place: 0,
            corner,
            strides,
        };
        level.place = level.word_of(cell);
        level.look_up_to(s, t_bound);
        level
    }

    /// The walk through the grid in the cell, whose resolution is at word `first`.
    #[inline(always)]
    pub fn inner<S: Simd + Width<4, V = V>>(
        &self,
        s: S,
        (first, resolution): (u32, [u32; 3]),
        turned: [u32; 3],
        t_bound: f32,
    ) -> Self {
        let (mut wall, mut entered, mut leaves) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        self.wall.store(&mut wall);
        self.entered.store(&mut entered);
        s.least_of_three(self.wall.sub(self.from).mul(self.pace)).store(&mut leaves);
        let (mut origin, mut direction) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let n = f64::from(resolution[k]);
            origin[k] = (self.origin[k] - f64::from(wall[k] - 1.0)) * n;
            direction[k] = self.direction[k] * n;
        }
        let exit = self.start + f64::from(leaves[0]);
        let part = Part {
            start: self.start + f64::from(entered[0]),
            exit: if exit < self.exit { exit } else { self.exit },
        };
        Level::new(s, [origin, direction], (first, resolution), turned, part, t_bound)
    }

    /// The word of a cell.
    #[inline(always)]
    fn word_of(&self, cell: [i32; 4]) -> u32 {
        let mut word = self.corner;
        for (cell, stride) in cell.into_iter().zip(self.strides) {
            word = word.wrapping_add((cell as u32).wrapping_mul(stride));
        }
        word
    }

    /// Takes note of a new bound.
    #[inline(always)]
    pub fn look_up_to<S: Simd + Width<4, V = V>>(&mut self, s: S, t_bound: f32) {
        let t = f64::from(t_bound);
        let end = if t < self.exit { t } else { self.exit };
        self.limit = Width::<4>::splat(s, time_above(end, self.start));
    }

    /// Whether the bound comes before the exit: then what is behind this grid is not of interest.
    #[inline(always)]
    pub fn ends_before_exit(&self, t_bound: f32) -> bool {
        f64::from(t_bound) < self.exit
    }

    /// Goes through the nearest wall, or all that are equally near; false when that is beyond the limit.
    #[inline(always)]
    pub fn step<S: Simd + Width<4, V = V>>(&mut self, s: S) -> bool {
        let one = Width::<4>::splat(s, 1.0);
        loop {
            let times = self.wall.sub(self.from).mul(self.pace);
            let least = s.least_of_three(times);
            // Written so that a NaN ends the walk.
            if least.less_or_equal(self.limit) & 1 == 0 {
                return false;
            }
            let moved = times.less_or_equal(least) & 7;
            self.wall = self.wall.add(s.where_less_or_equal(times, least, one));
            self.entered = least;
            self.place = self.place.wrapping_add(self.along(moved));
            let outside = self.last.less(self.wall) & 7;
            if outside == 0 {
                return true;
            }
            self.stop(s, outside);
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

    /// Stays in the last cell of these axes, whose last wall was just passed.
    #[inline(always)]
    fn stop<S: Simd + Width<4, V = V>>(&mut self, s: S, axes: u32) {
        self.place = self.place.wrapping_sub(self.along(axes));
        self.wall = self.wall.min(self.last);
        let mut from = [0.0; 4];
        self.from.store(&mut from);
        for (k, from) in from.iter_mut().enumerate() {
            if axes >> k & 1 == 1 {
                *from = STOPPED;
            }
        }
        self.from = Width::<4>::load(s, &from);
    }

    /// Goes through the cube of `side` empty cells ahead, the cell itself included; false when it ends beyond the limit.
    #[inline(always)]
    pub fn jump<S: Simd + Width<4, V = V>>(&mut self, s: S, side: u8) -> bool {
        let one = Width::<4>::splat(s, 1.0);
        let far = self.wall.add(Width::<4>::splat(s, f32::from(side - 1)));
        let times = far.sub(self.from).mul(self.pace);
        let least = s.least_of_three(times);
        if least.less_or_equal(self.limit) & 1 == 0 {
            return false;
        }
        // On other axes to where the ray is then: forwards, and within the cube.
        let at = self.speed.mul(least).add(self.from).max(self.wall.sub(one)).min(far);
        let along = s.floats(s.whole(at)).add(one).min(far);
        let through = s.where_less_or_equal(times, least, one);
        // Those that leave the cube are at its far wall already.
        let along = s.where_less_or_equal(times, least, far).max(along);
        self.wall = along.add(through);
        self.entered = least;
        if self.last.less(self.wall) & 7 != 0 {
            self.stop_beyond(s);
        }
        self.place = self.word_of(s.whole(self.wall.sub(one)));
        true
    }

    /// Stays in the last cells of the axes along which the walk is beyond them.
    #[inline(always)]
    fn stop_beyond<S: Simd + Width<4, V = V>>(&mut self, s: S) {
        let outside = self.last.less(self.wall) & 7;
        self.stop(s, outside);
    }

    /// The cell, and when the walk came into it and will leave it, as a start and a time from there.
    #[cfg(test)]
    pub fn seen<S: Simd + Width<4, V = V>>(&self, s: S) -> Seen {
        let [mut wall, mut entered, mut leaves, mut limit] = [[0.0; 4]; 4];
        self.wall.store(&mut wall);
        self.entered.store(&mut entered);
        self.limit.store(&mut limit);
        s.least_of_three(self.wall.sub(self.from).mul(self.pace)).store(&mut leaves);
        let end = leaves[0].min(limit[0]).max(entered[0]);
        let cell = [0, 1, 2].map(|k| wall[k] - 1.0);
        Seen { cell, times: [entered[0], end].map(|t| [self.start, f64::from(t)]) }
    }
}

/// What a walk thinks.
#[cfg(test)]
#[derive(Debug)]
pub(super) struct Seen {
    pub cell: [f32; 3],
    pub times: [[f64; 2]; 2],
}
