//! Hierarchical Russian Roulette for Vertex Connections [Tokuyoshi & Harada 2019]: caustics seen in extremely
//! glossy mirrors, without bias.
//!
//! The modules stand in reading order, each using only what stands above it (`docs/architecture.md`).

pub mod error;
pub mod file;
pub mod math;
pub mod sampler;
pub mod settings;

pub mod image;
pub mod texture;
pub mod geometry;

pub mod bsdf;
pub mod material;
pub mod light;
pub mod camera;
pub mod outliers;
pub mod film;

pub mod scene;
pub mod effects;
pub mod visibility;

pub mod vertex_bvh;
pub mod roulette;
pub mod tally;
pub mod mis;
pub mod subpath;
pub mod light_cache;
pub mod techniques;
pub mod connect;

pub mod integrator;
pub mod render;
pub mod report;

pub mod ffi;

pub use error::{Error, Result};

/// The example in the README, which the documentation tests run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
