//! Reading C's scene: checked once from end to end, then converted element by element, because
//! nothing may be allocated.

use core::marker::PhantomData;
use core::ptr::NonNull;

use super::accel_at;
use super::status::Error;
use super::types::{RtInstance, RtMesh, RtScene, RtSphereSet};
use super::versioned::{self, Growing};
use crate::kinds::INSTANCES;
use crate::scene::{Geometries, Instance, Mesh, Placements, SphereSet, Strided};

/// A scene in C's types all of whose pointers, counts and strides are right.
///
/// Vertex indices are not looked at: that is the build's part.
pub(crate) struct CheckedScene<'a> {
    meshes: Elements<'a, RtMesh>,
    sphere_sets: Elements<'a, RtSphereSet>,
    instances: Elements<'a, RtInstance>,
}

impl<'a> CheckedScene<'a> {
    /// # Safety
    ///
    /// `scene` is null or valid, as are its arrays and theirs, the accels of its instances included, and nobody writes
    /// to them during `'a`.
    pub unsafe fn new(scene: *const RtScene) -> Result<Self, Error> {
        // SAFETY: the caller's promise.
        let scene = unsafe { versioned::read(scene) }?;
        if scene.reserved != 0 {
            return Err(Error::InvalidArgument);
        }
        // SAFETY: the caller's promise.
        let meshes = unsafe { Elements::new(scene.meshes, scene.mesh_count, scene.mesh_size) }?;
        let (count, size) = (scene.sphere_set_count, scene.sphere_set_size);
        // SAFETY: the caller's promise.
        let sphere_sets = unsafe { Elements::new(scene.sphere_sets, count, size) }?;
        if !INSTANCES && scene.instance_count > 0 {
            return Err(Error::Layout);
        }
        let (count, size) = (scene.instance_count, scene.instance_size);
        // SAFETY: the caller's promise.
        let instances = unsafe { Elements::new(scene.instances, count, size) }?;
        let checked = CheckedScene { meshes, sphere_sets, instances };
        (0..checked.mesh_count()).try_for_each(|i| checked.checked_mesh(i).map(drop))?;
        (0..checked.sphere_set_count()).try_for_each(|i| checked.checked_set(i).map(drop))?;
        (0..checked.instance_count()).try_for_each(|i| checked.checked_instance(i).map(drop))?;
        Ok(checked)
    }

    fn checked_mesh(&self, i: usize) -> Result<Mesh<'a>, Error> {
        let mesh = self.meshes.get(i).ok_or(Error::Internal)?;
        if mesh.reserved != 0 {
            return Err(Error::InvalidArgument);
        }
        // SAFETY: what `new` was promised of the arrays of its arrays.
        let vertices = unsafe { words(mesh.vertices, 3, mesh.vertex_count, mesh.vertex_stride) }?;
        let indices = if mesh.indices.is_null() {
            None
        } else {
            // SAFETY: as above.
            Some(unsafe { words(mesh.indices, 3, mesh.triangle_count, mesh.index_stride) }?)
        };
        let triangles = mesh.triangle_count as usize;
        Ok(Mesh::strided(vertices, indices, triangles).with_mask(mesh.mask))
    }

    fn checked_set(&self, i: usize) -> Result<SphereSet<'a>, Error> {
        let set = self.sphere_sets.get(i).ok_or(Error::Internal)?;
        if set.reserved != 0 {
            return Err(Error::InvalidArgument);
        }
        // SAFETY: what `new` was promised of the arrays of its arrays.
        let spheres = unsafe { words(set.spheres, 4, set.sphere_count, set.sphere_stride) }?;
        Ok(SphereSet::strided(spheres).with_mask(set.mask))
    }

    fn checked_instance(&self, i: usize) -> Result<Instance<'a>, Error> {
        let instance = self.instances.get(i).filter(|_| INSTANCES).ok_or(Error::Internal)?;
        if instance.reserved != 0 {
            return Err(Error::InvalidArgument);
        }
        // SAFETY: what `new` was promised of the accels.
        let accel = unsafe { accel_at(instance.accel) }?;
        Ok(Instance::new(&accel, instance.object_to_world).with_mask(instance.mask))
    }
}

impl Placements for CheckedScene<'_> {
    fn instance_count(&self) -> usize {
        self.instances.count
    }

    fn instance(&self, i: usize) -> Option<Instance<'_>> {
        self.checked_instance(i).ok()
    }
}

impl Geometries for CheckedScene<'_> {
    fn mesh_count(&self) -> usize {
        self.meshes.count
    }

    fn mesh(&self, i: usize) -> Option<Mesh<'_>> {
        self.checked_mesh(i).ok()
    }

    fn sphere_set_count(&self) -> usize {
        self.sphere_sets.count
    }

    fn sphere_set(&self, i: usize) -> Option<SphereSet<'_>> {
        self.checked_set(i).ok()
    }
}

/// An array of structs, each `size` bytes long as its caller compiled it.
struct Elements<'a, T> {
    first: NonNull<T>,
    count: usize,
    size: usize,
    memory: PhantomData<&'a [T]>,
}

// SAFETY: elements are only read, by copying them, and nobody writes to them during `'a`, as `new` was promised;
// pointers in them are read as numbers.
unsafe impl<T> Sync for Elements<'_, T> {}

impl<'a, T: Growing> Elements<'a, T> {
    /// # Safety
    ///
    /// `first` is null or valid for reads of `count * size` bytes (`size` 0: as large as `T`) during
    /// `'a`.
    unsafe fn new(first: *const T, count: u32, size: u32) -> Result<Self, Error> {
        let size = if size == 0 { size_of::<T>() } else { size as usize };
        if size < T::FIRST_SIZE || size % align_of::<T>() != 0 {
            return Err(Error::InvalidArgument);
        }
        let first = if count == 0 { NonNull::dangling() } else { versioned::pointer(first)? };
        reach(first, u64::from(count) * size as u64)?;
        let elements = Elements { first, count: count as usize, size, memory: PhantomData };
        for i in 0..elements.count {
            // SAFETY: element `i` of `count`, each of `size` bytes.
            unsafe { versioned::check_size(elements.at(i), size) }?;
        }
        Ok(elements)
    }

    /// Where element `i` is, which must be below `count`.
    fn at(&self, i: usize) -> NonNull<T> {
        // SAFETY: within the array that `new` was promised, whose size `reach` has checked.
        unsafe { self.first.byte_add(i * self.size) }
    }

    fn get(&self, i: usize) -> Option<T> {
        // SAFETY: an element that `new` was promised; only asked for below `count`.
        (i < self.count).then(|| unsafe { versioned::read_prefix(self.at(i), self.size) })
    }
}

/// `count` elements of `width` words each, `stride` bytes apart (0: packed).
///
/// # Safety
///
/// `first` is null or valid for reads of all these bytes during `'a`.
unsafe fn words<'a, T: Copy>(
    first: *const T,
    width: usize,
    count: u32,
    stride: u32,
) -> Result<Strided<'a, T>, Error> {
    const { assert!(size_of::<T>() == 4) };
    let packed = 4 * width;
    let stride = if stride == 0 { packed } else { stride as usize };
    if stride % 4 != 0 || (count > 1 && stride < packed) {
        return Err(Error::InvalidArgument);
    }
    let words = if count == 0 {
        &[]
    } else {
        let first = versioned::pointer(first)?;
        let bytes = reach(first, u64::from(count - 1) * stride as u64 + packed as u64)?;
        // SAFETY: aligned, and valid as the caller promises; `reach` has bounded the size.
        unsafe { core::slice::from_raw_parts(first.as_ptr(), bytes / 4) }
    };
    Strided::new(words, width, stride / 4, count as usize).ok_or(Error::Internal)
}

/// `bytes`, if that many from `first` on can exist at all.
fn reach<T>(first: NonNull<T>, bytes: u64) -> Result<usize, Error> {
    let size = isize::try_from(bytes).map_err(|_| Error::TooLarge)? as usize;
    first.addr().checked_add(size).ok_or(Error::TooLarge)?;
    Ok(size)
}
