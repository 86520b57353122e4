//! What surrounds the core: loaders, scene makers, a renderer, an exact oracle, statistics.

pub mod assembly;
pub mod chart;
pub mod fit;
pub mod load;
pub mod make;
pub mod model;
pub mod oracle;
pub mod rays;
pub mod render;
pub mod scenes;
pub mod search;
pub mod shared_scenes;
pub mod stats;
pub mod stress;
pub mod textbook;
