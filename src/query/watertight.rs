//! Decisions in `f32` alone.

use super::{Decide, Meets, SphereLane, TriangleLane, Watch, clamped_weights};
use crate::block::leaf::Place;
use crate::math::float::limited;
use crate::ray::PreparedRay;
use crate::sieve;

/// Nothing that the ray hits is missed: what the filter could not reject is met. Of two meetings
/// the one with the smaller computed `t` comes first.
#[derive(Clone, Copy)]
pub(crate) struct Watertight;

/// A meeting with its `t` in the frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WatertightMet {
    t: f32,
    weights: [f32; 2],
    place: Place,
    front: Option<bool>,
    root: usize,
    skippable: bool,
}

impl Meets for WatertightMet {
    fn place(&self) -> Place {
        self.place
    }

    fn front(&self) -> Option<bool> {
        self.front
    }

    fn root(&self) -> usize {
        self.root
    }

    fn skippable(&self) -> bool {
        self.skippable
    }
}

impl Decide for Watertight {
    type Met = WatertightMet;
    const ANY_BOXES: bool = false;
    type Memory = ();

    /// In line where room is no matter.
    #[cfg_attr(target_pointer_width = "64", inline(always))]
    fn likely(
        ray: &PreparedRay,
        lane: &TriangleLane,
        _: &mut impl Watch,
    ) -> Option<(WatertightMet, bool)> {
        let detail = sieve::detail(ray, lane.corners());
        if detail.t + detail.t_error < ray.t_min || detail.t - detail.t_error > ray.t_max {
            return None;
        }
        let met = WatertightMet {
            t: limited(detail.t, ray.t_min, ray.t_max),
            weights: detail.weights,
            place: lane.place,
            front: detail.front,
            root: 0,
            skippable: true,
        };
        Some((met, false))
    }

    fn sphere(
        ray: &PreparedRay,
        lane: &SphereLane,
        _: &mut impl Watch,
    ) -> [Option<WatertightMet>; 2] {
        let nearest = usize::from(lane.detail.far_is_nearest);
        let ([near, far], slack) = (lane.detail.t, lane.detail.t_error);
        [(0, near), (1, far)].map(|(root, t)| {
            // Written so that a NaN stays.
            if t + slack < ray.t_min || t - slack > ray.t_max {
                return None;
            }
            Some(WatertightMet {
                t: limited(t, ray.t_min, ray.t_max),
                weights: [0.0; 2],
                place: lane.place,
                front: Some(root == 0),
                root,
                // Roots that round to one may still be two, of which one stays.
                skippable: root == nearest,
            })
        })
    }

    fn is_before(
        _: &PreparedRay,
        met: &WatertightMet,
        best: &WatertightMet,
        prim_ids: &[u32],
        _: Option<&mut ()>,
        _: &mut impl Watch,
    ) -> bool {
        met.t < best.t || (met.t == best.t && met.place.prim(prim_ids) < best.place.prim(prim_ids))
    }

    fn is_surely_after(_: &TriangleLane, _: &WatertightMet, _: &[u32]) -> bool {
        false
    }

    fn t_bound(_: &PreparedRay, met: &WatertightMet) -> f32 {
        met.t
    }

    fn t(ray: &PreparedRay, met: &WatertightMet, _: &mut impl Watch) -> f32 {
        // Out of the frame; what rounding at the limits moved goes back between them.
        limited(ray.given_t(met.t), ray.given.t_min, ray.given.t_max) + 0.0
    }

    fn weights(met: &WatertightMet) -> [f32; 2] {
        clamped_weights(met.weights)
    }
}
