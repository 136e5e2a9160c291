//! Queries allocate nothing: counted.

use super::support::*;
use hrr::ffi::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ptr::{null, null_mut};

/// The system's allocator, which counts each thread's calls.
struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // Not while a thread ends.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

// SAFETY: the system's own, which is called with what it is called with.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        count();
        // SAFETY: passed on.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[test]
fn a_query_of_a_million_vertices_allocates_nothing() {
    let context = Context::new(2);
    let points: Vec<[f32; 3]> =
        (0..1_000_000u32).map(|i| [(i % 1000) as f32 * 1e-3, (i / 1000) as f32 * 1e-3, 1.0]).collect();
    let cache = context.floats(&points);
    let (normal, wo) = ([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]);
    let mut lobes = [sphere(1e-3); 2];
    // SAFETY: arrays of three and a local.
    let status =
        unsafe { hrr_lobe_reflection(normal.as_ptr(), null(), wo.as_ptr(), 0.01, 0.01, 1.0, &mut lobes[0]) };
    assert_eq!(status, HRR_OK);
    unsafe extern "C" fn go_on(_: *mut std::ffi::c_void, _: *const HrrHit) -> i32 {
        0
    }
    let mut hits = vec![HrrHit { id: 0, probability: 0.0 }; 100_000];
    let (mut counters, mut accepted) = (HrrCounters::default(), 0);
    let before = CALLS.get();
    for (rule, brute_force) in [(0, false), (1, false), (2, false), (0, true)] {
        for key in 0..(if brute_force { 2 } else { 300 }) {
            let ask = query([0.5 + 1e-4 * key as f64, 0.5, 0.0], &lobes, 1e-3, key);
            let (o, mut count) = (options(rule, brute_force), 0);
            let (at, room) = (hits.as_mut_ptr(), hits.len() as u64);
            // SAFETY: locals of the sizes given.
            unsafe {
                assert_eq!(hrr_query(cache.0, &ask, &o, at, room, &mut count, &mut counters), HRR_OK);
                accepted += count;
                let status = hrr_query_visit(cache.0, &ask, &o, Some(go_on), null_mut(), null_mut());
                assert_eq!(status, HRR_OK);
            }
        }
    }
    let calls = CALLS.get() - before;
    assert_eq!(calls, 0);
    assert!(accepted > 1000, "{accepted}");
    // The counter counts.
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(CALLS.get() - before, 2);
}
