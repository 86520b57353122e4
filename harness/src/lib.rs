//! What surrounds the core: loaders, scene makers, a renderer, an exact oracle, statistics.

pub mod make;
pub mod model;
pub mod oracle;
pub mod rays;
