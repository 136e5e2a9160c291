//! Choosing one of many in proportion to weights.

/// A discrete distribution over indices, sampled by binary search in its running sum.
#[derive(Debug, Clone, Default)]
pub struct Discrete {
    cdf: Vec<f64>,
    total: f64,
}

impl Discrete {
    /// Weights must be finite and at least 0; `None` if there are none or all are 0.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut total = 0.0;
        let cdf: Vec<f64> = weights
            .into_iter()
            .map(|w| {
                total += w;
                total
            })
            .collect();
        (total > 0.0 && total.is_finite()).then_some(Self { cdf, total })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cdf.len()
    }

    /// Never true for a value made by [`Discrete::new`].
    pub fn is_empty(&self) -> bool {
        self.cdf.is_empty()
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Probability of an index, 0..=1.
    pub fn probability(&self, index: usize) -> f64 {
        let below = if index == 0 { 0.0 } else { self.cdf[index - 1] };
        (self.cdf[index] - below) / self.total
    }

    /// As [`Discrete::sample`], with where `u` lies within the index's share: uniform in [0,1).
    pub fn sample_and_rest(&self, u: f64) -> (usize, f64) {
        let index = self.sample(u);
        let below = if index == 0 { 0.0 } else { self.cdf[index - 1] };
        let rest = (u * self.total - below) / (self.cdf[index] - below);
        (index, rest.clamp(0.0, 1.0 - f64::EPSILON))
    }

    /// The index that `u` in [0,1) falls on; never one of weight 0.
    #[inline(always)]
    pub fn sample(&self, u: f64) -> usize {
        let target = u * self.total;
        let index = self.cdf.partition_point(|&c| c <= target);
        // u * total may round up to the total: step back to the last entry that has any weight.
        if index < self.cdf.len() { index } else { self.cdf.partition_point(|&c| c < self.total) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_weights_are_never_chosen() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 0.0]).unwrap();
        assert_eq!(d.sample(0.0), 1);
        assert_eq!(d.sample(0.25), 3);
        assert_eq!(d.sample(1.0), 3);
        assert_eq!((d.probability(0), d.probability(1), d.probability(3)), (0.0, 0.25, 0.75));
        assert!(Discrete::new([0.0]).is_none() && Discrete::new([]).is_none());
    }
}
