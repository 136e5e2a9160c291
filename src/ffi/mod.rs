//! The C interface, for renderers written in other languages: the vertex tree and the roulette, rays, whole renders.
//!
//! `include/hrr.h` is made from these files and is where hosts read about them; `docs/c-api.md` tells how to use them.
//! Everything here is thin: it checks what a host hands over, turns it into the types of [`crate::vertex_bvh`],
//! [`crate::roulette`], [`crate::visibility`] and [`crate::render`], and gives the same numbers that they give, bit for
//! bit.
//!
//! # Safety
//!
//! What every function asks of its caller, and cannot check: a pointer that is not NULL points to as much as the
//! function's description says, readable or writable, for the time of the call; a handle was made by this library and
//! has not been given up; functions that the host passes return normally.

// The other of the crate's two doors to C.
#![allow(unsafe_code)]
// Said once, above.
#![allow(clippy::missing_safety_doc)]

pub mod status;
pub mod log;
pub mod memory;
pub mod progress;
pub mod context;
pub mod segment;
pub mod cache;
pub mod lobe;
pub mod query;
pub mod batch;
pub mod aids;
pub mod capture;
pub mod replay;
pub mod geometry;
pub mod rays;
pub mod scene;
pub mod render;
mod contents;
mod pointer;
mod points;
mod tasks;

pub use aids::*;
pub use batch::*;
pub use cache::*;
pub use capture::*;
pub use context::*;
pub use geometry::*;
pub use lobe::*;
pub use log::*;
pub use memory::*;
pub use progress::*;
pub use query::*;
pub use rays::*;
pub use render::*;
pub use replay::*;
pub use scene::*;
pub use segment::*;
pub use status::*;
