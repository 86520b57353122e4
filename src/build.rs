//! Builds: what may be chosen, how much memory it takes, and which structure it becomes.

use core::mem::MaybeUninit;

use crate::accel::{Accel, Layout};
use crate::block::Census;
use crate::error::{BuildError, Unsupported};
use crate::prim::{Survey, survey};
use crate::scene::Scene;
use crate::storage::{self, ALIGNMENT};
use crate::{bvh, grid, list};

/// How much memory a build wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Enough for all the options ask, scratch included; a multiple of `alignment`.
    pub size: usize,
    /// The least that is accepted; below it the build is refused.
    pub minimum: usize,
    /// 64.
    pub alignment: usize,
}

/// How much time a build may take for the sake of the rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Binned SAH.
    #[default]
    Balanced,
    /// For a structure that is built every frame. Not in this version.
    Fast,
    /// For a structure that is built once. Not in this version.
    Best,
}

/// Whether a plain list may stand for the structure asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlainList {
    /// For a handful of primitives, which no structure makes faster.
    #[default]
    Automatic,
    /// Never: build the structure even over one primitive.
    Never,
    /// Always: every ray is tested against every leaf block.
    Always,
}

/// What a build may choose. The default in every field suits most scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BuildOptions {
    /// Time spent on building.
    pub quality: Quality,
    /// The layout of a BVH.
    pub layout: Layout,
    /// Whether the block must stay refittable. Not in this version.
    pub refit: bool,
    /// Whether a plain list may stand in.
    pub plain_list: PlainList,
}

/// The memory [`build_bvh`] needs for `scene`.
pub fn bvh_needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    Ok(Job::new(scene, options, options.bvh())?.memory)
}

/// The memory [`build_grid`] needs for `scene`.
pub fn grid_needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    Ok(Job::new(scene, options, Structure::Grid)?.memory)
}

/// Builds a BVH over `scene` at the front of `memory`.
///
/// `memory` starts at a multiple of 64 bytes and holds at least the minimum of [`bvh_needs`]; with
/// less than its size the leaves are larger, and in the last resort the layout is compact. The finished block is [`Accel::block`]; what lies behind
/// it is free again. On an error nothing was written.
pub fn build_bvh<'m>(
    scene: &Scene,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    Job::new(scene, options, options.bvh())?.run(memory)
}

/// Builds a regular grid over `scene` at the front of `memory`.
///
/// `memory` starts at a multiple of 64 bytes and holds at least the minimum of [`grid_needs`]; with
/// less than its size the grid is coarser, a fifth of its cells along each axis at a time. The
/// finished block is [`Accel::block`]; what lies behind it is free again. On an error nothing was
/// written.
pub fn build_grid<'m>(
    scene: &Scene,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    Job::new(scene, options, Structure::Grid)?.run(memory)
}

/// What a build makes of a scene.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Structure {
    List,
    Grid,
    Bvh,
    /// A BVH of bundles with this many lanes.
    Wide(u32),
}

/// A build that was checked and sized, but not begun.
pub(crate) struct Job<'s, 'a> {
    scene: &'s Scene<'a>,
    survey: Survey,
    census: Census,
    structure: Structure,
    pub memory: Memory,
}

impl<'s, 'a> Job<'s, 'a> {
    pub fn new(
        scene: &'s Scene<'a>,
        options: &BuildOptions,
        asked: Structure,
    ) -> Result<Self, BuildError> {
        options.check()?;
        let survey = survey(scene)?;
        let census = Census::take(scene, &survey)?;
        let handful = match options.plain_list {
            PlainList::Automatic => list::HANDFUL,
            PlainList::Never => 0,
            PlainList::Always => u32::MAX,
        };
        let structure = if census.hittable() <= handful { Structure::List } else { asked };
        let (size, minimum) = match structure {
            Structure::List => list::needs(&survey, &census)?,
            Structure::Grid => grid::needs(scene, &survey, &census)?,
            Structure::Bvh => bvh::needs(&survey, &census)?,
            Structure::Wide(width) => bvh::needs_wide(&survey, &census, width)?,
        };
        let memory = Memory { size, minimum, alignment: ALIGNMENT };
        Ok(Job { scene, survey, census, structure, memory })
    }

    pub fn run<'m>(&self, memory: &'m mut [MaybeUninit<u8>]) -> Result<Accel<'m>, BuildError> {
        let Memory { size, minimum, alignment } = self.memory;
        if !memory.as_ptr().addr().is_multiple_of(alignment) {
            return Err(BuildError::Misaligned);
        }
        if memory.len() < minimum {
            return Err(BuildError::OutOfMemory { minimum });
        }
        let usable = memory.len().min(size);
        let bytes = storage::zeroed(&mut memory[..usable]);
        let Job { scene, survey, census, .. } = self;
        match self.structure {
            Structure::List => list::build(scene, survey, census, bytes)?,
            Structure::Grid => grid::build(scene, survey, census, bytes)?,
            Structure::Bvh => bvh::build(scene, survey, census, bytes)?,
            Structure::Wide(width) => bvh::build_wide(scene, survey, census, width, bytes)?,
        };
        // A block that was just sealed is always recognised, so this error does not arise.
        Accel::recognise(bytes).map_err(|_| BuildError::OutOfMemory { minimum })
    }
}

impl BuildOptions {
    fn check(&self) -> Result<(), BuildError> {
        match self.layout {
            Layout::Automatic | Layout::Compact | Layout::Wide(4 | 8 | 16) => {}
            Layout::Wide(width) => return Err(BuildError::NoSuchLayout { width }),
        }
        if self.quality != Quality::Balanced {
            return Err(BuildError::Unsupported(Unsupported::Quality));
        }
        if self.refit {
            return Err(BuildError::Unsupported(Unsupported::Refit));
        }
        Ok(())
    }

    /// The structure of a BVH with this layout.
    pub(crate) fn bvh(&self) -> Structure {
        match self.layout {
            Layout::Automatic => Structure::Wide(16),
            Layout::Compact => Structure::Bvh,
            Layout::Wide(width) => Structure::Wide(width),
        }
    }
}
