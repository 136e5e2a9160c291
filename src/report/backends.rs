//! Ray query backends side by side: speed on a scene's own rays, and every answer in which they differ.

use crate::bsdf::Transport;
use crate::geometry::{Mesh, SurfacePoint};
use crate::math::Frame;
use crate::mis::Heuristic;
use crate::sampler::counter::{combine, mix, unit};
use crate::sampler::{Sampler, Stream};
use crate::subpath::{World, from_light};
use crate::techniques::Techniques;
use crate::visibility::{Hit, Ray, Visibility, offset};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::time::Instant;

/// How far rounding may move what `f32` rays meet, in units in the last place of the largest coordinate.
const ROUNDING: f64 = 8.0;

/// Rays of one kind.
#[derive(Debug)]
pub struct Workload {
    /// What they are.
    pub name: &'static str,
    /// Whether any hit will do, or the nearest is wanted.
    pub any_hit: bool,
    /// The rays, in the order in which a renderer would ask.
    pub rays: Vec<Ray>,
}

/// Camera rays, diffuse bounces from where these hit, and connections from there to where light from the emitters
/// falls; up to `count` each.
pub fn workloads(world: &World<'_>, count: usize) -> [Workload; 3] {
    let film = &world.scene.film;
    let (camera, mut state) = (&world.camera, 0u64);
    let mut random = || {
        state += 1;
        unit(mix(combine(0x7261_7973, state)))
    };
    let aspect = f64::from(film.width) / f64::from(film.height);
    let down = ((count as f64 / aspect).sqrt() as usize).max(1);
    let across = (count / down).max(1);
    let size = DVec2::new(film.width.into(), film.height.into());
    let mut cameras = Vec::new();
    let mut seen = Vec::new();
    for (x, y) in (0..down).flat_map(|y| (0..across).map(move |x| (x, y))) {
        let at = DVec2::new((x as f64 + random()) / across as f64, (y as f64 + random()) / down as f64);
        let direction = camera.direction(at * size);
        let ray = offset::from_free_point(camera.position, direction);
        cameras.push(ray);
        seen.extend(world.intersect(&ray, camera.position, direction).map(|p| (p, direction)));
    }
    let bounces = seen.iter().map(|(p, from)| scattered(p, -*from, random(), random()).0).collect();
    let rules = Techniques::none(Heuristic::Balance).rules(Transport::Importance);
    let lit: Vec<SurfacePoint> = (0..seen.len() as u64)
        .filter_map(|index| {
            let sampler = Sampler::new(0, 0, Stream::Light, index);
            Some(from_light::emit(world, &rules, None, &sampler, 0.0)?.vertex.point)
        })
        .collect();
    let mut connections = Vec::new();
    if !lit.is_empty() {
        for (p, _) in &seen {
            connections.push(offset::between(p, &lit[(random() * lit.len() as f64) as usize]));
        }
    }
    [
        Workload { name: "camera rays", any_hit: false, rays: cameras },
        Workload { name: "diffuse bounces", any_hit: false, rays: bounces },
        Workload { name: "connections", any_hit: true, rays: connections },
    ]
}

/// A ray from a surface, by the cosine, on the side that `toward` is on.
fn scattered(point: &SurfacePoint, toward: DVec3, u: f64, v: f64) -> (Ray, DVec3) {
    let normal = point.ng * 1f64.copysign(point.ng.dot(toward));
    let (r, (sin, cos)) = (u.sqrt(), (TAU * v).sin_cos());
    let direction =
        Frame::from_z(normal).to_world(DVec3::new(r * cos, r * sin, (1.0 - u).max(0.0).sqrt())).normalize();
    (offset::leave(point, direction), direction)
}

/// Seconds that the rays take on the pool's threads, and how many of them meet something.
pub fn time(visibility: &dyn Visibility, workload: &Workload) -> (f64, usize) {
    let start = Instant::now();
    let found = workload
        .rays
        .par_chunks(4096)
        .map(|rays| {
            let meets = |ray: &&Ray| {
                if workload.any_hit { visibility.occluded(ray) } else { visibility.intersect(ray).is_some() }
            };
            rays.iter().filter(meets).count()
        })
        .sum();
    (start.elapsed().as_secs_f64(), found)
}

/// How two backends' answers to the same rays compare.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Disagreements {
    /// Rays that were asked.
    pub rays: usize,
    /// Both meet the same place, on two triangles that touch or coincide there.
    pub same_place: usize,
    /// One meets a triangle where it ends, and the other passes it by less than rounding.
    pub at_an_edge: usize,
    /// What neither explains.
    pub unexplained: Vec<(Ray, Option<Hit>, Option<Hit>)>,
}

/// Asks two backends the same and explains every difference.
pub fn disagreements(
    mesh: &Mesh,
    workload: &Workload,
    a: &dyn Visibility,
    b: &dyn Visibility,
) -> Disagreements {
    let mut result = Disagreements { rays: workload.rays.len(), ..Disagreements::default() };
    let answers: Vec<_> = workload
        .rays
        .par_iter()
        .filter_map(|ray| {
            if workload.any_hit && a.occluded(ray) == b.occluded(ray) {
                return None;
            }
            let hits = (a.intersect(ray), b.intersect(ray));
            let triangle = |hit: Option<Hit>| hit.map(|h| h.triangle);
            (workload.any_hit || triangle(hits.0) != triangle(hits.1)).then_some((*ray, hits.0, hits.1))
        })
        .collect();
    for (ray, a, b) in answers {
        match explain(mesh, &ray, a, b) {
            Some(true) => result.same_place += 1,
            Some(false) => result.at_an_edge += 1,
            None => result.unexplained.push((ray, a, b)),
        }
    }
    result
}

/// `Some(true)`: the same place; `Some(false)`: at an edge.
fn explain(mesh: &Mesh, ray: &Ray, a: Option<Hit>, b: Option<Hit>) -> Option<bool> {
    let corners =
        |hit: &Hit| mesh.triangles[hit.triangle as usize].map(|v| mesh.positions[v as usize].as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let place = |hit: &Hit| {
        let [p, q, r] = corners(hit);
        let normal = (q - p).cross(r - p);
        let t = normal.dot(p - origin) / normal.dot(direction);
        (t, origin + direction * t, [p, q, r], normal.normalize())
    };
    let tolerance = |x: DVec3, corners: &[DVec3; 3]| {
        let size = [origin, x].iter().chain(corners).map(|p| p.abs().max_element()).fold(0.0, f64::max);
        ROUNDING * f64::from(f32::EPSILON) * size
    };
    if let (Some(a), Some(b)) = (&a, &b) {
        let ((_, xa, corners, na), (_, xb, _, nb)) = (place(a), place(b));
        // Along a ray that grazes, the same offset from a plane is a longer way.
        let grazing = direction.normalize().dot(na).abs().min(direction.normalize().dot(nb).abs()).max(1e-6);
        if (xa - xb).length() <= tolerance(xa, &corners) / grazing {
            return Some(true);
        }
    }
    let nearer = match (&a, &b) {
        (Some(a), Some(b)) => Some(if place(a).0 < place(b).0 { a } else { b }),
        (a, b) => a.as_ref().or(b.as_ref()),
    };
    let (_, x, corners, normal) = place(nearer?);
    let cos = direction.normalize().dot(normal).abs().max(1e-6);
    let to_edge = (0..3)
        .map(|i| {
            let (p, q) = (corners[i], corners[(i + 1) % 3]);
            let along = ((x - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
            (p + (q - p) * along - x).length()
        })
        .fold(f64::INFINITY, f64::min);
    (to_edge <= tolerance(x, &corners) / cos).then_some(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::brute::Brute;
    use glam::Vec3;

    /// Two triangles of a square, and a third that lies on the first.
    fn mesh() -> Mesh {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 1, 2]];
        Mesh { positions, materials: vec![0; triangles.len()], triangles, ..Mesh::default() }
    }

    fn down(x: f32, y: f32) -> Ray {
        Ray { origin: Vec3::new(x, y, 1.0), direction: -Vec3::Z, t_min: 0.0, t_max: f32::INFINITY }
    }

    fn hit(triangle: u32) -> Option<Hit> {
        Some(Hit { triangle, u: 0.3, v: 0.3, t: 1.0 })
    }

    #[test]
    fn differences_are_told_apart() {
        let mesh = mesh();
        assert_eq!(explain(&mesh, &down(0.6, 0.3), hit(0), hit(2)), Some(true), "coincident triangles");
        assert_eq!(explain(&mesh, &down(0.5, 0.5), hit(0), hit(1)), Some(true), "the common edge");
        assert_eq!(explain(&mesh, &down(1.0, 0.5), hit(0), None), Some(false), "the border");
        assert_eq!(explain(&mesh, &down(0.6, 0.3), None, hit(0)), None, "the middle");
        assert_eq!(explain(&mesh, &down(0.99, 0.5), hit(0), None), None, "near the border is not on it");
    }

    /// A backend that is blind to one triangle is found out.
    #[test]
    fn a_backend_that_errs_is_found_out() {
        let whole = mesh();
        let mut part = mesh();
        part.triangles[1] = [0, 0, 0];
        let rays = (0..100).map(|i| down(0.05 + 0.009 * i as f32, 0.5)).collect();
        let workload = Workload { name: "rows", any_hit: false, rays };
        let (a, b) = (Brute::new(&whole, None).unwrap(), Brute::new(&part, None).unwrap());
        let found = disagreements(&whole, &workload, &a, &b);
        assert_eq!(found.rays, 100);
        assert!((45..=55).contains(&found.unexplained.len()), "{found:?}");
        assert_eq!(
            disagreements(&whole, &workload, &a, &a),
            Disagreements { rays: 100, ..Default::default() }
        );
    }
}
