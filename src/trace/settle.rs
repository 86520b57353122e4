//! What rays that are asked together surely meet, settled without a query for each.

use super::{AnyHit, ClosestHit, Name, Question, name};
use crate::block::Block;
use crate::block::leaf::{KIND_TRIANGLES, LeafRef, Place};
use crate::math::Bits;
use crate::query::{Exact, SureMeetings};
use crate::ray::{Abreast, Hit, Interval, NONE, PreparedRay};
use crate::simd::Simd;

/// What each of sixteen rays meets before all others: a lane of a leaf block.
#[derive(Clone, Copy)]
pub(crate) struct Firsts {
    /// The block's number and kind, as in a [`LeafRef`].
    pub blocks: [u32; 16],
    /// One bit.
    pub lanes: [u32; 16],
}

impl Firsts {
    pub const NONE: Self = Firsts { blocks: [0; 16], lanes: [0; 16] };

    /// What ray `i` meets.
    #[inline(always)]
    pub fn leaf(&self, i: usize) -> LeafRef {
        LeafRef { block: self.blocks[i % 16], lanes: self.lanes[i % 16] }
    }
}

/// The triangle in the one lane of `leaf`.
#[inline(always)]
fn met_triangle(block: &Block, leaf: LeafRef) -> Option<(Place, [[f32; 3]; 3])> {
    let (number, lane) = (leaf.number(), leaf.lanes.trailing_zeros());
    let triangles = block.triangle_blocks.get(number).filter(|_| leaf.kind() == KIND_TRIANGLES)?;
    let entry = triangles.first.wrapping_add(lane);
    Some((Place { block: number as u32, lane, entry }, triangles.triangle(lane as usize)))
}

/// Writes a triangle into the lanes from `first` on: all that follow may meet the same one.
#[inline(always)]
fn fill_from(first: usize, columns: &mut [[f32; 8]; 9], triangle: &[[f32; 3]; 3]) {
    for (column, x) in columns.iter_mut().zip(triangle.as_flattened()) {
        for (lane, place) in column.iter_mut().enumerate() {
            *place = if lane < first { *place } else { *x };
        }
    }
}

/// A question that rays can ask together, by what is sure of each without a query.
pub(crate) trait Together<'m>: Question<'m> + Copy {
    /// Whether it leaves no primitive out.
    fn sees_all(&self) -> bool;

    /// Answers by `write` for rays of which it is sure what they meet before all others, within their limits: those of
    /// `rays` in the lanes of `lanes`. The lanes of those for which that takes more than a look.
    fn settle<S: Simd>(
        s: S,
        block: &Block,
        rays: &Abreast,
        firsts: &Firsts,
        lanes: u32,
        write: impl FnMut(usize, Self::Answer),
    ) -> u32;

    /// What a query was offered before all else, and the `t` between which it is met.
    fn best(query: &mut Self::Query, ray: &PreparedRay) -> Option<(LeafRef, Interval<f64>)>;
}

impl<'m, const MEMORY: usize> Together<'m> for ClosestHit<Exact, (), MEMORY> {
    #[inline(always)]
    fn sees_all(&self) -> bool {
        self.choice.sees_all()
    }

    #[inline(always)]
    fn settle<S: Simd>(
        s: S,
        block: &Block,
        rays: &Abreast,
        firsts: &Firsts,
        lanes: u32,
        mut write: impl FnMut(usize, Option<Hit>),
    ) -> u32 {
        let mut unsettled = lanes;
        for half in [0, 8] {
            if lanes >> half & 0xFF == 0 {
                continue;
            }
            let mut corners = [[0.0; 8]; 9];
            let mut named = [None; 8];
            let mut last = None;
            for i in Bits(lanes >> half & 0xFF) {
                let leaf = firsts.leaf(half + i);
                let name = match last {
                    Some((known, name)) if known == leaf => name,
                    _ => {
                        let Some((place, triangle)) = met_triangle(block, leaf) else { continue };
                        fill_from(i, &mut corners, &triangle);
                        let name = name(block, place);
                        last = Some((leaf, name));
                        name
                    }
                };
                named[i % 8] = Some(name);
            }
            let SureMeetings { sure, t, weights: [u, v] } =
                Exact::of_sure(s, rays.lines(half), &corners);
            for (i, name) in named.into_iter().enumerate() {
                if let Some(Name { prim, geometry }) = name
                    && sure >> i & 1 == 1
                {
                    let hit = Hit { t: t[i], u: u[i], v: v[i], prim, geometry, instance: NONE };
                    write(half + i, Some(hit));
                    unsettled &= !(1 << (half + i));
                }
            }
        }
        unsettled
    }

    fn best(query: &mut Self::Query, ray: &PreparedRay) -> Option<(LeafRef, Interval<f64>)> {
        query.settle(ray);
        query.best.as_ref().map(|met| (met.leaf(), met.interval()))
    }
}

impl<'m> Together<'m> for AnyHit<Exact, ()> {
    #[inline(always)]
    fn sees_all(&self) -> bool {
        self.choice.sees_all()
    }

    #[inline(always)]
    fn settle<S: Simd>(
        _: S,
        _: &Block,
        _: &Abreast,
        _: &Firsts,
        lanes: u32,
        mut write: impl FnMut(usize, bool),
    ) -> u32 {
        for lane in Bits(lanes) {
            write(lane, true);
        }
        0
    }

    fn best(_: &mut Self::Query, _: &PreparedRay) -> Option<(LeafRef, Interval<f64>)> {
        None
    }
}
