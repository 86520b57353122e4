//! Triangles along the ray: the depth at which it meets their planes, and the limits.

use super::areas::Areas;
use crate::math::Aabb;
use crate::math::rounding::UNIT32;
use crate::ray::{PreparedRay, TINY};
use crate::simd::{Lanes, Width, mul_add, mul_sub};

/// The middle of a box along the ray: depths near it are small numbers, wherever the ray starts.
#[derive(Clone, Copy)]
pub(super) struct Middle {
    /// Its depth from the frame's zero, and from the ray's origin.
    pub raw: f32,
    pub depth: f32,
    /// No vertex is further from it.
    pub half: f32,
    /// The depth of the vertex that is deepest before or behind the ray's origin.
    pub deepest: f32,
}

impl Middle {
    #[inline(always)]
    pub fn of(ray: &PreparedRay, aabb: &Aabb) -> Self {
        let k = ray.shear.axes[2];
        // Halves, as a sum of given coordinates may overflow.
        let scale = 0.5 * ray.shear.depth_scale;
        let (lower, upper) = (aabb.lower[k] * scale, aabb.upper[k] * scale);
        let (raw, half) = (lower + upper, (upper - lower).abs());
        let depth = raw - ray.shear.origin_depth;
        // What half and middle were rounded by, and what fell below the frame's least float.
        let slack = (lower.abs() + upper.abs()) * (4.0 * UNIT32) + TINY;
        Middle { raw, depth, half: half + slack, deepest: depth.abs() + half }
    }

    /// What is beyond these depths from here is not within `t_min` and `t_bound`.
    #[inline(always)]
    pub fn window(&self, ray: &PreparedRay, t_bound: f32) -> [f32; 2] {
        let slack = self.depth.abs() * (3.0 * UNIT32);
        let [low, high] = [ray.shear.low, ray.shear.high(t_bound)];
        [(low - self.depth) - slack, (high - self.depth) + slack]
    }

    /// Whether all of the box is beyond a window: where areas are in doubt, as from very far away, this is not.
    #[inline(always)]
    pub fn is_beyond(&self, [low, high]: [f32; 2]) -> bool {
        (low > self.half) | (high < -self.half)
    }

    /// What is within these depths from here surely is within the limits of the ray.
    #[inline(always)]
    pub fn inner_window(&self, ray: &PreparedRay) -> [f32; 2] {
        let slack = self.depth.abs() * (3.0 * UNIT32);
        let [low, high] = ray.inner_depths();
        [(low - self.depth) + slack, (high - self.depth) - slack]
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
    /// `raw` are the depths of the corners from the frame's zero.
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        s: S,
        middle: &Middle,
        areas: &Areas<V>,
        raw: &[V; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let [over_a, over_b, over_c] = areas.over;
        let [a, b, c] = raw;
        let total = over_a.add(over_b).add(over_c);
        let from_middle = s.splat(middle.raw);
        let rise = over_a.mul(a.sub(from_middle));
        let rise = mul_add::<V, FUSED, N>(over_b, b.sub(from_middle), rise);
        let rise = mul_add::<V, FUSED, N>(over_c, c.sub(from_middle), rise).flipped_by(total);
        let error = areas.error.mul(s.splat(16.0 * middle.half)).add(s.splat(TINY));
        Meetings { total: total.abs(), rise, error }
    }

    /// How far the meetings are before each of these depths, times `total`.
    #[inline(always)]
    fn before<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        &self,
        s: S,
        [low, high]: [f32; 2],
    ) -> [V; 2]
    where
        V: Lanes<N>,
    {
        let low = mul_sub::<V, FUSED, N>(self.total, s.splat(low), self.rise);
        [low, mul_sub::<V, FUSED, N>(self.total, s.splat(high), self.rise)]
    }

    /// Lanes that the ray surely does not meet between these depths.
    #[inline(always)]
    pub fn outside<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        &self,
        s: S,
        depths: [f32; 2],
    ) -> u32
    where
        V: Lanes<N>,
    {
        let [low, high] = self.before::<S, FUSED, N>(s, depths);
        self.error.less(low) | high.less(s.splat(0.0).sub(self.error))
    }

    /// Lanes that the ray surely meets between these depths, if its line passes between the edges.
    #[inline(always)]
    pub fn inside<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        &self,
        s: S,
        depths: [f32; 2],
    ) -> u32
    where
        V: Lanes<N>,
    {
        let [low, high] = self.before::<S, FUSED, N>(s, depths);
        low.less(s.splat(0.0).sub(self.error)) & self.error.less(high)
    }

    /// In memory.
    #[inline(always)]
    pub fn stored<const N: usize>(&self) -> Meetings<[f32; N]>
    where
        V: Lanes<N>,
    {
        let mut stored = Meetings::NOWHERE;
        self.total.store(&mut stored.total);
        self.rise.store(&mut stored.rise);
        self.error.store(&mut stored.error);
        stored
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
