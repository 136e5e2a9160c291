//! Contexts: threads, and memory that builds hand to each other.

use super::cache::Storage;
use super::capture::Capture;
use super::log::{HRR_LOG_INFO, HrrLogFn, Log};
use super::memory::{Account, HrrMemoryFn};
use super::pointer::{self, Out};
use super::segment::Gathered;
use super::status::{Failure, HRR_ERROR_INTERNAL, HrrStatus, Outcome, guard};
use super::tasks::HostThreads;
use std::ffi::c_void;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

/// A task of hrr_query_batch: call it once for each index, from any thread, all before parallel_for returns.
pub type HrrTaskFn = Option<unsafe extern "C" fn(task_data: *mut c_void, index: u32)>;

/// The host's way to run tasks on its own threads: calls task(task_data, i) once for each i in [0, count), in any
/// order, at the same time or one after the other, and returns when all of them have ended. Must not throw.
pub type HrrParallelForFn =
    Option<unsafe extern "C" fn(user: *mut c_void, count: u32, task: HrrTaskFn, task_data: *mut c_void)>;

/// How to make a context. Zero it, then set struct_size and what is wanted.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrContextDesc {
    /// sizeof(HrrContextDesc).
    pub struct_size: u32,
    /// Threads of the context's own pool, for builds and batches: 0 = one for each processor.
    pub threads: u32,
    /// The host's threads, for batches in place of the pool; NULL = none. Builds always use the pool.
    pub parallel_for: HrrParallelForFn,
    /// Passed to parallel_for.
    pub parallel_user: *mut c_void,
    /// Where messages go; NULL = nowhere.
    pub log: HrrLogFn,
    /// Passed to log.
    pub log_user: *mut c_void,
    /// HRR_LOG_*: the highest level that is said; 0 = nothing.
    pub log_level: u32,
    /// 0.
    pub reserved: u32,
    /// Asked for memory; NULL = nobody is.
    pub memory: HrrMemoryFn,
    /// Passed to memory.
    pub memory_user: *mut c_void,
}

/// Threads and spare memory. May be used from any thread, by several at once. Opaque; see hrr_context_new.
#[derive(Debug)]
pub struct HrrContext {
    pub(super) pool: Pool,
    pub(super) host: Option<HostThreads>,
    pub(super) spare: Arc<Spare>,
    pub(super) log: Log,
    pub(super) account: Arc<Account>,
    pub(super) capture: Arc<Capture>,
}

/// Buffers of released caches and of builds, for the next build.
#[derive(Debug, Default)]
pub(super) struct Spare {
    storage: Mutex<Option<Storage>>,
    gathered: Mutex<Option<Gathered>>,
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing is ever half done under these locks.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Spare {
    pub fn take(&self) -> (Storage, Gathered) {
        let storage = lock(&self.storage).take();
        (storage.unwrap_or_default(), lock(&self.gathered).take().unwrap_or_default())
    }

    pub fn give_storage(&self, storage: Storage) {
        let old = lock(&self.storage).replace(storage);
        drop(old);
    }

    pub fn give_gathered(&self, gathered: Gathered) {
        let old = lock(&self.gathered).replace(gathered);
        drop(old);
    }
}

/// Threads that have ended when it is dropped: the host may unload the library next.
#[derive(Debug)]
pub(super) struct Pool {
    /// Not there while dropping only.
    pool: Option<rayon::ThreadPool>,
    threads: Vec<JoinHandle<()>>,
}

impl Pool {
    fn new(count: usize) -> Outcome<Self> {
        let mut threads = Vec::new();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .spawn_handler(|worker| {
                let name = format!("hrr {}", worker.index());
                threads.push(thread::Builder::new().name(name).spawn(|| worker.run())?);
                Ok(())
            })
            .build()
            .map_err(|e| Failure::new(HRR_ERROR_INTERNAL, format!("the thread pool: {e}")))?;
        Ok(Self { pool: Some(pool), threads })
    }

    pub fn threads(&self) -> usize {
        self.threads.len()
    }

    /// Runs work on one of the threads and waits for it.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.pool = None;
        for thread in self.threads.drain(..) {
            // A thread that panicked has ended, too.
            let _ = thread.join();
        }
    }
}

/// Most threads of a pool.
const MAX_THREADS: u32 = 4096;

impl HrrContext {
    pub(super) fn new(desc: Option<HrrContextDesc>) -> Outcome<Self> {
        let threads = desc.map_or(0, |d| d.threads);
        if threads > MAX_THREADS {
            return Err(Failure::argument(format!("desc->threads is {threads}: at most {MAX_THREADS}")));
        }
        let level = desc.map_or(0, |d| d.log_level);
        if level > HRR_LOG_INFO || desc.is_some_and(|d| d.reserved != 0) {
            let message = format!("desc->log_level is {level}: no HRR_LOG_*, or desc->reserved is not 0");
            return Err(Failure::argument(message));
        }
        let pool = Pool::new(threads as usize)?;
        let host = desc.and_then(|d| HostThreads::new(d.parallel_for, d.parallel_user));
        let log = desc.map_or(Log::default(), |d| Log::new(d.log, d.log_user, level));
        let account = Arc::new(desc.map_or(Account::default(), |d| Account::new(d.memory, d.memory_user)));
        log.say(HRR_LOG_INFO, || format!("hrr {}, {} threads", env!("CARGO_PKG_VERSION"), pool.threads()));
        Ok(Self { pool, host, spare: Arc::default(), log, account, capture: Arc::default() })
    }
}

/// Makes a context with one reference, which hrr_context_release gives up. desc: NULL for the defaults. It starts the
/// threads of its pool, which sleep until there is work. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI, HRR_ERROR_INTERNAL (no threads to be had).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_context_new(
    desc: *const HrrContextDesc,
    out_context: *mut *mut HrrContext,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let out = unsafe { Out::new(out_context, "out_context") }?;
        // SAFETY: this module's contract.
        let desc = if desc.is_null() { None } else { Some(unsafe { pointer::sized(desc, "desc") }?) };
        out.write(pointer::handle(HrrContext::new(desc)?));
        Ok(())
    })
}

/// Adds a reference; NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_context_retain(context: *mut HrrContext) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::retain(context) };
        Ok(())
    });
}

/// Gives up a reference; the last one ends the context's threads and waits for that. NULL is allowed. Caches live on
/// without their context. Any thread, but not within a callback.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_context_release(context: *mut HrrContext) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::release(context) };
        Ok(())
    });
}

/// What a context holds. Set struct_size before the call.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrContextInfo {
    /// sizeof(HrrContextInfo).
    pub struct_size: u32,
    /// Threads of the pool.
    pub threads: u32,
    /// Bytes that the context's caches hold, with the memory kept for the next build. Geometry and scenes are not
    /// counted.
    pub bytes: u64,
    /// The most that `bytes` ever was, by upper bounds while builds went on.
    pub peak_bytes: u64,
}

/// Describes a context. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_context_info(
    context: *const HrrContext,
    info: *mut HrrContextInfo,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, (out, struct_size)) =
            unsafe { (pointer::object(context, "context")?, pointer::sized_out(info, "info")?) };
        let (bytes, peak_bytes) = context.account.figures();
        let threads = context.pool.threads() as u32;
        out.write(HrrContextInfo { struct_size, threads, bytes, peak_bytes });
        Ok(())
    })
}

/// Frees the memory that the context keeps for its next build. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_context_trim(context: *const HrrContext) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let context = unsafe { pointer::object(context, "context") }?;
        drop(context.spare.take());
        Ok(())
    })
}
