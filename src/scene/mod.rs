//! A scene, from its files or from memory.

use crate::geometry::Mesh;
use crate::material::Material;
use crate::settings::Settings;
use glam::DVec3;
use std::path::PathBuf;

/// A perspective camera as a scene file gives it; world coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSettings {
    /// Centre of projection.
    pub origin: DVec3,
    /// A point in the middle of the image.
    pub target: DVec3,
    /// A direction that appears upward.
    pub up: DVec3,
    /// Full vertical angle, degrees.
    pub fov_y: f64,
    /// Lens radius, world units; 0 is a pinhole.
    pub aperture_radius: f64,
    /// Distance in perfect focus, world units.
    pub focus_distance: f64,
}

/// The image as a scene file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Reconstruction filter.
    pub filter: Filter,
}

/// How a sample spreads over pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// The pixel it falls in.
    #[default]
    Box,
    /// A Gaussian of half a pixel's standard deviation, cut at 1.5 pixels.
    Gaussian,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            origin: DVec3::new(0.0, 0.0, 1.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov_y: 40.0,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        }
    }
}

impl Default for FilmSettings {
    fn default() -> Self {
        Self { width: 640, height: 480, filter: Filter::Box }
    }
}

/// Everything that is rendered.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The file it came from; empty when made in memory.
    pub path: PathBuf,
    /// All triangles.
    pub mesh: Mesh,
    /// The materials that [`Mesh::materials`] indexes.
    pub materials: Vec<Material>,
    /// The camera.
    pub camera: CameraSettings,
    /// The image.
    pub film: FilmSettings,
    /// How to render it, unless told otherwise.
    pub settings: Settings,
    /// What the loader wants the user to know, one sentence each.
    pub warnings: Vec<String>,
}
