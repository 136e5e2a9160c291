//! A surface point where a path scatters.

use super::World;
use crate::bsdf::{Bsdf, Transport};
use crate::geometry::SurfacePoint;
use crate::light::Place;
use crate::math::{Frame, Spectrum};
use crate::sampler::{Purpose, Sampler};
use glam::DVec3;

/// A surface point with its scattering model, seen from where the path came.
#[derive(Debug, Clone, Copy)]
pub struct Vertex {
    /// Where.
    pub point: SurfacePoint,
    /// Unit direction to the previous vertex.
    pub wo: DVec3,
    /// The scattering model.
    pub bsdf: Bsdf,
    /// Frame in which `bsdf` works.
    pub frame: Frame,
    wo_local: DVec3,
}

/// A direction drawn at a vertex.
#[derive(Debug, Clone, Copy)]
pub struct Scattered {
    /// Unit direction, world space.
    pub wi: DVec3,
    /// What the path's throughput is multiplied by.
    pub weight: Spectrum,
    /// Density of `wi` given `wo`, survival included, 1/sr (for delta lobes: see [`BsdfSample::pdf`]).
    ///
    /// [`BsdfSample::pdf`]: crate::bsdf::BsdfSample::pdf
    pub pdf: f64,
    /// Density of `wo` given `wi`, likewise.
    pub pdf_rev: f64,
    /// Whether the direction comes from a delta lobe.
    pub delta: bool,
}

impl Vertex {
    /// The vertex at a surface point, reached from the unit direction `wo`.
    #[inline(always)]
    pub fn new(world: &World<'_>, point: SurfacePoint, wo: DVec3) -> Self {
        let material = &world.scene.materials[world.scene.mesh.materials[point.triangle as usize] as usize];
        let shading = point.shading(&world.scene.mesh);
        let frame = if material.bends_frame() { material.frame(&shading, point.ng) } else { shading.frame };
        Self { point, wo, bsdf: material.bsdf(shading.uv), frame, wo_local: frame.to_local(wo) }
    }

    /// |cos| between the geometric normal and a unit direction.
    #[inline(always)]
    pub fn cos_ng(&self, w: DVec3) -> f64 {
        self.point.ng.dot(w).abs()
    }

    /// The place for which next-event estimation chooses a light.
    pub fn place(&self) -> Place {
        let ng = self.point.ng;
        let normal = if ng.dot(self.wo) >= 0.0 { ng } else { -ng };
        Place { position: self.point.position, normal, passes: matches!(self.bsdf, Bsdf::Dielectric(_)) }
    }

    /// The scattering factor per geometric cosine: f |ns.w_light| / |ng.w_light|, so that a path's contribution is the
    /// product of these factors and of purely geometric terms, the same from either end [Veach 1997, section 5.3].
    /// Zero where shading and geometric normal disagree on the side.
    pub fn factor(&self, w_eye: DVec3, w_light: DVec3) -> Spectrum {
        let (eye, light) = (self.frame.to_local(w_eye), self.frame.to_local(w_light));
        let cos = self.point.ng.dot(w_light);
        if cos * light.z <= 0.0 || self.point.ng.dot(w_eye) * eye.z <= 0.0 {
            return Spectrum::ZERO;
        }
        self.bsdf.eval(eye, light) * (light.z / cos)
    }

    /// What an eye vertex does with light from the direction `wi`: [`Vertex::factor`] times |ng.wi|, that is f |ns.wi|,
    /// and [`Vertex::pdf_w`] for `wo`.
    #[inline(always)]
    pub fn toward_light(&self, wi: DVec3) -> (Spectrum, f64) {
        let light = self.frame.to_local(wi);
        let pdf_w = self.bsdf.pdf(self.wo_local, light) * self.bsdf.survival();
        if self.point.ng.dot(wi) * light.z <= 0.0 || self.point.ng.dot(self.wo) * self.wo_local.z <= 0.0 {
            return (Spectrum::ZERO, pdf_w);
        }
        (self.bsdf.eval(self.wo_local, light) * light.z.abs(), pdf_w)
    }

    /// Density of going on to `to` when coming from `from`, survival included, 1/sr; without delta lobes.
    #[inline]
    pub fn pdf_w(&self, from: DVec3, to: DVec3) -> f64 {
        self.bsdf.pdf(self.frame.to_local(from), self.frame.to_local(to)) * self.bsdf.survival()
    }

    /// Draws a direction to go on in; `depth` keys the random numbers. `None` when the path ends here.
    #[inline(always)]
    pub fn sample(&self, transport: Transport, sampler: &Sampler, depth: u32) -> Option<Scattered> {
        let survival = self.bsdf.survival();
        if survival < 1.0 && sampler.u1(depth, Purpose::Survival) >= survival {
            return None;
        }
        let (lobe, u) = (sampler.u1(depth, Purpose::Lobe), sampler.u2(depth, Purpose::Direction));
        let s = self.bsdf.sample(self.wo_local, transport, lobe, u)?;
        let wi = self.frame.to_world(s.wi);
        let (cos_o, cos_i) = (self.point.ng.dot(self.wo), self.point.ng.dot(wi));
        if cos_o * self.wo_local.z <= 0.0 || cos_i * s.wi.z <= 0.0 {
            return None;
        }
        let adjoint = match transport {
            Transport::Radiance => 1.0,
            Transport::Importance => (self.wo_local.z * cos_i / (cos_o * s.wi.z)).abs(),
        };
        Some(Scattered {
            wi,
            weight: s.weight * (adjoint / survival),
            pdf: s.pdf * survival,
            pdf_rev: s.pdf_rev * survival,
            delta: s.delta,
        })
    }
}
