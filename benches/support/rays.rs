//! A scene of many triangles and rays in it, as a renderer would trace them.

use glam::DVec3;
use hrr::geometry::{Mesh, SurfacePoint};
use hrr::sampler::counter::{combine, unit};
use hrr::visibility::{Ray, Visibility, offset};

/// Rays of each kind.
const RAYS: usize = 400_000;

/// A rough ball in the middle of a room: `n` triangles in all.
pub fn scene(n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let side = ((n / 2) as f64).sqrt() as u32;
    let mut sheet = |place: &dyn Fn(f64, f64) -> DVec3, side: u32| {
        let first = mesh.positions.len() as u32;
        let step = 1.0 / f64::from(side);
        for j in 0..=side {
            mesh.positions
                .extend((0..=side).map(|i| place(f64::from(i) * step, f64::from(j) * step).as_vec3()));
        }
        for j in 0..side {
            for a in (0..side).map(|i| first + j * (side + 1) + i) {
                mesh.triangles.extend([[a, a + 1, a + side + 1], [a + 1, a + side + 2, a + side + 1]]);
            }
        }
    };
    let ball = |u: f64, v: f64| {
        let (phi, theta) = (u * std::f64::consts::TAU, v * std::f64::consts::PI);
        let rough = 1.0 + 0.1 * (40.0 * phi).sin() * (30.0 * theta).sin() + 0.03 * (300.0 * phi).sin();
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()) * rough
    };
    sheet(&ball, side);
    for axis in 0..3 {
        for sign in [-3.0, 3.0] {
            let wall = move |u: f64, v: f64| {
                let mut p = DVec3::splat(sign);
                p[(axis + 1) % 3] = u * 6.0 - 3.0;
                p[(axis + 2) % 3] = v * 6.0 - 3.0;
                p
            };
            sheet(&wall, 1);
        }
    }
    mesh.materials = vec![0; mesh.triangles.len()];
    mesh
}

/// Camera rays in order, rays that go on from where those hit, and shadow rays between such points.
pub fn workloads(mesh: &Mesh, tracer: &dyn Visibility) -> [(&'static str, Vec<Ray>); 3] {
    let mut state = 0;
    let mut random = || {
        state = combine(state, 1);
        unit(state)
    };
    let side = (RAYS as f64).sqrt() as usize;
    let eye = DVec3::new(0.3, -2.9, 0.2);
    let camera: Vec<(DVec3, Ray)> = (0..side * side)
        .map(|i| {
            let [x, y] = [i % side, i / side].map(|k| (k as f64 + random()) / side as f64 * 1.2 - 0.6);
            let direction = DVec3::new(x, 1.0, y).normalize();
            (direction, offset::from_free_point(eye, direction))
        })
        .collect();
    let points: Vec<(DVec3, SurfacePoint)> = camera
        .iter()
        .map(|&(direction, ray)| {
            let hit = tracer.intersect(&ray).expect("the room is closed");
            let (u, v) = (f64::from(hit.u), f64::from(hit.v));
            (direction, SurfacePoint::at_ray(mesh, hit.triangle, u, v, eye, direction))
        })
        .collect();
    let mut scattered = || {
        let z = 2.0 * random() - 1.0;
        let (sin, cos) = (random() * std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    };
    let onwards = points
        .iter()
        .map(|(from, p)| offset::leave(p, (p.ng * -from.dot(p.ng).signum() + scattered()).normalize()))
        .collect();
    let between = (0..points.len())
        .map(|i| offset::between(&points[i].1, &points[(random() * points.len() as f64) as usize].1))
        .collect();
    let camera = camera.into_iter().map(|(_, ray)| ray).collect();
    [("camera", camera), ("scattered", onwards), ("shadow", between)]
}
