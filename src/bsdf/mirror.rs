//! A perfect mirror, on both faces.

use super::BsdfSample;
use crate::math::Spectrum;
use glam::DVec3;

/// Reflects the same share of light in every direction.
#[derive(Debug, Clone, Copy)]
pub struct Mirror {
    reflectance: Spectrum,
}

impl Mirror {
    /// `reflectance` per channel, 0..=1.
    pub fn new(reflectance: Spectrum) -> Self {
        Self { reflectance }
    }

    pub(super) fn sample(&self, wo: DVec3) -> Option<BsdfSample> {
        reflect(wo, self.reflectance)
    }

    pub(super) fn survival(&self) -> f64 {
        self.reflectance.max_element().clamp(0.0, 1.0)
    }
}

/// The one direction that a smooth reflector goes on in; `None` along the surface.
pub(super) fn reflect(wo: DVec3, weight: Spectrum) -> Option<BsdfSample> {
    let cos = wo.z.abs();
    (cos > 0.0).then(|| BsdfSample {
        wi: DVec3::new(-wo.x, -wo.y, wo.z),
        weight,
        pdf: cos,
        pdf_rev: cos,
        delta: true,
    })
}
