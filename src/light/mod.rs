//! Emitters: picking one, points and directions on it, and the densities of both.

pub mod area;

pub mod guide;

pub use area::{EmitterPoint, Lights};
pub use guide::EmissionGuide;
