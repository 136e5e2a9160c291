//! The perspective camera: pixels to rays, points to pixels, and the density that joins the two.

use crate::error::{Error, Result};
use crate::math::{Frame, warp};
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

/// A camera with a pinhole or a thin lens over a raster of square pixels; raster x grows to the right, y downward.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Centre of projection and of the lens, mesh coordinates.
    pub position: DVec3,
    /// x right, y up, z backward: what is seen has negative z.
    frame: Frame,
    resolution: DVec2,
    /// Side of a pixel on the image plane at distance 1.
    pixel: f64,
    /// Radius of the lens; 0: a pinhole.
    aperture: f64,
    /// Distance of the plane in focus.
    focus: f64,
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
        let (aperture, focus) = (camera.aperture_radius, camera.focus_distance);
        if !(aperture >= 0.0 && aperture.is_finite()) || aperture > 0.0 && !(focus > 0.0 && focus.is_finite())
        {
            return Err(Error::Input(format!(
                "camera: aperture_radius = {aperture} must not be negative, and focus_distance = {focus} must be positive"
            )));
        }
        let frame = Frame { x, y: z.cross(x), z };
        Ok(Self { position: camera.origin - origin, frame, resolution, pixel, aperture, focus })
    }

    /// Whether there is a lens, and with it depth of field.
    pub fn has_lens(&self) -> bool {
        self.aperture > 0.0
    }

    /// Where rays start: a point of the lens, uniform over its area for `u` uniform in the unit square. A pinhole does
    /// not ask for `u`.
    #[inline]
    pub fn lens_point(&self, u: impl FnOnce() -> DVec2) -> DVec3 {
        if self.aperture == 0.0 {
            return self.position;
        }
        let disc = warp::square_to_disc(u()) * self.aperture;
        self.position + self.frame.x * disc.x + self.frame.y * disc.y
    }

    /// The unit direction from a point of the lens that belongs to a raster position: where the plane in focus is met,
    /// the rays from all points of the lens meet.
    #[inline]
    pub fn direction_from(&self, lens: DVec3, raster: DVec2) -> DVec3 {
        let direction = self.direction(raster);
        if self.aperture == 0.0 {
            return direction;
        }
        let in_focus = self.position + direction * (self.focus / -self.frame.z.dot(direction));
        (in_focus - lens).normalize()
    }

    /// Raster position of a unit direction from a point of the lens, `None` outside the image.
    pub fn raster_from(&self, lens: DVec3, direction: DVec3) -> Option<DVec2> {
        if self.aperture == 0.0 {
            return self.raster(direction);
        }
        let cos = -self.frame.z.dot(direction);
        if !(cos > 0.0) {
            return None;
        }
        self.raster(lens + direction * (self.focus / cos) - self.position)
    }

    /// Unit direction from the centre through a raster position in [0,width) x [0,height).
    pub fn direction(&self, raster: DVec2) -> DVec3 {
        let p = (raster - self.resolution * 0.5) * self.pixel;
        self.frame.to_world(DVec3::new(p.x, -p.y, -1.0)).normalize()
    }

    /// Raster position of a direction from the centre, `None` outside the image.
    pub fn raster(&self, direction: DVec3) -> Option<DVec2> {
        let d = self.frame.to_local(direction);
        if !(d.z < 0.0) {
            return None;
        }
        let raster = DVec2::new(d.x, -d.y) / (-d.z * self.pixel) + self.resolution * 0.5;
        (raster.cmpge(DVec2::ZERO).all() && raster.cmplt(self.resolution).all()).then_some(raster)
    }

    /// Density of directions from any one point of the lens for a position uniform in *one* pixel, 1/sr; `direction` is
    /// unit and seen by the camera. With a box filter this is also the importance that the pixel attaches to radiance
    /// from there. (The plane in focus shows pixels of the same shape from everywhere, at distances that cancel.)
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
    fn rays_through_a_lens_meet_in_focus_and_find_their_raster_position() {
        let settings = CameraSettings {
            origin: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(-1.0, 0.5, 0.2),
            aperture_radius: 0.3,
            focus_distance: 2.0,
            ..Default::default()
        };
        let camera = Camera::new(&settings, SIZE, DVec3::ZERO).unwrap();
        for raster in [DVec2::new(0.5, 1.0), DVec2::new(32.0, 24.0), DVec2::new(63.0, 40.5)] {
            let center = camera.direction(raster);
            let focus = camera.position + center * (2.0 / -camera.frame.z.dot(center));
            for u in [DVec2::new(0.1, 0.2), DVec2::new(0.9, 0.3), DVec2::new(0.5, 0.99)] {
                let lens = camera.lens_point(|| u);
                assert!(
                    (lens - camera.position).length() <= 0.3
                        && camera.frame.z.dot(lens - camera.position).abs() < 1e-15
                );
                let direction = camera.direction_from(lens, raster);
                let to_focus = focus - lens;
                assert!((direction.cross(to_focus)).length() < 1e-14 && direction.dot(to_focus) > 0.0);
                assert!((camera.raster_from(lens, direction).unwrap() - raster).length() < 1e-9);
                // The density is the solid angle's of a pixel, seen from the lens point.
                let step = |d: DVec2| camera.direction_from(lens, raster + d * 1e-4);
                let angle =
                    (step(DVec2::X) - step(-DVec2::X)).cross(step(DVec2::Y) - step(-DVec2::Y)).length()
                        / 4e-8;
                assert!((angle * camera.pdf_w(direction) - 1.0).abs() < 1e-6);
            }
        }
        let broken = CameraSettings { focus_distance: 0.0, ..settings };
        assert!(Camera::new(&broken, SIZE, DVec3::ZERO).is_err());
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
