//! Several rays against one box, and against many boxes as if they were one thick ray.

use super::Ray;
use super::abreast::{Abreast, Ends};
use super::alike::Alike;
use super::slab::WideBoxes;
use crate::math::Aabb;
use crate::simd::{Lanes, Width};

/// Rays of a packet are looked at in so many groups of 16 at most.
pub(crate) const GROUPS: usize = 4;

/// Up to 16 rays for each of the [groups](GROUPS), which [are alike](Alike).
pub(crate) struct RayPacket {
    pub alike: Alike,
    groups: [Abreast; GROUPS],
    /// The least and the largest reciprocal, the largest shift of a near wall and the least of a far one.
    reciprocals: [[f32; 2]; 3],
    near_shift: [f32; 3],
    far_shift: [f32; 3],
    low: f32,
    pub spread: Spread,
}

/// Between what the numbers of all rays of a packet lie, in its frame.
pub(crate) struct Spread {
    /// Along the axes x, y and depth.
    pub origin: [[f32; 2]; 3],
    pub slope: [[f32; 2]; 2],
    /// What x or y of a sheared vertex may be off at most, for each unit of depth.
    pub blur: f32,
}

impl RayPacket {
    /// Without rays. It is some kilobytes large, which had better not be written anew for each packet.
    pub fn new(alike: Alike) -> Self {
        RayPacket {
            alike,
            groups: [const { Abreast::EMPTY }; GROUPS],
            reciprocals: [[0.0; 2]; 3],
            near_shift: [0.0; 3],
            far_shift: [0.0; 3],
            low: 0.0,
            spread: Spread { origin: [[0.0; 2]; 3], slope: [[0.0; 2]; 2], blur: 0.0 },
        }
    }

    /// Becomes these rays, whatever it was; for each group the lanes of those that can hit something.
    #[inline(always)]
    pub fn set<S: Width<16>>(&mut self, s: S, alike: Alike, rays: &[Ray]) -> [u32; GROUPS] {
        self.alike = alike;
        let mut sound = [0; GROUPS];
        let mut ends = Ends::none(s);
        let parts = self.groups.iter_mut().zip(rays.chunks(16)).zip(&mut sound);
        for ((group, rays), sound) in parts {
            *sound = group.set(s, &self.alike, rays);
            ends.take(s, group);
        }
        for group in self.groups.iter_mut().skip(rays.len().div_ceil(16)) {
            group.clear();
        }
        for k in 0..3 {
            self.reciprocals[k] = ends_of(s, ends.reciprocals[k]);
            self.spread.origin[k] = ends_of(s, ends.origin[k]);
            self.near_shift[k] = s.largest(ends.near_shift[k]);
            self.far_shift[k] = least_lane(s, ends.far_shift[k]);
        }
        self.low = least_lane(s, ends.low);
        self.spread.slope = [ends_of(s, ends.slope[0]), ends_of(s, ends.slope[1])];
        self.spread.blur = s.largest(ends.blur);
        sound
    }

    /// The rays of one of them.
    #[inline(always)]
    pub fn group(&mut self, number: usize) -> &mut Abreast {
        &mut self.groups[number % GROUPS]
    }

    /// The largest depth that is of interest to any.
    #[inline(always)]
    pub fn highest<S: Width<16>>(&self, s: S) -> f32 {
        let mut highest = s.splat(f32::NEG_INFINITY);
        for group in &self.groups {
            highest = highest.max(s.load(&group.high));
        }
        s.largest(highest)
    }

    /// For each group the rays that enter the box.
    #[inline(always)]
    pub fn entered<S: Width<16>>(&self, s: S, aabb: &Aabb) -> [u32; GROUPS] {
        let (mut first, mut last) = (aabb.lower, aabb.upper);
        for k in 0..3 {
            if self.alike.backwards[k] {
                (first[k], last[k]) = (last[k], first[k]);
            }
        }
        let mut entered = [0; GROUPS];
        for (entered, group) in entered.iter_mut().zip(&self.groups) {
            *entered = group.entered(s, first, last);
        }
        entered
    }

    /// All rays as one: what any of them enters, this does, and no later.
    #[inline(always)]
    pub fn hull<S: Width<16>>(&self, s: S) -> Hull<'_, S, S::V> {
        let [x, y, z] = self.reciprocals;
        let backwards = self.alike.backwards;
        Hull {
            reciprocals: [both(s, x), both(s, y), both(s, z)],
            near_shift: each(s, self.near_shift),
            far_shift: each(s, self.far_shift),
            low: s.splat(self.low),
            first: [0, 1, 2].map(|k| if backwards[k] { k + 3 } else { k }),
            rays: self,
            s,
        }
    }
}

#[inline(always)]
fn ends_of<S: Width<16>>(s: S, [least, most]: [S::V; 2]) -> [f32; 2] {
    [least_lane(s, least), s.largest(most)]
}

#[inline(always)]
fn least_lane<S: Width<16>>(s: S, v: S::V) -> f32 {
    -s.largest(s.splat(0.0).sub(v))
}

#[inline(always)]
fn both<S: Width<16>>(s: S, [x, y]: [f32; 2]) -> [S::V; 2] {
    [s.splat(x), s.splat(y)]
}

#[inline(always)]
fn each<S: Width<16>>(s: S, [x, y, z]: [f32; 3]) -> [S::V; 3] {
    [s.splat(x), s.splat(y), s.splat(z)]
}

/// The rays of a [`RayPacket`] as one thick ray.
///
/// Products and differences of floats do not change their order by rounding, so what is computed from the ends of
/// intervals bounds what is computed for any of the rays.
///
/// Of what that enters, boxes that none of the rays enters up to its bound are left out.
pub(crate) struct Hull<'p, S, V> {
    s: S,
    rays: &'p RayPacket,
    reciprocals: [[V; 2]; 3],
    near_shift: [V; 3],
    far_shift: [V; 3],
    low: V,
    /// The walls that the rays pass first, among lower and upper ones.
    first: [usize; 3],
}

/// The boxes that a [`Hull`] enters.
pub(crate) struct Entered<V> {
    /// One bit each.
    pub boxes: u32,
    /// Where at the earliest.
    pub near: V,
    /// How many boxes the rays were tested against, and into how many of them those of the first group go, added up.
    pub tests: u32,
    pub visits: u32,
}

impl<S: Width<16>> WideBoxes<S, 16> for Hull<'_, S, S::V> {
    #[inline(always)]
    fn entered<const FUSED: bool>(&self, walls: &[[f32; 16]; 6], t_bound: S::V) -> (u32, S::V) {
        let Entered { boxes, near, .. } = self.enters(walls, t_bound);
        (boxes, near)
    }
}

impl<S: Width<16>> Hull<'_, S, S::V> {
    /// `walls` are lower x y z, then upper x y z.
    #[inline(always)]
    pub fn enters(&self, walls: &[[f32; 16]; 6], t_bound: S::V) -> Entered<S::V> {
        let [x, y, z] = [self.between(walls, 0), self.between(walls, 1), self.between(walls, 2)];
        let near = x[0].max(y[0]).max(z[0].max(self.low));
        let far = x[1].min(y[1]).min(z[1].min(t_bound));
        let mut boxes = near.less_or_equal(far);
        let (tests, mut visits) = (boxes.count_ones(), 0);
        let mut rest = boxes;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % 16;
            rest &= rest - 1;
            let [x, y, z] = self.first;
            let first = [walls[x][lane], walls[y][lane], walls[z][lane]];
            let last = [walls[3 - x][lane], walls[5 - y][lane], walls[7 - z][lane]];
            let [group, groups @ ..] = &self.rays.groups;
            let mut rays = group.entered(self.s, first, last);
            visits += rays.count_ones();
            // Without a branch, as it is hard to foretell which of them enters.
            for group in groups {
                rays |= group.entered(self.s, first, last);
            }
            boxes &= !(u32::from(rays == 0) << lane);
        }
        Entered { boxes, near, tests, visits }
    }

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
