//! What an integrator says of a scene, with how sure it is: means over independent iterations.

use super::stats::{Family, z_p};
use glam::DVec3;
use hrr::film::Film;
use hrr::math::luminance;
use hrr::scene::Scene;
use hrr::settings::Settings;
use hrr::subpath::World;

/// Mean luminance of square blocks of pixels, and the variance of that mean.
pub struct Estimate {
    pub mean: Vec<f64>,
    pub variance: Vec<f64>,
    /// Of the whole image, per channel.
    pub total: DVec3,
    pub total_variance: DVec3,
}

/// Runs `settings.iterations` iterations, each on a film of its own.
pub fn estimate(scene: &Scene, settings: &Settings, block: u32) -> Estimate {
    let world = World::new(scene, settings).unwrap();
    let mut integrator = hrr::integrator::new(&world, settings).unwrap();
    estimate_of(scene, settings.iterations, block, |iteration| {
        let mut film = Film::new(&scene.film);
        integrator.iterate(iteration, &mut film, &|_| ()).unwrap();
        film
    })
}

/// What independent films say together.
pub fn estimate_of(scene: &Scene, films: u64, block: u32, mut film: impl FnMut(u64) -> Film) -> Estimate {
    let blocks = (scene.film.width.div_ceil(block), scene.film.height.div_ceil(block));
    let count = (blocks.0 * blocks.1) as usize;
    let (mut sum, mut square) = (vec![0.0; count], vec![0.0; count]);
    let (mut total, mut total_square) = (DVec3::ZERO, DVec3::ZERO);
    for index in 0..films {
        let film = film(index);
        assert_eq!(film.dropped(), 0, "samples that are not finite");
        let mut now = vec![0.0; count];
        let mut all = DVec3::ZERO;
        for y in 0..film.height() {
            for x in 0..film.width() {
                let value = film.mean(x, y);
                now[(y / block * blocks.0 + x / block) as usize] += luminance(value);
                all += value;
            }
        }
        for i in 0..count {
            sum[i] += now[i];
            square[i] += now[i] * now[i];
        }
        total += all;
        total_square += all * all;
    }
    let n = films as f64;
    let variance = |sum: f64, square: f64| ((square / n - (sum / n) * (sum / n)) / (n - 1.0)).max(0.0);
    Estimate {
        mean: sum.iter().map(|s| s / n).collect(),
        variance: sum.iter().zip(&square).map(|(&s, &q)| variance(s, q)).collect(),
        total: total / n,
        total_variance: DVec3::new(
            variance(total.x, total_square.x),
            variance(total.y, total_square.y),
            variance(total.z, total_square.z),
        ),
    }
}

impl Estimate {
    /// Asserts that both say the same: every block and the image's mean within what their noise allows, and the mean
    /// within `relative`.
    #[track_caller]
    pub fn assert_agrees(&self, other: &Self, relative: f64, names: &str) {
        let mut family = self.blocks(other, f64::INFINITY, names);
        let variance = self.total_variance + other.total_variance;
        for c in 0..3 {
            family.add(
                format!("{names}, mean of channel {c}"),
                p_of((self.total - other.total)[c], variance[c]),
            );
        }
        let ratio = self.total / other.total;
        let noise = variance.map(f64::sqrt) / other.total;
        println!("{names}: ratio of means {ratio:.5} (noise {noise:.5})");
        family.assert();
        assert!((ratio - 1.0).abs().max_element() < relative, "{names}: the means' ratio is {ratio}");
    }

    /// Asserts that both say the same where both are sure: in the blocks whose standard deviations are at most `noise`
    /// of the mean. Returns how many those are.
    #[track_caller]
    pub fn assert_agrees_where_sure(&self, other: &Self, noise: f64, names: &str) -> usize {
        let family = self.blocks(other, noise, names);
        println!("{names}: {} of {} blocks are sure to {noise}", family.len(), self.mean.len());
        family.assert();
        family.len()
    }

    fn blocks(&self, other: &Self, noise: f64, names: &str) -> Family {
        let mut family = Family::default();
        let sure = |e: &Self, i: usize| e.variance[i].sqrt() <= noise * e.mean[i] || noise == f64::INFINITY;
        for i in (0..self.mean.len()).filter(|&i| sure(self, i) && sure(other, i)) {
            let what = format!("{names}, block {i}: {} against {}", self.mean[i], other.mean[i]);
            family.add(what, p_of(self.mean[i] - other.mean[i], self.variance[i] + other.variance[i]));
        }
        family
    }
}

/// How likely a difference of means is by chance.
fn p_of(difference: f64, variance: f64) -> f64 {
    if difference == 0.0 { 1.0 } else { z_p(difference / variance.sqrt()) }
}
