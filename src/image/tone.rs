//! Between linear light and the sRGB values of display files (IEC 61966-2-1).

use glam::Vec3;

/// The 8-bit sRGB values of a linear Rec. 709 colour, `exposure` stops brighter. What lies outside 0..=1 is clipped;
/// NaN is black.
pub fn to_srgb8(linear: Vec3, exposure: f32) -> [u8; 3] {
    let scale = exposure.exp2();
    linear.to_array().map(|x| (encode(x * scale) * 255.0 + 0.5) as u8)
}

/// A linear value in 0..=1 as its sRGB value in 0..=1; clipped, NaN is 0.
pub fn encode(linear: f32) -> f32 {
    if linear.is_nan() {
        return 0.0;
    }
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// An sRGB value in 0..=1 as its linear value in 0..=1; the inverse of [`encode`].
pub fn decode(srgb: f32) -> f32 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_value_survives_the_way_there_and_back() {
        for value in 0..=255u8 {
            let linear = decode(f32::from(value) / 255.0);
            assert_eq!(to_srgb8(Vec3::splat(linear), 0.0), [value; 3]);
        }
    }

    #[test]
    fn known_points_and_both_sides_of_the_knee() {
        assert_eq!(to_srgb8(Vec3::new(0.0, 0.5, 1.0), 0.0), [0, 188, 255]);
        // Middle grey of 18 % is 46 % of the signal [IEC 61966-2-1].
        assert!((encode(0.18) - 0.461_356).abs() < 1e-5);
        assert!((encode(0.003_130_7) - encode(0.003_130_9)).abs() < 1e-5);
        assert!((decode(0.040_449) - decode(0.040_451)).abs() < 1e-6);
    }

    #[test]
    fn exposure_is_in_stops() {
        assert_eq!(to_srgb8(Vec3::splat(0.125), 2.0), to_srgb8(Vec3::splat(0.5), 0.0));
        assert_eq!(to_srgb8(Vec3::splat(0.5), -1.0), to_srgb8(Vec3::splat(0.25), 0.0));
    }

    #[test]
    fn anything_is_clipped() {
        assert_eq!(to_srgb8(Vec3::new(-1.0, f32::NAN, f32::INFINITY), 0.0), [0, 0, 255]);
        assert_eq!(to_srgb8(Vec3::new(7.0, f32::NEG_INFINITY, 1e-9), 100.0), [255, 0, 255]);
    }
}
