//! Pixels in square tiles, spread over threads.

use crate::film::Film;
use crate::math::Spectrum;
use crate::sampler::{Purpose, Sampler, Stream};
use crate::tally::{Clock, Tally};
use glam::DVec2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

const SIDE: u32 = 16;
/// One tile in this many has its shadow rays and queries timed.
const TIMED: usize = 16;

/// A little under 1: the film's size times this is inside it.
pub(super) const INSIDE: f64 = 1.0 - 1e-12;

/// One eye sample: where and with which numbers.
pub struct Sample {
    /// Position on the film.
    pub raster: DVec2,
    /// The sample's number within its iteration.
    pub index: u64,
    /// Its random numbers.
    pub sampler: Sampler,
}

/// Takes `samples` samples of every pixel of a film and adds what `radiance` makes of them. The time less what
/// `radiance` itself puts into `roulette_seconds` and `visibility` is `eye_trace`.
pub fn sample_film(
    film: &Film,
    (seed, iteration, samples): (u64, u64, u32),
    progress: &(dyn Fn(f64) + Sync),
    radiance: impl Fn(&Sample, Clock, &mut Tally) -> Spectrum + Sync,
) -> Tally {
    let (width, height) = (film.width(), film.height());
    let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
    let (tiles, done) = ((across * down) as usize, AtomicUsize::new(0));
    (0..tiles)
        .into_par_iter()
        .map(|tile| {
            let mut tally = Tally::default();
            let clock = Clock::sampled(tile, TIMED.min(tiles));
            let (left, top) = (tile as u32 % across * SIDE, tile as u32 / across * SIDE);
            let mut seconds = 0.0;
            Clock::sampled(0, 1).time(&mut seconds, || {
                for y in top..(top + SIDE).min(height) {
                    for x in left..(left + SIDE).min(width) {
                        let pixel = u64::from(y) * u64::from(width) + u64::from(x);
                        let values = (0..samples).map(|n| {
                            let index = pixel * u64::from(samples) + u64::from(n);
                            let sampler = Sampler::in_family(seed, iteration, Stream::Eye, pixel, n);
                            let raster = DVec2::new(x.into(), y.into()) + sampler.u2(0, Purpose::Raster);
                            let sample = Sample { raster, index, sampler };
                            (raster, radiance(&sample, clock, &mut tally))
                        });
                        film.add_samples(x, y, values);
                    }
                }
            });
            tally.camera_rays += u64::from((left + SIDE).min(width) - left)
                * u64::from((top + SIDE).min(height) - top)
                * u64::from(samples);
            tally.eye_trace += seconds;
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / tiles as f64);
            tally
        })
        .reduce(Tally::default, Tally::plus)
        .less_parts_of_eye_trace()
}
