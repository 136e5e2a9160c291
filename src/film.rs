//! The film: exact sums, so that the order of additions does not matter.
//!
//! Values are added as 128-bit fixed-point numbers. Integer addition is associative: any thread count, any order of
//! work and any split of a render into parts that are added up later give the same bits.

use crate::error::{Error, Result};
use crate::image::Image;
use crate::math::Spectrum;
use crate::outliers::{self, Largest};
use glam::{DVec2, Vec3};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};

/// Units per 1.0: values are kept to 5e-20, sums up to 9e18.
const ONE: f64 = (1u128 << 64) as f64;
/// Standard deviation and cut-off radius of the Gaussian reconstruction filter, pixels.
const GAUSSIAN: (f64, f64) = (0.5, 1.5);
/// How many pixels to each side it reaches.
const REACH: usize = 2;

type Pixel = [i128; 3];

/// The image as a scene file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Reconstruction filter.
    pub filter: Filter,
}

impl Default for FilmSettings {
    fn default() -> Self {
        Self { width: 640, height: 480, filter: Filter::Box }
    }
}

/// How a sample spreads over pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// The pixel it falls in.
    #[default]
    Box,
    /// A Gaussian of half a pixel's standard deviation, cut at 1.5 pixels.
    Gaussian,
}

/// A row of pixels.
#[derive(Debug)]
struct Row {
    sums: Vec<Pixel>,
    /// The largest contributions to each; empty where they are not watched.
    largest: Vec<Largest>,
}

/// A sum of contributions to a pixel, before it is rounded.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    value: Spectrum,
    /// The largest of them, where these are watched.
    largest: Largest,
}

impl Sum {
    fn add(&mut self, value: Spectrum, watched: bool) {
        self.value += value;
        if watched {
            self.largest.add(value);
        }
    }
}

/// A sum of samples for every pixel.
#[derive(Debug)]
pub struct Film {
    width: u32,
    height: u32,
    filter: Filter,
    rows: Vec<Mutex<Row>>,
    /// Whether the largest contributions are remembered.
    outliers: bool,
    samples: u64,
    /// What each sample to come counts for.
    weight: u32,
    /// What all samples of a pixel count for.
    weights: u64,
    dropped: AtomicU64,
}

impl Film {
    /// A black film of no samples.
    pub fn new(settings: &FilmSettings) -> Self {
        Self::watching(settings, false)
    }

    /// The same; `outliers`: whether it remembers what tells these ([`Film::without_outliers`]), 48 bytes a pixel.
    pub fn watching(settings: &FilmSettings, outliers: bool) -> Self {
        let width = settings.width as usize;
        let largest = if outliers { width } else { 0 };
        let row =
            || Mutex::new(Row { sums: vec![[0; 3]; width], largest: vec![Largest::default(); largest] });
        Self {
            width: settings.width,
            height: settings.height,
            filter: settings.filter,
            rows: (0..settings.height).map(|_| row()).collect(),
            outliers,
            samples: 0,
            weight: 1,
            weights: 0,
            dropped: AtomicU64::new(0),
        }
    }

    /// A black film of the same kind.
    pub fn alike(&self) -> Self {
        let Self { width, height, filter, outliers, .. } = *self;
        Self::watching(&FilmSettings { width, height, filter }, outliers)
    }

    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Samples per pixel so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// What the samples of a pixel count for so far: their number, unless [`Film::set_weight`] was called.
    pub fn weights(&self) -> u64 {
        self.weights
    }

    /// Values that were not finite and therefore left out. Always 0 unless hrr has a bug.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Says that every pixel has had `n` more samples.
    pub fn count_samples(&mut self, n: u64) {
        self.samples += n;
        self.weights += n * u64::from(self.weight);
    }

    /// What each sample to come counts for in the mean, beside 1 at the start: for iterations of different quality.
    pub fn set_weight(&mut self, weight: u32) {
        self.weight = weight;
    }

    /// Adds the sum of a pixel's samples, each a raster position in the pixel and a value, as [`Film::add`] does for one. The
    /// sum of the samples in one pixel is rounded as a whole: the same samples must come together to give the same bits.
    pub fn add_samples(&self, x: u32, y: u32, samples: impl Iterator<Item = (DVec2, Spectrum)>) {
        let reach = match self.filter {
            Filter::Box => 0,
            Filter::Gaussian => REACH,
        };
        let side = 2 * reach + 1;
        let mut around = vec![Sum::default(); side * side];
        // Of a pixel from the square's corner: huge where it is to the left or above.
        let from = |i: u32, middle: u32| (i as usize + reach).wrapping_sub(middle as usize);
        for (raster, value) in samples {
            if self.counts(value) {
                self.spread(raster, |i, j, weight| match (from(i, x), from(j, y)) {
                    (column, row) if column < side && row < side => {
                        around[row * side + column].add(value * weight, self.outliers);
                    }
                    _ => self.add_one(i, j, value * weight),
                });
            }
        }
        for (n, sum) in around.iter().enumerate().filter(|(_, sum)| sum.value != Spectrum::ZERO) {
            let (i, j) = (x as usize + n % side, y as usize + n / side);
            self.add_pixel((i - reach) as u32, (j - reach) as u32, sum);
        }
    }

    /// Adds a value at a raster position in [0,width) x [0,height), through the reconstruction filter. From any thread.
    pub fn add(&self, raster: DVec2, value: Spectrum) {
        if value != Spectrum::ZERO && self.counts(value) {
            self.spread(raster, |x, y, weight| self.add_one(x, y, value * weight));
        }
    }

    /// Whether a value is finite; counts those that are not.
    fn counts(&self, value: Spectrum) -> bool {
        let finite = value.is_finite();
        if !finite {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        finite
    }

    /// The weights of the pixels around a raster position, of sum 1: at the border the Gaussian is cut and scaled up again.
    #[inline(always)]
    fn spread(&self, raster: DVec2, mut add: impl FnMut(u32, u32, f64)) {
        if self.filter == Filter::Box {
            return add(raster.x as u32, raster.y as u32, 1.0);
        }
        let (sigma, radius) = GAUSSIAN;
        let axis = |at: f64, size: u32| {
            let first = (at - 0.5 - radius).ceil().max(0.0) as u32;
            let last = ((at - 0.5 + radius).floor() as u32).min(size - 1);
            let mut weights = [0.0; 2 * REACH];
            for (weight, i) in weights.iter_mut().zip(first..=last) {
                let d = (f64::from(i) + 0.5 - at) / sigma;
                *weight = (-0.5 * d * d).exp();
            }
            let sum: f64 = weights.iter().sum();
            (first..=last).zip(weights.map(|weight| weight / sum))
        };
        let columns = axis(raster.x, self.width);
        for (y, wy) in axis(raster.y, self.height) {
            columns.clone().for_each(|(x, wx)| add(x, y, wx * wy));
        }
    }

    /// Adds one contribution.
    fn add_one(&self, x: u32, y: u32, value: Spectrum) {
        let mut sum = Sum::default();
        sum.add(value, self.outliers);
        self.add_pixel(x, y, &sum);
    }

    /// Adds a sum of contributions.
    fn add_pixel(&self, x: u32, y: u32, sum: &Sum) {
        let (x, y) = (x.min(self.width - 1) as usize, y.min(self.height - 1));
        let weight = f64::from(self.weight);
        let fixed = sum.value.to_array().map(|v| (v * (ONE * weight)) as i128);
        let mut row = lock(&self.rows[y as usize]);
        for (sum, v) in row.sums[x].iter_mut().zip(fixed) {
            *sum = sum.saturating_add(v);
        }
        if let Some(pixel) = row.largest.get_mut(x) {
            pixel.add_scaled(&sum.largest, weight);
        }
    }

    /// Adds another film of the same size, as if its samples had been taken here. Outliers are told among those that were
    /// watched.
    pub fn merge(&mut self, other: &Film) -> Result<()> {
        if (self.width, self.height) != (other.width, other.height) {
            return Err(Error::Input(format!(
                "cannot add a film of {}x{} to one of {}x{}",
                other.width, other.height, self.width, self.height
            )));
        }
        self.add_rows(other, |v| v, 1.0);
        self.samples += other.samples;
        self.weights += other.weights;
        *self.dropped.get_mut() += other.dropped();
        Ok(())
    }

    /// Adds what another film of the same size has, times a factor, as samples that are counted elsewhere.
    pub fn add_scaled(&self, other: &Film, factor: f64) {
        let scale = factor * f64::from(self.weight);
        self.add_rows(other, |v| (v as f64 * scale) as i128, scale);
        self.dropped.fetch_add(other.dropped(), Ordering::Relaxed);
    }

    fn add_rows(&self, other: &Film, scaled: impl Fn(i128) -> i128, scale: f64) {
        for (row, other) in self.rows.iter().zip(&other.rows) {
            let (mut row, other) = (lock(row), lock(other));
            for (sum, &v) in row.sums.iter_mut().flatten().zip(other.sums.iter().flatten()) {
                *sum = sum.saturating_add(scaled(v));
            }
            for (pixel, largest) in row.largest.iter_mut().zip(&other.largest) {
                pixel.add_scaled(largest, scale);
            }
        }
    }

    /// The sums of a row of pixels, in double precision.
    pub fn row(&self, y: u32) -> Vec<Spectrum> {
        let row = lock(&self.rows[y as usize]);
        row.sums.iter().map(|sums| Spectrum::from_array(sums.map(|v| v as f64 / ONE))).collect()
    }

    /// The mean of a pixel, in double precision.
    pub fn mean(&self, x: u32, y: u32) -> Spectrum {
        let row = lock(&self.rows[y as usize]);
        Spectrum::from_array(row.sums[x as usize].map(|v| v as f64 / (ONE * self.weights.max(1) as f64)))
    }

    /// The image so far: weighted means of the samples; black when there are none.
    pub fn image(&self) -> Image {
        let pixels: Vec<Vec3> =
            (0..self.height).flat_map(|y| (0..self.width).map(move |x| self.mean(x, y).as_vec3())).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// The image so far, without outliers where these are watched.
    pub fn shown(&self) -> Image {
        self.without_outliers().unwrap_or_else(|| self.image())
    }

    /// The image so far without outliers, which is biased; `None` where these were not watched.
    pub fn without_outliers(&self) -> Option<Image> {
        if !self.outliers {
            return None;
        }
        let sums: Vec<Spectrum> = (0..self.height).flat_map(|y| self.row(y)).collect();
        let largest: Vec<Largest> = self.rows.iter().flat_map(|row| lock(row).largest.clone()).collect();
        let excess = outliers::excess(self.width as usize, &sums, &largest);
        let weights = self.weights.max(1) as f64;
        // Sums end at 9e18, their largest contributions do not.
        let rest = |(&sum, excess): (&Spectrum, Spectrum)| (sum - excess).max(Spectrum::ZERO);
        let pixels = sums.iter().zip(excess).map(|pair| (rest(pair) * (1.0 / weights)).as_vec3());
        Some(Image { width: self.width, height: self.height, pixels: pixels.collect() })
    }
}

/// Rows are whole between additions, so that a panic elsewhere does not matter.
fn lock(row: &Mutex<Row>) -> MutexGuard<'_, Row> {
    row.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(filter: Filter) -> Film {
        Film::new(&FilmSettings { width: 8, height: 6, filter })
    }

    #[test]
    fn any_order_and_any_split_give_the_same_bits() {
        let value = |i: u64| Spectrum::new(0.1 * i as f64, 1e9 / (i + 1) as f64, 1e-9 * i as f64);
        let at = |i: u64| DVec2::new((i * 7 % 80) as f64 / 10.0, (i * 13 % 60) as f64 / 10.0);
        for filter in [Filter::Box, Filter::Gaussian] {
            let (forward, backward) = (film(filter), film(filter));
            let (mut first, mut second) = (film(filter), film(filter));
            for i in 0..1000 {
                forward.add(at(i), value(i));
                backward.add(at(999 - i), value(999 - i));
                if i < 300 { &first } else { &second }.add(at(i), value(i));
            }
            first.count_samples(0);
            second.count_samples(0);
            first.merge(&second).unwrap();
            for other in [&backward, &first] {
                for (x, y) in (0..8).flat_map(|x| (0..6).map(move |y| (x, y))) {
                    assert_eq!(forward.mean(x, y), other.mean(x, y));
                }
            }
        }
    }

    #[test]
    fn samples_count_by_their_weight() {
        let mut film = film(Filter::Box);
        film.add(DVec2::ONE, Spectrum::ONE);
        film.count_samples(1);
        film.set_weight(3);
        film.add(DVec2::ONE, Spectrum::splat(5.0));
        film.count_samples(1);
        assert_eq!((film.samples(), film.mean(1, 1)), (2, Spectrum::splat(4.0)));
    }

    #[test]
    fn a_film_can_be_added_in_part() {
        let (mut film, other) = (film(Filter::Box), film(Filter::Box));
        other.add(DVec2::ONE, Spectrum::splat(8.0));
        film.set_weight(3);
        film.add(DVec2::ONE, Spectrum::ONE);
        film.add_scaled(&other, 0.25);
        film.count_samples(1);
        assert_eq!(film.mean(1, 1), Spectrum::splat(3.0));
    }

    #[test]
    fn no_outlier_makes_a_pixel_negative() {
        let film = Film::watching(&FilmSettings { width: 3, height: 3, filter: Filter::Box }, true);
        film.add(DVec2::ONE, Spectrum::new(1e300, 1e25, 0.0));
        film.add(DVec2::ONE, Spectrum::ONE);
        assert!(film.shown().pixels.iter().all(|p| p.min_element() >= 0.0), "{:?}", film.shown());
    }

    #[test]
    fn the_gaussian_keeps_energy_up_to_the_border() {
        for raster in [DVec2::new(3.3, 2.8), DVec2::new(0.0, 0.0), DVec2::new(7.99, 5.99)] {
            let film = film(Filter::Gaussian);
            film.add(raster, Spectrum::splat(2.0));
            let sum: f64 = film.image().pixels.iter().map(|p| f64::from(p.x)).sum();
            assert!((sum - 2.0).abs() < 1e-6, "{raster}: {sum}");
        }
    }

    #[test]
    fn a_pixels_samples_are_added_as_each_alone() {
        let samples: Vec<(DVec2, Spectrum)> = (0..40)
            .map(|i| f64::from(i) / 40.0)
            .map(|u| (DVec2::new(u, (7.0 * u).fract()), Spectrum::new(u, 1.0 - u, 5.0 * u)))
            .collect();
        for (filter, x, y) in [Filter::Box, Filter::Gaussian]
            .into_iter()
            .flat_map(|filter| [(0, 0), (3, 2), (7, 5)].map(|(x, y)| (filter, x, y)))
        {
            let (together, alone) = (film(filter), film(filter));
            let at = |offset: DVec2| DVec2::new(x.into(), y.into()) + offset;
            together.add_samples(x, y, samples.iter().map(|&(offset, value)| (at(offset), value)));
            samples.iter().for_each(|&(offset, value)| alone.add(at(offset), value));
            for (a, b) in together.image().pixels.iter().zip(&alone.image().pixels) {
                assert!(
                    (*a - *b).abs().max_element() <= 1e-6 * b.max_element(),
                    "{filter:?} ({x},{y}): {a} {b}"
                );
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_counted() {
        let film = film(Filter::Box);
        film.add(DVec2::ONE, Spectrum::new(f64::NAN, 1.0, 1.0));
        film.add(DVec2::ONE, Spectrum::new(1.0, f64::INFINITY, 1.0));
        assert_eq!((film.dropped(), film.mean(1, 1)), (2, Spectrum::ZERO));
    }
}
