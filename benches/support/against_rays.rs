//! A query's time in units of raw shadow rays: both in one run, in turn, by the processor time of the thread.

#[path = "bare_embree.rs"]
#[expect(dead_code, reason = "only occlusion is timed here")]
mod bare_embree;
#[path = "rays.rs"]
mod rays;

use crate::workload::{cpu_seconds, eye_vertices, light_vertices};
use crate::{RUNS, run};
use hrr::roulette::{Query, constant_for};
use hrr::settings::Backend;
use hrr::vertex_bvh::VertexBvh;

/// Incoherent shadow rays through a scene of a million triangles against queries of about 15 visits and of more.
pub fn rays() {
    println!("-- queries against raw shadow rays of Embree (1e6 triangles)");
    let mesh = rays::scene(1_000_000);
    let tracer = hrr::visibility::build(Backend::Obvhs, &mesh, 1).unwrap();
    let [_, _, (_, shadow)] = rays::workloads(&mesh, &*tracer);
    let embree = bare_embree::Bare::new(&mesh);
    for (n, alpha, k) in [(10_000, 1e-3, 2.0), (1_000_000, 1e-4, 1.0), (1_000_000, 1e-4, 20.0)] {
        let mut bvh = VertexBvh::new();
        bvh.build(&light_vertices(n)).unwrap();
        let eyes = eye_vertices(20_000, alpha, alpha);
        let c = constant_for(k, 24.0, n);
        let queries: Vec<_> = eyes.iter().map(|e| Query::new(e.position, &e.lobes, c, e.key)).collect();
        let (mut ray, mut query, mut stats) = (f64::INFINITY, f64::INFINITY, Default::default());
        for turn in 0..RUNS {
            let some = &shadow[turn * 10_000 % shadow.len()..][..10_000];
            let start = cpu_seconds();
            std::hint::black_box(some.iter().filter(|ray| embree.occluded(ray)).count());
            ray = ray.min((cpu_seconds() - start) / some.len() as f64);
            let seconds;
            (seconds, stats) = run(&bvh, &queries, false);
            query = query.min(seconds);
        }
        let visits = stats.nodes as f64 / stats.queries as f64;
        println!(
            "{n} vertices, alpha {alpha:e}, k {k}: {:.3} us/query, {visits:.1} visits, {:.2} accepted; {:.3} us/ray; \
             a query costs {:.2} rays, a visit {:.3}",
            query * 1e6,
            stats.accepted as f64 / stats.queries as f64,
            ray * 1e6,
            query / ray,
            query / visits / ray
        );
    }
}
