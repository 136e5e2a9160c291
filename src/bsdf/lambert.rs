//! Diffuse reflection, on both faces.

use super::BsdfSample;
use crate::math::{Spectrum, warp};
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

/// Lambert's law: f = albedo / pi.
#[derive(Debug, Clone, Copy)]
pub struct Lambert {
    albedo: Spectrum,
}

impl Lambert {
    /// `albedo` per channel, 0..=1.
    pub fn new(albedo: Spectrum) -> Self {
        Self { albedo }
    }

    #[inline(always)]
    pub(super) fn eval(&self, a: DVec3, b: DVec3) -> Spectrum {
        if a.z * b.z > 0.0 { self.albedo * FRAC_1_PI } else { Spectrum::ZERO }
    }

    #[inline(always)]
    pub(super) fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z * wi.z > 0.0 { wi.z.abs() * FRAC_1_PI } else { 0.0 }
    }

    #[inline(always)]
    pub(super) fn sample(&self, wo: DVec3, u: DVec2) -> Option<BsdfSample> {
        let mut wi = warp::square_to_cosine_hemisphere(u);
        wi.z = wi.z.copysign(wo.z);
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: self.albedo,
            pdf,
            pdf_rev: self.pdf(wi, wo),
            delta: false,
        })
    }

    #[inline(always)]
    pub(super) fn survival(&self) -> f64 {
        self.albedo.max_element().min(1.0)
    }
}
