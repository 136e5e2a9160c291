//! Tasks on the host's threads or on the context's.

use super::context::{HrrContext, HrrParallelForFn, HrrTaskFn};
use super::pointer::Callback;
use super::status::{Failure, HRR_ERROR_CALLBACK, Outcome};
use rayon::prelude::*;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A host's `parallel_for`.
#[derive(Debug, Clone, Copy)]
pub(super) struct HostThreads(Callback<unsafe extern "C" fn(*mut c_void, u32, HrrTaskFn, *mut c_void)>);

struct Job<'a> {
    body: &'a (dyn Fn(usize) + Sync),
    taken: Vec<AtomicBool>,
    done: AtomicUsize,
    panicked: AtomicBool,
}

unsafe extern "C" fn run_one(job: *mut c_void, index: u32) {
    if job.is_null() {
        return;
    }
    // SAFETY: `HostThreads::run` passes a `Job` that lives until the host's function returns.
    let job = unsafe { &*job.cast_const().cast::<Job<'_>>() };
    // A host that repeats an index, or makes one up, does no harm.
    let Some(taken) = job.taken.get(index as usize) else { return };
    if taken.swap(true, Ordering::Relaxed) {
        return;
    }
    match catch_unwind(AssertUnwindSafe(|| (job.body)(index as usize))) {
        Ok(()) => drop(job.done.fetch_add(1, Ordering::Release)),
        Err(payload) => {
            job.panicked.store(true, Ordering::Release);
            std::mem::forget(payload);
        }
    }
}

impl HostThreads {
    pub fn new(parallel_for: HrrParallelForFn, user: *mut c_void) -> Option<Self> {
        Callback::new(parallel_for, user).map(Self)
    }

    fn run(&self, count: usize, body: &(dyn Fn(usize) + Sync)) -> Outcome {
        let taken = (0..count).map(|_| AtomicBool::new(false)).collect();
        let job = Job { body, taken, done: AtomicUsize::new(0), panicked: AtomicBool::new(false) };
        let data = (&raw const job).cast_mut().cast();
        // SAFETY: the host's function, called as its type says; the job outlives the call.
        unsafe { (self.0.function)(self.0.user, count as u32, Some(run_one), data) };
        assert!(!job.panicked.load(Ordering::Acquire), "a task panicked");
        let done = job.done.load(Ordering::Acquire);
        if done < count {
            let message = format!("parallel_for ran {done} of {count} tasks to their end");
            return Err(Failure::new(HRR_ERROR_CALLBACK, message));
        }
        Ok(())
    }
}

/// Runs `body` for each of `count` tasks (below 2^32).
pub(super) fn run(context: &HrrContext, count: usize, body: &(dyn Fn(usize) + Sync)) -> Outcome {
    if let (Some(host), 1..) = (&context.host, count) {
        return host.run(count, body);
    }
    if count <= 1 || context.pool.threads() == 1 {
        (0..count).for_each(body);
    } else {
        context.pool.install(|| (0..count).into_par_iter().with_max_len(1).for_each(body));
    }
    Ok(())
}
