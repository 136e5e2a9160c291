//! Images as functions of texture coordinates.

use crate::image::Image;
use crate::math::Spectrum;
use glam::DVec2;
use std::sync::Arc;

/// An image laid over the plane of texture coordinates, (0, 0) at its lower left and (1, 1) at its upper right corner,
/// repeated in both directions and interpolated bilinearly between the centres of pixels.
#[derive(Debug, Clone)]
pub struct Texture {
    image: Arc<Image>,
    scale: DVec2,
    offset: DVec2,
    /// Least and greatest pixel, channel by channel.
    bounds: (Spectrum, Spectrum),
    even: bool,
}

impl Texture {
    /// The texture coordinates (u, v) look up the image at (u, v) * `scale` + `offset`. The image must have pixels.
    pub fn new(image: Arc<Image>, scale: DVec2, offset: DVec2) -> Self {
        debug_assert!(image.width > 0 && image.height > 0);
        let mut pixels = image.pixels.iter().map(|p| p.as_dvec3());
        let first = pixels.next().unwrap_or_default();
        let bounds = pixels.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        Self { image, scale, offset, bounds, even: bounds.0 == bounds.1 }
    }

    /// The value at texture coordinates, in the image's linear units.
    pub fn lookup(&self, uv: DVec2) -> Spectrum {
        let uv = uv * self.scale + self.offset;
        self.between(
            Axis::new(uv.x, self.image.width as usize),
            Axis::new(1.0 - uv.y, self.image.height as usize),
        )
    }

    /// As [`Texture::lookup`], repeated from left to right only: above and below, the border goes on.
    pub fn lookup_clamped(&self, uv: DVec2) -> Spectrum {
        let uv = uv * self.scale + self.offset;
        self.between(
            Axis::new(uv.x, self.image.width as usize),
            Axis::clamped(1.0 - uv.y, self.image.height as usize),
        )
    }

    fn between(&self, x: Axis, y: Axis) -> Spectrum {
        if self.even {
            // To the bit, which interpolation would not give.
            return self.bounds.0;
        }
        let w = self.image.width as usize;
        let at = |column: usize, row: usize| self.image.pixels[row * w + column].as_dvec3();
        let above = at(x.first, y.first).lerp(at(x.second, y.first), x.weight);
        let below = at(x.first, y.second).lerp(at(x.second, y.second), x.weight);
        above.lerp(below, y.weight)
    }

    /// The value, where it is the same over the whole plane.
    pub fn constant(&self) -> Option<Spectrum> {
        self.even.then_some(self.bounds.0)
    }

    /// Least and greatest value of each channel over the whole plane.
    pub fn bounds(&self) -> (Spectrum, Spectrum) {
        self.bounds
    }
}

/// The two pixels around a coordinate, and how far it lies towards the second.
struct Axis {
    first: usize,
    second: usize,
    weight: f64,
}

impl Axis {
    fn new(coordinate: f64, pixels: usize) -> Self {
        let wrapped = coordinate.rem_euclid(1.0);
        // Infinite coordinates have no place in the image; they read its first pixel.
        let x = if wrapped.is_finite() { wrapped * pixels as f64 - 0.5 } else { 0.0 };
        let floor = x.floor();
        let first = (floor as isize).rem_euclid(pixels as isize) as usize;
        Self { first, second: if first + 1 == pixels { 0 } else { first + 1 }, weight: x - floor }
    }

    fn clamped(coordinate: f64, pixels: usize) -> Self {
        let x = (coordinate.clamp(0.0, 1.0) * pixels as f64 - 0.5).clamp(0.0, (pixels - 1) as f64);
        let first = x as usize;
        Self { first, second: (first + 1).min(pixels - 1), weight: x - first as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    /// 2 x 2: red green / blue white.
    fn checks(scale: DVec2, offset: DVec2) -> Texture {
        let pixels = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
        Texture::new(Arc::new(Image { width: 2, height: 2, pixels }), scale, offset)
    }

    #[test]
    fn centres_read_pixels_and_the_first_row_is_on_top() {
        let t = checks(DVec2::ONE, DVec2::ZERO);
        for (u, v, expected) in
            [(0.25, 0.75, DVec3::X), (0.75, 0.75, DVec3::Y), (0.25, 0.25, DVec3::Z), (0.75, 0.25, DVec3::ONE)]
        {
            for shift in [DVec2::ZERO, DVec2::new(3.0, -2.0), DVec2::new(-1.0, 7.0)] {
                assert!((t.lookup(DVec2::new(u, v) + shift) - expected).length() < 1e-12);
            }
        }
        assert!((t.lookup(DVec2::splat(0.5)) - DVec3::splat(0.5)).length() < 1e-12);
    }

    #[test]
    fn lookups_are_continuous_over_the_seam() {
        let t = checks(DVec2::ONE, DVec2::ZERO);
        for seam in [0.0, 1.0, -1.0] {
            for v in [0.1, 0.6] {
                let (a, b) = (t.lookup(DVec2::new(seam - 1e-9, v)), t.lookup(DVec2::new(seam + 1e-9, v)));
                assert!((a - b).length() < 1e-7, "{a} {b}");
                let (a, b) = (t.lookup(DVec2::new(v, seam - 1e-9)), t.lookup(DVec2::new(v, seam + 1e-9)));
                assert!((a - b).length() < 1e-7, "{a} {b}");
            }
        }
    }

    #[test]
    fn scale_comes_before_offset() {
        let plain = checks(DVec2::ONE, DVec2::ZERO);
        let t = checks(DVec2::new(2.0, 3.0), DVec2::new(0.1, -0.2));
        let uv = DVec2::new(0.3, 0.8);
        let there = DVec2::new(0.3 * 2.0 + 0.1, 0.8 * 3.0 - 0.2);
        assert!((t.lookup(uv) - plain.lookup(there)).length() < 1e-12);
    }

    #[test]
    fn an_even_image_is_its_value_to_the_bit() {
        let pixels = vec![Vec3::new(0.1, 0.7, 1e-3); 6];
        let t = Texture::new(
            Arc::new(Image { width: 3, height: 2, pixels }),
            DVec2::new(1.3, 0.7),
            DVec2::splat(0.11),
        );
        assert_eq!(t.constant(), Some(t.bounds().0));
        for i in 0..200 {
            let uv = DVec2::new(f64::from(i) * 0.0173, f64::from(i) * -0.0291);
            assert_eq!((t.lookup(uv), t.lookup_clamped(uv)), (t.bounds().0, t.bounds().0), "{uv}");
        }
        assert_eq!(checks(DVec2::ONE, DVec2::ZERO).constant(), None);
    }

    #[test]
    fn odd_coordinates_stay_in_the_image() {
        let t = checks(DVec2::ONE, DVec2::ZERO);
        for x in [f64::NAN, f64::INFINITY, 1e300, -1e300, -1e-18, 1.0 - 1e-17] {
            assert!(t.lookup(DVec2::splat(x)).is_finite());
        }
        assert_eq!(t.bounds(), (DVec3::ZERO, DVec3::ONE));
    }
}
