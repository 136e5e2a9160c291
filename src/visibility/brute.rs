//! Every triangle against every ray: what the other backends are compared with.

use super::triangle::{Shear, hit};
use super::{Hit, Ray, Visibility};
use crate::error::Result;
use crate::geometry::Mesh;
use glam::Vec3;

/// The triangles, in order.
#[derive(Debug)]
pub struct Brute {
    triangles: Vec<[Vec3; 3]>,
}

impl Brute {
    /// Copies the triangles.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        mesh.validate()?;
        let triangles = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect();
        Ok(Self { triangles })
    }
}

impl Visibility for Brute {
    /// Of several triangles at the same distance the first counts.
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let shear = Shear::new(ray);
        let mut nearest = None;
        let mut t_max = f64::from(ray.t_max);
        for (i, corners) in self.triangles.iter().enumerate() {
            if let Some(met) = shear.meet(corners, t_max) {
                t_max = met.0;
                nearest = Some(hit(i as u32, met));
            }
        }
        nearest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let shear = Shear::new(ray);
        self.triangles.iter().any(|corners| shear.meet(corners, f64::from(ray.t_max)).is_some())
    }
}
