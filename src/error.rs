//! Every reason why a build, or the opening of a block, is refused.

use core::fmt;

/// Why a build was refused. Nothing was written, unless it was cancelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BuildError {
    /// A vertex index of a mesh is not below its vertex count.
    IndexOutOfRange {
        /// The mesh.
        mesh: u32,
        /// The first triangle with such an index.
        triangle: u32,
    },
    /// A mesh without indices has fewer than three vertices a triangle.
    VerticesMissing {
        /// The mesh.
        mesh: u32,
    },
    /// The memory is smaller than the least that the build can use.
    OutOfMemory {
        /// That least size, in bytes.
        minimum: usize,
    },
    /// The memory does not start at a multiple of 64 bytes.
    Misaligned,
    /// The scene has more primitives than 32 bits can number, or asks for more memory than the
    /// machine can address.
    TooLarge,
    /// This build of the library leaves out what was asked for, or what is in the scene.
    LeftOut,
    /// Bundles are 4, 8 or 16 wide.
    NoSuchLayout {
        /// The width asked for.
        width: u32,
    },
    /// The map of an instance is not finite, or flattens space: it has no inverse.
    SingularInstance {
        /// The instance.
        instance: u32,
    },
    /// The accel of an instance has instances itself: there are two levels.
    NestedInstance {
        /// The instance.
        instance: u32,
    },
    /// The caller's progress callback said to stop. The memory holds no structure and may be used again.
    Cancelled,
}

/// Why a block was not refitted. Nothing was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RefitError {
    /// The block was not built with [`BuildOptions::refit`](crate::BuildOptions::refit), or it is a grid, which is built anew instead.
    NotRefittable,
    /// The scene has other meshes, sphere sets, counts or vertex numbers than the one that was built, or a vertex number
    /// out of range.
    OtherScene,
    /// There is no block.
    NoBlock(OpenError),
}

/// Why a block was not opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OpenError {
    /// The memory does not start at a multiple of 64 bytes.
    Misaligned,
    /// The bytes do not begin as a block does.
    NotABlock,
    /// The block was written on a machine of the other byte order.
    ByteOrder,
    /// The block is of another version of the format.
    Version,
    /// Fewer bytes than the block says it has.
    Truncated,
    /// The block holds something that this build of the library leaves out.
    Layout,
    /// The contents contradict themselves.
    Corrupt,
    /// The block refers to other blocks by address: it has to be packed before it is copied or saved.
    Linked,
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BuildError::IndexOutOfRange { mesh, triangle } => {
                write!(f, "triangle {triangle} of mesh {mesh} has a vertex index out of range")
            }
            BuildError::VerticesMissing { mesh } => {
                write!(f, "mesh {mesh} has no indices and fewer than three vertices a triangle")
            }
            BuildError::OutOfMemory { minimum } => {
                write!(f, "the memory is too small: {minimum} bytes are the least")
            }
            BuildError::Misaligned => f.write_str("the memory is not aligned to 64 bytes"),
            BuildError::TooLarge => f.write_str("the scene is too large to be numbered or stored"),
            BuildError::LeftOut => f.write_str("this build of the library leaves that out"),
            BuildError::NoSuchLayout { width } => {
                write!(f, "there are no bundles of {width} lanes: 4, 8 or 16")
            }
            BuildError::SingularInstance { instance } => {
                write!(f, "the map of instance {instance} has no inverse or is not finite")
            }
            BuildError::NestedInstance { instance } => {
                write!(f, "the accel of instance {instance} has instances itself")
            }
            BuildError::Cancelled => f.write_str("the caller cancelled the build"),
        }
    }
}

impl fmt::Display for RefitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RefitError::NotRefittable => f.write_str("the block was not built to be refitted"),
            RefitError::OtherScene => {
                f.write_str("meshes, counts or vertex numbers are not those of the build")
            }
            RefitError::NoBlock(error) => write!(f, "there is no block: {error}"),
        }
    }
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            OpenError::Misaligned => "the block is not aligned to 64 bytes",
            OpenError::NotABlock => "the bytes are not a raykern block",
            OpenError::ByteOrder => "the block was written on a machine of the other byte order",
            OpenError::Version => "the block is of another version of the format",
            OpenError::Truncated => "the block is longer than the bytes given",
            OpenError::Layout => "this build of the library leaves out what the block holds",
            OpenError::Corrupt => "the block's contents contradict themselves",
            OpenError::Linked => "the block refers to other blocks by address and was not packed",
        })
    }
}

impl core::error::Error for BuildError {}
impl core::error::Error for RefitError {}
impl core::error::Error for OpenError {}
