//! Vectors, frames, boxes, warps and discrete distributions.
//!
//! Numbers are `f64` in registers and `f32` in arrays: paths are computed in double precision, while meshes,
//! bounding boxes, rays and caches, which live from memory bandwidth, are stored in single precision.

pub mod aabb;
pub mod discrete;
pub mod frame;
pub mod relative;
pub mod spectrum;
pub mod warp;

pub use aabb::Aabb;
pub use discrete::Discrete;
pub use frame::Frame;
pub use spectrum::{Spectrum, luminance};
