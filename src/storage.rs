//! One caller's block as typed slices.
//!
//! The types that live in a block are plain numbers, so any bytes of the right length and alignment
//! are a valid value: reading a block can give nonsense, never undefined behaviour.

#![allow(unsafe_code, reason = "the casts between bytes and plain numbers live here")]

use core::mem::MaybeUninit;

/// Every part of a block, and the block itself, starts at a multiple of this many bytes.
pub(crate) const ALIGNMENT: usize = 64;

/// `n` rounded up to a multiple of [`ALIGNMENT`]; `None` when that is not a `u64`.
pub(crate) const fn align_up(n: u64) -> Option<u64> {
    match n.checked_add(ALIGNMENT as u64 - 1) {
        Some(n) => Some(n / ALIGNMENT as u64 * ALIGNMENT as u64),
        None => None,
    }
}

/// Types of which every bit pattern is a value.
///
/// # Safety
///
/// `repr(C)` or primitive, no padding bytes, no invalid bit patterns, alignment at most
/// [`ALIGNMENT`].
pub(crate) unsafe trait Plain: Copy + 'static {}

// SAFETY: every bit pattern is a number, and a primitive has no padding.
unsafe impl Plain for u32 {}
// SAFETY: as above.
unsafe impl Plain for u64 {}
// SAFETY: an array adds no padding to its elements.
unsafe impl Plain for [f32; 3] {}

/// Fills `memory` with zeros and hands it back as bytes.
pub(crate) fn zeroed(memory: &mut [MaybeUninit<u8>]) -> &mut [u8] {
    memory.fill(MaybeUninit::new(0));
    // SAFETY: every byte was written in the line above, and `MaybeUninit<u8>` has the layout of u8.
    unsafe { &mut *(core::ptr::from_mut(memory) as *mut [u8]) }
}

/// `count` values of `T` that start at byte `offset`, or `None` when they do not lie inside `bytes`
/// or are not aligned.
pub(crate) fn view<T: Plain>(bytes: &[u8], offset: usize, count: usize) -> Option<&[T]> {
    let part = bytes.get(offset..offset.checked_add(count.checked_mul(size_of::<T>())?)?)?;
    if !part.as_ptr().cast::<T>().is_aligned() {
        return None;
    }
    // SAFETY: `part` holds `count` times the size of `T`, is aligned, and `T` is plain.
    Some(unsafe { core::slice::from_raw_parts(part.as_ptr().cast::<T>(), count) })
}

/// [`view`] to write through.
pub(crate) fn view_mut<T: Plain>(
    bytes: &mut [u8],
    offset: usize,
    count: usize,
) -> Option<&mut [T]> {
    let end = offset.checked_add(count.checked_mul(size_of::<T>())?)?;
    let part = bytes.get_mut(offset..end)?;
    if !part.as_ptr().cast::<T>().is_aligned() {
        return None;
    }
    // SAFETY: as in `view`; the borrow is unique because `bytes` is.
    Some(unsafe { core::slice::from_raw_parts_mut(part.as_mut_ptr().cast::<T>(), count) })
}

/// The bytes of a plain value.
pub(crate) fn bytes_of<T: Plain>(value: &T) -> &[u8] {
    // SAFETY: a plain type has no padding, so all of its bytes are initialised.
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(value).cast(), size_of::<T>()) }
}

/// The block of `size` bytes that starts at `block`.
///
/// # Safety
///
/// `block` points to `size` readable bytes that nobody writes to during `'m`.
#[cfg(feature = "capi")]
pub(crate) unsafe fn from_raw<'m>(block: *const u8, size: usize) -> &'m [u8] {
    // SAFETY: the caller's promise, word for word.
    unsafe { core::slice::from_raw_parts(block, size) }
}

/// Memory from the global allocator, aligned as blocks are.
#[cfg(feature = "alloc")]
pub(crate) struct AlignedMemory(alloc::vec::Vec<MaybeUninit<Line>>);

#[cfg(feature = "alloc")]
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Line([u8; ALIGNMENT]);

#[cfg(feature = "alloc")]
impl AlignedMemory {
    /// `size` zero bytes, rounded up to whole lines; `None` when there is no memory.
    pub fn new(size: usize) -> Option<Self> {
        let lines = size.div_ceil(ALIGNMENT);
        let mut memory = alloc::vec::Vec::new();
        memory.try_reserve_exact(lines).ok()?;
        memory.resize(lines, MaybeUninit::new(Line([0; ALIGNMENT])));
        Some(AlignedMemory(memory))
    }

    /// The first `size` bytes in memory of just that size.
    pub fn moved(self, size: usize) -> Option<Self> {
        let lines = self.0.get(..size.div_ceil(ALIGNMENT))?;
        let mut memory = alloc::vec::Vec::new();
        memory.try_reserve_exact(lines.len()).ok()?;
        memory.extend_from_slice(lines);
        Some(AlignedMemory(memory))
    }

    /// The bytes to build into.
    pub fn uninit(&mut self) -> &mut [MaybeUninit<u8>] {
        let size = size_of_val(self.0.as_slice());
        // SAFETY: the lines are `size` bytes, one after the other, and any byte may be unwritten.
        unsafe { core::slice::from_raw_parts_mut(self.0.as_mut_ptr().cast(), size) }
    }

    /// The bytes, all of which were written when they were zeroed.
    pub fn bytes(&self) -> &[u8] {
        let size = size_of_val(self.0.as_slice());
        // SAFETY: `new` writes every line, builds write whole bytes, and `moved` copies lines.
        unsafe { core::slice::from_raw_parts(self.0.as_ptr().cast(), size) }
    }
}
