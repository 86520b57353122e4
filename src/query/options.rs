//! What one query may leave out, and how right it must be.

use crate::block::leaf::Place;
use crate::block::{Finished, Geometry};
use crate::ray::NONE;

/// Which of two sides of a surface a ray may meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Facing {
    /// Both sides.
    #[default]
    Both,
    /// Only the front: the side from which a triangle's vertices run counter-clockwise, and the
    /// outside of a sphere.
    Front,
    /// Only the back.
    Back,
}

/// How right an answer must be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Hit or miss, which primitive and which order as in real arithmetic; `t` is the nearest float;
    /// the same bits from every structure and on every machine.
    #[default]
    Exact,
    /// In `f32` alone, for the last per cent of speed and for processors without `f64`.
    ///
    /// Nothing is missed: if the ray meets a triangle or a sphere within its limits in real arithmetic,
    /// the answer is a hit, for any finite input and from every structure. More may be hit than is
    /// there, but only what the ray passes within a few units of `f32` of its distance and extent: a
    /// triangle if no edge has the ray farther outside its line than that, a sphere if the line is
    /// that close to it. A ray in a triangle's plane counts as meeting it, and beside it too.
    ///
    /// `t` lies within the ray's limits; for a triangle it lies within the depths of its vertices
    /// as well, and is as close to the real one as the angle allows. `docs/METHODS.md` states the
    /// bounds. The smaller computed `t` wins.
    ///
    /// A block and a ray give the same bits on every processor, as no operation is fused; list, grid
    /// and BVH over one scene may answer differently. The side of a triangle seen edge-on within
    /// rounding is a guess, which [`Facing`] other than `Both` may then miss; likewise which root of a
    /// sphere is the nearest, which `skip` leaves out, when both are equally near.
    Watertight,
}

/// A primitive by its numbers, as they stand in a [`Hit`](crate::Hit).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimId {
    /// The number within the geometry.
    pub prim: u32,
    /// The mesh, or the number of meshes plus the sphere set.
    pub geometry: u32,
    /// The instance, [`NONE`](crate::NONE) outside instances.
    pub instance: u32,
}

/// What one query may leave out. The default leaves out nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryOptions {
    /// How right the answer must be.
    pub precision: Precision,
    /// A geometry is seen when its mask and this one share a bit, or when either is zero.
    pub mask: u32,
    /// The sides of surfaces that count.
    pub facing: Facing,
    /// A primitive to leave out, such as the one the ray starts on. Of a sphere only the root
    /// nearest to `t = 0` is left out, so that a ray refracted into it still leaves it.
    pub skip: Option<PrimId>,
}

/// What a query leaves out, in flat numbers.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct Choice {
    mask: u32,
    facing: Facing,
    skip: u32,
}

impl Choice {
    /// Leaves out nothing.
    pub const EVERYTHING: Self = Choice { mask: 0, facing: Facing::Both, skip: NONE };

    /// Whether nothing is left out.
    #[inline(always)]
    pub fn sees_all(&self) -> bool {
        // In one number, as each ray asks.
        self.mask | !self.skip | self.facing as u32 == 0
    }

    /// What `options` leave of the primitives with these geometries in an instance, or outside instances ([`NONE`]).
    #[inline(always)]
    pub fn new(
        options: &QueryOptions,
        instance: u32,
        geometries: &[Geometry],
        prim_limit: u32,
    ) -> Self {
        let skip = options.skip.filter(|id| id.instance == instance);
        let skip = skip.and_then(|id| flat_number(&id, geometries, prim_limit));
        let QueryOptions { mask, facing, .. } = *options;
        Choice { mask, facing, skip: skip.unwrap_or(NONE) }
    }
}

/// A choice among the primitives of a block.
///
/// In C's order: in another one a compiler made room for queries twice, and copied all of it.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct Filter<'m> {
    /// Its parts are found when they are asked for, which is rare.
    pub block: Finished<'m>,
    choice: Choice,
}

impl<'m> Filter<'m> {
    #[inline(always)]
    pub fn new(choice: Choice, block: Finished<'m>) -> Self {
        Filter { block, choice }
    }

    /// What the primitives of the block are called.
    #[inline(always)]
    pub fn prim_ids(&self) -> &'m [u32] {
        self.block.parts().prim_ids
    }

    /// Whether every meeting counts.
    #[inline(always)]
    pub fn sees_all(&self) -> bool {
        self.choice.sees_all()
    }

    /// Whether a meeting with the primitive stored there counts; only those that are `skippable` are
    /// skipped.
    #[inline(always)]
    pub fn sees(&self, place: Place, skippable: bool) -> bool {
        let sees_all = self.choice.mask == 0 && (self.choice.skip == NONE || !skippable);
        sees_all || self.sees_prim(place.prim(self.prim_ids()), skippable)
    }

    #[inline(never)]
    fn sees_prim(&self, prim: u32, skippable: bool) -> bool {
        !(skippable && prim == self.choice.skip) && (self.choice.mask == 0 || self.mask_sees(prim))
    }

    /// Whether meetings with either side count.
    #[inline(always)]
    pub fn both_sides(&self) -> bool {
        self.choice.facing == Facing::Both
    }

    /// Whether a meeting with this side counts; an unknown one does.
    #[inline(always)]
    pub fn faces(&self, front: Option<bool>) -> bool {
        match self.choice.facing {
            Facing::Both => true,
            Facing::Front => front != Some(false),
            Facing::Back => front != Some(true),
        }
    }

    fn mask_sees(&self, prim: u32) -> bool {
        let mask = geometry_of(prim, self.block.parts().geometries).map_or(0, |(_, g)| g.mask);
        shares_bit(mask, self.choice.mask)
    }
}

/// Whether what has the one mask is seen by the other: they share a bit, or one is zero.
pub(crate) fn shares_bit(mask: u32, of_query: u32) -> bool {
    mask == 0 || of_query == 0 || mask & of_query != 0
}

/// The number of the geometry that holds the flat number `prim`, and the geometry.
#[inline]
pub(crate) fn geometry_of(prim: u32, geometries: &[Geometry]) -> Option<(u32, &Geometry)> {
    // Mostly there is one.
    if let [only] = geometries {
        return (only.first <= prim).then_some((0, only));
    }
    // Empty geometries share their first number with the next one; the last of them holds it.
    let after = geometries.partition_point(|g| g.first <= prim);
    let number = after.checked_sub(1)?;
    Some((number as u32, geometries.get(number)?))
}

/// The flat number of a primitive, or `None` when it does not exist; its instance is not looked at.
pub(crate) fn flat_number(id: &PrimId, geometries: &[Geometry], prim_limit: u32) -> Option<u32> {
    let g = id.geometry as usize;
    let end = geometries.get(g.checked_add(1)?).map_or(prim_limit, |next| next.first);
    let prim = geometries.get(g)?.first.checked_add(id.prim)?;
    (prim < end).then_some(prim)
}
