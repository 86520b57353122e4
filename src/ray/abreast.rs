//! Sixteen rays side by side, in one frame.

use super::Ray;
use super::alike::Alike;
use super::exponents::ORDINARY;
use super::frame::{BLUR, DEPTH_SLACK, SLOWEST, TINY};
use super::slab::{CONSTANT_PAD, NEGLIGIBLE, RELATIVE_PAD};
use crate::simd::{Lanes, Width};

/// A number of each ray.
pub(crate) type Sixteen = [f32; 16];

/// Sixteen rays that [are alike](Alike), made ready for boxes and triangles.
///
/// Where a ray is counts in *depths* from its origin, along the one axis that is the depth for all of them: what
/// `t` times the size of that component is in the frame. Across it, a ray moves by its `slope` for each unit of
/// depth. As the direction is divided by its own component, no bound depends on how long it is.
pub(crate) struct Abreast {
    /// The rays as they were given: origin, `t_min`, direction, `t_max`.
    given: [Sixteen; 8],
    /// The origins along the axes x, y and depth of the frame; depths grow along the rays.
    pub origin: [Sixteen; 3],
    pub slope: [Sixteen; 2],
    /// What x and y of a sheared vertex may be off for each unit of depth.
    pub blur: Sixteen,
    /// Below the depths of interest. Those that hit nothing by definition have infinity here, and less above.
    pub low: Sixteen,
    /// Above the depths of interest; less and less, and minus infinity when nothing is any more.
    pub high: Sixteen,
    /// What lies between these depths surely is within the limits.
    pub inner: [Sixteen; 2],
    /// For boxes, as in a narrow slab.
    reciprocal: [Sixteen; 3],
    near_shift: [Sixteen; 3],
    far_shift: [Sixteen; 3],
}

impl Abreast {
    /// Without rays.
    pub const EMPTY: Self = Abreast {
        given: [[0.0; 16]; 8],
        origin: [[0.0; 16]; 3],
        slope: [[0.0; 16]; 2],
        blur: [0.0; 16],
        low: [f32::INFINITY; 16],
        high: [f32::NEG_INFINITY; 16],
        inner: [[0.0; 16]; 2],
        reciprocal: [[0.0; 16]; 3],
        near_shift: [[0.0; 16]; 3],
        far_shift: [[0.0; 16]; 3],
    };

    /// Becomes no rays: none that enters anything.
    pub fn clear(&mut self) {
        (self.low, self.high) = ([f32::INFINITY; 16], [f32::NEG_INFINITY; 16]);
    }

    /// Becomes these rays, one to 16, and more of the first in the other lanes. The lanes of those that can hit
    /// something.
    #[inline(always)]
    pub fn set<S: Width<16>>(&mut self, s: S, alike: &Alike, rays: &[Ray]) -> u32 {
        let Some(first) = rays.first() else { return 0 };
        let mut rows = [first.row(); 16];
        for (row, ray) in rows.iter_mut().zip(rays) {
            *row = ray.row();
        }
        self.given = s.columns(&rows);
        let [x, y, z, t_min, dx, dy, dz, t_max] = &self.given;
        let origin = [s.load(x), s.load(y), s.load(z)];
        let direction = [s.load(dx), s.load(dy), s.load(dz)];
        let limits = [s.load(t_min), s.load(t_max)];
        let mut sound = limits[0].less_or_equal(limits[1]) & ((1 << rays.len().min(16)) - 1);
        for k in 0..3 {
            let ordinary = s.splat(ORDINARY);
            sound &= origin[k].abs().less(ordinary) & direction[k].abs().less(ordinary);
        }
        let speed = direction[alike.axes[2]].abs();
        self.set_shear(s, alike, &origin, &direction, speed);
        self.set_limits(s, sound, limits, speed.mul(s.splat(alike.scale)));
        self.set_slabs(s, alike, &origin, &direction, speed);
        sound
    }

    #[inline(always)]
    fn set_shear<S: Width<16>>(
        &mut self,
        s: S,
        alike: &Alike,
        origin: &[S::V; 3],
        direction: &[S::V; 3],
        speed: S::V,
    ) {
        let [kx, ky, kz] = alike.axes;
        let scale = s.splat(alike.scale);
        let inverse = s.splat(1.0).div(speed);
        let (x, y) = (direction[kx].mul(inverse), direction[ky].mul(inverse));
        x.store(&mut self.slope[0]);
        y.store(&mut self.slope[1]);
        x.abs().max(y.abs()).mul(s.splat(BLUR)).store(&mut self.blur);
        origin[kx].mul(scale).store(&mut self.origin[0]);
        origin[ky].mul(scale).store(&mut self.origin[1]);
        origin[kz].mul(s.splat(alike.depth_scale())).store(&mut self.origin[2]);
    }

    /// `rate` is the depth for each unit of the given `t`.
    #[inline(always)]
    fn set_limits<S: Width<16>>(&mut self, s: S, sound: u32, [from, to]: [S::V; 2], rate: S::V) {
        let most = s.splat(f32::MAX);
        let low = from.max(s.splat(-f32::MAX)).mul(rate);
        let high = to.min(most).mul(rate);
        let (below, above) = (slack(s, low), slack(s, high));
        s.select(sound, low.sub(below), s.splat(f32::INFINITY)).store(&mut self.low);
        s.select(sound, high.add(above), s.splat(f32::NEG_INFINITY)).store(&mut self.high);
        low.add(below).store(&mut self.inner[0]);
        high.sub(above).store(&mut self.inner[1]);
    }

    /// The formulas of a narrow slab, with depths for `t`.
    #[inline(always)]
    fn set_slabs<S: Width<16>>(
        &mut self,
        s: S,
        alike: &Alike,
        origin: &[S::V; 3],
        direction: &[S::V; 3],
        speed: S::V,
    ) {
        let scale = s.splat(alike.scale);
        let (relative, least) = (s.splat(RELATIVE_PAD), s.splat(NEGLIGIBLE * alike.reach));
        let constant = s.splat(CONSTANT_PAD * alike.reach);
        let slowest = speed.mul(s.splat(SLOWEST));
        for k in 0..3 {
            let inverse = speed.div(direction[k].abs().max(slowest));
            let ahead = origin[k].mul(scale).flipped_by(direction[k]);
            let pad = ahead.abs().mul(relative).add(least);
            let reciprocal = inverse.mul(scale).with_sign_of(direction[k]);
            reciprocal.store(&mut self.reciprocal[k]);
            inverse.mul(ahead.add(pad)).add(constant).store(&mut self.near_shift[k]);
            inverse.mul(ahead.sub(pad)).sub(constant).store(&mut self.far_shift[k]);
        }
    }

    /// Those that enter a box between their depths of interest, by the walls that they pass first and last.
    #[inline(always)]
    pub fn entered<S: Width<16>>(&self, s: S, first: [f32; 3], last: [f32; 3]) -> u32 {
        let (mut near, mut far) = (s.load(&self.low), s.load(&self.high));
        for k in 0..3 {
            let r = s.load(&self.reciprocal[k]);
            let (near_shift, far_shift) = (s.load(&self.near_shift[k]), s.load(&self.far_shift[k]));
            near = s.splat(first[k]).fast_mul_sub(r, near_shift).max(near);
            far = s.splat(last[k]).fast_mul_sub(r, far_shift).min(far);
        }
        near.less_or_equal(far)
    }

    /// Origins and directions as they were given, eight from lane `first` on.
    #[inline(always)]
    pub fn lines(&self, first: usize) -> [&[f32; 8]; 6] {
        let half = |column| self.half(column, first);
        [half(0), half(1), half(2), half(4), half(5), half(6)]
    }

    /// Their limits as they were given, eight from lane `first` on.
    #[inline(always)]
    pub fn limits(&self, first: usize) -> [&[f32; 8]; 2] {
        [self.half(3, first), self.half(7, first)]
    }

    #[inline(always)]
    fn half(&self, column: usize, first: usize) -> &[f32; 8] {
        let (halves, _) = self.given[column].as_chunks::<8>();
        halves.get(first / 8).unwrap_or(&[0.0; 8])
    }

    /// Nothing is of interest to these rays any more.
    #[inline(always)]
    pub fn end<S: Width<16>>(&mut self, s: S, rays: u32) {
        let high = s.load(&self.high);
        s.select(rays, s.splat(f32::NEG_INFINITY), high).store(&mut self.high);
    }
}

/// What depths that are computed from limits are widened by, as for one ray.
#[inline(always)]
fn slack<S: Width<16>>(s: S, depth: S::V) -> S::V {
    let finite = depth.abs().min(s.splat(f32::MAX));
    finite.mul(s.splat(DEPTH_SLACK)).add(s.splat(TINY))
}

/// The ends of the intervals in which the numbers of several rays lie.
pub(super) struct Ends<V> {
    pub reciprocals: [[V; 2]; 3],
    pub origin: [[V; 2]; 3],
    pub slope: [[V; 2]; 2],
    pub near_shift: [V; 3],
    pub far_shift: [V; 3],
    pub low: V,
    pub blur: V,
}

impl<V: Copy> Ends<V> {
    #[inline(always)]
    pub fn none<S: Width<16, V = V>>(s: S) -> Self {
        let (above, below) = (s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY));
        Ends {
            reciprocals: [[above, below]; 3],
            origin: [[above, below]; 3],
            slope: [[above, below]; 2],
            near_shift: [below; 3],
            far_shift: [above; 3],
            low: above,
            blur: below,
        }
    }

    /// Takes sixteen more rays in; a NaN is left out.
    #[inline(always)]
    pub fn take<S: Width<16, V = V>>(&mut self, s: S, rays: &Abreast)
    where
        V: Lanes<16>,
    {
        for k in 0..3 {
            widen(&mut self.reciprocals[k], s.load(&rays.reciprocal[k]));
            widen(&mut self.origin[k], s.load(&rays.origin[k]));
            self.near_shift[k] = s.load(&rays.near_shift[k]).max(self.near_shift[k]);
            self.far_shift[k] = s.load(&rays.far_shift[k]).min(self.far_shift[k]);
        }
        widen(&mut self.slope[0], s.load(&rays.slope[0]));
        widen(&mut self.slope[1], s.load(&rays.slope[1]));
        self.low = s.load(&rays.low).min(self.low);
        self.blur = s.load(&rays.blur).max(self.blur);
    }
}

#[inline(always)]
fn widen<V: Lanes<16>>(ends: &mut [V; 2], more: V) {
    *ends = [more.min(ends[0]), more.max(ends[1])];
}
