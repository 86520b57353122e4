//! What splits are judged by: boxes, their areas, and where the refs of a node lie.

use super::refs::PrimRef;
use crate::math::Aabb;
use crate::simd::{self, Lanes, Width};

/// A box with a fourth lane that means nothing: four lanes are one vector on most machines.
#[derive(Clone, Copy)]
pub(crate) struct Box4 {
    pub lower: [f32; 4],
    pub upper: [f32; 4],
}

impl Box4 {
    pub const EMPTY: Box4 = Box4 { lower: [f32::INFINITY; 4], upper: [f32::NEG_INFINITY; 4] };

    /// Of which bytes are zero; not empty.
    pub const ZERO: Box4 = Box4 { lower: [0.0; 4], upper: [0.0; 4] };

    /// Grows the box until it holds `other`.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    pub fn add(&mut self, other: &Box4) {
        // By instructions that are named: of plain comparisons compilers make stores of some lanes, where there are such, which are
        // slow to read.
        let s = simd::at_hand();
        let (lower, upper) = (Width::<4>::load(s, &self.lower), Width::<4>::load(s, &self.upper));
        Width::<4>::load(s, &other.lower).min(lower).store(&mut self.lower);
        Width::<4>::load(s, &other.upper).max(upper).store(&mut self.upper);
    }

    /// The axis along which it is widest.
    pub fn widest(&self) -> usize {
        let width = |k: usize| self.upper[k] - self.lower[k];
        let axis = if width(1) > width(0) { 1 } else { 0 };
        if width(2) > width(axis) { 2 } else { axis }
    }

    /// The box around a point.
    #[inline]
    pub fn at(point: [f32; 4]) -> Box4 {
        Box4 { lower: point, upper: point }
    }

    pub fn aabb(&self) -> Aabb {
        let [[a, b, c, _], [d, e, f, _]] = [self.lower, self.upper];
        Aabb { lower: [a, b, c], upper: [d, e, f] }
    }
}

/// The lesser one; `b` when `a` is NaN. Just one instruction where there are vectors, as the order of
/// equal zeros does not matter: refs have no -0.
#[inline]
pub(super) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline]
pub(super) fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Areas of boxes as `f32`, in units in which a scene's coordinates are about 1 at most: they
/// neither overflow nor, unless a box is 1e-19 of the scene, underflow.
#[derive(Clone, Copy)]
pub(crate) struct Areas(f32);

impl Areas {
    pub fn new(bounds: &Aabb) -> Self {
        // 2 to the minus exponent, as far as that is a normal number.
        let exponent = bounds.reach().to_bits() >> 23;
        Areas(f32::from_bits(254u32.saturating_sub(exponent).max(1) << 23))
    }

    /// Half the surface area; 0 for the empty box. Finite, and not NaN, for infinite boxes too.
    pub fn of(self, aabb: &Aabb) -> f32 {
        let edge = |k: usize| self.edge(aabb.lower[k], aabb.upper[k]);
        let [x, y, z] = [edge(0), edge(1), edge(2)];
        x * y + y * z + z * x
    }

    /// The same without a care for infinite boxes, whose area may be infinite or NaN.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    pub fn of_finite(self, all: &Box4) -> f32 {
        let s = self.0;
        let mut edges = [0.0; 4];
        for ((edge, upper), lower) in edges.iter_mut().zip(all.upper).zip(all.lower) {
            *edge = upper * s - lower * s;
        }
        let [x, y, z, _] = edges;
        x * y + y * z + z * x
    }

    #[inline]
    fn edge(self, lower: f32, upper: f32) -> f32 {
        greater(lesser(upper * self.0 - lower * self.0, 16.0), 0.0)
    }
}

/// The box around the refs of a node, and the box around their centres.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub bounds: Box4,
    pub centres: Box4,
}

impl Extent {
    pub const EMPTY: Extent = Extent { bounds: Box4::EMPTY, centres: Box4::EMPTY };

    /// The boxes around both.
    pub fn with(mut self, other: &Extent) -> Extent {
        self.bounds.add(&other.bounds);
        self.centres.add(&other.centres);
        self
    }

    #[cfg_attr(target_os = "none", inline(never))]
    pub fn around(refs: &[PrimRef]) -> Extent {
        Extent::of_sample(refs, 1)
    }

    /// That of every `step`-th ref.
    pub fn of_sample(refs: &[PrimRef], step: usize) -> Extent {
        let mut extent = Extent::EMPTY;
        for r in refs.iter().step_by(step.max(1)) {
            extent.bounds.add(&r.bounds);
            extent.centres.add(&Box4::at(centre(r)));
        }
        extent
    }
}

/// A quarter of the sum of the corners, which is half the centre: it cannot overflow, and neither
/// can the difference of two. NaN for boxes that are infinite both ways.
#[inline(always)]
pub(super) fn centre(r: &PrimRef) -> [f32; 4] {
    let Box4 { lower, upper } = &r.bounds;
    let mut centre = [0.0; 4];
    for k in 0..4 {
        centre[k] = middle(lower[k], upper[k]);
    }
    centre
}

/// Half the middle of two coordinates.
#[inline(always)]
pub(super) fn middle(lower: f32, upper: f32) -> f32 {
    0.25 * lower + 0.25 * upper
}
