//! All triangles of a scene as one indexed mesh.

use crate::error::{Error, Result};
use crate::math::Aabb;
use glam::{DVec3, Vec2, Vec3};

/// An indexed triangle mesh. Positions are relative to [`Mesh::origin`], so that `f32` keeps its precision far from
/// the world's origin.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// World position that the mesh calls (0, 0, 0).
    pub origin: DVec3,
    /// Vertex positions relative to `origin`, world units.
    pub positions: Vec<Vec3>,
    /// Vertex normals, one per position (zero: none, use the face's), or empty when no vertex has one.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position, or empty.
    pub uvs: Vec<Vec2>,
    /// Position indices of each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into the scene's materials, one per triangle.
    pub materials: Vec<u32>,
}

impl Mesh {
    /// Checks that arrays fit together, indices are in range and positions finite; errors name the index.
    pub fn validate(&self) -> Result<()> {
        let n = self.positions.len();
        let fail = |message: String| Err(Error::Input(message));
        if self.materials.len() != self.triangles.len() {
            return fail(format!(
                "{} triangles but {} materials",
                self.triangles.len(),
                self.materials.len()
            ));
        }
        for (name, len) in [("normals", self.normals.len()), ("texture coordinates", self.uvs.len())] {
            if len != 0 && len != n {
                return fail(format!("{n} positions but {len} {name}"));
            }
        }
        if let Some(i) = self.positions.iter().position(|p| !p.is_finite()) {
            return fail(format!("vertex {i} is not finite: {}", self.positions[i]));
        }
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
            return fail(format!("triangle {i} uses vertex {:?} of {n}", self.triangles[i]));
        }
        Ok(())
    }

    /// The corners of a triangle in double precision.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize].as_dvec3())
    }

    /// The normal of a triangle scaled to twice its area; zero for a degenerate one.
    #[inline]
    pub fn scaled_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Area of a triangle, square world units.
    pub fn area(&self, triangle: u32) -> f64 {
        0.5 * self.scaled_normal(triangle).length()
    }

    /// Sum of all areas, square world units.
    pub fn total_area(&self) -> f64 {
        (0..self.triangles.len() as u32).map(|t| self.area(t)).sum()
    }

    /// Box around the vertices that triangles use, relative to `origin`.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.triangles.iter().flatten().map(|&v| self.positions[v as usize]))
    }
}
