//! All integration tests, one binary.

mod support;

mod bsdf;
mod warps;
