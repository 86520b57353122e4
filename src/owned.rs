//! A built structure in memory of its own: the outer shell, and the only place that allocates.

use core::marker::PhantomData;

use crate::accel::Accel;
use crate::build::{BuildOptions, Job, Structure};
use crate::caller::{Caller, Threads};
use crate::error::{BuildError, RefitError};
use crate::refit::refit;
use crate::scene::Scene;
use crate::storage::AlignedMemory;

/// The threads of rayon's pool, for [`BuildOptions::threads`].
#[cfg(feature = "parallel")]
#[derive(Clone, Copy, Debug, Default)]
pub struct Rayon;

#[cfg(feature = "parallel")]
impl Threads for Rayon {
    fn worker_count(&self) -> usize {
        rayon::current_num_threads()
    }

    fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_max_len(1).for_each(task);
    }
}

/// A built structure in memory of its own.
///
/// The scratch memory is given back after the build. What is built over instances borrows their accels for `'c`; all else
/// borrows nothing.
pub struct OwnedAccel<'c> {
    memory: AlignedMemory,
    children: PhantomData<&'c [u8]>,
}

impl OwnedAccel<'_> {
    /// Builds a BVH; see [`build_bvh`](crate::build_bvh).
    pub fn bvh<'c>(
        scene: &Scene<'_, 'c>,
        options: &BuildOptions,
    ) -> Result<OwnedAccel<'c>, BuildError> {
        Self::build(scene, options, options.bvh())
    }

    /// Builds a grid; see [`build_grid`](crate::build_grid).
    pub fn grid<'c>(
        scene: &Scene<'_, 'c>,
        options: &BuildOptions,
    ) -> Result<OwnedAccel<'c>, BuildError> {
        Self::build(scene, options, Structure::Grid(options.grid))
    }

    /// Builds what suits the scene; see [`build`](crate::build()).
    pub fn automatic<'c>(
        scene: &Scene<'_, 'c>,
        options: &BuildOptions,
    ) -> Result<OwnedAccel<'c>, BuildError> {
        Self::build(scene, options, Structure::Automatic)
    }

    fn build<'c>(
        scene: &Scene<'_, 'c>,
        options: &BuildOptions,
        structure: Structure,
    ) -> Result<OwnedAccel<'c>, BuildError> {
        let job = Job::new(scene, options, structure)?;
        let size = job.memory.size;
        let memory = AlignedMemory::new(size);
        let mut memory = memory.ok_or(BuildError::OutOfMemory { minimum: size })?;
        let used = job.run(memory.bytes_mut())?.len();
        Ok(OwnedAccel { memory: memory.shrunk(used), children: PhantomData })
    }

    /// Lets the structure follow `moved`, on `threads` if there are any: see [`AccelMut::refit`](crate::AccelMut::refit).
    pub fn refit(
        &mut self,
        moved: &Scene,
        threads: Option<&dyn Threads>,
    ) -> Result<f32, RefitError> {
        refit(self.memory.bytes_mut(), moved, &Caller::new(threads, None))
    }

    /// The structure and all that it refers to as one block, which borrows nothing; see [`Accel::pack`].
    pub fn packed(&self) -> Result<OwnedAccel<'static>, BuildError> {
        let accel = self.accel();
        let size = accel.pack_needs()?.size;
        let memory = AlignedMemory::new(size);
        let mut memory = memory.ok_or(BuildError::OutOfMemory { minimum: size })?;
        accel.pack_into(memory.bytes_mut())?;
        Ok(OwnedAccel { memory: memory.shrunk(size), children: PhantomData })
    }

    /// The structure. Cheap, but not free: keep the view while tracing.
    pub fn accel(&self) -> Accel<'_> {
        Accel::recognise(self.memory.bytes()).expect("a built block has a sound header")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Layout;
    use crate::build::PlainList;
    use crate::error::OpenError;
    use crate::scene::{Mesh, SphereSet};
    use std::vec::Vec;

    /// The first primitive id of a block over one geometry: behind the header and its line.
    const FIRST_ID: usize = 192;

    #[test]
    fn opening_looks_into_the_parts() {
        let triangles = [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]];
        let meshes = [Mesh::soup(&triangles)];
        let scene = Scene::new(&meshes, &[]);
        for plain_list in [PlainList::Never, PlainList::Always] {
            let options = BuildOptions { plain_list, ..Default::default() };
            for built in [OwnedAccel::bvh(&scene, &options), OwnedAccel::grid(&scene, &options)] {
                let built = built.expect("a structure");
                let block = built.accel().block();
                assert!(Accel::open(block).is_ok());
                let mut copy = AlignedMemory::new(block.len()).expect("memory");
                let bytes = copy.bytes_mut();
                bytes.copy_from_slice(block);
                assert!(Accel::open(bytes).is_ok());
                bytes[FIRST_ID] = 1;
                assert_eq!(Accel::open(bytes).err(), Some(OpenError::Corrupt));
            }
        }
    }

    /// Queries of bundles look for no nodes and no grid between the parts they use.
    #[test]
    fn a_block_has_one_structure() {
        const SIZE: usize = 16;
        const COUNTS: [usize; 3] = [96, 100, 104];
        let row = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let triangles: Vec<_> = (0..100).map(|i| row.map(|[x, y, _]| [x, y, i as f32])).collect();
        let meshes = [Mesh::soup(&triangles)];
        let options = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
        let built = OwnedAccel::bvh(&Scene::new(&meshes, &[]), &options).expect("a structure");
        assert!(matches!(built.accel().info().layout, Layout::Wide(_)));
        let block = built.accel().block();
        let size = block.len() + 64;
        for count in COUNTS {
            let mut copy = AlignedMemory::new(size).expect("memory");
            let bytes = copy.bytes_mut();
            bytes[..block.len()].copy_from_slice(block);
            bytes[SIZE..SIZE + 8].copy_from_slice(&(size as u64).to_ne_bytes());
            bytes[count..count + 4].copy_from_slice(&1u32.to_ne_bytes());
            assert_eq!(Accel::recognise(bytes).err(), Some(OpenError::Corrupt));
        }
    }

    /// Whatever the bytes hold, even if they were never opened, no panic and no endless loop.
    #[test]
    fn any_bytes_may_be_refitted() {
        let vertices: Vec<_> = (0..300).map(|i| [i as f32, (i * i % 17) as f32, 0.5]).collect();
        let indices: Vec<_> = (0..298).map(|i| [i, i + 1, i + 2]).collect();
        let spheres: Vec<_> = (0..40).map(|i| [i as f32, 3.0, 1.0, 0.25]).collect();
        let (meshes, sets) = ([Mesh::indexed(&vertices, &indices)], [SphereSet::new(&spheres)]);
        let scene = Scene::new(&meshes, &sets);
        let mut state = 1u32;
        let mut next = |end: usize| {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            (state >> 8) as usize % end
        };
        let never =
            BuildOptions { refit: true, plain_list: PlainList::Never, ..Default::default() };
        let list = BuildOptions { plain_list: PlainList::Always, ..never };
        let (mut refitted, mut refused) = (0, 0);
        for options in [list, never, BuildOptions { layout: Layout::Compact, ..never }] {
            let built = OwnedAccel::bvh(&scene, &options).expect("a structure");
            let good = built.accel().block();
            let mut copy = AlignedMemory::new(good.len()).expect("memory");
            for _ in 0..1000 {
                copy.bytes_mut().copy_from_slice(good);
                let reach = if next(4) == 0 { 256 } else { good.len() };
                for _ in 0..=next(8) {
                    copy.bytes_mut()[next(reach)] = next(256) as u8;
                }
                let sound = Accel::open(copy.bytes()).is_ok();
                match refit(copy.bytes_mut(), &scene, &Caller::new(None, None)) {
                    Ok(_) => refitted += 1,
                    Err(_) => refused += 1,
                }
                assert!(!sound || Accel::open(copy.bytes()).is_ok(), "no block any more");
            }
        }
        assert!(refitted > 500 && refused > 100, "{refitted} {refused}");
    }
}
