//! Decisions as in real arithmetic: intervals in `f64` first, then numbers without error.

use core::cmp::Ordering;

use super::{Decide, Meets, SphereLane, TriangleLane, Watch, clamped_weights};
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, LeafRef, Place, block_ref};
use crate::exact::{self, Distance, Line, Meeting};
use crate::interval::plane::{PlaneMeeting, minus};
use crate::interval::triangle::{Feature, TriangleMeeting};
use crate::interval::{sphere, triangle};
use crate::ray::{Interval, PreparedRay};
use crate::simd::{Doubles, Lanes, SMALL, Simd, Width};

/// Hit or miss, the primitive and the order of real arithmetic; `t` correctly rounded.
#[derive(Clone, Copy)]
pub(crate) struct Exact;

/// A meeting, and an interval that holds its real `t`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExactMet {
    t: f64,
    /// A bound on the error of `t`.
    t_error: f64,
    /// Of the second and the third vertex of a triangle.
    weights: [f32; 2],
    /// What is met, from which the real `t` follows.
    meeting: Meeting,
    /// Where on a triangle.
    feature: Feature,
    place: Place,
    front: bool,
    skippable: bool,
}

impl Meets for ExactMet {
    fn place(&self) -> Place {
        self.place
    }

    fn front(&self) -> Option<bool> {
        Some(self.front)
    }

    fn root(&self) -> usize {
        match self.meeting {
            Meeting::Triangle(_) => 0,
            Meeting::Sphere { root, .. } => root,
        }
    }

    fn skippable(&self) -> bool {
        self.skippable
    }
}

impl ExactMet {
    /// Floats between which the real `t` lies.
    ///
    /// `t_error` grants at least one rounding of `t` more than the error needs, which covers the
    /// rounding of these two sums; a hundredth of it covers its own arithmetic.
    #[inline(always)]
    pub fn interval(&self) -> Interval<f64> {
        interval(self.t, self.t_error)
    }

    /// The order of two meetings on different lines, this one's and the other's, in real arithmetic.
    #[cold]
    #[inline(never)]
    pub fn compare(&self, line: &Line, other: &ExactMet, other_line: &Line) -> Ordering {
        let mine = Distance::new(line, &self.meeting);
        let others = Distance::new(other_line, &other.meeting);
        // Both exist but for blocks of foreign bytes.
        mine.zip(others).map_or(Ordering::Equal, |(mine, others)| mine.compare(&others))
    }

    /// Where what is met is stored, as a leaf of one lane.
    pub fn leaf(&self) -> LeafRef {
        let kind = match self.meeting {
            Meeting::Triangle(_) => KIND_TRIANGLES,
            Meeting::Sphere { .. } => KIND_SPHERES,
        };
        LeafRef { block: block_ref(kind, self.place.block), lanes: 1 << self.place.lane }
    }

    /// Whether this comes before `best`, whose interval overlaps with this one's.
    #[cold]
    #[inline(never)]
    fn is_really_before(
        &self,
        ray: &PreparedRay,
        best: &ExactMet,
        prim_ids: &[u32],
        memory: Option<&mut ExactMemory>,
        watch: &mut impl Watch,
    ) -> bool {
        let first = self.place.prim(prim_ids) < best.place.prim(prim_ids);
        // Neighbours that share what the ray passes through, and doubled surfaces.
        if self.feature.is_same(&best.feature) || self.meeting.surely_equal(&best.meeting) {
            return first;
        }
        watch.exact();
        let line = ray.line();
        let order = match memory {
            Some(memory) if !SMALL => Distance::new(&line, &self.meeting)
                .zip(memory.t_of(ray, best))
                .map(|(mine, best)| mine.compare(best)),
            _ => exact::order(&line, &self.meeting, &best.meeting),
        };
        match order {
            Some(Ordering::Less) => true,
            Some(Ordering::Greater) => false,
            Some(Ordering::Equal) => first,
            // Neither number exists: only blocks of foreign bytes come here.
            None => self.t < best.t,
        }
    }

    /// The nearest float to the real `t`, in real arithmetic.
    #[cold]
    #[inline(never)]
    fn rounded(&self, ray: &PreparedRay) -> f32 {
        Distance::new(&ray.line(), &self.meeting).map_or(self.t as f32, |t| t.round())
    }
}

/// The real `t` of the best meeting, once a comparison has needed it.
#[derive(Default)]
pub(crate) struct ExactMemory {
    /// Whose it is.
    of: Option<(Place, usize)>,
    t: Option<Distance>,
}

impl ExactMemory {
    fn t_of(&mut self, ray: &PreparedRay, met: &ExactMet) -> Option<&Distance> {
        let key = (met.place, met.root());
        if self.of != Some(key) {
            *self = ExactMemory { of: Some(key), t: Distance::new(&ray.line(), &met.meeting) };
        }
        self.t.as_ref()
    }
}

/// What [`Exact::of_sure`] finds.
pub(crate) struct SureMeetings {
    /// One bit for each of which the rest is what is answered.
    pub sure: u32,
    pub t: [f32; 8],
    pub weights: [[f32; 8]; 2],
}

impl Exact {
    /// Of eight rays whose lines surely pass between the edges of a triangle, those that surely meet it within their limits,
    /// and those that surely do not, one bit each.
    #[inline(always)]
    pub fn within_limits<S: Simd>(
        s: S,
        line: [&[f32; 8]; 6],
        [t_min, t_max]: [&[f32; 8]; 2],
        corners: &[[f32; 3]; 3],
    ) -> [u32; 2] {
        let mut columns = [[0.0; 8]; 9];
        for (column, x) in columns.iter_mut().zip(corners.as_flattened()) {
            *column = [*x; 8];
        }
        let PlaneMeeting { t, t_error, clear, .. } = planes(s, line, &columns);
        let margin = t_error.times(MARGIN);
        let (near, far) = (t.sub(margin), t.add(margin));
        let (t_min, t_max) = (s.widened(t_min), s.widened(t_max));
        let inside = !(near.less(t_min) | t_max.less(far));
        [clear & inside, clear & (far.less(t_min) | t_max.less(near))]
    }

    /// What is answered of triangles that rays surely meet within their limits, eight of each: origin and direction of the
    /// rays, and the coordinates of the triangles' corners, side by side.
    #[inline(always)]
    pub fn of_sure<S: Simd>(s: S, line: [&[f32; 8]; 6], corners: &[[f32; 8]; 9]) -> SureMeetings {
        let PlaneMeeting { t, t_error, weights, clear, .. } = planes(s, line, corners);
        let margin = t_error.times(MARGIN);
        let nearest = s.load(&s.narrowed(t));
        let (near, far) = (s.load(&s.narrowed(t.sub(margin))), s.load(&s.narrowed(t.add(margin))));
        let (zero, one) = (Width::<8>::splat(s, 0.0), Width::<8>::splat(s, 1.0));
        let u = s.load(&s.narrowed(weights[0])).max(zero).min(one).add(zero);
        let v = s.load(&s.narrowed(weights[1])).max(zero).min(one.sub(u)).add(zero);
        let mut met = SureMeetings { sure: clear, t: [0.0; 8], weights: [[0.0; 8]; 2] };
        // Rounding keeps order: if both ends round to the float of the middle, so does the real `t` between them.
        met.sure &= nearest.less_or_equal(near) & far.less_or_equal(nearest);
        nearest.add(zero).store(&mut met.t);
        u.store(&mut met.weights[0]);
        v.store(&mut met.weights[1]);
        met
    }

    /// The meetings with a sphere stored at `place` that lie within the limits, entering and leaving.
    #[inline(never)]
    pub fn roots(
        ray: &PreparedRay,
        (centre, radius): ([f32; 3], f32),
        place: Place,
        watch: &mut impl Watch,
    ) -> [Option<ExactMet>; 2] {
        watch.interval();
        let Some(both) = sphere::meet(&ray.line(), centre, radius) else { return [None; 2] };
        if both.exact {
            watch.exact();
        }
        let ([near, far], [near_error, far_error]) = (both.t, both.t_error);
        [(0, near, near_error), (1, far, far_error)].map(|(root, t, t_error)| {
            let met = ExactMet {
                t,
                t_error,
                weights: [0.0; 2],
                meeting: Meeting::Sphere { centre, radius, root },
                feature: Feature::Face,
                place,
                front: root == 0,
                // A line that only touches meets front and back in one point.
                skippable: both.touches || root == both.nearest,
            };
            let in_doubt = in_doubt(ray, interval(t, t_error))?;
            (!in_doubt || Exact::is_met(ray, &met, watch)).then_some(met)
        })
    }
}

impl Decide for Exact {
    type Met = ExactMet;
    const ANY_BOXES: bool = true;
    type Memory = ExactMemory;

    #[inline(always)]
    fn sure<S: Simd>(s: S, ray: &PreparedRay, lane: &TriangleLane) -> Option<(f32, [f32; 2])> {
        let PlaneMeeting { t, t_error, weights: [u, v], clear, .. } =
            PlaneMeeting::by(s, &ray.given.rows(), &lane.corners().map(|[x, y, z]| [x, y, z, 0.0]));
        let t = surely_rounded(interval(t, t_error), t).filter(|_| clear != 0)?;
        Some((t, clamped_weights([u as f32, v as f32])))
    }

    /// In line where room is no matter.
    #[cfg_attr(target_pointer_width = "64", inline(always))]
    #[cfg_attr(not(target_pointer_width = "64"), inline(never))]
    fn likely(
        ray: &PreparedRay,
        lane: &TriangleLane,
        watch: &mut impl Watch,
    ) -> Option<(ExactMet, bool)> {
        watch.interval();
        let clear = match lane.sure {
            true if !SMALL => triangle::clear_plane(&ray.line(), &lane.corners()),
            _ => None,
        };
        let (met, feature) = match clear {
            Some(met) => (met, Feature::Face),
            None => any_meeting(ray, *lane)?,
        };
        if met.exact {
            watch.exact();
        }
        let in_doubt = in_doubt(ray, interval(met.t, met.t_error))?;
        let met = ExactMet {
            t: met.t,
            t_error: met.t_error,
            weights: [met.weights[0] as f32, met.weights[1] as f32],
            meeting: Meeting::Triangle(lane.corners()),
            feature,
            place: lane.place,
            front: met.front,
            skippable: true,
        };
        Some((met, in_doubt))
    }

    #[inline(always)]
    fn is_met(ray: &PreparedRay, met: &ExactMet, watch: &mut impl Watch) -> bool {
        watch.exact();
        // What only a copy of is lent out of line can stay in registers, and what is written to memory by parts is slow to
        // read as a whole. Where room is scarce there is no copy, here and below.
        let copy = met.meeting;
        is_really_within(ray, if SMALL { &met.meeting } else { &copy })
    }

    fn sphere(
        ray: &PreparedRay,
        lane: &SphereLane,
        watch: &mut impl Watch,
    ) -> [Option<ExactMet>; 2] {
        Exact::roots(ray, (lane.centre, lane.radius), lane.place, watch)
    }

    #[inline(always)]
    fn is_before(
        ray: &PreparedRay,
        met: &ExactMet,
        best: &ExactMet,
        prim_ids: &[u32],
        memory: Option<&mut ExactMemory>,
        watch: &mut impl Watch,
    ) -> bool {
        let (a, b) = (met.interval(), best.interval());
        if a.far < b.near {
            return true;
        }
        if b.far < a.near {
            return false;
        }
        let copy = *met;
        let met = if SMALL { met } else { &copy };
        met.is_really_before(ray, best, prim_ids, memory, watch)
    }

    #[inline(always)]
    fn is_surely_after(lane: &TriangleLane, best: &ExactMet, prim_ids: &[u32]) -> bool {
        // Cheaper than finding out whether it is met, if that is not clear already: neighbours at a vertex,
        // and doubled surfaces.
        !lane.sure
            && best.place.prim(prim_ids) < lane.place.prim(prim_ids)
            && (best.feature.is_part_of(&lane.corners())
                || best.meeting.surely_equal(&Meeting::Triangle(lane.corners())))
    }

    #[inline(always)]
    fn t_bound(ray: &PreparedRay, met: &ExactMet) -> f32 {
        ray.t_above(met.t, 1.01 * met.t_error)
    }

    #[inline(always)]
    fn t(ray: &PreparedRay, met: &ExactMet, watch: &mut impl Watch) -> f32 {
        surely_rounded(met.interval(), met.t).unwrap_or_else(|| {
            watch.rounding();
            // Adding +0 turns -0 into +0.
            met.rounded(ray) + 0.0
        })
    }

    #[inline(always)]
    fn weights(met: &ExactMet) -> [f32; 2] {
        clamped_weights(met.weights)
    }
}

/// Whether the real `t` of a meeting is within the ray's limits, in real arithmetic.
#[cold]
#[inline(never)]
fn is_really_within(ray: &PreparedRay, meeting: &Meeting) -> bool {
    exact::is_within(&ray.line(), meeting, [ray.given.t_min, ray.given.t_max])
}

/// The meeting with a triangle, also where the line passes its edges closely or hardly crosses its plane.
#[cfg_attr(target_pointer_width = "64", inline(never))]
#[cfg_attr(not(target_pointer_width = "64"), inline(always))]
fn any_meeting(ray: &PreparedRay, lane: TriangleLane) -> Option<(TriangleMeeting, Feature)> {
    let (line, corners) = (ray.line(), lane.corners());
    match lane.sure {
        true => Some((triangle::plane(&line, &corners)?, Feature::Face)),
        false => triangle::meet(&line, &corners),
    }
}

/// Where eight lines meet the planes of as many triangles.
#[inline(always)]
fn planes<S: Simd>(
    s: S,
    [ox, oy, oz, dx, dy, dz]: [&[f32; 8]; 6],
    [ax, ay, az, bx, by, bz, cx, cy, cz]: &[[f32; 8]; 9],
) -> PlaneMeeting<S::Doubles> {
    let origin = [s.widened(ox), s.widened(oy), s.widened(oz)];
    let direction = [s.widened(dx), s.widened(dy), s.widened(dz)];
    let a = [s.widened(ax), s.widened(ay), s.widened(az)];
    let b = [s.widened(bx), s.widened(by), s.widened(bz)];
    let c = [s.widened(cx), s.widened(cy), s.widened(cz)];
    PlaneMeeting::new(direction, minus(a, origin), [minus(b, a), minus(c, a)])
}

/// A part of the error more, for the arithmetic of the error.
const MARGIN: f64 = 1.01;

/// See [`ExactMet::interval`].
#[inline(always)]
fn interval(t: f64, t_error: f64) -> Interval<f64> {
    let margin = MARGIN * t_error;
    Interval { near: t - margin, far: t + margin }
}

/// The float that all numbers of an interval around `t` are rounded to, if there is one.
#[inline(always)]
fn surely_rounded(Interval { near, far }: Interval<f64>, t: f64) -> Option<f32> {
    let nearest = t as f32;
    // Adding +0 turns -0 into +0.
    (near as f32 == nearest && far as f32 == nearest).then_some(nearest + 0.0)
}

/// Whether it takes real arithmetic to know if what lies in an interval is within the ray's limits; `None` if it surely is not.
#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
fn in_doubt(ray: &PreparedRay, part: Interval<f64>) -> Option<bool> {
    let (t_min, t_max) = (f64::from(ray.given.t_min), f64::from(ray.given.t_max));
    if part.far < t_min || part.near > t_max {
        return None;
    }
    Some(!(part.near >= t_min && part.far <= t_max))
}
