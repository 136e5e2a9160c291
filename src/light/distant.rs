//! Light that arrives in parallel rays, from a direction of the environment or a directional light, and the disc outside
//! the scene from which light subpaths bring it in.

use crate::math::{Frame, Spectrum, warp};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The sphere around the scene that distant light comes through.
#[derive(Debug, Clone, Copy, Default)]
pub struct Surroundings {
    /// Middle, mesh coordinates.
    pub center: DVec3,
    /// A little more than the distance of the farthest point of the scene.
    pub radius: f64,
}

/// A direction that light comes from.
#[derive(Debug, Clone, Copy)]
pub struct DistantPoint {
    /// Unit direction in which the light travels.
    pub direction: DVec3,
    /// Radiance; irradiance on a surface across the rays, W/m^2, where `delta`.
    pub radiance: Spectrum,
    /// Density of the direction among all lights' points, 1/sr; the probability of choosing the light where `delta`.
    pub pdf: f64,
    /// Whether the light comes from one direction only.
    pub delta: bool,
    /// The light's number.
    pub(super) number: u32,
}

impl Surroundings {
    /// Density of positions on the disc through which one direction's light enters, per area across the rays.
    pub fn density(&self) -> f64 {
        1.0 / (PI * self.radius * self.radius)
    }

    /// Where a ray in a direction enters; `u` is uniform in the unit square.
    pub fn entry(&self, direction: DVec3, u: DVec2) -> DVec3 {
        let (frame, disc) = (Frame::from_z(direction), warp::square_to_disc(u));
        self.center + (frame.x * disc.x + frame.y * disc.y - direction) * self.radius
    }

    /// The point of the unit square that [`Surroundings::entry`] turns into the ray in a direction through a position.
    pub fn square_of(&self, direction: DVec3, position: DVec3) -> DVec2 {
        let local = Frame::from_z(direction).to_local(position - self.center);
        warp::disc_to_square(local.truncate() / self.radius)
    }
}
