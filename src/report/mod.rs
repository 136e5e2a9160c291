//! What accuracy costs in time: how far an image is from another, and what was paid to come so near.

pub mod flip;
pub mod metric;
