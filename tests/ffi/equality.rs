//! The same numbers as the Rust interface, on any thread, in any batch, in any order.

use super::support::*;
use crate::roulette::{random_frame, surface_points, u};
use glam::{DVec3, Vec3};
use hrr::ffi::*;
use hrr::math::Frame;
use hrr::roulette::{self, Lobe, MinimumRandom, Query, QueryCounters};
use hrr::vertex_bvh::VertexBvh;
use std::ffi::c_void;
use std::ptr;

/// Fewer light vertices, a larger share of them.
const CONSTANT: f64 = if cfg!(miri) { 0.5 } else { 0.01 };

fn points(n: usize) -> Vec<[f32; 3]> {
    surface_points(n).into_iter().map(|p| p.to_array()).collect()
}

fn eye(i: u64) -> DVec3 {
    DVec3::new(u(i, 21), u(i, 22), u(i, 23)) - 0.5
}

/// Two GGX lobes and a floor, by the Rust interface.
fn rust_lobes(i: u64) -> Vec<Lobe> {
    let frame = random_frame(i);
    let mut wo = random_frame(i + 1000).z;
    if frame.z.dot(wo) < 0.0 {
        wo = -wo;
    }
    let (ax, ay) = (10f64.powf(-4.0 * u(i, 7)), 10f64.powf(-4.0 * u(i, 8)));
    vec![
        Lobe::from_ggx_reflection(&frame, wo, ax, ay, 0.9),
        Lobe::from_ggx_transmission(&frame, wo, ax, ay, 1.5, 0.4).with_weight(2.0),
        Lobe::sphere(0.1),
    ]
}

fn c_lobes(i: u64) -> Vec<HrrLobe> {
    rust_lobes(i).into_iter().map(HrrLobe::from).collect()
}

#[test]
fn lobes_are_those_of_the_rust_interface() {
    for i in 0..size(100, 10) {
        let frame = random_frame(i);
        let (n, t, wo) = (frame.z.to_array(), frame.x.to_array(), random_frame(i + 1000).z);
        // A normal on the other side is turned round, x with it.
        let outside = frame.z.dot(wo) >= 0.0;
        let own = Frame::from_z_tangent(frame.z, frame.x);
        let own = if outside { own } else { Frame { x: -own.x, y: own.y, z: -own.z } };
        let (ax, ay, wo) = (u(i, 7), u(i, 8), wo.to_array());
        let (mut r, mut tr): (HrrLobe, HrrLobe) = (zeroed(), zeroed());
        // SAFETY: arrays of three, and locals.
        unsafe {
            let (n, t, o) = (n.as_ptr(), t.as_ptr(), wo.as_ptr());
            assert_eq!(hrr_lobe_reflection(n, t, o, ax, ay, 0.5, &mut r), HRR_OK, "{}", last_error());
            assert_eq!(hrr_lobe_transmission(n, t, o, ax, ay, 1.3, 0.5, &mut tr), HRR_OK);
        }
        let wo = DVec3::from_array(wo);
        assert_eq!(r, Lobe::from_ggx_reflection(&own, wo, ax, ay, 0.5).into());
        assert_eq!(tr, Lobe::from_ggx_transmission(&own, wo, ax, ay, 1.3, 0.5).into());
    }
}

#[test]
fn hits_are_those_of_the_rust_interface() {
    let context = Context::new(2);
    let mut accepted = 0;
    for n in [0, 1, 9, size(500, 12), size(20_000, 30)] {
        let positions = surface_points(n);
        let mut bvh = VertexBvh::new();
        bvh.build(&positions).unwrap();
        let cache = context.floats(&points(n));
        for i in 0..size(40, 1) {
            let (eye, rust, c) = (eye(i), rust_lobes(i), c_lobes(i));
            let rules = [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact];
            for (number, rule) in rules.into_iter().enumerate() {
                let ask = Query { rule, ..Query::new(eye, &rust, CONSTANT, i) };
                let (mut expected, mut did) = (Vec::new(), QueryCounters::default());
                roulette::query(&bvh, &ask, &mut did, &mut |id, probability| {
                    expected.push(HrrHit { id: id.into(), probability });
                });
                let ask = query(eye.to_array(), &c, CONSTANT, i);
                assert_eq!(cache.hits(&ask, Some(&options(number as u32, false))), expected);
                assert_eq!(cache.hits(&ask, Some(&options(number as u32, true))), expected);
                if number == 0 {
                    assert_eq!(cache.hits(&ask, None), expected);
                }
                accepted += expected.len();
            }
        }
    }
    assert!(accepted > size(1000, 0), "{accepted}");
}

#[test]
fn any_edge_has_the_probability_that_a_query_divides_by() {
    let context = Context::new(1);
    let far = [1e7, -3e6, 5.0];
    let doubles: Vec<[f64; 3]> = surface_points(size(3000, 30))
        .into_iter()
        .map(|p| (p.as_dvec3() * 1.1 + DVec3::from_array(far)).to_array())
        .collect();
    let mut segment = floats(&[]);
    segment.position = doubles.as_ptr().cast::<c_void>();
    segment.count = doubles.len() as u64;
    let segments = [segment];
    let desc = HrrBuildDesc { position_format: HRR_DOUBLE3, ..build_desc(&segments) };
    let cache = context.build(&desc).unwrap();
    let info = cache.info();
    assert!((DVec3::from_array(info.origin) - DVec3::from_array(far)).length() < 0.1);
    assert!((0..3).all(|k| info.bounds_min[k] < far[k] && info.bounds_max[k] > far[k] + 1.0));
    let mut checked = 0;
    for i in 0..size(200, 5) {
        let eye = (eye(i) + DVec3::from_array(far)).to_array();
        let lobes = c_lobes(i);
        for hit in cache.hits(&query(eye, &lobes, CONSTANT, i), None) {
            let light = &doubles[hit.id as usize];
            let (mut offset, mut p) = ([0.0; 3], 0.0);
            // SAFETY: arrays of three, and locals.
            unsafe {
                let status = hrr_cache_offset(cache.0, light.as_ptr(), eye.as_ptr(), offset.as_mut_ptr());
                assert_eq!(status, HRR_OK);
                let n = lobes.len() as u32;
                assert_eq!(hrr_probability(lobes.as_ptr(), n, CONSTANT, offset.as_ptr(), &mut p), HRR_OK);
            }
            // What single precision at a distance of 1e7 would have lost: half a unit.
            let error = DVec3::from_array(offset) - (DVec3::from_array(*light) - DVec3::from_array(eye));
            assert!(error.length() < 1e-6);
            assert_eq!(p.to_bits(), hit.probability.to_bits());
            checked += 1;
        }
    }
    assert!(checked > size(300, 3), "{checked}");
}

/// A host's queries, and the lobes that they point to.
fn many(n: u64) -> (Vec<HrrQuery>, Vec<Vec<HrrLobe>>) {
    let lobes: Vec<_> = (0..n).map(c_lobes).collect();
    let queries = (0..n).map(|i| query(eye(i).to_array(), &lobes[i as usize], CONSTANT, hrr_key(1, 0, i, 2)));
    (queries.collect(), lobes)
}

unsafe extern "C" fn backwards(user: *mut c_void, count: u32, task: HrrTaskFn, data: *mut c_void) {
    let task = task.unwrap();
    // Repeats and inventions do no harm.
    for i in (0..count + 5).rev().chain(0..count) {
        // SAFETY: as the library asks.
        unsafe { task(data, i) };
    }
    // SAFETY: the test's counter, which no other thread touches.
    unsafe { *user.cast::<u32>() += 1 };
}

#[test]
fn threads_batches_and_order_change_nothing() {
    let points = points(size(20_000, 30));
    let (mut queries, _lobes) = many(size(1500, 5));
    let mut calls = 0u32;
    let user = (&raw mut calls).cast();
    let contexts = [
        Context::new(1),
        Context::new(3),
        Context::with(|d| {
            d.parallel_for = Some(backwards);
            (d.threads, d.parallel_user) = (2, user);
        }),
    ];
    let caches: Vec<_> = contexts.iter().map(|c| c.floats(&points)).collect();
    assert!(caches.iter().all(|c| c.hash() == caches[0].hash()));
    let single: Vec<_> = queries.iter().map(|q| caches[0].hits(q, None)).collect();
    let (hits, offsets) = caches[0].batch(&contexts[0], &queries);
    assert!(hits.len() > size(1000, 3));
    for (i, own) in single.iter().enumerate() {
        assert_eq!(&hits[offsets[i] as usize..offsets[i + 1] as usize], &own[..]);
    }
    for (context, cache) in contexts.iter().zip(&caches) {
        assert_eq!(cache.batch(context, &queries), (hits.clone(), offsets.clone()));
        assert_eq!(cache.batch(context, &[]), (vec![], vec![0]));
    }
    assert_eq!(calls, 2);
    queries.reverse();
    let (reversed, offsets) = caches[1].batch(&contexts[1], &queries);
    for (i, own) in single.iter().rev().enumerate() {
        assert_eq!(&reversed[offsets[i] as usize..offsets[i + 1] as usize], &own[..]);
    }
}

#[test]
fn callbacks_and_counters_see_what_buffers_do() {
    unsafe extern "C" fn push(user: *mut c_void, hit: *const HrrHit) -> i32 {
        // SAFETY: the test's vector, and a hit.
        unsafe { (*user.cast::<Vec<HrrHit>>()).push(*hit) };
        0
    }
    let context = Context::new(1);
    let cache = context.floats(&points(size(5000, 30)));
    let n = size(50, 4);
    let (queries, _lobes) = many(n);
    let (mut visited, mut counters, mut batch) =
        (Vec::<HrrHit>::new(), HrrCounters::default(), HrrCounters::default());
    for q in &queries {
        let user = (&raw mut visited).cast();
        // SAFETY: all pointers are to locals.
        let status = unsafe { hrr_query_visit(cache.0, q, ptr::null(), Some(push), user, &mut counters) };
        assert_eq!(status, HRR_OK);
    }
    assert_eq!(visited, queries.iter().flat_map(|q| cache.hits(q, None)).collect::<Vec<_>>());
    assert_eq!((counters.queries, counters.accepted), (n, visited.len() as u64));
    assert!(counters.leaves >= counters.accepted && counters.tests > counters.leaves && counters.nodes > n);
    let mut offsets = vec![0; queries.len() + 1];
    // SAFETY: all pointers are to locals of the sizes given.
    let status = unsafe {
        let (q, o) = (queries.as_ptr(), offsets.as_mut_ptr());
        hrr_query_batch(context.0, cache.0, q, 0, n, ptr::null(), ptr::null_mut(), 0, o, &mut batch)
    };
    assert_eq!(status, HRR_ERROR_BUFFER_TOO_SMALL);
    assert_eq!((batch.accepted, batch.tests), (counters.accepted, counters.tests));
}

#[test]
fn segments_strides_ids_and_masks() {
    /// A vertex in a host's memory, in which nothing is aligned.
    #[repr(C, packed)]
    #[derive(Clone, Copy)]
    struct Packed {
        tag: u8,
        id: u64,
        position: [f32; 3],
        mask: u32,
    }
    let points = points(size(4000, 30));
    let vertex = |i: usize| Packed { tag: 7, id: 1000 + i as u64, position: points[i], mask: 1 << (i % 3) };
    let vertices: Vec<_> = (0..points.len()).map(vertex).collect();
    assert!(vertices.iter().all(|v| v.tag == 7));
    let segment = |part: &[Packed]| {
        let (mut s, stride) = (floats(&[]), size_of::<Packed>());
        s.position = part.as_ptr().wrapping_byte_add(std::mem::offset_of!(Packed, position)).cast();
        s.mask = part.as_ptr().wrapping_byte_add(std::mem::offset_of!(Packed, mask)).cast();
        s.id = part.as_ptr().wrapping_byte_add(std::mem::offset_of!(Packed, id)).cast();
        (s.position_stride, s.mask_stride, s.id_stride) = (stride, stride, stride);
        s.count = part.len() as u64;
        s
    };
    let context = Context::new(2);
    let (whole, middle) = ([segment(&vertices)], vertices.len() / 8 * 5);
    let parts = [segment(&vertices[..17]), floats(&[]), segment(&vertices[17..])];
    let swapped = [segment(&vertices[middle..]), segment(&vertices[..middle])];
    let by_id = |s: &[HrrSegment]| HrrBuildDesc { order: HRR_ORDER_BY_ID, ..build_desc(s) };
    let cache = context.build(&build_desc(&whole)).unwrap();
    assert_eq!(context.build(&build_desc(&parts)).unwrap().hash(), cache.hash());
    assert_eq!(context.build(&by_id(&swapped)).unwrap().hash(), cache.hash());

    let plain = context.floats(&points);
    let lobes = [sphere(1.0)];
    let mut seen = 0;
    for i in 0..size(30, 4) {
        let ask = query(eye(i).to_array(), &lobes, CONSTANT, i);
        let all = plain.hits(&ask, None);
        for mask in [1, 2, 5] {
            let expected: Vec<_> = all.iter().filter(|h| (1 << (h.id % 3)) & mask != 0).collect();
            let found = cache.hits(&HrrQuery { mask, ..ask }, None);
            assert_eq!(found.len(), expected.len());
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(f, e)| f.id == e.id + 1000 && f.probability == e.probability)
            );
            seen += found.len();
        }
    }
    assert!(seen > size(100, 2));
}

#[test]
fn queries_go_on_while_others_build() {
    let context = Context::new(2);
    let n = size(20_000, 30);
    let cache = context.floats(&points(n));
    let (queries, lobes) = many(size(300, 3));
    let expected: Vec<_> = queries.iter().map(|q| cache.hits(q, None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                for round in 0..3 {
                    for (i, expected) in expected.iter().enumerate() {
                        let q =
                            query(eye(i as u64).to_array(), &lobes[i], CONSTANT, hrr_key(1, 0, i as u64, 2));
                        assert_eq!(&cache.hits(&q, None), expected, "{round}");
                    }
                }
            });
        }
        scope.spawn(|| {
            let hash = cache.hash();
            for other_n in [n, n / 4, n, 1, n] {
                // Released at once: the next build takes its memory.
                let other = context.floats(&points(other_n));
                assert_eq!(other.hash() == hash, other_n == n);
                assert_eq!(other.info().vertex_count, other_n as u64);
            }
        });
    });
}

#[test]
fn crooked_frames_are_mended() {
    // The frame is single precision and askew by 4e-4: culling counts on an orthonormal one.
    let context = Context::new(1);
    let points = points(size(20_000, 30));
    let cache = context.floats(&points);
    let mut accepted = 0;
    for i in 0..size(60, 3) {
        let eye = eye(i);
        let target = Vec3::from_array(points[i as usize * 11]).as_dvec3();
        let frame = Frame::from_z_tangent((target - eye).normalize(), random_frame(i).x);
        let single = |v: DVec3| v.as_vec3().as_dvec3().to_array();
        let (x, y, z) = (single(frame.x + frame.z * 4e-4), single(-frame.y), single(frame.z * 1.0003));
        let lobe = [HrrLobe { x, y, z, alpha_x: 1e-3, alpha_y: 1e-2, weight: 1.0 }];
        let ask = query(eye.to_array(), &lobe, 30.0, i);
        let hits = cache.hits(&ask, None);
        assert_eq!(hits, cache.hits(&ask, Some(&options(HRR_RULE_NESTED, true))));
        let [x, z] = [x, z].map(DVec3::from_array);
        let mended = [Lobe::new(Frame::from_z_tangent(z.normalize(), x), 1e-3, 1e-2, 1.0)];
        for hit in &hits {
            let offset = Vec3::from_array(points[hit.id as usize]).as_dvec3() - eye;
            assert_eq!(hit.probability, roulette::probability(&mended, 30.0, offset));
        }
        accepted += hits.len();
    }
    assert!(accepted > size(100, 2), "{accepted}");
}
