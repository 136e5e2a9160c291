//! Rays against single triangles, for the backends that are written here: the watertight test of [Woop, Benthin & Wald
//! 2013, "Watertight Ray/Triangle Intersection"], in double precision. Two triangles that share an edge compute the
//! same value for it, so no ray passes between them.

use super::{Hit, Ray};
use glam::{DVec3, Vec3};

/// A ray in a frame in which it runs along z, one unit of z being one unit of distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shear {
    origin: DVec3,
    /// The permutation that makes z the direction's largest component.
    axes: [usize; 3],
    /// x and y of the direction over its z, and 1 over its z.
    scale: DVec3,
    t_min: f64,
}

impl Shear {
    pub(super) fn new(ray: &Ray) -> Self {
        let direction = ray.direction.as_dvec3();
        let z = ray.direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let scale = DVec3::new(direction[axes[0]], direction[axes[1]], 1.0) / direction[z];
        Self { origin: ray.origin.as_dvec3(), axes, scale, t_min: f64::from(ray.t_min) }
    }

    /// The distance and the barycentric weights (second and third corner) where the ray meets a triangle within
    /// (`t_min`, `t_max`). A triangle seen edge-on or without area is not met.
    #[inline]
    pub(super) fn meet(&self, corners: &[Vec3; 3], t_max: f64) -> Option<(f64, [f64; 2])> {
        let [a, b, c] = corners.map(|corner| {
            let p = corner.as_dvec3() - self.origin;
            let z = p[self.axes[2]];
            DVec3::new(
                p[self.axes[0]] - self.scale.x * z,
                p[self.axes[1]] - self.scale.y * z,
                self.scale.z * z,
            )
        });
        let u = c.x * b.y - c.y * b.x;
        let v = a.x * c.y - a.y * c.x;
        let w = b.x * a.y - b.y * a.x;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        let t = (u * a.z + v * b.z + w * c.z) / det;
        // A vanishing `det` makes `t` NaN or infinite.
        (self.t_min < t && t < t_max).then(|| (t, [v / det, w / det]))
    }
}

pub(super) fn hit(triangle: u32, (t, [u, v]): (f64, [f64; 2])) -> Hit {
    Hit { triangle, u: u as f32, v: v as f32, t: t as f32 }
}
