//! A glossy or smooth coat over a diffuse base: plastic, varnish, and whatever a material file gives both a diffuse and a
//! specular colour.

use super::ggx::Ggx;
use super::{BsdfSample, Glossy, fresnel, mirror};
use crate::math::{Spectrum, luminance, warp};
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

/// f = F D G2 / (4 cos cos) + (1 - F(wo)) (1 - F(wi)) albedo / pi, F being Schlick's approximation: what the coat lets in
/// on the way to the base and out again is what it does not reflect. The same on both faces, and in both directions.
#[derive(Debug, Clone, Copy)]
pub struct Coated {
    /// Reflectance of the coat at normal incidence.
    f0: Spectrum,
    albedo: Spectrum,
    /// `None`: a smooth coat, a delta lobe.
    ggx: Option<Ggx>,
    survival: f64,
}

/// Least and greatest probability of drawing a direction from the coat: neither lobe is starved by an estimate.
const COAT_SHARE: (f64, f64) = (0.05, 0.95);

impl Coated {
    /// `f0`: reflectance of the coat at normal incidence, `albedo`: that of the base, both 0..=1; `alpha_x`, `alpha_y`: GGX
    /// roughness of the coat, 0..=1, not squared, smooth with both under [`MIN_ALPHA`](super::ggx::MIN_ALPHA).
    pub fn new(f0: Spectrum, albedo: Spectrum, alpha_x: f64, alpha_y: f64) -> Self {
        // Schlick's mean over the cosine-weighted hemisphere.
        let coat = f0 + (Spectrum::ONE - f0) / 21.0;
        let survival = (coat + (Spectrum::ONE - coat) * albedo).max_element().clamp(0.0, 1.0);
        Self { f0, albedo, ggx: Ggx::new(alpha_x, alpha_y), survival }
    }

    /// Probability of drawing from the coat, seen from `w`.
    fn coat_share(&self, w: DVec3) -> f64 {
        let coat = fresnel::schlick(w.z.abs(), self.f0);
        let base = luminance((Spectrum::ONE - coat) * self.albedo);
        let coat = luminance(coat);
        if base == 0.0 { 1.0 } else { (coat / (coat + base)).clamp(COAT_SHARE.0, COAT_SHARE.1) }
    }

    fn base(&self, a: DVec3, b: DVec3) -> Spectrum {
        let through = |w: DVec3| Spectrum::ONE - fresnel::schlick(w.z.abs().min(1.0), self.f0);
        self.albedo * through(a) * through(b) * FRAC_1_PI
    }

    pub(super) fn eval(&self, a: DVec3, b: DVec3) -> Spectrum {
        if !(a.z * b.z > 0.0) {
            return Spectrum::ZERO;
        }
        let base = self.base(a, b);
        let Some(ggx) = &self.ggx else { return base };
        let h = a + b;
        base + fresnel::schlick((0.5 * h.length()).min(1.0), self.f0)
            * (ggx.d(h) * ggx.g2_over_4_cosines(a, b))
    }

    pub(super) fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        if !(wo.z * wi.z > 0.0) {
            return 0.0;
        }
        let coat = self.coat_share(wo);
        let base = (1.0 - coat) * wi.z.abs() * FRAC_1_PI;
        let Some(ggx) = &self.ggx else { return base };
        coat * ggx.d(wo + wi) * ggx.g1_over_4_cosine(wo) + base
    }

    pub(super) fn sample(&self, wo: DVec3, lobe: f64, u: DVec2) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let coat = self.coat_share(wo);
        let wi = if lobe >= coat {
            let wi = warp::square_to_cosine_hemisphere(u);
            wi.with_z(wi.z.copysign(wo.z))
        } else if let Some(ggx) = &self.ggx {
            let side = 1f64.copysign(wo.z);
            let m = ggx.sample_visible(wo * side, u) * side;
            (m * (2.0 * wo.dot(m) / m.length_squared()) - wo).normalize()
        } else {
            let s = mirror::reflect(wo, fresnel::schlick(wo.z.abs(), self.f0) / coat)?;
            return Some(BsdfSample { pdf: s.pdf * coat, pdf_rev: s.pdf_rev * coat, ..s });
        };
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: self.eval(wo, wi) * (wi.z.abs() / pdf),
            pdf,
            pdf_rev: self.pdf(wi, wo),
            delta: false,
        })
    }

    pub(super) fn survival(&self) -> f64 {
        self.survival
    }

    pub(super) fn glossy(&self) -> Option<Glossy> {
        self.ggx.map(|g| Glossy { alpha_x: g.alpha_x(), alpha_y: g.alpha_y(), eta: None })
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.albedo
    }
}
