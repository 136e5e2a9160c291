//! Any bytes as calls of the C interface.

#![no_main]

#[path = "../../tests/support/bytes.rs"]
mod bytes;
#[path = "../../tests/support/calls_of_bytes.rs"]
mod calls_of_bytes;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    calls_of_bytes::check(bytes);
});
