//! Random numbers that depend on what they are for, never on who asked first.

pub mod counter;
mod sobol;

pub use counter::{Family, Purpose, Sampler, Stream};
