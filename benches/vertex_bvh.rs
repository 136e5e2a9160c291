//! How long the tree over light vertices takes to build, against obvhs and Embree's Morton builder on the same points
//! in the same run; and how fast it finds the vertices within a radius, against a hash grid.
//!
//! `cargo bench --bench vertex_bvh -- [build|within]`

#[cfg(feature = "embree")]
#[path = "support/embree_builder.rs"]
mod embree_builder;

#[path = "support/hash_grid.rs"]
mod hash_grid;
#[path = "support/workload.rs"]
#[expect(dead_code, reason = "the roulette's queries are not timed here")]
mod workload;

use hrr::vertex_bvh::VertexBvh;
use obvhs::aabb::Aabb;
use obvhs::ploc::PlocBuilder;
use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Repetitions of which the fastest counts.
const RUNS: usize = 15;

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let run = |name: &str| args.is_empty() || args[0] == name;
    if run("build") {
        build();
    }
    if run("within") {
        within();
    }
}

/// Points of one set around points of another, as light vertices around eye vertices, all threads.
fn within() {
    let n = 1_000_000;
    let points = workload::light_vertices(n);
    let centers: Vec<_> = workload::light_vertices(2 * n)[n..].iter().map(|p| p.as_dvec3()).collect();
    for radius in [0.0005, 0.002, 0.008] {
        let mut times = [[f64::INFINITY; 2]; 2];
        let (mut tree, mut found) = (VertexBvh::new(), [0; 2]);
        for _ in 0..5 {
            let mut grid = None;
            let built = [
                seconds(|| tree.build(&points).unwrap()),
                seconds(|| grid = Some(hash_grid::HashGrid::new(&points, radius))),
            ];
            let grid = grid.as_ref().expect("it was made");
            let count = |query: &(dyn Fn(glam::DVec3, &mut u64) + Sync)| {
                let each = |center: &glam::DVec3| {
                    let mut sum = 0;
                    query(*center, &mut sum);
                    sum
                };
                centers.par_iter().map(each).sum::<u64>()
            };
            let asked = [
                seconds(|| found[0] = count(&|c, sum| tree.within(c, radius, &mut |_| *sum += 1))),
                seconds(|| found[1] = count(&|c, sum| grid.within(c, radius, &mut |_| *sum += 1))),
            ];
            for i in 0..2 {
                times[i] = [times[i][0].min(built[i]), times[i][1].min(asked[i])];
            }
        }
        assert_eq!(found[0], black_box(found[1]), "both find the same");
        println!("radius {radius}: {:.3} found on average", found[0] as f64 / n as f64);
        for (name, [build, ask]) in ["tree", "hash grid"].iter().zip(times) {
            println!(
                "    {name:10} build {:6.1} ns/vertex, query {:7.1} ns",
                build * 1e9 / n as f64,
                ask * 1e9 / n as f64
            );
        }
    }
}

fn build() {
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
