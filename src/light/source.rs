//! Lights as a scene file gives them, beside emitting materials.

use crate::image::Image;
use crate::math::Spectrum;
use glam::DVec3;
use std::sync::Arc;

/// A light that is no surface; world coordinates.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum LightSource {
    /// Shines the same in all directions from a point.
    Point {
        /// Where.
        position: DVec3,
        /// W/sr.
        intensity: Spectrum,
    },
    /// Shines from a point into a cone.
    Spot {
        /// Where.
        position: DVec3,
        /// Unit direction of the cone's middle.
        direction: DVec3,
        /// W/sr, within the inner angle.
        intensity: Spectrum,
        /// Angle from the middle up to which intensity is full, radians; below `outer`.
        inner: f64,
        /// Angle from the middle at which intensity is 0, radians, in (0, pi].
        outer: f64,
    },
    /// Parallel light, as of the sun.
    Directional {
        /// Unit direction in which it travels.
        direction: DVec3,
        /// On a surface across it, W/m^2.
        irradiance: Spectrum,
    },
    /// Light from all sides.
    Environment {
        /// Radiance, W/(m^2 sr); with an image the factor to its values.
        color: Spectrum,
        /// A map of longitude and latitude: its middle lies towards -z, its top is +y.
        image: Option<Arc<Image>>,
    },
}
