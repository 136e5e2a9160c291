//! All integration tests, one binary.

mod hard_cases;
mod roulette;
mod support;

mod bsdf;
mod warps;
mod image;
mod settings;
mod cli;
