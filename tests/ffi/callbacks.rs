//! A host's functions: told of memory, messages and progress; obeyed when they refuse.

use super::support::*;
use hrr::ffi::*;
use std::ffi::{CStr, c_char, c_void};
use std::ptr::null_mut;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

/// A host that counts.
#[derive(Default)]
struct Host {
    held: AtomicI64,
    most: AtomicI64,
    /// Above it, memory is refused; 0 = no limit.
    limit: AtomicI64,
    messages: Mutex<Vec<(u32, String)>>,
}

unsafe extern "C" fn memory(user: *mut c_void, bytes: i64) -> i32 {
    // SAFETY: the test's host.
    let host = unsafe { &*user.cast_const().cast::<Host>() };
    let (now, limit) = (host.held.load(Ordering::SeqCst) + bytes, host.limit.load(Ordering::SeqCst));
    if bytes > 0 && limit > 0 && now > limit {
        return 7;
    }
    host.held.store(now, Ordering::SeqCst);
    host.most.fetch_max(now, Ordering::SeqCst);
    0
}

unsafe extern "C" fn log(user: *mut c_void, level: u32, message: *const c_char) {
    // SAFETY: the test's host, and a text.
    let (host, text) = unsafe { (&*user.cast_const().cast::<Host>(), CStr::from_ptr(message)) };
    host.messages.lock().unwrap().push((level, text.to_str().unwrap().to_owned()));
}

fn context(host: &Host, level: u32) -> Context {
    let user = std::ptr::from_ref(host).cast_mut().cast::<c_void>();
    Context::with(|d| {
        d.threads = 2;
        d.memory = Some(memory);
        d.log = Some(log);
        (d.memory_user, d.log_user, d.log_level) = (user, user, level);
    })
}

fn info(context: &Context) -> HrrContextInfo {
    let mut info: HrrContextInfo = zeroed();
    info.struct_size = size_of::<HrrContextInfo>() as u32;
    // SAFETY: both are live.
    assert_eq!(unsafe { hrr_context_info(context.0, &mut info) }, HRR_OK);
    info
}

fn sheet(n: u32) -> Vec<[f32; 3]> {
    (0..n).map(|i| [i as f32, (i * 7 % 1000) as f32, 0.5]).collect()
}

#[test]
fn memory_is_told_and_adds_up() {
    let host = Host::default();
    {
        let context = context(&host, 0);
        let held = || host.held.load(Ordering::SeqCst);
        assert_eq!((held(), info(&context).threads), (0, 2));
        let n = size(10_000, 150);
        let cache = context.floats(&sheet(n));
        // Positions and boxes, ids; the build's buffers are kept for the next one.
        assert!(held() >= i64::from(n) * (16 + 8) && held() as u64 >= cache.info().bytes, "{}", held());
        assert_eq!(info(&context).bytes, held() as u64);
        let (first, estimate) = (held(), hrr_cache_estimate_bytes(n.into(), 0) as i64);
        assert!(first <= estimate && host.most.load(Ordering::SeqCst) == estimate);
        assert_eq!(info(&context).peak_bytes, estimate as u64);
        let second = context.floats(&sheet(n));
        assert!(held() > first);
        drop(cache);
        drop(second);
        let kept = held();
        assert!(kept > 0 && kept < 2 * estimate);
        // What is kept is enough: nothing new is asked for.
        host.limit.store(estimate, Ordering::SeqCst);
        let third = context.floats(&sheet(n / 2));
        drop(third);
        // SAFETY: live.
        assert_eq!(unsafe { hrr_context_trim(context.0) }, HRR_OK);
        assert_eq!(held(), 0);
        let (cache, small) = (context.floats(&sheet(100)), held());
        host.limit.store(small + 1000, Ordering::SeqCst);
        let points = sheet(n);
        let segments = [floats(&points)];
        assert_eq!(context.build(&build_desc(&segments)).unwrap_err(), HRR_ERROR_OUT_OF_MEMORY);
        assert!(last_error().contains("refused"), "{}", last_error());
        drop(context);
        // Caches live on without their context, and still give back.
        assert!(held() > 0);
        drop(cache);
    }
    assert_eq!(host.held.load(Ordering::SeqCst), 0);
}

#[test]
fn messages_are_said_up_to_their_level() {
    let said = |level| {
        let host = Host::default();
        let context = context(&host, level);
        let points = [[0.0, f32::NAN, 0.0], [1.0; 3]];
        let segments = [floats(&points)];
        let desc = HrrBuildDesc { invalid: HRR_INVALID_DROP, ..build_desc(&segments) };
        drop(context.build(&desc).unwrap());
        drop(context);
        host.messages.into_inner().unwrap()
    };
    assert_eq!(said(HRR_LOG_OFF), []);
    let warnings = said(HRR_LOG_WARNING);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].1.starts_with("1 of 2 light vertices"), "{warnings:?}");
    let all = said(HRR_LOG_INFO);
    assert!(all.len() == 3 && all.contains(&warnings[0]), "{all:?}");
    assert!(all.iter().any(|(level, text)| *level == HRR_LOG_INFO && text.contains("cache of 1 light")));
    let mut desc: HrrContextDesc = zeroed();
    desc.struct_size = size_of::<HrrContextDesc>() as u32;
    desc.log_level = 9;
    let mut out = null_mut();
    // SAFETY: locals.
    assert_eq!(unsafe { hrr_context_new(&desc, &mut out) }, HRR_ERROR_INVALID_ARGUMENT);
    assert!(last_error().contains("log_level"));
}

/// Ends at a fraction, in thousandths, that is told by the address' owner; counts the calls.
unsafe extern "C" fn until(user: *mut c_void, done: f64) -> i32 {
    // SAFETY: the test's numbers.
    let [limit, last, calls] = unsafe { &*user.cast_const().cast::<[AtomicU64; 3]>() };
    let thousandths = (1000.0 * done) as u64;
    assert!(done <= 1.0 && thousandths >= last.swap(thousandths, Ordering::SeqCst));
    calls.fetch_add(1, Ordering::SeqCst);
    i32::from(thousandths >= limit.load(Ordering::SeqCst))
}

#[test]
fn progress_rises_and_ends_builds() {
    let context = Context::new(2);
    let points = sheet(size(200_000, 60));
    let segments = [floats(&points)];
    let build = |limit: u64| {
        let numbers: [AtomicU64; 3] = [limit.into(), 0.into(), 0.into()];
        let user = (&raw const numbers).cast_mut().cast();
        let desc = HrrBuildDesc { progress: Some(until), progress_user: user, ..build_desc(&segments) };
        let [_, last, calls] = &numbers;
        let built = context.build(&desc).map(|cache| cache.hash());
        (built, last.load(Ordering::SeqCst), calls.load(Ordering::SeqCst))
    };
    let (whole, last, calls) = build(u64::MAX);
    assert!(last == 1000 && calls > size(6, 2), "{last} {calls}");
    let plain = context.build(&build_desc(&segments)).unwrap().hash();
    assert_eq!(whole, Ok(plain));
    for limit in [0, 1, 100, 300, 1000] {
        let (status, last, _) = build(limit);
        assert_eq!(status, Err(HRR_ERROR_CANCELLED));
        assert!(last >= limit && last_error().starts_with("progress returned 1"), "{}", last_error());
    }
    assert_eq!(build(u64::MAX).0, Ok(plain));
}
