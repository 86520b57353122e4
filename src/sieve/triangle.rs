//! The filter of triangles, in `f32`: it rejects what the ray surely does not meet.

use glam::Vec3;

use super::TINY;
use super::vector::{cross, dot, sum_abs};
use crate::block::leaf::TriangleBlock;
use crate::math::Aabb;
use crate::math::rounding::UNIT32;
use crate::ray::PreparedRay;
use crate::simd::{Lanes, Scalar, Simd, Width, mul_sub};

/// The limits of one visit of a block, as depths of the sheared space.
///
/// The filter asks with the bound that held when the block was opened, whatever lanes before may have
/// found since, so that all backends offer the same lanes.
#[derive(Clone, Copy)]
struct Depths {
    low: f32,
    high: f32,
    /// What surely lies within both limits of the ray lies between these.
    inside: [f32; 2],
}

impl Depths {
    #[inline(always)]
    fn new(ray: &PreparedRay, t_bound: f32) -> Self {
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
    /// Minus x, and minus y: areas are the same.
    x: V,
    y: V,
    /// The larger distance from the ray along x and y.
    size: V,
    /// Depth from the frame's zero, without rounding.
    raw: V,
    /// Depth from the ray's origin.
    depth: V,
}

impl<V: Copy> Sheared<V> {
    /// From given coordinates, an array for each axis.
    #[inline(always)]
    fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
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
        let flat = |k: usize| s.splat(ray.origin[k]);
        let x = mul_sub::<V, FUSED, N>(s.load(&vertices[kx]), scale, flat(kx));
        let y = mul_sub::<V, FUSED, N>(s.load(&vertices[ky]), scale, flat(ky));
        let x = mul_sub::<V, FUSED, N>(depth, s.splat(shear.slope[0]), x);
        let y = mul_sub::<V, FUSED, N>(depth, s.splat(shear.slope[1]), y);
        Sheared { x, y, size: x.abs().max(y.abs()), raw, depth }
    }
}

/// Twice the area that the ray's point spans with two vertices.
#[inline(always)]
fn area<V: Lanes<N>, const FUSED: bool, const N: usize>(p: &Sheared<V>, q: &Sheared<V>) -> V {
    mul_sub::<V, FUSED, N>(p.x, q.y, p.y.mul(q.x))
}

/// What x and y of a vertex may be off, when none is larger than `size` and no depth than `deepest`:
/// `2.5 u size + 5.5 u steepness deepest`. Here the second part, which all vertices of a block share.
#[inline(always)]
fn shared_error(ray: &PreparedRay, deepest: f32) -> f32 {
    5.5 * UNIT32 * ray.shear.steepness * deepest
}

/// What an area may be off, by the largest [size](Sheared::size) of the three vertices.
///
/// With `e` what a coordinate may be off, `e (4 size + 2 e) + 4.5 u size^2`, as a polynomial in `size`.
#[derive(Clone, Copy)]
struct AreaError {
    linear: f32,
    constant: f32,
}

impl AreaError {
    const SQUARE: f32 = 14.6 * UNIT32;

    #[inline(always)]
    fn new(shared_error: f32) -> Self {
        AreaError {
            linear: 4.01 * shared_error,
            constant: 2.01 * shared_error * shared_error + TINY,
        }
    }

    #[inline(always)]
    fn of<S: Width<N>, const FUSED: bool, const N: usize>(&self, s: S, size: S::V) -> S::V {
        let (square, linear, constant) = (Self::SQUARE, -self.linear, -self.constant);
        let slope = mul_sub::<S::V, FUSED, N>(size, s.splat(square), s.splat(linear));
        mul_sub::<S::V, FUSED, N>(size, slope, s.splat(constant))
    }
}

/// The depth of the point of a box that is deepest before or behind the ray's origin.
#[inline(always)]
fn deepest(ray: &PreparedRay, aabb: &Aabb) -> f32 {
    let k = ray.shear.axes[2];
    let depth = |wall: f32| (wall * ray.scale - ray.origin[k]).abs();
    let (lower, upper) = (depth(aabb.lower[k]), depth(aabb.upper[k]));
    if lower > upper { lower } else { upper }
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

/// The areas that the ray's point spans with the edges of triangles, each over the vertex opposite to it.
struct Areas<V> {
    over: [V; 3],
    /// What each of them may be off.
    error: V,
    least: V,
    most: V,
}

impl<V: Copy> Areas<V> {
    #[inline(always)]
    fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        s: S,
        error: &AreaError,
        [a, b, c]: &[Sheared<V>; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let over =
            [area::<V, FUSED, N>(b, c), area::<V, FUSED, N>(c, a), area::<V, FUSED, N>(a, b)];
        let [x, y, z] = over;
        Areas {
            over,
            error: error.of::<S, FUSED, N>(s, a.size.max(b.size).max(c.size)),
            least: x.min(y).min(z),
            most: x.max(y).max(z),
        }
    }

    /// Lanes whose triangle the ray's line surely passes by.
    #[inline(always)]
    fn outside<S: Width<N, V = V>, const N: usize>(&self, s: S) -> u32
    where
        V: Lanes<N>,
    {
        self.least.less(s.splat(0.0).sub(self.error)) & self.error.less(self.most)
    }

    /// Lanes between whose edges the ray's line surely passes.
    #[inline(always)]
    fn sure<S: Width<N, V = V>, const N: usize>(&self, s: S) -> u32
    where
        V: Lanes<N>,
    {
        self.error.less(self.least) | self.most.less(s.splat(0.0).sub(self.error))
    }
}

/// Where the ray's line meets the planes of triangles.
struct Meetings<V> {
    /// Lanes that the ray surely does not meet within its limits and up to the bound.
    past: u32,
    /// Lanes whose real `t` surely is within the ray's limits, if the line passes between the edges.
    inside: u32,
    total: V,
    /// The depth of the meeting, from that of the first vertex, times the size of `total`.
    rise: V,
    /// What it may be off, even if the total has the wrong sign.
    error: V,
    nearest_depth: V,
    farthest_depth: V,
}

impl<V: Copy> Meetings<V> {
    #[inline(always)]
    fn new<S: Width<N, V = V>, const N: usize>(
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
    fn least_depth<S: Width<N, V = V>, const N: usize>(&self, s: S, first_depth: V) -> V
    where
        V: Lanes<N>,
    {
        let above_first = self.rise.sub(self.error).div(self.total.abs());
        // Three roundings.
        let slack = first_depth.abs().add(above_first.abs()).mul(s.splat(4.0 * UNIT32));
        first_depth.add(above_first).sub(slack)
    }
}

/// What is left of a block, one bit a lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangles {
    /// Lanes that the filter could not reject.
    pub candidates: u32,
    /// Those between whose edges the ray's line surely passes.
    pub sure: u32,
    /// Those of them whose real `t` surely is within the ray's limits.
    pub inside: u32,
    /// What the depth of the meeting in each candidate is surely not below; NaN where this is not known.
    least_depths: [f32; 16],
}

impl Triangles {
    const NONE: Self =
        Triangles { candidates: 0, sure: 0, inside: 0, least_depths: [f32::NAN; 16] };

    /// The lane of `lanes` whose meeting may come first; those of which it is not known, before.
    #[inline(always)]
    pub fn nearest(&self, lanes: u32) -> Option<u32> {
        let (mut rest, mut nearest, mut least) = (lanes, None, f32::INFINITY);
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            let depth = self.least_depths[lane as usize % 16];
            if nearest.is_none() || !(depth >= least) {
                (nearest, least) = (Some(lane), depth);
            }
        }
        nearest
    }

    /// The lanes whose meeting may come up to `t_bound`.
    #[inline(always)]
    pub fn up_to(&self, ray: &PreparedRay, t_bound: f32) -> u32 {
        let high = Depths::new(ray, t_bound).high;
        let beyond = |(lane, depth): (usize, &f32)| u32::from(*depth > high) << lane;
        !self.least_depths.iter().enumerate().map(beyond).fold(0, |all, lane| all | lane)
    }
}

/// So many candidates are decided one by one, without looking at their depths together first.
const DIRECT: u32 = 1;

/// The filter for the `lanes` of a block, all at once unless they are few for the backend.
///
/// Conservative for every finite triangle and prepared ray: what is rejected is not met in real
/// arithmetic, and `sure` and `inside` are only said of what is so. All bounds are for a lane
/// alone, but for the depth of its block: they grow with the triangle's own size in the sheared plane.
/// `docs/METHODS.md` derives the constants.
///
/// With `FREE`, the lanes that are left are none that the ray meets, but else may be others on another
/// backend; without, no operation is fused and every backend leaves the same ones.
///
/// Source: \[WBW13\] for the shear; the bounds are our own.
#[inline(always)]
pub(crate) fn triangles<S: Simd, const FREE: bool>(
    s: S,
    ray: &PreparedRay,
    t_bound: f32,
    block: &TriangleBlock,
    lanes: u32,
) -> Triangles {
    let error = AreaError::new(shared_error(ray, deepest(ray, &block.aabb)));
    if S::FEW > 0 && lanes.count_ones() <= S::FEW {
        return few(ray, t_bound, &error, block, lanes);
    }
    let vertices = Sheared::new::<S, FREE, 16>(s, ray, &block.vertices);
    let corners = corners(s, &vertices, &block.corners);
    let areas = Areas::new::<S, FREE, 16>(s, &error, &corners);
    let candidates = lanes & !areas.outside(s);
    if candidates == 0 {
        return Triangles::NONE;
    }
    let sure = candidates & areas.sure(s);
    if FREE && candidates.count_ones() <= DIRECT {
        return Triangles { candidates, sure, ..Triangles::NONE };
    }
    let meetings = Meetings::new(s, &Depths::new(ray, t_bound), &areas, &corners);
    let candidates = candidates & !meetings.past;
    let mut found = Triangles {
        candidates,
        sure: sure & candidates,
        inside: sure & candidates & meetings.inside,
        ..Triangles::NONE
    };
    meetings.least_depth(s, corners[0].depth).store(&mut found.least_depths);
    found
}

/// The corners of all triangles of a block, out of its vertices.
#[inline(always)]
fn corners<S: Simd>(
    s: S,
    vertices: &Sheared<<S as Width<16>>::V>,
    lists: &[[u8; 8]; 3],
) -> [Sheared<<S as Width<16>>::V>; 3] {
    let [a, b, c] = lists;
    [corner(s, vertices, a), corner(s, vertices, b), corner(s, vertices, c)]
}

#[inline(always)]
fn corner<S: Simd>(
    s: S,
    vertices: &Sheared<<S as Width<16>>::V>,
    list: &[u8; 8],
) -> Sheared<<S as Width<16>>::V> {
    Sheared {
        x: s.corners(vertices.x, list),
        y: s.corners(vertices.y, list),
        size: s.corners(vertices.size, list),
        raw: s.corners(vertices.raw, list),
        depth: s.corners(vertices.depth, list),
    }
}

/// The filter, lane by lane.
fn few(
    ray: &PreparedRay,
    t_bound: f32,
    error: &AreaError,
    block: &TriangleBlock,
    lanes: u32,
) -> Triangles {
    let depths = Depths::new(ray, t_bound);
    let mut found = Triangles::NONE;
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let one = One::new(ray, &depths, error, block.triangle(lane as usize));
        if !one.is_rejected() {
            found.candidates |= 1 << lane;
            found.sure |= u32::from(one.is_sure()) << lane;
            found.inside |= u32::from(one.is_inside()) << lane;
            [found.least_depths[lane as usize % 16]] =
                one.meetings.least_depth(Scalar, [one.first_depth]);
        }
    }
    found
}

/// The filter for one triangle.
struct One {
    areas: Areas<[f32; 1]>,
    meetings: Meetings<[f32; 1]>,
    first_depth: f32,
}

impl One {
    #[inline(always)]
    fn new(ray: &PreparedRay, depths: &Depths, error: &AreaError, corners: [[f32; 3]; 3]) -> One {
        let corners = corners.map(|v| sheared(ray, v));
        let areas = Areas::new::<Scalar, false, 1>(Scalar, error, &corners);
        let meetings = Meetings::new(Scalar, depths, &areas, &corners);
        One { areas, meetings, first_depth: corners[0].depth[0] }
    }

    /// A triangle by itself, not in a block.
    fn alone(ray: &PreparedRay, depths: &Depths, corners: [[f32; 3]; 3]) -> One {
        let error = AreaError::new(shared_error(ray, deepest(ray, &Aabb::around(&corners))));
        One::new(ray, depths, &error, corners)
    }

    fn is_rejected(&self) -> bool {
        self.areas.outside(Scalar) | self.meetings.past != 0
    }

    fn is_sure(&self) -> bool {
        self.areas.sure(Scalar) != 0
    }

    fn is_inside(&self) -> bool {
        self.is_sure() && self.meetings.inside != 0
    }
}

fn sheared(ray: &PreparedRay, vertex: [f32; 3]) -> Sheared<[f32; 1]> {
    Sheared::new::<Scalar, false, 1>(Scalar, ray, &vertex.map(|x| [x]))
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

/// What the filter knows of a triangle that it does not reject.
pub(crate) fn detail(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> TriangleDetail {
    let One { areas, meetings, first_depth } =
        One::alone(ray, &Depths::new(ray, ray.t_max), corners);
    let [[_], [over_b], [over_c]] = areas.over;
    let ([area_error], [total], [rise]) = (areas.error, meetings.total, meetings.rise);
    let ([nearest], [farthest]) = (meetings.nearest_depth, meetings.farthest_depth);
    // The total carries the errors of three areas, and less than as much again of its own.
    let is_clear = total.abs() > 6.0 * area_error;
    // A NaN, from 0 / 0, loses to the depths of the vertices.
    let depth = (first_depth + rise / total.abs()).max(nearest).min(farthest);
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
    let d = Vec3::from_slice(&ray.direction);
    let to_plane = a - Vec3::from_slice(&ray.origin);
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
    use super::{AreaError, Depths, One, PreparedRay, Scalar, TriangleDetail};
    use crate::math::rounding::UNIT32;

    pub struct Sheared {
        pub x: f32,
        pub y: f32,
        pub raw: f32,
        pub depth: f32,
    }

    pub fn sheared(ray: &PreparedRay, vertex: [f32; 3]) -> Sheared {
        let super::Sheared { x: [x], y: [y], raw: [raw], depth: [depth], .. } =
            super::sheared(ray, vertex);
        Sheared { x: -x, y: -y, raw, depth }
    }

    pub fn area(p: &Sheared, q: &Sheared) -> f32 {
        p.x * q.y - p.y * q.x
    }

    pub fn coordinate_error(ray: &PreparedRay, size: f32, deepest: f32) -> f32 {
        2.5 * UNIT32 * size + super::shared_error(ray, deepest)
    }

    pub fn area_error(ray: &PreparedRay, size: f32, deepest: f32) -> f32 {
        let error = AreaError::new(super::shared_error(ray, deepest));
        error.of::<Scalar, false, 1>(Scalar, [size])[0]
    }

    pub fn rise_error(area_error: f32, span: f32, depth: f32, size_of_total: f32) -> f32 {
        super::rise_error(Scalar, [area_error], [span], [depth], [size_of_total])[0]
    }

    #[derive(Clone, Copy, Debug)]
    pub struct Sieved {
        pub sure: bool,
        pub inside: bool,
        pub least_depth: f32,
        pub detail: TriangleDetail,
    }

    pub fn sieve(ray: &PreparedRay, t_bound: f32, corners: [[f32; 3]; 3]) -> Option<Sieved> {
        let one = One::alone(ray, &Depths::new(ray, t_bound), corners);
        (!one.is_rejected()).then(|| Sieved {
            sure: one.is_sure(),
            inside: one.is_inside(),
            least_depth: one.meetings.least_depth(Scalar, [one.first_depth])[0],
            detail: super::detail(ray, corners),
        })
    }
}
