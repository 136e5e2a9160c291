//! What iterations so far showed of every pixel: its noise by where that comes from, and what the roulette costs there.

use super::parts::LEAST_SAMPLES;
use crate::math::{Spectrum, luminance};
use crate::tally::Tally;

/// Pixels around one that say what it needs: few samples of one alone say little.
const AROUND: usize = 2;
/// Samples of a pixel without which nothing is said: that of the preview, and those of a pilot that ran out of time.
const ENOUGH: f64 = 1.0 + LEAST_SAMPLES as f64;
/// What a connection of a kept light vertex costs, over a visit of a node.
const CONNECTION: f64 = 12.0;

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

/// What playing the roulette has cost, in visits of nodes.
pub(super) fn work(tally: &Tally) -> f64 {
    tally.roulette.nodes as f64 + CONNECTION * tally.roulette.accepted as f64
}

/// Sums over a pixel's samples: how many, what the roulette found and the rest, the squares of these, and the work of the
/// roulette.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PixelSums {
    samples: f64,
    roulette: [f64; 2],
    rest: [f64; 2],
    work: f64,
}

impl PixelSums {
    /// Adds a sample that was one of a share that played, and the roulette's work for it.
    pub fn add(&mut self, seen: &Seen, share: f64, work: f64) {
        let all = luminance(seen.radiance);
        // As if every sample had played: its square counts once for each that did not, its work likewise.
        let roulette = luminance(seen.roulette);
        self.samples += 1.0;
        self.work += work / share;
        for (sums, value, scale) in
            [(&mut self.roulette, roulette, share), (&mut self.rest, all - roulette, 1.0)]
        {
            sums[0] += value;
            sums[1] += value * value * scale;
        }
    }

    fn plus(mut self, other: &Self) -> Self {
        self.samples += other.samples;
        self.work += other.work;
        for i in 0..2 {
            self.roulette[i] += other.roulette[i];
            self.rest[i] += other.rest[i];
        }
        self
    }

    /// What they say of the pixel.
    pub fn need(&self) -> Need {
        let n = self.samples.max(1.0);
        let variance = |sums: [f64; 2]| (sums[1] / n - (sums[0] / n).powi(2)).max(0.0);
        Need {
            roulette: variance(self.roulette),
            rest: variance(self.rest),
            mean: (self.roulette[0] + self.rest[0]) / n,
            work: self.work / n,
        }
    }
}

/// What a pixel and those around it are like.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Need {
    /// Variance of what the roulette finds for one sample.
    pub roulette: f64,
    /// Variance of the rest of one sample.
    pub rest: f64,
    /// Mean of all that eye samples see.
    pub mean: f64,
    /// What playing the roulette costs for one sample, in visits of nodes.
    pub work: f64,
}

impl Need {
    fn plus(&mut self, other: &Self) {
        self.roulette += other.roulette;
        self.rest += other.rest;
        self.mean += other.mean;
        self.work += other.work;
    }
}

/// What iterations so far showed of every pixel.
#[derive(Debug, Default)]
pub(super) struct Watched {
    pub width: usize,
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

    /// What each pixel needs, as the square around it shows; `None` while too little is known.
    pub fn needs(&self) -> Option<Vec<Need>> {
        let known = self.pixels.iter().map(|p| p.samples).sum::<f64>();
        if known < ENOUGH * self.pixels.len() as f64 {
            return None;
        }
        let each: Vec<Need> = self.pixels.iter().map(PixelSums::need).collect();
        Some(around(&each, self.width))
    }
}

/// The needs around a pixel.
#[derive(Default)]
struct Around {
    sum: Need,
    /// The largest variances: one bright sample in 25 pixels is chance, and would have samples follow it.
    most: [f64; 2],
}

impl Around {
    fn add(&mut self, need: &Need) {
        self.sum.plus(need);
        self.most = [self.most[0].max(need.roulette), self.most[1].max(need.rest)];
    }

    /// Of this many pixels; variances without the largest one, where it is one of a block.
    fn mean(&self, count: f64) -> Need {
        let dropped = if count < 9.0 { 0.0 } else { 1.0 };
        let without = |sum: f64, most: f64| (sum - dropped * most).max(0.0) / (count - dropped);
        Need {
            roulette: without(self.sum.roulette, self.most[0]),
            rest: without(self.sum.rest, self.most[1]),
            mean: self.sum.mean / count,
            work: self.sum.work / count,
        }
    }
}

/// The needs of the square around each pixel.
fn around(each: &[Need], width: usize) -> Vec<Need> {
    let height = each.len() / width.max(1);
    (0..each.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let range = |at: usize, size: usize| at.saturating_sub(AROUND)..(at + AROUND + 1).min(size);
            let (columns, mut all, mut count) = (range(x, width), Around::default(), 0.0);
            for row in range(y, height) {
                for need in &each[row * width..][columns.clone()] {
                    all.add(need);
                    count += 1.0;
                }
            }
            all.mean(count)
        })
        .collect()
}

/// One over the brightness that errors of pixels are relative to, but not to what is nearly black.
pub(super) fn weights(needs: &[Need]) -> Vec<f64> {
    let floor = 0.02 * needs.iter().map(|n| n.mean).sum::<f64>() / needs.len() as f64;
    needs.iter().map(|n| 1.0 / (n.mean + floor)).collect()
}

/// The roulette's share of the variance of samples relative to the pixels' brightness, over all pixels.
pub(super) fn roulette_share(needs: &[Need]) -> f64 {
    let (mut roulette, mut all) = (0.0, 0.0);
    for (weight, need) in weights(needs).iter().zip(needs) {
        roulette += weight * weight * need.roulette;
        all += weight * weight * (need.roulette + need.rest);
    }
    if all > 0.0 { roulette / all } else { 0.0 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A film of 40 by 20 after four samples, with this noise of the roulette and of the rest in each column, and this
    /// work of the roulette.
    pub fn watched(noise: impl Fn(u32) -> (f64, f64), work: f64) -> Watched {
        let mut watched = Watched::new(40, 20);
        for i in 0..800 {
            let (roulette, rest) = noise(i % 40);
            let mut sums = PixelSums::default();
            for sign in [-1.0, 1.0, -1.0, 1.0] {
                let roulette = Spectrum::splat(roulette * sign);
                let radiance = Spectrum::splat(1.0 + rest * sign) + roulette;
                sums.add(&Seen { radiance, roulette }, 1.0, work);
            }
            watched.add(i % 40, i / 40, &sums);
        }
        watched
    }

    #[test]
    fn noise_is_told_apart_by_where_it_comes_from() {
        let needs = watched(|x| if x < 20 { (0.0, 0.1) } else { (0.3, 0.2) }, 7.0).needs().unwrap();
        for (x, roulette, rest) in
            [(5, 0.0, 0.01), (35, 0.09, 0.04), (19, 9.0 * 0.09 / 24.0, (15.0 * 0.01 + 9.0 * 0.04) / 24.0)]
        {
            let need = needs[10 * 40 + x];
            assert!((need.roulette - roulette).abs() < 1e-12 && (need.rest - rest).abs() < 1e-12, "{need:?}");
            assert!((need.mean - 1.0).abs() < 1e-12 && (need.work - 7.0).abs() < 1e-12, "{need:?}");
        }
        assert!(Watched::new(4, 4).needs().is_none());
    }

    #[test]
    fn the_roulette_has_its_share_of_the_noise() {
        for (roulette, rest, share) in [(0.3, 0.1, 0.9), (0.0, 0.1, 0.0), (0.0, 0.0, 0.0)] {
            let got = roulette_share(&watched(|_| (roulette, rest), 0.0).needs().unwrap());
            assert!((got - share).abs() < 1e-12, "{got}");
        }
        // Relative to brightness: two halves of one noise, of which that with the roulette is the darker by 1 to 3.
        let mut sums = [PixelSums::default(); 2];
        for sign in [-1.0, 1.0, -1.0, 1.0] {
            let seen = |mean: f64, roulette: f64, rest: f64| Seen {
                radiance: Spectrum::splat(mean + sign * (roulette + rest)),
                roulette: Spectrum::splat(sign * roulette),
            };
            sums[0].add(&seen(1.0, 0.1, 0.0), 1.0, 0.0);
            sums[1].add(&seen(3.0, 0.0, 0.1), 1.0, 0.0);
        }
        let got = roulette_share(&sums.map(|s| s.need()));
        let square = |mean: f64| 1.0 / (mean + 0.02 * 2.0f64).powi(2);
        assert!((got - square(1.0) / (square(1.0) + square(3.0))).abs() < 1e-12, "{got}");
    }

    #[test]
    fn one_bright_sample_draws_no_others() {
        let mut watched = watched(|_| (0.1, 0.2), 7.0);
        let before = watched.needs().unwrap()[10 * 40 + 20];
        let mut bright = PixelSums::default();
        bright.add(&Seen { radiance: Spectrum::splat(1e3), roulette: Spectrum::splat(9e2) }, 1.0, 7.0);
        watched.add(20, 10, &bright);
        let after = watched.needs().unwrap()[10 * 40 + 20];
        assert!((after.roulette - before.roulette).abs() < 1e-8 && (after.rest - before.rest).abs() < 1e-8);
        assert!(after.mean > before.mean);
    }
}
