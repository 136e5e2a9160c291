//! What accuracy costs in time: how far an image is from another, and what was paid to come so near.

pub mod flip;
pub mod metric;
pub mod agreement;
pub mod bootstrap;
pub mod backends;
pub mod study;
pub mod results;
pub mod fall;
pub mod blur;
pub mod curve;
pub mod chart;
pub mod page;
pub mod markdown;
