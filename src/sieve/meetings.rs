//! Triangles along the ray: the depth at which it meets their planes, and the limits.

use super::areas::Areas;
use crate::math::Aabb;
use crate::math::rounding::UNIT32;
use crate::ray::{Interval, PreparedRay, TINY};
use crate::simd::{Lanes, Scalar, Width, mul_add, mul_sub};

/// The middle of a box along rays: depths near it are small numbers, wherever a ray starts.
#[derive(Clone, Copy)]
pub(super) struct Middle<V> {
    /// Its depth from the frame's zero, and from the origin of each ray.
    pub raw: f32,
    pub depth: V,
    /// No vertex is further from it.
    pub half: f32,
    /// The depth of the vertex that is deepest before or behind a ray's origin.
    pub deepest: V,
}

impl<V: Copy> Middle<V> {
    /// Between two given coordinates along the axis of rays of one frame, whose `depth_scale` brings these to depths.
    #[inline(always)]
    pub fn of<S: Width<N, V = V>, const N: usize>(
        s: S,
        depth_scale: f32,
        origin_depth: V,
        [lower, upper]: [f32; 2],
    ) -> Self
    where
        V: Lanes<N>,
    {
        // Halves, as a sum of given coordinates may overflow.
        let scale = 0.5 * depth_scale;
        let (lower, upper) = (lower * scale, upper * scale);
        let (raw, half) = (lower + upper, (upper - lower).abs());
        let depth = s.splat(raw).sub(origin_depth);
        // What half and middle were rounded by, and what fell below the frame's least float.
        let slack = (lower.abs() + upper.abs()) * (4.0 * UNIT32) + TINY;
        Middle { raw, depth, half: half + slack, deepest: depth.abs().add(s.splat(half)) }
    }

    /// What is beyond these depths from here is beyond those from the origins.
    #[inline(always)]
    pub fn window<S: Width<N, V = V>, const N: usize>(&self, s: S, [low, high]: [V; 2]) -> [V; 2]
    where
        V: Lanes<N>,
    {
        let slack = self.slack(s);
        [low.sub(self.depth).sub(slack), high.sub(self.depth).add(slack)]
    }

    /// What is within these depths from here surely is within those from the origins.
    #[inline(always)]
    pub fn inner_window<S: Width<N, V = V>, const N: usize>(
        &self,
        s: S,
        [low, high]: [V; 2],
    ) -> [V; 2]
    where
        V: Lanes<N>,
    {
        let slack = self.slack(s);
        [low.sub(self.depth).add(slack), high.sub(self.depth).sub(slack)]
    }

    /// What a depth from here may be off for the rounding of `depth`.
    #[inline(always)]
    fn slack<S: Width<N, V = V>, const N: usize>(&self, s: S) -> V
    where
        V: Lanes<N>,
    {
        self.depth.abs().mul(s.splat(3.0 * UNIT32))
    }

    /// Whether all of the box is beyond a window: where areas are in doubt, as from very far away, this is not.
    #[inline(always)]
    pub fn is_beyond<S: Width<N, V = V>, const N: usize>(&self, s: S, [low, high]: [V; 2]) -> u32
    where
        V: Lanes<N>,
    {
        s.splat(self.half).less(low) | high.less(s.splat(-self.half))
    }
}

impl Middle<[f32; 1]> {
    /// Of a box for one ray.
    #[inline(always)]
    pub fn of_one(ray: &PreparedRay, aabb: &Aabb) -> Self {
        let k = ray.shear.axes[2] as usize;
        Middle::between(ray, [aabb.lower[k], aabb.upper[k]])
    }

    /// Between two given coordinates along the axis of one ray.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn between(ray: &PreparedRay, ends: [f32; 2]) -> Self {
        Middle::of(Scalar, ray.shear.depth_scale, [ray.shear.origin_depth], ends)
    }
}

/// Where the ray's line meets the planes of triangles, if it passes between their edges.
#[derive(Clone, Copy)]
pub(super) struct Meetings<V> {
    /// The sum of the areas, without its sign.
    pub total: V,
    /// The depth of the meeting, from the middle of the box, times `total`.
    pub rise: V,
    /// What a comparison of `rise` with the product of `total` and a depth within the box may be off, even if the sum has
    /// the wrong sign. Depths beyond it are told from all meetings anyway.
    pub error: V,
}

impl<V: Copy> Meetings<V> {
    /// For a box that is twice `half` deep; `depths` are those of the corners from its middle.
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        s: S,
        half: f32,
        areas: &Areas<V>,
        depths: [V; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let [over_a, over_b, over_c] = areas.over;
        let [a, b, c] = depths;
        let total = over_a.add(over_b).add(over_c);
        let rise = over_a.mul(a);
        let rise = mul_add::<V, FUSED, N>(over_b, b, rise);
        let rise = mul_add::<V, FUSED, N>(over_c, c, rise).flipped_by(total);
        let error = areas.error.mul(s.splat(16.0 * half)).add(s.splat(TINY));
        Meetings { total: total.abs(), rise, error }
    }

    /// How far the meetings are before each of these depths, times `total`.
    #[inline(always)]
    fn before<const FUSED: bool, const N: usize>(&self, [low, high]: [V; 2]) -> [V; 2]
    where
        V: Lanes<N>,
    {
        let low = mul_sub::<V, FUSED, N>(self.total, low, self.rise);
        [low, mul_sub::<V, FUSED, N>(self.total, high, self.rise)]
    }

    /// Lanes that the ray surely does not meet between these depths.
    #[inline(always)]
    pub fn outside<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        &self,
        s: S,
        depths: [V; 2],
    ) -> u32
    where
        V: Lanes<N>,
    {
        let [low, high] = self.before::<FUSED, N>(depths);
        self.error.less(low) | high.less(s.splat(0.0).sub(self.error))
    }

    /// Lanes that the ray surely meets between these depths, if its line passes between the edges.
    #[inline(always)]
    pub fn inside<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        &self,
        s: S,
        depths: [V; 2],
    ) -> u32
    where
        V: Lanes<N>,
    {
        let [low, high] = self.before::<FUSED, N>(depths);
        low.less(s.splat(0.0).sub(self.error)) & self.error.less(high)
    }

    /// Those of one lane.
    #[inline(always)]
    pub fn lane<S: Width<N, V = V>, const N: usize>(&self, s: S, lane: u32) -> Meetings<[f32; 1]>
    where
        V: Lanes<N>,
    {
        Meetings {
            total: [s.lane(self.total, lane)],
            rise: [s.lane(self.rise, lane)],
            error: [s.lane(self.error, lane)],
        }
    }

    /// In memory, with room for more lanes, in which nothing is met.
    #[inline(always)]
    pub fn stored<const N: usize, const ROOM: usize>(&self) -> Meetings<[f32; ROOM]>
    where
        V: Lanes<N>,
    {
        const { assert!(N <= ROOM) }
        let mut stored = Meetings::NOWHERE;
        let Meetings { total, rise, error } = &mut stored;
        for (v, room) in [(self.total, total), (self.rise, rise), (self.error, error)] {
            if let Some(lanes) = room.first_chunk_mut() {
                v.store(lanes);
            }
        }
        stored
    }
}

impl Meetings<[f32; 1]> {
    /// The part of the ray in which it meets the plane, by `t` of the frame, if it surely passes between the edges. Rounding
    /// takes some `6 u` of what is added up.
    #[inline(always)]
    pub fn part(&self, middle: &Middle<[f32; 1]>, ray: &PreparedRay) -> Interval<f32> {
        let ([total], [rise], [error]) = (self.total, self.rise, self.error);
        let ([middle], inverse) = (middle.depth, 1.0 / total);
        let (above, error) = (rise * inverse, error * inverse);
        let slack = (middle.abs() + above.abs() + error) * (8.0 * UNIT32) + TINY;
        let (near, far) = (above - (error + slack), above + (error + slack));
        let pace = ray.shear.pace();
        Interval { near: (middle + near) * pace, far: (middle + far) * pace }
    }
}

impl<const N: usize> Meetings<[f32; N]> {
    pub const NOWHERE: Self = Meetings { total: [0.0; N], rise: [0.0; N], error: [0.0; N] };

    /// Back in registers.
    #[inline(always)]
    pub fn loaded<S: Width<N>>(&self, s: S) -> Meetings<S::V> {
        Meetings {
            total: s.load(&self.total),
            rise: s.load(&self.rise),
            error: s.load(&self.error),
        }
    }

    pub fn set(&mut self, lane: usize, one: &Meetings<[f32; 1]>) {
        ([self.total[lane]], [self.rise[lane]], [self.error[lane]]) =
            (one.total, one.rise, one.error);
    }
}
