//! One step of a subpath, the same from either end.

use super::{Scattered, Storing, Vertex, World};
use crate::bsdf::Transport;
use crate::geometry::SurfacePoint;
use crate::math::Spectrum;
use crate::mis::{Heuristic, Side};
use crate::sampler::Sampler;
use crate::visibility::{Ray, offset};
use glam::DVec3;

/// The last vertex of a subpath and what was gathered on the way to it.
#[derive(Debug, Clone, Copy)]
pub struct Walk {
    /// The vertex.
    pub vertex: Vertex,
    /// Light side: power per vertex factor (W sr-free: contributions are throughput x factor x geometry);
    /// eye side: the share of the pixel.
    pub throughput: Spectrum,
    /// Multiple importance sampling's sums.
    pub side: Side,
    /// Distance to the previous vertex, world units.
    pub distance: f64,
    /// Segments from the subpath's start, at least 1.
    pub depth: u32,
    /// Whether the previous vertex scattered by a delta lobe, so that nothing can connect to it.
    pub after_delta: bool,
    /// Whether the previous vertex scatters narrowly ([`Storing`]), and the one before it.
    pub after_narrow: [bool; 2],
}

/// What all steps of a subpath have in common.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    /// What the subpath carries.
    pub transport: Transport,
    /// How techniques share a path.
    pub heuristic: Heuristic,
    /// Which light vertices are stored.
    pub storing: Storing,
}

/// Where a segment starts.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// The ray to trace.
    pub ray: Ray,
    /// Its origin in full precision.
    pub origin: DVec3,
    /// Its unit direction in full precision.
    pub direction: DVec3,
    /// Density of the direction, 1/sr.
    pub pdf_w: f64,
    /// |cos| at the origin.
    pub cos: f64,
    /// [`Heuristic::total`] at the origin: what is known, and what counts for the probability that the origin would be
    /// stored as a light vertex, were the vertex that the segment leads to its predecessor.
    pub total: [f64; 2],
    /// Whether the segment comes in from a distant light: `pdf_w` is then a density per area across it, 1/m^2.
    pub distant: bool,
}

/// A segment that a subpath goes on along.
#[derive(Debug, Clone, Copy)]
pub struct Segment {
    /// Where it starts.
    pub start: Start,
    /// [`Walk::throughput`] at its end.
    pub throughput: Spectrum,
    /// Whether its direction comes from a delta lobe.
    pub delta: bool,
}

impl Start {
    /// [`Heuristic::total`] at the origin, once it is known whether what the segment leads to scatters narrowly.
    pub fn total(&self, rules: &Rules, narrow: bool) -> f64 {
        let [known, if_stored] = self.total;
        if if_stored == 0.0 {
            return known;
        }
        known + rules.heuristic.raise(rules.storing.probability(narrow)) * if_stored
    }
}

impl Walk {
    /// Follows a segment to the surface it meets.
    pub fn follow(world: &World<'_>, rules: &Rules, start: &Start, throughput: Spectrum) -> Option<Self> {
        let point = world.intersect(&start.ray, start.origin, start.direction)?;
        Self::arrive(world, rules, start, throughput, point)
    }

    /// Arrives at the surface that a segment meets.
    pub fn arrive(
        world: &World<'_>,
        rules: &Rules,
        start: &Start,
        throughput: Spectrum,
        point: SurfacePoint,
    ) -> Option<Self> {
        let wo = -start.direction;
        let cos = point.ng.dot(wo).abs();
        let distance2 = (point.position - start.origin).length_squared();
        if !(cos > 0.0 && distance2 > 0.0) {
            return None;
        }
        let vertex = Vertex::new(world, point, wo);
        let total = start.total(rules, rules.storing.is_narrow(&vertex.bsdf));
        let spread = if start.distant { 1.0 } else { distance2 };
        Some(Self {
            vertex,
            throughput,
            side: rules.heuristic.arrive(start.pdf_w, cos, start.cos, spread, total),
            distance: distance2.sqrt(),
            depth: 1,
            after_delta: false,
            after_narrow: [false; 2],
        })
    }

    /// Scatters at the vertex. `total` gives [`Start::total`] for the way the path goes on.
    pub fn scatter(
        &self,
        rules: &Rules,
        sampler: &Sampler,
        total: impl FnOnce(&Scattered) -> [f64; 2],
    ) -> Option<Segment> {
        let s = self.vertex.sample(rules.transport, sampler, self.depth)?;
        let start = Start {
            ray: offset::leave(&self.vertex.point, s.wi),
            origin: self.vertex.point.position,
            direction: s.wi,
            pdf_w: s.pdf,
            cos: self.vertex.cos_ng(s.wi),
            total: total(&s),
            distant: false,
        };
        Some(Segment { start, throughput: self.throughput * s.weight, delta: s.delta })
    }

    /// Goes on along a segment that ends at `point`.
    pub fn go_on(
        &self,
        world: &World<'_>,
        rules: &Rules,
        segment: &Segment,
        point: SurfacePoint,
    ) -> Option<Self> {
        Some(Self {
            depth: self.depth + 1,
            after_delta: segment.delta,
            after_narrow: [rules.storing.is_narrow(&self.vertex.bsdf), self.after_narrow[0]],
            ..Self::arrive(world, rules, &segment.start, segment.throughput, point)?
        })
    }

    /// Scatters at the vertex and goes on to the next; see [`Walk::scatter`].
    pub fn next(
        &self,
        world: &World<'_>,
        rules: &Rules,
        sampler: &Sampler,
        total: impl FnOnce(&Scattered) -> [f64; 2],
    ) -> Option<Self> {
        let segment = self.scatter(rules, sampler, total)?;
        let Start { ray, origin, direction, .. } = &segment.start;
        self.go_on(world, rules, &segment, world.intersect(ray, *origin, *direction)?)
    }

    /// Offset from the vertex back to the previous one.
    pub fn to_previous(&self) -> DVec3 {
        self.vertex.wo * self.distance
    }
}
