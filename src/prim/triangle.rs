//! The filter of triangles, in `f32`: it rejects what the ray surely does not meet.

use crate::block::leaf::TriangleBlock;
use crate::math::rounding::UNIT32;
use crate::query::TriangleLane;
use crate::ray::PreparedRay;

/// Far below every bound on coordinates in the frame, and far above what underflow can take away.
const TINY: f32 = 1.0 / (1u128 << 100) as f32;

/// The limits of one visit of a block, as depths of the sheared space.
///
/// The filter asks with the bound that held when the block was opened, whatever lanes before may have
/// found since, so that all backends offer the same lanes.
pub(crate) struct Depths {
    low: f32,
    high: f32,
    /// What surely lies within both limits of the ray lies between these.
    inside: [f32; 2],
}

impl Depths {
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

/// A vertex in the sheared space: the ray is the line x = y = 0, and depth grows along it.
#[derive(Clone, Copy)]
pub(super) struct Sheared {
    pub x: f32,
    pub y: f32,
    /// Depth from the frame's zero, without rounding.
    pub raw: f32,
    /// Depth from the ray's origin.
    pub depth: f32,
}

pub(super) fn sheared(ray: &PreparedRay, vertex: [f32; 3]) -> Sheared {
    let shear = &ray.shear;
    let [kx, ky, kz] = shear.axes;
    let raw = vertex[kz] * (ray.scale * shear.depth_sign);
    let depth = raw - ray.origin[kz] * shear.depth_sign;
    Sheared {
        x: (vertex[kx] * ray.scale - ray.origin[kx]) - shear.slope[0] * depth,
        y: (vertex[ky] * ray.scale - ray.origin[ky]) - shear.slope[1] * depth,
        raw,
        depth,
    }
}

/// Twice the area that the ray's point spans with an edge.
pub(super) fn area(p: &Sheared, q: &Sheared) -> f32 {
    p.x * q.y - p.y * q.x
}

/// What x and y of a vertex may be off, when none is larger than `size` and no depth than `deepest`.
pub(super) fn coordinate_error(size: f32, steepness: f32, deepest: f32) -> f32 {
    UNIT32 * (2.5 * size + 5.5 * steepness * deepest)
}

/// What an area may be off, when coordinates are off by `shift`.
pub(super) fn area_error(shift: f32, size: f32) -> f32 {
    shift * (4.0 * size + 2.0 * shift) + 4.5 * UNIT32 * (size * size) + TINY
}

/// What `rise` may be off the depth of the meeting times the total area, and what the comparison of
/// both with a limit may be off, even if the total has the wrong sign.
pub(super) fn rise_error(area_error: f32, span: f32, depth: f32, size_of_total: f32) -> f32 {
    20.0 * area_error * span + 5.0 * UNIT32 * (depth.abs() + span) * size_of_total + TINY
}

/// What is left of a lane after the filter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sieved {
    pub sure: bool,
    pub inside: bool,
    pub front: bool,
    pub nearest: f32,
    pub t: f32,
    pub weights: [f32; 2],
}

/// The filter for one triangle; `None` only when the ray does not meet it within its limits and up to
/// the bound.
///
/// Conservative for every finite triangle and prepared ray, and `sure` and `inside` are only said of
/// what is so in real arithmetic. All bounds are for this lane alone: they grow with the triangle's
/// own size in the sheared plane and its own depth, not with the block's. No operation is fused, so
/// every backend computes the same bits. `docs/METHODS.md` derives the constants.
///
/// Source: \[WBW13\] for the shear; the bounds are our own.
pub(super) fn sieve(ray: &PreparedRay, depths: &Depths, corners: [[f32; 3]; 3]) -> Option<Sieved> {
    let [a, b, c] = corners.map(|vertex| sheared(ray, vertex));
    let nearest_depth = a.depth.min(b.depth).min(c.depth);
    let farthest_depth = a.depth.max(b.depth).max(c.depth);
    let slack = 2.0 * UNIT32;
    if nearest_depth - nearest_depth.abs() * slack > depths.high
        || farthest_depth + farthest_depth.abs() * slack < depths.low
    {
        return None;
    }
    // Twice the areas that the ray's point spans with the edges, each over the vertex opposite to it.
    let (over_a, over_b, over_c) = (area(&b, &c), area(&c, &a), area(&a, &b));
    let in_plane = |v: &Sheared| v.x.abs().max(v.y.abs());
    let size = in_plane(&a).max(in_plane(&b)).max(in_plane(&c));
    let deepest = a.depth.abs().max(b.depth.abs()).max(c.depth.abs());
    let area_error = area_error(coordinate_error(size, ray.shear.steepness, deepest), size);
    let least = over_a.min(over_b).min(over_c);
    let most = over_a.max(over_b).max(over_c);
    if least < -area_error && most > area_error {
        return None;
    }
    let sure = least > area_error || most < -area_error;
    let total = over_a + over_b + over_c;
    let size_of_total = total.abs();
    // The depth of the meeting, from that of the first vertex, is `rise / size_of_total`.
    let (to_b, to_c) = (b.raw - a.raw, c.raw - a.raw);
    let rise = (over_b * to_b + over_c * to_c) * 1f32.copysign(total);
    let span = to_b.abs().max(to_c.abs());
    let error = rise_error(area_error, span, a.depth, size_of_total);
    let beyond = |depth: f32| rise - (depth - a.depth) * size_of_total;
    if beyond(depths.high) > error || beyond(depths.low) < -error {
        return None;
    }
    let inside = sure && beyond(depths.inside[1]) < -error && beyond(depths.inside[0]) > error;
    let rate = ray.shear.depth_rate;
    // A NaN, from 0 / 0, loses to the depths of the vertices.
    let depth = (a.depth + rise / size_of_total).max(nearest_depth).min(farthest_depth);
    let low = (a.depth + (rise - error) / size_of_total).max(nearest_depth);
    Some(Sieved {
        sure,
        inside,
        front: (total < 0.0) == (ray.shear.depth_sign > 0.0),
        nearest: (low - low.abs() * (8.0 * UNIT32) - TINY) / rate,
        t: depth / rate,
        weights: [over_b / total, over_c / total],
    })
}

/// The triangle in a lane, unless the ray surely does not meet it.
pub(crate) fn lane(
    ray: &PreparedRay,
    depths: &Depths,
    block: &TriangleBlock,
    place: (u32, u32),
    prim: u32,
) -> Option<TriangleLane> {
    let corners = block.triangle(place.1 as usize);
    let Sieved { sure, inside, front, nearest, t, weights } = sieve(ray, depths, corners)?;
    Some(TriangleLane { corners, prim, place, sure, inside, front, nearest, t, weights })
}
