//! The way of a ray through one outermost grid, cell by cell.

use super::ray::CellRay;
use super::steps::{Level, Sides};
use super::walk::Cells;
use crate::block::cells::{
    AHEAD, Cell, CellBox, EMPTY, GridHead, MOST_DEPTH, cell, resolution, side_ahead,
};
use crate::math::rounding::UNIT32;
use crate::pending::Pending;
use crate::ray::{PreparedRay, Slab};
use crate::simd::{Simd, Width};

/// How a ray comes to an outermost grid.
pub(crate) enum Entry<S: Simd> {
    /// Not up to the bound.
    Beside,
    /// Into its only cell, which lists primitives.
    Listed(Listed),
    /// From so far away that its cells cannot be told apart.
    Afar,
    Way(Way<S>),
}

/// A run, and the times of the frame between which what it lists can be met.
#[derive(Clone, Copy)]
pub(crate) struct Listed {
    pub first: usize,
    pub begin: f32,
    pub end: f32,
}

impl Listed {
    /// At any time.
    #[inline(always)]
    pub fn always(first: usize) -> Self {
        Listed { first, begin: f32::NEG_INFINITY, end: f32::INFINITY }
    }

    /// Between times that count from `start`, and a little more.
    #[inline(always)]
    pub(super) fn between(first: usize, times: [f32; 2], start: f64) -> Self {
        let [near, far] = times.map(|time| (start + f64::from(time)) as f32);
        Listed { first, begin: near - slack(near), end: far + slack(far) }
    }
}

/// A ray in a cell. It is told what the cell's word says, and goes on.
pub(crate) struct Way<S: Simd> {
    pub(super) level: Level<<S as Width<4>>::V>,
    pub turned: [u32; 3],
    pub octant: u32,
    pub(super) sides: Sides<<S as Width<4>>::V>,
    /// When it comes into the grid, in the frame: times in cells count from there.
    pub start: f64,
    pub t_bound: f32,
    /// The same as a time in cells.
    pub(super) bound: <S as Width<4>>::V,
}

/// Where a way goes on behind inner grids. A sound block has no deeper grids than there is room for.
pub(super) type Outer<S> = Pending<Level<<S as Width<4>>::V>, { MOST_DEPTH - 1 }>;

impl<S: Simd> Way<S> {
    /// The way of a ray through a grid.
    #[inline(always)]
    pub fn into(
        s: S,
        cells: &Cells,
        head: &GridHead,
        ray: &PreparedRay,
        slab: &impl Slab,
        t_bound: f32,
    ) -> Entry<S> {
        let part = slab.part_by(s, &head.bounds, t_bound);
        let first = head.first_word as usize;
        let Some(n) = cells.words.get(first).map(|word| resolution(*word)) else {
            return Entry::Beside;
        };
        if part.is_empty() {
            return Entry::Beside;
        }
        if n == [1; 3] {
            let word = cells.words.get(first + 1).copied().unwrap_or(EMPTY);
            if let Cell::Run(run) = cell(word) {
                return Entry::Listed(Listed::always(run));
            }
        }
        let cell_ray = CellRay::new(head, n, ray);
        if !cell_ray.is_near(head.finest) {
            return Entry::Afar;
        }
        let mut part = [f64::from(part.near), f64::from(part.far)];
        if !cell_ray.holds(cell_ray.at(part[0])) {
            part = cell_ray.part(part);
            // Written so that a NaN, from foreign bytes, ends it.
            if !(part[0] <= part[1]) {
                return Entry::Beside;
            }
        }
        Entry::Way(Way::begin(s, &cell_ray, head.first_word, part, t_bound))
    }

    #[inline(always)]
    pub(super) fn begin(
        s: S,
        ray: &CellRay,
        first: u32,
        [start, exit]: [f64; 2],
        t_bound: f32,
    ) -> Self {
        let turned = ray.turned;
        Way {
            level: Level::outermost(s, ray, first, ray.at(start), time_above(exit, start)),
            turned,
            octant: turned[0] & 1 | turned[1] & 2 | turned[2] & 4,
            sides: Sides::new(s, turned),
            start,
            t_bound,
            bound: bound_of(s, t_bound, start),
        }
    }

    /// The word of the cell.
    #[inline(always)]
    pub fn word(&self, cells: &Cells) -> u32 {
        cells.words.get(self.level.place as usize).copied().unwrap_or(EMPTY)
    }

    /// Goes on from an empty cell; false when the grid or the bound ends before the next one.
    #[inline(always)]
    pub fn pass(&mut self, s: S, word: u32) -> bool {
        let side = side_ahead(word, self.octant);
        if side > 0 { self.level.jump(s, AHEAD[side], self.bound) } else { self.step(s) }
    }

    /// Goes into the grid in the cell, whose resolution is at word `first`.
    #[inline(always)]
    pub(super) fn enter(&mut self, s: S, cells: &Cells, first: usize, outer: &mut Outer<S>) {
        let inner = inner(s, &self.level, cells, first, self.turned);
        if self.level.step(s, self.bound) {
            outer.push(self.level);
        }
        self.level = inner;
    }

    /// What the ray may meet of the run behind the box of the cell, which is entry `first`, if it is in that box up to the bound.
    #[inline(always)]
    pub fn listed(&self, s: S, cells: &Cells, first: usize) -> Option<Listed> {
        let cell_box = cells.runs.get(first).map_or(CellBox::WHOLE, |run| run.cell_box());
        let times = self.level.times_in(s, cell_box, self.sides, self.bound)?;
        Some(Listed::between(first + 1, times, self.start))
    }

    /// Nothing beyond `t_bound` is of interest any more.
    #[inline(always)]
    pub fn heed(&mut self, s: S, t_bound: f32) {
        if t_bound < self.t_bound {
            self.t_bound = t_bound;
            self.bound = bound_of(s, t_bound, self.start);
        }
    }

    /// Goes on to the next cell; false when the grid or the bound ends before it.
    #[inline(always)]
    pub fn step(&mut self, s: S) -> bool {
        self.level.step(s, self.bound)
    }

    /// Leaves an inner grid for the one around it; false when nothing follows up to the bound.
    #[inline(always)]
    pub(super) fn leave(&mut self, outer: &mut Outer<S>) -> bool {
        match next_outer::<S>(outer, self.bound) {
            Some(next) => {
                self.level = next;
                true
            }
            None => false,
        }
    }
}

/// The last one that is outside, if it follows up to the bound: those before it come later still.
#[inline(always)]
pub(super) fn next_outer<S: Simd>(
    outer: &mut Outer<S>,
    bound: <S as Width<4>>::V,
) -> Option<Level<<S as Width<4>>::V>> {
    outer.pop().filter(|next| next.begins_before(bound))
}

/// The walk through the grid in the cell, whose resolution is at word `first`.
#[inline(always)]
pub(super) fn inner<S: Simd>(
    s: S,
    level: &Level<<S as Width<4>>::V>,
    cells: &Cells,
    first: usize,
    turned: [u32; 3],
) -> Level<<S as Width<4>>::V> {
    // A sound block has no grids outside the words.
    let n = cells.words.get(first).map_or([1; 3], |word| resolution(*word));
    level.inner(s, (first as u32, n), turned)
}

/// More than rounding takes from a `t` of the frame. Branches for the float next to it would be guessed wrong half the time.
#[inline(always)]
fn slack(t: f32) -> f32 {
    t.abs() * (2.0 * UNIT32) + f32::MIN_POSITIVE
}

/// The time from `start` to `t`, rounded up if it is not negative. Finite, as walls that are never passed are beyond it.
#[inline(always)]
pub(super) fn time_above(t: f64, start: f64) -> f32 {
    let time = ((t - start) * (1.0 + 1.0 / (1u64 << 22) as f64)) as f32;
    if time < f32::MAX { time } else { f32::MAX }
}

/// A bound as a time from `start`.
#[inline(always)]
fn bound_of<S: Simd>(s: S, t_bound: f32, start: f64) -> <S as Width<4>>::V {
    Width::<4>::splat(s, time_above(f64::from(t_bound), start))
}
