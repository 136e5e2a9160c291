//! The recursion of multiple importance sampling: the only file that knows it.
//!
//! A path x_0 (on a light) .. x_{k-1} (the camera) is found by technique s when its first s vertices come from the
//! light. With fw_i and rv_i the area densities of x_i in the direction of light and of eye, technique s has density
//! m_s prod_{i<s} fw_i prod_{i>=s} rv_i, where m_s says how often it tries (docs/theory.md section 6). The weight of s is
//! m_s / (L_s + m_s + E_s), with the densities of all techniques with fewer (L) and more (E) light vertices relative to
//! that of s, every factor raised to the heuristic's power. Merging both subpaths at x_i is a technique of density
//! eta fw_i times that of technique i. Both sums are carried along the two subpaths by one recursion [VCM-TR, eq. 34-40;
//! there dVCM, dVC and dVM, which is part of b here].

pub use crate::settings::Heuristic;

/// m_0: how much a hit of a light by scattering counts for in the weights, beside next-event estimation's 1. Both try once; but the
/// balance heuristic goes by second moments, and of next-event estimation, whose points are spread evenly over lamps, little of
/// these is variance, while hits are rare \[Grittmann19\]. Measured in benches/record/integrators.md.
pub const EYE_HITS: f64 = 0.3;

/// What one subpath knows, at its last vertex x, of the techniques that would have made it from the other end. All in
/// the power of the [`Heuristic`] that it was made with.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Side {
    /// 1 / (area density of x along this subpath).
    #[doc(alias = "dVCM")]
    pub a: f64,
    /// `a` times the sum up to the predecessor, less the density of scattering back to it, which needs the successor.
    #[doc(alias = "dVC")]
    pub b: f64,
}

impl Heuristic {
    /// A density, or a product of densities, in the heuristic's power.
    #[inline]
    pub fn raise(self, density: f64) -> f64 {
        match self {
            Self::Balance => density,
            Self::Power => density * density,
        }
    }

    /// Arrival at a vertex. `pdf_w`: density of the direction taken at the predecessor, 1/sr; `cos`: |cos| at the
    /// new vertex and at the predecessor, between its geometric normal and the edge; `total`:
    /// [`Heuristic::total`] there.
    #[inline]
    pub fn arrive(self, pdf_w: f64, cos: f64, cos_previous: f64, distance2: f64, total: f64) -> Side {
        let inverse = 1.0 / (pdf_w * cos);
        // Kept finite: infinity times a density of 0 would be no number.
        let b = (self.raise(cos_previous * inverse) * total).min(f64::MAX);
        Side { a: self.raise(distance2 * inverse), b }
    }

    /// The sum of the techniques that split a subpath before or at its last edge, and of those that merge before or at
    /// its last vertex, over the area density with which the other subpath would choose the vertex:
    /// L_s = rv_{s-1} total, E_s = fw_s total.
    ///
    /// `m`: how often the technique that connects the last edge tries; `pdf_w_back`: density of scattering back along
    /// that edge when coming from the successor, 1/sr; `merging`: eta, how many vertices of other subpaths are merged
    /// with this one, per unit of their density; 0 where none are.
    #[inline]
    pub fn total(self, side: &Side, m: f64, pdf_w_back: f64, merging: f64) -> f64 {
        (side.a * self.raise(m) + self.raise(merging) + self.raise(pdf_w_back) * side.b).min(f64::MAX)
    }

    /// L or E of a technique, from the area density in which the other subpath would choose the end of a subpath and
    /// the [`Heuristic::total`] there.
    #[inline]
    pub fn others(self, density: f64, total: f64) -> f64 {
        self.raise(density) * total
    }

    /// The weight of merging two subpaths at a vertex with the [`Heuristic::total`]s `light` and `eye`, which both
    /// count it.
    #[inline]
    pub fn merging_weight(self, light: f64, merging: f64, eye: f64) -> f64 {
        let m = self.raise(merging);
        m / (light + (eye - m).max(0.0)).max(f64::MIN_POSITIVE)
    }

    /// The weight of a technique that tries `m` times, above 0, beside the sums of all others.
    #[inline]
    pub fn weight(self, l: f64, m: f64, e: f64) -> f64 {
        let m = self.raise(m);
        m / (l + m + e).max(f64::MIN_POSITIVE)
    }
}

/// The area density of a vertex, given the density of a direction towards it: 1/(world unit)^2.
#[inline]
pub fn per_area(pdf_w: f64, cos: f64, distance2: f64) -> f64 {
    pdf_w * cos / distance2
}
