//! Subpaths: random walks from the light and from the eye.

pub mod world;
pub mod storing;
pub mod vertex;
pub mod walk;
pub mod from_light;

pub use storing::{Origin, Role, Storing, Total};
pub use vertex::{Scattered, Vertex};
pub use walk::Walk;
pub use world::World;
