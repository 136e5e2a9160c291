//! Tools of the statistical tests.
//!
//! A test draws many values, turns the comparison with what they should be into a p-value and adds that to a
//! [`stats::Family`], which fails when any of its p-values is too small for their number. Seeds are fixed: a failure
//! is a defect, not bad luck.

pub mod bytes;
pub mod chart;
pub mod distribution;
pub mod estimate;
pub mod program;
pub mod quadrature;
pub mod calls_of_bytes;
pub mod query_of_bytes;
pub mod scenes;
pub mod shapes;
pub mod stats;

use glam::DVec2;
use hrr::sampler::counter::{combine, mix, unit};

/// A stream of random numbers.
pub struct Random(u64);

impl Random {
    /// The stream of a key.
    pub fn new(key: u64) -> Self {
        Self(combine(0x5851_f42d_4c95_7f2d, key))
    }

    /// Uniform in [0,1).
    pub fn u1(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        unit(mix(self.0))
    }

    /// Two uniforms in [0,1).
    pub fn u2(&mut self) -> DVec2 {
        DVec2::new(self.u1(), self.u1())
    }
}
