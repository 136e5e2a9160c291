//! How long the tree over light vertices takes to build, against obvhs and Embree's Morton builder on the same points
//! in the same run. `cargo bench --bench vertex_bvh`.

#[cfg(feature = "embree")]
#[path = "support/embree_builder.rs"]
mod embree_builder;

#[path = "support/workload.rs"]
#[expect(dead_code, reason = "queries are not timed here")]
mod workload;

use hrr::vertex_bvh::VertexBvh;
use obvhs::aabb::Aabb;
use obvhs::ploc::PlocBuilder;
use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2};
use std::time::{Duration, Instant};

/// Repetitions of which the fastest counts.
const RUNS: usize = 15;

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn main() {
    for n in [10_000, 100_000, 1_000_000, 4_000_000] {
        let points = workload::light_vertices(n);
        let boxes: Vec<_> = points.iter().map(|&p| Aabb::from_point(p.into())).collect();
        let indices: Vec<_> = (0..n as u32).collect();
        let mut ours = VertexBvh::new();
        let params = BvhBuildParams::fastest_build();
        #[cfg(feature = "embree")]
        let (mut embree, given) = (embree_builder::Builder::new(), embree_builder::primitives(&points));
        let mut best = [f64::INFINITY; 4];
        for _ in 0..if n > 1_000_000 { 3 } else { RUNS } {
            let copy = indices.clone();
            #[cfg(feature = "embree")]
            let mut given = given.clone();
            let times = [
                seconds(|| ours.build(&points).unwrap()),
                seconds(|| {
                    std::hint::black_box(PlocBuilder::with_capacity(n).build(
                        params.ploc_search_distance,
                        &boxes,
                        copy,
                        params.sort_precision,
                        0,
                    ));
                }),
                seconds(|| {
                    std::hint::black_box(build_bvh2(&boxes, params, &mut Duration::default()));
                }),
                #[cfg(feature = "embree")]
                seconds(|| embree.build(&mut given)),
                #[cfg(not(feature = "embree"))]
                f64::NAN,
            ];
            for (b, t) in best.iter_mut().zip(times) {
                *b = b.min(t); // infinite where NaN
            }
        }
        let ns = best.map(|b| b * 1e9 / n as f64);
        println!(
            "{n:9} vertices, {} threads: ours {:6.1} ns/vertex ({:4.1} B/vertex)",
            rayon::current_num_threads(),
            ns[0],
            ours.bytes() as f64 / n as f64,
        );
        for (name, ns_other) in ["obvhs PLOC", "obvhs fastest_build", "Embree Morton"].iter().zip(&ns[1..]) {
            println!("    {name:20} {ns_other:6.1} ns/vertex ({:.2}x)", ns_other / ns[0]);
        }
    }
}
