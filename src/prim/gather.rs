//! The scene as a run of flat numbers: which primitives can be hit, and where they are.

use crate::block::{Census, Geometry};
use crate::error::BuildError;
use crate::interval::triangle::has_area;
use crate::math::rounding::{f32_above, f32_below};
use crate::math::{Aabb, wide};
use crate::query::geometry_of;
use crate::scene::Scene;

/// Flat numbers and block references leave two bits for other uses.
const MOST_PRIMS: usize = 1 << 30;

/// What a primitive is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Triangle([[f32; 3]; 3]),
    Sphere { centre: [f32; 3], radius: f32 },
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
    fn sound(self) -> Option<Shape> {
        let sound = match self {
            Shape::Triangle(corners) => {
                corners.as_flattened().iter().all(|x| x.is_finite()) && has_area(corners)
            }
            Shape::Sphere { centre, radius } => {
                centre.iter().all(|x| x.is_finite()) && radius.is_finite() && radius > 0.0
            }
        };
        sound.then_some(self)
    }

    /// A box around the shape; for triangles the smallest. It may be infinite for huge spheres.
    pub fn aabb(&self) -> Aabb {
        match *self {
            Shape::Triangle(corners) => Aabb::around(&corners),
            Shape::Sphere { centre, radius } => {
                // Sums of two floats far apart in size are rounded in f64 too: one step outwards
                // makes up for it.
                let (centre, radius) = (wide(centre), f64::from(radius));
                let lower = (centre - radius).to_array().map(|x| f32_below(x.next_down()));
                let upper = (centre + radius).to_array().map(|x| f32_above(x.next_up()));
                Aabb { lower, upper }
            }
        }
    }
}

/// Counts the scene, and checks that every triangle has its vertices.
pub(crate) fn survey(scene: &Scene) -> Result<Survey, BuildError> {
    let mut prims = 0usize;
    let mut count = |n: usize| -> Result<(), BuildError> {
        prims = prims.checked_add(n).filter(|n| *n < MOST_PRIMS).ok_or(BuildError::TooLarge)?;
        Ok(())
    };
    let geometries = scene.mesh_count().checked_add(scene.sphere_set_count());
    let geometry_count = geometries.filter(|n| *n < MOST_PRIMS).ok_or(BuildError::TooLarge)?;
    for m in 0..scene.mesh_count() {
        let Some(mesh) = scene.mesh(m) else { continue };
        count(mesh.triangle_count())?;
        if let Some(triangle) = (0..mesh.triangle_count()).find(|&i| mesh.triangle(i).is_none()) {
            return Err(if mesh.is_indexed() {
                BuildError::IndexOutOfRange { mesh: m as u32, triangle: triangle as u32 }
            } else {
                BuildError::VerticesMissing { mesh: m as u32 }
            });
        }
    }
    let mut spheres = 0;
    for s in 0..scene.sphere_set_count() {
        let n = scene.sphere_set(s).map_or(0, |set| set.sphere_count());
        count(n)?;
        spheres += n;
    }
    Ok(Survey {
        mesh_count: scene.mesh_count() as u32,
        geometry_count: geometry_count as u32,
        triangle_limit: (prims - spheres) as u32,
        prim_limit: prims as u32,
    })
}

/// Calls `f` with each primitive that can be hit, in the order of flat numbers.
pub(crate) fn for_each_prim(scene: &Scene, mut f: impl FnMut(Prim)) {
    let mut id = 0;
    let mut offer = |shape: Option<Shape>| {
        if let Some(shape) = shape.and_then(Shape::sound) {
            f(Prim { id, shape });
        }
        id += 1;
    };
    for mesh in (0..scene.mesh_count()).filter_map(|m| scene.mesh(m)) {
        for i in 0..mesh.triangle_count() {
            offer(mesh.triangle(i).map(Shape::Triangle));
        }
    }
    for set in (0..scene.sphere_set_count()).filter_map(|s| scene.sphere_set(s)) {
        for i in 0..set.sphere_count() {
            offer(set.sphere(i).map(sphere));
        }
    }
}

/// The shape with flat number `id`, whether it can be hit or not.
pub(crate) fn shape(scene: &Scene, geometries: &[Geometry], id: u32) -> Option<Shape> {
    let (number, geometry) = geometry_of(id, geometries)?;
    let prim = (id - geometry.first) as usize;
    match (number as usize).checked_sub(scene.mesh_count()) {
        None => scene.mesh(number as usize)?.triangle(prim).map(Shape::Triangle),
        Some(set) => scene.sphere_set(set)?.sphere(prim).map(sphere),
    }
}

fn sphere([x, y, z, radius]: [f32; 4]) -> Shape {
    Shape::Sphere { centre: [x, y, z], radius }
}

/// Writes the first number and the mask of each geometry.
pub(crate) fn geometries(scene: &Scene, out: &mut [Geometry]) {
    let meshes = (0..scene.mesh_count())
        .filter_map(|m| scene.mesh(m))
        .map(|mesh| (mesh.triangle_count(), mesh.mask()));
    let sets = (0..scene.sphere_set_count())
        .filter_map(|s| scene.sphere_set(s))
        .map(|set| (set.sphere_count(), set.mask()));
    let mut first = 0;
    for (out, (count, mask)) in out.iter_mut().zip(meshes.chain(sets)) {
        *out = Geometry { first, mask };
        first += count as u32;
    }
}

impl Census {
    /// Counts what can be hit, and finds its bounds.
    pub fn take(scene: &Scene, survey: &Survey) -> Census {
        let mut census = Census {
            bounds: Aabb::EMPTY,
            mesh_count: survey.mesh_count,
            triangle_limit: survey.triangle_limit,
            prim_limit: survey.prim_limit,
            triangle_count: 0,
            sphere_count: 0,
            ignored_count: survey.prim_limit,
        };
        for_each_prim(scene, |prim| {
            census.bounds.add(&prim.shape.aabb());
            census.ignored_count -= 1;
            match prim.shape {
                Shape::Triangle(_) => census.triangle_count += 1,
                Shape::Sphere { .. } => census.sphere_count += 1,
            }
        });
        census
    }

    /// The number of primitives that can be hit.
    pub fn hittable(&self) -> u32 {
        self.triangle_count + self.sphere_count
    }
}
