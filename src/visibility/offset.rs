//! Where rays start and end: the one place that knows how far `f32` can be trusted.
//!
//! A [`SurfacePoint`] lies on its triangle to the precision of `f64`, and every backend decides in `f64` on which side
//! of a triangle a ray starts. But a ray is `f32`: its origin is rounded, and its direction too, which tilts it against
//! the surfaces it runs along. So rays start and shadow rays end a little off the surface, along the geometric normal,
//! on the side where the path goes on. The shift follows the size of the coordinates ([`SurfacePoint::error`]), not the
//! ray's angle or length: nothing is tuned to a scene, and scaling a scene scales the shift.
//!
//! Of what is closer to a surface than the shift, rays that leave it know nothing.

use super::Ray;
use crate::geometry::SurfacePoint;
use crate::light::LightPoint;
use glam::DVec3;

/// Shift in units of [`SurfacePoint::error`]: 0.9 at most for the origin's rounding, as much again for the direction's,
/// across all of the triangle, and as much for the rounding of the corners, which can turn the edge between two nearly
/// coplanar triangles of a convex body into a concave one.
const MARGIN: f64 = 3.0;

/// The ray from a surface into a direction, to infinity. `direction` is unit.
#[inline(always)]
pub fn leave(point: &SurfacePoint, direction: DVec3) -> Ray {
    from_free_point(shifted(point, direction, point.error), direction)
}

/// The ray between two points on surfaces that is free when they see each other; its hits are the obstacles.
#[inline(always)]
pub fn between(a: &SurfacePoint, b: &SurfacePoint) -> Ray {
    let direction = b.position - a.position;
    // The error at an end also grows with the distance to the other.
    let error = a.error.max(b.error);
    segment(shifted(a, direction, error), shifted(b, -direction, error))
}

/// The ray from a point that is on no surface (a camera, a point light) into a direction, to infinity. `p` is relative
/// to the mesh's origin, `direction` unit.
#[inline(always)]
pub fn from_free_point(p: DVec3, direction: DVec3) -> Ray {
    Ray { origin: p.as_vec3(), direction: direction.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
}

/// The ray from a point that is on no surface to one that is, free when they see each other.
pub fn free_to_surface(p: DVec3, b: &SurfacePoint) -> Ray {
    let error = b.error.max(p.abs().max_element() * f64::from(f32::EPSILON));
    segment(p, shifted(b, p - b.position, error))
}

/// The ray from a surface to a light, free when they see each other.
#[inline]
pub fn to_light(a: &SurfacePoint, light: &LightPoint) -> Ray {
    match light {
        LightPoint::Surface(emitter) => between(a, &emitter.point),
        LightPoint::Lamp(l) => free_to_surface(l.lamp.position, a),
        LightPoint::Distant(d) => leave(a, -d.direction),
    }
}

/// `point` moved off its surface to the side that `toward` points to.
#[inline(always)]
fn shifted(point: &SurfacePoint, toward: DVec3, error: f64) -> DVec3 {
    point.position + point.ng * (MARGIN * error).copysign(point.ng.dot(toward))
}

#[inline(always)]
fn segment(from: DVec3, to: DVec3) -> Ray {
    let origin = from.as_vec3();
    // From where the ray starts after rounding, so that rounding does not add up at its end.
    Ray { origin, direction: (to - origin.as_dvec3()).as_vec3(), t_min: 0.0, t_max: 1.0 }
}
