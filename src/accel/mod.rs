//! The face of a built structure.

mod info;
mod sound;
mod spot;

use crate::batch;
use crate::block::Finished;
use crate::block::level::Level;
use crate::closest::{self, PointHit};
use crate::error::OpenError;
use crate::hits::{self, HitKey, Hits};
use crate::levels::{self, Across, Shown};
use crate::query::{Choice, Counts, Exact, Precision, QueryOptions, Watch, Watertight};
use crate::ray::{Hit, NONE, Ray};
use crate::scene::Instance;
use crate::storage::ALIGNMENT;
use crate::surface::Surface;
use crate::trace::{self, AnyHit, ClosestHit, MEMORY};

use info::info_of;
pub use info::{Info, Kind, Layout};
use sound::{block_is_sound, level_is_sound};
use spot::spot_of;

impl<'c> Instance<'c> {
    /// What is in `accel`, mapped from its object space to the world by three rows of four, the last column the shift:
    /// any map that has an inverse, mirroring, uneven scaling and shear included.
    ///
    /// The accel has no instances itself, which a build checks.
    pub fn new(accel: &Accel<'c>, object_to_world: [f32; 12]) -> Self {
        Instance { child: accel.0, object_to_world, mask: 0 }
    }
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
        if accel.0.level().is_some_and(|level| level.is_linked()) {
            return Err(OpenError::Linked);
        }
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
    #[cfg_attr(test, allow(dead_code, reason = "unit tests have no entry points"))]
    #[allow(unsafe_code, reason = "C passes a pointer to the block and nothing else")]
    #[inline(always)]
    pub(crate) unsafe fn from_ptr(block: *const u8) -> Option<Accel<'m>> {
        // SAFETY: the caller's promise.
        unsafe { Finished::known(block) }.map(Accel)
    }

    fn is_sound(&self) -> bool {
        block_is_sound(&self.0.parts()) && self.0.level().is_none_or(|level| level_is_sound(&level))
    }

    /// The block: what to copy, save or place in ROM, unless it [is linked](Self::is_linked).
    pub fn block(&self) -> &'m [u8] {
        self.0.bytes()
    }

    /// The ray in the object space of an instance, for which hits in it are exact: origin and direction are computed in `f64`
    /// and rounded once. `None` when there is no such instance, or when it is not hit because the rounded ray leaves the range
    /// of `f32` or has no direction.
    pub fn object_ray(&self, instance: u32, ray: &Ray) -> Option<Ray> {
        self.level()?.instances.get(instance as usize)?.object_ray(ray)
    }

    /// What belongs to its instances, if it has any.
    pub(crate) fn level(&self) -> Option<Level<'m>> {
        self.0.level()
    }

    /// Where its own primitives end, in bytes, if it has instances.
    pub(crate) fn own_size(&self) -> usize {
        self.0.header().level as usize * ALIGNMENT
    }

    /// Whether the block refers to the blocks of its instances, which stay where they are. Such a block can be queried, but
    /// to be copied or saved it has to be [packed](Self::pack).
    pub fn is_linked(&self) -> bool {
        self.0.level().is_some_and(|level| level.is_linked())
    }

    /// What the block holds.
    pub fn info(&self) -> Info {
        let own = info_of(&self.0.parts());
        let Some(level) = self.0.level() else { return own };
        let index = info_of(&level.index.parts());
        Info {
            kind: index.kind,
            layout: index.layout,
            lower: level.head.bounds.lower,
            upper: level.head.bounds.upper,
            instance_count: level.instances.len() as u32,
            resolution: index.resolution,
            size: own.size,
            structure_size: own.structure_size + index.structure_size,
            leaf_size: own.leaf_size + index.leaf_size + size_of_val(level.instances),
            id_size: own.id_size + index.id_size,
            ..own
        }
    }

    /// The closest hit: of least `t` in real numbers, and of equal ones the first by instance, geometry and
    /// primitive, what is in no instance before all that is.
    ///
    /// Hit or miss, the primitive and the order are those of real arithmetic on the given floats,
    /// and `t` is the nearest float to the real one, for all finite inputs.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.either::<Exact>(ray, false)
    }

    /// Whether anything is hit: true exactly when [`intersect`](Self::intersect) finds a hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.either::<Exact>(ray, true).is_some()
    }

    /// [`intersect_with`](Self::intersect_with) in [`Precision::Watertight`], and nothing left out: for programs with no room for the code of the
    /// exact answer, which this does not name.
    pub fn intersect_watertight(&self, ray: &Ray) -> Option<Hit> {
        self.either::<Watertight>(ray, false)
    }

    /// Whether anything is hit: true exactly when [`intersect_watertight`](Self::intersect_watertight) finds a hit.
    pub fn occluded_watertight(&self, ray: &Ray) -> bool {
        self.either::<Watertight>(ray, true).is_some()
    }

    /// The closest hit among what `options` leaves.
    pub fn intersect_with(&self, ray: &Ray, options: &QueryOptions) -> Option<Hit> {
        self.either_with(ray, options, (), false)
    }

    /// Whether anything that `options` leaves is hit.
    pub fn occluded_with(&self, ray: &Ray, options: &QueryOptions) -> bool {
        self.either_with(ray, options, (), true).is_some()
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
        match options.precision {
            Precision::Exact if block.has_level() => {
                levels::closest_of_each(block, rays, options, hits);
            }
            _ if block.has_level() => {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = self.intersect_with(ray, options).unwrap_or(Hit::MISS);
                }
            }
            Precision::Exact => {
                // Many of them are in flight, so each had better be small.
                let question = ClosestHit::<Exact, _, 0>::new(choice, ());
                batch::ask_all(block, rays, hits, question);
            }
            Precision::Watertight => {
                let question = ClosestHit::<Watertight, _, MEMORY>::new(choice, ());
                batch::ask_each(block, rays, hits, question);
            }
        }
    }

    /// [`occluded_with`](Self::occluded_with) for each ray. Stops at the end of the shorter slice.
    pub fn occluded_batch_with(&self, rays: &[Ray], options: &QueryOptions, occluded: &mut [bool]) {
        let (block, choice) = (self.0, self.choice(options));
        match options.precision {
            Precision::Exact if block.has_level() => {
                levels::any_of_each(block, rays, options, occluded);
            }
            _ if block.has_level() => {
                for (ray, occluded) in rays.iter().zip(occluded) {
                    *occluded = self.occluded_with(ray, options);
                }
            }
            Precision::Exact => {
                batch::ask_all(block, rays, occluded, AnyHit::<Exact, _>::new(choice, ()));
            }
            Precision::Watertight => {
                let question = AnyHit::<Watertight, _>::new(choice, ());
                batch::ask_each(block, rays, occluded, question);
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
        self.either_with(ray, options, counts, false)
    }

    /// [`occluded_with`](Self::occluded_with) that adds what it did to `counts`.
    pub fn occluded_counted(&self, ray: &Ray, options: &QueryOptions, counts: &mut Counts) -> bool {
        self.either_with(ray, options, counts, true).is_some()
    }

    /// The closest hit among what `options` leave or, with `any`, something if anything of it is hit.
    #[inline(always)]
    pub(crate) fn either_with(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        watch: impl Watch,
        any: bool,
    ) -> Option<Hit> {
        match options.precision {
            Precision::Exact => self.either_by::<Exact>(ray, options, watch, any),
            Precision::Watertight => self.either_by::<Watertight>(ray, options, watch, any),
        }
    }

    #[inline(always)]
    fn either_by<D: Across>(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        watch: impl Watch,
        any: bool,
    ) -> Option<Hit> {
        if self.0.has_level() {
            return in_levels::<D>(self.0, ray, options, watch, any);
        }
        trace::either_hit::<D, _>(self.0, ray, self.choice(options), watch, any)
    }

    /// All hits that `options` leaves, in the order of their real `t`; at equal `t` by instance, geometry and
    /// primitive. Each primitive of each instance comes at most once, whatever the structure, and a sphere twice, where
    /// the ray enters and where it leaves: also when it only touches.
    ///
    /// Exact whatever precision `options` name, with the promises of [`intersect`](Self::intersect), of
    /// which the answer is the first of these hits. At a shared edge or vertex every triangle that is
    /// met comes. Nothing is allocated; a few hits at a time are looked for.
    pub fn hits(&self, ray: &Ray, options: &QueryOptions) -> Hits<'m> {
        Hits::new(self.0, *ray, *options)
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
        self.hits_after(ray, options, last, hits).unwrap_or(0)
    }

    /// The same; `None` when the ray does not meet `last`: then nothing is written.
    pub(crate) fn hits_after(
        &self,
        ray: &Ray,
        options: &QueryOptions,
        last: &mut Option<HitKey>,
        hits: &mut [Hit],
    ) -> Option<usize> {
        hits::fill(self.0, ray, options, last, hits)
    }

    /// The point closest to `point` on the triangles and the surfaces of spheres, of those that the mask and
    /// `skip` of `options` leave; `None` when there is none within `radius`, ends included.
    ///
    /// Distances are computed in `f64` by one order of operations, whatever the structure, and of equal ones the first by
    /// instance, geometry and primitive wins: list, grid and BVH give the same bits. They are within 2^-46 of the
    /// distance plus the primitive's longest edge or diameter; so nothing is closer by more than that. `distance` is rounded from
    /// it. `facing` and `precision` are not asked, and `skip` leaves out all of a sphere.
    ///
    /// In instances, distances are those of the images of vertices, rounded to `f64`, and of the ellipsoids that spheres become; if a map stretches by at
    /// most 2^10 times as much along one axis as along another, within 2^-40 of the distance and the longest axis. Each instance is looked at whose box is
    /// closer than what was found before, so this takes time in proportion to their number.
    ///
    /// Finds nothing within a radius that is negative or NaN, from a point that is not finite, or beyond the largest float.
    pub fn closest_point(
        &self,
        point: [f32; 3],
        radius: f32,
        options: &QueryOptions,
    ) -> Option<PointHit> {
        closest::closest_point(self.0, point, radius, options)
    }

    /// The surface at `hit`, which an intersect call on this accel returned for `ray`; `None` when
    /// the ray has no such hit. Where both hits of a sphere round to one `t`, it is where the ray enters.
    ///
    /// The block keeps no way from a primitive's number to its place, so this follows the ray once
    /// more: it costs about as much as the intersect call did.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        if hit.instance == NONE {
            return spot_of(self.0, ray, hit).map(|spot| spot.surface());
        }
        let level = self.0.level()?;
        let instance = level.instances.get(hit.instance as usize)?;
        let spot = spot_of(level.child(instance)?, &instance.object_ray(ray)?, hit)?;
        Some(spot.mapped(&instance.map()).surface())
    }

    /// The closest hit or, with `any`, something if anything is hit; nothing is left out.
    #[inline(always)]
    pub(crate) fn either<D: Across>(&self, ray: &Ray, any: bool) -> Option<Hit> {
        if self.0.has_level() {
            return self.either_in_levels::<D>(ray, any);
        }
        trace::either_hit::<D, _>(self.0, ray, Choice::EVERYTHING, (), any)
    }

    /// Out of line, so that calls for blocks without instances stay short.
    #[cold]
    #[inline(never)]
    fn either_in_levels<D: Across>(&self, ray: &Ray, any: bool) -> Option<Hit> {
        in_levels::<D>(self.0, ray, &QueryOptions::default(), (), any)
    }

    #[inline(always)]
    fn choice(&self, options: &QueryOptions) -> Choice {
        Shown::own(self.0).choice(options)
    }
}

/// The closest or any hit of a block with instances.
#[inline(always)]
fn in_levels<D: Across>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    watch: impl Watch,
    any: bool,
) -> Option<Hit> {
    match any {
        true => levels::any::<D, _>(block, ray, options, watch).then_some(Hit::MISS),
        false => levels::closest::<D, _>(block, ray, options, watch),
    }
}
