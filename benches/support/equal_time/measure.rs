//! How far runs are from a reference, or from each other.

use super::study::{Recipe, Variant};
use glam::{DVec3, Vec3};
use hrr::image::Image;
use hrr::math::luminance;
use hrr::math::relative::{Tiles, floor, local_square, trimmed_mean};
use hrr::report::bootstrap::Interval;

/// Share of pixels that trimmed errors leave out: the worst thousandth.
const TRIMMED: f64 = 1e-3;

pub const HEADER: &str =
    "scene,recipe,seed,seconds,cpu_seconds,iterations,mean,mse,rmse,region_mse,error_square\n";

/// What a run took.
pub struct Cost {
    pub seconds: f64,
    pub cpu: f64,
    pub iterations: u64,
}

/// A finished run.
pub struct Run {
    pub image: Image,
    pub cost: Cost,
}

/// The errors of a run.
pub struct Errors {
    /// Mean of the image's luminance.
    pub mean: f64,
    /// Mean square error of all pixels, over channels.
    pub mse: f64,
    /// The same of the region's pixels; NaN where there is none.
    pub region_mse: f64,
    /// Mean square error relative to a pixel's surroundings, without the worst thousandth of the pixels, nor that of the
    /// reference's.
    pub trimmed: f64,
}

/// What a recipe's runs are measured by.
pub struct Yardstick<'a> {
    region: &'a [usize],
    mean: Image,
    /// Square errors of the mean itself.
    noise: Vec<DVec3>,
    /// Noise of a pixel of the reference beyond which relative errors leave it out: that of its worst thousandth.
    noisiest: f64,
    /// Images that are part of the mean, if the runs are.
    own: Option<usize>,
}

impl<'a> Yardstick<'a> {
    /// By a reference, the mean of several images; without one by the runs' own mean.
    pub fn new(region: &'a [usize], reference: Option<&[Image]>, runs: &[Run]) -> Self {
        let images: Vec<&Image> =
            reference.map_or_else(|| runs.iter().map(|r| &r.image).collect(), |r| r.iter().collect());
        let mean = mean(images.iter().copied());
        let n = images.len() as f64;
        let noise: Vec<DVec3> = (0..mean.pixels.len())
            .map(|i| {
                let square = |image: &&Image| {
                    let d = (image.pixels[i] - mean.pixels[i]).as_dvec3();
                    d * d
                };
                images.iter().map(square).sum::<DVec3>() / (n * (n - 1.0))
            })
            .collect();
        let mut sums: Vec<f64> = noise.iter().map(|n| n.element_sum()).collect();
        let kept = sums.len() - 1 - (TRIMMED * sums.len() as f64) as usize;
        let noisiest = match reference {
            Some(_) => *sums.select_nth_unstable_by(kept, f64::total_cmp).1,
            None => f64::INFINITY,
        };
        Self { region, mean, noise, noisiest, own: reference.is_none().then_some(runs.len()) }
    }

    /// The square error of a pixel, as well as it can be told.
    fn square(&self, image: &Image, i: usize) -> DVec3 {
        let d = (image.pixels[i] - self.mean.pixels[i]).as_dvec3();
        match self.own {
            // It lies nearer to a mean that it is part of.
            Some(n) => d * d * (n as f64 / (n as f64 - 1.0)),
            None => d * d - self.noise[i],
        }
    }

    pub fn errors(&self, image: &Image) -> Errors {
        let mean_of = |pixels: &mut dyn Iterator<Item = usize>| {
            let (mut sum, mut count) = (0.0, 0.0);
            for i in pixels {
                sum += self.square(image, i).element_sum() / 3.0;
                count += 1.0;
            }
            sum / count
        };
        let grid = Tiles::new(image.width, image.height);
        let at = |i: u32| luminance(self.mean.pixels[i as usize].as_dvec3());
        let tiles = grid.means(|x, y| at(y * image.width + x));
        let all = image.pixels.len();
        let eps = floor((0..all as u32).map(at).sum::<f64>() / all as f64);
        let tile = |i: usize| tiles[grid.of(i as u32 % image.width, i as u32 / image.width)];
        let mut relative: Vec<f64> = (0..all)
            .filter(|&i| self.noise[i].element_sum() <= self.noisiest)
            .map(|i| local_square(self.square(image, i), tile(i), eps))
            .collect();
        Errors {
            mean: image.pixels.iter().map(|p| luminance(p.as_dvec3())).sum::<f64>() / all as f64,
            mse: mean_of(&mut (0..all)),
            region_mse: mean_of(&mut self.region.iter().copied()),
            trimmed: trimmed_mean(&mut relative, TRIMMED),
        }
    }

    /// A picture of |difference|, a tenth of the mean's luminance as 0.2.
    pub fn map(&self, image: &Image) -> Image {
        let all = self.mean.pixels.len() as f32;
        let scale = 2.0 * all / self.mean.pixels.iter().map(|p| p.element_sum() / 3.0).sum::<f32>();
        let pixels =
            image.pixels.iter().zip(&self.mean.pixels).map(|(a, b)| (*a - *b).abs() * scale).collect();
        Image { width: image.width, height: image.height, pixels }
    }
}

/// The mean of images of one size.
pub fn mean<'a>(images: impl Iterator<Item = &'a Image> + Clone) -> Image {
    let first = images.clone().next().expect("an image");
    let count = images.clone().count() as f64;
    let pixels: Vec<Vec3> = (0..first.pixels.len())
        .map(|i| (images.clone().map(|m| m.pixels[i].as_dvec3()).sum::<DVec3>() / count).as_vec3())
        .collect();
    Image { width: first.width, height: first.height, pixels }
}

pub fn row(variant: &Variant, recipe: &Recipe, seed: usize, cost: &Cost, errors: &Errors) -> String {
    format!(
        "{},{},{seed},{:.3},{:.3},{},{:.6e},{:.6e},{:.6e},{:.6e},{:.6e}\n",
        variant.name,
        recipe.name,
        cost.seconds,
        cost.cpu,
        cost.iterations,
        errors.mean,
        errors.mse,
        errors.mse.max(0.0).sqrt(),
        errors.region_mse,
        errors.trimmed
    )
}

/// Means of runs over those of other runs, in turn with them, with 90 % intervals.
pub fn ratios(first: &[Errors], errors: &[Errors]) -> String {
    let over = |value: &dyn Fn(&Errors) -> f64| {
        let sum = |of: &[Errors], chosen: &[usize]| chosen.iter().map(|&r| value(&of[r])).sum::<f64>();
        let i = Interval::new(first.len(), |chosen| sum(errors, chosen) / sum(first, chosen));
        format!("{:.4} [{:.4}, {:.4}]", i.value, i.low, i.high)
    };
    format!(
        "mean {}; MSE {}; region {}; relative {}",
        over(&|e| e.mean),
        over(&|e| e.mse),
        over(&|e| e.region_mse),
        over(&|e| e.trimmed),
    )
}

/// Means over runs, with 90 % intervals.
pub fn summary(runs: &[Run], errors: &[Errors]) -> String {
    let over = |value: &dyn Fn(usize) -> f64| {
        let i = Interval::new(runs.len(), |chosen| {
            chosen.iter().map(|&r| value(r)).sum::<f64>() / chosen.len() as f64
        });
        format!("{:.3e} [{:.2e}, {:.2e}]", i.value, i.low, i.high)
    };
    format!(
        "{:.1} s, {:.1} CPU-s, {} iterations; mean {}; MSE {}; region {}; relative {}",
        runs.iter().map(|r| r.cost.seconds).sum::<f64>() / runs.len() as f64,
        runs.iter().map(|r| r.cost.cpu).sum::<f64>() / runs.len() as f64,
        runs[0].cost.iterations,
        over(&|r| errors[r].mean),
        over(&|r| errors[r].mse),
        over(&|r| errors[r].region_mse),
        over(&|r| errors[r].trimmed),
    )
}
