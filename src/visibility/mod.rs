//! Which triangle a ray meets first, and whether anything stands between two points.

use crate::geometry::SurfacePoint;
use glam::Vec3;

/// A ray in the mesh's coordinates. `direction` need not be normalised; hits lie in `t_min < t < t_max`.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Direction; distances are in units of its length.
    pub direction: Vec3,
    /// Nearest distance that counts.
    pub t_min: f32,
    /// Farthest distance that counts.
    pub t_max: f32,
}

/// The nearest triangle on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Triangle index.
    pub triangle: u32,
    /// Barycentric weight of the triangle's second corner.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner.
    pub v: f32,
    /// Distance in units of the ray's direction.
    pub t: f32,
}

/// A structure over one mesh that answers ray queries. Both faces of a triangle are seen. Any number of threads may
/// ask at once.
pub trait Visibility: Send + Sync {
    /// The nearest hit, or `None`.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything is hit at all.
    fn occluded(&self, ray: &Ray) -> bool;
}

// To come from the author of this module:
//   pub fn build(backend: settings::Backend, mesh: &Mesh, threads: usize) -> Result<Box<dyn Visibility>>
//   offset.rs: pub fn leave(point: &SurfacePoint, direction: DVec3) -> Ray      (t_max = inf)
//              pub fn between(a: &SurfacePoint, b: &SurfacePoint) -> Ray        (shadow ray)
//              pub fn from_free_point(p: DVec3, ...) for the camera
#[allow(unused)]
type Reserved = SurfacePoint;
