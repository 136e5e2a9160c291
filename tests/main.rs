//! All integration tests, one binary.

mod loading;
mod hard_cases;
mod fuzz;
mod roulette;
mod vertex_bvh;
mod support;

mod bsdf;
mod light;
mod light_sources;
mod warps;
mod image;
mod settings;
mod cli;
mod agreement;
mod closed_form;
mod ray_offset;
mod visibility;
mod determinism;
mod outliers;
mod effects;
mod layers;
mod mis;
mod techniques;
mod flip;
mod report;
mod study;
mod ffi;
