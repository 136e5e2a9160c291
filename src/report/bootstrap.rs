//! Confidence intervals by resampling [Efron 1979].

use crate::sampler::counter::{combine, mix, unit};

/// Resamples of each interval.
const RESAMPLES: u64 = 1000;

/// A number with the interval that holds it with 90 % confidence.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Interval {
    /// The best guess.
    pub value: f64,
    /// Lower end: 5 % lie below.
    pub low: f64,
    /// Upper end: 5 % lie above.
    pub high: f64,
}

impl Interval {
    /// The interval of a statistic of `n` runs. `statistic` gets the numbers of the runs, some of them more than once; the
    /// same for every call with the same `n`, so that runs that were interleaved stay paired.
    pub fn new(n: usize, statistic: impl Fn(&[usize]) -> f64) -> Self {
        let value = statistic(&(0..n).collect::<Vec<_>>());
        let mut values: Vec<f64> = (0..RESAMPLES)
            .map(|k| {
                let pick = |i: usize| (unit(mix(combine(k, i as u64))) * n as f64) as usize;
                statistic(&(0..n).map(pick).collect::<Vec<_>>())
            })
            .filter(|v| !v.is_nan())
            .collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            values.get(((values.len() as f64 * share) as usize).min(values.len().saturating_sub(1))).copied()
        };
        Self { value, low: at(0.05).unwrap_or(f64::NAN), high: at(0.95).unwrap_or(f64::NAN) }
    }

    /// Whether a number is inside.
    pub fn holds(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_lies_in_nine_of_ten_intervals() {
        let mut inside = 0;
        for key in 0..300 {
            let values: Vec<f64> = (0..16).map(|i| unit(mix(combine(combine(77, key), i)))).collect();
            let mean = |runs: &[usize]| runs.iter().map(|&r| values[r]).sum::<f64>() / runs.len() as f64;
            inside += u32::from(Interval::new(16, mean).holds(0.5));
        }
        // Of 16 values the bootstrap is known to be a little narrow.
        assert!((248..288).contains(&inside), "{inside} of 300");
    }
}
