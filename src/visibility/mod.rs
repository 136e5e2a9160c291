//! Which triangle a ray meets first, and whether anything stands between two points.

use crate::error::Result;
use crate::geometry::Mesh;
use crate::settings::{Backend, EmbreeBuild, Settings, Switch};
use glam::Vec3;

pub mod brute;
pub mod cutouts;
mod bvh4;
#[cfg(feature = "embree")]
pub mod embree;
pub mod obvhs;
pub mod offset;
mod triangle;

pub use cutouts::Cutouts;

/// A ray in the mesh's coordinates. `direction` need not be normalised; hits lie in `t_min < t < t_max`.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// A structure over one mesh that answers ray queries. Both faces of a triangle are seen; degenerate triangles never
/// are. Any number of threads may ask at once.
pub trait Visibility: Send + Sync {
    /// The nearest hit, or `None`.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything is hit at all.
    fn occluded(&self, ray: &Ray) -> bool;
    /// Bytes that the structure holds; `None` when unknown.
    fn bytes(&self) -> Option<u64> {
        None
    }
}

/// How a structure is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Threads at most; 0: all.
    pub threads: usize,
    /// Whether no ray slips between two triangles that share an edge. Obvhs never lets any.
    pub embree_robust: bool,
    /// How much time Embree takes.
    pub embree_build: EmbreeBuild,
}

impl Options {
    /// The default with up to `threads` threads (0: all).
    pub fn threads(threads: usize) -> Self {
        Self { threads, ..Self::of(&Settings::default()) }
    }

    /// What settings say.
    pub fn of(settings: &Settings) -> Self {
        Self {
            threads: settings.threads,
            embree_robust: settings.embree_robust == Switch::On,
            embree_build: settings.embree_build,
        }
    }
}

/// Builds a backend's structure over a mesh with up to `threads` threads (0: all). The mesh is copied.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) when the backend is not part of this build, [`Error::Input`](crate::Error::Input) for an invalid mesh, and what the
/// library below reports.
pub fn build(backend: Backend, mesh: &Mesh, threads: usize) -> Result<Box<dyn Visibility>> {
    build_with(backend, mesh, None, Options::threads(threads))
}

/// As [`build`], over surfaces of which `cutouts` says where they stop rays.
///
/// # Errors
/// As [`build`].
pub fn build_with_cutouts(
    backend: Backend,
    mesh: &Mesh,
    cutouts: Option<Cutouts>,
    threads: usize,
) -> Result<Box<dyn Visibility>> {
    build_with(backend, mesh, cutouts, Options::threads(threads))
}

/// As [`build_with_cutouts`], with a say in how.
///
/// # Errors
/// As [`build`].
pub fn build_with(
    backend: Backend,
    mesh: &Mesh,
    cutouts: Option<Cutouts>,
    options: Options,
) -> Result<Box<dyn Visibility>> {
    match backend {
        #[cfg(feature = "embree")]
        Backend::Embree => Ok(Box::new(embree::Embree::new(mesh, cutouts, options)?)),
        #[cfg(not(feature = "embree"))]
        Backend::Embree => {
            Err(crate::Error::Usage("this hrr was built without Embree (cargo feature 'embree')".into()))
        }
        Backend::Obvhs => Ok(Box::new(obvhs::Obvhs::new(mesh, cutouts, options.threads)?)),
        Backend::Brute => Ok(Box::new(brute::Brute::new(mesh, cutouts)?)),
    }
}
