//! Rays per second of the visibility backends, and of bare Embree calls on the same rays.
//! `cargo bench --bench visibility [-- MILLIONS_OF_TRIANGLES]`, one thread.

#[cfg(feature = "embree")]
#[path = "support/bare_embree.rs"]
mod bare_embree;

use glam::DVec3;
use hrr::geometry::{Mesh, SurfacePoint};
use hrr::sampler::counter::{combine, unit};
use hrr::settings::Backend;
use hrr::visibility::{Ray, Visibility, build, offset};
use std::time::Instant;

const RAYS: usize = 400_000;
/// Repetitions of which the fastest counts.
const RUNS: usize = 3;

/// A rough ball in the middle of a room: `n` triangles in all.
fn scene(n: usize) -> Mesh {
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
fn workloads(mesh: &Mesh, tracer: &dyn Visibility) -> [(&'static str, Vec<Ray>); 3] {
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

/// Millions a second, and how many found something.
fn rate(rays: &[Ray], ask: impl Fn(&Ray) -> bool) -> (f64, usize) {
    let mut best = (0.0, 0);
    for _ in 0..RUNS {
        let start = Instant::now();
        let found = rays.iter().filter(|ray| ask(ray)).count();
        let rate = rays.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
        best = if rate > best.0 { (rate, found) } else { best };
    }
    best
}

fn main() {
    let millions: f64 = std::env::args().filter_map(|a| a.parse().ok()).next().unwrap_or(1.0);
    let mesh = scene((millions * 1e6) as usize);
    println!(
        "{} triangles; millions of rays a second, nearest / any; in brackets: share that hits",
        mesh.triangles.len()
    );
    let reference = build(Backend::Obvhs, &mesh, 1).unwrap();
    let workloads = workloads(&mesh, &*reference);
    let report =
        |name: &str, seconds: f64, intersect: &dyn Fn(&Ray) -> bool, occluded: &dyn Fn(&Ray) -> bool| {
            print!("{name:12} built in {seconds:5.2} s");
            for (what, rays) in &workloads {
                let ((nearest, hits), (any, blocked)) = (rate(rays, intersect), rate(rays, occluded));
                print!(
                    "  {what} {nearest:5.2} / {any:5.2} ({:.4}, {:.4})",
                    share(hits, rays),
                    share(blocked, rays)
                );
            }
            println!();
        };
    let backends: &[Backend] =
        if cfg!(feature = "embree") { &[Backend::Embree, Backend::Obvhs] } else { &[Backend::Obvhs] };
    for &backend in backends {
        let start = Instant::now();
        let structure = build(backend, &mesh, 1).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let name = format!("{backend:?}");
        report(&name, seconds, &|ray| structure.intersect(ray).is_some(), &|ray| structure.occluded(ray));
    }
    #[cfg(feature = "embree")]
    {
        let start = Instant::now();
        let bare = bare_embree::Bare::new(&mesh);
        let seconds = start.elapsed().as_secs_f64();
        report("bare Embree", seconds, &|ray| bare.intersect(ray), &|ray| bare.occluded(ray));
    }
}

fn share(count: usize, rays: &[Ray]) -> f64 {
    count as f64 / rays.len() as f64
}
