//! Connections: what a path is worth whose two halves are joined by an edge, each technique's share included.

use crate::bsdf::Transport;
use crate::light::LightPoint;
use crate::light::point::Toward;
use crate::math::Spectrum;
use crate::mis::{Side, per_area};
use crate::sampler::{Purpose, Sampler};
use crate::subpath::walk::{Rules, Segment, Start, Walk};
use crate::subpath::{Origin, Total, World};
use crate::techniques::{Lobes, Techniques};
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
    /// Whether the camera sees it by way of delta lobes alone, or directly.
    shown: bool,
}

/// Where an eye subpath goes on to.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant, reason = "it lives for one step, on the stack")]
pub enum Onward {
    /// To a surface.
    Vertex(EyeVertex),
    /// Out of the scene: what it finds there, by technique s = 0.
    Sky(Spectrum),
    /// Nowhere.
    End,
}

impl Onward {
    /// The vertex, where there is one.
    pub fn vertex(self) -> Option<EyeVertex> {
        if let Self::Vertex(vertex) = self { Some(vertex) } else { None }
    }
}

impl EyeVertex {
    /// What is behind a raster position; `sampler` gives the point of the lens.
    pub fn first(world: &World<'_>, techniques: &Techniques, raster: DVec2, sampler: &Sampler) -> Onward {
        let origin = world.camera.lens_point(|| sampler.u2(0, Purpose::Lens));
        let direction = world.camera.direction_from(origin, raster);
        let start = Start {
            ray: offset::from_free_point(origin, direction),
            origin,
            direction,
            pdf_w: world.camera.pdf_w(direction),
            cos: 1.0,
            total: Total::known(0.0),
            distant: false,
        };
        let Some(point) = world.intersect(&start.ray, origin, direction) else {
            // No other technique sees the sky directly.
            return world.lights.sky(direction).map_or(Onward::End, |sky| Onward::Sky(sky.radiance));
        };
        let rules = techniques.rules(Transport::Radiance);
        let seen = Total { seen: techniques.light_image, ..Total::default() };
        match Walk::arrive(world, &rules, &start, Spectrum::ONE, point) {
            Some(walk) => Onward::Vertex(Self::new(techniques, walk, seen, 0.0, true)),
            None => Onward::End,
        }
    }

    #[inline(always)]
    fn new(techniques: &Techniques, walk: Walk, m_previous: Total, m_emitter: f64, shown: bool) -> Self {
        let delta = walk.vertex.bsdf.is_delta();
        let lobes = if delta { Lobes::NONE } else { techniques.lobes(&walk.vertex, walk.vertex.wo) };
        Self { walk, lobes, m_previous: if delta { Total::default() } else { m_previous }, m_emitter, shown }
    }

    /// Goes on from this vertex.
    pub fn next(&self, world: &World<'_>, techniques: &Techniques, sampler: &Sampler) -> Onward {
        let rules = techniques.rules(Transport::Radiance);
        let segment = self.walk.scatter(&rules, sampler, |s| {
            if s.delta {
                return Total::known(techniques.heuristic.total(&self.walk.side, 0.0, s.pdf_rev, 0.0));
            }
            self.totals(techniques, s.pdf_rev)
        });
        let Some(segment) = segment else { return Onward::End };
        let Start { ray, origin, direction, .. } = &segment.start;
        let Some(point) = world.intersect(ray, *origin, *direction) else {
            return self.sky(world, techniques, &rules, &segment);
        };
        let Some(walk) = self.walk.go_on(world, &rules, &segment, point) else { return Onward::End };
        let shown = self.shown && walk.after_delta;
        if walk.after_delta {
            return Onward::Vertex(Self::new(techniques, walk, Total::default(), 0.0, shown));
        }
        let back = -walk.to_previous();
        let m = techniques.connection(&self.lobes, back);
        let m_emitter = world.lights.at(&walk.vertex.point).map_or(0.0, |emitter| {
            let preference = world.lights.preference(|| self.walk.vertex.place(), emitter.emitter);
            techniques.direct(&self.lobes, Some(back), preference)
        });
        Onward::Vertex(Self::new(techniques, walk, m, m_emitter, shown))
    }

    /// What a segment that leaves the scene finds.
    fn sky(&self, world: &World<'_>, techniques: &Techniques, rules: &Rules, segment: &Segment) -> Onward {
        let start = &segment.start;
        let Some(sky) = world.lights.sky(start.direction) else { return Onward::End };
        let light = LightPoint::Distant(sky);
        let m_0 = techniques.eye_hits(&light);
        if m_0 == 0.0 {
            return Onward::End;
        }
        let total = start.total.given(rules.heuristic, &rules.storing, Origin::Lamp);
        let side = rules.heuristic.arrive(start.pdf_w, 1.0, start.cos, 1.0, total);
        let m_next_event = if segment.delta {
            0.0
        } else {
            techniques.next_event * world.lights.preference(|| self.walk.vertex.place(), light.number())
        };
        let back = techniques.emission_pdf(world, &light, sky.direction, start.origin);
        let e = rules.heuristic.others(sky.pdf, rules.heuristic.total(&side, m_next_event, back, 0.0));
        Onward::Sky(segment.throughput * sky.radiance * rules.heuristic.weight(0.0, m_0, e))
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
            stored: heuristic.total(side, m.stored, 0.0, 0.0),
            seen: heuristic.total(side, m.seen, 0.0, 0.0),
            merged: heuristic.raise(self.eta(techniques)),
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
        let first = vertex.point.position + self.walk.to_previous();
        let back = techniques.emission_pdf(world, &LightPoint::Surface(emitter), vertex.wo, first);
        let e = heuristic.others(emitter.pdf_a, heuristic.total(&side, self.m_emitter, back, 0.0));
        *throughput * radiance * heuristic.weight(0.0, techniques.eye_hits, e)
    }

    /// Technique s = 1: light straight from a point of a light, by next-event estimation. The value counts if the ray is
    /// free.
    pub fn next_event(
        &self,
        world: &World<'_>,
        techniques: &Techniques,
        sampler: &Sampler,
    ) -> Option<(Spectrum, Ray)> {
        let depth = self.walk.depth;
        let (pick, u) = (sampler.u1(depth, Purpose::LightPick), sampler.u2(depth, Purpose::LightPoint));
        let (number, preference) = world.lights.choose_for(|| self.walk.vertex.place(), pick)?;
        let (light, m) = (world.lights.point_on(number, u), techniques.next_event * preference);
        self.direct(world, techniques, &light, m, preference, preference)
    }

    /// Technique s = 1 by the roulette over points of lights: from one that it kept. `tries`: how many points it judged,
    /// times the probability that it kept this one; the value counts if the ray is free.
    pub fn emitter_point(
        &self,
        world: &World<'_>,
        techniques: &Techniques,
        light: &LightPoint,
        tries: f64,
    ) -> Option<(Spectrum, Ray)> {
        let offset = light.position()? - self.walk.vertex.point.position;
        let m = techniques.emitter_points(&self.lobes, Some(offset));
        let preference = world.lights.preference(|| self.walk.vertex.place(), light.number());
        self.direct(world, techniques, light, m, tries, preference)
    }

    /// Light straight from a point of a light, by the technique that has the part `m` of m_1 and tries so often.
    fn direct(
        &self,
        world: &World<'_>,
        techniques: &Techniques,
        light: &LightPoint,
        m: f64,
        tries: f64,
        preference: f64,
    ) -> Option<(Spectrum, Ray)> {
        let vertex = &self.walk.vertex;
        let Toward { w, distance2, cos: cos_light, radiance } = light.toward(vertex.point.position)?;
        if radiance == Spectrum::ZERO {
            return None;
        }
        let (factor, pdf_w) = vertex.toward_light(w);
        let value = self.walk.throughput * factor * radiance * (cos_light / distance2);
        if value == Spectrum::ZERO || !(m > 0.0) {
            return None;
        }
        let heuristic = techniques.heuristic;
        let offset = light.position().map(|position| position - vertex.point.position);
        let all = techniques.direct(&self.lobes, offset, preference);
        let l = per_area(pdf_w, cos_light, distance2) * techniques.eye_hits(light) / light.pdf();
        let emission = techniques.emission_pdf(world, light, -w, vertex.point.position);
        let density = per_area(emission, vertex.cos_ng(w), distance2);
        let e = self.others(techniques, density, w, Origin::Lamp);
        // Both techniques of s = 1 share its weight by their parts, whatever the heuristic.
        let weight = heuristic.weight(heuristic.raise(l), all, e) * (m / all);
        Some((value * (weight / (tries * light.pdf())), offset::to_light(&vertex.point, light)))
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

    /// eta here; 0 where light vertices are not merged.
    pub fn eta(&self, techniques: &Techniques) -> f64 {
        let all = !techniques.storing.shown_only;
        if all || self.shown && self.walk.depth > 1 { techniques.eta() } else { 0.0 }
    }

    /// Merging with a light vertex within the radius: the light that arrives there counts as arriving here.
    pub fn merge(&self, techniques: &Techniques, light: &Walk) -> Spectrum {
        let vertex = &self.walk.vertex;
        let value = self.walk.throughput * vertex.factor(vertex.wo, light.vertex.wo) * light.throughput;
        let eta = self.eta(techniques) * techniques.merged(light);
        if value == Spectrum::ZERO || eta == 0.0 {
            return Spectrum::ZERO;
        }
        let light_total = techniques.light_total(light, vertex.wo, eta);
        let eye_total = self.total(techniques, light.vertex.wo, light.origins[0]);
        value * (techniques.heuristic.merging_weight(light_total, eta, eye_total) / eta)
    }
}

/// Technique s = k-1: a light vertex seen by the camera. The value, for the sum over a film's eye samples, belongs at
/// the raster position if the ray is free. `sampler` gives the point of the lens.
pub fn connect_camera(
    world: &World<'_>,
    techniques: &Techniques,
    light: &Walk,
    sampler: &Sampler,
) -> Option<(DVec2, Spectrum, Ray)> {
    let (y, m) = (&light.vertex, techniques.light_image * techniques.seen(light));
    if m == 0.0 {
        return None;
    }
    let lens = world.camera.lens_point(|| sampler.u2(light.depth, Purpose::Lens));
    let edge = Edge::new(lens, y.point.position)?;
    let raster = world.camera.raster_from(lens, edge.w)?;
    let pdf = per_area(world.camera.pdf_w(edge.w), y.cos_ng(edge.w), edge.distance2);
    let value = light.throughput * y.factor(-edge.w, y.wo) * pdf;
    if value == Spectrum::ZERO {
        return None;
    }
    let l = techniques.light_others(light, pdf, -edge.w);
    let ray = offset::free_to_surface(lens, &y.point);
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
