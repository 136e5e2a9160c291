//! Lamps without size: point and spot lights.

use crate::math::{Frame, Spectrum, luminance, warp};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A lamp at a point.
#[derive(Debug, Clone, Copy)]
pub struct Lamp {
    /// Where, mesh coordinates.
    pub position: DVec3,
    /// Radiant intensity on the axis, W/sr.
    pub intensity: Spectrum,
    /// Axis and cone; `None` shines the same in all directions.
    pub cone: Option<Cone>,
}

/// The cone that a spot light fills.
#[derive(Debug, Clone, Copy)]
pub struct Cone {
    /// Unit direction of its middle.
    pub axis: DVec3,
    /// Cosine of the angle from the axis up to which intensity is full.
    pub cos_inner: f64,
    /// Cosine of the angle from the axis at which intensity has fallen to 0; below `cos_inner`.
    pub cos_outer: f64,
}

/// A lamp, chosen among all lights.
#[derive(Debug, Clone, Copy)]
pub struct LampPoint {
    /// The lamp.
    pub lamp: Lamp,
    /// Probability of choosing it.
    pub probability: f64,
    /// The light's number.
    pub(super) number: u32,
}

impl Lamp {
    /// Intensity in a unit direction, W/sr. From the inner to the outer angle it falls along 3t^2 - 2t^3 in the cosine.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let Some(cone) = &self.cone else { return self.intensity };
        let t =
            ((cone.axis.dot(direction) - cone.cos_outer) / (cone.cos_inner - cone.cos_outer)).clamp(0.0, 1.0);
        self.intensity * (t * t * (3.0 - 2.0 * t))
    }

    /// Luminance of all its light, W.
    pub fn power(&self) -> f64 {
        let angle = self.cone.map_or(2.0 * TAU, |c| TAU * (1.0 - 0.5 * (c.cos_inner + c.cos_outer)));
        luminance(self.intensity) * angle
    }

    /// Density of [`Lamp::sample`], 1/sr: uniform over the directions that it shines in.
    pub fn pdf(&self, direction: DVec3) -> f64 {
        match &self.cone {
            None => 0.25 / PI,
            Some(cone) if cone.axis.dot(direction) > cone.cos_outer => 1.0 / (TAU * (1.0 - cone.cos_outer)),
            Some(_) => 0.0,
        }
    }

    /// A direction in which it shines; `u` is uniform in the unit square.
    pub fn sample(&self, u: DVec2) -> DVec3 {
        match &self.cone {
            None => warp::square_to_sphere(u),
            Some(cone) => {
                let z = 1.0 - u.x * (1.0 - cone.cos_outer);
                let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
                let (sin, cos) = (TAU * u.y).sin_cos();
                Frame::from_z(cone.axis).to_world(DVec3::new(r * cos, r * sin, z))
            }
        }
    }

    /// The point of the unit square that [`Lamp::sample`] turns into a direction.
    pub fn square_of(&self, direction: DVec3) -> DVec2 {
        let (local, span) = match &self.cone {
            None => (direction, 2.0),
            Some(cone) => (Frame::from_z(cone.axis).to_local(direction), 1.0 - cone.cos_outer),
        };
        DVec2::new(((1.0 - local.z) / span).clamp(0.0, 1.0), (local.y.atan2(local.x) / TAU).rem_euclid(1.0))
    }
}
