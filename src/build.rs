//! Builds: what may be chosen, how much memory it takes, and which structure it becomes.

use core::fmt;
use core::mem::MaybeUninit;

use crate::accel::{Accel, Layout};
use crate::block::Census;
use crate::bvh::{self, Effort, How};
use crate::caller::{Caller, Threads};
use crate::choice::{Suited, are_few, suited};
use crate::error::BuildError;
use crate::grid::{self, GridKind, GridOptions};
use crate::instance::{Counted, Placed, fixed_size, write};
use crate::kinds::{GRID, INSTANCES, REFIT, SPHERES, WIDE};
use crate::list;
use crate::math::Aabb;
use crate::prim::{Survey, survey};
use crate::refit;
use crate::scene::Scene;
use crate::storage::{self, ALIGNMENT};

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
    /// SAH over 16 bins on each axis, for large nodes by samples; pairs of triangles as one.
    #[default]
    Balanced,
    /// For a structure that is built often: leaves are runs of triangles along a curve, unless a few are much larger than
    /// the others.
    Fast,
    /// For a structure that is built once: 32 bins, every primitive in them.
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
///
/// For the same choices a block has the same bytes on every machine and with any number of threads.
#[derive(Clone, Copy, Default)]
pub struct BuildOptions<'a> {
    /// Time spent on a BVH; grids have but one way. [`build()`] takes `Fast` for `Balanced` where rays are few.
    pub quality: Quality,
    /// The layout of a BVH.
    pub layout: Layout,
    /// Whether the block can be refitted when vertices move; for lists and BVHs. Vertices are then the same if their numbers
    /// are, nothing is cut in two, and what cannot be hit has a place, as it may be hit later. [`build()`] then makes no grid.
    pub refit: bool,
    /// Whether a plain list may stand in.
    pub plain_list: PlainList,
    /// How a grid divides space.
    pub grid: GridOptions,
    /// For [`build`], how many rays for each primitive will be traced before the next build; zero means many. Below six are few.
    pub rays_per_prim: f32,
    /// Threads that the build may use, and its `needs`; none of them is kept.
    pub threads: Option<&'a dyn Threads>,
    /// Told how far the build is, from 0 to 1, on the thread that builds; false cancels it. It is
    /// asked a few times a build, not at equal times.
    pub progress: Option<&'a dyn Fn(f32) -> bool>,
}

impl fmt::Debug for BuildOptions<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BuildOptions")
            .field("quality", &self.quality)
            .field("layout", &self.layout)
            .field("refit", &self.refit)
            .field("plain_list", &self.plain_list)
            .field("grid", &self.grid)
            .field("rays_per_prim", &self.rays_per_prim)
            .field("threads", &self.threads.map(|threads| threads.worker_count()))
            .field("progress", &self.progress.is_some())
            .finish()
    }
}

/// The memory [`build_bvh`] needs for `scene`.
pub fn bvh_needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    Ok(Job::new(scene, options, options.bvh())?.memory)
}

/// The memory [`build_grid`] needs for `scene`.
pub fn grid_needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    Ok(Job::new(scene, options, Structure::Grid(options.grid))?.memory)
}

/// Builds a BVH over `scene` at the front of `memory`.
///
/// `memory` starts at a multiple of 64 bytes and holds at least the minimum of [`bvh_needs`]; with
/// less than its size the leaves are larger, and in the last resort the layout is compact. The
/// finished block is [`Accel::block`]; what lies behind it is free again. On an error nothing was
/// written, unless the build was cancelled.
pub fn build_bvh<'m>(
    scene: &Scene<'_, 'm>,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    finished(bvh_bytes(scene, options, memory)?)
}

/// Builds a grid over `scene` at the front of `memory`.
///
/// `memory` starts at a multiple of 64 bytes and holds at least the minimum of [`grid_needs`]; with
/// less than its size the grid is coarser. In a uniform one the cells along each axis become fewer by a fifth, and again. In a nested one cells
/// that come later stay whole when there is no more room, those of the deepest grids first; if leaf blocks then do not fit, less
/// is listed by a quarter, and again; and where the outermost grid has no room it is halved along each axis. The last resort is one
/// cell. The finished block is [`Accel::block`]; what lies behind it is free again. On an error nothing was
/// written, unless the build was cancelled.
pub fn build_grid<'m>(
    scene: &Scene<'_, 'm>,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    finished(Job::new(scene, options, Structure::Grid(options.grid))?.run_in(memory)?)
}

/// The memory [`build`] needs for `scene`.
pub fn needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    Ok(Job::new(scene, options, Structure::Automatic)?.memory)
}

/// Builds at the front of `memory` what is likely to take the least time over `scene`, building it and tracing
/// [`rays_per_prim`](BuildOptions::rays_per_prim): a list, a grid or a BVH. All else as [`build_bvh`] and [`build_grid`].
pub fn build<'m>(
    scene: &Scene<'_, 'm>,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    finished(Job::new(scene, options, Structure::Automatic)?.run_in(memory)?)
}

/// [`build_bvh`], for those who will write to the block.
pub(crate) fn bvh_bytes<'m>(
    scene: &Scene,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<&'m mut [u8], BuildError> {
    Job::new(scene, options, options.bvh())?.run_in(memory)
}

/// The accel of the block that a build returned. That is always recognised, so the error does not arise.
fn finished(block: &[u8]) -> Result<Accel<'_>, BuildError> {
    Accel::recognise(block).map_err(|_| BuildError::TooLarge)
}

/// What a build makes of a scene.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Structure {
    /// Whichever of the others the scene and the options suggest.
    Automatic,
    List,
    Grid(GridOptions),
    Bvh,
    /// A BVH of bundles with this many lanes.
    Wide(u32),
}

/// A build that was checked and sized, but not begun.
pub(crate) struct Job<'s> {
    scene: &'s Scene<'s, 's>,
    options: &'s BuildOptions<'s>,
    own: Plan,
    level: Option<LevelPlan<'s>>,
    pub memory: Memory,
}

/// One structure: what is known of its primitives, what it is to be, and the bytes that takes at best and at least.
struct Plan {
    survey: Survey,
    census: Census,
    structure: Structure,
    quality: Quality,
    size: usize,
    minimum: usize,
    grid: Option<grid::Needs>,
}

/// The instances of a scene, and the index over them.
struct LevelPlan<'s> {
    placed: Placed<'s>,
    index: Plan,
    /// The bytes of all that is not the index.
    fixed: usize,
}

impl Plan {
    /// A plan for `asked`; up to `handful` primitives become a list.
    fn new(
        scene: &Scene,
        options: &BuildOptions,
        asked: Structure,
        handful: u32,
    ) -> Result<Self, BuildError> {
        let survey = survey(scene)?;
        if !SPHERES && scene.boxes().is_none() && survey.prim_limit != survey.triangle_limit {
            return Err(BuildError::LeftOut);
        }
        let caller = Caller::new(options.threads, None);
        let census = Census::take(scene, &survey, &caller)?;
        // Instances are not refitted: their index is built anew.
        let asked_to = REFIT && options.refit;
        let refit = asked_to && scene.instance_count() == 0 && scene.boxes().is_none();
        let kept = if refit { census.for_refit() } else { census };
        let few = asked == Structure::Automatic && !refit && are_few(options.rays_per_prim);
        let quality = match options.quality {
            Quality::Balanced if few => Quality::Fast,
            asked => asked,
        };
        let grid = |kind| Structure::Grid(GridOptions { kind, ..options.grid });
        let structure = match asked {
            _ if kept.hittable() <= handful => Structure::List,
            Structure::Grid(_) if census.hittable() == 0 => Structure::List,
            Structure::Automatic if GRID && few => {
                let with_care = quality == Quality::Best;
                match suited(scene, &census, options.rays_per_prim, with_care) {
                    Suited::Uniform => grid(GridKind::Uniform),
                    Suited::Nested => grid(GridKind::Nested),
                    Suited::Bvh => options.bvh(),
                }
            }
            Structure::Automatic => options.bvh(),
            asked => asked,
        };
        let census = if matches!(structure, Structure::Grid(_)) { census } else { kept };
        let mut planned = None;
        let (size, minimum) = match structure {
            Structure::List => list::needs(&survey, &census)?,
            Structure::Grid(grid) if GRID => {
                let needs = grid::needs(scene, &survey, &census, &grid, &caller)?;
                planned = Some(needs);
                (needs.size, needs.minimum)
            }
            Structure::Bvh | Structure::Automatic => bvh::needs(&survey, &census)?,
            Structure::Wide(width) if WIDE => bvh::needs_wide(&survey, &census, width)?,
            Structure::Grid(_) | Structure::Wide(_) => return Err(BuildError::LeftOut),
        };
        Ok(Plan { survey, census, structure, quality, size, minimum, grid: planned })
    }

    /// Builds into zero bytes, aligned and at least the minimum; returns the size of the block.
    fn run(&self, scene: &Scene, caller: &Caller, bytes: &mut [u8]) -> Result<usize, BuildError> {
        let Plan { survey, census, .. } = self;
        let effort = match self.quality {
            Quality::Fast => Effort::FAST,
            Quality::Balanced => Effort::BALANCED,
            Quality::Best => Effort::BEST,
        };
        let how = How { effort, caller };
        match self.structure {
            Structure::List => list::build(scene, survey, census, bytes),
            Structure::Grid(grid) if GRID => {
                let needs = self.grid.as_ref().ok_or(BuildError::LeftOut)?;
                grid::build(scene, survey, census, &grid, needs, caller, bytes)
            }
            Structure::Bvh | Structure::Automatic => bvh::build(scene, survey, census, &how, bytes),
            Structure::Wide(width) if WIDE => {
                bvh::build_wide(scene, survey, census, width, &how, bytes)
            }
            Structure::Grid(_) | Structure::Wide(_) => Err(BuildError::LeftOut),
        }
    }
}

impl<'s> LevelPlan<'s> {
    /// The plan for the instances of a scene; `bounds` is the box around all else in it. The index is of the structure that
    /// the scene's own primitives were to be, though it is seldom chosen for them; a list only if that was asked for.
    fn new(
        scene: &'s Scene<'s, 's>,
        options: &BuildOptions,
        asked: Structure,
        bounds: Aabb,
    ) -> Result<Self, BuildError> {
        let placed = Placed::new(scene, bounds)?;
        let asked = if asked == Structure::Automatic { options.bvh() } else { asked };
        let handful = if options.plain_list == PlainList::Always { u32::MAX } else { 0 };
        // The size of a tree does not depend on where its boxes are.
        let index = match asked {
            Structure::Grid(_) => Plan::new(&Scene::of_boxes(&placed), options, asked, handful)?,
            _ => Plan::new(&Scene::of_boxes(&Counted(&placed)), options, asked, handful)?,
        };
        let fixed = fixed_size(scene.instance_count()).ok_or(BuildError::TooLarge)?;
        Ok(LevelPlan { placed, index, fixed })
    }
}

impl<'s> Job<'s> {
    pub fn new(
        scene: &'s Scene<'s, 's>,
        options: &'s BuildOptions<'s>,
        asked: Structure,
    ) -> Result<Self, BuildError> {
        options.check()?;
        let handful = match options.plain_list {
            PlainList::Automatic => list::HANDFUL,
            PlainList::Never => 0,
            PlainList::Always => u32::MAX,
        };
        let own = Plan::new(scene, options, asked, handful)?;
        let level = match scene.instance_count() {
            0 => None,
            _ if !INSTANCES => return Err(BuildError::LeftOut),
            _ => Some(LevelPlan::new(scene, options, asked, own.census.bounds)?),
        };
        let sum = |own: usize, index: fn(&Plan) -> usize| match &level {
            _ if !INSTANCES => Some(own),
            None => Some(own),
            Some(LevelPlan { index: plan, fixed, .. }) => {
                own.checked_add(*fixed)?.checked_add(index(plan))
            }
        };
        let size = sum(own.size, |plan| plan.size).filter(|size| isize::try_from(*size).is_ok());
        let size = size.ok_or(BuildError::TooLarge)?;
        let minimum = sum(own.minimum, |plan| plan.minimum).ok_or(BuildError::TooLarge)?;
        let memory = Memory { size, minimum, alignment: ALIGNMENT };
        Ok(Job { scene, options, own, level, memory })
    }

    /// Builds into memory that may hold anything; returns the block.
    fn run_in<'m>(&self, memory: &'m mut [MaybeUninit<u8>]) -> Result<&'m mut [u8], BuildError> {
        let Memory { size, minimum, alignment } = self.memory;
        if !memory.as_ptr().addr().is_multiple_of(alignment) {
            return Err(BuildError::Misaligned);
        }
        if memory.len() < minimum {
            return Err(BuildError::OutOfMemory { minimum });
        }
        let usable = memory.len().min(size);
        let short = BuildError::OutOfMemory { minimum };
        self.run(storage::zeroed(memory.get_mut(..usable).ok_or(short)?))
    }

    /// Builds into zero bytes, aligned and at least the minimum; returns the block.
    pub fn run<'m>(&self, bytes: &'m mut [u8]) -> Result<&'m mut [u8], BuildError> {
        let minimum = self.memory.minimum;
        let Job { scene, options, own, level, .. } = self;
        let caller = Caller::new(options.threads, options.progress);
        caller.done(0.0).ok_or(BuildError::Cancelled)?;
        // The index takes what it wants, as long as that leaves the least for the own primitives.
        let level = level.as_ref().filter(|_| INSTANCES);
        let kept = level.map_or(0, |level| level.fixed + level.index.size);
        let room = bytes.len().saturating_sub(kept).min(own.size).max(own.minimum).min(bytes.len());
        let room = room / ALIGNMENT * ALIGNMENT;
        let short = BuildError::OutOfMemory { minimum };
        let own_bytes = bytes.get_mut(..room).ok_or(short)?;
        let built = own.run(scene, &caller, own_bytes);
        if caller.cancelled() {
            return Err(BuildError::Cancelled);
        }
        let size = match level {
            Some(level) => level.run(options, built?, bytes),
            None => Some(built?),
        };
        let block = size.and_then(|size| bytes.get_mut(..size));
        let block = block.ok_or(short)?;
        if REFIT && own.census.refit {
            // The scene was checked and the block is whole, so this error does not arise.
            refit::finish(block, scene, &caller).ok_or(BuildError::TooLarge)?;
        }
        if caller.done(1.0).is_none() {
            // It is finished, and nobody shall take it for a block.
            block.iter_mut().take(ALIGNMENT).for_each(|byte| *byte = 0);
            return Err(BuildError::Cancelled);
        }
        Ok(block)
    }
}

impl LevelPlan<'_> {
    /// Builds behind the own primitives, which end at byte `own`; returns the size of the block.
    fn run(&self, options: &BuildOptions, own: usize, bytes: &mut [u8]) -> Option<usize> {
        let LevelPlan { placed, index, .. } = self;
        write(placed, own, bytes, |boxes, rest| {
            let room = rest.len().min(index.size);
            let caller = Caller::new(options.threads, None);
            let scene = Scene::of_boxes(boxes);
            let census = Census::take(&scene, &index.survey, &caller).ok()?;
            let index = Plan { census, ..*index };
            index.run(&scene, &caller, rest.get_mut(..room)?).ok()
        })
    }
}

impl BuildOptions<'_> {
    fn check(&self) -> Result<(), BuildError> {
        match self.layout {
            Layout::Automatic | Layout::Compact | Layout::Wide(4 | 8 | 16) => {}
            Layout::Wide(width) => return Err(BuildError::NoSuchLayout { width }),
        }
        if self.refit && !REFIT {
            return Err(BuildError::LeftOut);
        }
        Ok(())
    }

    /// The structure of a BVH with this layout.
    pub(crate) fn bvh(&self) -> Structure {
        match self.layout {
            Layout::Automatic if WIDE => Structure::Wide(16),
            Layout::Automatic | Layout::Compact => Structure::Bvh,
            Layout::Wide(width) => Structure::Wide(width),
        }
    }
}
