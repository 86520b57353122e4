//! raykern as C sees it: what a call costs on top of the ray.

use anyhow::Result;
use raykern::{Hit, Layout, OwnedAccel, Ray};
use raykern_harness::model::Model;

use crate::lineup::{Class, Lineup, Tracer};
use crate::ours::{bvh, each};
use crate::watch::Watch;

// The functions of include/raykern.h; they are part of the crate with its feature `capi`.
unsafe extern "C" {
    fn rt_intersect(accel: *const u8, ray: *const Ray, hit: *mut Hit) -> bool;
    fn rt_occluded(accel: *const u8, ray: *const Ray) -> bool;
}

/// Adds the C face over a BVH of its own.
pub fn join(lineup: &mut Lineup, model: &Model) -> Result<()> {
    lineup.add("bvh through C", Class::Face, Face(bvh(model, Layout::Automatic)?));
    Ok(())
}

struct Face(OwnedAccel<'static>);

impl Tracer for Face {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        let accel = self.0.accel().block().as_ptr();
        watch.time(|| {
            each(rays, hits, |ray| {
                let mut hit = Hit::MISS;
                // SAFETY: the block lives as long as `self`; the others are references.
                unsafe { rt_intersect(accel, ray, &mut hit) };
                hit
            });
        });
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        let accel = self.0.accel().block().as_ptr();
        // SAFETY: as above.
        watch.time(|| each(rays, occluded, |ray| unsafe { rt_occluded(accel, ray) }));
    }
}
