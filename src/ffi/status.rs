//! What calls return, the text of the last error, versions.

use crate::Error;
use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a call returns: HRR_OK or one of HRR_ERROR_*. An integer, so that numbers of later versions stay defined.
pub type HrrStatus = i32;

// Numbers are never reused.

/// The call did what it says.
pub const HRR_OK: HrrStatus = 0;
/// An argument is NULL, out of its range or contradicts another.
pub const HRR_ERROR_INVALID_ARGUMENT: HrrStatus = 1;
/// The call does not fit what was called before: an end without a beginning, two beginnings.
pub const HRR_ERROR_INVALID_STATE: HrrStatus = 2;
/// An input is NaN, infinite, or too large for single precision; the message names it.
pub const HRR_ERROR_NON_FINITE: HrrStatus = 3;
/// The memory is not there, or max_bytes does not allow it.
pub const HRR_ERROR_OUT_OF_MEMORY: HrrStatus = 4;
/// The host's progress function ended the call.
pub const HRR_ERROR_CANCELLED: HrrStatus = 5;
/// The results do not fit; the number that would is written. The same call again gives the same results.
pub const HRR_ERROR_BUFFER_TOO_SMALL: HrrStatus = 6;
/// Header and library do not belong together, or a struct_size is none.
pub const HRR_ERROR_ABI: HrrStatus = 7;
/// A file cannot be read or written, or is not what it should be; the message names it, with the line where it has any.
pub const HRR_ERROR_IO: HrrStatus = 8;
/// A function of the host asked to stop, or did not do its work.
pub const HRR_ERROR_CALLBACK: HrrStatus = 9;
/// A bug in this library, caught at its border.
pub const HRR_ERROR_PANIC: HrrStatus = 10;
/// Something below failed (threads), or the self-test found a difference.
pub const HRR_ERROR_INTERNAL: HrrStatus = 11;

/// The interface that this header describes; for hrr_check_abi.
pub const HRR_ABI: u32 = 1;

/// Why a call failed.
#[derive(Debug)]
pub(super) struct Failure {
    pub status: HrrStatus,
    pub message: String,
}

pub(super) type Outcome<T = ()> = std::result::Result<T, Failure>;

impl Failure {
    pub fn new(status: HrrStatus, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    pub fn argument(message: impl Into<String>) -> Self {
        Self::new(HRR_ERROR_INVALID_ARGUMENT, message)
    }

    pub fn non_finite(message: impl Into<String>) -> Self {
        Self::new(HRR_ERROR_NON_FINITE, message)
    }

    pub fn panic(payload: Box<dyn Any + Send>) -> Self {
        let text = payload.downcast_ref::<&str>().copied().map(str::to_owned);
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
        // A payload may panic when dropped.
        std::mem::forget(payload);
        Self::new(HRR_ERROR_PANIC, format!("bug in hrr: {}", text.as_deref().unwrap_or("no message")))
    }

    /// Keeps the message for this thread's `hrr_last_error`.
    pub fn record(self) -> HrrStatus {
        let text = CString::new(self.message.replace('\0', " ")).unwrap_or_default();
        // A thread that is ending has nobody left to ask.
        let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = text);
        self.status
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::Memory(_) => HRR_ERROR_OUT_OF_MEMORY,
            Error::Scene { .. } | Error::Output { .. } => HRR_ERROR_IO,
            Error::Internal(_) => HRR_ERROR_INTERNAL,
            _ => HRR_ERROR_INVALID_ARGUMENT,
        };
        Self::new(status, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Runs what a C function does: no panic leaves, errors become a status and a message.
pub(super) fn guard(body: impl FnOnce() -> Outcome) -> HrrStatus {
    // Unwind safety: what a body changes is either its host's (and undefined after an error) or behind a lock.
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => HRR_OK,
        Ok(Err(failure)) => failure.record(),
        Err(payload) => Failure::panic(payload).record(),
    }
}

/// The library's version: major << 16 | minor << 8 | patch. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_version() -> u32 {
    const fn number(text: &str) -> u32 {
        let (bytes, mut n, mut i) = (text.as_bytes(), 0, 0);
        while i < bytes.len() {
            n = 10 * n + (bytes[i] - b'0') as u32;
            i += 1;
        }
        n
    }
    const MAJOR: u32 = number(env!("CARGO_PKG_VERSION_MAJOR"));
    const MINOR: u32 = number(env!("CARGO_PKG_VERSION_MINOR"));
    const PATCH: u32 = number(env!("CARGO_PKG_VERSION_PATCH"));
    MAJOR << 16 | MINOR << 8 | PATCH
}

/// The library's version as text, and the libraries it was built with. Static: never freed. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_version_string() -> *const c_char {
    macro_rules! text {
        ($with:literal) => {
            concat!("hrr ", env!("CARGO_PKG_VERSION"), $with, "\0")
        };
    }
    let text = match (cfg!(feature = "embree"), cfg!(feature = "oiio")) {
        (true, true) => text!(" (embree, oiio)"),
        (true, false) => text!(" (embree)"),
        (false, true) => text!(" (oiio)"),
        (false, false) => text!(""),
    };
    text.as_ptr().cast()
}

/// HRR_OK when the library serves the interface of the header; call hrr_check_abi(HRR_ABI) first. Any thread.
///
/// Errors: HRR_ERROR_ABI.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_check_abi(header_abi: u32) -> HrrStatus {
    guard(|| {
        if header_abi == HRR_ABI {
            return Ok(());
        }
        let message = format!("hrr.h is of interface {header_abi}, the library of {HRR_ABI}");
        Err(Failure::new(HRR_ERROR_ABI, message))
    })
}

/// A status' name, as in this header; "unknown status" for others. Static: never freed. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_status_name(status: HrrStatus) -> *const c_char {
    let name: &CStr = match status {
        HRR_OK => c"HRR_OK",
        HRR_ERROR_INVALID_ARGUMENT => c"HRR_ERROR_INVALID_ARGUMENT",
        HRR_ERROR_INVALID_STATE => c"HRR_ERROR_INVALID_STATE",
        HRR_ERROR_NON_FINITE => c"HRR_ERROR_NON_FINITE",
        HRR_ERROR_OUT_OF_MEMORY => c"HRR_ERROR_OUT_OF_MEMORY",
        HRR_ERROR_CANCELLED => c"HRR_ERROR_CANCELLED",
        HRR_ERROR_BUFFER_TOO_SMALL => c"HRR_ERROR_BUFFER_TOO_SMALL",
        HRR_ERROR_ABI => c"HRR_ERROR_ABI",
        HRR_ERROR_IO => c"HRR_ERROR_IO",
        HRR_ERROR_CALLBACK => c"HRR_ERROR_CALLBACK",
        HRR_ERROR_PANIC => c"HRR_ERROR_PANIC",
        HRR_ERROR_INTERNAL => c"HRR_ERROR_INTERNAL",
        _ => c"unknown status",
    };
    name.as_ptr()
}

/// What went wrong in this thread's last call that failed, in English; "" when none has. Calls that succeed leave it
/// alone. Valid until this thread's next call that fails; never freed by the host.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_last_error() -> *const c_char {
    LAST_ERROR.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last() -> String {
        // SAFETY: the text is this thread's and not replaced while it is copied.
        unsafe { CStr::from_ptr(hrr_last_error()) }.to_str().unwrap().to_owned()
    }

    #[test]
    fn panics_become_a_status_and_a_message() {
        assert_eq!(guard(|| panic!("at {}", 7)), HRR_ERROR_PANIC);
        assert_eq!(last(), "bug in hrr: at 7");
        assert_eq!(guard(|| std::panic::panic_any(3)), HRR_ERROR_PANIC);
        assert_eq!(last(), "bug in hrr: no message");
        assert_eq!(guard(|| Err(Failure::argument("a\0b"))), HRR_ERROR_INVALID_ARGUMENT);
        assert_eq!(guard(|| Ok(())), HRR_OK);
        assert_eq!(last(), "a b");
    }
}
