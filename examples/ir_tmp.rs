#[path = "../benches/support/workload.rs"]
mod workload;
use hrr::roulette::*;
use hrr::vertex_bvh::VertexBvh;
use workload::*;
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let points = light_vertices(n);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    let a = 0.1 / (n as f64).sqrt();
    let eyes = eye_vertices(2000, a, a);
    let c = constant_for(1.0, 24.0, n);
    let mut s = QueryCounters::default();
    for e in &eyes {
        query(&bvh, &Query::new(e.position, &e.lobes, c, e.key), &mut s, &mut |_, _| ());
    }
    println!("{s:?}");
}
