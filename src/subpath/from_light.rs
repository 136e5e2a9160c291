//! Light subpaths.

use super::walk::{Rules, Start, Walk};
use super::{Total, World};
use crate::light::{EmissionGuide, EmitterPoint};
use crate::sampler::{Purpose, Sampler};
use crate::visibility::offset;
use glam::DVec3;

/// Emits from a point of an emitter, chosen by power and area, into a direction, chosen by the cosine or by `guide`, and
/// follows it
/// to the first surface. `m_0` says how often the eye subpath that hits the emitter tries (0 or 1). `None` when
/// nothing emits or nothing is met.
pub fn emit(
    world: &World<'_>,
    rules: &Rules,
    guide: Option<&EmissionGuide>,
    sampler: &Sampler,
    m_0: f64,
) -> Option<Walk> {
    let (emitter, direction) = start(world, guide, sampler)?;
    let cos = emitter.point.ng.dot(direction).abs();
    let pdf_w = guide.map_or_else(|| emitter.pdf_w(direction), |guide| guide.pdf_w(&emitter, direction));
    if !(pdf_w > 0.0) {
        return None;
    }
    let start = Start {
        ray: offset::leave(&emitter.point, direction),
        origin: emitter.point.position,
        direction,
        pdf_w,
        cos,
        total: Total::known(rules.heuristic.raise(m_0 / emitter.pdf_a)),
    };
    let throughput = emitter.emission * (cos / (emitter.pdf_a * pdf_w));
    Walk::follow(world, rules, &start, throughput)
}

/// Where and in which direction a light subpath starts; `None` when nothing emits.
pub fn start(
    world: &World<'_>,
    guide: Option<&EmissionGuide>,
    sampler: &Sampler,
) -> Option<(EmitterPoint, DVec3)> {
    let emitter =
        world.lights.sample_point(sampler.u1(0, Purpose::LightPick), sampler.u2(0, Purpose::LightPoint))?;
    let u = sampler.u2(0, Purpose::LightDirection);
    let direction = emitter.sample_direction(guide.map_or(u, |guide| guide.warp(&emitter, u)))?;
    Some((emitter, direction))
}
