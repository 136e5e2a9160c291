//! Scattering at a surface. Every model works in the local shading frame: z is the shading normal, directions are
//! unit and point away from the surface. Reflecting models look the same from both sides.

use crate::math::Spectrum;
use glam::{DVec2, DVec3};

pub mod lambert;
pub mod fresnel;
pub mod ggx;
pub mod mirror;
pub mod conductor;
pub mod dielectric;
pub mod coated;

pub use coated::Coated;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use fresnel::Reflectance;
pub use lambert::Lambert;
pub use mirror::Mirror;

/// What a subpath carries, which decides how refraction scales it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// An eye subpath: `wo` points towards the eye; refraction scales radiance by (eta_o/eta_i)^2.
    Radiance,
    /// A light subpath: `wo` points towards the light; no such scale.
    Importance,
}

/// A direction drawn from a [`Bsdf`].
#[derive(Debug, Clone, Copy)]
pub struct BsdfSample {
    /// Where the path goes on, unit.
    pub wi: DVec3,
    /// f |cos wi| / pdf, for the transport asked for.
    pub weight: Spectrum,
    /// Density of `wi` given `wo`, 1/sr. For a delta lobe its probability times n^2 |cos| on the side of `wi`: the
    /// amplitude for which densities in both directions describe the same measure.
    pub pdf: f64,
    /// Density of `wo` given `wi`, likewise.
    pub pdf_rev: f64,
    /// Drawn from a delta lobe: `eval` and `pdf` know nothing of it.
    pub delta: bool,
}

/// The glossy reflection of a [`Bsdf`], for those who want to know where its light goes without drawing directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glossy {
    /// GGX roughness along x, not squared.
    pub alpha_x: f64,
    /// GGX roughness along y, not squared.
    pub alpha_y: f64,
    /// Index inside (-z) over outside where light is refracted as well; `None` for reflectors.
    pub eta: Option<f64>,
}

/// A scattering model with its parameters at a point.
#[derive(Debug, Clone, Copy)]
pub enum Bsdf {
    /// Diffuse reflection.
    Lambert(Lambert),
    /// Metal, rough or smooth.
    Conductor(Conductor),
    /// Reflection and refraction, rough or smooth.
    Dielectric(Dielectric),
    /// Perfect reflection.
    Mirror(Mirror),
    /// A glossy or smooth coat over a diffuse base.
    Coated(Coated),
}

impl Bsdf {
    /// f for light that arrives from `w_light` and leaves to `w_eye`, 1/sr; 0 for delta lobes. In this form radiance
    /// and importance see the same value.
    #[inline(always)]
    pub fn eval(&self, w_eye: DVec3, w_light: DVec3) -> Spectrum {
        match self {
            Self::Lambert(b) => b.eval(w_eye, w_light),
            Self::Conductor(b) => b.eval(w_eye, w_light),
            Self::Dielectric(b) => b.eval(w_eye, w_light),
            Self::Coated(b) => b.eval(w_eye, w_light),
            Self::Mirror(_) => Spectrum::ZERO,
        }
    }

    /// Density of [`Bsdf::sample`] choosing `wi` given `wo`, 1/sr; without delta lobes.
    #[inline(always)]
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        match self {
            Self::Lambert(b) => b.pdf(wo, wi),
            Self::Conductor(b) => b.pdf(wo, wi),
            Self::Dielectric(b) => b.pdf(wo, wi),
            Self::Coated(b) => b.pdf(wo, wi),
            Self::Mirror(_) => 0.0,
        }
    }

    /// Draws a direction; `lobe` and `u` are uniform in [0,1). `None` when the draw fell where nothing scatters.
    #[inline(always)]
    pub fn sample(&self, wo: DVec3, transport: Transport, lobe: f64, u: DVec2) -> Option<BsdfSample> {
        match self {
            Self::Lambert(b) => b.sample(wo, u),
            Self::Conductor(b) => b.sample(wo, u),
            Self::Dielectric(b) => b.sample(wo, transport, lobe, u),
            Self::Mirror(b) => b.sample(wo),
            Self::Coated(b) => b.sample(wo, lobe, u),
        }
    }

    /// True when there are only delta lobes, so that connecting to this vertex is pointless.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::Coated(_) => false,
            Self::Conductor(b) => b.is_delta(),
            Self::Dielectric(b) => b.is_delta(),
            Self::Mirror(_) => true,
        }
    }

    /// About how much is scattered on, 0..=1: the survival probability of Russian roulette. A property of the point
    /// alone, so that both directions of a path agree on it; 0 only where nothing is ever scattered.
    #[inline(always)]
    pub fn survival(&self) -> f64 {
        match self {
            Self::Lambert(b) => b.survival(),
            Self::Conductor(b) => b.survival(),
            Self::Dielectric(_) => 1.0,
            Self::Mirror(b) => b.survival(),
            Self::Coated(b) => b.survival(),
        }
    }

    /// The glossy reflection, if the model has one that is not a delta lobe.
    pub fn glossy(&self) -> Option<Glossy> {
        match self {
            Self::Lambert(_) | Self::Mirror(_) => None,
            Self::Conductor(b) => b.glossy(),
            Self::Dielectric(b) => b.glossy(),
            Self::Coated(b) => b.glossy(),
        }
    }

    /// Reflectance of the diffuse lobe beside the glossy or delta one, if the model has both.
    pub fn diffuse_base(&self) -> Option<Spectrum> {
        if let Self::Coated(b) = self { Some(b.albedo()) } else { None }
    }

    /// The greater GGX roughness of the narrowest lobe, 0 for delta lobes; `None` for diffuse models.
    pub fn narrowest(&self) -> Option<f64> {
        match (self.glossy(), self) {
            (_, Self::Lambert(_)) => None,
            (Some(glossy), _) => Some(glossy.alpha_x.max(glossy.alpha_y)),
            (None, _) => Some(0.0),
        }
    }
}
