//! Visibility without any C library: a tree built by the obvhs crate, opened up to four children a node.

use super::bvh4::Bvh4;
use super::triangle::{Shear, hit};
use super::{Cutouts, Hit, Ray, Visibility, cutouts};
use crate::error::{Error, Result};
use crate::geometry::Mesh;
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::{Boundable, BvhBuildParams};
use std::time::Duration;

/// A tree over triangles. (obvhs's own traversals take distances below 1e-4 for nothing, or miss boxes by a rounding
/// error, so only its builder is used.)
#[derive(Debug)]
pub struct Obvhs {
    tree: Bvh4,
    /// In the order of the tree's leaves.
    triangles: Vec<Triangle>,
    cutouts: Option<Cutouts>,
}

#[derive(Debug, Clone, Copy)]
struct Triangle {
    corners: [Vec3; 3],
    number: u32,
}

impl Boundable for Triangle {
    fn aabb(&self) -> Aabb {
        Aabb::from_points(&self.corners.map(Vec3A::from))
    }
}

impl Obvhs {
    /// Builds the tree with up to `threads` threads (0: all). The mesh is copied.
    pub fn new(mesh: &Mesh, cutouts: Option<Cutouts>, threads: usize) -> Result<Self> {
        mesh.validate()?;
        let unordered: Vec<Triangle> = (0..)
            .zip(&mesh.triangles)
            .map(|(number, t)| Triangle { corners: t.map(|v| mesh.positions[v as usize]), number })
            .collect();
        if unordered.is_empty() {
            return Ok(Self { tree: Bvh4::new(&Default::default()), triangles: Vec::new(), cutouts });
        }
        let mut parameters = BvhBuildParams::medium_build();
        parameters.max_prims_per_leaf = 4;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Internal(format!("cannot start threads: {e}")))?;
        let tree = pool
            .install(|| obvhs::bvh2::builder::build_bvh2(&unordered, parameters, &mut Duration::default()));
        let triangles = tree.primitive_indices.iter().map(|&i| unordered[i as usize]).collect();
        Ok(Self { tree: Bvh4::new(&tree), triangles, cutouts })
    }

    #[inline(always)]
    fn stops(&self, ray: &Ray, triangle: &Triangle, &(_, [u, v]): &(f64, [f64; 2])) -> bool {
        self.cutouts.as_ref().is_none_or(|cutouts| cutouts.stops(cutouts::key(ray), triangle.number, u, v))
    }

    fn leaf(&self, first: u32, count: u32) -> &[Triangle] {
        &self.triangles[first as usize..(first + count) as usize]
    }
}

impl Visibility for Obvhs {
    fn bytes(&self) -> Option<u64> {
        Some((self.tree.bytes() + size_of_val(&self.triangles[..])) as u64)
    }

    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let shear = Shear::new(ray);
        let mut nearest = None;
        let mut t_max = f64::from(ray.t_max);
        self.tree.traverse(ray, |first, count| {
            for triangle in self.leaf(first, count) {
                let met = shear.meet(&triangle.corners, t_max);
                if let Some(met) = met.filter(|met| self.stops(ray, triangle, met)) {
                    t_max = met.0;
                    nearest = Some((triangle.number, met));
                }
            }
            t_max as f32
        });
        nearest.map(|(number, met)| hit(number, met))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let shear = Shear::new(ray);
        let mut found = false;
        self.tree.traverse(ray, |first, count| {
            found = self.leaf(first, count).iter().any(|triangle| {
                let met = shear.meet(&triangle.corners, f64::from(ray.t_max));
                met.is_some_and(|met| self.stops(ray, triangle, &met))
            });
            if found { f32::NEG_INFINITY } else { ray.t_max }
        });
        found
    }
}
