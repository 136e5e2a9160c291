//! Connections: what a path is worth whose two halves are joined by an edge, each technique's share included.

use crate::bsdf::Transport;
use crate::math::{Spectrum, luminance};
use crate::mis::{Heuristic, per_area};
use crate::roulette::{self, Lobe};
use crate::sampler::{Purpose, Sampler};
use crate::subpath::walk::{Start, Walk};
use crate::subpath::{Vertex, World};
use crate::visibility::{Ray, offset};
use glam::{DVec2, DVec3};

/// How often each technique tries a path, per eye sample: the m of docs/theory.md section 6. A technique that is off
/// has 0.
#[derive(Debug, Clone, Copy)]
pub struct Techniques {
    /// How they share a path.
    pub heuristic: Heuristic,
    /// m_0: the eye subpath hits an emitter.
    pub eye_hits: f64,
    /// m_1: next-event estimation, relative to emission, which draws its points from the same density.
    pub next_event: f64,
    /// m_{k-1}: light subpaths seen by the camera, light subpaths over eye samples.
    pub light_image: f64,
    /// m_s, 2 <= s <= k-2, where the roulette is off.
    pub base: f64,
    /// m_s / P where the roulette is on.
    pub roulette: Option<Roulette>,
    /// How light vertices are merged with eye vertices.
    pub merging: Option<Merging>,
}

/// Vertex merging: light vertices near an eye vertex count as if they were it.
#[derive(Debug, Clone, Copy)]
pub struct Merging {
    /// n_L, the number of light subpaths emitted.
    pub light_subpaths: f64,
    /// How near, world units.
    pub radius: f64,
}

impl Merging {
    /// eta = n_L pi r^2: how many light subpaths end in an eye vertex's disc, per unit of their density.
    pub fn eta(&self) -> f64 {
        self.light_subpaths * std::f64::consts::PI * self.radius * self.radius
    }
}

/// Where and how hard the roulette plays.
#[derive(Debug, Clone, Copy)]
pub struct Roulette {
    /// n_L, the number of light subpaths emitted.
    pub light_subpaths: f64,
    /// C, world units squared.
    pub constant: f64,
    /// Largest GGX roughness at which it plays.
    pub max_alpha: f64,
}

impl Roulette {
    /// n_L P: how often an edge with this offset (light - eye) is kept.
    pub fn density(&self, lobe: &Lobe, offset: DVec3) -> f64 {
        self.light_subpaths * roulette::probability(std::slice::from_ref(lobe), self.constant, offset)
    }
}

impl Techniques {
    /// All of them off.
    pub fn none(heuristic: Heuristic) -> Self {
        Self {
            heuristic,
            eye_hits: 0.0,
            next_event: 0.0,
            light_image: 0.0,
            base: 0.0,
            roulette: None,
            merging: None,
        }
    }

    /// The lobe by which the roulette judges light vertices, at a vertex seen from `w_eye`; `None` where it is off.
    pub fn lobe(&self, vertex: &Vertex, w_eye: DVec3) -> Option<Lobe> {
        let limit = self.roulette?.max_alpha;
        let glossy = vertex.bsdf.glossy()?;
        if glossy.alpha_x.max(glossy.alpha_y) > limit || glossy.eta.is_some() {
            return None;
        }
        // The lobe lies on the viewer's side; the model is the same from both.
        let mut frame = vertex.frame;
        if frame.z.dot(w_eye) < 0.0 {
            (frame.x, frame.z) = (-frame.x, -frame.z);
        }
        let w = frame.to_local(w_eye);
        let mirrored = frame.to_world(DVec3::new(-w.x, -w.y, w.z));
        let lobe = Lobe::from_ggx_reflection(&frame, w_eye, glossy.alpha_x, glossy.alpha_y, 1.0);
        let weight = luminance(vertex.factor(w_eye, mirrored)) * vertex.cos_ng(mirrored);
        // Without a weight nothing would ever be kept, though there may be light beside the mirrored direction.
        (weight > 0.0).then(|| lobe.with_weight(weight))
    }

    /// m_s of an edge between two surfaces, neither of them delta. `lobe`: that of the eye-side vertex; `offset`: from
    /// there to the light-side vertex.
    pub fn connection(&self, lobe: Option<&Lobe>, offset: DVec3) -> f64 {
        match (&self.roulette, lobe) {
            (Some(roulette), Some(lobe)) => roulette.density(lobe, offset),
            _ => self.base,
        }
    }

    /// m of the edge that leads to the light vertex's predecessor, were the light vertex an eye vertex seen from
    /// `w_eye`.
    pub fn before(&self, light: &Walk, w_eye: DVec3) -> f64 {
        if light.after_delta || light.vertex.bsdf.is_delta() {
            0.0
        } else if light.depth == 1 {
            self.next_event
        } else if self.roulette.is_none() {
            self.base
        } else {
            self.connection(self.lobe(&light.vertex, w_eye).as_ref(), light.to_previous())
        }
    }

    /// eta at vertices that are not delta; 0 without merging.
    pub fn eta(&self) -> f64 {
        self.merging.map_or(0.0, |merging| merging.eta())
    }

    /// L_s of a technique whose eye side ends with an edge along `w_eye` at the light vertex; `density`: in which the
    /// eye side would choose that vertex.
    fn light_others(&self, light: &Walk, density: f64, w_eye: DVec3) -> f64 {
        self.heuristic.others(density, self.light_total(light, w_eye))
    }

    /// The sum over the light side's techniques up to a light vertex from which the path goes on along `w_eye`.
    fn light_total(&self, light: &Walk, w_eye: DVec3) -> f64 {
        let back = light.vertex.pdf_w(w_eye, light.vertex.wo);
        self.heuristic.total(&light.side, self.before(light, w_eye), back, self.eta())
    }

    /// Goes on along a light subpath.
    pub fn next_light(&self, world: &World<'_>, light: &Walk, sampler: &Sampler) -> Option<Walk> {
        light.next(world, self.heuristic, Transport::Importance, sampler, self.eta(), |wi| {
            self.before(light, wi)
        })
    }
}

/// An eye vertex: its walk, and what connections to it share.
#[derive(Debug, Clone, Copy)]
pub struct EyeVertex {
    /// The walk.
    pub walk: Walk,
    /// The roulette's lobe here.
    pub lobe: Option<Lobe>,
    /// m of the edge to the previous eye vertex, were this vertex the light subpath's last.
    m_previous: f64,
    /// m of that edge, were this vertex on an emitter.
    m_emitter: f64,
}

impl EyeVertex {
    /// The first vertex behind a raster position.
    pub fn first(world: &World<'_>, techniques: &Techniques, raster: DVec2) -> Option<Self> {
        let direction = world.camera.direction(raster);
        let origin = world.camera.position;
        let start = Start {
            ray: offset::from_free_point(origin, direction),
            origin,
            direction,
            pdf_w: world.camera.pdf_w(direction),
            cos: 1.0,
            total: 0.0,
        };
        let walk = Walk::follow(world, techniques.heuristic, &start, Spectrum::ONE, 1, false)?;
        Some(Self::new(techniques, walk, techniques.light_image, 0.0))
    }

    fn new(techniques: &Techniques, walk: Walk, m_previous: f64, m_emitter: f64) -> Self {
        let delta = walk.vertex.bsdf.is_delta();
        let lobe = if delta { None } else { techniques.lobe(&walk.vertex, walk.vertex.wo) };
        Self { walk, lobe, m_previous: if delta { 0.0 } else { m_previous }, m_emitter }
    }

    /// Goes on to the next eye vertex.
    pub fn next(&self, world: &World<'_>, techniques: &Techniques, sampler: &Sampler) -> Option<Self> {
        let walk = self.walk.next(
            world,
            techniques.heuristic,
            Transport::Radiance,
            sampler,
            techniques.eta(),
            |_| self.m_previous,
        )?;
        if walk.after_delta {
            return Some(Self::new(techniques, walk, 0.0, 0.0));
        }
        let m = techniques.connection(self.lobe.as_ref(), -walk.to_previous());
        Some(Self::new(techniques, walk, m, techniques.next_event))
    }

    /// E_s of a technique whose light side ends with an edge along `w_light`; `density`: in which the light side would
    /// choose this vertex.
    fn others(&self, techniques: &Techniques, density: f64, w_light: DVec3) -> f64 {
        techniques.heuristic.others(density, self.total(techniques, w_light))
    }

    /// The sum over the eye side's techniques up to this vertex, when the path goes on along `w_light`.
    fn total(&self, techniques: &Techniques, w_light: DVec3) -> f64 {
        let back = self.walk.vertex.pdf_w(w_light, self.walk.vertex.wo);
        techniques.heuristic.total(&self.walk.side, self.m_previous, back, techniques.eta())
    }

    /// Radiance that this vertex emits itself, by technique s = 0.
    pub fn emitted(&self, world: &World<'_>, techniques: &Techniques) -> Spectrum {
        let Walk { vertex, throughput, side, .. } = &self.walk;
        let Some(emitter) = world.lights.at(&vertex.point) else { return Spectrum::ZERO };
        let radiance = emitter.radiance(vertex.wo);
        if radiance == Spectrum::ZERO || techniques.eye_hits == 0.0 && self.walk.depth > 1 {
            return Spectrum::ZERO;
        }
        if self.walk.depth == 1 {
            return *throughput * radiance; // no other technique sees emitters directly
        }
        let heuristic = techniques.heuristic;
        let total = heuristic.total(side, self.m_emitter, emitter.pdf_w(vertex.wo), 0.0);
        let e = heuristic.others(emitter.pdf_a, total);
        *throughput * radiance * heuristic.weight(0.0, techniques.eye_hits, e)
    }

    /// Technique s = 1: light straight from a point of an emitter. The value counts if the ray is free.
    pub fn next_event(
        &self,
        world: &World<'_>,
        techniques: &Techniques,
        sampler: &Sampler,
    ) -> Option<(Spectrum, Ray)> {
        let (depth, vertex) = (self.walk.depth, &self.walk.vertex);
        let emitter = world
            .lights
            .sample_point(sampler.u1(depth, Purpose::LightPick), sampler.u2(depth, Purpose::LightPoint))?;
        let edge = Edge::new(vertex.point.position, emitter.point.position)?;
        let radiance = emitter.radiance(-edge.w);
        if radiance == Spectrum::ZERO {
            return None;
        }
        let (cos, cos_light) = (vertex.cos_ng(edge.w), emitter.point.ng.dot(edge.w).abs());
        let (factor, pdf_w) = vertex.toward_light(edge.w);
        let value = self.walk.throughput * factor * radiance * (cos_light / edge.distance2);
        if value == Spectrum::ZERO {
            return None;
        }
        let (heuristic, m) = (techniques.heuristic, techniques.next_event);
        let l = per_area(pdf_w, cos_light, edge.distance2) * techniques.eye_hits / emitter.pdf_a;
        let e = self.others(techniques, per_area(emitter.pdf_w(-edge.w), cos, edge.distance2), edge.w);
        let value = value * (heuristic.weight(heuristic.raise(l), m, e) / emitter.pdf_a);
        Some((value, offset::between(&vertex.point, &emitter.point)))
    }

    /// Techniques 2 <= s <= k-2: light from a vertex of a light subpath at `offset` from here. `tries`: how often the
    /// estimator really tries this pair (the m in its weight may be an estimate of that); the value counts if the ray
    /// is free.
    pub fn connect(
        &self,
        techniques: &Techniques,
        light: &Walk,
        m: f64,
        tries: f64,
    ) -> Option<(Spectrum, Ray)> {
        let (eye, y) = (&self.walk.vertex, &light.vertex);
        let edge = Edge::new(eye.point.position, y.point.position)?;
        let (cos, cos_light) = (eye.cos_ng(edge.w), y.cos_ng(edge.w));
        let (factor, pdf_w) = eye.toward_light(edge.w);
        let value = self.walk.throughput
            * factor
            * y.factor(-edge.w, y.wo)
            * light.throughput
            * (cos_light / edge.distance2);
        if value == Spectrum::ZERO || !(m > 0.0) {
            return None;
        }
        let heuristic = techniques.heuristic;
        let l = techniques.light_others(light, per_area(pdf_w, cos_light, edge.distance2), -edge.w);
        let density = per_area(y.pdf_w(y.wo, -edge.w), cos, edge.distance2);
        let e = self.others(techniques, density, edge.w);
        let value = value * (heuristic.weight(l, m, e) / tries);
        Some((value, offset::between(&eye.point, &y.point)))
    }

    /// Merging with a light vertex within the radius: the light that arrives there counts as arriving here.
    pub fn merge(&self, techniques: &Techniques, merging: &Merging, light: &Walk) -> Spectrum {
        let vertex = &self.walk.vertex;
        let value = self.walk.throughput * vertex.factor(vertex.wo, light.vertex.wo) * light.throughput;
        if value == Spectrum::ZERO {
            return value;
        }
        let eta = merging.eta();
        let light_total = techniques.light_total(light, vertex.wo);
        let eye_total = self.total(techniques, light.vertex.wo);
        value * (techniques.heuristic.merging_weight(light_total, eta, eye_total) / eta)
    }
}

/// Technique s = k-1: a light vertex seen by the camera. The value, for the sum over a film's eye samples, belongs at
/// the raster position if the ray is free.
pub fn connect_camera(
    world: &World<'_>,
    techniques: &Techniques,
    light: &Walk,
) -> Option<(DVec2, Spectrum, Ray)> {
    let y = &light.vertex;
    let edge = Edge::new(world.camera.position, y.point.position)?;
    let raster = world.camera.raster(edge.w)?;
    let pdf = per_area(world.camera.pdf_w(edge.w), y.cos_ng(edge.w), edge.distance2);
    let value = light.throughput * y.factor(-edge.w, y.wo) * pdf;
    if value == Spectrum::ZERO {
        return None;
    }
    let l = techniques.light_others(light, pdf, -edge.w);
    let m = techniques.light_image;
    let ray = offset::free_to_surface(world.camera.position, &y.point);
    Some((raster, value * (techniques.heuristic.weight(l, m, 0.0) / m), ray))
}

/// The segment from the eye side to the light side.
struct Edge {
    /// Unit direction towards the light side.
    w: DVec3,
    distance2: f64,
}

impl Edge {
    fn new(eye: DVec3, light: DVec3) -> Option<Self> {
        let d = light - eye;
        let distance2 = d.length_squared();
        (distance2 > 0.0).then(|| Self { w: d * (1.0 / distance2.sqrt()), distance2 })
    }
}
