//! What a query through the C interface costs beside one through the Rust interface: `cargo bench --bench ffi`.
//!
//! Both are measured in turn, many times, and compared pair by pair, so that what else the machine does hits both.

#![allow(unsafe_code)]

#[path = "support/workload.rs"]
mod workload;

use hrr::ffi::*;
use hrr::math::Frame;
use hrr::roulette::{Lobe, Query, QueryCounters, query};
use hrr::vertex_bvh::VertexBvh;
use std::borrow::Borrow;
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

/// An eye vertex' lobe as numbers: what an application has before either interface.
#[derive(Clone, Copy)]
struct Numbers {
    frame: Frame,
    alpha: (f64, f64),
    weight: f64,
}

impl Numbers {
    fn of(lobe: &Lobe) -> Self {
        Self { frame: *lobe.frame(), alpha: lobe.alpha(), weight: lobe.weight() }
    }

    fn in_rust(&self) -> Lobe {
        Lobe::new(self.frame, self.alpha.0, self.alpha.1, self.weight)
    }

    fn in_c(&self) -> HrrLobe {
        let [x, y, z] = [self.frame.x, self.frame.y, self.frame.z].map(|v| v.to_array());
        HrrLobe { x, y, z, alpha_x: self.alpha.0, alpha_y: self.alpha.1, weight: self.weight }
    }
}

/// Time and hits of all queries; `lobe` gives or makes that of the i-th.
#[inline(always)]
fn in_rust<L: Borrow<Lobe>>(
    bvh: &VertexBvh,
    eyes: &[EyeVertex],
    constant: f64,
    lobe: impl Fn(usize) -> L,
) -> (f64, u64) {
    let (mut did, mut hits) = (QueryCounters::default(), Vec::with_capacity(4096));
    let start = cpu_seconds();
    for (i, eye) in eyes.iter().enumerate() {
        hits.clear();
        let lobe = lobe(i);
        let ask = Query::new(eye.position, std::slice::from_ref(lobe.borrow()), constant, eye.key);
        query(bvh, &ask, &mut did, &mut |id, probability| {
            hits.push(HrrHit { id: id.into(), probability });
        });
        std::hint::black_box(&hits);
    }
    (cpu_seconds() - start, did.accepted)
}

/// The same through C.
#[inline(always)]
fn in_c<L: Borrow<HrrLobe>>(
    cache: *const HrrCache,
    eyes: &[EyeVertex],
    constant: f64,
    lobe: impl Fn(usize) -> L,
) -> (f64, u64) {
    let mut hits = vec![HrrHit { id: 0, probability: 0.0 }; 4096];
    let (mut count, mut did) = (0, HrrCounters::default());
    let start = cpu_seconds();
    for (i, eye) in eyes.iter().enumerate() {
        let lobe = lobe(i);
        let ask = HrrQuery {
            position: eye.position.to_array(),
            lobes: lobe.borrow(),
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

/// The median ratio of C to Rust, and the seconds of that pair.
fn median(mut rust: impl FnMut() -> (f64, u64), mut c: impl FnMut() -> (f64, u64)) -> (f64, f64, f64) {
    let mut pairs: Vec<_> = (0..PAIRS)
        .map(|_| {
            let ((rust, found), (c, same)) = (rust(), c());
            assert_eq!(found, same);
            (c / rust, rust, c)
        })
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs[PAIRS / 2]
}

fn main() {
    println!(
        "Medians of {PAIRS} pairs. \"made\": Rust has its lobe already, C checks and converts one in each call."
    );
    println!("\"numbers\": both begin with a frame, two alphas and a weight.");
    println!(
        "{:>9} {:>8} {:>10} {:>10} {:>9} {:>10} {:>10} {:>9}",
        "vertices", "alpha", "Rust us", "C us", "made", "Rust us", "C us", "numbers"
    );
    for (n, alpha) in [(10_000, 1e-3), (1_000_000, 1e-4), (1_000_000, 1e-2)] {
        let points = light_vertices(n);
        let constant = CONSTANT_K * 24.0 / n as f64;
        let eyes = eye_vertices(2000, alpha, alpha);
        let numbers: Vec<_> = eyes.iter().map(|eye| Numbers::of(&eye.lobes[0])).collect();
        let lobes: Vec<_> = numbers.iter().map(Numbers::in_c).collect();
        let mut bvh = VertexBvh::new();
        bvh.build(&points).unwrap();
        let (context, cache) = cache(&points);
        let made = median(
            || in_rust(&bvh, &eyes, constant, |i| &eyes[i].lobes[0]),
            || in_c(cache, &eyes, constant, |i| &lobes[i]),
        );
        let from_numbers = median(
            || in_rust(&bvh, &eyes, constant, |i| numbers[i].in_rust()),
            || in_c(cache, &eyes, constant, |i| numbers[i].in_c()),
        );
        let us = |seconds: f64| seconds / eyes.len() as f64 * 1e6;
        print!("{n:9} {alpha:8.0e}");
        for (ratio, rust, c) in [made, from_numbers] {
            print!(" {:10.3} {:10.3} {ratio:9.3}", us(rust), us(c));
        }
        println!();
        // SAFETY: the references of `cache`.
        unsafe {
            hrr_cache_release(cache);
            hrr_context_release(context);
        }
    }
}
