//! Bad arguments: a status and a message that names them, outputs left alone, never a crash.

use super::support::*;
use hrr::ffi::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// Asserts a status and a word of the message.
fn fails(status: HrrStatus, expected: HrrStatus, word: &str) {
    assert_eq!(status, expected, "{}", last_error());
    assert!(last_error().contains(word), "{:?} does not name {word:?}", last_error());
}

fn one_cache() -> (Context, Cache) {
    let context = Context::new(1);
    let cache = context.floats(&[[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]);
    (context, cache)
}

#[test]
fn null_is_refused_by_every_function() {
    let (context, cache) = one_cache();
    let lobe = [sphere(1.0)];
    let ask = query([0.0; 3], &lobe, 1.0, 0);
    let v = [0.0, 0.0, 1.0];
    let (mut hits, mut number, mut count) = ([HrrHit { id: 0, probability: 0.0 }; 4], 5.0, 7u64);
    let mut offset = [0.0; 3];
    let mut out_lobe = lobe[0];
    let mut fit: HrrLobeFit = zeroed();
    let (mut context_out, mut cache_out): (*mut HrrContext, _) = (null_mut(), null_mut());
    let desc = build_desc(&[]);
    let (n, o, bad) = (v.as_ptr(), &raw mut number, HRR_ERROR_INVALID_ARGUMENT);
    unsafe extern "C" fn go_on(_: *mut c_void, _: *const HrrHit) -> i32 {
        0
    }
    // SAFETY: pointers are NULL or to locals of the sizes given.
    unsafe {
        fails(hrr_context_new(null(), null_mut()), bad, "out_context");
        fails(hrr_context_trim(null()), bad, "context");
        hrr_context_retain(null_mut());
        hrr_context_release(null_mut());
        hrr_cache_retain(null_mut());
        hrr_cache_release(null_mut());
        fails(hrr_cache_build(null(), &desc, &mut cache_out), bad, "context");
        fails(hrr_cache_build(context.0, null(), &mut cache_out), bad, "desc");
        fails(hrr_cache_build(context.0, &desc, null_mut()), bad, "out_cache");
        let no_segments = HrrBuildDesc { segments: null(), segment_count: 1, ..desc };
        fails(hrr_cache_build(context.0, &no_segments, &mut cache_out), bad, "desc->segments");
        fails(hrr_cache_info(null(), &mut cache.info()), bad, "cache");
        fails(hrr_cache_info(cache.0, null_mut()), bad, "info");
        fails(hrr_cache_hash(null(), &mut count), bad, "cache");
        fails(hrr_cache_hash(cache.0, null_mut()), bad, "out_hash");
        let to = offset.as_mut_ptr();
        fails(hrr_cache_offset(null(), n, n, to), bad, "cache");
        fails(hrr_cache_offset(cache.0, null(), n, to), bad, "light");
        fails(hrr_cache_offset(cache.0, n, null(), to), bad, "eye");
        fails(hrr_cache_offset(cache.0, n, n, null_mut()), bad, "out_offset");
        let l = &raw mut out_lobe;
        fails(hrr_lobe_reflection(null(), n, n, 0.1, 0.1, 1.0, l), bad, "normal");
        fails(hrr_lobe_reflection(n, n, null(), 0.1, 0.1, 1.0, l), bad, "wo");
        fails(hrr_lobe_reflection(n, null(), n, 0.1, 0.1, 1.0, null_mut()), bad, "out_lobe");
        fails(hrr_lobe_transmission(null(), n, n, 0.1, 0.1, 1.5, 1.0, l), bad, "normal");
        fails(hrr_lobe_transmission(n, n, null(), 0.1, 0.1, 1.5, 1.0, l), bad, "wo");
        fails(hrr_lobe_transmission(n, n, n, 0.1, 0.1, 1.5, 1.0, null_mut()), bad, "out_lobe");
        fails(hrr_lobe_sphere(1.0, null_mut()), bad, "out_lobe");
        fails(hrr_lobe_eval(null(), n, o), bad, "lobe");
        fails(hrr_lobe_eval(l, null(), o), bad, "direction");
        fails(hrr_lobe_eval(l, n, null_mut()), bad, "out_k");
        fails(hrr_probability(null(), 1, 1.0, n, o), bad, "lobes");
        fails(hrr_probability(l, 1, 1.0, null(), o), bad, "offset");
        fails(hrr_probability(l, 1, 1.0, n, null_mut()), bad, "out_probability");
        fails(hrr_constant_for(1.0, 1.0, 1, null_mut()), bad, "out_constant");
        let h = hits.as_mut_ptr();
        fails(hrr_query(null(), &ask, null(), h, 4, &mut count, null_mut()), bad, "cache");
        fails(hrr_query(cache.0, null(), null(), h, 4, &mut count, null_mut()), bad, "query");
        fails(hrr_query(cache.0, &ask, null(), null_mut(), 4, &mut count, null_mut()), bad, "hits");
        fails(hrr_query(cache.0, &ask, null(), h, 4, null_mut(), null_mut()), bad, "out_count");
        let no_lobes = HrrQuery { lobes: null(), ..ask };
        fails(hrr_query(cache.0, &no_lobes, null(), h, 4, &mut count, null_mut()), bad, "lobes");
        fails(hrr_query_visit(null(), &ask, null(), Some(go_on), null_mut(), null_mut()), bad, "cache");
        fails(hrr_query_visit(cache.0, null(), null(), Some(go_on), null_mut(), null_mut()), bad, "query");
        fails(hrr_query_visit(cache.0, &ask, null(), None, null_mut(), null_mut()), bad, "visit");
        let (k, c, to) = (cache.0, context.0, &raw mut count);
        let batch = |c, k, q, h, to| hrr_query_batch(c, k, q, 0, 1, null(), h, 4, to, null_mut());
        fails(batch(null_mut(), k, &raw const ask, h, to), bad, "context");
        fails(batch(c, null_mut(), &raw const ask, h, to), bad, "cache");
        fails(batch(c, k, null(), h, to), bad, "queries");
        fails(batch(c, k, &raw const ask, null_mut(), to), bad, "hits");
        fails(batch(c, k, &raw const ask, h, null_mut()), bad, "offsets");
        fails(hrr_check_lobe_fit(null(), n, n, 1, &mut fit), bad, "lobe");
        fails(hrr_check_lobe_fit(l, null(), n, 1, &mut fit), bad, "directions");
        fails(hrr_check_lobe_fit(l, n, null(), 1, &mut fit), bad, "f_cos");
        fails(hrr_check_lobe_fit(l, n, n, 1, null_mut()), bad, "out_fit");
        fails(hrr_self_test(null(), 0), bad, "context");
        fails(hrr_context_new(null(), (&raw mut context_out).wrapping_byte_add(1)), bad, "not aligned");
    }
    assert!(context_out.is_null() && cache_out.is_null());
    assert_eq!((number, count, offset), (5.0, 7, [0.0; 3]));
}

#[test]
fn structs_have_their_size() {
    #[repr(C)]
    #[derive(Clone, Copy)]
    struct Newer {
        desc: HrrBuildDesc,
        field: u64,
    }
    let context = Context::new(1);
    let mut cache = null_mut();
    let size = size_of::<HrrBuildDesc>() as u32;
    for struct_size in [0, 4, size - 1, 5000, u32::MAX] {
        let desc = HrrBuildDesc { struct_size, ..build_desc(&[]) };
        assert_eq!(context.build(&desc).unwrap_err(), HRR_ERROR_ABI);
        assert!(last_error().contains("struct_size"));
    }
    let desc = HrrBuildDesc { struct_size: size + 8, ..build_desc(&[]) };
    let mut newer = Newer { desc, field: 0 };
    // SAFETY: locals; the structs are as long as they say, or refused.
    unsafe {
        assert_eq!(hrr_cache_build(context.0, &newer.desc, &mut cache), HRR_OK, "{}", last_error());
        hrr_cache_release(cache);
        newer.field = 1 << 20;
        let newer = (&raw const newer).cast();
        fails(hrr_cache_build(context.0, newer, &mut cache), HRR_ERROR_ABI, "does not know");

        let mut out = null_mut();
        let mut desc: HrrContextDesc = zeroed();
        fails(hrr_context_new(&desc, &mut out), HRR_ERROR_ABI, "struct_size");
        desc.struct_size = size_of::<HrrContextDesc>() as u32;
        desc.threads = u32::MAX;
        fails(hrr_context_new(&desc, &mut out), HRR_ERROR_INVALID_ARGUMENT, "threads");
        let (context, cache) = one_cache();
        let mut info: HrrCacheInfo = zeroed();
        fails(hrr_cache_info(cache.0, &mut info), HRR_ERROR_ABI, "struct_size");
        let (lobe, mut count) = ([sphere(1.0)], 0);
        let ask = query([0.0; 3], &lobe, 1.0, 0);
        let o = HrrQueryOptions { struct_size: 3, ..options(0, false) };
        let status = hrr_query(cache.0, &ask, &o, null_mut(), 0, &mut count, null_mut());
        fails(status, HRR_ERROR_ABI, "options");
        drop(context);
    }
    assert_eq!(hrr_check_abi(HRR_ABI), HRR_OK);
    fails(hrr_check_abi(HRR_ABI + 1), HRR_ERROR_ABI, "interface");
}

#[test]
fn positions_that_are_not_finite() {
    let context = Context::new(1);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let good = vec![[0.5f32, 0.0, 1.0]; 10];
        let mut points = good.clone();
        points[7][1] = bad;
        let segments = [floats(&good), floats(&points)];
        let status = context.build(&build_desc(&segments)).unwrap_err();
        fails(status, HRR_ERROR_NON_FINITE, "segments[1].position 7");
        let drop = HrrBuildDesc { invalid: HRR_INVALID_DROP, ..build_desc(&segments) };
        let info = context.build(&drop).unwrap().info();
        assert_eq!((info.vertex_count, info.dropped_count), (19, 1));
        assert_eq!(info.bounds_max, [0.5, 0.0, 1.0]);
    }
    // Doubles beyond single precision, and those whose distance would be.
    for bad in [f64::NAN, f64::INFINITY, 1e300, -2e38] {
        let points = [[1e38, 0.0, 0.0], [bad, 0.0, 0.0], [-1e38, 0.0, 1.0]];
        let mut segment = floats(&[]);
        (segment.position, segment.count) = (points.as_ptr().cast(), 3);
        let segments = [segment];
        let desc = HrrBuildDesc { position_format: HRR_DOUBLE3, ..build_desc(&segments) };
        fails(context.build(&desc).unwrap_err(), HRR_ERROR_NON_FINITE, "position 1");
        let desc = HrrBuildDesc { invalid: HRR_INVALID_DROP, ..desc };
        let info = context.build(&desc).unwrap().info();
        assert_eq!((info.vertex_count, info.dropped_count), (2, 1));
        assert_eq!((info.bounds_min[0], info.origin[0]), (f64::from(-1e38f32), 0.0));
    }
}

#[test]
fn counts_and_strides() {
    let context = Context::new(1);
    let points = [[0.0f32; 3]; 2];
    let build = |change: &dyn Fn(&mut HrrSegment)| {
        let mut segments = [floats(&points)];
        change(&mut segments[0]);
        context.build(&build_desc(&segments)).map(|cache| cache.info().vertex_count)
    };
    assert_eq!(build(&|_| ()), Ok(2));
    assert_eq!(build(&|s| s.count = 0), Ok(0));
    assert_eq!(build(&|s| (s.count, s.position) = (0, null())), Ok(0));
    let bad = Err(HRR_ERROR_INVALID_ARGUMENT);
    assert_eq!(build(&|s| s.count = u64::MAX), bad);
    assert_eq!(build(&|s| s.count = (1 << 31) + 1), bad);
    assert_eq!(build(&|s| s.position = null()), bad);
    assert_eq!(build(&|s| s.position_stride = 11), bad);
    assert_eq!(build(&|s| s.position_stride = usize::MAX), bad);
    assert_eq!(build(&|s| (s.mask, s.mask_stride) = ([0u32; 2].as_ptr(), 3)), bad);
    assert_eq!(build(&|s| (s.id, s.id_stride) = ([0u64; 2].as_ptr(), 7)), bad);
    fails(HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INVALID_ARGUMENT, "segments[0].id");
    for change in [
        |d: &mut HrrBuildDesc| d.position_format = 2,
        |d: &mut HrrBuildDesc| d.invalid = 2,
        |d: &mut HrrBuildDesc| d.order = 2,
        |d: &mut HrrBuildDesc| d.reserved = 1,
    ] {
        let mut desc = build_desc(&[]);
        change(&mut desc);
        fails(context.build(&desc).unwrap_err(), HRR_ERROR_INVALID_ARGUMENT, "desc->");
    }
    let segments = [floats(&points)];
    let needed = hrr_cache_estimate_bytes(2, 0);
    let limited = |max_bytes| HrrBuildDesc { max_bytes, ..build_desc(&segments) };
    assert!(context.build(&limited(needed)).is_ok());
    fails(context.build(&limited(needed - 1)).unwrap_err(), HRR_ERROR_OUT_OF_MEMORY, "2 light vertices");
    let mut huge = floats(&points);
    huge.count = u64::MAX;
    let huge = [huge, huge];
    let desc = HrrBuildDesc { max_bytes: 1 << 40, ..build_desc(&huge) };
    assert_eq!(context.build(&desc).unwrap_err(), HRR_ERROR_OUT_OF_MEMORY);
    assert_eq!(hrr_cache_estimate_bytes(u64::MAX, 1), u64::MAX);
}

#[test]
fn estimates_are_upper_bounds() {
    let context = Context::new(1);
    for n in [1, 100, size(50_000, 300)] {
        let cache = context.floats(&vec![[1.0, 2.0, 3.0]; n]);
        let info = cache.info();
        assert!(info.bytes <= hrr_cache_estimate_bytes(n as u64, 0) && info.bytes >= 24 * n as u64);
        // SAFETY: live.
        assert_eq!(unsafe { hrr_context_trim(context.0) }, HRR_OK);
    }
}

#[test]
fn queries_out_of_range() {
    let (context, cache) = one_cache();
    let lobes = [sphere(1.0); 9];
    let good = query([0.0; 3], &lobes[..8], 1.0, 0);
    let ask = |q: HrrQuery, o: &HrrQueryOptions| {
        let (mut count, mut offsets) = (99, [5, 6]);
        // SAFETY: pointers are to locals of the sizes given.
        let status = unsafe { hrr_query(cache.0, &q, o, null_mut(), 0, &mut count, null_mut()) };
        // SAFETY: as above.
        let batch = unsafe {
            let to = offsets.as_mut_ptr();
            hrr_query_batch(context.0, cache.0, &q, 0, 1, o, null_mut(), 0, to, null_mut())
        };
        assert_eq!(batch, status);
        assert!(status == HRR_OK || status == HRR_ERROR_BUFFER_TOO_SMALL || (count, offsets) == (99, [5, 6]));
        status
    };
    let plain = options(0, false);
    assert_eq!(ask(HrrQuery { constant: 0.0, ..good }, &plain), HRR_OK);
    assert_eq!(ask(HrrQuery { lobe_count: 0, ..good }, &plain), HRR_OK);
    assert_eq!(ask(HrrQuery { constant: f64::MAX, ..good }, &plain), HRR_ERROR_BUFFER_TOO_SMALL);
    let (bad, nan) = (HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE);
    fails(ask(HrrQuery { lobe_count: 9, ..good }, &plain), bad, "9 lobes");
    fails(ask(HrrQuery { lobe_count: u32::MAX, ..good }, &plain), bad, "queries[0]: 4294967295 lobes");
    fails(ask(HrrQuery { mask: 0, ..good }, &plain), bad, "mask");
    fails(ask(HrrQuery { constant: -1.0, ..good }, &plain), bad, "constant");
    fails(ask(HrrQuery { constant: f64::NAN, ..good }, &plain), nan, "constant");
    fails(ask(HrrQuery { constant: f64::INFINITY, ..good }, &plain), nan, "constant");
    fails(ask(HrrQuery { position: [0.0, f64::NAN, 0.0], ..good }, &plain), nan, "position");
    assert_ne!(ask(HrrQuery { position: [1e300, -1e300, 0.0], ..good }, &plain), HRR_ERROR_PANIC);
    fails(ask(good, &options(3, false)), bad, "rule");
    fails(ask(good, &HrrQueryOptions { brute_force: 2, ..plain }), bad, "brute_force");
    fails(ask(good, &HrrQueryOptions { reserved: 2, ..plain }), bad, "reserved");
    let mut offsets = [0; 2];
    // SAFETY: refused before anything is read.
    unsafe {
        let (to, q) = (offsets.as_mut_ptr(), &raw const good);
        let batch = |stride, n| {
            hrr_query_batch(context.0, cache.0, q, stride, n, null(), null_mut(), 0, to, null_mut())
        };
        fails(batch(0, u64::MAX), bad, "query_count");
        fails(batch(usize::MAX / 2, 1 << 20), bad, "queries");
        fails(batch(8, 1), bad, "stride");
    }
}

#[test]
fn lobes_out_of_range() {
    let good = sphere(1.0);
    let direction = [0.0, 0.6, 0.8];
    let eval = |lobe: HrrLobe| {
        let mut k = 7.0;
        // SAFETY: locals.
        let status = unsafe { hrr_lobe_eval(&lobe, direction.as_ptr(), &mut k) };
        assert!(status == HRR_OK && k == 1.0 || status != HRR_OK && k == 7.0);
        status
    };
    let (bad, nan) = (HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE);
    assert_eq!(eval(good), HRR_OK);
    assert_eq!(eval(HrrLobe { x: [1.0005, 0.0, 0.0], ..good }), HRR_ERROR_INVALID_ARGUMENT);
    assert_eq!(eval(HrrLobe { x: [1.0001, 0.0, 0.0], y: [0.0, -1.0, 0.0], ..good }), HRR_OK);
    fails(eval(HrrLobe { z: [0.0; 3], ..good }), bad, "orthonormal");
    fails(eval(HrrLobe { z: good.x, ..good }), bad, "orthonormal");
    fails(eval(HrrLobe { y: [0.0, f64::NAN, 0.0], ..good }), nan, "lobe");
    for alpha in [0.0, -0.1, 1.1] {
        fails(eval(HrrLobe { alpha_x: alpha, ..good }), bad, "alpha");
        fails(eval(HrrLobe { alpha_y: alpha, ..good }), bad, "alpha");
    }
    fails(eval(HrrLobe { alpha_y: f64::NAN, ..good }), nan, "lobe");
    fails(eval(HrrLobe { weight: -1.0, ..good }), bad, "weight");
    fails(eval(HrrLobe { weight: f64::INFINITY, ..good }), nan, "lobe");

    let mut out = good;
    let z = [0.0, 0.0, 1.0];
    let mut make = |n: [f64; 3], wo: [f64; 3], alpha: f64, eta: f64, size: f64| {
        // SAFETY: locals.
        let status = unsafe {
            hrr_lobe_transmission(n.as_ptr(), null(), wo.as_ptr(), alpha, 0.1, eta, size, &mut out)
        };
        if status == HRR_OK {
            assert_eq!(eval(HrrLobe { weight: 1.0, alpha_x: 1.0, alpha_y: 1.0, ..out }), HRR_OK);
        }
        status
    };
    for alpha in [0.0, 1e-300, 0.1, 1.0] {
        for wo in [z, [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8]] {
            assert_eq!(make(z, wo, alpha, 1.0, 1.0), HRR_OK);
            assert_eq!(make(z, wo, alpha, 1e-3, 0.0), HRR_OK);
        }
    }
    fails(make([0.0; 3], z, 0.1, 1.5, 1.0), bad, "normal");
    fails(make(z, [0.0, 0.0, 1.1], 0.1, 1.5, 1.0), bad, "wo");
    fails(make(z, [0.0, f64::NAN, 1.0], 0.1, 1.5, 1.0), nan, "wo");
    fails(make(z, z, 1.5, 1.5, 1.0), bad, "alpha_x");
    fails(make(z, z, f64::NAN, 1.5, 1.0), nan, "alpha_x");
    fails(make(z, z, 0.1, 0.0, 1.0), bad, "eta");
    fails(make(z, z, 0.1, 1.5, -1.0), bad, "transmittance");
    let mut number = 0.0;
    // SAFETY: locals.
    unsafe {
        fails(hrr_lobe_sphere(-1.0, &mut out), bad, "weight");
        fails(hrr_constant_for(-1.0, 1.0, 1, &mut number), bad, "wanted");
        fails(hrr_constant_for(1.0, f64::NAN, 1, &mut number), nan, "area");
        fails(hrr_constant_for(f64::MAX, f64::MAX, 1, &mut number), nan, "constant");
        assert_eq!(hrr_constant_for(3.0, 2.0, 4, &mut number), HRR_OK);
        assert_eq!(number, 1.5);
        assert_eq!(hrr_constant_for(3.0, 2.0, 0, &mut number), HRR_OK);
        assert_eq!(number, 0.0);
    }
}

#[test]
fn small_buffers_tell_what_is_needed() {
    let context = Context::new(1);
    let cache = context.floats(&vec![[0.0, 0.0, 1.0]; 100]);
    let lobes = [sphere(1.0)];
    let ask = query([0.0; 3], &lobes, 0.5, 3);
    let all = cache.hits(&ask, None);
    assert!(all.len() > 20 && all.iter().all(|h| h.probability == 0.5));
    let (mut hits, mut count) = ([HrrHit { id: 777, probability: 0.0 }; 8], 0);
    // SAFETY: locals of the sizes given.
    let status = unsafe { hrr_query(cache.0, &ask, null(), hits.as_mut_ptr(), 7, &mut count, null_mut()) };
    fails(status, HRR_ERROR_BUFFER_TOO_SMALL, "capacity is 7");
    assert_eq!((count, &hits[..7], hits[7].id), (all.len() as u64, &all[..7], 777));
}

#[test]
fn callbacks_that_fail() {
    unsafe extern "C" fn stop_at_third(user: *mut c_void, _: *const HrrHit) -> i32 {
        // SAFETY: the test's counter.
        let seen = unsafe { &mut *user.cast::<u32>() };
        *seen += 1;
        if *seen == 3 { -5 } else { 0 }
    }
    unsafe extern "C" fn lazy(_: *mut c_void, count: u32, task: HrrTaskFn, data: *mut c_void) {
        for i in 1..count {
            // SAFETY: as the library asks, but for the first.
            unsafe { task.unwrap()(data, i) };
        }
        // SAFETY: no task: nothing to do.
        unsafe { task.unwrap()(null_mut(), 0) };
    }
    let context = Context::with(|d| d.parallel_for = Some(lazy));
    let cache = context.floats(&vec![[0.0, 0.0, 1.0]; 100]);
    let (lobes, mut seen, mut counters) = ([sphere(1.0)], 0u32, HrrCounters::default());
    let ask = query([0.0; 3], &lobes, 0.5, 3);
    let (user, mut offsets) = ((&raw mut seen).cast(), [9; 2]);
    // SAFETY: locals of the sizes given.
    unsafe {
        let status = hrr_query_visit(cache.0, &ask, null(), Some(stop_at_third), user, &mut counters);
        fails(status, HRR_ERROR_CALLBACK, "-5");
        assert_eq!((seen, counters), (3, HrrCounters::default()));
        let to = offsets.as_mut_ptr();
        let status = hrr_query_batch(context.0, cache.0, &ask, 0, 1, null(), null_mut(), 0, to, null_mut());
        fails(status, HRR_ERROR_CALLBACK, "0 of 1");
    }
    assert_eq!(offsets, [9; 2]);
}

#[test]
fn handles_are_counted() {
    let (context, cache) = one_cache();
    // SAFETY: as many references are given up as there are.
    unsafe {
        hrr_cache_retain(cache.0);
        hrr_context_retain(context.0);
        hrr_context_release(context.0);
        hrr_cache_release(cache.0);
        // Half a million probabilities are too many for Miri.
        if !cfg!(miri) {
            assert_eq!(hrr_self_test(context.0, 3), HRR_OK, "{}", last_error());
        }
    }
    // A cache outlives its context.
    drop(context);
    assert_eq!(cache.info().vertex_count, 2);
}

#[test]
fn a_wrong_convention_of_roughness_shows_in_the_fit() {
    let (z, wo) = ([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]);
    let make = |alpha: f64| {
        let mut lobe: HrrLobe = zeroed();
        // SAFETY: locals.
        let status =
            unsafe { hrr_lobe_reflection(z.as_ptr(), null(), wo.as_ptr(), alpha, alpha, 1.0, &mut lobe) };
        assert_eq!(status, HRR_OK);
        lobe
    };
    let (right, wrong) = (make(0.01), make(0.1));
    let directions: Vec<[f64; 3]> =
        (0..50).map(|i| [-0.6 + 0.001 * f64::from(i - 25), 0.0005 * f64::from(i % 7), 0.8]).collect();
    let eval = |w: &[f64; 3]| {
        let mut k = 0.0;
        // SAFETY: locals.
        assert_eq!(unsafe { hrr_lobe_eval(&right, w.as_ptr(), &mut k) }, HRR_OK);
        right.weight * k
    };
    let f_cos: Vec<f64> = directions.iter().map(eval).collect();
    let check = |lobe: &HrrLobe| {
        let (mut fit, d, n): (HrrLobeFit, _, _) = (zeroed(), directions.as_ptr().cast(), f_cos.len() as u64);
        // SAFETY: arrays of the sizes given.
        assert_eq!(unsafe { hrr_check_lobe_fit(lobe, d, f_cos.as_ptr(), n, &mut fit) }, HRR_OK);
        assert!(fit.count == 50 && fit.min <= fit.mean && fit.mean <= fit.max && fit.worst < 50);
        fit
    };
    let fit = check(&right);
    assert!((fit.max - 1.0).abs() < 1e-12 && (fit.min - 1.0).abs() < 1e-12);
    let fit = check(&wrong);
    assert!(fit.max > 50.0 && fit.max > 3.0 * fit.min);
    let mut fit: HrrLobeFit = zeroed();
    // SAFETY: locals; nothing is read for a count of 0.
    unsafe {
        let status = hrr_check_lobe_fit(&right, null(), null(), 0, &mut fit);
        fails(status, HRR_ERROR_INVALID_ARGUMENT, "0 directions");
        let huge = hrr_check_lobe_fit(&right, z.as_ptr(), z.as_ptr(), u64::MAX, &mut fit);
        fails(huge, HRR_ERROR_INVALID_ARGUMENT, "directions");
        let status = hrr_check_lobe_fit(&right, [0.0; 3].as_ptr(), z.as_ptr(), 1, &mut fit);
        fails(status, HRR_ERROR_INVALID_ARGUMENT, "direction 0");
    }
}

#[test]
fn names_and_versions() {
    // SAFETY: static texts.
    let text = |t| unsafe { std::ffi::CStr::from_ptr(t) }.to_str().unwrap().to_owned();
    assert_eq!(text(hrr_status_name(HRR_ERROR_CALLBACK)), "HRR_ERROR_CALLBACK");
    assert_eq!(text(hrr_status_name(-77)), "unknown status");
    let version = text(hrr_version_string());
    assert!(version.starts_with(concat!("hrr ", env!("CARGO_PKG_VERSION"))), "{version}");
    assert_eq!(version.contains("embree"), cfg!(feature = "embree"));
    assert_eq!(hrr_version() >> 16, env!("CARGO_PKG_VERSION_MAJOR").parse::<u32>().unwrap());
    let keys: std::collections::HashSet<_> = (0..size(1000, 50))
        .flat_map(|i| [hrr_key(1, i, 0, 0), hrr_key(1, 0, i + 1, 0), hrr_key(1, 0, 0, i + 1)])
        .collect();
    assert_eq!(keys.len(), size(3000, 150));
}
