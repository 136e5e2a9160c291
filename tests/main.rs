//! All integration tests, one binary.

mod loading;
