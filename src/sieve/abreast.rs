//! The filter of triangles the other way round: one triangle, and sixteen rays that are alike.

use super::areas::{Across, AreaError, Areas};
use super::beside::not_beside;
use super::meetings::{Meetings, Middle};
use crate::block::leaf::TriangleBlock;
use crate::math::rounding::UNIT32;
use crate::math::{Aabb, Bits};
use crate::ray::{Abreast, Alike, Sixteen, Spread};
use crate::simd::{Lanes, Simd, Width, mul_sub};

/// A block in the frame of rays that are alike: what is the same for all of them.
pub(crate) struct Opened<'b> {
    pub block: &'b TriangleBlock,
    alike: Alike,
    /// The vertices along the axes x, y and depth of the frame.
    vertices: [Sixteen; 3],
    /// Their depths from the middle of the block's box.
    depths: Sixteen,
    /// The triangles that do not lie beside all rays, one bit each, and their vertices.
    pub lanes: u32,
    used: u32,
}

impl<'b> Opened<'b> {
    #[inline(always)]
    pub fn new<S: Simd>(s: S, alike: &Alike, spread: &Spread, block: &'b TriangleBlock) -> Self {
        let (vertices, depths) = ([[0.0; 16]; 3], [0.0; 16]);
        let mut opened = Opened { block, alike: *alike, vertices, depths, lanes: 0, used: 0 };
        let scales = [alike.scale, alike.scale, alike.depth_scale()];
        for (k, scale) in scales.into_iter().enumerate() {
            let given = Width::<16>::load(s, &block.vertices[alike.axes[k]]);
            given.mul(Width::<16>::splat(s, scale)).store(&mut opened.vertices[k]);
        }
        let middle = Width::<16>::splat(s, opened.middle(s, Width::<16>::splat(s, 0.0)).raw);
        s.load(&opened.vertices[2]).sub(middle).store(&mut opened.depths);
        opened.lanes = not_beside(s, spread, &opened.vertices, block);
        for i in Bits(opened.lanes) {
            let [a, b, c] = block.corner_numbers(i);
            opened.used |= 1 << a | 1 << b | 1 << c;
        }
        opened
    }

    #[inline(always)]
    fn middle<S: Width<16>>(&self, s: S, origin_depth: S::V) -> Middle<S::V> {
        let (k, Aabb { lower, upper }) = (self.alike.axes[2], &self.block.aabb);
        Middle::of(s, self.alike.depth_scale(), origin_depth, [lower[k], upper[k]])
    }
}

/// Room for vertices that are sheared for sixteen rays: minus x and minus y of each.
pub(crate) type Sheared = [[Sixteen; 2]; 16];

/// Sixteen rays in front of a block.
///
/// Most triangles are told apart by one bound for all of them, that of the vertex that is farthest from the ray: it is less tight
/// than one for each, and costs next to nothing.
pub(crate) struct Aim<'r, V> {
    vertices: &'r Sheared,
    /// What an area may be off, by the size of a triangle, and for all of them.
    error: AreaError<V>,
    largest_error: V,
    middle: Middle<V>,
    /// Where all is that is of interest, and where all is that surely is, from the middle of the box.
    window: [V; 2],
    inner: [V; 2],
}

/// What rays have to do with a triangle, one bit each.
pub(crate) struct Found<V> {
    /// The filter could not reject it.
    pub candidates: u32,
    /// The lines of those surely pass between its edges.
    pub sure: u32,
    /// And it surely is met within the limits.
    pub clear: u32,
    meetings: Meetings<V>,
}

impl<'r, V: Lanes<16>> Aim<'r, V> {
    #[inline(always)]
    pub fn new<S: Width<16, V = V>>(
        s: S,
        rays: &Abreast,
        opened: &Opened,
        room: &'r mut Sheared,
    ) -> Self {
        let [from_x, from_y, from_depth] = &rays.origin;
        let (from_x, from_y, from_depth) = (s.load(from_x), s.load(from_y), s.load(from_depth));
        let [slope_x, slope_y] = [s.load(&rays.slope[0]), s.load(&rays.slope[1])];
        let middle = opened.middle(s, from_depth);
        let mut size = s.splat(0.0);
        let [xs, ys, depths] = &opened.vertices;
        for i in Bits(opened.used) {
            let [x_out, y_out] = &mut room[i % 16];
            let depth = s.splat(depths[i]).sub(from_depth);
            let (x, y) = (s.splat(xs[i]).sub(from_x), s.splat(ys[i]).sub(from_y));
            let x = mul_sub::<V, true, 16>(depth, slope_x, x);
            let y = mul_sub::<V, true, 16>(depth, slope_y, y);
            x.store(x_out);
            y.store(y_out);
            size = size.max(Across { x, y }.size());
        }
        let error = AreaError::new(s, s.load(&rays.blur).mul(middle.deepest));
        let largest_error = error.of::<S, true, 16>(s, size);
        let inner = middle.inner_window(s, [s.load(&rays.inner[0]), s.load(&rays.inner[1])]);
        let window = middle.window(s, [s.load(&rays.low), s.load(&rays.high)]);
        Aim { vertices: room, error, largest_error, middle, window, inner }
    }

    /// The rays for which not all of the block is beyond their limits.
    #[inline(always)]
    pub fn within<S: Width<16, V = V>>(&self, s: S) -> u32 {
        !self.middle.is_beyond(s, self.window)
    }

    /// The triangles that one of the rays of `lanes` may pass between the edges of, one bit each. All are looked at before
    /// anything depends on one.
    #[inline(always)]
    pub fn passed<S: Width<16, V = V>>(&self, s: S, opened: &Opened, lanes: u32) -> u32 {
        let mut passed = 0;
        for i in Bits(opened.lanes) {
            let corners = self.corners(s, opened.block.corner_numbers(i));
            let areas = Areas::new::<true, 16>(&corners, self.largest_error);
            passed |= u32::from(lanes & !areas.outside(s) != 0) << i;
        }
        passed
    }

    #[inline(always)]
    fn corners<S: Width<16, V = V>>(&self, s: S, [a, b, c]: [usize; 3]) -> [Across<V>; 3] {
        [self.corner(s, a), self.corner(s, b), self.corner(s, c)]
    }

    #[inline(always)]
    fn corner<S: Width<16, V = V>>(&self, s: S, number: usize) -> Across<V> {
        let [x, y] = &self.vertices[number % 16];
        Across { x: s.load(x), y: s.load(y) }
    }

    /// Looks at triangle `i` for the rays of `lanes`.
    #[inline(always)]
    pub fn look<S: Width<16, V = V>>(
        &self,
        s: S,
        opened: &Opened,
        i: usize,
        lanes: u32,
    ) -> Found<V> {
        let [a, b, c] = opened.block.corner_numbers(i);
        let corners = self.corners(s, [a, b, c]);
        let size = corners[0].size().max(corners[1].size()).max(corners[2].size());
        let error = self.error.of::<S, true, 16>(s, size);
        let areas = Areas::new::<true, 16>(&corners, error);
        let depths = &opened.depths;
        let depths = [s.splat(depths[a % 16]), s.splat(depths[b % 16]), s.splat(depths[c % 16])];
        let meetings = Meetings::new::<S, true, 16>(s, self.middle.half, &areas, depths);
        let outside = areas.outside(s) | meetings.outside::<S, true, 16>(s, self.window);
        let sure = areas.sure(s);
        let clear = sure & meetings.inside::<S, true, 16>(s, self.inner);
        let candidates = lanes & !outside;
        Found { candidates, sure: candidates & sure, clear: candidates & clear, meetings }
    }

    /// Depths from the origins between which the rays really meet what [surely](Found::clear) is met.
    #[inline(always)]
    pub fn span<S: Width<16, V = V>>(&self, s: S, found: &Found<V>) -> [V; 2] {
        let Meetings { total, rise, error } = found.meetings;
        let (near, far) = (rise.sub(error).div(total), rise.add(error).div(total));
        let reach = self.middle.deepest.add(s.splat(self.middle.half));
        let slack = reach.mul(s.splat(8.0 * UNIT32));
        let depth = self.middle.depth;
        [depth.add(near).sub(slack), depth.add(far).add(slack)]
    }

    /// Nothing beyond these depths from the origins is of interest any more.
    #[inline(always)]
    pub fn limit<S: Width<16, V = V>>(&mut self, s: S, high: V) {
        self.window[1] = self.middle.window(s, [high, high])[1];
    }
}
