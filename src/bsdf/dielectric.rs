//! Glass and other dielectrics: rough (GGX) or smooth, reflecting and refracting.

use super::ggx::Ggx;
use super::{BsdfSample, Glossy, Transport, fresnel};
use crate::math::Spectrum;
use glam::{DVec2, DVec3};

/// The interface between the outside (+z) and a medium inside (-z), which light may reach from either side
/// [Walter et al. 2007], with height-correlated G2 for both lobes [Heitz 2014].
///
/// With n the index on the side of a direction (1 outside, `ior` inside), f(a, b) / n_a^2 = f(b, a) / n_b^2: radiance
/// over n^2 is what stays the same along a refracted ray.
#[derive(Debug, Clone, Copy)]
pub struct Dielectric {
    ior: f64,
    /// `None` when smooth.
    ggx: Option<Ggx>,
}

/// The facet that sends light from one of two directions to the other.
struct Facet {
    /// D(m), 1/sr.
    d: f64,
    /// How much of the light it sends that way: F or 1 - F.
    share: f64,
    /// 4 |cos(wo, m)| dm/dwi, over n_i^2 for refraction: the factor that `f` and `pdf` share, and the same with both
    /// directions exchanged.
    spread: f64,
}

impl Dielectric {
    /// `ior` is the index inside over that outside, above 0. `alpha_x`, `alpha_y`: GGX roughness along x and y, 0..=1,
    /// not squared. With both under [`MIN_ALPHA`](super::ggx::MIN_ALPHA), or where the indices differ by less than
    /// 1e-6 so that there is nothing for facets to bend, the interface is smooth: two delta lobes.
    pub fn new(ior: f64, alpha_x: f64, alpha_y: f64) -> Self {
        Self { ior, ggx: Ggx::new(alpha_x, alpha_y).filter(|_| (ior - 1.0).abs() >= 1e-6) }
    }

    /// Index of the medium on the side of `w`, relative to the outside.
    fn index(&self, w: DVec3) -> f64 {
        if w.z > 0.0 { 1.0 } else { self.ior }
    }

    /// Index of the other side over that on the side of `w`.
    fn eta_across(&self, w: DVec3) -> f64 {
        if w.z > 0.0 { self.ior } else { 1.0 / self.ior }
    }

    /// What refraction from the side of `wo` does to what the path carries.
    fn refraction_scale(&self, wo: DVec3, transport: Transport) -> f64 {
        match transport {
            Transport::Radiance => self.eta_across(wo).powi(-2),
            Transport::Importance => 1.0,
        }
    }

    fn facet(&self, ggx: &Ggx, wo: DVec3, wi: DVec3) -> Option<Facet> {
        if wo.z == 0.0 || wi.z == 0.0 {
            return None;
        }
        if reflects(wo, wi) {
            let h = wo + wi;
            // |wo + wi| is twice the cosine, and the same from both sides to the last bit.
            let cos = (0.5 * h.length()).min(1.0);
            let share = fresnel::dielectric(cos, self.eta_across(wo)).0;
            return Some(Facet { d: ggx.d(h), share, spread: 1.0 });
        }
        let h = wo * self.index(wo) + wi * self.index(wi);
        let h = if (h.z > 0.0) == (wo.z > 0.0) { h } else { -h };
        let len2 = h.length_squared();
        let (cos_o, cos_i) = (wo.dot(h), -wi.dot(h));
        // A facet that shows its back to either direction refracts nothing.
        if !(cos_o > 0.0 && cos_i > 0.0) {
            return None;
        }
        let share = fresnel::transmittance_from_cosines(cos_o, cos_i, self.eta_across(wo));
        Some(Facet { d: ggx.d(h), share, spread: 4.0 * (cos_o / len2) * (cos_i / len2) })
    }

    pub(super) fn eval(&self, w_eye: DVec3, w_light: DVec3) -> Spectrum {
        let value = self.ggx.and_then(|ggx| {
            let facet = self.facet(&ggx, w_eye, w_light)?;
            let n = if reflects(w_eye, w_light) { 1.0 } else { self.index(w_eye) };
            Some(facet.share * facet.d * facet.spread * n * n * ggx.g2_over_4_cosines(w_eye, w_light))
        });
        Spectrum::splat(value.unwrap_or(0.0))
    }

    pub(super) fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        let pdf = self.ggx.and_then(|ggx| {
            let facet = self.facet(&ggx, wo, wi)?;
            let n = if reflects(wo, wi) { 1.0 } else { self.index(wi) };
            Some(facet.share * facet.d * facet.spread * n * n * ggx.g1_over_4_cosine(wo))
        });
        pdf.unwrap_or(0.0)
    }

    pub(super) fn sample(&self, wo: DVec3, transport: Transport, lobe: f64, u: DVec2) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let Some(ggx) = &self.ggx else {
            return Some(self.sample_smooth(wo, transport, lobe));
        };
        let side = 1f64.copysign(wo.z);
        let m = ggx.sample_visible(wo * side, u).normalize() * side;
        let cos_o = wo.dot(m).clamp(0.0, 1.0);
        let eta = self.eta_across(wo);
        let (wi, facet_reflects) = match fresnel::dielectric(cos_o, eta) {
            (f, Some(cos_t)) if lobe >= f => (m * (cos_o / eta - cos_t) - wo / eta, false),
            _ => (m * (2.0 * cos_o) - wo, true),
        };
        let wi = wi.normalize();
        // A tilted facet may reflect into the surface or refract back out of it: masked, and not the other lobe.
        if reflects(wo, wi) != facet_reflects {
            return None;
        }
        // Value and density are those of the direction as rounded, not of the normal it came from.
        let pdf = self.pdf(wo, wi);
        let scale = if facet_reflects { 1.0 } else { self.refraction_scale(wo, transport) };
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: Spectrum::splat(scale * ggx.g2_over_g1(wo, wi)),
            pdf,
            pdf_rev: self.pdf(wi, wo),
            delta: false,
        })
    }

    fn sample_smooth(&self, wo: DVec3, transport: Transport, lobe: f64) -> BsdfSample {
        let eta = self.eta_across(wo);
        let (wi, probability, scale) = match fresnel::dielectric(wo.z.abs().min(1.0), eta) {
            (f, Some(cos_t)) if lobe >= f => {
                let wi = DVec3::new(-wo.x / eta, -wo.y / eta, -cos_t.copysign(wo.z));
                (wi, 1.0 - f, self.refraction_scale(wo, transport))
            }
            (f, _) => (DVec3::new(-wo.x, -wo.y, wo.z), f, 1.0),
        };
        BsdfSample {
            wi,
            weight: Spectrum::splat(scale),
            pdf: probability * self.index(wi).powi(2) * wi.z.abs(),
            pdf_rev: probability * self.index(wo).powi(2) * wo.z.abs(),
            delta: true,
        }
    }

    pub(super) fn is_delta(&self) -> bool {
        self.ggx.is_none()
    }

    pub(super) fn glossy(&self) -> Option<Glossy> {
        self.ggx.map(|g| Glossy { alpha_x: g.alpha_x(), alpha_y: g.alpha_y(), eta: Some(self.ior) })
    }
}

/// Whether both directions are on one side of the surface.
fn reflects(a: DVec3, b: DVec3) -> bool {
    (a.z > 0.0) == (b.z > 0.0)
}
