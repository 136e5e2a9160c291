//! Emitting triangles: a point is picked with probability proportional to power, uniformly over the area; directions
//! follow the cosine law. Next-event estimation and emission use the same density of points.

use super::choice::{self, Group, Shape};
use super::joined;
use crate::geometry::{Mesh, SurfacePoint};
use crate::material::Material;
use crate::math::{Discrete, Frame, Spectrum, luminance, warp};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

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
    /// `None` where every point emits the same.
    pattern: Option<Box<Pattern>>,
}

/// How emission varies over a triangle.
#[derive(Debug, Clone)]
struct Pattern {
    /// Texture coordinates of the corners.
    uvs: [DVec2; 3],
    material: Arc<Material>,
}

/// Points across a triangle at which emission is looked up to tell how much the triangle emits.
const PROBES: u32 = 16;
/// Part of the brightest emission that every triangle of a material is taken to emit at least: none is left out.
const LEAST: f64 = 0.05;

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
        let uneven: Vec<Option<Arc<Material>>> =
            materials.iter().map(|m| Pattern::is_needed(m).then(|| Arc::new(m.clone()))).collect();
        for triangle in 0..mesh.triangles.len() as u32 {
            let number = mesh.materials[triangle as usize] as usize;
            let material = &materials[number];
            let (area, corners) = (mesh.area(triangle), mesh.corners(triangle));
            let sides = if material.two_sided_emission { 2.0 } else { 1.0 };
            let pattern = uneven[number].as_ref().map(|material| Pattern::new(mesh, triangle, material));
            let even = material.emission_at(DVec2::ZERO);
            let mean = pattern.as_ref().map_or(luminance(even), |pattern| pattern.mean());
            let power = PI * sides * area * mean;
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
                emission: even,
                two_sided: material.two_sided_emission,
                pdf_a: 1.0 / area,
                pattern: pattern.map(Box::new),
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

    /// Their lamps; triangles that touch are one. `share`: theirs of light picks. `None` where there are too many to choose among.
    pub(super) fn groups(&self, share: f64) -> Option<Vec<Group>> {
        let first = joined::lamps(self.emitters.iter().map(|e| e.corners));
        let mut lamps: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (i, lamp) in first.into_iter().enumerate() {
            lamps.entry(lamp).or_default().push(i as u32);
        }
        if lamps.len() > choice::MOST {
            return None;
        }
        let groups = lamps
            .into_values()
            .filter_map(|lights| {
                let emitters = || lights.iter().map(|&i| &self.emitters[i as usize]);
                let pick = Discrete::new(lights.iter().map(|&i| self.pick.probability(i as usize)))?;
                let corners = || emitters().flat_map(|e| e.corners);
                let (low, high) = corners().fold((DVec3::MAX, DVec3::MIN), |(l, h), c| (l.min(c), h.max(c)));
                let center = 0.5 * (low + high);
                let radius = corners().map(|c| (c - center).length()).fold(0.0, f64::max);
                let axis = emitters().map(|e| e.ng).sum::<DVec3>().normalize_or(DVec3::Z);
                let cos = emitters().map(|e| e.ng.dot(axis)).fold(1.0, f64::min);
                // Triangles in a plane are one, whatever the roundings.
                let spread = if cos > 1.0 - 1e-6 { 0.0 } else { (1.0 - cos.max(0.0).powi(2)).sqrt() };
                let by_power = pick.total() * share;
                let two_sided = emitters().any(|e| e.two_sided);
                let intensity = pick.total() * self.power() / (PI * if two_sided { 2.0 } else { 1.0 });
                let shape = Shape::Area { center, radius, axis, spread, two_sided, intensity };
                Some(Group { lights, pick, by_power, shape })
            })
            .collect();
        Some(groups)
    }

    /// The sum of the squares of their lamps' shares of the light; triangles that touch are one lamp.
    pub(super) fn concentration(&self) -> f64 {
        let mut shares = vec![0.0; self.emitters.len()];
        for (i, lamp) in joined::lamps(self.emitters.iter().map(|e| e.corners)).into_iter().enumerate() {
            shares[lamp] += self.pick.probability(i);
        }
        shares.iter().map(|share| share * share).sum()
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
        self.choose(pick).map(|number| self.point_on(number, u))
    }

    /// The number of an emitter.
    #[inline(always)]
    pub(super) fn choose(&self, pick: f64) -> Option<u32> {
        (!self.emitters.is_empty()).then(|| self.pick.sample(pick) as u32)
    }

    /// A point on an emitter.
    #[inline(always)]
    pub(crate) fn point_on(&self, number: u32, u: DVec2) -> EmitterPoint {
        let emitter = &self.emitters[number as usize];
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
        let mut point = emitter.at(number, point);
        if let Some(pattern) = &emitter.pattern {
            // A path that meets the emitter by chance meets it as often as it is opaque.
            point.emission *= pattern.material.opacity_at(pattern.uv(uv));
        }
        point
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
        let &Self { mut emission, two_sided, pdf_a, .. } = self;
        if let Some(pattern) = &self.pattern {
            emission = pattern.material.emission_at(pattern.uv(point.barycentric));
        }
        EmitterPoint { point, emission, two_sided, pdf_a, emitter }
    }
}

impl Pattern {
    /// Whether a material's emission varies.
    fn is_needed(material: &Material) -> bool {
        let varies = material.maps().emission.as_ref().is_some_and(|map| map.constant().is_none());
        material.emits() && (varies || !material.is_opaque())
    }

    fn new(mesh: &Mesh, triangle: u32, material: &Arc<Material>) -> Self {
        let uvs = if mesh.uvs.is_empty() {
            [DVec2::ZERO, DVec2::X, DVec2::Y]
        } else {
            mesh.triangles[triangle as usize].map(|v| mesh.uvs[v as usize].as_dvec2())
        };
        Self { uvs, material: material.clone() }
    }

    fn uv(&self, b: DVec2) -> DVec2 {
        self.uvs[0] * (1.0 - b.x - b.y) + self.uvs[1] * b.x + self.uvs[2] * b.y
    }

    /// About the mean luminance over the triangle, W/(m^2 sr); above 0 wherever the material emits at all.
    fn mean(&self) -> f64 {
        let brightest = self.material.maps().emission.as_ref().map_or(Spectrum::ONE, |map| map.bounds().1);
        let most = luminance(self.material.emission * brightest.max(Spectrum::ZERO));
        let grid = (0..PROBES * PROBES).map(|i| {
            let u = DVec2::new((i % PROBES).into(), (i / PROBES).into());
            warp::square_to_triangle((u + 0.5) / f64::from(PROBES))
        });
        let at = |b: DVec2| {
            let uv = self.uv(b);
            luminance(self.material.emission_at(uv)) * self.material.opacity_at(uv)
        };
        (grid.map(at).sum::<f64>() / f64::from(PROBES * PROBES)).max(LEAST * most)
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
