//! The filter of triangles, in `f32`: it rejects what the ray surely does not meet.

use glam::Vec3;

use super::TINY;
use super::vector::{cross, dot, sum_abs};
use crate::block::leaf::TriangleBlock;
use crate::math::rounding::UNIT32;
use crate::ray::PreparedRay;
use crate::simd::{Lanes, Scalar, Simd, Width};

/// The limits of one visit of a block, as depths of the sheared space.
///
/// The filter asks with the bound that held when the block was opened, whatever lanes before may have
/// found since, so that all backends offer the same lanes.
#[derive(Clone, Copy)]
pub(crate) struct Depths {
    low: f32,
    high: f32,
    /// What surely lies within both limits of the ray lies between these.
    inside: [f32; 2],
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

/// Vertices in the sheared space: the ray is the line x = y = 0, and depth grows along it.
#[derive(Clone, Copy)]
struct Sheared<V> {
    x: V,
    y: V,
    /// Depth from the frame's zero, without rounding.
    raw: V,
    /// Depth from the ray's origin.
    depth: V,
}

impl<V: Copy> Sheared<V> {
    /// From given coordinates, an array for each axis.
    #[inline(always)]
    fn new<S: Width<N, V = V>, const N: usize>(
        s: S,
        ray: &PreparedRay,
        vertices: &[[f32; N]; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let shear = &ray.shear;
        let [kx, ky, kz] = shear.axes;
        let scale = s.splat(ray.scale);
        let raw = s.load(&vertices[kz]).mul(s.splat(ray.scale * shear.depth_sign));
        let depth = raw.sub(s.splat(ray.origin[kz] * shear.depth_sign));
        let x = s.load(&vertices[kx]).mul(scale).sub(s.splat(ray.origin[kx]));
        let y = s.load(&vertices[ky]).mul(scale).sub(s.splat(ray.origin[ky]));
        Sheared {
            x: x.sub(s.splat(shear.slope[0]).mul(depth)),
            y: y.sub(s.splat(shear.slope[1]).mul(depth)),
            raw,
            depth,
        }
    }

    /// Twice the area that the ray's point spans with two vertices.
    #[inline(always)]
    fn area<const N: usize>(&self, next: &Self) -> V
    where
        V: Lanes<N>,
    {
        self.x.mul(next.y).sub(self.y.mul(next.x))
    }

    /// The larger distance from the ray along x and y.
    #[inline(always)]
    fn size<const N: usize>(&self) -> V
    where
        V: Lanes<N>,
    {
        self.x.abs().max(self.y.abs())
    }
}

/// The corners `k` of all triangles of a block, out of its vertices.
#[inline(always)]
fn corners<S: Simd>(
    s: S,
    vertices: &Sheared<<S as Width<16>>::V>,
    list: &[u8; 8],
) -> Sheared<<S as Width<16>>::V> {
    Sheared {
        x: s.corners(vertices.x, list),
        y: s.corners(vertices.y, list),
        raw: s.corners(vertices.raw, list),
        depth: s.corners(vertices.depth, list),
    }
}

/// What x and y of a vertex may be off, when none is larger than `size` and no depth than `deepest`.
#[inline(always)]
fn coordinate_error<S: Width<N>, const N: usize>(
    s: S,
    size: S::V,
    steepness: f32,
    deepest: S::V,
) -> S::V {
    let of_depth = deepest.mul(s.splat(5.5 * UNIT32 * steepness));
    size.mul(s.splat(2.5 * UNIT32)).add(of_depth)
}

/// What an area may be off, when coordinates are off by `shift`.
#[inline(always)]
fn area_error<S: Width<N>, const N: usize>(s: S, shift: S::V, size: S::V) -> S::V {
    let of_shift = shift.mul(size.mul(s.splat(4.0)).add(shift.mul(s.splat(2.0))));
    of_shift.add(size.mul(size).mul(s.splat(4.5 * UNIT32))).add(s.splat(TINY))
}

/// What `rise` may be off the depth of the meeting times the total area, and what the comparison of
/// both with a limit may be off, even if the total has the wrong sign.
#[inline(always)]
fn rise_error<S: Width<N>, const N: usize>(
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

/// What the filter computes of each lane.
struct Sieved<V> {
    /// Lanes that the ray surely does not meet within its limits and up to the bound.
    rejected: u32,
    /// Lanes between whose edges the ray's line surely passes.
    sure: u32,
    /// Those of them whose real `t` surely is within the ray's limits.
    inside: u32,
    over_b: V,
    over_c: V,
    total: V,
    area_error: V,
    /// The depth of the meeting, from that of the first vertex, times the size of `total`.
    rise: V,
    first_depth: V,
    nearest_depth: V,
    farthest_depth: V,
}

/// The filter for the triangles with these corners, one a lane.
///
/// Conservative for every finite triangle and prepared ray: what is rejected is not met in real
/// arithmetic, and `sure` and `inside` are only said of what is so. All bounds are for a lane
/// alone: they grow with the triangle's own size in the sheared plane and its own depth. No operation
/// is fused, so every backend computes the same bits. `docs/METHODS.md` derives the constants.
///
/// Source: \[WBW13\] for the shear; the bounds are our own.
#[inline(always)]
fn sieve<S: Width<N>, const N: usize>(
    s: S,
    ray: &PreparedRay,
    depths: &Depths,
    [a, b, c]: [Sheared<S::V>; 3],
) -> Sieved<S::V> {
    let nearest_depth = a.depth.min(b.depth).min(c.depth);
    let farthest_depth = a.depth.max(b.depth).max(c.depth);
    let slack = s.splat(2.0 * UNIT32);
    let (high, low) = (s.splat(depths.high), s.splat(depths.low));
    let too_far = high.less(nearest_depth.sub(nearest_depth.abs().mul(slack)));
    let too_near = farthest_depth.add(farthest_depth.abs().mul(slack)).less(low);
    // Each area over the vertex opposite to it.
    let (over_a, over_b, over_c) = (b.area(&c), c.area(&a), a.area(&b));
    let size = a.size().max(b.size()).max(c.size());
    let deepest = nearest_depth.abs().max(farthest_depth.abs());
    let shift = coordinate_error(s, size, ray.shear.steepness, deepest);
    let area_error = area_error(s, shift, size);
    let minus_error = s.splat(0.0).sub(area_error);
    let least = over_a.min(over_b).min(over_c);
    let most = over_a.max(over_b).max(over_c);
    let outside = least.less(minus_error) & area_error.less(most);
    let sure = area_error.less(least) | most.less(minus_error);
    let total = over_a.add(over_b).add(over_c);
    let size_of_total = total.abs();
    let (to_b, to_c) = (b.raw.sub(a.raw), c.raw.sub(a.raw));
    let rise = over_b.mul(to_b).add(over_c.mul(to_c)).flipped_by(total);
    let span = to_b.abs().max(to_c.abs());
    let error = rise_error(s, area_error, span, a.depth, size_of_total);
    let minus_error = s.splat(0.0).sub(error);
    // Positive where the meeting is beyond that depth.
    let past_high = rise.sub(high.sub(a.depth).mul(size_of_total));
    let past_low = rise.sub(low.sub(a.depth).mul(size_of_total));
    let inside_low = rise.sub(s.splat(depths.inside[0]).sub(a.depth).mul(size_of_total));
    let inside_high = rise.sub(s.splat(depths.inside[1]).sub(a.depth).mul(size_of_total));
    let past = error.less(past_high) | past_low.less(minus_error);
    let inside = error.less(inside_low) & inside_high.less(minus_error);
    Sieved {
        rejected: too_far | too_near | outside | past,
        sure,
        inside: sure & inside,
        over_b,
        over_c,
        total,
        area_error,
        rise,
        first_depth: a.depth,
        nearest_depth,
        farthest_depth,
    }
}

/// What is left of a block, one bit a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Triangles {
    /// Lanes that the filter could not reject, perhaps among them some that were not asked for.
    pub candidates: u32,
    pub sure: u32,
    pub inside: u32,
}

/// The filter for the `lanes` of a block, all at once unless they are few for the backend.
#[inline(always)]
pub(crate) fn triangles<S: Simd>(
    s: S,
    ray: &PreparedRay,
    depths: &Depths,
    block: &TriangleBlock,
    lanes: u32,
) -> Triangles {
    if S::FEW > 0 && lanes.count_ones() <= S::FEW {
        return few(ray, depths, block, lanes);
    }
    let vertices = Sheared::new(s, ray, &block.vertices);
    let [a, b, c] = &block.corners;
    let corners = [corners(s, &vertices, a), corners(s, &vertices, b), corners(s, &vertices, c)];
    let Sieved { rejected, sure, inside, .. } = sieve::<S, 16>(s, ray, depths, corners);
    Triangles { candidates: !rejected & 0xFFFF, sure, inside }
}

/// The filter, lane by lane.
fn few(ray: &PreparedRay, depths: &Depths, block: &TriangleBlock, lanes: u32) -> Triangles {
    let mut found = Triangles { candidates: 0, sure: 0, inside: 0 };
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let sieved = sieve_one(ray, depths, block.triangle(lane as usize));
        found.candidates |= (!sieved.rejected & 1) << lane;
        found.sure |= sieved.sure << lane;
        found.inside |= sieved.inside << lane;
    }
    found
}

/// One triangle in `f32`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleDetail {
    /// The frame's `t`, between those of the nearest and the farthest vertex.
    pub t: f32,
    /// What it may be off; infinite where the triangle is seen edge-on.
    pub t_error: f32,
    /// Weights of the second and the third vertex.
    pub weights: [f32; 2],
    /// Whether the line meets the front, where rounding leaves no doubt.
    pub front: Option<bool>,
}

#[inline(always)]
fn sieve_one(ray: &PreparedRay, depths: &Depths, corners: [[f32; 3]; 3]) -> Sieved<[f32; 1]> {
    let corners = corners.map(|vertex| Sheared::new(Scalar, ray, &vertex.map(|x| [x])));
    sieve::<Scalar, 1>(Scalar, ray, depths, corners)
}

/// Whether the filter cannot reject this triangle.
pub(crate) fn is_candidate(ray: &PreparedRay, depths: &Depths, corners: [[f32; 3]; 3]) -> bool {
    sieve_one(ray, depths, corners).rejected == 0
}

/// What the filter knows of a triangle that it does not reject.
pub(crate) fn detail(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> TriangleDetail {
    let sieved = sieve_one(ray, &Depths::new(ray, ray.t_max), corners);
    let [over_b, over_c, total, area_error, rise, first, nearest, farthest] = [
        sieved.over_b,
        sieved.over_c,
        sieved.total,
        sieved.area_error,
        sieved.rise,
        sieved.first_depth,
        sieved.nearest_depth,
        sieved.farthest_depth,
    ]
    .map(|[x]| x);
    // The total carries the errors of three areas, and less than as much again of its own.
    let is_clear = total.abs() > 6.0 * area_error;
    // A NaN, from 0 / 0, loses to the depths of the vertices.
    let depth = (first + rise / total.abs()).max(nearest).min(farthest);
    let rate = ray.shear.depth_rate;
    let (t, t_error) = match plane(ray, corners) {
        Some((t, t_error)) => ((t * rate).max(nearest).min(farthest) / rate, t_error),
        None => (depth / rate, f32::INFINITY),
    };
    TriangleDetail {
        t,
        t_error,
        weights: [over_b / total, over_c / total],
        front: is_clear.then_some((total < 0.0) == (ray.shear.depth_sign > 0.0)),
    }
}

/// The frame's `t` at which the ray meets the plane of the triangle, and a bound on its error; `None` when
/// they are nearly parallel.
///
/// Far tighter than what the areas give for a ray that starts on a large triangle: the error grows with the
/// distance to the first vertex instead of with the triangle. The computation is that of
/// [`interval`](crate::interval) with another unit, and its bounds.
fn plane(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> Option<(f32, f32)> {
    let [a, b, c] = corners.map(|vertex| Vec3::from(vertex) * ray.scale);
    let (e1, e2) = (b - a, c - a);
    let n = cross(e1, e2);
    let d = Vec3::from(ray.direction);
    let to_plane = a - Vec3::from(ray.origin);
    let along = dot(d, n);
    let size = 8.5 * UNIT32 * sum_abs(e1) * sum_abs(e2);
    let along_error = sum_abs(d) * size + TINY;
    if !(4.0 * along_error < along.abs()) {
        return None;
    }
    let t = dot(to_plane, n) / along;
    // Half as much again for the divisor's own error, and a few roundings of the quotient and limits.
    let error = (sum_abs(to_plane) * size + TINY + t.abs() * along_error) / along.abs();
    Some((t, 1.5 * error + 8.0 * UNIT32 * t.abs()))
}

/// The pieces of the filter for one lane, for the tests of its bounds.
#[cfg(test)]
pub(super) mod single {
    use super::{Depths, PreparedRay, Scalar, TriangleDetail};

    pub struct Sheared {
        pub x: f32,
        pub y: f32,
        pub raw: f32,
        pub depth: f32,
    }

    pub fn sheared(ray: &PreparedRay, vertex: [f32; 3]) -> Sheared {
        let super::Sheared { x: [x], y: [y], raw: [raw], depth: [depth] } =
            super::Sheared::new(Scalar, ray, &vertex.map(|x| [x]));
        Sheared { x, y, raw, depth }
    }

    pub fn area(p: &Sheared, q: &Sheared) -> f32 {
        p.x * q.y - p.y * q.x
    }

    pub fn coordinate_error(size: f32, steepness: f32, deepest: f32) -> f32 {
        super::coordinate_error(Scalar, [size], steepness, [deepest])[0]
    }

    pub fn area_error(shift: f32, size: f32) -> f32 {
        super::area_error(Scalar, [shift], [size])[0]
    }

    pub fn rise_error(area_error: f32, span: f32, depth: f32, size_of_total: f32) -> f32 {
        super::rise_error(Scalar, [area_error], [span], [depth], [size_of_total])[0]
    }

    #[derive(Clone, Copy, Debug)]
    pub struct Sieved {
        pub sure: bool,
        pub inside: bool,
        pub detail: TriangleDetail,
    }

    pub fn sieve(ray: &PreparedRay, depths: &Depths, corners: [[f32; 3]; 3]) -> Option<Sieved> {
        let sieved = super::sieve_one(ray, depths, corners);
        (sieved.rejected == 0).then(|| Sieved {
            sure: sieved.sure == 1,
            inside: sieved.inside == 1,
            detail: super::detail(ray, corners),
        })
    }
}
