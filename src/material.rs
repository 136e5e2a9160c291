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
    scattering: Scattering,
    /// The model made of `scattering`, but for what a texture adds.
    bsdf: Bsdf,
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
        let bsdf = scattering.bsdf();
        Self { name: name.into(), scattering, bsdf, tangent_angle: 0.0, emission, two_sided_emission }
    }

    /// How it scatters.
    pub fn scattering(&self) -> &Scattering {
        &self.scattering
    }

    /// Whether it gives light.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }

    /// The scattering model at texture coordinates `uv`.
    #[inline(always)]
    pub fn bsdf(&self, uv: DVec2) -> Bsdf {
        match &self.scattering {
            Scattering::Diffuse { albedo, map: Some(map) } => {
                let texel = map.lookup(uv).clamp(Spectrum::ZERO, Spectrum::ONE);
                Bsdf::Lambert(Lambert::new(*albedo * texel))
            }
            _ => self.bsdf,
        }
    }
}

impl Scattering {
    fn bsdf(&self) -> Bsdf {
        match self {
            Self::Diffuse { albedo, .. } => Bsdf::Lambert(Lambert::new(*albedo)),
            Self::Conductor { reflectance, alpha_x, alpha_y } => {
                Bsdf::Conductor(Conductor::new(*reflectance, *alpha_x, *alpha_y))
            }
            Self::Dielectric { ior, alpha_x, alpha_y } => {
                Bsdf::Dielectric(Dielectric::new(*ior, *alpha_x, *alpha_y))
            }
            Self::Mirror { reflectance } => Bsdf::Mirror(Mirror::new(*reflectance)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use glam::{DVec3, Vec3};
    use std::f64::consts::FRAC_1_PI;
    use std::sync::Arc;

    #[test]
    fn a_map_scales_the_albedo_and_cannot_add_energy() {
        let image = Image { width: 1, height: 1, pixels: vec![Vec3::new(0.5, 4.0, -1.0)] };
        let map = Texture::new(Arc::new(image), DVec2::ONE, DVec2::ZERO);
        let albedo = Spectrum::new(0.8, 0.6, 0.4);
        let m = Material::new("m", Scattering::Diffuse { albedo, map: Some(map) });
        let f = m.bsdf(DVec2::splat(0.3)).eval(DVec3::Z, DVec3::Z);
        assert!((f - Spectrum::new(0.4, 0.6, 0.0) * FRAC_1_PI).length() < 1e-12, "{f}");
    }

    #[test]
    fn every_kind_becomes_its_model() {
        let bsdf = |s: Scattering| Material::new("m", s).bsdf(DVec2::ZERO);
        let reflectance = Reflectance::Schlick { f0: Spectrum::ONE };
        let (alpha_x, alpha_y) = (1e-4, 1e-2);
        assert!(matches!(bsdf(Scattering::Diffuse { albedo: Spectrum::ONE, map: None }), Bsdf::Lambert(_)));
        let glossy = bsdf(Scattering::Conductor { reflectance, alpha_x, alpha_y }).glossy().unwrap();
        assert_eq!((glossy.alpha_x, glossy.alpha_y, glossy.eta), (1e-4, 1e-2, None));
        let glossy = bsdf(Scattering::Dielectric { ior: 1.4, alpha_x, alpha_y }).glossy().unwrap();
        assert_eq!((glossy.alpha_x, glossy.alpha_y, glossy.eta), (1e-4, 1e-2, Some(1.4)));
        assert!(bsdf(Scattering::Conductor { reflectance, alpha_x: 0.0, alpha_y: 0.0 }).is_delta());
        assert!(bsdf(Scattering::Dielectric { ior: 1.4, alpha_x: 0.0, alpha_y: 0.0 }).is_delta());
        assert!(bsdf(Scattering::Mirror { reflectance: Spectrum::ONE }).is_delta());
    }
}
