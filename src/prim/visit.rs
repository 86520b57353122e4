//! The scene as a run of flat numbers.

use core::ops::Range;

use super::gather::{Shape, is_sound, sphere};
use super::names::Names;
use crate::kinds::{INSTANCES, SPHERES};
use crate::scene::Scene;
use crate::simd::SMALL;

/// A primitive that can be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prim {
    /// Its flat number.
    pub id: u32,
    pub shape: Shape,
}

/// Looks at primitives one after the other. Where that is a million triangles it is no closure: what it does is inlined
/// where they are read, since handing each over in memory takes longer than looking at it.
pub(crate) trait Visitor {
    /// Triangle `id`, whether it can be hit or not; `None` for one without its vertices.
    fn triangle(&mut self, id: u32, corners: Option<[[f32; 3]; 3]>, names: Names);

    /// What else there is.
    fn other(&mut self, id: u32, shape: Shape);
}

/// Shows the primitives with the numbers in `range`, in order. Where room is scarce all visitors share one loop.
#[inline]
pub(crate) fn visit(scene: &Scene, range: Range<u32>, visitor: &mut impl Visitor) {
    #[inline(never)]
    fn shared(scene: &Scene, range: Range<u32>, visitor: &mut dyn Visitor) {
        show(scene, range, visitor);
    }
    if SMALL { shared(scene, range, visitor) } else { show(scene, range, visitor) }
}

#[inline]
fn show<V: Visitor + ?Sized>(scene: &Scene, range: Range<u32>, visitor: &mut V) {
    let Range { start, end } = range;
    if let Some(boxes) = scene.boxes().filter(|_| INSTANCES) {
        return (start..end.min(boxes.count() as u32))
            .for_each(|i| visitor.other(i, Shape::Box(boxes.aabb(i as usize))));
    }
    let mut first = 0;
    // The part of a geometry with `count` primitives that is in the range.
    let mut next = |count: usize| {
        let base = first;
        first += count as u32;
        (base, start.max(base) - base..end.min(first).max(base) - base)
    };
    for mesh in (0..scene.mesh_count()).filter_map(|m| scene.mesh(m)) {
        let (base, part) = next(mesh.triangle_count());
        for i in part {
            let corners = mesh.triangle(i as usize);
            visitor.triangle(base + i, corners, Names(Some((&mesh, base, i))));
        }
    }
    if !SPHERES {
        return;
    }
    for set in (0..scene.sphere_set_count()).filter_map(|s| scene.sphere_set(s)) {
        let (base, part) = next(set.sphere_count());
        for i in part {
            if let Some(of_set) = set.sphere(i as usize) {
                visitor.other(base + i, sphere(of_set));
            }
        }
    }
}

/// Calls `f` with each primitive in `range` that can be hit, and with what knows its vertices by name; with `sound`, all
/// of them can.
#[inline]
pub(crate) fn for_each_named_in(
    scene: &Scene,
    range: Range<u32>,
    sound: bool,
    f: impl FnMut(Prim, Names),
) {
    visit(scene, range, &mut Each { sound, f });
}

/// Calls a function.
struct Each<F> {
    sound: bool,
    f: F,
}

impl<F: FnMut(Prim, Names)> Visitor for Each<F> {
    #[inline(always)]
    fn triangle(&mut self, id: u32, corners: Option<[[f32; 3]; 3]>, names: Names) {
        if let Some(corners) = corners.filter(|corners| self.sound || is_sound(*corners)) {
            (self.f)(Prim { id, shape: Shape::Triangle(corners) }, names);
        }
    }

    #[inline(always)]
    fn other(&mut self, id: u32, shape: Shape) {
        if let Some(shape) = if self.sound { Some(shape) } else { shape.sound() } {
            (self.f)(Prim { id, shape }, Names(None));
        }
    }
}
