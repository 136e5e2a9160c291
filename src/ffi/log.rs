//! What the library has to say to a host, beside errors.

use super::pointer::Callback;
use std::ffi::{CString, c_char, c_void};

/// Nothing is said.
pub const HRR_LOG_OFF: u32 = 0;
/// What went wrong without a call that could say so.
pub const HRR_LOG_ERROR: u32 = 1;
/// What hosts and users should know: light vertices left out, remarks on scene files.
pub const HRR_LOG_WARNING: u32 = 2;
/// What was done: builds, renders, with figures.
pub const HRR_LOG_INFO: u32 = 3;

/// Takes a message (one sentence in UTF-8, valid during the call) of a level, one of HRR_LOG_*. Called by any thread, by
/// several at once. Must not throw.
pub type HrrLogFn = Option<unsafe extern "C" fn(user: *mut c_void, level: u32, message: *const c_char)>;

type Function = unsafe extern "C" fn(*mut c_void, u32, *const c_char);

/// Where messages go, up to a level.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Log {
    to: Option<Callback<Function>>,
    level: u32,
}

impl Log {
    pub fn new(log: HrrLogFn, user: *mut c_void, level: u32) -> Self {
        Self { to: Callback::new(log, user), level }
    }

    /// Says something, made only when somebody listens.
    pub fn say(&self, level: u32, message: impl FnOnce() -> String) {
        let Some(to) = self.to.filter(|_| level <= self.level) else { return };
        let text = CString::new(message().replace('\0', " ")).unwrap_or_default();
        // SAFETY: the host's function, called as its type says; the text outlives the call.
        unsafe { (to.function)(to.user, level, text.as_ptr()) };
    }
}
