//! Rays per second of the visibility backends, and of bare Embree calls on the same rays.
//! `cargo bench --bench visibility [-- MILLIONS_OF_TRIANGLES]`, one thread.

#[cfg(feature = "embree")]
#[path = "support/bare_embree.rs"]
mod bare_embree;
#[path = "support/rays.rs"]
mod rays;

use hrr::settings::Backend;
use hrr::visibility::{Ray, build};
use rays::{scene, workloads};
use std::time::Instant;

/// Repetitions of which the fastest counts.
const RUNS: usize = 3;

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
