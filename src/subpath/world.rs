//! A scene made ready for rays.

use crate::bsdf::Bsdf;
use crate::camera::Camera;
use crate::error::Result;
use crate::geometry::SurfacePoint;
use crate::light::Lights;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::visibility::{self, Cutouts, Ray, Visibility};
use glam::{DVec2, DVec3};

/// A scene with its emitters, camera and ray queries. Shared by all threads.
pub struct World<'a> {
    /// Triangles and materials.
    pub scene: &'a Scene,
    /// Emitting triangles and other lights.
    pub lights: Lights,
    /// The camera.
    pub camera: Camera,
    /// Ray queries.
    pub visibility: Box<dyn Visibility>,
}

impl<'a> World<'a> {
    /// Builds everything that rays need.
    ///
    /// # Errors
    /// What is wrong with the mesh or camera, and what the visibility backend reports.
    pub fn new(scene: &'a Scene, settings: &Settings) -> Result<Self> {
        scene.mesh.validate()?;
        Ok(Self {
            scene,
            lights: Lights::new(&scene.mesh, &scene.materials, &scene.lights)
                .chosen_by(settings.light_choice, &scene.mesh),
            camera: Camera::new(&scene.camera, (scene.film.width, scene.film.height), scene.mesh.origin)?,
            visibility: visibility::build_with(
                settings.visibility,
                &scene.mesh,
                Cutouts::new(&scene.mesh, &scene.materials),
                visibility::Options::of(settings),
            )?,
        })
    }

    /// The scattering model at a surface point.
    pub fn bsdf_at(&self, point: &SurfacePoint) -> Bsdf {
        let mesh = &self.scene.mesh;
        let material = &self.scene.materials[mesh.materials[point.triangle as usize] as usize];
        material.bsdf(if material.is_constant() { DVec2::ZERO } else { point.uv(mesh) })
    }

    /// The surface point that a ray meets first. `origin` and unit `direction` are the ray in full precision, before
    /// it was moved off its surface and rounded.
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray, origin: DVec3, direction: DVec3) -> Option<SurfacePoint> {
        let hit = self.visibility.intersect(ray)?;
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        Some(SurfacePoint::at_ray(&self.scene.mesh, hit.triangle, u, v, origin, direction))
    }
}
