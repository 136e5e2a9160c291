//! The perspective camera: pixels to rays, points to pixels, and the density that joins the two.

use crate::error::{Error, Result};
use crate::math::Frame;
use glam::{DVec2, DVec3};

/// A perspective camera as a scene file gives it; world coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSettings {
    /// Centre of projection.
    pub origin: DVec3,
    /// A point in the middle of the image.
    pub target: DVec3,
    /// A direction that appears upward.
    pub up: DVec3,
    /// Full vertical angle, degrees.
    pub fov_y: f64,
    /// Lens radius, world units; 0 is a pinhole.
    pub aperture_radius: f64,
    /// Distance in perfect focus, world units.
    pub focus_distance: f64,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            origin: DVec3::new(0.0, 0.0, 1.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov_y: 40.0,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        }
    }
}

/// A pinhole camera over a raster of square pixels; raster x grows to the right, y downward.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Centre of projection, mesh coordinates.
    pub position: DVec3,
    /// x right, y up, z backward: what is seen has negative z.
    frame: Frame,
    resolution: DVec2,
    /// Side of a pixel on the image plane at distance 1.
    pixel: f64,
}

impl Camera {
    /// A camera for images of `(width, height)` pixels, relative to `origin`, the world position that the mesh calls
    /// zero.
    pub fn new(camera: &CameraSettings, (width, height): (u32, u32), origin: DVec3) -> Result<Self> {
        let z = camera.origin - camera.target;
        let x = camera.up.cross(z);
        if !(x.length_squared() > 0.0) || !x.is_finite() {
            return Err(Error::Input(
                "camera: origin and target must differ, and up must not point along the view".into(),
            ));
        }
        if !(camera.fov_y > 0.0 && camera.fov_y < 180.0) {
            return Err(Error::Input(format!(
                "camera: fov_y = {} is not between 0 and 180 degrees",
                camera.fov_y
            )));
        }
        if width == 0 || height == 0 {
            return Err(Error::Input(format!("film: {width}x{height} has no pixel")));
        }
        let (x, z) = (x.normalize(), z.normalize());
        let resolution = DVec2::new(width.into(), height.into());
        let pixel = 2.0 * (camera.fov_y.to_radians() * 0.5).tan() / resolution.y;
        Ok(Self { position: camera.origin - origin, frame: Frame { x, y: z.cross(x), z }, resolution, pixel })
    }

    /// Unit direction through a raster position in [0,width) x [0,height).
    pub fn direction(&self, raster: DVec2) -> DVec3 {
        let p = (raster - self.resolution * 0.5) * self.pixel;
        self.frame.to_world(DVec3::new(p.x, -p.y, -1.0)).normalize()
    }

    /// Raster position of a direction, `None` outside the image.
    pub fn raster(&self, direction: DVec3) -> Option<DVec2> {
        let d = self.frame.to_local(direction);
        if !(d.z < 0.0) {
            return None;
        }
        let raster = DVec2::new(d.x, -d.y) / (-d.z * self.pixel) + self.resolution * 0.5;
        (raster.cmpge(DVec2::ZERO).all() && raster.cmplt(self.resolution).all()).then_some(raster)
    }

    /// Density of directions for a position uniform in *one* pixel, 1/sr; `direction` is unit and seen by the camera.
    /// With a box filter this is also the importance that the pixel attaches to radiance from there.
    pub fn pdf_w(&self, direction: DVec3) -> f64 {
        let cos = -self.frame.z.dot(direction);
        1.0 / (self.pixel * self.pixel * cos * cos * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (u32, u32) = (64, 48);

    fn camera() -> Camera {
        let settings = CameraSettings {
            origin: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(-1.0, 0.5, 0.2),
            up: DVec3::Y,
            fov_y: 70.0,
            ..Default::default()
        };
        Camera::new(&settings, SIZE, DVec3::new(5.0, 0.0, 0.0)).unwrap()
    }

    #[test]
    fn ray_and_raster_are_inverse() {
        let camera = camera();
        for i in 0..=64 {
            for j in 0..=48 {
                let raster = DVec2::new(
                    (f64::from(i) + 1e-6) / 64.001 * f64::from(SIZE.0),
                    (f64::from(j) + 1e-6) / 48.001 * f64::from(SIZE.1),
                );
                let back = camera.raster(camera.direction(raster) * 3.7).unwrap();
                assert!((back - raster).length() < 1e-9, "{raster} {back}");
            }
        }
        assert!(camera.raster(camera.frame.z).is_none(), "behind");
        assert!(camera.raster(-camera.frame.z + camera.frame.x * 9.0).is_none(), "beside");
        assert_eq!(camera.position, DVec3::new(-4.0, 2.0, 3.0));
    }

    #[test]
    fn pixel_density_integrates_to_one() {
        // The solid angle of a corner pixel, by midpoint rule over the pixel, must equal the mean of 1 / pdf_w.
        let camera = camera();
        let n = 64;
        let (mut angle, mut inverse) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let at = |a: f64, b: f64| camera.direction(DVec2::new(a, b) / f64::from(n));
                let (i, j) = (f64::from(i), f64::from(j));
                let (a, b, c) = (at(i, j), at(i + 1.0, j), at(i, j + 1.0));
                angle += (b - a).cross(c - a).length();
                inverse += 1.0 / camera.pdf_w(at(i + 0.5, j + 0.5)) / f64::from(n * n);
            }
        }
        assert!((angle / inverse - 1.0).abs() < 1e-3, "{angle} {inverse}");
    }
}
