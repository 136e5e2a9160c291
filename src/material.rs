//! Materials: what the surface of a triangle scatters and emits.

use crate::bsdf::{Bsdf, Coated, Conductor, Dielectric, Lambert, Mirror, Reflectance};
use crate::error::Place;
use crate::geometry::Shading;
use crate::math::{Frame, Spectrum};
use crate::texture::Texture;
use glam::{DVec2, DVec3};

/// A named material.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name in the MTL file.
    pub name: String,
    scattering: Scattering,
    maps: Maps,
    /// The model made of `scattering`, but for what textures add.
    bsdf: Bsdf,
    /// Whether `bsdf` is the same everywhere.
    constant: bool,
    /// How far the shading frame is turned about its normal, from the direction of u towards that of v, before
    /// [`Material::bsdf`] is used in it; radians.
    pub tangent_angle: f64,
    /// Emitted radiance, W/(m^2 sr); from the front face only unless [`Material::two_sided_emission`]. A map is
    /// multiplied by it.
    pub emission: Spectrum,
    /// Whether the back face emits as well.
    pub two_sided_emission: bool,
    /// How likely the surface is there at all, 0..=1: what is not stopped goes on straight. A map is multiplied by it.
    pub opacity: f64,
    /// What its file asks for and hrr has not got.
    pub unsupported: Vec<Unsupported>,
}

/// Something that a material's file asks for and that hrr has not got.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unsupported {
    /// The MTL key that asks for it.
    pub key: &'static str,
    /// What it is, and what is done instead.
    pub what: String,
    /// Where.
    pub place: Place,
}

/// What varies over a material's surfaces, beside the diffuse reflectance: data, but for `emission`.
#[derive(Debug, Clone, Default)]
pub struct Maps {
    /// Factor to the square root of the GGX roughness, 0..=1 (the red channel).
    pub roughness: Option<Texture>,
    /// Normals in the frame of u, v and the shading normal, from 0..=1 for -1..=1.
    pub normal: Option<Texture>,
    /// Factor to the emission.
    pub emission: Option<Texture>,
    /// Factor to the opacity, 0..=1 (the red channel).
    pub opacity: Option<Texture>,
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
    /// A glossy or smooth coat over a diffuse base.
    Coated {
        /// Reflectance of the base, 0..=1; of the map, where there is one, the factor.
        albedo: Spectrum,
        /// A texture that `albedo` is multiplied by.
        map: Option<Texture>,
        /// Reflectance of the coat at normal incidence, 0..=1.
        f0: Spectrum,
        /// GGX roughness of the coat along the frame's x axis, 0..=1; both 0 is smooth.
        alpha_x: f64,
        /// GGX roughness of the coat along the frame's y axis, 0..=1.
        alpha_y: f64,
    },
}

impl Material {
    /// A diffuse material that emits nothing; `albedo` in 0..=1.
    pub fn diffuse(name: impl Into<String>, albedo: Spectrum) -> Self {
        Self::new(name, Scattering::Diffuse { albedo, map: None })
    }

    /// An opaque material that emits nothing.
    pub fn new(name: impl Into<String>, scattering: Scattering) -> Self {
        let mut material = Self {
            name: name.into(),
            bsdf: scattering.bsdf(DVec2::ZERO, 1.0),
            scattering,
            maps: Maps::default(),
            constant: true,
            tangent_angle: 0.0,
            emission: Spectrum::ZERO,
            two_sided_emission: false,
            opacity: 1.0,
            unsupported: Vec::new(),
        };
        material.set_maps(Maps::default());
        material
    }

    /// Lays textures over it. One that is the same everywhere costs as little as its value.
    pub fn set_maps(&mut self, maps: Maps) {
        let varies = |map: &Option<Texture>| map.as_ref().is_some_and(|map| map.constant().is_none());
        self.constant = !varies(&maps.roughness) && !varies(self.scattering.albedo_map());
        self.maps = maps;
        self.bsdf = self.bsdf_at(DVec2::ZERO);
    }

    /// Its textures, but for that of the diffuse reflectance.
    pub fn maps(&self) -> &Maps {
        &self.maps
    }

    /// How it scatters.
    pub fn scattering(&self) -> &Scattering {
        &self.scattering
    }

    /// Whether it gives light.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }

    /// Whether all surfaces stop every ray.
    pub fn is_opaque(&self) -> bool {
        self.opacity >= 1.0 && self.maps.opacity.as_ref().is_none_or(|map| map.bounds().0.x >= 1.0)
    }

    /// The probability that a surface stops a ray, at texture coordinates `uv`.
    pub fn opacity_at(&self, uv: DVec2) -> f64 {
        match &self.maps.opacity {
            None => self.opacity,
            Some(map) => (self.opacity * map.lookup(uv).x).clamp(0.0, 1.0),
        }
    }

    /// Emitted radiance at texture coordinates `uv`.
    pub fn emission_at(&self, uv: DVec2) -> Spectrum {
        match &self.maps.emission {
            None => self.emission,
            Some(map) => self.emission * map.lookup(uv).max(Spectrum::ZERO),
        }
    }

    /// The scattering model at texture coordinates `uv`.
    #[inline(always)]
    pub fn bsdf(&self, uv: DVec2) -> Bsdf {
        if self.constant { self.bsdf } else { self.bsdf_at(uv) }
    }

    /// Whether [`Material::bsdf`] is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.constant
    }

    /// Whether the frame that [`Material::bsdf`] works in is another than the surface's.
    #[inline(always)]
    pub fn bends_frame(&self) -> bool {
        self.tangent_angle != 0.0 || self.maps.normal.is_some()
    }

    /// The frame that [`Material::bsdf`] works in.
    #[inline(never)]
    pub fn frame(&self, shading: &Shading, ng: DVec3) -> Frame {
        let mut frame = shading.frame;
        if let Some(map) = &self.maps.normal {
            let n = map.lookup(shading.uv) * 2.0 - 1.0;
            let bent = frame.x * n.x + frame.y * (n.y * shading.handedness) + frame.z * n.z;
            // A normal that shows its back to the surface's own is no normal.
            if let Some(z) = bent.try_normalize().filter(|z| z.dot(ng) * frame.z.dot(ng) > 0.0) {
                frame = Frame::from_z_tangent(z, frame.x);
            }
        }
        let (sin, cos) = self.tangent_angle.sin_cos();
        Frame { x: frame.x * cos + frame.y * sin, y: frame.y * cos - frame.x * sin, z: frame.z }
    }

    fn bsdf_at(&self, uv: DVec2) -> Bsdf {
        let roughness = self.maps.roughness.as_ref().map_or(1.0, |map| map.lookup(uv).x.clamp(0.0, 1.0));
        self.scattering.bsdf(uv, roughness * roughness)
    }
}

impl Scattering {
    /// The texture that the diffuse reflectance is multiplied by.
    pub fn albedo_map(&self) -> &Option<Texture> {
        match self {
            Self::Diffuse { map, .. } | Self::Coated { map, .. } => map,
            _ => &None,
        }
    }

    /// The model at texture coordinates `uv`, GGX roughness times `scale`.
    fn bsdf(&self, uv: DVec2, scale: f64) -> Bsdf {
        let textured = |albedo: &Spectrum, map: &Option<Texture>| match map {
            None => *albedo,
            Some(map) => *albedo * map.lookup(uv).clamp(Spectrum::ZERO, Spectrum::ONE),
        };
        match self {
            Self::Diffuse { albedo, map } => Bsdf::Lambert(Lambert::new(textured(albedo, map))),
            Self::Conductor { reflectance, alpha_x, alpha_y } => {
                Bsdf::Conductor(Conductor::new(*reflectance, alpha_x * scale, alpha_y * scale))
            }
            Self::Dielectric { ior, alpha_x, alpha_y } => {
                Bsdf::Dielectric(Dielectric::new(*ior, alpha_x * scale, alpha_y * scale))
            }
            Self::Mirror { reflectance } => Bsdf::Mirror(Mirror::new(*reflectance)),
            Self::Coated { albedo, map, f0, alpha_x, alpha_y } => {
                Bsdf::Coated(Coated::new(*f0, textured(albedo, map), alpha_x * scale, alpha_y * scale))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use glam::Vec3;
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
