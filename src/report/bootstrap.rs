//! Confidence intervals by resampling [Efron 1979].

use crate::sampler::counter::{combine, mix, unit};

/// Resamples of each interval.
const RESAMPLES: u64 = 1000;

/// 95 % quantile of the normal distribution.
const NORMAL_95: f64 = 1.644_853_626_951_472_7;

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
    /// The interval of a statistic of `n` runs, at least 2. It is read off farther out in the resamples than at 5 % and
    /// 95 %: these are as narrow as if the runs' scatter were known, and n / (n - 1) times as narrow in variance [Hesterberg
    /// 2015, "expanded percentile intervals"]. `statistic` gets the numbers of the runs, some of them more than once; the
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
        let below = expanded_tail(n);
        Self { value, low: at(below).unwrap_or(f64::NAN), high: at(1.0 - below).unwrap_or(f64::NAN) }
    }

    /// Whether a number is inside.
    pub fn holds(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// The share of resamples outside each end of an interval of 90 % from `n` runs: that of the normal distribution below
/// Student's quantile, widened by the root of n / (n - 1).
fn expanded_tail(n: usize) -> f64 {
    let (n, z) = (n.max(2) as f64, NORMAL_95);
    let nu = n - 1.0;
    // Student's quantile by its expansion in 1 / nu [Abramowitz & Stegun 26.7.5]: to 1 % from nu = 3.
    let t = z
        + (z.powi(3) + z) / (4.0 * nu)
        + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * nu.powi(2))
        + (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / (384.0 * nu.powi(3));
    0.5 * libm::erfc(t * (n / nu).sqrt() * std::f64::consts::FRAC_1_SQRT_2)
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
        // 270 on average, with a standard deviation of 5.
        assert!((255..286).contains(&inside), "{inside} of 300");
    }

    #[test]
    fn tails_are_those_of_students_quantile() {
        // t of 15, 7 and 3 degrees of freedom at 95 %: 1.7531, 1.8946, 2.3534; to infinity 1.6449.
        for (n, t) in [(16, 1.7531f64), (8, 1.8946), (4, 2.3534), (1_000_000, 1.644_86)] {
            let nu = f64::from(n) - 1.0;
            let tail = 0.5 * libm::erfc(t * (f64::from(n) / nu / 2.0).sqrt());
            let ours = expanded_tail(n as usize);
            assert!((ours / tail - 1.0).abs() < 0.03, "{n}: {ours} {tail}");
        }
    }
}
