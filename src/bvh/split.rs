//! Where to part the refs of a node: binned SAH.

use super::tree::PrimRef;
use crate::math::Aabb;

/// A box with a fourth lane that means nothing: four lanes are one vector on most machines.
#[derive(Clone, Copy)]
pub(crate) struct Box4 {
    pub lower: [f32; 4],
    pub upper: [f32; 4],
}

impl Box4 {
    pub const EMPTY: Box4 = Box4 { lower: [f32::INFINITY; 4], upper: [f32::NEG_INFINITY; 4] };

    /// Grows the box until it holds `other`.
    #[inline]
    pub fn add(&mut self, other: &Box4) {
        for k in 0..4 {
            self.lower[k] = lesser(other.lower[k], self.lower[k]);
            self.upper[k] = greater(other.upper[k], self.upper[k]);
        }
    }

    pub fn aabb(&self) -> Aabb {
        let [[a, b, c, _], [d, e, f, _]] = [self.lower, self.upper];
        Aabb { lower: [a, b, c], upper: [d, e, f] }
    }
}

/// The lesser one; `b` when `a` is NaN. Just one instruction where there are vectors, as the order of
/// equal zeros does not matter: refs have no -0.
#[inline]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline]
fn greater(a: f32, b: f32) -> f32 {
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
    #[inline]
    fn of_finite(self, all: &Box4) -> f32 {
        let s = self.0;
        let [x, y, z, _]: [f32; 4] = core::array::from_fn(|k| all.upper[k] * s - all.lower[k] * s);
        x * y + y * z + z * x
    }

    #[inline]
    fn edge(self, lower: f32, upper: f32) -> f32 {
        greater(lesser(upper * self.0 - lower * self.0, 16.0), 0.0)
    }
}

/// Boxes around the refs of a node, and around their centres.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub bounds: Box4,
    centres: Box4,
}

impl Extent {
    pub const EMPTY: Extent = Extent { bounds: Box4::EMPTY, centres: Box4::EMPTY };

    pub fn around(refs: &[PrimRef]) -> Extent {
        let mut extent = Extent::EMPTY;
        for r in refs {
            extent.add(r);
        }
        extent
    }

    #[inline]
    fn add(&mut self, r: &PrimRef) {
        let centre = core::array::from_fn(|k| centre(r, k));
        self.bounds.add(&r.bounds);
        self.centres.add(&Box4 { lower: centre, upper: centre });
    }
}

/// A quarter of the sum of the corners, which is half the centre: it cannot overflow, and neither
/// can the difference of two. NaN for boxes that are infinite both ways.
#[inline]
fn centre(r: &PrimRef, k: usize) -> f32 {
    0.25 * r.bounds.lower[k] + 0.25 * r.bounds.upper[k]
}

/// Bins along each axis at most.
const BINS: usize = 16;
/// Of more refs than twice this, some are enough to choose a plane by.
const SAMPLES: usize = 512;

/// How centres fall into bins.
#[derive(Clone, Copy)]
struct Binning {
    lower: [f32; 4],
    scale: [f32; 4],
    bins: usize,
}

impl Binning {
    fn new(centres: &Box4, count: usize) -> Self {
        // Few refs leave most bins empty.
        let bins = (4 + count / 8).min(BINS);
        let scale = core::array::from_fn(|k| bins as f32 / (centres.upper[k] - centres.lower[k]));
        Binning { lower: centres.lower, scale, bins }
    }

    /// The bin on an axis. NaN, from infinite boxes or an axis without extent, goes to bin 0:
    /// everything is in some bin.
    #[inline]
    fn bin_of(&self, r: &PrimRef, k: usize) -> usize {
        // Above 2^23 the lowest bits of a float are those of an integer.
        const INTEGER: f32 = (1 << 23) as f32;
        let at = (centre(r, k) - self.lower[k]) * self.scale[k] - 0.5;
        let bin = at.max(0.0).min((self.bins - 1) as f32) + INTEGER;
        bin.to_bits() as usize % BINS
    }
}

/// The plane of least cost, between two bins of one axis.
pub(crate) struct Plane {
    binning: Binning,
    axis: usize,
    /// Bins below this one are left.
    bin: usize,
    /// The areas of the sides, each times its primitives.
    pub work: f32,
}

impl Plane {
    /// Brings the refs left of the plane to the front; returns their number.
    ///
    /// Every ref is moved, left or not: a branch would be guessed wrong half the time.
    pub fn part(&self, refs: &mut [PrimRef]) -> usize {
        let mut count = 0;
        for i in 0..refs.len() {
            let left = self.binning.bin_of(&refs[i], self.axis) < self.bin;
            refs.swap(i, count);
            count += usize::from(left);
        }
        count
    }
}

/// The bins of the three axes: scratch for [`best_plane`].
pub(crate) struct Bins([Axis; 3]);

struct Axis {
    bounds: [Box4; BINS],
    counts: [u32; BINS],
}

impl Bins {
    pub const EMPTY: Bins =
        Bins([const { Axis { bounds: [Box4::EMPTY; BINS], counts: [0; BINS] } }; 3]);
}

/// The best split by bins, or `None` when all centres fall into one.
///
/// Source: \[Wald07\].
pub(crate) fn best_plane(
    refs: &[PrimRef],
    extent: &Extent,
    areas: Areas,
    Bins(axes): &mut Bins,
) -> Option<Plane> {
    let binning = Binning::new(&extent.centres, refs.len());
    for axis in axes.iter_mut() {
        axis.bounds[..binning.bins].fill(Box4::EMPTY);
        axis.counts[..binning.bins].fill(0);
    }
    if refs.len() < 2 * SAMPLES {
        fill(refs.iter(), &binning, axes);
    } else {
        fill(refs.iter().step_by(refs.len() / SAMPLES), &binning, axes);
    }
    let mut best = (f32::INFINITY, 0, 0);
    for (k, axis) in axes.iter().enumerate() {
        let (work, bin) = axis.best(binning.bins, areas);
        if work < best.0 {
            best = (work, k, bin);
        }
    }
    let (work, axis, bin) = best;
    (bin > 0).then_some(Plane { binning, axis, bin, work })
}

fn fill<'r>(refs: impl Iterator<Item = &'r PrimRef>, binning: &Binning, axes: &mut [Axis; 3]) {
    for r in refs {
        for (k, axis) in axes.iter_mut().enumerate() {
            let bin = binning.bin_of(r, k);
            axis.bounds[bin].add(&r.bounds);
            axis.counts[bin] += 1;
        }
    }
}

impl Axis {
    /// The least work of a split, and the first bin on its right; 0 when there is none.
    fn best(&self, bins: usize, areas: Areas) -> (f32, usize) {
        let (bounds, counts) = (&self.bounds[..bins], &self.counts[..bins]);
        // What lies right of each plane, from the right; then what lies left.
        let mut right = [(0.0f32, 0u32); BINS];
        let (mut all, mut count) = (Box4::EMPTY, 0);
        for ((right, one), n) in right.iter_mut().zip(bounds).zip(counts).skip(1).rev() {
            all.add(one);
            count += n;
            *right = (areas.of_finite(&all) * count as f32, count);
        }
        let (mut all, mut count) = (Box4::EMPTY, 0);
        let mut best = (f32::INFINITY, 0);
        let planes = right.iter().zip(1..).skip(1).map(|(right, bin)| (right, bin - 1));
        for ((one, n), ((right_work, right_count), bin)) in bounds.iter().zip(counts).zip(planes) {
            all.add(one);
            count += n;
            let work = areas.of_finite(&all) * count as f32 + right_work;
            if count > 0 && *right_count > 0 && work < best.0 {
                best = (work, bin);
            }
        }
        best
    }
}
