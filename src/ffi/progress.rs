//! How far a call is, told to a host that may end it.

use super::pointer::Callback;
use super::status::{Failure, HRR_ERROR_CANCELLED, Outcome};
use std::ffi::c_void;

/// Told how much is done, from 0 to 1; anything but 0 ends the call. Called now and then by one thread at a time, which
/// need not be the caller's. Must not throw.
pub type HrrProgressFn = Option<unsafe extern "C" fn(user: *mut c_void, done: f64) -> i32>;

type Function = unsafe extern "C" fn(*mut c_void, f64) -> i32;

/// Whom to tell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress(Option<Callback<Function>>);

impl Progress {
    pub const NONE: Self = Self(None);

    pub fn new(progress: HrrProgressFn, user: *mut c_void) -> Self {
        Self(Callback::new(progress, user))
    }

    /// Tells; an error when the host wants to end.
    pub fn at(&self, done: f64) -> Outcome {
        // SAFETY: the host's function, called as its type says.
        match self.0.map_or(0, |host| unsafe { (host.function)(host.user, done) }) {
            0 => Ok(()),
            answer => {
                let message = format!("progress returned {answer} at {:.0} %", 100.0 * done);
                Err(Failure::new(HRR_ERROR_CANCELLED, message))
            }
        }
    }
}
