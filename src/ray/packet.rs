//! Several rays against one box, and against many boxes as if they were one thick ray.

use super::slab::{NarrowSlab, WideBoxes};
use crate::math::Aabb;
use crate::simd::{Lanes, Width};

/// Rays of a packet at most.
pub(crate) const PACKET: usize = 16 * GROUPS;
/// They are looked at in groups of 16.
pub(crate) const GROUPS: usize = 4;

/// A number of each ray.
type OfEach = [[f32; 16]; GROUPS];

/// [`NarrowSlab`]s of rays that run the same way along each axis, number by number.
pub(crate) struct SlabPacket {
    reciprocal: [OfEach; 3],
    near_shift: [OfEach; 3],
    far_shift: [OfEach; 3],
    t_min: OfEach,
    t_bound: OfEach,
    backwards: [bool; 3],
    /// The least and the largest reciprocal, the largest shift of a near wall and the least of a far one.
    reciprocals: [[f32; 2]; 3],
    largest_near_shift: [f32; 3],
    least_far_shift: [f32; 3],
    least_t_min: f32,
}

impl SlabPacket {
    /// Without rays.
    pub const EMPTY: Self = SlabPacket {
        reciprocal: [[[0.0; 16]; GROUPS]; 3],
        near_shift: [[[0.0; 16]; GROUPS]; 3],
        far_shift: [[[0.0; 16]; GROUPS]; 3],
        t_min: [[0.0; 16]; GROUPS],
        t_bound: [[f32::NEG_INFINITY; 16]; GROUPS],
        backwards: [false; 3],
        reciprocals: [[f32::INFINITY, f32::NEG_INFINITY]; 3],
        largest_near_shift: [f32::NEG_INFINITY; 3],
        least_far_shift: [f32::INFINITY; 3],
        least_t_min: f32::INFINITY,
    };

    /// Makes the ray the one of this number.
    #[inline(always)]
    pub fn set(&mut self, number: usize, slab: &NarrowSlab) {
        let (group, lane) = (number / 16 % GROUPS, number % 16);
        for k in 0..3 {
            let r = slab.reciprocal[k];
            let (near, far) = (slab.near_shift[k], slab.far_shift[k]);
            self.reciprocal[k][group][lane] = r;
            self.near_shift[k][group][lane] = near;
            self.far_shift[k][group][lane] = far;
            let [least, largest] = &mut self.reciprocals[k];
            *least = if r < *least { r } else { *least };
            *largest = if r > *largest { r } else { *largest };
            let (near_shift, far_shift) =
                (&mut self.largest_near_shift[k], &mut self.least_far_shift[k]);
            *near_shift = if near > *near_shift { near } else { *near_shift };
            *far_shift = if far < *far_shift { far } else { *far_shift };
        }
        self.t_min[group][lane] = slab.t_min;
        self.least_t_min =
            if slab.t_min < self.least_t_min { slab.t_min } else { self.least_t_min };
        self.backwards = slab.backwards;
    }

    /// Nothing beyond this `t` of the ray's frame is of interest to it any more; minus infinity when it wants nothing
    /// more at all, as before it is [set](Self::set).
    #[inline(always)]
    pub fn set_bound(&mut self, number: usize, t_bound: f32) {
        self.t_bound[number / 16 % GROUPS][number % 16] = t_bound;
    }

    /// The largest of the bounds.
    #[inline(always)]
    pub fn largest_bound<S: Width<16>>(&self, s: S) -> f32 {
        let mut all = s.load(&self.t_bound[0]);
        for group in &self.t_bound {
            all = all.max(s.load(group));
        }
        let mut lanes = [0.0; 16];
        all.store(&mut lanes);
        let mut largest = f32::NEG_INFINITY;
        for lane in lanes {
            largest = if lane > largest { lane } else { largest };
        }
        largest
    }

    /// The rays of a group that enter the box, each up to its bound.
    #[inline(always)]
    pub fn entered<S: Width<16>>(&self, s: S, group: usize, aabb: &Aabb) -> u32 {
        let mut near = s.load(&self.t_min[group]);
        let mut far = s.load(&self.t_bound[group]);
        for k in 0..3 {
            let (lower, upper) = (aabb.lower[k], aabb.upper[k]);
            let (first, last) = if self.backwards[k] { (upper, lower) } else { (lower, upper) };
            let r = s.load(&self.reciprocal[k][group]);
            near = near.max(s.splat(first).mul(r).sub(s.load(&self.near_shift[k][group])));
            far = far.min(s.splat(last).mul(r).sub(s.load(&self.far_shift[k][group])));
        }
        near.less_or_equal(far)
    }

    /// Whether any ray enters the box.
    #[inline(always)]
    fn any_enters<S: Width<16>>(&self, s: S, aabb: &Aabb) -> bool {
        for group in 0..GROUPS {
            if self.entered(s, group, aabb) != 0 {
                return true;
            }
        }
        false
    }

    /// All rays as one: what any of them enters, this does, and no later.
    #[inline(always)]
    pub fn hull<S: Width<16>>(&self, s: S) -> Hull<'_, S, S::V> {
        let [x, y, z] = self.reciprocals;
        Hull {
            reciprocals: [both(s, x), both(s, y), both(s, z)],
            near_shift: each(s, self.largest_near_shift),
            far_shift: each(s, self.least_far_shift),
            t_min: s.splat(self.least_t_min),
            first: [0, 1, 2].map(|k| if self.backwards[k] { k + 3 } else { k }),
            rays: self,
            s,
        }
    }
}

#[inline(always)]
fn both<S: Width<16>>(s: S, [x, y]: [f32; 2]) -> [S::V; 2] {
    [s.splat(x), s.splat(y)]
}

#[inline(always)]
fn each<S: Width<16>>(s: S, [x, y, z]: [f32; 3]) -> [S::V; 3] {
    [s.splat(x), s.splat(y), s.splat(z)]
}

/// The rays of a [`SlabPacket`] as one thick ray.
///
/// Products and differences of floats do not change their order by rounding, so what is computed from the ends of
/// intervals bounds what is computed for any of the rays.
///
/// Of what that enters, boxes that none of the rays enters up to its bound are left out.
pub(crate) struct Hull<'p, S, V> {
    s: S,
    rays: &'p SlabPacket,
    reciprocals: [[V; 2]; 3],
    near_shift: [V; 3],
    far_shift: [V; 3],
    t_min: V,
    /// The walls that the rays pass first, among lower and upper ones.
    first: [usize; 3],
}

impl<S: Width<16>> WideBoxes<S, 16> for Hull<'_, S, S::V> {
    #[inline(always)]
    fn entered<const FUSED: bool>(&self, walls: &[[f32; 16]; 6], t_bound: S::V) -> (u32, S::V) {
        let [x, y, z] = [self.between(walls, 0), self.between(walls, 1), self.between(walls, 2)];
        let near = x[0].max(y[0]).max(z[0].max(self.t_min));
        let far = x[1].min(y[1]).min(z[1].min(t_bound));
        let mut entered = near.less_or_equal(far);
        let mut rest = entered;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % 16;
            rest &= rest - 1;
            let corner =
                |first: usize| [walls[first][lane], walls[first + 1][lane], walls[first + 2][lane]];
            let aabb = Aabb { lower: corner(0), upper: corner(3) };
            if !self.rays.any_enters(self.s, &aabb) {
                entered &= !(1 << lane);
            }
        }
        (entered, near)
    }
}

impl<S: Width<16>> Hull<'_, S, S::V> {
    /// The least and the largest distance between the walls across an axis.
    #[inline(always)]
    fn between(&self, walls: &[[f32; 16]; 6], k: usize) -> [S::V; 2] {
        let first = self.s.load(&walls[self.first[k]]);
        let last = self.s.load(&walls[2 * k + 3 - self.first[k]]);
        let [least, largest] = self.reciprocals[k];
        let near = first.mul(least).min(first.mul(largest)).sub(self.near_shift[k]);
        let far = last.mul(least).max(last.mul(largest)).sub(self.far_shift[k]);
        [near, far]
    }
}
