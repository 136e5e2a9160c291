//! Emitting triangles: a point is picked with probability proportional to power, uniformly over the area; directions
//! follow the cosine law. Next-event estimation and emission use the same density of points.

use crate::geometry::{Mesh, SurfacePoint};
use crate::material::Material;
use crate::math::{Discrete, Frame, Spectrum, luminance, warp};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

const NOT_EMITTING: u32 = u32::MAX;

/// All emitting triangles of a scene.
#[derive(Debug, Clone, Default)]
pub struct AreaLights {
    emitters: Vec<Emitter>,
    pick: Discrete,
    of_triangle: Vec<u32>,
}

#[derive(Debug, Clone)]
struct Emitter {
    triangle: u32,
    material: u32,
    corners: [DVec3; 3],
    ng: DVec3,
    error: f64,
    emission: Spectrum,
    two_sided: bool,
    /// Density of points over this triangle, pick included, 1/m^2.
    pdf_a: f64,
}

/// A point on an emitter.
#[derive(Debug, Clone, Copy)]
pub struct EmitterPoint {
    /// Where.
    pub point: SurfacePoint,
    /// Radiance on each emitting side, W/(m^2 sr).
    pub emission: Spectrum,
    /// Whether the back face emits as well.
    pub two_sided: bool,
    /// Density of the point over all emitters' area, 1/m^2.
    pub pdf_a: f64,
    /// The emitter's number.
    pub emitter: u32,
}

impl AreaLights {
    /// Collects the emitting triangles. Degenerate ones emit nothing.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Self {
        let mut emitters = Vec::new();
        let mut weights = Vec::new();
        let mut of_triangle = Vec::new();
        for triangle in 0..mesh.triangles.len() as u32 {
            let material = &materials[mesh.materials[triangle as usize] as usize];
            let (area, corners) = (mesh.area(triangle), mesh.corners(triangle));
            let sides = if material.two_sided_emission { 2.0 } else { 1.0 };
            let power = PI * sides * area * luminance(material.emission);
            if !(power > 0.0) {
                continue;
            }
            if of_triangle.is_empty() {
                of_triangle = vec![NOT_EMITTING; mesh.triangles.len()];
            }
            of_triangle[triangle as usize] = emitters.len() as u32;
            weights.push(power);
            emitters.push(Emitter {
                triangle,
                material: mesh.materials[triangle as usize],
                corners,
                ng: mesh.scaled_normal(triangle).normalize(),
                error: SurfacePoint::error_on(&corners),
                emission: material.emission,
                two_sided: material.two_sided_emission,
                pdf_a: 1.0 / area,
            });
        }
        let pick = Discrete::new(weights).unwrap_or_default();
        for (i, emitter) in emitters.iter_mut().enumerate() {
            emitter.pdf_a *= pick.probability(i);
        }
        Self { emitters, pick, of_triangle }
    }

    /// True when nothing emits.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// Luminance of all their light, W.
    pub(super) fn power(&self) -> f64 {
        self.pick.total()
    }

    /// Makes room for other lights, which get the rest of all picks.
    pub(super) fn scale_densities(&mut self, share: f64) {
        self.emitters.iter_mut().for_each(|e| e.pdf_a *= share);
    }

    /// Number of emitting triangles.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// For each emitter, something that is equal for emitters of the same material and nearly the same orientation.
    pub(super) fn kinds(&self) -> impl Iterator<Item = (u32, [i16; 3])> {
        const STEPS: f64 = 64.0;
        self.emitters.iter().map(|e| (e.material, (e.ng * STEPS).round().to_array().map(|x| x as i16)))
    }

    /// A point on some emitter, `None` when there is none. `pick` and `u` are uniform in [0,1).
    #[inline(always)]
    pub fn sample_point(&self, pick: f64, u: DVec2) -> Option<EmitterPoint> {
        if self.emitters.is_empty() {
            return None;
        }
        let index = self.pick.sample(pick);
        let emitter = &self.emitters[index];
        let uv = warp::square_to_triangle(u);
        let [a, b, c] = emitter.corners;
        let position = a * (1.0 - uv.x - uv.y) + b * uv.x + c * uv.y;
        let point = SurfacePoint {
            position,
            ng: emitter.ng,
            barycentric: uv,
            triangle: emitter.triangle,
            error: emitter.error,
        };
        Some(emitter.at(index as u32, point))
    }

    /// The emitter's side of a point that a path has hit, `None` when its triangle does not emit.
    #[inline(always)]
    pub fn at(&self, point: &SurfacePoint) -> Option<EmitterPoint> {
        match self.of_triangle.get(point.triangle as usize) {
            None | Some(&NOT_EMITTING) => None,
            Some(&i) => Some(self.emitters[i as usize].at(i, *point)),
        }
    }
}

impl Emitter {
    #[inline(always)]
    fn at(&self, emitter: u32, point: SurfacePoint) -> EmitterPoint {
        let &Self { emission, two_sided, pdf_a, .. } = self;
        EmitterPoint { point, emission, two_sided, pdf_a, emitter }
    }
}

impl EmitterPoint {
    /// Radiance towards a unit direction, W/(m^2 sr).
    pub fn radiance(&self, direction: DVec3) -> Spectrum {
        if self.two_sided || self.point.ng.dot(direction) > 0.0 { self.emission } else { Spectrum::ZERO }
    }

    /// Density of [`EmitterPoint::sample_direction`], 1/sr.
    pub fn pdf_w(&self, direction: DVec3) -> f64 {
        let cos = self.point.ng.dot(direction);
        if self.two_sided {
            0.5 * warp::cosine_hemisphere_pdf(cos.abs())
        } else {
            warp::cosine_hemisphere_pdf(cos)
        }
    }

    /// The point of the unit square that [`EmitterPoint::sample_direction`] turns into a direction.
    pub fn square_of(&self, direction: DVec3) -> DVec2 {
        let local = Frame::from_z(self.point.ng).to_local(direction);
        let mut u = warp::disc_to_square(local.truncate());
        if self.two_sided {
            u.x = 0.5 * (u.x + if local.z < 0.0 { 1.0 } else { 0.0 });
        }
        u
    }

    /// A direction in which the point emits; `u` is uniform in the unit square. `None` on the horizon.
    pub fn sample_direction(&self, mut u: DVec2) -> Option<DVec3> {
        let mut side = 1.0;
        if self.two_sided {
            u.x *= 2.0;
            if u.x >= 1.0 {
                u.x -= 1.0;
                side = -1.0;
            }
        }
        let local = warp::square_to_cosine_hemisphere(u);
        (local.z > 0.0)
            .then(|| Frame::from_z(self.point.ng).to_world(DVec3::new(local.x, local.y, side * local.z)))
    }
}
