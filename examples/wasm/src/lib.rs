//! What the page asks of the library, as two modules: one traces pictures of blocks, and is all that the page needs while blocks
//! are baked; the other builds them.
//!
//! All memory is the page's, by address; there are no variables.

#![no_std]

#[cfg(feature = "build")]
mod build;
mod mesh;
#[cfg(feature = "trace")]
mod picture;
#[cfg(feature = "trace")]
mod trace;

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}
