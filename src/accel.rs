//! The face of a built structure.

use crate::batch;
use crate::block::cells::resolution;
use crate::block::{Block, Bundles, Finished, KIND_BVH, KIND_GRID, KIND_LIST};
use crate::bvh;
use crate::closest::{self, PointHit};
use crate::error::OpenError;
use crate::grid;
use crate::hits::{self, HitKey, Hits};
use crate::prim::{self, Leaves};
use crate::query::{
    Choice, Counts, Decide, Exact, Meets, Precision, PrimId, QueryOptions, Wanted, Watch,
    Watertight, flat_number,
};
use crate::ray::{Hit, Ray};
use crate::surface::{self, Surface};
use crate::trace::{self, AnyHit, ClosestHit, LocateHit};

/// What a block holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Leaf blocks alone.
    List,
    /// A regular grid.
    Grid,
    /// A bounding volume hierarchy.
    Bvh,
}

/// How the nodes of a BVH lie in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// [`Wide(16)`](Self::Wide): the fastest on most machines. The block says how it is read, not
    /// the machine.
    #[default]
    Automatic,
    /// Binary nodes of 32 bytes: the least memory, and the least stack.
    Compact,
    /// Bundles of 4, 8 or 16 boxes, over leaves of a whole block each.
    Wide(u32),
}

/// What a block holds, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// The structure.
    pub kind: Kind,
    /// How its nodes lie in memory; compact where there are none.
    pub layout: Layout,
    /// Lower corner of the box around everything that can be hit.
    pub lower: [f32; 3],
    /// Upper corner; below `lower` when nothing can be hit.
    pub upper: [f32; 3],
    /// Triangles that can be hit.
    pub triangle_count: u32,
    /// Spheres that can be hit.
    pub sphere_count: u32,
    /// Triangles without area, spheres without radius, and whatever is not finite.
    pub ignored_count: u32,
    /// Cells along each axis of a grid, of the outermost one if they are nested; zero otherwise.
    pub resolution: [u32; 3],
    /// The bytes of the whole block.
    pub size: usize,
    /// Bytes of nodes (BVH), or of cell words and runs (grid).
    pub structure_size: usize,
    /// Bytes of leaf blocks: the primitives themselves.
    pub leaf_size: usize,
    /// Bytes of primitive ids.
    pub id_size: usize,
}

/// A built structure: a view of one block in the caller's memory.
#[derive(Clone, Copy)]
pub struct Accel<'m>(Finished<'m>);

impl<'m> Accel<'m> {
    /// Opens a block that was built earlier, after checking it from end to end; nothing is copied.
    ///
    /// `block` starts at a multiple of 64 bytes and may be longer than the block in it. Whatever is
    /// accepted can be queried without reading outside, panicking or looping; whether its boxes and
    /// vertices make sense is not checked.
    pub fn open(block: &'m [u8]) -> Result<Self, OpenError> {
        let accel = Accel::recognise(block)?;
        if accel.is_sound() { Ok(accel) } else { Err(OpenError::Corrupt) }
    }

    /// The accel of a block that a build or [`open`](Self::open) returned: only the header is read.
    pub(crate) fn recognise(block: &'m [u8]) -> Result<Self, OpenError> {
        Finished::split(block).map(Accel)
    }

    /// The accel of a block that a build or [`open`](Self::open) returned.
    ///
    /// # Safety
    ///
    /// `block` is the first byte of such a block, which nobody writes to during `'m`.
    #[cfg(feature = "capi")]
    #[allow(unsafe_code, reason = "C passes a pointer to the block and nothing else")]
    #[inline(always)]
    pub(crate) unsafe fn from_ptr(block: *const u8) -> Option<Accel<'m>> {
        // SAFETY: the caller's promise.
        unsafe { Finished::known(block) }.map(Accel)
    }

    fn is_sound(&self) -> bool {
        let Block { header, geometries, grids, nodes, bundles, words, runs, .. } = self.0.parts();
        let leaves = self.leaves();
        let no_grid = grids.is_empty() && words.is_empty() && runs.is_empty();
        let no_nodes = nodes.is_empty();
        let structure = match (header.kind, bundles) {
            (KIND_LIST, Bundles::None) => no_grid && no_nodes,
            (KIND_GRID, Bundles::None) => {
                no_nodes && grid::grids_are_sound(grids, words, runs, &leaves)
            }
            (KIND_BVH, Bundles::None) => no_grid && bvh::tree_is_sound(nodes, &leaves),
            (KIND_BVH, Bundles::Four(bundles)) => {
                no_grid && no_nodes && bvh::bundles_are_sound(bundles, &leaves)
            }
            (KIND_BVH, Bundles::Eight(bundles)) => {
                no_grid && no_nodes && bvh::bundles_are_sound(bundles, &leaves)
            }
            (KIND_BVH, Bundles::Sixteen(bundles)) => {
                no_grid && no_nodes && bvh::bundles_are_sound(bundles, &leaves)
            }
            _ => false,
        };
        let first_sphere =
            geometries.get(header.mesh_count as usize).map_or(header.prim_limit, |g| g.first);
        let numbered = header.mesh_count as usize <= geometries.len()
            && header.triangle_limit == first_sphere
            && first_sphere <= header.prim_limit;
        let (triangles, prims) = (header.triangle_limit, header.prim_limit);
        structure && numbered && prim::leaves_are_sound(&leaves, geometries, triangles, prims)
    }

    /// The block: what to copy, save or place in ROM.
    pub fn block(&self) -> &'m [u8] {
        self.0.bytes()
    }

    /// What the block holds.
    pub fn info(&self) -> Info {
        let block = self.0.parts();
        let Block { whole, header, grids, nodes, bundles, words, runs, .. } = block;
        Info {
            kind: match header.kind {
                KIND_GRID => Kind::Grid,
                KIND_BVH => Kind::Bvh,
                _ => Kind::List,
            },
            layout: match bundles {
                Bundles::None => Layout::Compact,
                _ => Layout::Wide(header.layout),
            },
            lower: header.bounds.lower,
            upper: header.bounds.upper,
            triangle_count: header.triangle_count,
            sphere_count: header.sphere_count,
            ignored_count: header.ignored_count,
            resolution: grids
                .last()
                .and_then(|grid| words.get(grid.first_word as usize))
                .map_or([0; 3], |word| resolution(*word)),
            size: whole.bytes().len(),
            structure_size: size_of_val(grids)
                + size_of_val(nodes)
                + bundles.size()
                + size_of_val(words)
                + size_of_val(runs),
            leaf_size: size_of_val(block.triangle_blocks) + size_of_val(block.sphere_blocks),
            id_size: size_of_val(block.prim_ids),
        }
    }

    /// The closest hit: of least `t` in real numbers, and of equal ones the first by geometry and
    /// primitive.
    ///
    /// Hit or miss, the primitive and the order are those of real arithmetic on the given floats,
    /// and `t` is the nearest float to the real one, for all finite inputs.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        trace::ask(self.0, ray, ClosestHit::<Exact, _, 1>::new(Choice::EVERYTHING, ()))
    }

    /// Whether anything is hit: true exactly when [`intersect`](Self::intersect) finds a hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        trace::ask(self.0, ray, AnyHit::<Exact, _>::new(Choice::EVERYTHING, ()))
    }

    /// The closest hit among what `options` leaves.
    pub fn intersect_with(&self, ray: &Ray, options: &QueryOptions) -> Option<Hit> {
        self.intersect_watched(ray, options, ())
    }

    /// Whether anything that `options` leaves is hit.
    pub fn occluded_with(&self, ray: &Ray, options: &QueryOptions) -> bool {
        self.occluded_watched(ray, options, ())
    }

    /// [`intersect`](Self::intersect) for each ray; a miss is written as [`Hit::MISS`]. Stops at the
    /// end of the shorter slice.
    pub fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.intersect_batch_with(rays, &QueryOptions::default(), hits);
    }

    /// [`occluded`](Self::occluded) for each ray. Stops at the end of the shorter slice.
    pub fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.occluded_batch_with(rays, &QueryOptions::default(), occluded);
    }

    /// [`intersect_with`](Self::intersect_with) for each ray; a miss is written as [`Hit::MISS`].
    /// Stops at the end of the shorter slice.
    pub fn intersect_batch_with(&self, rays: &[Ray], options: &QueryOptions, hits: &mut [Hit]) {
        let (block, choice) = (self.0, self.choice(options));
        let keep = |hit: Option<Hit>| hit.unwrap_or(Hit::MISS);
        match options.precision {
            Precision::Exact => {
                // Many of them are in flight, so each had better be small.
                let question = ClosestHit::<Exact, _, 0>::new(choice, ());
                batch::ask_all(block, rays, hits, question, keep);
            }
            Precision::Watertight => {
                let question = ClosestHit::<Watertight, _, 1>::new(choice, ());
                batch::ask_each(block, rays, hits, question, keep);
            }
        }
    }

    /// [`occluded_with`](Self::occluded_with) for each ray. Stops at the end of the shorter slice.
    pub fn occluded_batch_with(&self, rays: &[Ray], options: &QueryOptions, occluded: &mut [bool]) {
        let (block, choice) = (self.0, self.choice(options));
        let keep = |occluded| occluded;
        match options.precision {
            Precision::Exact => {
                batch::ask_all(block, rays, occluded, AnyHit::<Exact, _>::new(choice, ()), keep);
            }
            Precision::Watertight => {
                let question = AnyHit::<Watertight, _>::new(choice, ());
                batch::ask_each(block, rays, occluded, question, keep);
            }
        }
    }

    /// [`intersect_with`](Self::intersect_with) that adds what it did to `counts`.
    pub fn intersect_counted(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        counts: &mut Counts,
    ) -> Option<Hit> {
        self.intersect_watched(ray, options, counts)
    }

    /// [`occluded_with`](Self::occluded_with) that adds what it did to `counts`.
    pub fn occluded_counted(&self, ray: &Ray, options: &QueryOptions, counts: &mut Counts) -> bool {
        self.occluded_watched(ray, options, counts)
    }

    #[inline(always)]
    fn intersect_watched(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        watch: impl Watch,
    ) -> Option<Hit> {
        let (block, choice) = (self.0, self.choice(options));
        match options.precision {
            Precision::Exact => {
                trace::ask(block, ray, ClosestHit::<Exact, _, 1>::new(choice, watch))
            }
            Precision::Watertight => {
                trace::ask(block, ray, ClosestHit::<Watertight, _, 1>::new(choice, watch))
            }
        }
    }

    #[inline(always)]
    fn occluded_watched(&self, ray: &Ray, options: &QueryOptions, watch: impl Watch) -> bool {
        let (block, choice) = (self.0, self.choice(options));
        match options.precision {
            Precision::Exact => trace::ask(block, ray, AnyHit::<Exact, _>::new(choice, watch)),
            Precision::Watertight => {
                trace::ask(block, ray, AnyHit::<Watertight, _>::new(choice, watch))
            }
        }
    }

    /// All hits that `options` leaves, in the order of their real `t`; at equal `t` by geometry and
    /// primitive. Each primitive comes at most once, whatever the structure, and a sphere twice, where
    /// the ray enters and where it leaves: also when it only touches.
    ///
    /// Exact whatever precision `options` name, with the promises of [`intersect`](Self::intersect), of
    /// which the answer is the first of these hits. At a shared edge or vertex every triangle that is
    /// met comes. Nothing is allocated; a few hits at a time are looked for.
    pub fn hits(&self, ray: &Ray, options: &QueryOptions) -> Hits<'m> {
        Hits::new(self.0, *ray, self.choice(options))
    }

    /// The nearest of the [hits](Self::hits), as many as `hits` has room for, in one search that does not
    /// look beyond the last of them; returns how many there are. What is behind them in `hits` is left as it was.
    pub fn nearest_hits(&self, ray: &Ray, options: &QueryOptions, hits: &mut [Hit]) -> usize {
        self.more_hits(ray, options, &mut None, hits)
    }

    /// The next of the [hits](Self::hits) after `last`, or the first ones, as many as `hits` has room for; returns how
    /// many there are, and `last` becomes the last of them. Fewer than there was room for: there are no more.
    ///
    /// Nothing is lost or given twice between two calls for the same ray, however many hits round to
    /// one `t`. A `last` that the ray does not meet: none.
    pub fn more_hits(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        last: &mut Option<HitKey>,
        hits: &mut [Hit],
    ) -> usize {
        hits::fill(self.0, ray, self.choice(options), last, hits)
    }

    /// The point closest to `point` on the triangles and the surfaces of spheres, of those that the mask and
    /// `skip` of `options` leave; `None` when there is none within `radius`, ends included.
    ///
    /// Distances are computed in `f64` by one order of operations, whatever the structure, and of equal ones the first by
    /// geometry and primitive wins: list, grid and BVH give the same bits. They are within 2^-46 of the
    /// distance plus the primitive's longest edge or diameter; so nothing is closer by more than that. `distance` is rounded from
    /// it. `facing` and `precision` are not asked, and `skip` leaves out all of a sphere.
    ///
    /// Finds nothing within a radius that is negative or NaN, from a point that is not finite, or beyond the largest float.
    pub fn closest_point(
        &self,
        point: [f32; 3],
        radius: f32,
        options: &QueryOptions,
    ) -> Option<PointHit> {
        closest::closest_point(self.0, point, radius, self.choice(options))
    }

    /// The surface at `hit`, which an intersect call on this accel returned for `ray`; `None` when
    /// the ray has no such hit. Where both hits of a sphere round to one `t`, it is where the ray enters.
    ///
    /// The block keeps no way from a primitive's number to its place, so this follows the ray once
    /// more: it costs about as much as the intersect call did.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        let Hit { prim, geometry, instance, .. } = *hit;
        let id = PrimId { prim, geometry, instance };
        let Block { geometries, header, .. } = self.0.parts();
        let number = flat_number(&id, geometries, header.prim_limit)?;
        self.surface_of::<Exact>(ray, number, hit.t)
            .or_else(|| self.surface_of::<Watertight>(ray, number, hit.t))
    }

    /// The surface at the hit with this flat number and `t` in one precision.
    fn surface_of<D: Decide>(&self, ray: &Ray, number: u32, t: f32) -> Option<Surface> {
        let found =
            trace::ask(self.0, ray, LocateHit::<D>::new(Wanted { prim: number, t, root: None }))?;
        let line = ray.line();
        let (block, lane) = (found.place().block as usize, found.place().lane as usize);
        let Block { header, triangle_blocks, sphere_blocks, .. } = self.0.parts();
        if number < header.triangle_limit {
            let corners = triangle_blocks.get(block)?.triangle(lane);
            return Some(surface::of_triangle(&line, corners));
        }
        let (centre, radius) = sphere_blocks.get(block)?.sphere(lane);
        Some(surface::of_sphere(&line, centre, radius, found.root()))
    }

    fn leaves(&self) -> Leaves<'m> {
        Leaves::of(&self.0.parts())
    }

    #[inline(always)]
    fn choice(&self, options: &QueryOptions) -> Choice {
        let Block { header, geometries, .. } = self.0.parts();
        Choice::new(options, geometries, header.prim_limit)
    }
}
