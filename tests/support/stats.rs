//! From measurements to p-values, and from many p-values to one verdict.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT, Uniform};
use statrs::stats_tests::NaNPolicy;
use statrs::stats_tests::ks_test::{KSOneSampleAlternativeMethod, ks_onesample};

/// How often a family of tests may fail by chance.
pub const SIGNIFICANCE: f64 = 0.01;

/// Least count a bin of a chi^2 test must expect.
const MIN_EXPECTED: f64 = 5.0;

/// Tests that stand and fall together.
#[derive(Default)]
pub struct Family {
    tests: Vec<(String, f64)>,
}

impl Family {
    /// Adds a test's name and p-value.
    pub fn add(&mut self, name: impl Into<String>, p: f64) {
        self.tests.push((name.into(), p));
    }

    /// Number of tests.
    pub fn len(&self) -> usize {
        self.tests.len()
    }

    /// Fails if any p-value is below what the least of that many would be by chance [Sidak 1967].
    #[track_caller]
    pub fn assert(&self) {
        assert!(!self.tests.is_empty(), "no tests in the family");
        let limit = sidak(SIGNIFICANCE, self.tests.len());
        let failed: Vec<_> = self.tests.iter().filter(|(_, p)| !(*p >= limit)).collect();
        assert!(
            failed.is_empty(),
            "{} of {} rejected (p < {limit:.2e}):{}",
            failed.len(),
            self.tests.len(),
            failed.iter().map(|(name, p)| format!("\n  {name}: p = {p:.2e}")).collect::<String>()
        );
    }
}

/// The significance of each of `n` independent tests that together have `significance`.
pub fn sidak(significance: f64, n: usize) -> f64 {
    -((-significance).ln_1p() / n as f64).exp_m1()
}

/// Two-sided p-value of a standard normal deviate.
pub fn z_p(z: f64) -> f64 {
    2.0 * Normal::standard().sf(z.abs())
}

/// p-value of counts against expected counts (Pearson's chi^2). The sums must agree: give every outcome a bin, also
/// "nothing". Bins that expect too little for the test are pooled; panics if less than two are left.
pub fn chi2_p(observed: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len());
    if expected.iter().any(|e| !(*e >= 0.0)) {
        return 0.0;
    }
    let mut bins: Vec<(f64, f64)> = expected.iter().copied().zip(observed.iter().copied()).collect();
    bins.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pooled: Vec<(f64, f64)> = Vec::new();
    let mut open = (0.0, 0.0);
    for (e, o) in bins {
        open = (open.0 + e, open.1 + o);
        if open.0 >= MIN_EXPECTED {
            pooled.push(std::mem::take(&mut open));
        }
    }
    if let Some(last) = pooled.last_mut() {
        *last = (last.0 + open.0, last.1 + open.1);
    }
    assert!(pooled.len() >= 2, "chi^2 needs two bins that expect {MIN_EXPECTED} counts");
    let x: f64 = pooled.iter().map(|(e, o)| (o - e).powi(2) / e).sum();
    ChiSquared::new((pooled.len() - 1) as f64).unwrap().sf(x)
}

/// p-value of a sample against a continuous cumulative distribution (Kolmogorov-Smirnov, asymptotic: n >= 100).
pub fn ks_p(sample: impl IntoIterator<Item = f64>, cdf: impl Fn(f64) -> f64) -> f64 {
    let ranks: Vec<f64> = sample.into_iter().map(cdf).collect();
    assert!(ranks.len() >= 100 && ranks.iter().all(|r| (0.0..=1.0).contains(r)));
    let uniform = Uniform::new(0.0, 1.0).unwrap();
    let method = KSOneSampleAlternativeMethod::TwoSidedAsymptotic;
    ks_onesample(ranks, &uniform, method, NaNPolicy::Error).unwrap().1.clamp(0.0, 1.0)
}

/// Running mean and variance [Welford 1962].
#[derive(Debug, Default, Clone, Copy)]
pub struct Moments {
    n: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Takes a value in.
    pub fn push(&mut self, x: f64) {
        self.n += 1.0;
        let d = x - self.mean;
        self.mean += d / self.n;
        self.squares += d * (x - self.mean);
    }

    /// The mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Variance of the mean.
    pub fn variance_of_mean(&self) -> f64 {
        self.squares / (self.n - 1.0) / self.n
    }

    /// p-value of the mean against a number known up to `error` (Z-test: many values of finite variance).
    pub fn z_test(&self, expected: f64, error: f64) -> f64 {
        let off = ((self.mean - expected).abs() - error).max(0.0);
        if off == 0.0 { 1.0 } else { z_p(off / self.variance_of_mean().sqrt()) }
    }

    /// p-value of two means being the same, whatever their variances [Welch 1947].
    pub fn welch(&self, other: &Self) -> f64 {
        let (a, b) = (self.variance_of_mean(), other.variance_of_mean());
        if a + b == 0.0 {
            return if self.mean == other.mean { 1.0 } else { 0.0 };
        }
        let freedom = (a + b).powi(2) / (a * a / (self.n - 1.0) + b * b / (other.n - 1.0));
        let t = (self.mean - other.mean) / (a + b).sqrt();
        2.0 * StudentsT::new(0.0, 1.0, freedom).unwrap().sf(t.abs())
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<T: IntoIterator<Item = f64>>(values: T) -> Self {
        let mut m = Self::default();
        values.into_iter().for_each(|x| m.push(x));
        m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::Random;

    #[test]
    fn p_values_are_uniform_when_all_is_well() {
        let mut rng = Random::new(1);
        let mut p: [Vec<f64>; 4] = Default::default();
        for _ in 0..400 {
            let (mut counts, expected) =
                ([0.0; 10], [20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 40.0, 38.0, 1.0, 1.0]);
            for _ in 0..200 {
                let (mut i, mut u) = (0, rng.u1() * 200.0);
                while u >= expected[i] {
                    u -= expected[i];
                    i += 1;
                }
                counts[i] += 1.0;
            }
            p[0].push(chi2_p(&counts, &expected));
            p[1].push(ks_p((0..200).map(|_| rng.u1().sqrt()), |x| x * x));
            let mut mean = |n, scale| (0..n).map(|_| (rng.u1() - 0.5) * scale).collect::<Moments>();
            p[2].push(mean(1000, 1.0).z_test(0.0, 0.0));
            p[3].push(mean(20, 1.0).welch(&mean(100, 5.0)));
        }
        let mut family = Family::default();
        for (name, p) in ["chi2", "ks", "z", "welch"].into_iter().zip(p) {
            family.add(name, ks_p(p, |p| p));
        }
        family.assert();
    }

    #[test]
    fn wrong_distributions_are_rejected() {
        let mut rng = Random::new(2);
        assert!(chi2_p(&[520.0, 480.0, 0.0], &[600.0, 400.0, 0.0]) < 1e-6);
        assert!(chi2_p(&[500.0, 495.0, 5.0], &[500.0, 500.0, 0.0]) > 0.5, "pooled zero bins carry on");
        assert!(chi2_p(&[500.0, 400.0, 100.0], &[500.0, 500.0, 0.0]) < 1e-4);
        assert_eq!(chi2_p(&[1.0, 1.0], &[f64::NAN, 1.0]), 0.0);
        assert!(ks_p((0..2000).map(|_| rng.u1()), |x| x.powf(1.2)) < 1e-6);
        let a: Moments = (0..10_000).map(|_| rng.u1()).collect();
        let b: Moments = (0..10_000).map(|_| 1.1 * rng.u1()).collect();
        assert!(a.z_test(0.55, 0.0) < 1e-6 && a.z_test(0.55, 0.1) == 1.0 && a.welch(&b) < 1e-6);
    }

    #[test]
    #[should_panic(expected = "1 of 2 rejected")]
    fn a_family_fails_with_its_worst_member() {
        let mut family = Family::default();
        family.add("good", 0.006); // under 0.01, but not rare for the lesser of two
        family.add("bad", 0.004);
        family.assert();
    }
}
