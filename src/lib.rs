//! A ray-intersection core.

#![no_std]
#![allow(unused, missing_docs)]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("raykern needs square roots: enable the feature `std` or the feature `libm`");

mod accel;
mod error;
mod math;
mod query;
mod ray;
mod scene;

pub use accel::*;
pub use error::{BuildError, OpenError, Unsupported};
pub use query::{Facing, PrimId, QueryOptions};
pub use ray::{Hit, NONE, Ray};
pub use scene::{Mesh, Scene, SphereSet, Strided};
