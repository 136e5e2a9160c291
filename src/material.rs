//! Materials: what the surface of a triangle scatters and emits.

use crate::bsdf::{Bsdf, Lambert};
use crate::math::Spectrum;
use glam::DVec2;

/// A named material.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name in the MTL file.
    pub name: String,
    /// How it scatters.
    pub scattering: Scattering,
    /// Emitted radiance, W/(m^2 sr); from the front face only unless [`Material::two_sided_emission`].
    pub emission: Spectrum,
    /// Whether the back face emits as well.
    pub two_sided_emission: bool,
}

/// How a material scatters, before textures are looked up.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Scattering {
    /// Lambert's law.
    Diffuse {
        /// Reflectance per channel, 0..=1.
        albedo: Spectrum,
    },
}

impl Material {
    /// The scattering model at texture coordinates `uv`.
    pub fn bsdf(&self, uv: DVec2) -> Bsdf {
        let _ = uv;
        match &self.scattering {
            Scattering::Diffuse { albedo } => Bsdf::Lambert(Lambert::new(*albedo)),
        }
    }
}
