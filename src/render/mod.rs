//! (being written)

pub mod counters;
pub mod observer;
