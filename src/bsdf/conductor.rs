//! Metals: rough (GGX) or smooth, the same on both faces.

use super::ggx::Ggx;
use super::{BsdfSample, Glossy, Reflectance, mirror};
use crate::math::Spectrum;
use glam::{DVec2, DVec3};

/// A metal whose facets reflect like a mirror: f = F D G2 / (4 |cos wo| |cos wi|) [Walter et al. 2007, eq. 20], with
/// height-correlated G2 [Heitz 2014]. Light that would be reflected twice between facets is lost.
#[derive(Debug, Clone, Copy)]
pub struct Conductor {
    reflectance: Reflectance,
    /// `None` when smooth.
    ggx: Option<Ggx>,
    survival: f64,
}

impl Conductor {
    /// `alpha_x` along x, `alpha_y` along y: GGX roughness, 0..=1, not squared. With both under
    /// [`MIN_ALPHA`](super::ggx::MIN_ALPHA) the metal is a perfect mirror, a delta lobe; when only one is, it is
    /// raised to that.
    pub fn new(reflectance: Reflectance, alpha_x: f64, alpha_y: f64) -> Self {
        let survival = reflectance.mean().max_element().clamp(0.0, 1.0);
        Self { reflectance, ggx: Ggx::new(alpha_x, alpha_y), survival }
    }

    pub(super) fn eval(&self, a: DVec3, b: DVec3) -> Spectrum {
        match self.ggx {
            Some(ggx) if same_side(a, b) => {
                let h = a + b;
                self.fresnel(h) * (ggx.d(h) * ggx.g2_over_4_cosines(a, b))
            }
            _ => Spectrum::ZERO,
        }
    }

    pub(super) fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        match self.ggx {
            Some(ggx) if same_side(wo, wi) => ggx.d(wo + wi) * ggx.g1_over_4_cosine(wo),
            _ => 0.0,
        }
    }

    pub(super) fn sample(&self, wo: DVec3, u: DVec2) -> Option<BsdfSample> {
        let Some(ggx) = self.ggx else {
            return mirror::reflect(wo, self.reflectance.at(wo.z.abs()));
        };
        let side = 1f64.copysign(wo.z);
        let m = ggx.sample_visible(wo * side, u) * side;
        let wi = (m * (2.0 * wo.dot(m) / m.length_squared()) - wo).normalize();
        if !same_side(wo, wi) {
            return None;
        }
        // Value and density are those of the direction as rounded, not of the normal it came from.
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: self.fresnel(wo + wi) * ggx.g2_over_g1(wo, wi),
            pdf,
            pdf_rev: self.pdf(wi, wo),
            delta: false,
        })
    }

    /// Reflectance of the facet with the unnormalised half vector `h`: its length is twice the cosine, and the same
    /// from both sides to the last bit.
    fn fresnel(&self, h: DVec3) -> Spectrum {
        self.reflectance.at(0.5 * h.length())
    }

    pub(super) fn is_delta(&self) -> bool {
        self.ggx.is_none()
    }

    pub(super) fn survival(&self) -> f64 {
        self.survival
    }

    pub(super) fn glossy(&self) -> Option<Glossy> {
        self.ggx.map(|g| Glossy { alpha_x: g.alpha_x(), alpha_y: g.alpha_y(), eta: None })
    }
}

/// Whether both directions are on one side of the surface; neither may lie in it.
fn same_side(a: DVec3, b: DVec3) -> bool {
    (a.z > 0.0 && b.z > 0.0) || (a.z < 0.0 && b.z < 0.0)
}
