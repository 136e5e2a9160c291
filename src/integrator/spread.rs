//! How eye samples are spread over the pixels of an iteration, by what earlier ones showed.
//!
//! Pixels differ in noise by orders of magnitude, and so does what the roulette gives to them. Samples go where they lower
//! the relative error most, and where the roulette is little of a pixel's noise, only a share of the samples plays it, each
//! for as many as do not. The sums stay unbiased: a plan depends on earlier iterations only.

use crate::film::FilmSettings;
use crate::math::{Spectrum, luminance};
use crate::tally::Tally;

/// Bounds of a pixel's samples over the mean number.
const SAMPLES: (f64, f64) = (0.2, 8.0);
/// Least share of samples that play.
const LEAST_SHARE: f64 = 0.1;
/// Pixels around one that say what it needs: few samples of one alone say little.
const AROUND: usize = 2;
/// Samples of a pixel without which nothing is said.
const ENOUGH: f64 = 4.0;

/// What an eye sample sees.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// All of it.
    pub radiance: Spectrum,
    /// What of it the roulette found.
    pub roulette: Spectrum,
}

impl From<Spectrum> for Seen {
    fn from(radiance: Spectrum) -> Self {
        Self { radiance, roulette: Spectrum::ZERO }
    }
}

/// Sums over a pixel's samples: how many, what the roulette found and the rest, and the squares of these.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PixelSums {
    samples: f64,
    roulette: [f64; 2],
    rest: [f64; 2],
}

impl PixelSums {
    /// Adds a sample.
    pub fn add(&mut self, seen: &Seen, share: f64) {
        let all = luminance(seen.radiance);
        // As if every sample had played: its square counts once for each that did not.
        let roulette = luminance(seen.roulette);
        self.samples += 1.0;
        for (sums, value, scale) in
            [(&mut self.roulette, roulette, share), (&mut self.rest, all - roulette, 1.0)]
        {
            sums[0] += value;
            sums[1] += value * value * scale;
        }
    }

    fn plus(mut self, other: &Self) -> Self {
        self.samples += other.samples;
        for i in 0..2 {
            self.roulette[i] += other.roulette[i];
            self.rest[i] += other.rest[i];
        }
        self
    }

    /// Variance of one sample's roulette and rest, and the mean of all.
    fn statistics(&self) -> ([f64; 2], f64) {
        let n = self.samples.max(1.0);
        let variance = |sums: [f64; 2]| (sums[1] / n - (sums[0] / n).powi(2)).max(0.0);
        ([variance(self.roulette), variance(self.rest)], (self.roulette[0] + self.rest[0]) / n)
    }
}

/// What iterations so far showed of every pixel.
#[derive(Debug, Default)]
pub(super) struct Watched {
    width: usize,
    pixels: Vec<PixelSums>,
}

impl Watched {
    /// Of a film of this size.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width: width as usize, pixels: vec![PixelSums::default(); width as usize * height as usize] }
    }

    /// Adds to a pixel's sums.
    pub fn add(&mut self, x: u32, y: u32, sums: &PixelSums) {
        let pixel = &mut self.pixels[y as usize * self.width + x as usize];
        *pixel = pixel.plus(sums);
    }

    /// The sums over the square around each pixel, of variances within pixels.
    fn around(&self) -> Vec<([f64; 2], f64)> {
        let height = self.pixels.len() / self.width.max(1);
        let each: Vec<([f64; 2], f64)> = self.pixels.iter().map(PixelSums::statistics).collect();
        (0..self.pixels.len())
            .map(|i| {
                let (x, y) = (i % self.width, i / self.width);
                let range = |at: usize, size: usize| at.saturating_sub(AROUND)..(at + AROUND + 1).min(size);
                let (mut variance, mut mean, mut count) = ([0.0; 2], 0.0, 0.0);
                for row in range(y, height) {
                    for (v, m) in &each[row * self.width..][range(x, self.width)] {
                        variance = [variance[0] + v[0], variance[1] + v[1]];
                        mean += m;
                        count += 1.0;
                    }
                }
                (variance.map(|v| v / count), mean / count)
            })
            .collect()
    }

    /// A plan for `samples` per pixel on average. `queries`: what playing the roulette costs, over all else that a sample
    /// costs. `None` while too little is known.
    pub fn plan(&self, samples: u32, queries: f64) -> Option<Spread> {
        let pixels = self.pixels.len() as f64;
        if self.pixels.iter().map(|p| p.samples).sum::<f64>() < ENOUGH * pixels {
            return None;
        }
        let around = self.around();
        // Error relative to a pixel's brightness, but not to what is nearly black.
        let floor = 0.02 * around.iter().map(|(_, mean)| mean).sum::<f64>() / pixels;
        let wanted: Vec<(f64, f64)> = around
            .iter()
            .map(|&([roulette, rest], mean)| {
                // The least of (rest + roulette / share) (1 + queries share).
                let share =
                    (roulette / (rest * queries).max(f64::MIN_POSITIVE)).sqrt().clamp(LEAST_SHARE, 1.0);
                let variance = rest + roulette / share;
                (variance.sqrt() / (mean + floor) / (1.0 + queries * share).sqrt(), share)
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

/// What an integrator that adapts remembers.
#[derive(Debug)]
pub(super) struct Adaptive {
    watched: Watched,
    /// What the roulette costs, over all else that a sample costs.
    queries: f64,
    spread: Option<Spread>,
}

impl Adaptive {
    /// Nothing so far.
    pub fn new(film: &FilmSettings) -> Self {
        Self { watched: Watched::new(film.width, film.height), queries: 0.0, spread: None }
    }

    /// What a pixel gets in an iteration of `samples`.
    pub fn pixel(&self, x: u32, y: u32, samples: u32) -> PixelPlan {
        self.spread.as_ref().map_or(PixelPlan { samples, share: 1.0 }, |spread| spread.pixel(x, y))
    }

    /// Learns from an iteration.
    pub fn learn(&mut self, pixels: &[(u32, u32, PixelSums)], tally: &Tally) {
        for (x, y, sums) in pixels {
            self.watched.add(*x, *y, sums);
        }
        if self.spread.is_none() {
            self.queries = tally.roulette_seconds / (tally.eye_trace + tally.visibility).max(1e-9);
        }
    }

    /// Plans iterations to come.
    pub fn plan(&mut self, samples: u32) {
        self.spread = self.watched.plan(samples, self.queries);
    }
}

#[cfg(test)]
mod tests {
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

    fn watched(noise: impl Fn(u32) -> (f64, f64)) -> Watched {
        let mut watched = Watched::new(40, 20);
        for i in 0..800 {
            let (roulette, rest) = noise(i % 40);
            let mut sums = PixelSums::default();
            for sign in [-1.0, 1.0, -1.0, 1.0] {
                let roulette = Spectrum::splat(roulette * sign);
                sums.add(&Seen { radiance: Spectrum::splat(1.0 + rest * sign) + roulette, roulette }, 1.0);
            }
            watched.add(i % 40, i / 40, &sums);
        }
        watched
    }

    #[test]
    fn samples_go_to_noise_and_queries_to_what_they_find() {
        // Noise on the right four times that on the left; the roulette's on the right only.
        let spread = watched(|x| if x < 20 { (0.0, 0.1) } else { (0.3, 0.26) }).plan(16, 3.0).unwrap();
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
        assert!(watched(|_| (0.0, 0.0)).plan(16, 1.0).is_none());
    }
}
