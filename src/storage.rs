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

/// Has the system give large pages to bytes that are not yet written: a build then waits for a page every two megabytes.
#[cfg(feature = "alloc")]
fn want_large_pages(bytes: &[u8]) {
    const MADV_HUGEPAGE: i32 = 14;
    advise(bytes, MADV_HUGEPAGE);
}

/// Has the system put finished bytes into large pages, where it can and has not yet: rays visit them here and there, and
/// with small pages many visits would wait for the table of pages.
#[cfg(feature = "alloc")]
fn use_large_pages(bytes: &[u8]) {
    const MADV_COLLAPSE: i32 = 25;
    want_large_pages(bytes);
    advise(bytes, MADV_COLLAPSE);
}

/// Gives the system advice on those bytes that make up large pages.
#[cfg(all(feature = "std", target_os = "linux", target_arch = "x86_64", not(miri)))]
fn advise(bytes: &[u8], advice: core::ffi::c_int) {
    use core::ffi::{c_int, c_void};
    unsafe extern "C" {
        fn madvise(start: *mut c_void, size: usize, advice: c_int) -> c_int;
    }
    const LARGE: usize = 2 << 20;
    let start = bytes.as_ptr();
    let ahead = start.addr().wrapping_neg() % LARGE;
    let size = bytes.len().saturating_sub(ahead) / LARGE * LARGE;
    if size > 0 {
        let start = start.wrapping_add(ahead).cast_mut().cast();
        // SAFETY: whole pages of one allocation, whose bytes stay as they are. Systems that do not know the advice
        // refuse it, which does not matter.
        unsafe { madvise(start, size, advice) };
    }
}

#[cfg(all(
    feature = "alloc",
    not(all(feature = "std", target_os = "linux", target_arch = "x86_64", not(miri)))
))]
fn advise(_bytes: &[u8], _advice: i32) {}

/// Zero bytes from the global allocator, aligned as blocks are.
///
/// The allocator is asked for no alignment, so that it can give back the end of a large piece without
/// moving the rest.
#[cfg(feature = "alloc")]
pub(crate) struct AlignedMemory {
    memory: alloc::vec::Vec<u8>,
    start: usize,
    size: usize,
}

#[cfg(feature = "alloc")]
impl AlignedMemory {
    /// `size` zero bytes; `None` when there is no memory.
    pub fn new(size: usize) -> Option<Self> {
        let layout = core::alloc::Layout::array::<u8>(size.checked_add(ALIGNMENT)?).ok()?;
        // SAFETY: the layout has at least `ALIGNMENT` bytes.
        let memory = unsafe { alloc::alloc::alloc_zeroed(layout) };
        if memory.is_null() {
            return None;
        }
        // SAFETY: allocated just now by the global allocator with the layout of that many bytes, all of
        // which are zero.
        let memory =
            unsafe { alloc::vec::Vec::from_raw_parts(memory, layout.size(), layout.size()) };
        want_large_pages(&memory);
        let start = Self::start(&memory);
        Some(AlignedMemory { memory, start, size })
    }

    /// Keeps the first `size` bytes and gives the rest back.
    pub fn shrunk(mut self, size: usize) -> Self {
        self.size = self.size.min(size);
        let start = self.start;
        self.memory.truncate(start + self.size + ALIGNMENT);
        self.memory.shrink_to_fit();
        self.start = Self::start(&self.memory);
        if self.start != start {
            self.memory.copy_within(start..start + self.size, self.start);
        }
        use_large_pages(&self.memory);
        self
    }

    fn start(memory: &[u8]) -> usize {
        memory.as_ptr().addr().wrapping_neg() % ALIGNMENT
    }

    /// The bytes to build into.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.memory[self.start..][..self.size]
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.memory[self.start..][..self.size]
    }
}
