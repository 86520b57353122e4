//! What surrounds the core: loaders, scene makers, a renderer, an exact oracle, statistics.

pub mod assembly;
#[cfg(feature = "tools")]
pub mod chart;
#[cfg(feature = "tools")]
pub mod fit;
#[cfg(feature = "tools")]
pub mod load;
pub mod make;
pub mod model;
pub mod oracle;
pub mod rays;
#[cfg(feature = "tools")]
pub mod render;
#[cfg(feature = "tools")]
pub mod scenes;
pub mod search;
pub mod shared_scenes;
#[cfg(feature = "tools")]
pub mod stats;
pub mod stress;
pub mod textbook;
#[cfg(feature = "tools")]
pub mod threads;
