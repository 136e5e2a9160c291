//! A point on the scene's surface, with the frames that scattering needs.

use super::Mesh;
use crate::math::Frame;
use glam::{DVec2, DVec3};

/// A point on a triangle.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    /// Position relative to the mesh's origin.
    pub position: DVec3,
    /// Unit normal of the triangle's front face.
    pub ng: DVec3,
    /// Shading frame: z on the front face's side, x along the texture's u direction.
    pub frame: Frame,
    /// Texture coordinates (barycentric ones where the mesh has none).
    pub uv: DVec2,
    /// Weights of the triangle's second and third corner.
    pub barycentric: DVec2,
    /// Triangle index.
    pub triangle: u32,
    /// What a unit in the last place of an `f32` is worth here, world units: of the coordinates relative to the mesh's
    /// origin, or of the triangle's extent where that is larger. Rays start off the surface by a little more.
    pub error: f64,
}

impl SurfacePoint {
    /// The point of a triangle with barycentric weights (1-u-v, u, v).
    pub fn at_barycentric(mesh: &Mesh, triangle: u32, u: f64, v: f64) -> Self {
        let corners = mesh.corners(triangle);
        let position = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
        Self::new(mesh, triangle, corners, position, u, v)
    }

    /// The point where a ray meets a triangle's plane. A ray tracer's `f32` barycentric coordinates only say which
    /// triangle; the point is found again in double precision, and `(u, v)` serve where that is ill-conditioned.
    pub fn at_ray(mesh: &Mesh, triangle: u32, u: f64, v: f64, origin: DVec3, direction: DVec3) -> Self {
        let corners = mesh.corners(triangle);
        let [e1, e2] = [corners[1] - corners[0], corners[2] - corners[0]];
        let p = direction.cross(e2);
        let inverse = 1.0 / e1.dot(p);
        let s = origin - corners[0];
        let q = s.cross(e1);
        let (u2, v2, t) = (s.dot(p) * inverse, direction.dot(q) * inverse, e2.dot(q) * inverse);
        // Both answers describe the same hit unless the ray grazes the plane.
        if (u2 - u).abs() + (v2 - v).abs() < 1e-3 {
            Self::new(mesh, triangle, corners, origin + direction * t, u2, v2)
        } else {
            Self::at_barycentric(mesh, triangle, u, v)
        }
    }

    fn new(mesh: &Mesh, triangle: u32, corners: [DVec3; 3], position: DVec3, u: f64, v: f64) -> Self {
        let [e1, e2] = [corners[1] - corners[0], corners[2] - corners[0]];
        let ng = e1.cross(e2).normalize_or(DVec3::Z);
        let indices = mesh.triangles[triangle as usize].map(|i| i as usize);
        let weights = [1.0 - u - v, u, v];
        let mut ns = ng;
        if !mesh.normals.is_empty() {
            let n: DVec3 = (0..3).map(|k| mesh.normals[indices[k]].as_dvec3() * weights[k]).sum();
            // A missing corner normal (zero) or one that faces the other way leaves the face's own.
            let complete = indices.iter().all(|&i| mesh.normals[i] != glam::Vec3::ZERO);
            if complete && n.length_squared() > 1e-12 {
                let n = n.normalize();
                ns = if n.dot(ng) < 0.0 { -n } else { n };
            }
        }
        let (uv, frame) = if mesh.uvs.is_empty() {
            (DVec2::new(u, v), Frame::from_z(ns))
        } else {
            let t = indices.map(|i| mesh.uvs[i].as_dvec2());
            let (d1, d2) = (t[1] - t[0], t[2] - t[0]);
            let det = d1.perp_dot(d2);
            let tangent = (e1 * d2.y - e2 * d1.y) * det.signum();
            let uv = t[0] * weights[0] + t[1] * weights[1] + t[2] * weights[2];
            (uv, if det == 0.0 { Frame::from_z(ns) } else { Frame::from_z_tangent(ns, tangent) })
        };
        let barycentric = DVec2::new(u, v);
        Self { position, ng, frame, uv, barycentric, triangle, error: Self::error_on(&corners) }
    }

    /// [`SurfacePoint::error`] for all points of a triangle.
    pub fn error_on(&[a, b, c]: &[DVec3; 3]) -> f64 {
        let coordinates = a.abs().max(b.abs()).max(c.abs());
        let extent = (b - a).abs().max((c - a).abs());
        coordinates.max(extent).max_element() * f64::from(f32::EPSILON)
    }
}
