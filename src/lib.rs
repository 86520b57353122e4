//! A ray-intersection core to embed: a regular grid and a bounding volume hierarchy over triangles
//! and spheres, in memory that the caller owns.
//!
//! ```
//! use raykern::{BuildOptions, Mesh, OwnedAccel, Ray, Scene};
//!
//! let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let meshes = [Mesh::indexed(&vertices, &[[0, 1, 2]])];
//! let scene = Scene::new(&meshes, &[]);
//! let built = OwnedAccel::bvh(&scene, &BuildOptions::default())?;
//! let ray = Ray::new([0.25, 0.25, 2.0], [0.0, 0.0, -1.0]);
//! let hit = built.accel().intersect(&ray).expect("the ray points at the triangle");
//! assert_eq!((hit.t, hit.u, hit.v, hit.prim), (2.0, 0.25, 0.25, 0));
//! # Ok::<(), raykern::BuildError>(())
//! ```
//!
//! - [`Scene`] borrows meshes and sphere sets; [`build_bvh`] and [`build_grid`] read them into one
//!   block in memory that the caller passes in, and [`bvh_needs`] and [`grid_needs`] say how much.
//!   A handful of primitives becomes a plain list.
//! - [`Accel`] is a view of such a block: [`Accel::intersect`], [`Accel::occluded`] and their
//!   relatives. All of them take `&self`, allocate nothing and may run on many threads at once.
//! - [`AccelMut`] and [`OwnedAccel`] follow what moves: a block that was built with [`BuildOptions::refit`] is refitted in
//!   its place.
//! - A block holds no pointers: it may be copied, saved, mapped, and [opened](Accel::open) again.
//! - A scene may hold [`Instance`]s of built structures. What is built over them refers to their blocks, until it is
//!   [packed](Accel::pack) with them into one.
//!
//! List, grid and BVH give the same answers, to the bit, for a scene and a ray: see
//! [`Accel::intersect`] for what is promised of them in this version.
//!
//! # Features
//!
//! | feature | adds | costs |
//! |---|---|---|
//! | `std` (default) | `alloc`, `full`; square roots from std; panics stopped at the C boundary | std |
//! | `full` | all kinds of blocks: `wide`, `grid`, `spheres`, `instances`, `refit`, and `threads` for builds, each for itself as well | their code |
//! | `alloc` | [`OwnedAccel`] | a global allocator |
//! | `parallel` | `Rayon`, threads for [`BuildOptions::threads`] | std and the crate rayon |
//! | `libm` | square roots without std | the crate libm |
//! | `capi` | the C entry points `rt_...` of `include/raykern.h` | 20 to 90 kB: what is called |
//! | `capi-panic` | a panic handler, for a C library without std | a few bytes |
//! | `header` | development: writes the C header again | the crate cbindgen |

#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("raykern needs square roots: enable the feature `std` or the feature `libm`");

/// The examples of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod accel;
mod accel_mut;
mod batch;
mod block;
mod build;
mod bvh;
mod caller;
#[cfg(feature = "capi")]
#[cfg_attr(test, allow(dead_code, reason = "unit tests have no entry points"))]
#[allow(unsafe_code, reason = "C passes pointers, and calls by name")]
mod capi;
mod choice;
mod closest;
mod error;
mod exact;
mod grid;
mod hits;
mod instance;
mod interval;
mod kinds;
mod levels;
mod list;
mod math;
#[cfg(feature = "alloc")]
mod owned;
mod pack;
mod pending;
mod point;
mod prim;
mod query;
mod ray;
mod refit;
mod scene;
mod sieve;
mod simd;
mod storage;
mod surface;
mod trace;

pub use accel::{Accel, Info, Kind, Layout};
pub use accel_mut::AccelMut;
pub use build::{
    BuildOptions, Memory, PlainList, Quality, build, build_bvh, build_grid, bvh_needs, grid_needs,
    needs,
};
pub use caller::Threads;
pub use closest::PointHit;
pub use error::{BuildError, OpenError, RefitError};
pub use grid::{GridKind, GridOptions};
pub use hits::{HitKey, Hits};
#[cfg(feature = "alloc")]
pub use owned::OwnedAccel;
#[cfg(feature = "parallel")]
pub use owned::Rayon;
pub use query::{Counts, Facing, Precision, PrimId, QueryOptions};
pub use ray::{Hit, NONE, Ray};
pub use scene::{Instance, Mesh, Scene, SphereSet, Strided};
pub use simd::Backend;
pub use surface::Surface;
