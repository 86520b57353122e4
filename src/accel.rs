//! The face of a built structure.

use crate::block::{Block, Header, KIND_BVH, KIND_GRID, KIND_LIST};
use crate::error::OpenError;
use crate::prim::{self, Leaves};
use crate::query::{
    Any, Candidate, Closest, Counted, Counts, Filter, Locate, PrimId, Query, QueryOptions,
    flat_number, geometry_of,
};
use crate::ray::{Hit, NONE, PreparedRay, Ray};
#[cfg(feature = "capi")]
use crate::storage;
use crate::surface::{self, Surface};
use crate::{bvh, grid};

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

/// What a block holds, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// The structure.
    pub kind: Kind,
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
    /// Cells along each axis of a grid, zero otherwise.
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
pub struct Accel<'m>(Block<'m>);

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
        Block::split(block).map(Accel)
    }

    /// The accel of a block that a build or [`open`](Self::open) returned.
    ///
    /// # Safety
    ///
    /// `block` is the first byte of such a block, which nobody writes to during `'m`.
    #[cfg(feature = "capi")]
    #[allow(unsafe_code, reason = "C passes a pointer to the block and nothing else")]
    pub(crate) unsafe fn from_ptr(block: *const u8) -> Option<Accel<'m>> {
        // SAFETY: the header is the first part of the block.
        let size = unsafe { Block::size_at(block) };
        // SAFETY: a block has as many bytes as its header says.
        let bytes = unsafe { storage::from_raw(block, size) };
        Accel::recognise(bytes).ok()
    }

    fn is_sound(&self) -> bool {
        let Block { header, geometries, grids, nodes, words, runs, .. } = self.0;
        let leaves = self.leaves();
        let no_grid = grids.is_empty() && words.is_empty() && runs.is_empty();
        let structure = match header.kind {
            KIND_LIST => no_grid && nodes.is_empty(),
            KIND_GRID => nodes.is_empty() && grid::grid_is_sound(grids, words, runs, &leaves),
            KIND_BVH => no_grid && bvh::tree_is_sound(nodes, &leaves),
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
        self.0.bytes
    }

    /// What the block holds.
    pub fn info(&self) -> Info {
        let Block { bytes, header, grids, nodes, words, runs, .. } = self.0;
        Info {
            kind: match header.kind {
                KIND_GRID => Kind::Grid,
                KIND_BVH => Kind::Bvh,
                _ => Kind::List,
            },
            lower: header.bounds.lower,
            upper: header.bounds.upper,
            triangle_count: header.triangle_count,
            sphere_count: header.sphere_count,
            ignored_count: header.ignored_count,
            resolution: grids.first().map_or([0; 3], |grid| grid.resolution),
            size: bytes.len(),
            structure_size: size_of_val(grids)
                + size_of_val(nodes)
                + size_of_val(words)
                + size_of_val(runs),
            leaf_size: size_of_val(self.0.triangle_blocks) + size_of_val(self.0.sphere_blocks),
            id_size: size_of_val(self.0.prim_ids),
        }
    }

    /// The closest hit: of least `t` in real numbers, and of equal ones the first by geometry and
    /// primitive.
    ///
    /// Hit or miss, the primitive and the order are those of real arithmetic on the given floats,
    /// and `t` is the nearest float to the real one, for all finite inputs.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_with(ray, &QueryOptions::default())
    }

    /// Whether anything is hit: true exactly when [`intersect`](Self::intersect) finds a hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_with(ray, &QueryOptions::default())
    }

    /// The closest hit among what `options` leaves.
    pub fn intersect_with(&self, ray: &Ray, options: &QueryOptions) -> Option<Hit> {
        let ray = ray.prepare()?;
        let mut query = Closest::new(self.filter(options), &ray);
        self.ask(&ray, &mut query);
        query.best.map(|best| self.hit(&ray, &best))
    }

    /// Whether anything that `options` leaves is hit.
    pub fn occluded_with(&self, ray: &Ray, options: &QueryOptions) -> bool {
        let Some(ray) = ray.prepare() else { return false };
        let mut query = Any::new(self.filter(options), &ray);
        self.ask(&ray, &mut query)
    }

    /// [`intersect`](Self::intersect) for each ray; a miss is written as [`Hit::MISS`]. Stops at the
    /// end of the shorter slice.
    pub fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray).unwrap_or(Hit::MISS);
        }
    }

    /// [`occluded`](Self::occluded) for each ray. Stops at the end of the shorter slice.
    pub fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.occluded(ray);
        }
    }

    /// [`intersect_with`](Self::intersect_with) that adds what it did to `counts`.
    pub fn intersect_counted(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        counts: &mut Counts,
    ) -> Option<Hit> {
        let ray = ray.prepare()?;
        let query = Closest::new(self.filter(options), &ray);
        let mut counted = Counted { query, counts };
        self.ask(&ray, &mut counted);
        counted.query.best.map(|best| self.hit(&ray, &best))
    }

    /// [`occluded_with`](Self::occluded_with) that adds what it did to `counts`.
    pub fn occluded_counted(&self, ray: &Ray, options: &QueryOptions, counts: &mut Counts) -> bool {
        let Some(ray) = ray.prepare() else { return false };
        let query = Any::new(self.filter(options), &ray);
        self.ask(&ray, &mut Counted { query, counts })
    }

    /// The surface at `hit`, which an intersect call on this accel returned for `ray`; `None` when
    /// the ray has no such hit.
    ///
    /// The block keeps no way from a primitive's number to its place, so this follows the ray once
    /// more: it costs about as much as the intersect call did.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        let ray = ray.prepare()?;
        let Hit { prim, geometry, instance, .. } = *hit;
        let id = PrimId { prim, geometry, instance };
        let Header { triangle_limit, prim_limit, .. } = *self.0.header;
        let number = flat_number(&id, self.0.geometries, prim_limit)?;
        let mut query = Locate::new(number, hit.t, &ray);
        self.ask(&ray, &mut query);
        let found = query.found?;
        let (block, lane) = (found.place.0 as usize, found.place.1 as usize);
        Some(if number < triangle_limit {
            surface::of_triangle(self.0.triangle_blocks.get(block)?.triangle(lane), found.weights)
        } else {
            let (centre, radius) = self.0.sphere_blocks.get(block)?.sphere(lane);
            surface::of_sphere(&ray, found.t, centre, radius)
        })
    }

    /// Runs the one traversal of the structure at hand.
    fn ask<Q: Query>(&self, ray: &PreparedRay, query: &mut Q) -> bool {
        let Block { header, grids, nodes, words, runs, .. } = self.0;
        let leaves = self.leaves();
        match (header.kind, grids.first()) {
            (KIND_BVH, _) => bvh::traverse(nodes, &leaves, ray, query),
            (KIND_GRID, Some(grid)) => grid::walk(grid, words, runs, &leaves, ray, query),
            _ => leaves.intersect_all(ray, query),
        }
    }

    fn leaves(&self) -> Leaves<'m> {
        let Block { triangle_blocks, sphere_blocks, prim_ids, .. } = self.0;
        Leaves { triangle_blocks, sphere_blocks, prim_ids }
    }

    fn filter(&self, options: &QueryOptions) -> Filter<'m> {
        Filter::new(options, self.0.geometries, self.0.header.prim_limit)
    }

    /// The record of a candidate that won.
    fn hit(&self, ray: &PreparedRay, best: &Candidate) -> Hit {
        let place = geometry_of(best.prim, self.0.geometries);
        let (geometry, first) = place.map_or((NONE, 0), |(number, g)| (number, g.first));
        let [u, v] = rounded_weights(best.weights);
        // Adding +0 turns -0 into +0.
        let t = best.rounded_t(ray) + 0.0;
        Hit { t, u, v, prim: best.prim - first, geometry, instance: NONE }
    }
}

/// The weights of the second and third vertex as floats, such that neither they nor `1 - u - v` are
/// negative: each is the nearest float to its value in `f64`, and `v` gives way.
#[expect(clippy::manual_clamp, reason = "`clamp` panics on the NaN that foreign blocks can give")]
fn rounded_weights([u, v]: [f64; 2]) -> [f32; 2] {
    let u = (u as f32).max(0.0).min(1.0) + 0.0;
    let v = (v as f32).max(0.0).min(1.0 - u) + 0.0;
    [u, v]
}
