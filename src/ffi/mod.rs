//! The C interface: the vertex tree and the roulette, for renderers written in other languages.
//!
//! `include/hrr.h` is made from these files and is where hosts read about them; `docs/c-api.md` tells how to use them.
//! Everything here is thin: it checks what a host hands over, turns it into the types of [`crate::vertex_bvh`] and
//! [`crate::roulette`], and gives the same numbers that they give, bit for bit.
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
pub mod context;
pub mod segment;
pub mod cache;
pub mod lobe;
pub mod query;
pub mod batch;
pub mod aids;
mod pointer;
mod tasks;

pub use aids::*;
pub use batch::*;
pub use cache::*;
pub use context::*;
pub use lobe::*;
pub use query::*;
pub use segment::*;
pub use status::*;
