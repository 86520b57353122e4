//! Triangles along the ray: the depth at which it meets their planes, and the limits.

use super::TINY;
use super::areas::{Areas, Sheared};
use crate::math::rounding::UNIT32;
use crate::ray::PreparedRay;
use crate::simd::{Lanes, Width};

/// The limits of one visit of a block, as depths of the sheared space.
///
/// The filter asks with the bound that held when the block was opened, whatever lanes before may have
/// found since, so that all backends offer the same lanes.
#[derive(Clone, Copy)]
pub(super) struct Depths {
    pub low: f32,
    pub high: f32,
    /// What surely lies within both limits of the ray lies between these.
    pub inside: [f32; 2],
}

impl Depths {
    #[inline(always)]
    pub fn new(ray: &PreparedRay, t_bound: f32) -> Self {
        // A product rounds once. Infinite depths stay as they are: only their finite part is widened.
        let rate = ray.shear.depth_rate;
        let slack = |t: f32| (t * rate).abs().min(f32::MAX) * (4.0 * UNIT32);
        let lower = |t: f32| t * rate - slack(t);
        let upper = |t: f32| t * rate + slack(t);
        Depths {
            // Depths of vertices are off by what scaling to the frame took below its least float.
            low: lower(ray.t_min) - TINY,
            high: upper(t_bound) + TINY,
            inside: [upper(ray.t_inside[0]), lower(ray.t_inside[1])],
        }
    }
}

/// What `rise` may be off the depth of the meeting times the total area, and what the comparison of
/// both with a limit may be off, even if the total has the wrong sign.
#[inline(always)]
pub(super) fn rise_error<S: Width<N>, const N: usize>(
    s: S,
    area_error: S::V,
    span: S::V,
    depth: S::V,
    size_of_total: S::V,
) -> S::V {
    let of_areas = area_error.mul(span.mul(s.splat(20.0)));
    let of_depth = depth.abs().add(span).mul(size_of_total).mul(s.splat(5.0 * UNIT32));
    of_areas.add(of_depth).add(s.splat(TINY))
}

/// Where the ray's line meets the planes of triangles.
pub(super) struct Meetings<V> {
    /// Lanes that the ray surely does not meet within its limits and up to the bound.
    pub past: u32,
    /// Lanes whose real `t` surely is within the ray's limits, if the line passes between the edges.
    pub inside: u32,
    pub total: V,
    /// The depth of the meeting, from that of the first vertex, times the size of `total`.
    pub rise: V,
    /// What it may be off, even if the total has the wrong sign.
    pub error: V,
    pub nearest_depth: V,
    pub farthest_depth: V,
}

impl<V: Copy> Meetings<V> {
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const N: usize>(
        s: S,
        depths: &Depths,
        areas: &Areas<V>,
        [a, b, c]: &[Sheared<V>; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let nearest_depth = a.depth.min(b.depth).min(c.depth);
        let farthest_depth = a.depth.max(b.depth).max(c.depth);
        let slack = s.splat(2.0 * UNIT32);
        let (high, low) = (s.splat(depths.high), s.splat(depths.low));
        let too_far = high.less(nearest_depth.sub(nearest_depth.abs().mul(slack)));
        let too_near = farthest_depth.add(farthest_depth.abs().mul(slack)).less(low);
        let [over_a, over_b, over_c] = areas.over;
        let total = over_a.add(over_b).add(over_c);
        let size_of_total = total.abs();
        let (to_b, to_c) = (b.raw.sub(a.raw), c.raw.sub(a.raw));
        let rise = over_b.mul(to_b).add(over_c.mul(to_c)).flipped_by(total);
        let span = to_b.abs().max(to_c.abs());
        let error = rise_error(s, areas.error, span, a.depth, size_of_total);
        let minus_error = s.splat(0.0).sub(error);
        // Positive where the meeting is beyond that depth.
        let past_high = rise.sub(high.sub(a.depth).mul(size_of_total));
        let past_low = rise.sub(low.sub(a.depth).mul(size_of_total));
        let inside_low = rise.sub(s.splat(depths.inside[0]).sub(a.depth).mul(size_of_total));
        let inside_high = rise.sub(s.splat(depths.inside[1]).sub(a.depth).mul(size_of_total));
        let beyond = error.less(past_high) | past_low.less(minus_error);
        Meetings {
            past: too_far | too_near | beyond,
            inside: error.less(inside_low) & inside_high.less(minus_error),
            total,
            rise,
            error,
            nearest_depth,
            farthest_depth,
        }
    }

    /// What the depth of the meeting is surely not below, by the depth of the first vertex. NaN, or minus
    /// infinity, where the total is zero.
    #[inline(always)]
    pub fn least_depth<S: Width<N, V = V>, const N: usize>(&self, s: S, first_depth: V) -> V
    where
        V: Lanes<N>,
    {
        let above_first = self.rise.sub(self.error).div(self.total.abs());
        // Three roundings.
        let slack = first_depth.abs().add(above_first.abs()).mul(s.splat(4.0 * UNIT32));
        first_depth.add(above_first).sub(slack)
    }
}
