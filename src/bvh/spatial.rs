//! Where to cut space, and what stands in it, so that the boxes of two sides do not overlap.

use super::clip::clip;
use super::refs::PrimRef;
use super::split::{Areas, Box4, greater, lesser};
use crate::math::Aabb;
use crate::prim::Shapes;

/// Slabs along each axis.
const SLABS: usize = 16;

/// A box in equal slabs along each axis.
#[derive(Clone, Copy)]
struct Slabs {
    lower: [f32; 4],
    width: [f32; 4],
    scale: [f32; 4],
}

impl Slabs {
    fn new(bounds: &Box4) -> Slabs {
        let width: [f32; 4] =
            core::array::from_fn(|k| (bounds.upper[k] - bounds.lower[k]) / SLABS as f32);
        Slabs { lower: bounds.lower, width, scale: width.map(|w| 1.0 / w) }
    }

    /// The slabs in which a ref begins and ends on each axis. NaN goes to the first.
    ///
    /// What reaches beyond a wall by less than a thousandth of a slab ends at it.
    #[inline]
    fn of(&self, r: &PrimRef) -> [[usize; 4]; 2] {
        const LITTLE: f32 = 1e-3;
        let [first, last] =
            [self.near(&r.bounds.lower, LITTLE), self.near(&r.bounds.upper, -LITTLE)];
        [first, core::array::from_fn(|k| last[k].max(first[k]))]
    }

    /// The slabs around a point moved by a part of a slab.
    #[inline]
    fn near(&self, point: &[f32; 4], moved: f32) -> [usize; 4] {
        // Above 2^23 the lowest bits of a float are those of an integer.
        const INTEGER: f32 = (1 << 23) as f32;
        let bits: [u32; 4] = core::array::from_fn(|k| {
            let at = (point[k] - self.lower[k]) * self.scale[k] - (0.5 - moved);
            let at = lesser(greater(at, 0.0), (SLABS - 1) as f32);
            (at + INTEGER).to_bits() % SLABS as u32
        });
        bits.map(|slab| slab as usize)
    }

    /// The wall below slab `slab` of axis `k`.
    #[inline]
    fn wall(&self, k: usize, slab: usize) -> f32 {
        self.lower[k] + self.width[k] * slab as f32
    }
}

/// What lies in the slabs of one axis.
#[derive(Clone, Copy)]
struct Axis {
    bounds: [Box4; SLABS],
    begins: [usize; SLABS],
    ends: [usize; SLABS],
}

impl Axis {
    const EMPTY: Axis = Axis { bounds: [Box4::EMPTY; SLABS], begins: [0; SLABS], ends: [0; SLABS] };
}

/// A wall between two slabs.
pub(super) struct Cut {
    slabs: Slabs,
    axis: usize,
    /// What ends below this slab is left.
    slab: usize,
    /// The areas of the sides, each times its refs.
    pub work: f32,
}

/// The cut of least work for which `allowed` says so of the counts of its sides. What reaches through
/// several slabs counts with its box there.
///
/// Source: \[Stich09\]; there triangles are cut here too, for as good trees in twice the time.
pub(super) fn best_cut(
    refs: &[PrimRef],
    bounds: &Box4,
    areas: Areas,
    allowed: impl Fn([usize; 2]) -> bool,
) -> Option<Cut> {
    let slabs = Slabs::new(bounds);
    let mut axes = [Axis::EMPTY; 3];
    for r in refs {
        let [first, last] = slabs.of(r);
        for (k, axis) in axes.iter_mut().enumerate() {
            axis.add(r, k, [first[k], last[k]], &slabs);
        }
    }
    let mut best: Option<Cut> = None;
    for (k, axis) in axes.iter().enumerate().filter(|(k, _)| slabs.width[*k] > 0.0) {
        let least = best.as_ref().map_or(f32::INFINITY, |best| best.work);
        if let Some((slab, work)) = axis.best(areas, least, &allowed) {
            best = Some(Cut { slabs, axis: k, slab, work });
        }
    }
    best
}

impl Axis {
    /// Adds a ref to each slab it is in, with the part of its box that is there.
    #[inline]
    fn add(&mut self, r: &PrimRef, k: usize, [first, last]: [usize; 2], slabs: &Slabs) {
        self.begins[first] += 1;
        self.ends[last] += 1;
        let mut part = r.bounds;
        for slab in first..last {
            let wall = slabs.wall(k, slab + 1);
            part.upper[k] = wall;
            self.bounds[slab].add(&part);
            part.lower[k] = wall;
        }
        part.upper[k] = r.bounds.upper[k];
        self.bounds[last].add(&part);
    }

    /// The first slab right of the best wall with less work than `least`, and its work.
    fn best(
        &self,
        areas: Areas,
        least: f32,
        allowed: &impl Fn([usize; 2]) -> bool,
    ) -> Option<(usize, f32)> {
        let mut right = [(0.0f32, 0); SLABS];
        let (mut all, mut count) = (Box4::EMPTY, 0);
        for slab in (1..SLABS).rev() {
            all.add(&self.bounds[slab]);
            count += self.ends[slab];
            right[slab] = (areas.of_finite(&all) * count as f32, count);
        }
        let (mut all, mut count, mut best) = (Box4::EMPTY, 0, None);
        let mut least = least;
        for (slab, &(right_work, right_count)) in right.iter().enumerate().skip(1) {
            all.add(&self.bounds[slab - 1]);
            count += self.begins[slab - 1];
            let work = areas.of_finite(&all) * count as f32 + right_work;
            let both = count > 0 && right_count > 0;
            if both && work < least && allowed([count, right_count]) {
                (least, best) = (work, Some((slab, work)));
            }
        }
        best
    }
}

impl Cut {
    /// Parts the first `count` of `slots`: the left ones come first, the right ones follow; what is on both
    /// sides is there twice. Returns how many each side has, or `None`, with all refs in some order,
    /// when the slots are too few.
    pub fn part(
        &self,
        slots: &mut [PrimRef],
        count: usize,
        shapes: &mut Shapes,
    ) -> Option<[usize; 2]> {
        let side = |r: &PrimRef| {
            let [first, last] = self.slabs.of(r);
            (last[self.axis] >= self.slab, first[self.axis] >= self.slab)
        };
        // Left ones, those on both sides, right ones.
        let refs = slots.get_mut(..count)?;
        let left = to_front(refs, |r| !side(r).0);
        let mut middle = left + to_front(refs.get_mut(left..)?, |r| !side(r).1);
        let mut end = count;
        if middle - left > slots.len() - count {
            return None;
        }
        let wall = self.slabs.wall(self.axis, self.slab);
        let mut at = left;
        while at < middle {
            let r = *slots.get(at)?;
            let parts = clip(&r, shapes.get(r.id()), self.axis, wall);
            *slots.get_mut(at)? = parts[0].or(parts[1]).unwrap_or(r);
            match parts {
                [Some(_), Some(right)] => {
                    *slots.get_mut(end)? = right;
                    end += 1;
                    at += 1;
                }
                [None, Some(_)] => {
                    middle -= 1;
                    slots.swap(at, middle);
                }
                _ => at += 1,
            }
        }
        Some([middle, end - middle])
    }
}

/// Brings what is `first` to the front; returns how many that are.
fn to_front(refs: &mut [PrimRef], first: impl Fn(&PrimRef) -> bool) -> usize {
    let mut count = 0;
    for i in 0..refs.len() {
        let is_first = first(&refs[i]);
        refs.swap(i, count);
        count += usize::from(is_first);
    }
    count
}

/// Half the surface area of where two boxes overlap; 0 if they do not.
pub(super) fn overlap(areas: Areas, [a, b]: [&Box4; 2]) -> f32 {
    let [a, b] = [a.aabb(), b.aabb()];
    let both = Aabb {
        lower: core::array::from_fn(|k| a.lower[k].max(b.lower[k])),
        upper: core::array::from_fn(|k| a.upper[k].min(b.upper[k])),
    };
    let apart = (0..3).any(|k| both.lower[k] > both.upper[k]);
    if apart { 0.0 } else { areas.of(&both) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{BvhNode, Geometry};
    use crate::bvh::bins::Effort;
    use crate::bvh::branch::grow;
    use crate::bvh::tree::{Depth, Grown, Limits};
    use crate::caller::Caller;
    use crate::prim::{Shape, Source};
    use crate::scene::{Mesh, Scene};
    use std::vec::Vec;

    /// Long thin triangles across each other, among many small ones; all coordinates are integers.
    fn triangles() -> Vec<[[f32; 3]; 3]> {
        let mut state = 7u32;
        let mut next = |below: u32| {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            ((state >> 16) % below) as f32
        };
        let small = (0..900).map(|_| {
            let [x, y, z] = [0; 3].map(|_| next(4000));
            [[x, y, z], [x + 8.0, y, z], [x, y + 8.0, z + 8.0]]
        });
        let mut all: Vec<_> = small.collect();
        for i in 0..100 {
            let at = 40.0 * i as f32;
            all.push([[0.0, at, at], [4096.0, 4096.0 - at, at], [4096.0, at, 4096.0 - at]]);
        }
        all
    }

    #[test]
    fn cut_triangles_are_covered_by_their_parts() {
        let triangles = triangles();
        let meshes = [Mesh::soup(&triangles)];
        let scene = Scene::new(&meshes, &[]);
        let geometries = [Geometry { first: 0, mask: u32::MAX }];
        let count = triangles.len();
        let shape = |i: usize| Shape::Triangle(triangles[i]);
        let mut slots: Vec<_> =
            (0..count).map(|i| PrimRef::new(i as u32, &shape(i).aabb(), false)).collect();
        slots.resize(count + count / 4, slots[0]);
        let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * count];
        let source = Some(Source { scene: &scene, geometries: &geometries, named: false });
        let limits = Limits { source, ..Limits::new(count, 5, Depth::Deep, Effort::BEST) };
        let caller = &Caller::new(None, None);
        let size = grow(&mut nodes, &mut slots, count, &limits, caller).expect("room");
        assert!(size.refs > count + 100, "{} of {} slots", size.refs, slots.len());
        let mut parts = std::vec![Vec::new(); count];
        for node in nodes[..size.nodes].iter().enumerate().filter(|(i, n)| *i != 1 && n.is_leaf()) {
            let first = node.1.first as usize;
            for r in &slots[first..first + Grown::of(node.1).0] {
                parts[r.id() as usize].push(node.1.aabb());
            }
        }
        for (corners, parts) in triangles.iter().zip(&parts) {
            for (i, j) in (0..=64).flat_map(|i| (0..=64 - i).map(move |j| (i, j))) {
                // Weights of 64ths: the points are floats without error in f64.
                let weights = [i, j, 64 - i - j].map(|w| f64::from(w) / 64.0);
                let point: [f64; 3] = core::array::from_fn(|k| {
                    (0..3).map(|c| weights[c] * f64::from(corners[c][k])).sum()
                });
                let held = parts.iter().any(|part| {
                    (0..3).all(|k| {
                        f64::from(part.lower[k]) <= point[k] && point[k] <= f64::from(part.upper[k])
                    })
                });
                assert!(held, "{corners:?} {point:?}");
            }
        }
    }
}
