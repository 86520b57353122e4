//! Primitives in sixteen lanes, to be looked at side by side.

use crate::math::Aabb;
use crate::prim::{Names, Shape, Visitor, visit};
use crate::scene::Scene;
use crate::simd::{Lanes, Simd, Width};
use core::ops::Range;

/// Up to sixteen primitives, their corners side by side.
///
/// ```text
/// corners[corner][axis]   | lane 0 | lane 1 | ..
/// ```
///
/// What is no triangle has three corners around which its box is.
pub(super) struct Sixteen {
    pub corners: [[[f32; 16]; 3]; 3],
    pub ids: [u32; 16],
    pub count: usize,
    /// The lanes that are triangles.
    pub triangles: u32,
}

impl Sixteen {
    pub const EMPTY: Self =
        Sixteen { corners: [[[0.0; 16]; 3]; 3], ids: [0; 16], count: 0, triangles: 0 };

    /// Adds a primitive; whether that was the last for which there is room.
    #[inline(always)]
    pub fn push(&mut self, id: u32, shape: &Shape) -> bool {
        match *shape {
            Shape::Triangle(corners) => self.push_triangle(id, corners),
            Shape::Sphere { .. } | Shape::Box(_) => {
                let aabb = shape.aabb();
                self.put(id, [aabb.lower, aabb.upper, aabb.upper])
            }
        }
    }

    /// The same of a triangle.
    #[inline(always)]
    pub fn push_triangle(&mut self, id: u32, corners: [[f32; 3]; 3]) -> bool {
        self.triangles |= 1 << (self.count % 16);
        self.put(id, corners)
    }

    #[inline(always)]
    fn put(&mut self, id: u32, corners: [[f32; 3]; 3]) -> bool {
        let lane = self.count % 16;
        for (corner, p) in self.corners.iter_mut().zip(corners) {
            for (axis, x) in corner.iter_mut().zip(p) {
                axis[lane] = x;
            }
        }
        self.ids[lane] = id;
        self.count += 1;
        self.count == 16
    }

    pub fn clear(&mut self) {
        (self.count, self.triangles) = (0, 0);
    }

    /// The primitive in a lane, or what stands for it.
    pub fn shape(&self, lane: usize) -> Shape {
        let [a, b, c] = self.corners.map(|corner| corner.map(|axis| axis[lane % 16]));
        let is_triangle = self.triangles >> lane & 1 == 1;
        if is_triangle {
            Shape::Triangle([a, b, c])
        } else {
            Shape::Box(Aabb { lower: a, upper: b })
        }
    }

    /// The coordinates of all three corners along an axis.
    #[inline(always)]
    pub fn along<S: Simd>(&self, s: S, axis: usize) -> [<S as Width<16>>::V; 3] {
        let [a, b, c] = &self.corners;
        let (a, b, c) = (&a[axis % 3], &b[axis % 3], &c[axis % 3]);
        [Width::<16>::load(s, a), Width::<16>::load(s, b), Width::<16>::load(s, c)]
    }
}

/// The least and the largest of three.
#[inline(always)]
pub(super) fn ends<V: Lanes<16>>([a, b, c]: [V; 3]) -> [V; 2] {
    [a.min(b).min(c), a.max(b).max(c)]
}

/// Calls `f` with the primitives in `range` that can be hit, sixteen at a time and in order; with `sound`, all of them can.
#[inline]
pub(super) fn for_each_sixteen(
    scene: &Scene,
    range: Range<usize>,
    sound: bool,
    f: impl FnMut(&Sixteen),
) {
    let mut gathering = Gathering { sound, sixteen: Sixteen::EMPTY, f };
    visit(scene, range.start as u32..range.end as u32, &mut gathering);
    (gathering.f)(&gathering.sixteen);
}

/// Gathers primitives for a function.
struct Gathering<F> {
    sound: bool,
    sixteen: Sixteen,
    f: F,
}

impl<F: FnMut(&Sixteen)> Gathering<F> {
    #[inline(always)]
    fn show(&mut self) {
        (self.f)(&self.sixteen);
        self.sixteen.clear();
    }
}

impl<F: FnMut(&Sixteen)> Visitor for Gathering<F> {
    #[inline(always)]
    fn triangle(&mut self, id: u32, corners: Option<[[f32; 3]; 3]>, _names: Names) {
        let is_sound = |corners| self.sound || Shape::Triangle(corners).sound().is_some();
        let corners = corners.filter(|corners| is_sound(*corners));
        if corners.is_some_and(|corners| self.sixteen.push_triangle(id, corners)) {
            self.show();
        }
    }

    #[inline(always)]
    fn other(&mut self, id: u32, shape: Shape) {
        if shape.sound().is_some_and(|shape| self.sixteen.push(id, &shape)) {
            self.show();
        }
    }
}
