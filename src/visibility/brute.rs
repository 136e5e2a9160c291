//! Every triangle against every ray: what the other backends are compared with.

use super::triangle::{Shear, hit};
use super::{Cutouts, Hit, Ray, Visibility, cutouts};
use crate::error::Result;
use crate::geometry::Mesh;
use glam::Vec3;

/// The triangles, in order.
#[derive(Debug)]
pub struct Brute {
    triangles: Vec<[Vec3; 3]>,
    cutouts: Option<Cutouts>,
}

impl Brute {
    /// Copies the triangles.
    pub fn new(mesh: &Mesh, cutouts: Option<Cutouts>) -> Result<Self> {
        mesh.validate()?;
        let triangles = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect();
        Ok(Self { triangles, cutouts })
    }

    fn stops(&self, ray: &Ray, triangle: usize, &(_, [u, v]): &(f64, [f64; 2])) -> bool {
        self.cutouts.as_ref().is_none_or(|cutouts| cutouts.stops(cutouts::key(ray), triangle as u32, u, v))
    }
}

impl Visibility for Brute {
    fn bytes(&self) -> Option<u64> {
        Some((self.triangles.len() * size_of::<[Vec3; 3]>()) as u64)
    }

    /// Of several triangles at the same distance the first counts.
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let shear = Shear::new(ray);
        let mut nearest = None;
        let mut t_max = f64::from(ray.t_max);
        for (i, corners) in self.triangles.iter().enumerate() {
            if let Some(met) = shear.meet(corners, t_max).filter(|met| self.stops(ray, i, met)) {
                t_max = met.0;
                nearest = Some(hit(i as u32, met));
            }
        }
        nearest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let shear = Shear::new(ray);
        let t_max = f64::from(ray.t_max);
        self.triangles
            .iter()
            .enumerate()
            .any(|(i, corners)| shear.meet(corners, t_max).is_some_and(|met| self.stops(ray, i, &met)))
    }
}
