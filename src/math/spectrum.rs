//! Colours.

use glam::DVec3;

/// Linear Rec. 709 RGB. Radiance in W/(m^2 sr), reflectance in 0..=1.
pub type Spectrum = DVec3;

/// Luminance of a linear Rec. 709 colour, in the colour's own unit.
pub fn luminance(c: Spectrum) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}
