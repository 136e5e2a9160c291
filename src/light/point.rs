//! x_0 of a path: a point of a light, whatever its kind, as the formulas of theory.md section 6 see it.
//!
//! A lamp without size and a direction have no cosine of their own, and a direction no distance: both then count as 1. So
//! one form of every formula serves all kinds, with the density of x_0 in its own measure: per area, per solid angle, or a
//! plain probability.

use super::EmitterPoint;
use super::distant::{DistantPoint, Surroundings};
use super::lamp::LampPoint;
use crate::math::Spectrum;
use glam::{DVec2, DVec3};

/// A point of a light, with the density of choosing it.
#[derive(Debug, Clone, Copy)]
pub enum LightPoint {
    /// On an emitting triangle.
    Surface(EmitterPoint),
    /// A point or spot light.
    Lamp(LampPoint),
    /// A direction of the environment or of a directional light.
    Distant(DistantPoint),
}

/// A light's point seen from a position.
#[derive(Debug, Clone, Copy)]
pub struct Toward {
    /// Unit direction to it.
    pub w: DVec3,
    /// Squared distance, world units; 1 for distant light.
    pub distance2: f64,
    /// |cos| at the light; 1 where it has no surface.
    pub cos: f64,
    /// Radiance towards the position (intensity of a lamp, irradiance of a directional light).
    pub radiance: Spectrum,
}

/// The start of a light subpath.
#[derive(Debug, Clone, Copy)]
pub struct Emission {
    /// Where the ray starts, mesh coordinates.
    pub origin: DVec3,
    /// Its unit direction.
    pub direction: DVec3,
    /// |cos| at the light; 1 where it has no surface.
    pub cos: f64,
    /// Radiance that it carries (see [`Toward::radiance`]).
    pub radiance: Spectrum,
}

impl LightPoint {
    /// Where it is, mesh coordinates; `None` for distant light.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Surface(e) => Some(e.point.position),
            Self::Lamp(l) => Some(l.lamp.position),
            Self::Distant(_) => None,
        }
    }

    /// Density of choosing this point among all lights' points: 1/m^2 on surfaces, 1/sr of distant light, a probability
    /// where [`LightPoint::is_delta`].
    pub fn pdf(&self) -> f64 {
        match self {
            Self::Surface(e) => e.pdf_a,
            Self::Lamp(l) => l.probability,
            Self::Distant(d) => d.pdf,
        }
    }

    /// Whether no eye subpath can meet it by chance.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Surface(_) => false,
            Self::Lamp(_) => true,
            Self::Distant(d) => d.delta,
        }
    }

    /// The light's number among [`Lights`](super::Lights).
    pub fn number(&self) -> u32 {
        match self {
            Self::Surface(e) => e.emitter,
            Self::Lamp(l) => l.number,
            Self::Distant(d) => d.number,
        }
    }

    /// How it looks from a position; `None` from where it is itself.
    #[inline]
    pub fn toward(&self, from: DVec3) -> Option<Toward> {
        let position = match self {
            Self::Surface(e) => e.point.position,
            Self::Lamp(l) => l.lamp.position,
            Self::Distant(d) => {
                return Some(Toward { w: -d.direction, distance2: 1.0, cos: 1.0, radiance: d.radiance });
            }
        };
        let to = position - from;
        let distance2 = to.length_squared();
        let w = to * (1.0 / distance2.sqrt());
        let (cos, radiance) = match self {
            Self::Surface(e) => (e.point.ng.dot(w).abs(), e.radiance(-w)),
            Self::Lamp(l) => (1.0, l.lamp.intensity(-w)),
            Self::Distant(_) => (1.0, Spectrum::ZERO),
        };
        (distance2 > 0.0).then_some(Toward { w, distance2, cos, radiance })
    }

    /// The light subpath that the point `u` of the unit square stands for; `None` on the horizon.
    pub fn emit(&self, surroundings: &Surroundings, u: DVec2) -> Option<Emission> {
        Some(match self {
            Self::Surface(e) => {
                let direction = e.sample_direction(u)?;
                let cos = e.point.ng.dot(direction).abs();
                Emission { origin: e.point.position, direction, cos, radiance: e.emission }
            }
            Self::Lamp(l) => {
                let direction = l.lamp.sample(u);
                let radiance = l.lamp.intensity(direction);
                Emission { origin: l.lamp.position, direction, cos: 1.0, radiance }
            }
            Self::Distant(d) => {
                let origin = surroundings.entry(d.direction, u);
                Emission { origin, direction: d.direction, cos: 1.0, radiance: d.radiance }
            }
        })
    }

    /// Density of [`LightPoint::emit`] for the subpath that goes in a direction to a position: 1/sr, for distant light
    /// 1/m^2 across the rays.
    pub fn emission_pdf(&self, surroundings: &Surroundings, direction: DVec3) -> f64 {
        match self {
            Self::Surface(e) => e.pdf_w(direction),
            Self::Lamp(l) => l.lamp.pdf(direction),
            Self::Distant(_) => surroundings.density(),
        }
    }

    /// The point of the unit square that [`LightPoint::emit`] turns into the subpath in a direction to a position.
    pub fn square_of(&self, surroundings: &Surroundings, direction: DVec3, position: DVec3) -> DVec2 {
        match self {
            Self::Surface(e) => e.square_of(direction),
            Self::Lamp(l) => l.lamp.square_of(direction),
            Self::Distant(d) => surroundings.square_of(d.direction, position),
        }
    }
}
