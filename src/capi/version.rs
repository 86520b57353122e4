//! What the library says of itself: its version, and what statuses mean.

use core::ffi::c_char;

use super::status::{RtStatus, message};

/// What the header says, in cbindgen.toml.
const RT_RAYKERN_VERSION: u32 = 0x000100;
const _: () = assert!(RT_RAYKERN_VERSION == version());

/// A sentence for `status`, also for numbers that are no status. It need not be freed.
#[unsafe(no_mangle)]
pub extern "C" fn rt_status_message(status: RtStatus) -> *const c_char {
    message(status).as_ptr()
}

/// The version of the library, in the form of RT_RAYKERN_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn rt_version() -> u32 {
    const { version() }
}

/// The version in Cargo.toml as `major << 16 | minor << 8 | patch`.
const fn version() -> u32 {
    let text = env!("CARGO_PKG_VERSION").as_bytes();
    let (mut version, mut number, mut i) = (0, 0, 0);
    while i < text.len() {
        if text[i] == b'.' {
            version = (version | number) << 8;
            number = 0;
        } else {
            assert!(text[i].is_ascii_digit());
            number = 10 * number + (text[i] - b'0') as u32;
        }
        i += 1;
    }
    version | number
}
