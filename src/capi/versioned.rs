//! Structs that grow: reading and writing them in the size their caller compiled.

use core::mem::MaybeUninit;
use core::ptr::NonNull;

use super::status::Error;

/// No struct of this interface will ever be larger, so a larger `struct_size` is not followed.
const LARGEST: usize = 4096;

/// A struct of the interface that may get new fields at its end.
///
/// # Safety
///
/// The type is `repr(C)` without padding, and zero bytes are a value of it.
pub(crate) unsafe trait Growing: Copy {
    /// The size of the first published version: nothing smaller was ever compiled.
    const FIRST_SIZE: usize = size_of::<Self>();
}

/// A [`Growing`] struct that says its size itself.
///
/// # Safety
///
/// The first field is `struct_size: u32`.
pub(crate) unsafe trait Versioned: Growing {}

/// Checks that `at` is neither null nor misaligned.
pub(crate) fn pointer<T>(at: *const T) -> Result<NonNull<T>, Error> {
    let at = NonNull::new(at.cast_mut()).ok_or(Error::NullPointer)?;
    if at.is_aligned() { Ok(at) } else { Err(Error::Misaligned) }
}

/// Checks the size that the caller of `at` compiled, and that what we do not know of it is zero.
///
/// # Safety
///
/// `at` is valid for reads of `size` bytes.
pub(crate) unsafe fn check_size<T: Growing>(at: NonNull<T>, size: usize) -> Result<(), Error> {
    if size < T::FIRST_SIZE {
        return Err(Error::InvalidArgument);
    }
    let Some(unknown) = size.checked_sub(size_of::<T>()) else { return Ok(()) };
    if size > LARGEST {
        return Err(Error::Version);
    }
    let tail = at.as_ptr().wrapping_add(1).cast::<u8>();
    // SAFETY: the caller promises `size` bytes, of which these are the last `unknown`.
    let tail = unsafe { core::slice::from_raw_parts(tail, unknown) };
    if tail.iter().all(|byte| *byte == 0) { Ok(()) } else { Err(Error::Version) }
}

/// The struct at `at`, of which the caller compiled `size` bytes; fields it does not have are zero.
///
/// # Safety
///
/// `at` is valid for reads of `size` bytes. It need not be aligned.
pub(crate) unsafe fn read_prefix<T: Growing>(at: NonNull<T>, size: usize) -> T {
    let mut value = MaybeUninit::<T>::zeroed();
    let known = size.min(size_of::<T>());
    // SAFETY: both sides have `known` bytes, and one of them is a local variable.
    unsafe {
        at.as_ptr().cast::<u8>().copy_to_nonoverlapping(value.as_mut_ptr().cast::<u8>(), known);
    }
    // SAFETY: zeros are a value, and so is what the caller wrote over them.
    unsafe { value.assume_init() }
}

/// The struct at `at`, checked for null, alignment and size.
///
/// # Safety
///
/// `at` is null or valid for reads of the `struct_size` that it begins with.
pub(crate) unsafe fn read<T: Versioned>(at: *const T) -> Result<T, Error> {
    let at = pointer(at)?;
    // SAFETY: the caller's promise.
    let size = unsafe { checked_size(at) }?;
    // SAFETY: the caller's promise.
    Ok(unsafe { read_prefix(at, size) })
}

/// The place of an output struct, whose `struct_size` its caller has set.
pub(crate) struct Output<T> {
    at: NonNull<T>,
    size: usize,
}

impl<T: Versioned> Output<T> {
    /// The place at `at`, checked for null, alignment and size.
    ///
    /// # Safety
    ///
    /// `at` is null or valid for reads and writes of the `struct_size` that it begins with, for as
    /// long as the value is used.
    pub unsafe fn new(at: *mut T) -> Result<Self, Error> {
        let at = pointer(at)?;
        // SAFETY: the caller's promise.
        let size = unsafe { checked_size(at) }?;
        Ok(Output { at, size })
    }

    /// Writes as much of the value as the caller knows; `f` gets its `struct_size`.
    pub fn write(self, f: impl FnOnce(u32) -> T) {
        let value = f(self.size as u32);
        let known = self.size.min(size_of::<T>());
        // SAFETY: `new` was promised `size` bytes here, and `value` is a local variable without
        // padding.
        unsafe {
            (&raw const value).cast::<u8>().copy_to_nonoverlapping(self.at.as_ptr().cast(), known);
        }
    }
}

/// # Safety
///
/// `at` is valid for reads of the `struct_size` that it begins with.
unsafe fn checked_size<T: Versioned>(at: NonNull<T>) -> Result<usize, Error> {
    // SAFETY: a `Versioned` begins with this number.
    let size = unsafe { at.cast::<u32>().read() } as usize;
    // SAFETY: the caller's promise.
    unsafe { check_size(at, size) }?;
    Ok(size)
}
