//! One step of a subpath, the same from either end.

use super::{Origin, Scattered, Storing, Total, Vertex, World};
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
    /// The `b` of these if the vertex is taken for the light's own, and not for a surface that is lit.
    pub b_as_lamp: f64,
    /// Distance to the previous vertex, world units.
    pub distance: f64,
    /// Segments from the subpath's start, at least 1.
    pub depth: u32,
    /// Whether the previous vertex scattered by a delta lobe, so that nothing can connect to it.
    pub after_delta: bool,
    /// Whether the segment that led here came in from a distant light.
    pub from_afar: bool,
    /// Light side, at the first vertex: [`Lights::preference`](crate::light::Lights::preference) of the light for it.
    pub preference: f64,
    /// Light side: what threw light on the vertex, and on the one before it.
    pub origins: [Origin; 2],
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
    /// [`Heuristic::total`] at the origin.
    pub total: Total,
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

impl Walk {
    /// Follows a segment to the surface it meets.
    pub fn follow(world: &World<'_>, rules: &Rules, start: &Start, throughput: Spectrum) -> Option<Self> {
        let point = world.intersect(&start.ray, start.origin, start.direction)?;
        Self::arrive(world, rules, start, throughput, point)
    }

    /// Arrives at the surface that a segment meets.
    #[inline(always)]
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
        let Rules { heuristic, storing, .. } = rules;
        let total = start.total.given(*heuristic, storing, storing.origin(&vertex.bsdf));
        let spread = if start.distant { 1.0 } else { distance2 };
        let side = heuristic.arrive(start.pdf_w, cos, start.cos, spread, total);
        let as_lamp = start.total.given(*heuristic, storing, Origin::Lamp);
        Some(Self {
            vertex,
            throughput,
            side,
            b_as_lamp: if as_lamp == total {
                side.b
            } else {
                heuristic.arrive(start.pdf_w, cos, start.cos, spread, as_lamp).b
            },
            distance: distance2.sqrt(),
            depth: 1,
            after_delta: false,
            from_afar: start.distant,
            preference: 1.0,
            origins: [Origin::Lamp; 2],
        })
    }

    /// Scatters at the vertex. `total` gives [`Start::total`] for the way the path goes on.
    #[inline(always)]
    pub fn scatter(
        &self,
        rules: &Rules,
        sampler: &Sampler,
        total: impl FnOnce(&Scattered) -> Total,
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
    #[inline(always)]
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
            origins: [rules.storing.origin(&self.vertex.bsdf), self.origins[0]],
            ..Self::arrive(world, rules, &segment.start, segment.throughput, point)?
        })
    }

    /// Scatters at the vertex and goes on to the next; see [`Walk::scatter`].
    pub fn next(
        &self,
        world: &World<'_>,
        rules: &Rules,
        sampler: &Sampler,
        total: impl FnOnce(&Scattered) -> Total,
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
