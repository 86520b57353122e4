//! A built structure in memory of its own: the outer shell, and the only place that allocates.

use crate::accel::Accel;
use crate::build::{BuildOptions, Memory, build_bvh, build_grid, bvh_needs, grid_needs};
use crate::error::BuildError;
use crate::scene::Scene;
use crate::storage::AlignedMemory;

/// A built structure in memory of its own.
///
/// The block is moved to a place of its own size after the build, so nothing of the scratch memory
/// stays.
pub struct OwnedAccel {
    memory: AlignedMemory,
}

impl OwnedAccel {
    /// Builds a BVH; see [`build_bvh`].
    pub fn bvh(scene: &Scene, options: &BuildOptions) -> Result<Self, BuildError> {
        let Memory { size, .. } = bvh_needs(scene, options)?;
        let mut memory = allocate(size)?;
        let used = build_bvh(scene, options, memory.uninit())?.block().len();
        Self::keep(memory, used)
    }

    /// Builds a grid; see [`build_grid`].
    pub fn grid(scene: &Scene, options: &BuildOptions) -> Result<Self, BuildError> {
        let Memory { size, .. } = grid_needs(scene, options)?;
        let mut memory = allocate(size)?;
        let used = build_grid(scene, options, memory.uninit())?.block().len();
        Self::keep(memory, used)
    }

    fn keep(memory: AlignedMemory, used: usize) -> Result<Self, BuildError> {
        let tight = memory.moved(used).ok_or(BuildError::OutOfMemory { minimum: used })?;
        Ok(OwnedAccel { memory: tight })
    }

    /// The structure. Cheap, but not free: keep the view while tracing.
    pub fn accel(&self) -> Accel<'_> {
        Accel::recognise(self.memory.bytes()).expect("a built block has a sound header")
    }
}

fn allocate(size: usize) -> Result<AlignedMemory, BuildError> {
    AlignedMemory::new(size).ok_or(BuildError::OutOfMemory { minimum: size })
}
