//! Connections: what a path is worth whose two halves are joined by an edge, each technique's share included.

use crate::bsdf::Transport;
use crate::math::Spectrum;
use crate::mis::{Side, per_area};
use crate::sampler::{Purpose, Sampler};
use crate::subpath::walk::{Start, Walk};
use crate::subpath::{Origin, Total, World};
use crate::techniques::{Lobes, Merging, Techniques};
use crate::visibility::{Ray, offset};
use glam::{DVec2, DVec3};

/// An eye vertex: its walk, and what connections to it share.
#[derive(Debug, Clone, Copy)]
pub struct EyeVertex {
    /// The walk.
    pub walk: Walk,
    /// The roulette's lobes here; empty where it is off.
    pub lobes: Lobes,
    /// m of the edge to the previous eye vertex or the camera, were this vertex the light subpath's last.
    m_previous: Total,
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
            total: Total::known(0.0),
        };
        let walk = Walk::follow(world, &techniques.rules(Transport::Radiance), &start, Spectrum::ONE)?;
        let seen = techniques.light_image;
        Some(Self::new(techniques, walk, Total { seen, ..Total::default() }, 0.0))
    }

    fn new(techniques: &Techniques, walk: Walk, m_previous: Total, m_emitter: f64) -> Self {
        let delta = walk.vertex.bsdf.is_delta();
        let lobes = if delta { Lobes::NONE } else { techniques.lobes(&walk.vertex, walk.vertex.wo) };
        Self { walk, lobes, m_previous: if delta { Total::default() } else { m_previous }, m_emitter }
    }

    /// Goes on to the next eye vertex.
    pub fn next(&self, world: &World<'_>, techniques: &Techniques, sampler: &Sampler) -> Option<Self> {
        let walk = self.walk.next(world, &techniques.rules(Transport::Radiance), sampler, |s| {
            if s.delta {
                return Total::known(techniques.heuristic.total(&self.walk.side, 0.0, s.pdf_rev, 0.0));
            }
            self.totals(techniques, s.pdf_rev)
        })?;
        if walk.after_delta {
            return Some(Self::new(techniques, walk, Total::default(), 0.0));
        }
        let m = techniques.connection(&self.lobes, -walk.to_previous());
        Some(Self::new(techniques, walk, m, techniques.next_event))
    }

    /// E_s of a technique whose light side ends with an edge along `w_light`; `density`: in which the light side would
    /// choose this vertex; `origin`: what the light side ends with.
    fn others(&self, techniques: &Techniques, density: f64, w_light: DVec3, origin: Origin) -> f64 {
        techniques.heuristic.others(density, self.total(techniques, w_light, origin))
    }

    /// The sum over the eye side's techniques up to this vertex, when the path goes on along `w_light`.
    fn total(&self, techniques: &Techniques, w_light: DVec3, origin: Origin) -> f64 {
        let back = self.walk.vertex.pdf_w(w_light, self.walk.vertex.wo);
        self.totals(techniques, back).given(techniques.heuristic, &techniques.storing, origin)
    }

    /// The sum over the eye side's techniques up to this vertex. `back`: density of scattering to the previous vertex,
    /// 1/sr.
    fn totals(&self, techniques: &Techniques, back: f64) -> Total {
        let (heuristic, side, m) = (techniques.heuristic, &self.walk.side, &self.m_previous);
        Total {
            known: heuristic.total(side, m.known, back, 0.0),
            stored: heuristic.total(side, m.stored, 0.0, techniques.eta()),
            seen: heuristic.total(side, m.seen, 0.0, 0.0),
        }
    }

    /// Radiance that this vertex emits itself, by technique s = 0.
    pub fn emitted(&self, world: &World<'_>, techniques: &Techniques) -> Spectrum {
        let Walk { vertex, throughput, .. } = &self.walk;
        let Some(emitter) = world.lights.at(&vertex.point) else { return Spectrum::ZERO };
        let radiance = emitter.radiance(vertex.wo);
        if radiance == Spectrum::ZERO || techniques.eye_hits == 0.0 && self.walk.depth > 1 {
            return Spectrum::ZERO;
        }
        if self.walk.depth == 1 {
            return *throughput * radiance; // no other technique sees emitters directly
        }
        let (heuristic, side) = (techniques.heuristic, Side { b: self.walk.b_as_lamp, ..self.walk.side });
        let total =
            heuristic.total(&side, self.m_emitter, techniques.emission_pdf_w(&emitter, vertex.wo), 0.0);
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
        let emission = techniques.emission_pdf_w(&emitter, -edge.w);
        let e = self.others(techniques, per_area(emission, cos, edge.distance2), edge.w, Origin::Lamp);
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
        let e = self.others(techniques, density, edge.w, techniques.storing.origin(&y.bsdf));
        let value = value * (heuristic.weight(l, m, e) / tries);
        Some((value, offset::between(&eye.point, &y.point)))
    }

    /// Merging with a light vertex within the radius: the light that arrives there counts as arriving here.
    pub fn merge(&self, techniques: &Techniques, merging: &Merging, light: &Walk) -> Spectrum {
        let vertex = &self.walk.vertex;
        let value = self.walk.throughput * vertex.factor(vertex.wo, light.vertex.wo) * light.throughput;
        let stored = techniques.stored(light);
        if value == Spectrum::ZERO || stored == 0.0 {
            return Spectrum::ZERO;
        }
        let eta = merging.eta() * stored;
        let light_total = techniques.light_total(light, vertex.wo);
        let eye_total = self.total(techniques, light.vertex.wo, light.origins[0]);
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
    let (y, m) = (&light.vertex, techniques.light_image * techniques.seen(light));
    if m == 0.0 {
        return None;
    }
    let edge = Edge::new(world.camera.position, y.point.position)?;
    let raster = world.camera.raster(edge.w)?;
    let pdf = per_area(world.camera.pdf_w(edge.w), y.cos_ng(edge.w), edge.distance2);
    let value = light.throughput * y.factor(-edge.w, y.wo) * pdf;
    if value == Spectrum::ZERO {
        return None;
    }
    let l = techniques.light_others(light, pdf, -edge.w);
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
