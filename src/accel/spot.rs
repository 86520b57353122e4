//! A known hit, found again.

use crate::block::{Block, Finished};
use crate::query::{Decide, Exact, Meets, PrimId, Wanted, Watertight, flat_number};
use crate::ray::{Hit, Ray};
use crate::surface::Spot;
use crate::trace::{self, LocateHit};

/// The point of a hit outside instances, in either precision.
pub(super) fn spot_of(block: Finished, ray: &Ray, hit: &Hit) -> Option<Spot> {
    let Hit { prim, geometry, instance, .. } = *hit;
    let id = PrimId { prim, geometry, instance };
    let Block { geometries, header, .. } = block.parts();
    let number = flat_number(&id, geometries, header.prim_limit)?;
    spot_in::<Exact>(block, ray, number, hit.t)
        .or_else(|| spot_in::<Watertight>(block, ray, number, hit.t))
}

/// The point of the hit with this flat number and `t` in one precision.
fn spot_in<D: Decide>(whole: Finished, ray: &Ray, number: u32, t: f32) -> Option<Spot> {
    let found =
        trace::ask(whole, ray, LocateHit::<D>::new(Wanted { prim: number, t, root: None }))?;
    let line = ray.line();
    let (block, lane) = (found.place().block as usize, found.place().lane as usize);
    let Block { header, triangle_blocks, sphere_blocks, .. } = whole.parts();
    if number < header.triangle_limit {
        return Some(Spot::on_triangle(&line, triangle_blocks.get(block)?.triangle(lane)));
    }
    let (centre, radius) = sphere_blocks.get(block)?.sphere(lane);
    Some(Spot::on_sphere(&line, centre, radius, found.root()))
}
