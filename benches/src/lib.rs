//! Measures raykern against its peers: what the programs of this crate share.

pub mod builds;
pub mod c_face;
pub mod check;
#[cfg(feature = "embree")]
pub mod embree;
#[cfg(feature = "embree")]
pub mod embree4;
pub mod grids;
pub mod instances;
pub mod lineup;
pub mod measure;
pub mod motion;
pub mod options;
pub mod ours;
#[cfg(feature = "peers")]
pub mod peers;
pub mod points;
pub mod ratios;
pub mod rays;
pub mod report;
pub mod scenes;
pub mod watch;
