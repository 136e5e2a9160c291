//! Rays that leave surfaces and join them: the one offset policy, on every backend and at every scale.

use crate::support::Random;
use crate::support::shapes::{ball, cube, mesh, moved, wedge};
use crate::visibility::{BACKENDS, built};
use glam::{DVec2, DVec3};
use hrr::geometry::{Mesh, SurfacePoint};
use hrr::visibility::{build, offset};

const SCALES: [f64; 3] = [1e-6, 1.0, 1e6];

/// A triangle somewhere in the cube [-1,1]^3: of any size, compact or as thin as a needle or a leaf's cross-section.
fn random_triangle(random: &mut Random) -> [DVec3; 3] {
    let size = 10f64.powf(-4.0 * random.u1());
    let height = size * 10f64.powf(-3.0 * random.u1());
    let center = random.in_cube();
    let along = random.direction();
    let across = along.cross(random.direction()).normalize();
    if random.u1() < 0.5 {
        [center - across * height, center + across * height, center + along * size]
    } else {
        let apex = center + across * height + along * size * (random.u1() - 0.5);
        [center - along * size, center + along * size, apex]
    }
}

#[test]
fn a_ray_never_hits_the_triangle_that_it_leaves() {
    let mut random = Random::new(1);
    for scale in SCALES {
        for _ in 0..1000 {
            let mesh = mesh(&random_triangle(&mut random).map(|p| p * scale), &[[0, 1, 2]]);
            for (backend, structure) in built(&mesh) {
                for _ in 0..20 {
                    let point = random.surface_point(&mesh, 0.0);
                    let direction = random.grazing(point.ng, 1e-7);
                    let ray = offset::leave(&point, direction);
                    let hit = structure.intersect(&ray);
                    assert_eq!(
                        hit,
                        None,
                        "{backend:?} {scale} {point:?} {direction:?} cos {}",
                        direction.dot(point.ng)
                    );
                    assert!(!structure.occluded(&ray));
                }
            }
        }
    }
}

#[test]
fn two_points_with_nothing_between_them_see_each_other() {
    let mut random = Random::new(2);
    for scale in SCALES {
        for _ in 0..1000 {
            let corners = [random_triangle(&mut random), random_triangle(&mut random)].concat();
            let corners: Vec<DVec3> = corners.into_iter().map(|p| p * scale).collect();
            let mesh = mesh(&corners, &[[0, 1, 2], [3, 4, 5]]);
            for (backend, structure) in built(&mesh) {
                for _ in 0..20 {
                    let [a, b] = [0, 1].map(|triangle| {
                        let b = random.barycentric();
                        SurfacePoint::at_barycentric(&mesh, triangle, b.x, b.y)
                    });
                    for ray in [offset::between(&a, &b), offset::between(&b, &a)] {
                        assert!(!structure.occluded(&ray), "{backend:?} {scale} {a:?} {b:?}");
                    }
                    // From anywhere off the triangles, unless the other one is in the way.
                    let free = a.position + random.direction() * scale;
                    let seen = (free - a.position).dot(a.ng).abs() > 1e-3 * scale;
                    let blocked = structure.intersect(&offset::free_to_surface(free, &a));
                    assert!(!seen || blocked.is_none_or(|hit| hit.triangle == 1), "{backend:?} {free} {a:?}");
                }
            }
        }
    }
}

#[test]
fn triangles_of_all_sizes_in_one_plane_are_free_of_each_other() {
    // Coordinates of few bits: the plane x + y + z = 0 is exact in f32. Neighbours differ in size by up to 2^20.
    let mut coordinates: Vec<f64> =
        (0..=20).step_by(2).flat_map(|k| [1.0, -1.0].map(|s| s * 0.5f64.powi(k))).collect();
    coordinates.push(0.0);
    coordinates.sort_by(f64::total_cmp);
    let n = coordinates.len() as u32;
    let plane = |(x, y)| DVec3::new(x, y, -x - y);
    let positions: Vec<DVec3> =
        coordinates.iter().flat_map(|&y| coordinates.iter().map(move |&x| plane((x, y)))).collect();
    let squares = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
    let triangles: Vec<[u32; 3]> =
        squares.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]).collect();
    let mesh = mesh(&positions, &triangles);
    let mut random = Random::new(3);
    for (backend, structure) in built(&mesh) {
        for triangle in 0..triangles.len() as u32 {
            for _ in 0..50 {
                // Often close to an edge.
                let near = DVec2::new(1e-6f64.powf(random.u1()), 1e-6f64.powf(random.u1()));
                let b = random.barycentric() * near;
                let point = SurfacePoint::at_barycentric(&mesh, triangle, b.x, b.y);
                let ray = offset::leave(&point, random.grazing(point.ng, 1e-6));
                assert_eq!(structure.intersect(&ray), None, "{backend:?} {point:?}");
            }
        }
    }
}

/// Closed shapes, turned: what is inside cannot see what is outside. The first two are convex with edges of more than
/// and exactly 90 degrees; in the last ones, edges are as sharp as 30 and 3 degrees.
fn closed_shapes(random: &mut Random) -> Vec<Mesh> {
    let turned = |shape: Mesh, random: &mut Random| {
        let rotation = random.rotation();
        moved(shape, |p| rotation * p)
    };
    [ball(10), cube(4), wedge(0.3), wedge(0.025)].map(|shape| turned(shape, random)).into()
}

#[test]
fn nothing_gets_out_of_a_closed_surface_or_into_it() {
    let mut random = Random::new(4);
    for scale in SCALES {
        for (number, shape) in closed_shapes(&mut random).into_iter().enumerate() {
            let shape = moved(shape, |p| p * scale);
            for (backend, structure) in built(&shape) {
                for _ in 0..3000 {
                    // Inside a sharp edge there is no room for a shift.
                    let margin = if number < 2 { 0.0 } else { 1e-4 };
                    let (a, b) = (random.surface_point(&shape, margin), random.surface_point(&shape, margin));
                    // The front faces are outside.
                    let out = random.grazing(a.ng, 1e-7);
                    let out = out * 1f64.copysign(out.dot(a.ng));
                    let what = || format!("{backend:?} shape {number} scale {scale} {a:?} {out:?}");
                    let (leaving, staying) = (offset::leave(&a, out), offset::leave(&a, -out));
                    assert!(!structure.occluded(&leaving), "{}", what());
                    assert!(structure.intersect(&staying).is_some(), "{}", what());
                    assert!(structure.occluded(&staying), "{}", what());
                    // Across a convex inside, all see each other, but nobody sees through a wall.
                    if (b.position - a.position).dot(a.ng) < -10.0 * a.error {
                        assert!(!structure.occluded(&offset::between(&a, &b)), "{} {b:?}", what());
                        let outside = b.position + b.ng * scale;
                        let ray = offset::free_to_surface(outside, &a);
                        let through = (outside - a.position).dot(a.ng) < -10.0 * a.error;
                        assert!(structure.occluded(&ray) || !through, "{} {outside}", what());
                    }
                }
            }
        }
    }
}

#[test]
fn two_planes_that_nearly_touch_are_two() {
    let mut random = Random::new(5);
    for scale in SCALES {
        for _ in 0..200 {
            let rotation = random.rotation();
            let center = random.in_cube();
            let sheet = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
            let place = |p: DVec3, height: f64| (center + rotation * (p + DVec3::Z * height)) * scale;
            let lower = mesh(&sheet.map(|p| place(p, 0.0)), &[[0, 1, 2]]);
            let error = SurfacePoint::at_barycentric(&lower, 0, 0.3, 0.3).error / scale;
            // Twice the shift, for the rounding of the sheets' own corners.
            let both: Vec<DVec3> =
                [0.0, 6.0 * error].iter().flat_map(|&h| sheet.map(|p| place(p, h))).collect();
            let mesh = mesh(&both, &[[0, 1, 2], [3, 4, 5]]);
            for &backend in BACKENDS {
                let structure = build(backend, &mesh, 1).unwrap();
                for _ in 0..20 {
                    let b = random.barycentric() * 0.8 + 0.05;
                    let [low, high] =
                        [0, 1].map(|triangle| SurfacePoint::at_barycentric(&mesh, triangle, b.x, b.y));
                    let up = random.grazing(low.ng, 1e-3);
                    let up = up * 1f64.copysign(up.dot(low.ng));
                    assert!(
                        !structure.occluded(&offset::between(&low, &high)),
                        "{backend:?} {low:?} {high:?}"
                    );
                    let hit = structure.intersect(&offset::leave(&low, up));
                    assert!(hit.is_some_and(|hit| hit.triangle == 1), "{backend:?} {hit:?} {low:?} {up:?}");
                    let hit = structure.intersect(&offset::leave(&high, -up));
                    assert!(hit.is_some_and(|hit| hit.triangle == 0), "{backend:?} {hit:?} {high:?} {up:?}");
                    assert!(!structure.occluded(&offset::leave(&high, up)), "{backend:?} {high:?} {up:?}");
                }
            }
        }
    }
}
