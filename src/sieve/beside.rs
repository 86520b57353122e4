//! The triangles of a block that lie beside rays, all of them at once.

use super::areas::Across;
use crate::block::leaf::TriangleBlock;
use crate::math::rounding::UNIT32;
use crate::ray::{Sixteen, Spread, TINY};
use crate::simd::{Lanes, Simd, Width, mul_sub};

/// What x and y of a sheared vertex are between for rays within a [`Spread`], minus them: the ends of intervals.
struct Span<V> {
    least: Across<V>,
    most: Across<V>,
    /// What any of them may be off.
    error: V,
}

impl<V: Lanes<16>> Span<V> {
    /// For vertices along the axes x, y and depth of the rays' frame.
    ///
    /// By the operations that are done for each ray: rounding does not change the order of what they give.
    #[inline(always)]
    fn new<S: Width<16, V = V>>(s: S, spread: &Spread, [xs, ys, depths]: &[Sixteen; 3]) -> Self {
        let [x, y, z] = &spread.origin;
        let depths = s.load(depths);
        let depths = [depths.sub(s.splat(z[1])), depths.sub(s.splat(z[0]))];
        let [x_least, x_most] = between(s, s.load(xs), x, depths, &spread.slope[0]);
        let [y_least, y_most] = between(s, s.load(ys), y, depths, &spread.slope[1]);
        let (least, most) = (Across { x: x_least, y: y_least }, Across { x: x_most, y: y_most });
        let deepest = depths[0].abs().max(depths[1].abs());
        // `2.5 u` of the size and `blur` a unit of depth are derived in docs/METHODS.md; the rest is for the rounding of this.
        let shared = deepest.mul(s.splat(1.01 * spread.blur)).add(s.splat(TINY));
        let error = least.size().max(most.size()).mul(s.splat(3.0 * UNIT32)).add(shared);
        Span { least, most, error }
    }
}

#[inline(always)]
fn product<V: Lanes<16>>(depth: V, slope: V, x: V) -> V {
    mul_sub::<V, true, 16>(depth, slope, x)
}

/// Between what `depth * slope - (given - origin)` is.
#[inline(always)]
fn between<S: Width<16>>(
    s: S,
    given: S::V,
    origin: &[f32; 2],
    depths: [S::V; 2],
    slopes: &[f32; 2],
) -> [S::V; 2] {
    let (least, most) = (given.sub(s.splat(origin[1])), given.sub(s.splat(origin[0])));
    let [flat, steep] = [s.splat(slopes[0]), s.splat(slopes[1])];
    let [near, far] = depths;
    let lower = product(near, flat, most).min(product(near, steep, most));
    let upper = product(near, flat, least).max(product(near, steep, least));
    [
        lower.min(product(far, flat, most)).min(product(far, steep, most)),
        upper.max(product(far, flat, least)).max(product(far, steep, least)),
    ]
}

/// The triangles of a block of which not all corners lie on one side of all rays, one bit each.
#[inline(always)]
pub(super) fn not_beside<S: Simd>(
    s: S,
    spread: &Spread,
    vertices: &[Sixteen; 3],
    block: &TriangleBlock,
) -> u32 {
    let Span { least, most, error } = Span::new(s, spread, vertices);
    let zero = Width::<16>::splat(s, 0.0);
    let beside = all_above(s, block, least.x.sub(error))
        | all_above(s, block, zero.sub(most.x).sub(error))
        | all_above(s, block, least.y.sub(error))
        | all_above(s, block, zero.sub(most.y).sub(error));
    block.lanes() & !beside
}

/// The triangles whose three corners are above zero, one bit each.
#[inline(always)]
fn all_above<S: Simd>(s: S, block: &TriangleBlock, of_vertices: <S as Width<16>>::V) -> u32 {
    let [a, b, c] = &block.corners;
    let [a, b, c] = Width::<16>::of_corners(s, of_vertices, [a, b, c]);
    Width::<16>::splat(s, 0.0).less(a.min(b).min(c))
}
