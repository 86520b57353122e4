//! The scene as a run of flat numbers: which primitives can be hit, and where they are.

use core::ops::Range;

use super::names::Names;
use crate::block::{Census, Geometry};
use crate::caller::Caller;
use crate::error::BuildError;
use crate::interval::triangle::has_area;
use crate::kinds::{BALLS, INSTANCES, REFIT, SPHERES, THREADS};
use crate::math::rounding::{f32_above, f32_below};
use crate::math::{Aabb, wide};
use crate::scene::Scene;
use crate::simd::SMALL;

/// Flat numbers and block references leave two bits for other uses.
const MOST_PRIMS: usize = 1 << 30;

/// Primitives are shared out in multiples of this many.
pub(crate) const GRAIN: usize = 4096;

/// What a primitive is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Triangle([[f32; 3]; 3]),
    Sphere {
        centre: [f32; 3],
        radius: f32,
    },
    /// What is somewhere in a box: an instance, to those who build the index over them.
    Box(Aabb),
}

/// A primitive that can be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prim {
    /// Its flat number.
    pub id: u32,
    pub shape: Shape,
}

/// How large the scene is, before anything is known of its primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Survey {
    pub mesh_count: u32,
    pub geometry_count: u32,
    pub triangle_limit: u32,
    pub prim_limit: u32,
}

impl Shape {
    /// The shape, if it can be hit: finite, with area or radius.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn sound(self) -> Option<Shape> {
        let sound = match self {
            Shape::Triangle(corners) => {
                // Looked at all together: a branch for each takes longer. Zero unless one is infinite or NaN.
                let [a, b, c] = corners.map(|[x, y, z]| (x * 0.0 + y * 0.0) + z * 0.0);
                let finite = (a + b) + c == 0.0;
                finite && has_area(corners)
            }
            Shape::Sphere { .. } if !SPHERES => false,
            Shape::Sphere { centre, radius } => {
                centre.iter().all(|x| x.is_finite()) && radius.is_finite() && radius > 0.0
            }
            Shape::Box(aabb) => INSTANCES && aabb.lower[0] <= aabb.upper[0],
        };
        sound.then_some(self)
    }

    /// The box of a shape that perhaps cannot be hit, for a builder: within `bounds`, and finite if those are. Where it is
    /// going to appear nobody knows; as much of it as is within the bounds is a guess that is in nobody's way.
    pub fn place(self, bounds: &Aabb) -> Aabb {
        if let Some(sound) = self.sound() {
            return sound.aabb();
        }
        if !REFIT {
            return Aabb::EMPTY;
        }
        let points = match self {
            Shape::Triangle(corners) => corners,
            Shape::Sphere { centre, .. } => [centre; 3],
            Shape::Box(aabb) => return aabb,
        };
        let mut aabb = Aabb::EMPTY;
        // Not so for NaN.
        for point in points.into_iter().filter(|point| bounds.nearest(*point) == *point) {
            aabb.add(&Aabb { lower: point, upper: point });
        }
        let nowhere = aabb == Aabb::EMPTY;
        if nowhere { Aabb::around(&[bounds.nearest(points[0])]) } else { aabb }
    }

    /// A box around the shape; for triangles the smallest. It may be infinite for huge spheres.
    #[inline(always)]
    pub fn aabb(&self) -> Aabb {
        match *self {
            Shape::Triangle([a, b, c]) => {
                // Of equal zeros the first stays, as in `Aabb::add`; but without a branch.
                let least = |x: f32, y: f32| if y < x { y } else { x };
                let most = |x: f32, y: f32| if y > x { y } else { x };
                let mut aabb = Aabb { lower: a, upper: a };
                for k in 0..3 {
                    aabb.lower[k] = least(least(a[k], b[k]), c[k]);
                    aabb.upper[k] = most(most(a[k], b[k]), c[k]);
                }
                aabb
            }
            _ if !BALLS => Aabb::EMPTY,
            Shape::Sphere { centre, radius } => {
                // Sums of two floats far apart in size are rounded in f64 too: one step outwards
                // makes up for it.
                let (centre, radius) = (wide(centre), f64::from(radius));
                let lower = (centre - radius).to_array().map(|x| f32_below(x.next_down()));
                let upper = (centre + radius).to_array().map(|x| f32_above(x.next_up()));
                Aabb { lower, upper }
            }
            Shape::Box(aabb) => aabb,
        }
    }

    /// Whether it is a triangle. What is not goes where spheres go.
    pub fn is_triangle(&self) -> bool {
        !BALLS || matches!(self, Shape::Triangle(_))
    }
}

/// Counts the scene.
pub(crate) fn survey(scene: &Scene) -> Result<Survey, BuildError> {
    let mut prims = 0usize;
    let mut count = |n: usize| -> Result<(), BuildError> {
        prims = prims.checked_add(n).filter(|n| *n < MOST_PRIMS).ok_or(BuildError::TooLarge)?;
        Ok(())
    };
    if let Some(boxes) = scene.boxes() {
        count(boxes.count())?;
        let prim_limit = prims as u32;
        return Ok(Survey { mesh_count: 0, geometry_count: 1, triangle_limit: 0, prim_limit });
    }
    let geometries = scene.mesh_count().checked_add(scene.sphere_set_count());
    let geometry_count = geometries.filter(|n| *n < MOST_PRIMS).ok_or(BuildError::TooLarge)?;
    for mesh in (0..scene.mesh_count()).filter_map(|m| scene.mesh(m)) {
        count(mesh.triangle_count())?;
    }
    let mut spheres = 0;
    for set in (0..scene.sphere_set_count()).filter_map(|s| scene.sphere_set(s)) {
        count(set.sphere_count())?;
        spheres += set.sphere_count();
    }
    Ok(Survey {
        mesh_count: scene.mesh_count() as u32,
        geometry_count: geometry_count as u32,
        triangle_limit: (prims - spheres) as u32,
        prim_limit: prims as u32,
    })
}

/// What is called with shapes. Unlike a closure's address, that of one of these stands for one copy of its code.
trait Take<T> {
    fn take(&mut self, what: T, names: Names);
}

impl<T, F: FnMut(T, Names)> Take<T> for F {
    fn take(&mut self, what: T, names: Names) {
        self(what, names);
    }
}

/// Calls `f` with the numbers in `range` and what has them, `None` for a triangle without vertices; and with what knows
/// its vertices by name. Where room is scarce all share one loop.
#[inline]
fn for_each_shape(
    scene: &Scene,
    range: Range<u32>,
    mut f: impl FnMut((u32, Option<Shape>), Names),
) {
    #[inline(never)]
    fn shared(scene: &Scene, range: Range<u32>, f: &mut dyn Take<(u32, Option<Shape>)>) {
        each_shape(scene, range, |what, names| f.take(what, names));
    }
    if SMALL { shared(scene, range, &mut f) } else { each_shape(scene, range, f) }
}

#[inline]
fn each_shape(scene: &Scene, range: Range<u32>, mut f: impl FnMut((u32, Option<Shape>), Names)) {
    let Range { start, end } = range;
    if let Some(boxes) = scene.boxes().filter(|_| INSTANCES) {
        return (start..end.min(boxes.count() as u32))
            .for_each(|i| f((i, Some(Shape::Box(boxes.aabb(i as usize)))), Names(None)));
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
            let shape = mesh.triangle(i as usize).map(Shape::Triangle);
            f((base + i, shape), Names(Some((&mesh, base, i))));
        }
    }
    if !SPHERES {
        return;
    }
    for set in (0..scene.sphere_set_count()).filter_map(|s| scene.sphere_set(s)) {
        let (base, part) = next(set.sphere_count());
        for i in part {
            f((base + i, set.sphere(i as usize).map(sphere)), Names(None));
        }
    }
}

/// Calls `f` with each primitive that can be hit: quickly if the census found none that cannot.
#[inline]
pub(crate) fn for_each_counted(scene: &Scene, census: &Census, f: impl FnMut(Prim)) {
    for_each_prim_in(scene, 0..u32::MAX, census.ignored_count == 0, f);
}

/// Calls `f` with each primitive in `range` that can be hit; with `sound`, all of them can.
#[inline]
pub(crate) fn for_each_prim_in(
    scene: &Scene,
    range: Range<u32>,
    sound: bool,
    mut f: impl FnMut(Prim),
) {
    for_each_named_in(scene, range, sound, |prim, _| f(prim));
}

/// The same with the names of vertices.
#[inline]
pub(crate) fn for_each_named_in(
    scene: &Scene,
    range: Range<u32>,
    sound: bool,
    mut f: impl FnMut(Prim, Names),
) {
    #[inline(never)]
    fn shared(scene: &Scene, range: Range<u32>, sound: bool, f: &mut dyn Take<Prim>) {
        each_prim(scene, range, sound, |prim, names| f.take(prim, names));
    }
    if SMALL { shared(scene, range, sound, &mut f) } else { each_prim(scene, range, sound, f) }
}

#[inline]
fn each_prim(scene: &Scene, range: Range<u32>, sound: bool, mut f: impl FnMut(Prim, Names)) {
    for_each_shape(scene, range, |(id, shape), names| {
        if let Some(shape) = shape.and_then(|shape| if sound { Some(shape) } else { shape.sound() })
        {
            f(Prim { id, shape }, names);
        }
    });
}

/// A sphere of a set.
pub(super) fn sphere([x, y, z, radius]: [f32; 4]) -> Shape {
    Shape::Sphere { centre: [x, y, z], radius }
}

/// Writes the first number and the mask of each geometry.
pub(crate) fn geometries(scene: &Scene, out: &mut [Geometry]) {
    for (out, geometry) in out.iter_mut().zip(geometry_table(scene)) {
        *out = geometry;
    }
}

/// The first number and the mask of each geometry.
pub(crate) fn geometry_table(scene: &Scene) -> impl Iterator<Item = Geometry> {
    let meshes = (0..scene.mesh_count())
        .filter_map(|m| scene.mesh(m))
        .map(|mesh| (mesh.triangle_count(), mesh.mask()));
    let sets = (0..scene.sphere_set_count())
        .filter_map(|s| scene.sphere_set(s))
        .map(|set| (set.sphere_count(), set.mask()));
    let mut next = 0;
    meshes.chain(sets).map(move |(count, mask)| {
        let first = next;
        next += count as u32;
        Geometry { first, mask }
    })
}

impl Census {
    /// Counts what can be hit, finds its bounds, and checks that every triangle has its vertices.
    pub fn take(scene: &Scene, survey: &Survey, caller: &Caller) -> Result<Census, BuildError> {
        let mut census = Census {
            bounds: Aabb::EMPTY,
            longest: 0.0,
            mesh_count: survey.mesh_count,
            triangle_limit: survey.triangle_limit,
            prim_limit: survey.prim_limit,
            triangle_count: 0,
            sphere_count: 0,
            ignored_count: 0,
            is_index: scene.boxes().is_some(),
            refit: false,
        };
        let none = census;
        let count = survey.prim_limit as usize;
        if !THREADS {
            let counted = census.tally(scene, 0..count);
            return counted.map_or_else(|id| Err(incomplete(scene, id)), |()| Ok(census));
        }
        let tally = |range| {
            let mut part = none;
            part.tally(scene, range).map(|()| part)
        };
        let mut missing = None;
        let size = caller.part_size(count, GRAIN);
        caller.for_parts(count, size, tally, |part| match part {
            Ok(part) => census.add(&part),
            Err(id) => missing = missing.or(Some(id)),
        });
        missing.map_or(Ok(census), |id| Err(incomplete(scene, id)))
    }

    /// Adds the primitives in `range`. The error is the first triangle without its vertices.
    fn tally(&mut self, scene: &Scene, range: Range<usize>) -> Result<(), u32> {
        let range = range.start as u32..range.end as u32;
        let mut missing = None;
        for_each_shape(scene, range, |(id, shape), _| match shape.map(Shape::sound) {
            Some(Some(shape)) => {
                let aabb = shape.aabb();
                self.bounds.add(&aabb);
                for (lower, upper) in aabb.lower.into_iter().zip(aabb.upper) {
                    self.longest = self.longest.max(upper - lower);
                }
                match shape {
                    Shape::Triangle(_) => self.triangle_count += 1,
                    Shape::Sphere { .. } | Shape::Box(_) => self.sphere_count += 1,
                }
            }
            Some(None) => self.ignored_count += 1,
            None => missing = missing.or(Some(id)),
        });
        missing.map_or(Ok(()), Err)
    }

    fn add(&mut self, other: &Census) {
        self.bounds.add(&other.bounds);
        self.longest = self.longest.max(other.longest);
        self.triangle_count += other.triangle_count;
        self.sphere_count += other.sphere_count;
        self.ignored_count += other.ignored_count;
    }

    /// The same for a block that shall be refitted.
    pub fn for_refit(&self) -> Census {
        let nothing = self.bounds == Aabb::EMPTY;
        Census {
            bounds: if nothing { Aabb::around(&[[0.0; 3]]) } else { self.bounds },
            triangle_count: self.triangle_limit,
            sphere_count: self.prim_limit - self.triangle_limit,
            ignored_count: 0,
            refit: true,
            ..*self
        }
    }

    /// The number of primitives that can be hit.
    pub fn hittable(&self) -> u32 {
        self.triangle_count + self.sphere_count
    }

    /// Whether there are triangles and spheres that can be hit.
    pub fn is_mixed(&self) -> bool {
        self.triangle_count > 0 && self.sphere_count > 0
    }
}

/// What is wrong with triangle `id`, which has no vertices.
fn incomplete(scene: &Scene, id: u32) -> BuildError {
    let mut first = 0;
    for (m, mesh) in (0..).zip((0..scene.mesh_count()).filter_map(|m| scene.mesh(m))) {
        let triangle = id - first;
        if (triangle as usize) < mesh.triangle_count() {
            return match mesh.is_indexed() {
                true => BuildError::IndexOutOfRange { mesh: m, triangle },
                false => BuildError::VerticesMissing { mesh: m },
            };
        }
        first += mesh.triangle_count() as u32;
    }
    BuildError::TooLarge
}
