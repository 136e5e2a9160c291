//! Any bytes as light vertices and a query.

#![no_main]

#[path = "../../tests/support/bytes.rs"]
mod bytes;
#[path = "../../tests/support/query_of_bytes.rs"]
mod query_of_bytes;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    query_of_bytes::check(bytes);
});
