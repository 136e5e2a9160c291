//! The visibility backends against each other and against hand-made cases.

use crate::support::Random;
use crate::support::shapes::{ball, cube, mesh, moved, soup};
use glam::{DVec2, DVec3, Vec3};
use hrr::Error;
use hrr::geometry::Mesh;
use hrr::image::Image;
use hrr::material::{Maps, Material};
use hrr::math::Spectrum;
use hrr::settings::Backend;
use hrr::texture::Texture;
use hrr::visibility::{Cutouts, Hit, Ray, Visibility, build, build_with_cutouts};
use std::sync::Arc;

/// The backends of this build.
pub const BACKENDS: &[Backend] = if cfg!(feature = "embree") {
    &[Backend::Brute, Backend::Obvhs, Backend::Embree]
} else {
    &[Backend::Brute, Backend::Obvhs]
};

pub fn built(mesh: &Mesh) -> impl Iterator<Item = (Backend, Box<dyn Visibility>)> {
    BACKENDS.iter().map(|&backend| (backend, build(backend, mesh, 1).unwrap()))
}

fn ray(origin: DVec3, direction: DVec3, t_min: f32, t_max: f32) -> Ray {
    Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_min, t_max }
}

/// A ray from within twice the cube, towards it, with an interval that often cuts something off.
fn random_ray(random: &mut Random, scale: f64) -> Ray {
    let (from, to) = (random.in_cube() * 2.0 * scale, random.in_cube() * scale);
    // Lengths of any size: distances count in units of them.
    let direction = (to - from) * 10f64.powf(random.u1() * 4.0 - 2.0);
    let unit = scale / direction.length();
    let t_min = if random.u1() < 0.5 { 0.0 } else { random.u1() * unit };
    let t_max = if random.u1() < 0.5 { f64::INFINITY } else { random.u1() * 4.0 * unit };
    ray(from, direction, t_min as f32, t_max as f32)
}

/// Distance of a ray to a triangle's plane and the least of the barycentric weights there, by plain vector algebra.
fn plane_hit(mesh: &Mesh, triangle: u32, ray: &Ray) -> (f64, f64) {
    let [a, b, c] = mesh.corners(triangle);
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let n = (b - a).cross(c - a);
    let t = (a - o).dot(n) / d.dot(n);
    let p = o + d * t;
    let weight = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).dot(n) / n.length_squared();
    (t, weight(p, a, b).min(weight(p, b, c)).min(weight(p, c, a)))
}

/// How finely `f32` resolves where a ray meets a triangle's plane: in weights and relative to the distance. The
/// triangle's corners seen from the origin, and so its normal and height, are rounded.
fn resolution(mesh: &Mesh, triangle: u32, ray: &Ray) -> (f64, f64) {
    let [a, b, c] = mesh.corners(triangle);
    let n = (b - a).cross(c - a);
    let size = (b - a).length().max((c - a).length()).max((c - b).length());
    let d = ray.direction.as_dvec3();
    let cos = n.dot(d).abs() / (n.length() * d.length());
    let rounding = 16.0 * f64::from(f32::EPSILON) * ((a - ray.origin.as_dvec3()).length() + size);
    let (t, _) = plane_hit(mesh, triangle, ray);
    let slender = size * size / n.length();
    (rounding * slender / size / cos, rounding * slender / cos / (t * d.length()).abs())
}

/// Whether two answers differ only in what rounding may decide: an edge, an end of the interval or a tie.
fn explained(mesh: &Mesh, ray: &Ray, exact: Option<Hit>, other: Option<Hit>) -> bool {
    let doubtful = |hit: &Hit| {
        let (t, least) = plane_hit(mesh, hit.triangle, ray);
        let (weight, distance) = resolution(mesh, hit.triangle, ray);
        least.abs() < weight
            || [ray.t_min, ray.t_max].iter().any(|&end| (t / f64::from(end) - 1.0).abs() < distance)
    };
    let tie = || {
        let (a, b) = (exact?, other?);
        let tolerance = resolution(mesh, a.triangle, ray).1 + resolution(mesh, b.triangle, ray).1;
        Some((f64::from(a.t) / f64::from(b.t) - 1.0).abs() < tolerance)
    };
    // The nearer of the two answers is the one that the other has missed or denied.
    let nearer = [exact, other].into_iter().flatten().min_by(|a, b| a.t.total_cmp(&b.t));
    nearer.as_ref().is_some_and(doubtful) || tie() == Some(true)
}

#[test]
fn backends_agree_on_random_triangles_at_any_scale() {
    let mut random = Random::new(1);
    for (scale, triangles, size) in [(1.0, 500, 0.3), (1.0, 5000, 0.08), (1e-6, 500, 0.3), (1e6, 500, 0.3)] {
        let mesh = moved(soup(&mut random, triangles, size), |p| p * scale);
        let structures: Vec<_> = built(&mesh).collect();
        let (mut hits, mut differing) = (0, 0);
        let rays = 10_000;
        for _ in 0..rays {
            let ray = random_ray(&mut random, scale);
            let exact = structures[0].1.intersect(&ray);
            hits += usize::from(exact.is_some());
            assert_eq!(structures[0].1.occluded(&ray), exact.is_some());
            for (backend, structure) in &structures[1..] {
                let hit = structure.intersect(&ray);
                assert_eq!(structure.occluded(&ray), hit.is_some(), "{backend:?} {ray:?} {hit:?}");
                if hit.map(|h| h.triangle) != exact.map(|h| h.triangle) {
                    differing += 1;
                    assert!(explained(&mesh, &ray, exact, hit), "{backend:?} {ray:?} {exact:?} {hit:?}");
                } else if let (Some(a), Some(b)) = (exact, hit) {
                    let (weight, distance) = resolution(&mesh, a.triangle, &ray);
                    assert!(
                        (f64::from(b.t / a.t) - 1.0).abs() < distance.max(1e-6),
                        "{backend:?} {a:?} {b:?}"
                    );
                    let off = f64::from((a.u - b.u).abs().max((a.v - b.v).abs()));
                    assert!(off < weight.max(1e-6), "{backend:?} {a:?} {b:?}");
                }
            }
        }
        assert!(hits > rays / 10 && hits < rays * 9 / 10, "the rays show little: {hits} hits");
        assert!(differing < rays / 1000, "{differing} rays differ at scale {scale}");
    }
}

#[test]
fn the_tree_gives_exactly_what_trying_every_triangle_gives() {
    // Both use the same triangle test, so only the boxes can be wrong: flat ones, in the planes of axes, hit edge-on.
    let mut random = Random::new(2);
    let grid = cube(8);
    let [brute, tree] = [Backend::Brute, Backend::Obvhs].map(|backend| build(backend, &grid, 1).unwrap());
    let coordinate = |random: &mut Random| (random.u1() * 17.0).floor() / 8.0 - 1.0;
    for _ in 0..20_000 {
        let from =
            DVec3::new(coordinate(&mut random), coordinate(&mut random), coordinate(&mut random)) * 1.5;
        let to = DVec3::new(coordinate(&mut random), coordinate(&mut random), coordinate(&mut random));
        let ray = ray(from, to - from, 0.0, f32::INFINITY);
        let (a, b) = (brute.intersect(&ray), tree.intersect(&ray));
        assert_eq!(a.map(|h| h.t), b.map(|h| h.t), "{ray:?} {a:?} {b:?}");
        assert_eq!(tree.occluded(&ray), a.is_some());
    }
}

#[test]
fn nothing_is_hit_in_an_empty_mesh_or_one_without_area() {
    let line = mesh(&[DVec3::ZERO, DVec3::X, DVec3::X * 2.0], &[[0, 1, 2], [0, 0, 1], [1, 1, 1]]);
    for mesh in [Mesh::default(), line] {
        for (backend, structure) in built(&mesh) {
            for direction in [-DVec3::Z, DVec3::new(0.0, 0.1, -1.0), DVec3::X] {
                let ray = ray(DVec3::new(0.5, 0.0, 1.0), direction, 0.0, f32::INFINITY);
                assert_eq!(structure.intersect(&ray), None, "{backend:?}");
                assert!(!structure.occluded(&ray), "{backend:?}");
            }
        }
    }
}

#[test]
fn one_triangle_is_seen_from_both_sides_within_the_interval() {
    let corners = [DVec3::new(0.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, 4.0, 1.0)];
    let mesh = mesh(&corners, &[[0, 1, 2]]);
    for (backend, structure) in built(&mesh) {
        let target = DVec3::new(0.5, 2.0, 1.0);
        for (side, length) in [(1.0, 1.0), (-1.0, 1.0), (1.0, 8.0), (-1.0, 0.125)] {
            let start = target + DVec3::new(1.0, -1.0, 2.0) * side;
            let at = |t_min, t_max| ray(start, (target - start) / length, t_min, t_max);
            let end = length as f32;
            let hit = structure.intersect(&at(0.0, f32::INFINITY)).unwrap();
            let close = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-6;
            assert!(hit.triangle == 0 && close(hit.u, 0.25) && close(hit.v, 0.5), "{backend:?} {hit:?}");
            assert!(close(hit.t, end), "{backend:?} {hit:?}");
            for (t_min, t_max, expected) in [
                (0.0, 0.99 * end, false),
                (0.0, 1.01 * end, true),
                (0.99 * end, f32::INFINITY, true),
                (1.01 * end, f32::INFINITY, false),
                // The ends themselves do not count.
                (0.0, end, false),
                (end, f32::INFINITY, false),
            ] {
                assert_eq!(structure.occluded(&at(t_min, t_max)), expected, "{backend:?} {t_min}..{t_max}");
                assert_eq!(
                    structure.intersect(&at(t_min, t_max)).is_some(),
                    expected,
                    "{backend:?} {t_min}..{t_max}"
                );
            }
        }
        assert!(!structure.occluded(&ray(DVec3::new(2.0, 2.0, 0.0), DVec3::Z, 0.0, f32::INFINITY)));
    }
}

#[test]
fn no_ray_slips_out_of_a_closed_surface_through_edges_or_vertices() {
    // Embree decides each edge alone, with rounding, so that around a vertex all may say "beyond me": a ray in a
    // thousand of those aimed at nothing but vertices.
    let mut random = Random::new(3);
    let (mut slipped, mut aimed) = (0, 0);
    for shape in [ball(12), cube(3)] {
        let rotation = random.rotation();
        let shape = moved(shape, |p| rotation * p);
        for (backend, structure) in built(&shape) {
            for (i, corners) in shape.triangles.iter().enumerate() {
                let [a, b, c] = corners.map(|v| shape.positions[v as usize].as_dvec3());
                let inside = random.in_cube() * 0.4;
                for (k, target) in [a.lerp(b, 0.5), b.lerp(c, random.u1()), a, b, c].into_iter().enumerate() {
                    // Rounding moves the ray to one side of its target or the other.
                    let ray = ray(inside, target - inside, 0.0, f32::INFINITY);
                    let hit = structure.intersect(&ray);
                    assert_eq!(structure.occluded(&ray), hit.is_some());
                    if k < 2 || backend != Backend::Embree {
                        assert!(hit.is_some(), "{backend:?}, triangle {i}, {ray:?}");
                    } else {
                        aimed += 1;
                        slipped += usize::from(hit.is_none());
                    }
                }
            }
        }
    }
    assert!(slipped * 300 <= aimed, "{slipped} of {aimed} slipped out at vertices");
}

#[test]
fn threads_may_ask_the_same_structure_at_once() {
    let mut random = Random::new(4);
    let mesh = soup(&mut random, 2000, 0.2);
    let rays: Vec<Ray> = (0..4000).map(|_| random_ray(&mut random, 1.0)).collect();
    for &backend in BACKENDS {
        let [one, two] = [1, 2].map(|threads| build(backend, &mesh, threads).unwrap());
        let alone: Vec<Option<Hit>> = rays.iter().map(|ray| one.intersect(ray)).collect();
        std::thread::scope(|scope| {
            let ask = || rays.iter().map(|ray| two.intersect(ray)).collect::<Vec<_>>();
            let workers = [scope.spawn(ask), scope.spawn(ask)];
            for worker in workers {
                assert_eq!(worker.join().unwrap(), alone, "{backend:?}");
            }
        });
    }
}

#[test]
fn broken_meshes_and_missing_backends_are_errors() {
    let mut broken = mesh(&[DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]);
    broken.positions[1] = Vec3::NAN;
    let out_of_range = mesh(&[DVec3::ZERO], &[[0, 0, 1]]);
    for &backend in BACKENDS {
        for mesh in [&broken, &out_of_range] {
            assert!(matches!(build(backend, mesh, 1), Err(Error::Input(_))), "{backend:?}");
        }
    }
    if !cfg!(feature = "embree") {
        let Err(error @ Error::Usage(_)) = build(Backend::Embree, &Mesh::default(), 1) else {
            panic!("Embree is not part of this build");
        };
        assert!(error.to_string().contains("'embree'"), "{error}");
    }
}

#[test]
fn a_triangle_that_is_there_twice_is_hit_once() {
    let mut random = Random::new(7);
    let single = ball(4);
    let mut double = single.clone();
    double.triangles.extend_from_slice(&single.triangles);
    double.materials.extend_from_slice(&single.materials);
    for (&backend, (_, twice)) in BACKENDS.iter().zip(built(&double)) {
        let once = build(backend, &single, 1).unwrap();
        let mut hits = 0;
        for _ in 0..2000 {
            let ray = random_ray(&mut random, 1.0);
            let (a, b) = (once.intersect(&ray), twice.intersect(&ray));
            assert_eq!(a.map(|h| h.t), b.map(|h| h.t), "{backend:?} {ray:?}");
            assert_eq!(once.occluded(&ray), twice.occluded(&ray), "{backend:?} {ray:?}");
            hits += usize::from(a.is_some());
        }
        assert!(hits > 200, "{hits}");
    }
}

/// Checkered holes, and surfaces that are there in part: all backends decide alike, as often as they should.
#[test]
fn cutouts_are_the_same_in_every_backend() {
    let mut random = Random::new(8);
    let mut mesh = soup(&mut random, 2000, 0.15);
    mesh.uvs = mesh.positions.iter().map(|_| random.u2().as_vec2() * 3.0).collect();
    mesh.materials = (0..2000).map(|i| i % 3).collect();
    let opaque = Material::diffuse("opaque", Spectrum::ONE);
    let (mut veil, mut checkered) = (opaque.clone(), opaque.clone());
    veil.opacity = 0.3;
    let pixels = vec![Vec3::ONE, Vec3::ZERO, Vec3::ZERO, Vec3::ONE];
    let map = Texture::new(Arc::new(Image { width: 2, height: 2, pixels }), DVec2::ONE, DVec2::ZERO);
    checkered.set_maps(Maps { opacity: Some(map), ..Maps::default() });
    assert!(Cutouts::new(&mesh, &[opaque.clone(), opaque.clone(), opaque.clone()]).is_none());
    let cutouts = Cutouts::new(&mesh, &[opaque, veil, checkered]).unwrap();
    let built: Vec<_> = BACKENDS
        .iter()
        .map(|&backend| build_with_cutouts(backend, &mesh, Some(cutouts.clone()), 1).unwrap())
        .collect();
    let solid = build(Backend::Brute, &mesh, 1).unwrap();
    let (mut differing, mut stopped, mut met) = (0, [0; 3], [0; 3]);
    let rays = 10_000;
    for _ in 0..rays {
        let ray = random_ray(&mut random, 1.0);
        let answers: Vec<_> = built.iter().map(|b| b.intersect(&ray)).collect();
        for (structure, answer) in built.iter().zip(&answers) {
            assert_eq!(structure.occluded(&ray), answer.is_some(), "{ray:?}");
            differing += usize::from(answer.map(|h| h.triangle) != answers[0].map(|h| h.triangle));
        }
        if let Some(first) = solid.intersect(&ray) {
            let material = mesh.materials[first.triangle as usize] as usize;
            met[material] += 1;
            stopped[material] += usize::from(answers[0].is_some_and(|h| h.triangle == first.triangle));
        }
    }
    assert!(differing < rays / 500, "{differing} of {rays} answers differ");
    let share = [0, 1, 2].map(|m| stopped[m] as f64 / met[m] as f64);
    assert!(
        share[0] == 1.0 && (share[1] - 0.3).abs() < 0.05 && (share[2] - 0.5).abs() < 0.05,
        "{share:?} {met:?}"
    );
}
