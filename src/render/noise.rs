//! How far a render still is from what it converges to, told by itself: its iterations are independent, so their
//! scatter tells the variance of their mean.
//!
//! Iterations are taken together in groups, which grow with their number, so that this costs next to nothing. A group of
//! weight w (its samples' weights) and mean x adds `(x - m)^2 w W / (w + W)` to each pixel's sum of squares, m and W the mean and
//! weight before it [Welford 1962; West 1979]. Each of these terms has the variance of one sample as its mean, whatever
//! the sizes of the groups, and over their number it estimates it.

use crate::film::Film;
use crate::image::Image;
use crate::math::relative::{Tiles, floor, local_square, trimmed_mean};
use crate::math::{Spectrum, luminance};
use rayon::prelude::*;

/// A group has an iteration for every so many before it.
const GROUPS: u64 = 32;
/// Groups before anything is said.
const LEAST_GROUPS: usize = 8;
/// Share of the pixels that the error leaves out, the worst ones.
pub const TRIMMED: f64 = 0.001;
/// The normal deviate that 90 % are below.
const Z90: f64 = 1.281_551_565_5;
/// Most of the largest deviations that the tail's index is taken from.
const TAIL: usize = 1000;
/// The least index of a tail whose mean squares can be trusted. Below 2 they have no mean at all; up to about 3 they have one,
/// which samples underestimate for very long, since it is made of rare large ones.
pub const LEAST_HILL: f64 = 3.0;

/// The error of a render so far.
///
/// The error is the root of the mean square error of all pixels but the worst thousandth, each relative to the brightness
/// around it ([`local_square`]). It tells noise; the blur of vertex merging is not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Iterations that it is about.
    pub iterations: u64,
    /// The expected error; 0.01 is one percent.
    pub expected: f64,
    /// What the error is below of with 90 % confidence.
    pub bound: f64,
    /// Index of the tail of the pixels' deviations [Hill 1975]: the variance of tails below 2 does not exist, and up to 3
    /// samples underestimate it.
    pub hill: f64,
}

impl ErrorEstimate {
    /// Whether the tail is light enough for the error to mean anything.
    pub fn is_sure(&self) -> bool {
        self.hill >= LEAST_HILL
    }
}

/// Sums of squares of many means at once.
#[derive(Debug)]
struct Moments {
    /// Sums of all samples so far.
    sums: Vec<Spectrum>,
    /// Sums of squared deviations, in units of one sample's variance.
    squares: Vec<Spectrum>,
}

impl Moments {
    fn new(n: usize) -> Self {
        Self { sums: vec![Spectrum::ZERO; n], squares: vec![Spectrum::ZERO; n] }
    }

    /// Takes in what the sums are after `weight` more samples than the `before` that there were; the squares' growth.
    fn push(sum: &mut Spectrum, squares: &mut Spectrum, now: Spectrum, before: f64, weight: f64) -> Spectrum {
        let mut growth = Spectrum::ZERO;
        if before > 0.0 {
            let d = (now - *sum) / weight - *sum / before;
            growth = d * d * (weight * before / (weight + before));
            *squares += growth;
        }
        *sum = now;
        growth
    }
}

/// Watches the film between iterations.
#[derive(Debug)]
pub struct Noise {
    width: u32,
    height: u32,
    grid: Tiles,
    pixels: Moments,
    tiles: Moments,
    /// What the samples of a pixel that have been taken in count for.
    samples: u64,
    /// Iterations that have been taken in.
    iterations: u64,
    groups: usize,
    /// For each group but the first, the trimmed mean over the pixels of its relative square deviation: the variance of
    /// one sample, as that group saw it.
    scatter: Vec<f64>,
    /// The largest relative square deviations of any pixel in any group, unordered.
    tail: Vec<f64>,
    /// How many deviations they are the largest of.
    deviations: u64,
    estimate: Option<ErrorEstimate>,
}

impl Noise {
    /// For a film of that size without samples.
    pub fn new(width: u32, height: u32) -> Self {
        let grid = Tiles::new(width, height);
        Self {
            width,
            height,
            grid,
            pixels: Moments::new((width * height) as usize),
            tiles: Moments::new(grid.count()),
            samples: 0,
            iterations: 0,
            groups: 0,
            scatter: Vec::new(),
            tail: Vec::new(),
            deviations: 0,
            estimate: None,
        }
    }

    /// Looks at the film after `iterations` in all, `last` if no more will come.
    pub fn update(&mut self, film: &Film, iterations: u64, last: bool) {
        let fresh = iterations - self.iterations;
        if fresh == 0
            || (!last && fresh < (self.iterations / GROUPS).max(1))
            || film.weights() == self.samples
        {
            return;
        }
        let (before, weight) = (self.samples as f64, (film.weights() - self.samples) as f64);
        let deviations = self.take_in(film, before, weight);
        (self.samples, self.iterations) = (film.weights(), iterations);
        self.groups += 1;
        if before > 0.0 {
            self.look_at(deviations);
        }
    }

    /// Updates the sums; returns each pixel's relative square deviation.
    fn take_in(&mut self, film: &Film, before: f64, weight: f64) -> Vec<f64> {
        let width = self.width as usize;
        let rows: Vec<Vec<Spectrum>> = (0..self.height).into_par_iter().map(|y| film.row(y)).collect();
        let mut tile_sums = vec![Spectrum::ZERO; self.grid.count()];
        for (y, row) in rows.iter().enumerate() {
            for (x, now) in row.iter().enumerate() {
                tile_sums[self.grid.of(x as u32, y as u32)] += *now;
            }
        }
        let Moments { sums, squares } = &mut self.tiles;
        for ((sum, squares), now) in sums.iter_mut().zip(squares).zip(tile_sums) {
            Moments::push(sum, squares, now, before, weight);
        }
        let (grid, (eps, tiles)) = (self.grid, self.brightness(before + weight));
        let Moments { sums, squares } = &mut self.pixels;
        sums.par_chunks_mut(width)
            .zip(squares.par_chunks_mut(width))
            .zip(rows)
            .enumerate()
            .flat_map_iter(|(y, ((sums, squares), row))| {
                let pixels = sums.iter_mut().zip(squares).zip(row).enumerate();
                let tiles = &tiles;
                pixels.map(move |(x, ((sum, squares), now))| {
                    let growth = Moments::push(sum, squares, now, before, weight);
                    local_square(growth, tiles[grid.of(x as u32, y as u32)], eps)
                })
            })
            .collect()
    }

    /// What errors are relative to: eps, and the mean luminance of each tile.
    fn brightness(&self, samples: f64) -> (f64, Vec<f64>) {
        let sums = self.tiles.sums.iter().map(|sum| luminance(*sum) / samples);
        let total: f64 = sums.clone().sum();
        let means = sums.enumerate().map(|(tile, sum)| sum / self.grid.pixels(tile)).collect();
        (floor(total / self.pixels.sums.len().max(1) as f64), means)
    }

    fn look_at(&mut self, mut deviations: Vec<f64>) {
        self.deviations += deviations.len() as u64;
        let least = self.tail.iter().copied().fold(f64::INFINITY, f64::min);
        let full = self.tail.len() >= TAIL;
        self.tail.extend(deviations.iter().filter(|d| **d > 0.0 && (!full || **d > least)));
        if self.tail.len() > TAIL {
            self.tail.select_nth_unstable_by(TAIL, |a, b| b.total_cmp(a));
            self.tail.truncate(TAIL);
        }
        self.scatter.push(trimmed_mean(&mut deviations, TRIMMED));
        if self.groups >= LEAST_GROUPS {
            let expected = self.expected_square();
            self.estimate = Some(ErrorEstimate {
                iterations: self.iterations,
                expected: expected.sqrt(),
                bound: (expected * self.margin()).sqrt(),
                hill: self.hill(),
            });
        }
    }

    /// The trimmed mean of the pixels' relative variances.
    fn expected_square(&self) -> f64 {
        let samples = self.samples as f64;
        let (eps, tiles) = self.brightness(samples);
        let scale = 1.0 / ((self.groups - 1) as f64 * samples);
        let tile = |i: usize| tiles[self.grid.of(i as u32 % self.width, i as u32 / self.width)];
        let pixels = self.pixels.squares.par_iter().enumerate();
        let mut relative: Vec<f64> =
            pixels.map(|(i, squares)| local_square(*squares * scale, tile(i), eps)).collect();
        trimmed_mean(&mut relative, TRIMMED)
    }

    /// What the expected square error is multiplied with so that nine of ten renders err by less.
    ///
    /// A render's square error is about a sum of squares with as many degrees of freedom as its scatter tells: many
    /// where pixels err independently, few where they err together. The estimate has that many for each group. Their
    /// ratio has the F distribution.
    fn margin(&self) -> f64 {
        // Early groups measure in units of tiles that are hardly known.
        let late = &self.scatter[self.scatter.len() / 2..];
        let n = late.len() as f64;
        let mean = late.iter().sum::<f64>() / n;
        if !(mean > 0.0) {
            return 1.0;
        }
        let variance = late.iter().map(|q| (q - mean).powi(2)).sum::<f64>() / (n - 1.0);
        // A sum of squares of normal numbers has at least one; the scatter of few samples is not normal yet.
        let freedom = (2.0 * mean * mean / variance).max(1.0);
        f_quantile_90(freedom, freedom * (self.groups - 1) as f64)
    }

    /// Hill's index of the largest relative deviations.
    fn hill(&self) -> f64 {
        let wanted = ((self.deviations / 1000) as usize).clamp(20, TAIL);
        let mut tail = self.tail.clone();
        tail.sort_by(|a, b| b.total_cmp(a));
        tail.truncate(wanted);
        let Some(&least) = tail.last() else { return f64::INFINITY };
        // Squares: their logarithms are twice the deviations'.
        let logs: f64 = tail.iter().map(|d| 0.5 * (d / least).ln()).sum();
        if logs > 0.0 { (tail.len() - 1) as f64 / logs } else { f64::INFINITY }
    }

    /// The error so far; `None` before there are groups enough.
    pub fn error(&self) -> Option<ErrorEstimate> {
        self.estimate
    }

    /// Groups of iterations so far.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// Variance of each pixel's mean, in squares of the film's unit; `None` before there are two groups.
    pub fn variance(&self) -> Option<Image> {
        let scale = self.scale()?;
        let pixels = self.pixels.squares.iter().map(|s| (*s * scale).as_vec3()).collect();
        Some(Image { width: self.width, height: self.height, pixels })
    }

    /// Mean of each tile of 16 x 16 pixels and the variance of that mean, row by row. Unlike the sum of the pixels'
    /// variances it holds for pixels that err together. `None` before there are two groups.
    pub fn tiles(&self) -> Option<Vec<(Spectrum, Spectrum)>> {
        let scale = self.scale()?;
        let samples = self.samples as f64;
        let of = |(tile, (sum, squares)): (usize, (&Spectrum, &Spectrum))| {
            let pixels = self.grid.pixels(tile);
            (*sum / (samples * pixels), *squares * scale / (pixels * pixels))
        };
        Some(self.tiles.sums.iter().zip(&self.tiles.squares).enumerate().map(of).collect())
    }

    fn scale(&self) -> Option<f64> {
        (self.groups > 1).then(|| 1.0 / ((self.groups - 1) as f64 * self.samples as f64))
    }
}

/// The value that nine of ten F-distributed numbers are below of [Paulson 1942]: cube roots of chi^2 are about normal, and
/// their ratio's quantile solves a quadratic equation.
fn f_quantile_90(above: f64, below: f64) -> f64 {
    if !above.is_finite() {
        return 1.0;
    }
    let (a, b) = (2.0 / (9.0 * above), 2.0 / (9.0 * below));
    let (p, q) = (1.0 - b, 1.0 - a);
    // (p f - q)^2 = z^2 (b f^2 + a) for the cube root f.
    let z2 = Z90 * Z90;
    let leading = p * p - z2 * b;
    let root = (p * p * q * q - leading * (q * q - z2 * a)).max(0.0).sqrt();
    if leading > 0.0 { ((p * q + root) / leading).powi(3) } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmSettings, Filter};
    use crate::sampler::counter::{combine, unit};
    use glam::DVec2;

    /// A film of independent pixels, each of whose samples is `value` of a uniform number.
    fn noise(side: u32, iterations: u64, key: u64, value: impl Fn(f64) -> f64) -> (Film, Noise) {
        let mut film = Film::new(&FilmSettings { width: side, height: side, filter: Filter::Box });
        let mut noise = Noise::new(side, side);
        for i in 0..iterations {
            for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
                let u = unit(combine(combine(key, i), u64::from(y * side + x)));
                film.add(DVec2::new(x.into(), y.into()) + 0.5, Spectrum::splat(value(u)));
            }
            film.count_samples(1);
            noise.update(&film, i + 1, i + 1 == iterations);
        }
        (film, noise)
    }

    /// Uniform numbers: mean 1/2, variance 1/12.
    #[test]
    fn the_variance_of_the_mean_is_known_through_all_sizes_of_groups() {
        let (_, noise) = noise(24, 200, 1, |u| u);
        // 32 groups of 1, 32 of 1, then of 2, 3, 4 and 5 iterations, and what is left.
        assert!((80..200).contains(&noise.groups()), "{}", noise.groups());
        let variance = noise.variance().unwrap();
        let mean = variance.pixels.iter().map(|v| f64::from(v.y)).sum::<f64>() / 576.0;
        assert!((mean * 12.0 * 200.0 - 1.0).abs() < 0.03, "{mean}");
        let error = noise.error().unwrap();
        let expected = (1.0 / 12.0 / 0.25 / 200.0f64).sqrt();
        assert!((error.expected / expected - 1.0).abs() < 0.02, "{error:?} {expected}");
        assert!(error.bound > error.expected && error.bound < 1.1 * error.expected, "{error:?}");
        assert!(error.is_sure() && error.iterations == 200);
        for (mean, v) in noise.tiles().unwrap() {
            assert!((mean.x - 0.5).abs() < 5.0 * v.x.sqrt() && v.x > 0.0);
        }
    }

    /// Pixels that all err alike: a tile errs as one pixel does.
    #[test]
    fn tiles_know_that_their_pixels_err_together() {
        let mut film = Film::new(&FilmSettings { width: 20, height: 16, filter: Filter::Box });
        let mut noise = Noise::new(20, 16);
        for i in 0..100 {
            let value = Spectrum::splat(unit(combine(7, i)));
            for (x, y) in (0..20).flat_map(|x| (0..16).map(move |y| (x, y))) {
                film.add(DVec2::new(x.into(), y.into()) + 0.5, value);
            }
            film.count_samples(1);
            noise.update(&film, i + 1, false);
        }
        noise.update(&film, 100, true);
        let (pixel, tiles) = (noise.variance().unwrap().pixels[0].x, noise.tiles().unwrap());
        assert_eq!(tiles.len(), 2);
        for (mean, variance) in tiles {
            assert!((variance.x / f64::from(pixel) - 1.0).abs() < 1e-5);
            assert!((mean.x - film.mean(0, 0).x).abs() < 1e-12);
        }
        // One degree of freedom: nine of ten squares are below 2.7 times their mean.
        let error = noise.error().unwrap();
        assert!((error.bound / error.expected).powi(2) > 1.8, "{error:?}");
    }

    #[test]
    fn a_tail_without_variance_is_seen() {
        let (_, light) = noise(16, 64, 2, |u| -(1.0 - u).ln());
        assert!(light.error().unwrap().is_sure(), "{:?}", light.error());
        let (_, heavy) = noise(16, 64, 3, |u| (1.0 - u).powf(-1.0 / 1.2));
        assert!(!heavy.error().unwrap().is_sure(), "{:?}", heavy.error());
    }

    #[test]
    fn nothing_is_said_too_early_and_black_is_certain() {
        assert_eq!(noise(4, 7, 4, |u| u).1.error(), None);
        assert_eq!(noise(4, 1, 4, |u| u).1.variance(), None);
        let error = noise(4, 20, 4, |_| 0.0).1.error().unwrap();
        assert_eq!((error.expected, error.bound, error.is_sure()), (0.0, 0.0, true));
    }

    /// Against tables. With one degree of freedom the approximation is 2.5 % too small.
    #[test]
    fn quantiles_of_f() {
        for (a, b, expected) in
            [(10.0, 10.0, 2.323), (5.0, 40.0, 1.997), (100.0, 1000.0, 1.201), (2.0, 1e6, 2.303)]
        {
            let f = f_quantile_90(a, b);
            assert!((f / expected - 1.0).abs() < 0.02, "{a} {b}: {f}");
        }
        assert_eq!(f_quantile_90(f64::INFINITY, f64::INFINITY), 1.0);
    }
}
