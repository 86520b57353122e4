//! Which kinds of things this build of the library knows.
//!
//! A microcontroller with triangles in a compact BVH has no room for the code of the others. They are left out where a kind
//! is told from another, by constants: all code is compiled for types in every build, and nothing else knows of it. What
//! cannot be read is not opened, and what cannot be made is not built.

/// Layouts of 4, 8 or 16 boxes side by side.
pub(crate) const WIDE: bool = cfg!(feature = "wide");
/// Grids, uniform and nested.
pub(crate) const GRID: bool = cfg!(feature = "grid");
/// Spheres, and with them quadratic numbers.
pub(crate) const SPHERES: bool = cfg!(feature = "spheres");
/// What is packed as spheres: these, and the boxes of instances.
pub(crate) const BALLS: bool = SPHERES || INSTANCES;
/// Blocks with instances.
pub(crate) const INSTANCES: bool = cfg!(feature = "instances");
/// Blocks that can be refitted.
pub(crate) const REFIT: bool = cfg!(feature = "refit");
/// Builds on threads that the caller lends; without, all is done by the caller's own.
pub(crate) const THREADS: bool = cfg!(feature = "threads");
