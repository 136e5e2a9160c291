//! `[camera]`: from the keys of a file and the bounds of the geometry to a camera.

use super::document::{At, Table};
use crate::camera::CameraSettings;
use crate::error::Result;
use crate::geometry::Mesh;
use glam::DVec3;

/// Full vertical angle where none is given, degrees.
const FOV_Y: f64 = 40.0;

/// The keys that are given, each with its place.
#[derive(Debug)]
pub(super) struct CameraKeys {
    origin: Option<(DVec3, At)>,
    target: Option<(DVec3, At)>,
    up: Option<(DVec3, At)>,
    fov_y: f64,
    aperture_radius: f64,
    focus_distance: Option<f64>,
}

impl CameraKeys {
    pub(super) fn read(table: &Table) -> Result<Self> {
        let known = ["origin", "target", "up", "fov_y", "aperture_radius", "focus_distance"];
        table.only("[camera]", &known)?;
        let vector = |key: &str| {
            let read =
                |node: &super::document::Node| Ok((node.vector(&format!("camera.{key}"))?, node.at.clone()));
            table.get(key).map(read).transpose()
        };
        let mut keys = Self {
            origin: vector("origin")?,
            target: vector("target")?,
            up: vector("up")?,
            fov_y: table.get("fov_y").map_or(Ok(FOV_Y), |n| n.number("camera.fov_y"))?,
            aperture_radius: 0.0,
            focus_distance: table
                .get("focus_distance")
                .map(|n| n.number("camera.focus_distance"))
                .transpose()?,
        };
        if let Some(node) = table.get("fov_y").filter(|_| !(keys.fov_y > 0.0 && keys.fov_y < 180.0)) {
            let message = format!("camera.fov_y is {}; it must lie between 0 and 180 degrees", keys.fov_y);
            return Err(node.at.error(message));
        }
        if let (Some(node), Some(d)) =
            (table.get("focus_distance"), keys.focus_distance.filter(|&d| d <= 0.0))
        {
            return Err(node.at.error(format!("camera.focus_distance is {d}; it must be positive")));
        }
        if let Some(node) = table.get("aperture_radius") {
            let radius = node.number("camera.aperture_radius")?;
            if radius < 0.0 {
                return Err(node
                    .at
                    .error(format!("camera.aperture_radius is {radius}; it must not be negative")));
            }
            keys.aperture_radius = radius;
        }
        match (&keys.origin, &keys.target) {
            (Some((_, at)), None) => Err(at.error("camera.origin is given, but not camera.target")),
            (None, Some((_, at))) => Err(at.error("camera.target is given, but not camera.origin")),
            (Some((o, _)), Some((t, at))) if o == t => {
                Err(at.error("camera.target is the same point as camera.origin"))
            }
            _ => Ok(keys),
        }
    }

    /// The camera; without a given position, one in front of the geometry that sees all of it. `aspect` is width over
    /// height.
    pub(super) fn settings(&self, mesh: &Mesh, aspect: f64) -> Result<CameraSettings> {
        let (origin, target) = match (&self.origin, &self.target) {
            (Some((origin, _)), Some((target, _))) => (*origin, *target),
            _ => frame(mesh, self.fov_y, aspect),
        };
        let view = target - origin;
        let up = self.up.as_ref().map_or(DVec3::Y, |(up, _)| *up);
        let parallel = up.cross(view).length() <= 1e-6 * up.length() * view.length();
        if let Some((_, at)) = self.up.as_ref().or(self.target.as_ref()).filter(|_| parallel) {
            let message = format!("camera.up, {:?}, is zero or parallel to the view", up.to_array());
            return Err(at.error(message));
        }
        let focus_distance = self.focus_distance.unwrap_or_else(|| view.length());
        let &Self { fov_y, aperture_radius, .. } = self;
        Ok(CameraSettings { origin, target, up, fov_y, aperture_radius, focus_distance })
    }
}

/// Origin and target of a camera that looks along -z, a little from above, at the whole of a mesh.
fn frame(mesh: &Mesh, fov_y: f64, aspect: f64) -> (DVec3, DVec3) {
    let bounds = mesh.bounds();
    let target = mesh.origin + bounds.center();
    let half_y = (fov_y * 0.5).to_radians();
    let half = half_y.min((half_y.tan() * aspect).atan());
    let distance = bounds.radius().max(f64::MIN_POSITIVE) / half.sin();
    (target + DVec3::new(0.0, 0.2, 1.0).normalize() * distance, target)
}
