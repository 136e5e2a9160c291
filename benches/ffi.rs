//! What a query through the C interface costs beside one through the Rust interface: `cargo bench --bench ffi`.
//!
//! Both are measured in turn, many times, and compared pair by pair, so that what else the machine does hits both.

#![allow(unsafe_code)]

#[path = "support/workload.rs"]
mod workload;

use hrr::ffi::*;
use hrr::roulette::{Query, QueryCounters, query};
use hrr::vertex_bvh::VertexBvh;
use std::ptr::{null, null_mut};
use workload::{EyeVertex, cpu_seconds, eye_vertices, light_vertices};

const CONSTANT_K: f64 = 1.0;
const PAIRS: usize = 201;

fn zeroed<T: Copy>() -> T {
    // SAFETY: used for the interface's plain structs of integers, floats and nullable pointers.
    unsafe { std::mem::zeroed() }
}

fn ok(status: HrrStatus) {
    assert_eq!(status, HRR_OK);
}

/// A context and a cache of the vertices.
fn cache(points: &[glam::Vec3]) -> (*mut HrrContext, *mut HrrCache) {
    let (mut context, mut cache) = (null_mut(), null_mut());
    let mut segment: HrrSegment = zeroed();
    (segment.position, segment.count) = (points.as_ptr().cast(), points.len() as u64);
    let mut desc: HrrBuildDesc = zeroed();
    desc.struct_size = size_of::<HrrBuildDesc>() as u32;
    (desc.segments, desc.segment_count) = (&raw const segment, 1);
    // SAFETY: locals, and an array of the size given.
    unsafe {
        ok(hrr_context_new(null(), &mut context));
        ok(hrr_cache_build(context, &desc, &mut cache));
    }
    (context, cache)
}

fn in_rust(bvh: &VertexBvh, eyes: &[EyeVertex], constant: f64) -> (f64, u64) {
    let (mut did, mut hits) = (QueryCounters::default(), Vec::with_capacity(4096));
    let start = cpu_seconds();
    for eye in eyes {
        hits.clear();
        let ask = Query::new(eye.position, &eye.lobes, constant, eye.key);
        query(bvh, &ask, &mut did, &mut |id, probability| {
            hits.push(HrrHit { id: id.into(), probability });
        });
        std::hint::black_box(&hits);
    }
    (cpu_seconds() - start, did.accepted)
}

fn in_c(cache: *const HrrCache, eyes: &[EyeVertex], lobes: &[[HrrLobe; 1]], constant: f64) -> (f64, u64) {
    let mut hits = vec![HrrHit { id: 0, probability: 0.0 }; 4096];
    let (mut count, mut did) = (0, HrrCounters::default());
    let start = cpu_seconds();
    for (eye, lobes) in eyes.iter().zip(lobes) {
        let ask = HrrQuery {
            position: eye.position.to_array(),
            lobes: lobes.as_ptr(),
            lobe_count: 1,
            mask: u32::MAX,
            constant,
            key: eye.key,
        };
        let (at, room) = (hits.as_mut_ptr(), hits.len() as u64);
        // SAFETY: locals of the sizes given, and a live cache.
        ok(unsafe { hrr_query(cache, &ask, null(), at, room, &mut count, &mut did) });
        std::hint::black_box(&hits);
    }
    (cpu_seconds() - start, did.accepted)
}

fn main() {
    println!(
        "{:>9} {:>8} {:>10} {:>10} {:>9}  (median of {PAIRS} pairs)",
        "vertices", "alpha", "Rust us", "C us", "C / Rust"
    );
    for (n, alpha) in [(10_000, 1e-3), (1_000_000, 1e-4), (1_000_000, 1e-2)] {
        let points = light_vertices(n);
        let constant = CONSTANT_K * 24.0 / n as f64;
        let eyes = eye_vertices(2000, alpha, alpha);
        let lobes: Vec<[HrrLobe; 1]> = eyes.iter().map(|eye| eye.lobes.map(HrrLobe::from)).collect();
        let mut bvh = VertexBvh::new();
        bvh.build(&points).unwrap();
        let (context, cache) = cache(&points);
        let mut pairs: Vec<(f64, f64, f64)> = (0..PAIRS)
            .map(|_| {
                let (rust, found) = in_rust(&bvh, &eyes, constant);
                let (c, same) = in_c(cache, &eyes, &lobes, constant);
                assert_eq!(found, same);
                (c / rust, rust, c)
            })
            .collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (ratio, rust, c) = pairs[PAIRS / 2];
        let us = |seconds: f64| seconds / eyes.len() as f64 * 1e6;
        println!("{n:9} {alpha:8.0e} {:10.3} {:10.3} {ratio:9.3}", us(rust), us(c));
        // SAFETY: the references of `cache`.
        unsafe {
            hrr_cache_release(cache);
            hrr_context_release(context);
        }
    }
}
