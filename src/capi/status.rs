//! What the calls return: numbers for C, an enum inside.

use core::ffi::CStr;

use crate::error::{BuildError, OpenError, RefitError};

/// Success is zero, everything else says why a call was refused. A number keeps its meaning for
/// ever; `rt_status_message` puts it in words.
pub type RtStatus = i32;

/// Done.
pub const RT_OK: RtStatus = 0;
/// A pointer is null that must not be.
pub const RT_ERROR_NULL_POINTER: RtStatus = 1;
/// A value is outside its range: an option that no constant names, a stride that is too small or no
/// multiple of four, a `struct_size` that is too small, a `reserved` field that is not zero.
pub const RT_ERROR_INVALID_ARGUMENT: RtStatus = 2;
/// A struct is larger than this library knows, and the part it does not know is not zero.
pub const RT_ERROR_VERSION: RtStatus = 3;
/// A triangle names a vertex that its mesh does not have.
pub const RT_ERROR_INDEX_OUT_OF_RANGE: RtStatus = 5;
/// The memory is smaller than the `minimum` of `rt_*_needs`.
pub const RT_ERROR_OUT_OF_MEMORY: RtStatus = 6;
/// A pointer is not aligned: blocks to 64 bytes, everything else as its C type.
pub const RT_ERROR_MISALIGNED: RtStatus = 7;
/// An array, or the memory a build needs, is larger than this machine can address, or the scene has
/// more primitives than can be numbered.
pub const RT_ERROR_TOO_LARGE: RtStatus = 8;
/// The bytes do not begin as a block does.
pub const RT_ERROR_NOT_A_BLOCK: RtStatus = 9;
/// The block was written on a machine of the other byte order.
pub const RT_ERROR_BYTE_ORDER: RtStatus = 10;
/// The block is of another version of the format.
pub const RT_ERROR_BLOCK_VERSION: RtStatus = 11;
/// There are fewer bytes than the block has.
pub const RT_ERROR_TRUNCATED: RtStatus = 12;
/// The block contradicts itself.
pub const RT_ERROR_CORRUPT: RtStatus = 13;
/// The block, the scene or the options ask for something that this build of the library leaves out.
pub const RT_ERROR_LAYOUT: RtStatus = 14;
/// The ray has no such hit.
pub const RT_ERROR_NOT_FOUND: RtStatus = 15;
/// A fault of the library, which was stopped before it reached the caller. Please report it.
pub const RT_ERROR_INTERNAL: RtStatus = 16;
/// `progress` returned false. The memory holds no structure and may be used again.
pub const RT_ERROR_CANCELLED: RtStatus = 17;
/// The block was not built with `RtBuildOptions.refit`, or it is a grid, which is built anew instead.
pub const RT_ERROR_NOT_REFITTABLE: RtStatus = 18;
/// Meshes, sphere sets, counts or vertex numbers are not those of the build.
pub const RT_ERROR_OTHER_SCENE: RtStatus = 19;
/// The map of an instance is not finite, or flattens space and has no inverse.
pub const RT_ERROR_SINGULAR: RtStatus = 20;
/// The accel of an instance has instances itself: there are two levels.
pub const RT_ERROR_NESTED: RtStatus = 21;
/// The block refers to other blocks by address: `rt_accel_pack` makes one of them that can be copied and saved.
pub const RT_ERROR_LINKED: RtStatus = 22;

/// Why a call was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Error {
    NullPointer,
    InvalidArgument,
    Version,
    IndexOutOfRange,
    OutOfMemory,
    Misaligned,
    TooLarge,
    NotABlock,
    ByteOrder,
    BlockVersion,
    Truncated,
    Corrupt,
    Layout,
    NotFound,
    Internal,
    Cancelled,
    Singular,
    Nested,
    Linked,
    NotRefittable,
    OtherScene,
}

impl Error {
    pub fn status(self) -> RtStatus {
        match self {
            Error::NullPointer => RT_ERROR_NULL_POINTER,
            Error::InvalidArgument => RT_ERROR_INVALID_ARGUMENT,
            Error::Version => RT_ERROR_VERSION,
            Error::IndexOutOfRange => RT_ERROR_INDEX_OUT_OF_RANGE,
            Error::OutOfMemory => RT_ERROR_OUT_OF_MEMORY,
            Error::Misaligned => RT_ERROR_MISALIGNED,
            Error::TooLarge => RT_ERROR_TOO_LARGE,
            Error::NotABlock => RT_ERROR_NOT_A_BLOCK,
            Error::ByteOrder => RT_ERROR_BYTE_ORDER,
            Error::BlockVersion => RT_ERROR_BLOCK_VERSION,
            Error::Truncated => RT_ERROR_TRUNCATED,
            Error::Corrupt => RT_ERROR_CORRUPT,
            Error::Layout => RT_ERROR_LAYOUT,
            Error::NotFound => RT_ERROR_NOT_FOUND,
            Error::Internal => RT_ERROR_INTERNAL,
            Error::Cancelled => RT_ERROR_CANCELLED,
            Error::Singular => RT_ERROR_SINGULAR,
            Error::Nested => RT_ERROR_NESTED,
            Error::Linked => RT_ERROR_LINKED,
            Error::NotRefittable => RT_ERROR_NOT_REFITTABLE,
            Error::OtherScene => RT_ERROR_OTHER_SCENE,
        }
    }
}

impl From<BuildError> for Error {
    fn from(error: BuildError) -> Error {
        match error {
            BuildError::IndexOutOfRange { .. } | BuildError::VerticesMissing { .. } => {
                Error::IndexOutOfRange
            }
            BuildError::OutOfMemory { .. } => Error::OutOfMemory,
            BuildError::Misaligned => Error::Misaligned,
            BuildError::TooLarge => Error::TooLarge,
            BuildError::LeftOut => Error::Layout,
            BuildError::NoSuchLayout { .. } => Error::InvalidArgument,
            BuildError::SingularInstance { .. } => Error::Singular,
            BuildError::NestedInstance { .. } => Error::Nested,
            BuildError::Cancelled => Error::Cancelled,
        }
    }
}

impl From<RefitError> for Error {
    fn from(error: RefitError) -> Error {
        match error {
            RefitError::NotRefittable => Error::NotRefittable,
            RefitError::OtherScene => Error::OtherScene,
            RefitError::NoBlock(error) => error.into(),
        }
    }
}

impl From<OpenError> for Error {
    fn from(error: OpenError) -> Error {
        match error {
            OpenError::Misaligned => Error::Misaligned,
            OpenError::NotABlock => Error::NotABlock,
            OpenError::ByteOrder => Error::ByteOrder,
            OpenError::Version => Error::BlockVersion,
            OpenError::Truncated => Error::Truncated,
            OpenError::Layout => Error::Layout,
            OpenError::Corrupt => Error::Corrupt,
            OpenError::Linked => Error::Linked,
        }
    }
}

/// A sentence for each number, in their order: one constant, which a linker leaves out where nobody asks for it. Strings by
/// themselves it keeps with all others of a unit.
const MESSAGES: &str = concat!(
    "done\0",
    "a pointer is null that must not be\0",
    "a value is outside its range\0",
    "a struct is larger than this library knows\0",
    "an unknown status\0",
    "a triangle names a vertex that its mesh does not have\0",
    "the memory is smaller than the minimum\0",
    "a pointer is not aligned\0",
    "an array, the scene or the memory it needs is too large\0",
    "the bytes are not a raykern block\0",
    "the block was written on a machine of the other byte order\0",
    "the block is of another version of the format\0",
    "the block is longer than the bytes given\0",
    "the block contradicts itself\0",
    "this build of the library leaves that out\0",
    "the ray has no such hit\0",
    "a fault of the library was stopped\0",
    "the caller cancelled the build\0",
    "the block was not built to be refitted\0",
    "meshes, counts or vertex numbers are not those of the build\0",
    "the map of an instance has no inverse or is not finite\0",
    "the accel of an instance has instances itself\0",
    "the block refers to other blocks by address and was not packed\0",
);

/// The number of no status, which was one once.
const UNKNOWN: usize = 4;

/// The sentence for a number.
pub(super) fn message(status: RtStatus) -> &'static CStr {
    let sentence = |number| MESSAGES.as_bytes().split_inclusive(|byte| *byte == 0).nth(number);
    let number = usize::try_from(status).unwrap_or(UNKNOWN);
    let bytes = sentence(number).or_else(|| sentence(UNKNOWN)).unwrap_or_default();
    CStr::from_bytes_until_nul(bytes).unwrap_or_default()
}
