//! What primitives are, which of them can be hit, where they are, and how many there may be.

use crate::block::Geometry;
use crate::error::BuildError;
use crate::interval::triangle::has_area;
use crate::kinds::{BALLS, INSTANCES, REFIT, SPHERES};
use crate::math::rounding::{f32_above, f32_below};
use crate::math::{Aabb, wide};
use crate::scene::Scene;

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
            Shape::Triangle(corners) => is_sound(corners),
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
            Shape::Triangle(corners) => box_around(corners),
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

/// Whether a triangle can be hit: finite, with area.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
pub(super) fn is_sound(corners: [[f32; 3]; 3]) -> bool {
    // Looked at all together: a branch for each takes longer. Zero unless one is infinite or NaN.
    let [a, b, c] = corners.map(|[x, y, z]| (x * 0.0 + y * 0.0) + z * 0.0);
    let finite = (a + b) + c == 0.0;
    finite && has_area(corners)
}

/// The smallest box around a triangle.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
pub(crate) fn box_around([a, b, c]: [[f32; 3]; 3]) -> Aabb {
    // Of equal zeros the first stays, as in `Aabb::add`.
    let least = |x: f32, y: f32| if y < x { y } else { x };
    let most = |x: f32, y: f32| if y > x { y } else { x };
    let mut aabb = Aabb { lower: a, upper: a };
    for k in 0..3 {
        aabb.lower[k] = least(least(a[k], b[k]), c[k]);
        aabb.upper[k] = most(most(a[k], b[k]), c[k]);
    }
    aabb
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
