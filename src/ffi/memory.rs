//! A context's memory: counted, and asked of the host beforehand.

use super::pointer::Callback;
use super::status::{Failure, HRR_ERROR_OUT_OF_MEMORY, Outcome};
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Told before memory is taken (bytes above 0: an upper bound; anything but 0 refuses, and the call fails with
/// HRR_ERROR_OUT_OF_MEMORY) and after it is given back (bytes below 0; the answer is not looked at). The sum of all
/// bytes not refused is what the context's caches hold, with the memory kept for the next build. Called by the threads
/// that build and release, by several at once, until the context and its caches are released. Must not throw.
pub type HrrMemoryFn = Option<unsafe extern "C" fn(user: *mut c_void, bytes: i64) -> i32>;

type Function = unsafe extern "C" fn(*mut c_void, i64) -> i32;

/// What a context holds.
#[derive(Debug, Default)]
pub(super) struct Account {
    host: Option<Callback<Function>>,
    bytes: AtomicU64,
    peak: AtomicU64,
}

impl Account {
    pub fn new(memory: HrrMemoryFn, user: *mut c_void) -> Self {
        Self { host: Callback::new(memory, user), ..Self::default() }
    }

    /// Bytes held now, and the most there ever were.
    pub fn figures(&self) -> (u64, u64) {
        (self.bytes.load(Ordering::Relaxed), self.peak.load(Ordering::Relaxed))
    }

    fn tell(&self, bytes: i64) -> i32 {
        // SAFETY: the host's function, called as its type says.
        self.host.map_or(0, |host| unsafe { (host.function)(host.user, bytes) })
    }

    fn take(&self, bytes: u64) -> Outcome {
        if bytes == 0 {
            return Ok(());
        }
        let answer = self.tell(i64::try_from(bytes).unwrap_or(i64::MAX));
        if answer != 0 {
            let message = format!("the host's memory function refused {bytes} bytes ({answer})");
            return Err(Failure::new(HRR_ERROR_OUT_OF_MEMORY, message));
        }
        let now = self.bytes.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        self.peak.fetch_max(now, Ordering::Relaxed);
        Ok(())
    }

    fn give(&self, bytes: u64) {
        if bytes > 0 {
            self.bytes.fetch_sub(bytes, Ordering::Relaxed);
            self.tell(i64::try_from(bytes).map_or(i64::MIN, |b| -b));
        }
    }
}

/// A share of a context's memory, given back when dropped.
#[derive(Debug)]
pub(super) struct Held {
    account: Arc<Account>,
    bytes: u64,
}

impl Held {
    /// At least so many bytes, of which some may be held already.
    pub fn at_least(account: &Arc<Account>, old: [Option<Self>; 2], bytes: u64) -> Outcome<Self> {
        let mut held = Self { account: account.clone(), bytes: 0 };
        for mut other in old.into_iter().flatten() {
            held.bytes += std::mem::take(&mut other.bytes);
        }
        let more = bytes.saturating_sub(held.bytes);
        account.take(more)?;
        held.bytes += more;
        Ok(held)
    }

    /// Divides it into two shares of the given sizes, as far as there is enough, and gives the rest back.
    pub fn split(mut self, first: u64, second: u64) -> (Self, Self) {
        let first = first.min(self.bytes);
        let second = second.min(self.bytes - first);
        let rest = self.bytes - first - second;
        self.bytes = first;
        self.account.give(rest);
        let other = Self { account: self.account.clone(), bytes: second };
        (self, other)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.account.give(self.bytes);
    }
}
