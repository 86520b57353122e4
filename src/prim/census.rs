//! What of a scene can be hit, and within what bounds.

use core::ops::Range;

use super::gather::{GRAIN, Shape, Survey, box_around, is_sound};
use super::names::Names;
use super::visit::{Visitor, visit};
use crate::block::Census;
use crate::caller::Caller;
use crate::error::BuildError;
use crate::kinds::THREADS;
use crate::math::Aabb;
use crate::scene::Scene;

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
        let tally = |range: Range<usize>| {
            let mut tally = Tally { census: none, missing: None };
            visit(scene, range.start as u32..range.end as u32, &mut tally);
            tally
        };
        let mut missing = None;
        let mut take = |part: Tally| {
            census.add(&part.census);
            missing = missing.or(part.missing);
        };
        if THREADS {
            caller.for_parts(count, caller.part_size(count, GRAIN), tally, take);
        } else {
            take(tally(0..count));
        }
        missing.map_or(Ok(census), |id| Err(incomplete(scene, id)))
    }

    fn add(&mut self, other: &Census) {
        self.bounds.add(&other.bounds);
        self.longest = self.longest.max(other.longest);
        self.triangle_count += other.triangle_count;
        self.sphere_count += other.sphere_count;
        self.ignored_count += other.ignored_count;
    }

    /// Takes in the box of something that can be hit.
    #[inline(always)]
    fn extend(&mut self, aabb: &Aabb) {
        self.bounds.add(aabb);
        for (lower, upper) in aabb.lower.into_iter().zip(aabb.upper) {
            self.longest = self.longest.max(upper - lower);
        }
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
                self.census.extend(&box_around(corners));
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
                self.census.extend(&shape.aabb());
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
