//! One step of a subpath, the same from either end.

use super::{Vertex, World};
use crate::bsdf::Transport;
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
    /// [`Heuristic::total`] at the origin.
    pub total: f64,
}

impl Walk {
    /// Follows a segment to the surface it meets.
    pub fn follow(
        world: &World<'_>,
        heuristic: Heuristic,
        start: &Start,
        throughput: Spectrum,
        depth: u32,
        after_delta: bool,
    ) -> Option<Self> {
        let point = world.intersect(&start.ray, start.origin, start.direction)?;
        let wo = -start.direction;
        let cos = point.ng.dot(wo).abs();
        let distance2 = (point.position - start.origin).length_squared();
        if !(cos > 0.0 && distance2 > 0.0) {
            return None;
        }
        Some(Self {
            vertex: Vertex::new(world, point, wo),
            throughput,
            side: heuristic.arrive(start.pdf_w, cos, start.cos, distance2, start.total),
            distance: distance2.sqrt(),
            depth,
            after_delta,
        })
    }

    /// Scatters at the vertex and goes on to the next. `m` tells how often the technique that would connect the edge
    /// to the previous vertex tries, given the direction in which the path leaves; neither it nor `merging`
    /// ([`Heuristic::total`]) counts at delta lobes.
    pub fn next(
        &self,
        world: &World<'_>,
        heuristic: Heuristic,
        transport: Transport,
        sampler: &Sampler,
        merging: f64,
        m: impl FnOnce(DVec3) -> f64,
    ) -> Option<Self> {
        let s = self.vertex.sample(transport, sampler, self.depth)?;
        let (m, merging) = if s.delta { (0.0, 0.0) } else { (m(s.wi), merging) };
        let start = Start {
            ray: offset::leave(&self.vertex.point, s.wi),
            origin: self.vertex.point.position,
            direction: s.wi,
            pdf_w: s.pdf,
            cos: self.vertex.cos_ng(s.wi),
            total: heuristic.total(&self.side, m, s.pdf_rev, merging),
        };
        Self::follow(world, heuristic, &start, self.throughput * s.weight, self.depth + 1, s.delta)
    }

    /// Offset from the vertex back to the previous one.
    pub fn to_previous(&self) -> DVec3 {
        self.vertex.wo * self.distance
    }
}
