//! The filter of triangles, in `f32`: it rejects what the ray surely does not meet.

use super::areas::{Across, Along, AreaError, Areas, shared_error};
use super::meetings::{Meetings, Middle};
use crate::block::leaf::TriangleBlock;
use crate::ray::{Interval, PreparedRay};
use crate::simd::{Lanes, NUMBERS, Scalar, Simd, Width};

/// What is left of a block, one bit a lane.
///
/// Conservative for every finite triangle and prepared ray: what is rejected is not met in real
/// arithmetic, and `sure` and `inside` are only said of what is so. The bounds grow with the triangle's own size across
/// the ray and with the depth of its block. `docs/METHODS.md` derives the constants.
pub(crate) struct Triangles<V, const N: usize> {
    /// Lanes that the filter could not reject.
    pub candidates: u32,
    /// Those between whose edges the ray's line surely passes.
    pub sure: u32,
    middle: Middle<[f32; 1]>,
    meetings: Meetings<V>,
}

impl<V: Lanes<N>, const N: usize> Triangles<V, N> {
    /// The sure lanes whose real `t` surely is within the ray's limits.
    #[inline(always)]
    pub fn inside<S: Simd + Width<N, V = V>>(&self, s: S, ray: &PreparedRay) -> u32 {
        let [low, high] = ray.inner_depths(s);
        let window = self.middle.inner_window(Scalar, [[low], [high]]);
        self.sure & self.meetings.inside::<S, true, N>(s, splat::<S, N>(s, window))
    }

    /// The part of the ray in which it meets the plane of a sure lane, by `t` of the frame.
    #[inline(always)]
    pub fn part<S: Simd + Width<N, V = V>>(
        &self,
        s: S,
        ray: &PreparedRay,
        lane: u32,
    ) -> Interval<f32> {
        self.meetings.lane(s, lane).part(&self.middle, ray)
    }

    /// In memory, for those whom registers cannot be lent to: with room for all lanes of a block.
    #[inline(always)]
    pub fn stored(&self) -> Triangles<[f32; 16], 16> {
        let Triangles { candidates, sure, middle, meetings } = *self;
        Triangles { candidates, sure, middle, meetings: meetings.stored() }
    }
}

impl<V: Lanes<16>> Triangles<V, 16> {
    /// The lane of `lanes`, of which there is one at least, whose meeting comes first or nearly so.
    #[inline(always)]
    pub fn nearest<S: Simd + Width<16, V = V>>(&self, s: S, lanes: u32) -> u32 {
        // Above zero, as the order is that of bits.
        let ahead = Width::<16>::splat(s, 2.0 * self.middle.half);
        let depth = self.meetings.rise.div(self.meetings.total).add(ahead);
        Width::<16>::nearest(s, lanes, depth, &NUMBERS).1
    }

    /// The lanes whose meeting may come up to `t_bound`. Never fused, as this serves both precisions.
    #[inline(always)]
    pub fn up_to<S: Simd + Width<16, V = V>>(&self, s: S, ray: &PreparedRay, t_bound: f32) -> u32 {
        let window = self.middle.window(Scalar, limits(ray, t_bound));
        !self.meetings.outside::<S, false, 16>(s, splat::<S, 16>(s, window))
    }
}

impl<const N: usize> Triangles<[f32; N], N> {
    /// Back in registers.
    #[inline(always)]
    pub fn loaded<S: Width<N>>(&self, s: S) -> Triangles<S::V, N> {
        let Triangles { candidates, sure, middle, ref meetings } = *self;
        Triangles { candidates, sure, middle, meetings: meetings.loaded(s) }
    }
}

/// The filter for the `lanes` of a block, none from `N` on, all at once unless they are few for the backend; `None` if
/// nothing is left.
///
/// With `FREE`, the lanes that are left are none that the ray meets, but else may be others on another
/// backend; without, no operation is fused and every backend leaves the same ones.
///
/// Source: \[WBW13\] for the shear; the bounds are our own.
#[inline(always)]
pub(crate) fn triangles<S: Simd + Width<N>, const FREE: bool, const N: usize>(
    s: S,
    ray: &PreparedRay,
    t_bound: f32,
    block: &TriangleBlock,
    lanes: u32,
) -> Option<Triangles<<S as Width<N>>::V, N>> {
    let middle = Middle::of_one(ray, &block.aabb);
    if S::FEW > 0 && lanes.count_ones() <= S::FEW {
        let found = few(ray, middle, t_bound, block, lanes);
        return (found.candidates != 0).then(|| found.loaded(s));
    }
    let along = Along::new(s, ray, &block.vertices);
    let across = Across::new::<S, FREE, 16>(s, ray, &block.vertices, &along);
    let [a, b, c] = &block.corners;
    let corners = [
        corner::<S, N>(s, &across, a),
        corner::<S, N>(s, &across, b),
        corner::<S, N>(s, &across, c),
    ];
    // One at a time where lanes are not picked out of a block by one instruction.
    let [x, y, z] = if S::IN_HALVES {
        [corners[0].size(), corners[1].size(), corners[2].size()]
    } else {
        Width::<N>::of_corners(s, across.size(), [a, b, c])
    };
    let size = x.max(y).max(z);
    let error = AreaError::new(s, Width::<N>::splat(s, shared_error(ray, middle.deepest[0])));
    let areas = Areas::new::<FREE, N>(&corners, error.of::<S, FREE, N>(s, size));
    // Most leaves that a ray comes to it passes by.
    let lanes = lanes & !areas.outside(s);
    if lanes == 0 {
        return None;
    }
    let window = middle.window(Scalar, limits(ray, t_bound));
    let lanes = if middle.is_beyond(Scalar, window) == 0 { lanes } else { 0 };
    let from_middle = along.raw.sub(Width::<16>::splat(s, middle.raw));
    let depths = Width::<N>::of_corners(s, from_middle, [a, b, c]);
    let meetings = Meetings::new::<S, FREE, N>(s, middle.half, &areas, depths);
    let candidates = lanes & !meetings.outside::<S, FREE, N>(s, splat::<S, N>(s, window));
    let sure = candidates & areas.sure(s);
    (candidates != 0).then_some(Triangles { candidates, sure, middle, meetings })
}

/// The corners that `list` names out of the vertices of a block.
#[inline(always)]
fn corner<S: Width<16> + Width<N>, const N: usize>(
    s: S,
    vertices: &Across<<S as Width<16>>::V>,
    list: &[u8; 8],
) -> Across<<S as Width<N>>::V> {
    let Across { x, y } = *vertices;
    Across { x: Width::<N>::corners(s, x, list), y: Width::<N>::corners(s, y, list) }
}

/// Depths from the origin between which is all that is of interest.
#[inline(always)]
fn limits(ray: &PreparedRay, t_bound: f32) -> [[f32; 1]; 2] {
    [[ray.shear.low], [ray.shear.high(t_bound)]]
}

/// A window of one ray in all lanes.
#[inline(always)]
fn splat<S: Width<N>, const N: usize>(s: S, [[low], [high]]: [[f32; 1]; 2]) -> [S::V; 2] {
    [s.splat(low), s.splat(high)]
}

/// The filter, lane by lane.
#[inline(never)]
fn few<const N: usize>(
    ray: &PreparedRay,
    middle: Middle<[f32; 1]>,
    t_bound: f32,
    block: &TriangleBlock,
    lanes: u32,
) -> Triangles<[f32; N], N> {
    let mut found = Triangles { candidates: 0, sure: 0, middle, meetings: Meetings::NOWHERE };
    let window = middle.window(Scalar, limits(ray, t_bound));
    if middle.is_beyond(Scalar, window) != 0 {
        return found;
    }
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let One { areas, meetings } = One::new(ray, &middle, block.triangle(lane as usize));
        if (areas.outside(Scalar) | meetings.outside::<_, false, 1>(Scalar, window)) == 0 {
            found.candidates |= 1 << lane;
            found.sure |= areas.sure(Scalar) << lane;
            found.meetings.set(lane as usize % N, &meetings);
        }
    }
    found
}

/// The same filter for one lane after the other, in little code.
pub(crate) struct Single<'a> {
    ray: &'a PreparedRay,
    block: &'a TriangleBlock,
    middle: Middle<[f32; 1]>,
    window: [[f32; 1]; 2],
}

/// What is known of a lane that is left.
pub(crate) struct Left {
    /// See [`Triangles::sure`].
    pub sure: bool,
    meetings: Meetings<[f32; 1]>,
}

impl<'a> Single<'a> {
    /// For a block that may have something up to `t_bound`.
    #[inline(always)]
    pub fn new(ray: &'a PreparedRay, t_bound: f32, block: &'a TriangleBlock) -> Option<Self> {
        let middle = Middle::of_one(ray, &block.aabb);
        let window = middle.window(Scalar, limits(ray, t_bound));
        let is_beyond = middle.is_beyond(Scalar, window) != 0;
        (!is_beyond).then_some(Single { ray, block, middle, window })
    }

    /// `None` for a lane that is not left.
    #[inline(never)]
    pub fn look(&self, lane: u32) -> Option<Left> {
        let corners = self.block.triangle(lane as usize);
        let (corners, areas) = Corners::and_areas(self.ray, &self.middle, corners);
        if areas.outside(Scalar) != 0 {
            return None;
        }
        let meetings = corners.meetings(&self.middle, &areas);
        let outside = meetings.outside::<_, false, 1>(Scalar, self.window) != 0;
        (!outside).then_some(Left { sure: areas.sure(Scalar) != 0, meetings })
    }

    /// Whether a sure lane surely is met within the ray's limits.
    #[inline(never)]
    pub fn is_inside(&self, left: &Left) -> bool {
        let depths = self.ray.inner_depths(Scalar).map(|depth| [depth]);
        let window = self.middle.inner_window(Scalar, depths);
        left.sure && left.meetings.inside::<_, false, 1>(Scalar, window) != 0
    }
}

/// The corners of one triangle in the sheared space.
struct Corners {
    /// From the middle of a box that holds it.
    depths: [[f32; 1]; 3],
}

impl Corners {
    /// The corners, and the areas that the ray has over each.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn and_areas(
        ray: &PreparedRay,
        middle: &Middle<[f32; 1]>,
        corners: [[f32; 3]; 3],
    ) -> (Self, Areas<[f32; 1]>) {
        let corners = all_sheared(ray, &corners);
        let depths = corners.map(|v| [v.0.raw[0] - middle.raw]);
        let across = corners.map(|v| v.1);
        let [a, b, c] = [across[0].size(), across[1].size(), across[2].size()];
        let error = AreaError::new(Scalar, [shared_error(ray, middle.deepest[0])]);
        let error = error.of::<Scalar, false, 1>(Scalar, a.max(b).max(c));
        let areas = Areas::new::<false, 1>(&across, error);
        (Corners { depths }, areas)
    }

    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn meetings(&self, middle: &Middle<[f32; 1]>, areas: &Areas<[f32; 1]>) -> Meetings<[f32; 1]> {
        Meetings::new::<Scalar, false, 1>(Scalar, middle.half, areas, self.depths)
    }
}

/// What the filter computes of one triangle.
pub(super) struct One {
    pub areas: Areas<[f32; 1]>,
    pub meetings: Meetings<[f32; 1]>,
}

impl One {
    /// For a box that holds it.
    #[inline(always)]
    pub fn new(ray: &PreparedRay, middle: &Middle<[f32; 1]>, corners: [[f32; 3]; 3]) -> One {
        let (corners, areas) = Corners::and_areas(ray, middle, corners);
        let meetings = corners.meetings(middle, &areas);
        One { areas, meetings }
    }
}

/// A vertex in the sheared space.
type Sheared = (Along<[f32; 1]>, Across<[f32; 1]>);

/// The corners of a triangle there.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
pub(super) fn all_sheared(ray: &PreparedRay, [a, b, c]: &[[f32; 3]; 3]) -> [Sheared; 3] {
    [sheared(ray, a), sheared(ray, b), sheared(ray, c)]
}

#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
fn sheared(ray: &PreparedRay, vertex: &[f32; 3]) -> Sheared {
    let vertex = vertex.map(|x| [x]);
    let along = Along::new(Scalar, ray, &vertex);
    (along, Across::new::<Scalar, false, 1>(Scalar, ray, &vertex, &along))
}

/// The pieces of the filter for one lane, for the tests of its bounds.
#[cfg(test)]
pub(super) mod single {
    use super::super::detail::{TriangleDetail, detail};
    use super::{
        Across, Along, AreaError, Interval, Middle, One, PreparedRay, Scalar, limits, shared_error,
    };
    use crate::math::Aabb;
    use crate::math::rounding::UNIT32;

    pub struct Sheared {
        pub x: f32,
        pub y: f32,
        pub depth: f32,
    }

    pub fn sheared(ray: &PreparedRay, vertex: [f32; 3]) -> Sheared {
        let (Along { depth: [depth], .. }, Across { x: [x], y: [y], .. }) =
            super::sheared(ray, &vertex);
        Sheared { x: -x, y: -y, depth }
    }

    pub fn area(p: &Sheared, q: &Sheared) -> f32 {
        p.x * q.y - p.y * q.x
    }

    pub fn coordinate_error(ray: &PreparedRay, size: f32, deepest: f32) -> f32 {
        2.5 * UNIT32 * size + shared_error(ray, deepest)
    }

    pub fn area_error(ray: &PreparedRay, size: f32, deepest: f32) -> f32 {
        let error = AreaError::new(Scalar, [shared_error(ray, deepest)]);
        error.of::<Scalar, false, 1>(Scalar, [size])[0]
    }

    /// What the sieve computes of the depth of a triangle, and what it says of it.
    #[derive(Clone, Copy, Debug)]
    pub struct Sieved {
        pub rejected: bool,
        pub sure: bool,
        pub inside: bool,
        /// The depth of the middle, without rounding from the frame's zero.
        pub middle: f32,
        pub total: f32,
        pub rise: f32,
        pub error: f32,
        pub detail: TriangleDetail,
        /// Where it is met, if it is sure.
        pub part: Interval<f32>,
    }

    pub fn sieve(ray: &PreparedRay, t_bound: f32, corners: [[f32; 3]; 3]) -> Sieved {
        let middle = Middle::of_one(ray, &Aabb::around(&corners));
        let One { areas, meetings } = One::new(ray, &middle, corners);
        let outside =
            meetings.outside::<_, false, 1>(Scalar, middle.window(Scalar, limits(ray, t_bound)));
        let inner = middle.inner_window(Scalar, ray.inner_depths(Scalar).map(|depth| [depth]));
        let inside = meetings.inside::<_, false, 1>(Scalar, inner);
        let sure = areas.sure(Scalar) != 0;
        let ([total], [rise], [error]) = (meetings.total, meetings.rise, meetings.error);
        Sieved {
            rejected: areas.outside(Scalar) | outside != 0,
            sure,
            inside: sure && inside != 0,
            middle: middle.raw,
            total,
            rise,
            error,
            detail: detail(ray, corners),
            part: meetings.part(&middle, ray),
        }
    }
}
