//! The filter of triangles, in `f32`: it rejects what the ray surely does not meet.

use super::areas::{AreaError, Areas, Sheared, deepest, shared_error};
use super::meetings::{Depths, Meetings};
use crate::block::leaf::TriangleBlock;
use crate::math::Aabb;
use crate::ray::PreparedRay;
use crate::simd::{Lanes, Scalar, Simd, Width};

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
pub(super) struct One {
    pub areas: Areas<[f32; 1]>,
    pub meetings: Meetings<[f32; 1]>,
    pub first_depth: f32,
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
    pub fn alone(ray: &PreparedRay, depths: &Depths, corners: [[f32; 3]; 3]) -> One {
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

/// The pieces of the filter for one lane, for the tests of its bounds.
#[cfg(test)]
pub(super) mod single {
    use super::super::detail::{TriangleDetail, detail};
    use super::super::meetings;
    use super::{AreaError, Depths, One, PreparedRay, Scalar, shared_error};
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
        2.5 * UNIT32 * size + shared_error(ray, deepest)
    }

    pub fn area_error(ray: &PreparedRay, size: f32, deepest: f32) -> f32 {
        let error = AreaError::new(shared_error(ray, deepest));
        error.of::<Scalar, false, 1>(Scalar, [size])[0]
    }

    pub fn rise_error(area_error: f32, span: f32, depth: f32, size_of_total: f32) -> f32 {
        meetings::rise_error(Scalar, [area_error], [span], [depth], [size_of_total])[0]
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
            detail: detail(ray, corners),
        })
    }
}
