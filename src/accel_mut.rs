//! A built structure that follows what moves, in the caller's memory.

use core::mem::MaybeUninit;

use crate::accel::Accel;
use crate::build::{BuildOptions, bvh_bytes};
use crate::caller::{Caller, Threads};
use crate::error::{BuildError, OpenError, RefitError};
use crate::refit::refit;
use crate::scene::Scene;

/// A built structure that can be refitted: the only view of its block.
pub struct AccelMut<'m>(&'m mut [u8]);

impl<'m> AccelMut<'m> {
    /// Builds a BVH; see [`build_bvh`](crate::build_bvh). With [`BuildOptions::refit`] it can be refitted.
    pub fn bvh(
        scene: &Scene,
        options: &BuildOptions,
        memory: &'m mut [MaybeUninit<u8>],
    ) -> Result<Self, BuildError> {
        bvh_bytes(scene, options, memory).map(AccelMut)
    }

    /// Opens a block that was built earlier; see [`Accel::open`].
    pub fn open(block: &'m mut [u8]) -> Result<Self, OpenError> {
        let size = Accel::open(block)?.block().len();
        Ok(AccelMut(&mut block[..size]))
    }

    /// The structure. Cheap, but not free: keep the view while tracing.
    pub fn accel(&self) -> Accel<'_> {
        Accel::recognise(self.0).expect("a built or opened block has a sound header")
    }

    /// Lets the structure follow `moved`: the scene that was built, with other vertices, spheres or masks. On `threads`,
    /// if there are any; the bytes do not depend on them.
    ///
    /// Meshes, sphere sets, counts and vertex numbers must be the same. Where things are does not matter: what ceases to be
    /// finite or to have an area is ignored, and what was ignored may become visible. Answers are those of a structure that
    /// is built anew; how fast they come depends on how good the tree still is. Returned is what a ray
    /// costs by the surface area heuristic, over that when the block was built: from about 2 on a new build is likely to
    /// pay. On an error nothing was written. Needs no memory, and time in proportion to the primitives.
    pub fn refit(
        &mut self,
        moved: &Scene,
        threads: Option<&dyn Threads>,
    ) -> Result<f32, RefitError> {
        refit(self.0, moved, &Caller::new(threads, None))
    }
}
