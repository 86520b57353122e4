//! What of a scene can be hit, and within what bounds.

use super::gather::{GRAIN, Shape, Survey, box_around, is_sound};
use super::names::Names;
use super::visit::{Visitor, visit};
use crate::block::Census;
use crate::caller::Caller;
use crate::error::BuildError;
use crate::math::Aabb;
use crate::scene::Scene;

impl Census {
    /// Counts what can be hit, finds its bounds, and checks that every triangle has its vertices.
    pub fn take(scene: &Scene, survey: &Survey, caller: &Caller) -> Result<Census, BuildError> {
        let mut census = Census {
            bounds: Aabb::EMPTY,
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
        let tallies = caller.map_parts(count, caller.part_size(count, GRAIN), |range| {
            let mut tally = Tally { census: none, missing: None };
            visit(scene, range.start as u32..range.end as u32, &mut tally);
            tally.missing.map_or(Ok(tally.census), Err)
        });
        for part in tallies {
            census.add(&part.map_err(|id| incomplete(scene, id))?);
        }
        Ok(census)
    }

    fn add(&mut self, other: &Census) {
        self.bounds.add(&other.bounds);
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

/// What is found in a range.
struct Tally {
    census: Census,
    /// The first triangle without its vertices.
    missing: Option<u32>,
}

impl Visitor for Tally {
    #[inline(always)]
    fn triangle(&mut self, id: u32, corners: Option<[[f32; 3]; 3]>, _names: Names) {
        match corners {
            Some(corners) if is_sound(corners) => {
                self.census.bounds.add(&box_around(corners));
                self.census.triangle_count += 1;
            }
            Some(_) => self.census.ignored_count += 1,
            None => self.missing = self.missing.or(Some(id)),
        }
    }

    #[inline(always)]
    fn other(&mut self, _id: u32, shape: Shape) {
        match shape.sound() {
            Some(shape) => {
                self.census.bounds.add(&shape.aabb());
                self.census.sphere_count += 1;
            }
            None => self.census.ignored_count += 1,
        }
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
