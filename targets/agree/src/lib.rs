//! Traces rays through every structure and layout, without std, and boils all answers down to one number.
//!
//! It is the same number on every processor. That the structures agree with each other is checked on the way.

#![no_std]

mod answers;
mod rays;
mod scenes;

use answers::Room;

/// The bytes of the room that [`agree`] needs, which begins at a multiple of 64.
#[unsafe(no_mangle)]
pub extern "C" fn agree_room() -> usize {
    size_of::<Room>()
}

/// See [`Room::agree`].
///
/// # Safety
///
/// `room` points to zeros, as many as [`agree_room`] says, which nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn agree(room: *mut Room, count: u32) -> u32 {
    // SAFETY: the caller's promise; zeros are a value of it.
    unsafe { &mut *room }.agree(count)
}

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
