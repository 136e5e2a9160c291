//! Which light vertices are worth keeping.
//!
//! What comes from a diffuse surface or straight from a lamp, eye subpaths and next-event estimation find as well; what
//! a glossy or perfectly smooth surface has thrown is a caustic. So a light vertex is stored always when its predecessor
//! scatters narrowly, and else with a small probability, which is part of every weight.

use crate::bsdf::Bsdf;

/// The rule by which light vertices are stored.
#[derive(Debug, Clone, Copy)]
pub struct Storing {
    /// Probability of storing a vertex whose predecessor does not scatter narrowly, in (0,1].
    pub share: f64,
    /// GGX roughness up to which scattering is narrow.
    pub max_alpha: f64,
}

impl Storing {
    /// All of them.
    pub const ALL: Self = Self { share: 1.0, max_alpha: 1.0 };

    /// Whether a surface scatters narrowly.
    pub fn is_narrow(&self, bsdf: &Bsdf) -> bool {
        bsdf.narrowest().is_some_and(|alpha| alpha <= self.max_alpha)
    }

    /// The probability of storing a vertex whose predecessor is narrow or not.
    #[inline]
    pub fn probability(&self, after_narrow: bool) -> f64 {
        if after_narrow { 1.0 } else { self.share }
    }
}
