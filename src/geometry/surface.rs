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
    /// Weights of the triangle's second and third corner.
    pub barycentric: DVec2,
    /// Triangle index.
    pub triangle: u32,
    /// What a unit in the last place of an `f32` is worth here, world units: of the coordinates relative to the mesh's
    /// origin, or of the triangle's extent where that is larger. Rays start off the surface by a little more.
    pub error: f64,
}

/// How a surface lies at a point, for those who scatter there.
#[derive(Debug, Clone, Copy)]
pub struct Shading {
    /// z: shading normal, on the front face's side; x: along the texture's u direction.
    pub frame: Frame,
    /// Texture coordinates (barycentric ones where the mesh has none).
    pub uv: DVec2,
    /// 1 where the texture's v direction is on the side of the frame's y axis, -1 where the texture is mirrored.
    pub handedness: f64,
}

impl SurfacePoint {
    /// The point of a triangle with barycentric weights (1-u-v, u, v).
    pub fn at_barycentric(mesh: &Mesh, triangle: u32, u: f64, v: f64) -> Self {
        let corners = mesh.corners(triangle);
        let position = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Self::new(triangle, &corners, normal, position, DVec2::new(u, v))
    }

    /// The point where a ray meets a triangle's plane. A ray tracer's `f32` barycentric coordinates only say which
    /// triangle; the point is found again in double precision, and `(u, v)` serve where that is ill-conditioned.
    #[inline(always)]
    pub fn at_ray(mesh: &Mesh, triangle: u32, u: f64, v: f64, origin: DVec3, direction: DVec3) -> Self {
        let corners = mesh.corners(triangle);
        let [e1, e2] = [corners[1] - corners[0], corners[2] - corners[0]];
        // [Möller & Trumbore 1997], with the normal, which is wanted anyway, as one of the two cross products.
        let normal = e1.cross(e2);
        let inverse = -1.0 / normal.dot(direction);
        let s = origin - corners[0];
        let q = s.cross(direction);
        let b = DVec2::new(e2.dot(q), -e1.dot(q)) * inverse;
        // Both answers describe the same hit unless the ray grazes the plane.
        let (position, b) = if (b.x - u).abs() + (b.y - v).abs() < 1e-3 {
            (origin + direction * (normal.dot(s) * inverse), b)
        } else {
            (corners[0] + e1 * u + e2 * v, DVec2::new(u, v))
        };
        Self::new(triangle, &corners, normal, position, b)
    }

    #[inline(always)]
    fn new(triangle: u32, corners: &[DVec3; 3], normal: DVec3, position: DVec3, barycentric: DVec2) -> Self {
        Self { position, ng: unit(normal), barycentric, triangle, error: Self::error_on(corners) }
    }

    /// The frame in which light scatters here, and the texture coordinates.
    #[inline(always)]
    pub fn shading(&self, mesh: &Mesh) -> Shading {
        let ns = if mesh.normals.is_empty() { self.ng } else { self.shading_normal(mesh) };
        if mesh.uvs.is_empty() {
            return Shading { frame: Frame::from_z(ns), uv: self.barycentric, handedness: 1.0 };
        }
        let [a, b, c] = mesh.corners(self.triangle);
        let t = mesh.triangles[self.triangle as usize].map(|i| mesh.uvs[i as usize].as_dvec2());
        let (d1, d2) = (t[1] - t[0], t[2] - t[0]);
        let det = d1.perp_dot(d2);
        let handedness = det.signum();
        let tangent = ((b - a) * d2.y - (c - a) * d1.y) * handedness;
        let uv = t[0] + d1 * self.barycentric.x + d2 * self.barycentric.y;
        let frame = if det == 0.0 { Frame::from_z(ns) } else { Frame::from_z_tangent(ns, tangent) };
        Shading { frame, uv, handedness }
    }

    /// Texture coordinates alone.
    pub fn uv(&self, mesh: &Mesh) -> DVec2 {
        if mesh.uvs.is_empty() {
            return self.barycentric;
        }
        let t = mesh.triangles[self.triangle as usize].map(|i| mesh.uvs[i as usize].as_dvec2());
        t[0] + (t[1] - t[0]) * self.barycentric.x + (t[2] - t[0]) * self.barycentric.y
    }

    /// Interpolated, on the front face's side.
    fn shading_normal(&self, mesh: &Mesh) -> DVec3 {
        let DVec2 { x: u, y: v } = self.barycentric;
        let [a, b, c] = mesh.triangles[self.triangle as usize].map(|i| mesh.normals[i as usize].as_dvec3());
        let n = a * (1.0 - u - v) + b * u + c * v;
        // A missing corner normal (zero) or one that faces the other way leaves the face's own.
        if [a, b, c].contains(&DVec3::ZERO) || !(n.length_squared() > 1e-12) {
            return self.ng;
        }
        let n = unit(n);
        if n.dot(self.ng) < 0.0 { -n } else { n }
    }

    /// [`SurfacePoint::error`] for all points of a triangle.
    #[inline(always)]
    pub fn error_on(&[a, b, c]: &[DVec3; 3]) -> f64 {
        let coordinates = a.abs().max(b.abs()).max(c.abs());
        let extent = (b - a).abs().max((c - a).abs());
        coordinates.max(extent).max_element() * f64::from(f32::EPSILON)
    }
}

/// The unit vector of a direction; z of none.
#[inline(always)]
fn unit(v: DVec3) -> DVec3 {
    let inverse = 1.0 / v.length();
    if inverse.is_finite() { v * inverse } else { v.normalize_or(DVec3::Z) }
}
