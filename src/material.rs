//! Materials: what the surface of a triangle scatters and emits.

use crate::bsdf::{Bsdf, Conductor, Dielectric, Lambert, Mirror, Reflectance};
use crate::math::Spectrum;
use crate::texture::Texture;
use glam::DVec2;

/// A named material.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name in the MTL file.
    pub name: String,
    /// How it scatters.
    pub scattering: Scattering,
    /// How far the shading frame is turned about its normal, from the direction of u towards that of v, before
    /// [`Material::bsdf`] is used in it; radians.
    pub tangent_angle: f64,
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
        /// Reflectance per channel, 0..=1; of the map, where there is one, the factor.
        albedo: Spectrum,
        /// A texture that `albedo` is multiplied by.
        map: Option<Texture>,
    },
    /// A metal with a smooth or GGX surface.
    Conductor {
        /// What a smooth surface reflects.
        reflectance: Reflectance,
        /// GGX roughness along the frame's x axis, 0..=1; both 0 is smooth.
        alpha_x: f64,
        /// GGX roughness along the frame's y axis, 0..=1.
        alpha_y: f64,
    },
    /// A transparent body with a smooth or GGX surface, entered where the front face is met.
    Dielectric {
        /// Index of refraction inside over that outside, > 0.
        ior: f64,
        /// GGX roughness along the frame's x axis, 0..=1; both 0 is smooth.
        alpha_x: f64,
        /// GGX roughness along the frame's y axis, 0..=1.
        alpha_y: f64,
    },
    /// A perfectly smooth mirror.
    Mirror {
        /// Reflectance per channel, the same at every angle, 0..=1.
        reflectance: Spectrum,
    },
}

impl Material {
    /// A diffuse material that emits nothing; `albedo` in 0..=1.
    pub fn diffuse(name: impl Into<String>, albedo: Spectrum) -> Self {
        Self::new(name, Scattering::Diffuse { albedo, map: None })
    }

    /// A material that emits nothing.
    pub fn new(name: impl Into<String>, scattering: Scattering) -> Self {
        let (emission, two_sided_emission) = (Spectrum::ZERO, false);
        Self { name: name.into(), scattering, tangent_angle: 0.0, emission, two_sided_emission }
    }

    /// Whether it gives light.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }

    /// The scattering model at texture coordinates `uv`.
    pub fn bsdf(&self, uv: DVec2) -> Bsdf {
        match &self.scattering {
            Scattering::Diffuse { albedo, map: None } => Bsdf::Lambert(Lambert::new(*albedo)),
            Scattering::Diffuse { albedo, map: Some(map) } => {
                let texel = map.lookup(uv).clamp(Spectrum::ZERO, Spectrum::ONE);
                Bsdf::Lambert(Lambert::new(*albedo * texel))
            }
            Scattering::Conductor { reflectance, alpha_x, alpha_y } => {
                Bsdf::Conductor(Conductor::new(*reflectance, *alpha_x, *alpha_y))
            }
            Scattering::Dielectric { ior, alpha_x, alpha_y } => {
                Bsdf::Dielectric(Dielectric::new(*ior, *alpha_x, *alpha_y))
            }
            Scattering::Mirror { reflectance } => Bsdf::Mirror(Mirror::new(*reflectance)),
        }
    }
}
