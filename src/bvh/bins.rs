//! Where to part the refs of a large node: SAH over bins.

use super::refs::PrimRef;
use super::split::{Areas, Box4, middle};
use crate::simd::{self, Lanes, SMALL, Width};

/// Bins along each axis at most.
const BINS: usize = 32;

/// How carefully planes are chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Bins along each axis, at most [`BINS`].
    bins: usize,
    /// Of more refs than twice this, some are enough to choose a plane by.
    samples: usize,
    /// Whether refs that may be one leaf stay together, as long as they are even: the collapse would seldom part them.
    pub whole: bool,
    /// Triangles at most that go as one, each with an edge of the one before.
    pub strip: usize,
    /// Whether leaves are leaf blocks at once: runs of refs along a curve where scenes are even, else what fits.
    pub blocks: bool,
    /// Above this unevenness of the refs more is done.
    even: f64,
    /// Whether refs may then be cut in two.
    pub cuts: bool,
}

impl Effort {
    pub const FAST: Effort = Effort { strip: 4, blocks: true, ..Effort::BALANCED };
    pub const BALANCED: Effort = Effort {
        bins: 16,
        samples: 512,
        whole: true,
        strip: 2,
        blocks: false,
        even: 64.0,
        cuts: false,
    };
    /// No plane is looked for: nodes are halved. For trees that are to be mended.
    #[cfg(test)]
    pub const HASTY: Effort = Effort { bins: 1, ..Effort::BALANCED };
    pub const BEST: Effort = Effort {
        bins: BINS,
        samples: ALL,
        whole: false,
        strip: 1,
        blocks: false,
        even: 4.0,
        cuts: true,
    };

    /// Of so many refs every so-many-th is in the bins.
    pub fn step(&self, count: usize) -> usize {
        if count < 2 * self.samples { 1 } else { count.checked_div(self.samples).unwrap_or(1) }
    }

    /// The effort where few refs are much larger than the others, such as the walls of a building: a sample says nothing
    /// of them, and where they are parted matters. `None` for scenes that are even enough.
    pub fn for_uneven(self, unevenness: f64) -> Option<Effort> {
        let uneven = Effort { bins: BINS, samples: ALL, whole: false, ..self };
        (!self.is_even(unevenness)).then_some(uneven)
    }

    /// Whether so uneven refs need no more than others.
    pub fn is_even(&self, unevenness: f64) -> bool {
        // Refs without any area are.
        !(unevenness > self.even)
    }
}

/// As many samples as there are refs.
const ALL: usize = 1 << 29;

/// How centres fall into bins.
#[derive(Clone, Copy)]
struct Binning {
    lower: [f32; 4],
    scale: [f32; 4],
    bins: usize,
    /// The bits of the last place.
    last: u32,
}

/// From 2^23 to 2^24 the lowest bits of a float are those of an integer; this is the middle, so that half a bin less is
/// among them.
const INTEGER: f32 = (3 << 22) as f32;

impl Binning {
    fn new(centres: &Box4, count: usize, most: usize) -> Self {
        // Few refs leave most bins empty.
        let bins = (4 + count / 8).min(most);
        let mut scale = [0.0; 4];
        for ((scale, upper), lower) in scale.iter_mut().zip(centres.upper).zip(centres.lower) {
            *scale = bins as f32 / (upper - lower);
        }
        Binning { lower: centres.lower, scale, bins, last: INTEGER.to_bits() + bins as u32 - 1 }
    }

    /// The bins on the three axes of a ref whose centre is in the box: by the operations of [`place`](Self::place), but clamped as floats, which
    /// is one instruction where it is named.
    #[inline(always)]
    fn bins_of(&self, r: &PrimRef) -> [usize; 3] {
        let s = simd::at_hand();
        let load = |lanes: &[f32; 4]| Width::<4>::load(s, lanes);
        let quarter = Width::<4>::splat(s, 0.25);
        let centre = load(&r.bounds.lower).mul(quarter).add(load(&r.bounds.upper).mul(quarter));
        let place = centre.sub(load(&self.lower)).mul(load(&self.scale));
        let place = place.sub(Width::<4>::splat(s, 0.5)).add(Width::<4>::splat(s, INTEGER));
        let mut at = [0.0; 4];
        place.min(Width::<4>::splat(s, f32::from_bits(self.last))).store(&mut at);
        let [x, y, z, _] = at.map(|place| place.to_bits() as usize % BINS);
        [x, y, z]
    }

    /// The bin on one axis.
    #[inline(always)]
    fn bin_of(&self, r: &PrimRef, k: usize) -> usize {
        let (k, Box4 { lower, upper }) = (k % 3, &r.bounds);
        self.bin(self.place(middle(lower[k], upper[k]), k).to_bits())
    }

    /// The bin of a place with these bits. Those of infinity and NaN, from infinite boxes or an axis without extent, go to the
    /// last one: everything is in some bin.
    #[inline(always)]
    fn bin(&self, bits: u32) -> usize {
        bits.min(self.last) as usize % BINS
    }

    /// The bin on axis `k`, above [`INTEGER`]; the last centre may be one beyond. Not clamped, as compilers make branches of
    /// that for floats, which are guessed wrong; below the first bin is no centre, as half a bin less is rounded to even.
    #[inline(always)]
    fn place(&self, centre: f32, k: usize) -> f32 {
        (centre - self.lower[k]) * self.scale[k] - 0.5 + INTEGER
    }
}

/// The plane of least cost, between two bins of one axis.
pub(crate) struct Plane {
    binning: Binning,
    axis: usize,
    /// Bins below this one are left.
    bin: usize,
}

impl Plane {
    /// Brings the refs left of the plane to the front; returns their number.
    ///
    /// Every ref is moved, left or not: a branch would be guessed wrong half the time.
    pub fn part(&self, refs: &mut [PrimRef]) -> usize {
        let (mut count, k) = (0, self.axis % 3);
        let right = self.bin as f32 + INTEGER;
        for i in 0..refs.len() {
            let (before, from) = refs.split_at_mut(i);
            let Some(r) = from.first_mut() else { break };
            let Box4 { lower, upper } = &r.bounds;
            // NaN is right, as it is in the last bin.
            let left = self.binning.place(middle(lower[k], upper[k]), k) < right;
            // None when all so far are left.
            if let Some(place) = before.get_mut(count) {
                core::mem::swap(place, r);
            }
            count += usize::from(left);
        }
        count
    }
}

/// A place between two bins, and the work of a split there. The least is found without a branch, which would be guessed wrong.
///
/// The bits of floats that are not negative are in their order; infinity and NaN come last. The work of a side without refs is one of
/// these: no refs times an area without end.
#[derive(Clone, Copy)]
struct Cut {
    work: u32,
    /// The axis above eight bits of the bin.
    place: u32,
}

impl Cut {
    const NONE: Cut = Cut { work: f32::INFINITY.to_bits(), place: 0 };

    #[inline(always)]
    fn new(work: f32, axis: usize, bin: u32) -> Cut {
        Cut { work: work.to_bits(), place: (axis as u32) << 8 | bin }
    }

    /// The one of less work, or else the first.
    #[inline(always)]
    fn min(self, other: Cut) -> Cut {
        let less = other.work < self.work;
        Cut {
            work: if less { other.work } else { self.work },
            place: if less { other.place } else { self.place },
        }
    }

    /// The axis and the first bin on the right side, if there is a split.
    fn plane(self) -> Option<(usize, usize)> {
        let (axis, bin) = (self.place as usize >> 8, self.place as usize & 0xFF);
        (bin > 0).then_some((axis, bin))
    }
}

/// The bins of the three axes, or of one after the other where room is scarce: scratch for [`best_plane`].
pub(crate) struct Bins([Axis; AXES]);

const AXES: usize = if SMALL { 1 } else { 3 };

struct Axis {
    bounds: [Box4; BINS],
    counts: [u32; BINS],
}

impl Bins {
    /// All zero, as that takes no room in a program; [`best_plane`] clears what it uses.
    pub const UNUSED: Bins =
        Bins([const { Axis { bounds: [Box4::ZERO; BINS], counts: [0; BINS] } }; AXES]);
}

/// The best split by bins of the box around the centres, or `None` when all fall into one. With `one_axis`, only the axis
/// along which these are furthest apart is looked at.
///
/// Source: \[Wald07\].
pub(crate) fn best_plane(
    refs: &[PrimRef],
    centres: &Box4,
    areas: Areas,
    (effort, one_axis): (Effort, bool),
    Bins(axes): &mut Bins,
) -> Option<Plane> {
    let binning = Binning::new(centres, refs.len(), effort.bins);
    let sample = refs.iter().step_by(effort.step(refs.len()).max(1));
    let one_by_one = SMALL || one_axis;
    if !one_by_one {
        fill(axes, &binning, sample.clone());
    }
    let mut best = Cut::NONE;
    let widest = centres.widest();
    for k in if one_axis { widest..widest + 1 } else { 0..3 } {
        let Some(axis) = axes.get_mut(k % AXES) else { break };
        if one_by_one {
            axis.fill(&binning, k, sample.clone());
        }
        best = best.min(axis.best(k, binning.bins, areas));
    }
    let (axis, bin) = best.plane()?;
    Some(Plane { binning, axis, bin })
}

/// Fills the bins of three axes at once.
#[inline]
fn fill<'r>(axes: &mut [Axis], binning: &Binning, sample: impl Iterator<Item = &'r PrimRef>) {
    let Some([x, y, z]) = axes.first_chunk_mut() else { return };
    for axis in [&mut *x, &mut *y, &mut *z] {
        axis.clear(binning.bins);
    }
    for r in sample {
        let [a, b, c] = binning.bins_of(r);
        x.add(r, a);
        y.add(r, b);
        z.add(r, c);
    }
}

impl Axis {
    fn clear(&mut self, bins: usize) {
        self.bounds.iter_mut().take(bins).for_each(|bounds| *bounds = Box4::EMPTY);
        self.counts.iter_mut().take(bins).for_each(|count| *count = 0);
    }

    /// Fills the bins of axis `k`.
    #[inline]
    fn fill<'r>(&mut self, binning: &Binning, k: usize, sample: impl Iterator<Item = &'r PrimRef>) {
        self.clear(binning.bins);
        for r in sample {
            self.add(r, binning.bin_of(r, k));
        }
    }

    #[inline(always)]
    fn add(&mut self, r: &PrimRef, bin: usize) {
        self.bounds[bin % BINS].add(&r.bounds);
        self.counts[bin % BINS] += 1;
    }

    /// The split of least work on axis `k`.
    fn best(&self, k: usize, bins: usize, areas: Areas) -> Cut {
        let bins = bins.min(BINS);
        let (bounds, counts) = (&self.bounds[..bins], &self.counts[..bins]);
        // What lies right of each plane, from the right; then what lies left. The last bin has no plane behind it.
        let mut right = [0.0f32; BINS];
        let (mut all, mut count) = (Box4::EMPTY, 0);
        for ((right, one), n) in right.iter_mut().zip(bounds).zip(counts).skip(1).rev() {
            all.add(one);
            count += n;
            *right = areas.of_finite(&all) * count as f32;
        }
        let (mut all, mut count) = (Box4::EMPTY, 0);
        let mut best = Cut::NONE;
        for (((one, n), right), bin) in
            bounds.iter().zip(counts).zip(right[..bins].iter().skip(1)).zip(1..)
        {
            all.add(one);
            count += n;
            best = best.min(Cut::new(areas.of_finite(&all) * count as f32 + right, k, bin));
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::split::Extent;
    use crate::math::Aabb;
    use std::vec::Vec;

    /// Refs in a part of space of this size, at this distance.
    fn refs_of(count: u32, size: f32, distance: f32) -> Vec<PrimRef> {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            distance + size * (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut at = |id| {
            let lower = [next(), next(), next()];
            PrimRef::new(id, &Aabb { lower, upper: lower.map(|x| x + size / 64.0) }, false)
        };
        (0..count).map(&mut at).collect()
    }

    #[test]
    fn what_is_in_the_box_is_in_a_bin() {
        let sizes = [1e-30, 1e-3, 1.0, 77.7, 1e30];
        let places = sizes.map(|size| [(size, 0.0), (size, size), (size, -1e4 * size)]);
        for (size, distance) in places.into_iter().flatten() {
            for (count, most) in [(2, 16), (9, 16), (37, 16), (100, 32), (3000, 16), (3000, 32)] {
                let mut refs = refs_of(count, size, distance);
                let centres = Extent::around(&refs).centres;
                let binning = Binning::new(&centres, refs.len(), most);
                let mut counts = [[0; BINS]; 3];
                for r in &refs {
                    let bins = binning.bins_of(r);
                    assert_eq!(bins, [0, 1, 2].map(|k| binning.bin_of(r, k)));
                    (0..3).for_each(|k| counts[k][bins[k]] += 1);
                }
                for (axis, counts) in counts.iter().enumerate() {
                    let used = &counts[..binning.bins];
                    assert_eq!(used.iter().sum::<usize>(), refs.len(), "{size} {distance}");
                    assert!(used[0] > 0 && used[binning.bins - 1] > 0, "{size} {distance}");
                    for bin in 1..binning.bins {
                        let left = Plane { binning, axis, bin }.part(&mut refs);
                        assert_eq!(left, used[..bin].iter().sum::<usize>());
                    }
                }
            }
        }
    }

    #[test]
    fn what_has_no_place_is_in_the_last_bin() {
        let lower = [f32::NEG_INFINITY, 1.0, 2.0];
        let everywhere = Aabb { lower, upper: [f32::INFINITY, 1.0, 5.0] };
        let mut refs = [PrimRef::new(0, &everywhere, true); 12];
        refs[3] = PrimRef::new(1, &Aabb { lower: [4.0, 1.0, 3.0], upper: [4.0, 1.0, 3.0] }, true);
        let binning = Binning::new(&Extent::around(&refs).centres, refs.len(), 16);
        let last = binning.bins - 1;
        assert!(refs.iter().all(|r| binning.bins_of(r)[..2] == [last; 2]));
        for axis in 0..2 {
            assert_eq!(Plane { binning, axis, bin: last }.part(&mut refs), 0);
        }
    }
}
