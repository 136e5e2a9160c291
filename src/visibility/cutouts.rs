//! Surfaces that are not everywhere there: masks, and materials that let some of the light pass.
//!
//! A ray is stopped with the probability that the surface's opacity says. The number that decides is made of the ray's
//! bits and the triangle, so that every backend decides alike, in whatever order it meets triangles, and a ray that is
//! asked twice is answered the same.

use super::Ray;
use crate::geometry::Mesh;
use crate::material::Material;
use crate::sampler::counter::{combine, unit};
use glam::{DVec2, Vec2};

/// Where the surfaces of a mesh stop rays.
#[derive(Debug, Clone)]
pub struct Cutouts {
    /// `None` for opaque materials.
    materials: Vec<Option<Material>>,
    of_triangle: Vec<u32>,
    /// Of each triangle's corners; empty where the mesh has none.
    uvs: Vec<[Vec2; 3]>,
}

impl Cutouts {
    /// `None` when all that the mesh uses is opaque.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Option<Self> {
        let open: Vec<Option<Material>> =
            materials.iter().map(|m| (!m.is_opaque()).then(|| m.clone())).collect();
        if !mesh.materials.iter().any(|&m| open[m as usize].is_some()) {
            return None;
        }
        let corners = |t: &[u32; 3]| t.map(|v| mesh.uvs[v as usize]);
        let uvs = if mesh.uvs.is_empty() { Vec::new() } else { mesh.triangles.iter().map(corners).collect() };
        Some(Self { materials: open, of_triangle: mesh.materials.clone(), uvs })
    }

    /// Whether a triangle stops the ray of a key at a point with the barycentric weights `u`, `v`.
    pub fn stops(&self, key: u64, triangle: u32, u: f64, v: f64) -> bool {
        let Some(material) = &self.materials[self.of_triangle[triangle as usize] as usize] else {
            return true;
        };
        let uv = match self.uvs.get(triangle as usize) {
            None => DVec2::new(u, v),
            Some(corners) => {
                let [a, b, c] = corners.map(|corner| corner.as_dvec2());
                a * (1.0 - u - v) + b * u + c * v
            }
        };
        unit(combine(key, triangle.into())) < material.opacity_at(uv)
    }
}

/// What tells a ray from others.
pub fn key(ray: &Ray) -> u64 {
    let numbers = ray.origin.to_array().into_iter().chain(ray.direction.to_array());
    numbers.fold(0, |key, x| combine(key, x.to_bits().into()))
}
