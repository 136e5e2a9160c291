//! Triangles and the surface points on them.

pub mod mesh;
pub mod surface;

pub use mesh::Mesh;
pub use surface::{Shading, SurfacePoint};
