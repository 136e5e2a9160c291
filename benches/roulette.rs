//! How fast the roulette is, in ratios measured within one run. `cargo bench --bench roulette [-- <part>...]`.

#[cfg(feature = "embree")]
#[path = "support/against_rays.rs"]
mod against_rays;
#[path = "support/variance.rs"]
mod variance;
#[path = "support/widths/mod.rs"]
mod widths;
#[path = "support/workload.rs"]
mod workload;

use hrr::roulette::{MinimumRandom, Query, QueryCounters, query, query_brute_force};
use hrr::vertex_bvh::VertexBvh;
use workload::{cpu_seconds, eye_vertices, light_vertices};

/// Runs queries and returns (seconds per query, counters).
fn run(bvh: &VertexBvh, queries: &[Query<'_>], brute: bool) -> (f64, QueryCounters) {
    let mut stats = QueryCounters::default();
    let mut sum = 0.0;
    let start = cpu_seconds();
    for q in queries {
        if brute {
            query_brute_force(bvh, q, &mut stats, &mut |_, p| sum += 1.0 / p);
        } else {
            query(bvh, q, &mut stats, &mut |_, p| sum += 1.0 / p);
        }
    }
    let seconds = (cpu_seconds() - start) / queries.len() as f64;
    std::hint::black_box(sum);
    (seconds, stats)
}

/// Repetitions of which the fastest counts.
const RUNS: usize = 25;

/// The best of some runs: what the code needs, without what the neighbours took.
fn best(bvh: &VertexBvh, queries: &[Query<'_>]) -> (f64, QueryCounters) {
    (0..RUNS).map(|_| run(bvh, queries, false)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

fn row(name: &str, (seconds, s): (f64, QueryCounters)) {
    let n = s.queries as f64;
    println!(
        "{name:34} {:8.2} us/query {:7.1} visits {:6.1} ns/visit {:7.2} candidates {:6.2} accepted",
        seconds * 1e6,
        s.nodes as f64 / n,
        seconds * 1e9 * n / s.nodes as f64,
        s.leaves as f64 / n,
        s.accepted as f64 / n
    );
}

fn visits() {
    println!("-- one visit, one query (1e6 vertices)");
    let points = light_vertices(1_000_000);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    for (ax, ay, k) in [
        (1e-4, 1e-4, 1.0),
        (1e-4, 1e-4, 20.0),
        (1e-4, 1e-2, 1.0),
        (1e-2, 1e-2, 1.0),
        (1e-6, 1e-6, 1.0),
        (0.1, 0.1, 1.0),
    ] {
        let eyes = eye_vertices(20_000, ax, ay);
        let c = hrr::roulette::constant_for(k, 24.0, points.len());
        let queries: Vec<_> = eyes.iter().map(|e| Query::new(e.position, &e.lobes, c, e.key)).collect();
        row(&format!("alpha ({ax:e}, {ay:e}) k {k}"), best(&bvh, &queries));
    }
    let eyes = eye_vertices(20_000, 1e-4, 1e-4);
    let c = hrr::roulette::constant_for(1.0, 24.0, points.len());
    for rule in [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact] {
        let queries: Vec<_> =
            eyes.iter().map(|e| Query { rule, ..Query::new(e.position, &e.lobes, c, e.key) }).collect();
        row(&format!("{rule:?}"), best(&bvh, &queries));
    }
}

fn against_testing_all() {
    println!("-- against testing all (1e6 vertices, about 8 accepted)");
    let points = light_vertices(1_000_000);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    let eyes = eye_vertices(20_000, 1e-2, 1e-2);
    let c = hrr::roulette::constant_for(1.9, 24.0, points.len());
    let queries: Vec<_> = eyes.iter().map(|e| Query::new(e.position, &e.lobes, c, e.key)).collect();
    let tree = best(&bvh, &queries);
    row("tree", tree);
    let brute = run(&bvh, &queries[..20], true);
    row("all", brute);
    println!("ratio {:.0}", brute.0 / tree.0);
}

fn growth() {
    println!("-- growth from 1e4 to 1e7 vertices at an equal number of accepted");
    let mut first = None;
    for n in [10_000, 100_000, 1_000_000, 10_000_000] {
        let points = light_vertices(n);
        let mut bvh = VertexBvh::new();
        bvh.build(&points).unwrap();
        // A lobe's footprint holds the same number of vertices.
        let alpha = 1e-1 / (n as f64).sqrt();
        let eyes = eye_vertices(20_000, alpha, alpha);
        let c = hrr::roulette::constant_for(1.0, 24.0, n);
        let queries: Vec<_> = eyes.iter().map(|e| Query::new(e.position, &e.lobes, c, e.key)).collect();
        let measured = best(&bvh, &queries);
        row(&format!("{n} vertices, alpha {alpha:.1e}"), measured);
        let base = *first.get_or_insert(measured.0);
        println!("ratio {:.2}", measured.0 / base);
    }
}

fn overhead() {
    println!("-- what a query costs before its visits");
    for n in [1, 8, 9, 64, 512, 4096] {
        let points = light_vertices(n);
        let mut bvh = VertexBvh::new();
        bvh.build(&points).unwrap();
        let eyes = eye_vertices(20_000, 1e-6, 1e-6);
        let queries: Vec<_> = eyes.iter().map(|e| Query::new(e.position, &e.lobes, 1e-9, e.key)).collect();
        row(&format!("{n} vertices"), best(&bvh, &queries));
    }
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let parts: [(&str, fn()); _] = [
        #[cfg(feature = "embree")]
        ("rays", against_rays::rays),
        ("overhead", overhead),
        ("visits", visits),
        ("all", against_testing_all),
        ("growth", growth),
        ("rules", variance::rules),
        ("ranges", variance::ranges),
        ("widths", widths::widths),
    ];
    for (name, part) in parts {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            part();
        }
    }
}
