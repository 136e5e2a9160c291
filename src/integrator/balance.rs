//! How an iteration's time is divided between its two sides, by what earlier ones showed.
//!
//! More light subpaths lower the noise of the roulette and of light that is seen by the camera, more eye samples that of
//! the roulette and of the rest. What is least is the error relative to the pixels' brightness, when eye samples are spread
//! as they best are.

use super::spread::Play;
use super::watched::{Need, around, weights};

/// Shares that are tried: from the least to the most in equal steps of their logarithm.
const TRIED: (f64, f64, u32) = (0.03, 0.6, 25);
/// Share of the pixels, those with the largest error, that nothing is decided by.
const TRIMMED: f64 = 1e-3;

/// What an iteration to come has, and what things cost.
#[derive(Debug, Clone, Copy)]
pub struct Costs {
    /// Seconds to divide.
    pub seconds: f64,
    /// Seconds of a light subpath.
    pub per_subpath: f64,
    /// Seconds of a sample in every pixel, as the last iteration took them.
    pub per_sample: f64,
}

/// What is known of an iteration before.
#[derive(Debug)]
pub(super) struct Known<'a> {
    /// What pixels need.
    pub needs: &'a [Need],
    /// Variance of what the camera saw of light vertices, for each pixel of so many columns.
    pub splats: &'a [f64],
    pub width: usize,
    /// Light subpaths that these were told from.
    pub light_subpaths: f64,
    /// What the visit of a node costs, over all that a sample costs without the roulette.
    pub visit: f64,
    /// The mean of what a sample cost, in the same unit.
    pub sample: f64,
}

impl Known<'_> {
    /// The share of the time that the light side should have; `None` where nothing is noisy.
    pub fn light_share(&self, costs: &Costs) -> Option<f64> {
        let weights = weights(self.needs);
        let splats: Vec<f64> = around(self.splats, self.width, |sum: &mut f64, v| *sum += v)
            .into_iter()
            .map(|(sum, n)| sum / n)
            .collect();
        let (least, most, steps) = TRIED;
        let share = |step: u32| least * (most / least).powf(f64::from(step) / f64::from(steps - 1));
        let errors = (0..steps).map(|step| (share(step), self.error(&weights, &splats, costs, share(step))));
        let (share, error) = errors.min_by(|a, b| a.1.total_cmp(&b.1))?;
        (error > 0.0 && error.is_finite()).then_some(share)
    }

    /// The sum of relative square errors of pixels, without the largest.
    fn error(&self, weights: &[f64], splats: &[f64], costs: &Costs, share: f64) -> f64 {
        let subpaths = share * costs.seconds / costs.per_subpath.max(1e-12);
        let fewer = self.light_subpaths / subpaths.max(1.0);
        let plays: Vec<(f64, Play)> = weights
            .iter()
            .zip(self.needs)
            .map(|(weight, need)| {
                let play = Play::best(&Need { roulette: need.roulette * fewer, ..*need }, self.visit);
                (weight * (play.variance / play.cost).sqrt(), play)
            })
            .collect();
        // Samples of pixels are proportional to the first of each pair; their cost adds up to the eye side's.
        let unit = costs.per_sample / self.sample / weights.len() as f64;
        let wanted: f64 = plays.iter().map(|(n, play)| n * play.cost).sum();
        let scale = (1.0 - share) * costs.seconds / unit.max(1e-12) / wanted.max(f64::MIN_POSITIVE);
        let mut errors: Vec<f64> = plays
            .iter()
            .zip(weights.iter().zip(splats))
            .map(|((n, play), (weight, splats))| {
                let samples = (n * scale).max(f64::MIN_POSITIVE);
                weight * weight * (play.variance / samples + splats * fewer)
            })
            .collect();
        let kept = errors.len() - (TRIMMED * errors.len() as f64) as usize;
        if kept < errors.len() {
            errors.select_nth_unstable_by(kept, f64::total_cmp);
        }
        errors[..kept].iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::watched::tests::watched;
    use super::*;

    /// The share for noise of the roulette, of the rest and of splats, where both sides are as dear.
    fn share(roulette: f64, rest: f64, splats: f64) -> Option<f64> {
        let needs = watched(|_| (roulette, rest), 0.0).needs().unwrap();
        let known = Known {
            needs: &needs,
            splats: &[splats; 800],
            width: 40,
            light_subpaths: 1e6,
            visit: 0.0,
            sample: 1.0,
        };
        known.light_share(&Costs { seconds: 2.0, per_subpath: 1e-6, per_sample: 0.1 })
    }

    #[test]
    fn time_goes_to_the_side_that_is_noisy() {
        // With r the roulette's variance, were all the time the light side's, over the rest's: (l + r) / (l (1 - l)) is
        // least at l = sqrt(r^2 + r) - r. Half of the time makes the million subpaths that the noise is told from.
        for ratio in [1e-2, 0.1, 1.0, 10.0] {
            let r: f64 = 0.5 * ratio;
            let want = (r * r + r).sqrt() - r;
            let got = share((ratio * 0.01f64).sqrt(), 0.1, 0.0).unwrap();
            assert!((got / want).ln().abs() < 0.08, "{ratio}: {got}, not {want}");
        }
        // Half and half for splats that are as noisy as all samples, 0.01 / 10 with half of the time.
        let got = share(0.0, 0.1, 1e-3).unwrap();
        assert!((got - 0.5).abs() < 0.04, "{got}");
        assert_eq!(share(0.0, 0.1, 0.0), Some(TRIED.0));
        assert_eq!(share(0.0, 0.0, 0.0), None);
    }
}
