//! Light subpaths.

use super::walk::{Rules, Start, Walk};
use super::{Total, World};
use crate::light::{EmissionGuide, LightPoint};
use crate::sampler::{Purpose, Sampler};
use crate::visibility::offset;
use glam::DVec2;

/// Emits from a point of a light, chosen by power and area, along a ray, chosen by the cosine (from all of the scene's
/// outline, where light is distant) or by `guide`, and follows it to the first surface. `m_0` says how often the eye
/// subpath that hits the emitter tries (0 or 1). `None` when nothing emits or nothing is met.
pub fn emit(
    world: &World<'_>,
    rules: &Rules,
    guide: Option<&EmissionGuide>,
    sampler: &Sampler,
    m_0: f64,
) -> Option<Walk> {
    let (light, u) = start(world, guide, sampler)?;
    let surroundings = world.lights.surroundings();
    let emission = light.emit(surroundings, u)?;
    let pdf = match guide {
        None => light.emission_pdf(surroundings, emission.direction),
        // Of distant light the place is meant, and the ray's start is on the ray.
        Some(guide) => guide.pdf(&light, emission.direction, emission.origin),
    };
    if !(pdf > 0.0) {
        return None;
    }
    let m_0 = if light.is_delta() { 0.0 } else { m_0 };
    let start = Start {
        ray: match &light {
            LightPoint::Surface(emitter) => offset::leave(&emitter.point, emission.direction),
            _ => offset::from_free_point(emission.origin, emission.direction),
        },
        origin: emission.origin,
        direction: emission.direction,
        pdf_w: pdf,
        cos: emission.cos,
        total: Total::known(rules.heuristic.raise(m_0 / light.pdf())),
        distant: matches!(light, LightPoint::Distant(_)),
    };
    let throughput = emission.radiance * (emission.cos / (light.pdf() * pdf));
    let mut walk = Walk::follow(world, rules, &start, throughput);
    if let Some(walk) = &mut walk {
        walk.preference = world.lights.preference(|| walk.vertex.place(), light.number());
    }
    walk
}

/// The light that a subpath starts from, and the point of the unit square that stands for the way it takes; `None`
/// when nothing emits.
pub fn start(
    world: &World<'_>,
    guide: Option<&EmissionGuide>,
    sampler: &Sampler,
) -> Option<(LightPoint, DVec2)> {
    let light = world.lights.sample(sampler.u1(0, Purpose::LightPick), sampler.u2(0, Purpose::LightPoint))?;
    let u = sampler.u2(0, Purpose::LightDirection);
    Some((light, guide.map_or(u, |guide| guide.warp(&light, u))))
}
