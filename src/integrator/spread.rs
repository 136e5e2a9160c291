//! How eye samples are spread over the pixels of an iteration, by what earlier ones showed.
//!
//! Pixels differ in noise by orders of magnitude, and so does what the roulette gives to them. Samples go where they lower
//! the relative error most, and where the roulette is little of a pixel's noise, only a share of the samples plays it, each
//! for as many as do not. The sums stay unbiased: a plan depends on earlier iterations only.

use super::watched::{Need, Watched, weights};

/// Bounds of a pixel's samples over the mean number.
const SAMPLES: (f64, f64) = (0.2, 8.0);
/// Least share of samples that play.
const LEAST_SHARE: f64 = 0.1;

/// What a pixel's samples are worth, played as they best are.
#[derive(Debug, Clone, Copy)]
struct Play {
    /// Share that plays the roulette.
    pub share: f64,
    /// Variance of one sample.
    pub variance: f64,
    /// What one costs, over what it costs without the roulette.
    pub cost: f64,
}

impl Play {
    /// `visit`: what the visit of a node costs, over all that a sample costs without the roulette.
    pub fn best(need: &Need, visit: f64) -> Self {
        let queries = visit * need.work;
        // The least of (rest + roulette / share) (1 + queries share).
        let share = (need.roulette / (need.rest * queries).max(f64::MIN_POSITIVE)).sqrt();
        let share = share.clamp(LEAST_SHARE, 1.0);
        Self { share, variance: need.rest + need.roulette / share, cost: 1.0 + queries * share }
    }
}

impl Watched {
    /// A plan for `samples` per pixel on average, where the visit of a node costs `visit`. `None` while too little is known.
    pub fn plan(&self, samples: u32, visit: f64) -> Option<Spread> {
        let needs = self.needs()?;
        let pixels = needs.len() as f64;
        let wanted: Vec<(f64, f64)> = weights(&needs)
            .iter()
            .zip(&needs)
            .map(|(weight, need)| {
                let play = Play::best(need, visit);
                (weight * (play.variance / play.cost).sqrt(), play.share)
            })
            .collect();
        let total: f64 = wanted.iter().map(|(n, _)| n).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut factors: Vec<f64> =
            wanted.iter().map(|(n, _)| (n / total * pixels).clamp(SAMPLES.0, SAMPLES.1)).collect();
        let scale = f64::from(samples) * pixels / factors.iter().sum::<f64>();
        factors.iter_mut().for_each(|f| *f *= scale);
        Some(Spread {
            width: self.width,
            pixels: factors
                .iter()
                .zip(&wanted)
                .map(|(&n, &(_, share))| PixelPlan { samples: n.round().clamp(1.0, 65535.0) as u32, share })
                .collect(),
        })
    }
}

/// What an iteration gives to a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PixelPlan {
    /// Samples.
    pub samples: u32,
    /// Share of these that play the roulette.
    pub share: f64,
}

impl PixelPlan {
    /// How often the sample counts as having played: 0, or one over the share. `offset`: uniform in [0,1), the same for
    /// all samples of the pixel; their sum is then as near to their number as can be.
    pub fn plays(&self, sample: u32, offset: f64) -> f64 {
        if self.share >= 1.0 {
            return 1.0;
        }
        let before = (f64::from(sample) * self.share + offset).floor();
        let after = (f64::from(sample + 1) * self.share + offset).floor();
        if after > before { 1.0 / self.share } else { 0.0 }
    }
}

/// The plan of an iteration.
#[derive(Debug)]
pub(super) struct Spread {
    width: usize,
    pixels: Vec<PixelPlan>,
}

impl Spread {
    /// What a pixel gets.
    pub fn pixel(&self, x: u32, y: u32) -> PixelPlan {
        self.pixels[y as usize * self.width + x as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::watched::tests::watched;
    use super::*;

    #[test]
    fn every_sample_counts_once_on_average() {
        for share in [0.1, 0.37, 0.9, 1.0] {
            let plan = PixelPlan { samples: 50, share };
            let mean =
                |sample: u32| (0..10_000).map(|i| plan.plays(sample, f64::from(i) / 1e4)).sum::<f64>() / 1e4;
            for sample in [0, 1, 7, 49] {
                assert!(
                    (mean(sample) - 1.0).abs() < 2e-3,
                    "share {share}, sample {sample}: {}",
                    mean(sample)
                );
            }
        }
    }

    #[test]
    fn samples_go_to_noise_and_queries_to_what_they_find() {
        // Noise on the right four times that on the left; the roulette's on the right only.
        let watched = watched(|x| if x < 20 { (0.0, 0.1) } else { (0.3, 0.26) }, 30.0);
        let spread = watched.plan(16, 0.1).unwrap();
        let (left, right) = (spread.pixel(5, 10), spread.pixel(35, 10));
        assert_eq!(left.share, LEAST_SHARE);
        assert!((right.share - (0.09f64 / 0.0676 / 3.0).sqrt()).abs() < 1e-9);
        assert!(right.samples > 2 * left.samples, "{left:?} {right:?}");
        let mean = spread.pixels.iter().map(|p| f64::from(p.samples)).sum::<f64>() / 800.0;
        assert!((mean - 16.0).abs() < 0.5, "{mean}");
    }

    #[test]
    fn nothing_is_planned_from_nothing() {
        assert!(Watched::new(4, 4).plan(16, 1.0).is_none());
        assert!(watched(|_| (0.0, 0.0), 1.0).plan(16, 1.0).is_none());
    }
}
