//! All integration tests, one binary.

mod image;
mod settings;
