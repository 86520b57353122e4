//! The C library: nothing but the core, whose `rt_` functions it exports.

#![no_std]

extern crate raykern_core as _;

/// Calls what nobody defines: a program that links has no way to panic.
#[cfg(feature = "panic-free")]
#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        safe fn raykern_could_panic() -> !;
    }
    raykern_could_panic()
}
