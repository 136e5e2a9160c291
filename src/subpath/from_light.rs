//! Light subpaths.

use super::World;
use super::walk::{Start, Walk};
use crate::mis::Heuristic;
use crate::sampler::{Purpose, Sampler};
use crate::visibility::offset;

/// Emits from a point of an emitter, chosen by power and area, into a direction, chosen by the cosine, and follows it
/// to the first surface. `m_0` says how often the eye subpath that hits the emitter tries (0 or 1). `None` when
/// nothing emits or nothing is met.
pub fn emit(world: &World<'_>, heuristic: Heuristic, sampler: &Sampler, m_0: f64) -> Option<Walk> {
    let emitter =
        world.lights.sample_point(sampler.u1(0, Purpose::LightPick), sampler.u2(0, Purpose::LightPoint))?;
    let direction = emitter.sample_direction(sampler.u2(0, Purpose::LightDirection))?;
    let cos = emitter.point.ng.dot(direction).abs();
    let pdf_w = emitter.pdf_w(direction);
    if !(pdf_w > 0.0) {
        return None;
    }
    let start = Start {
        ray: offset::leave(&emitter.point, direction),
        origin: emitter.point.position,
        direction,
        pdf_w,
        cos,
        total: heuristic.raise(m_0 / emitter.pdf_a),
    };
    Walk::follow(world, heuristic, &start, emitter.emission * (cos / (emitter.pdf_a * pdf_w)), 1, false)
}
