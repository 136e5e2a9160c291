//! Pixels in square tiles, spread over threads.

use super::adaptive::Adaptive;
use super::parts::Part;
use super::spread::PixelPlan;
use super::watched::{PixelSums, Seen, work};
use crate::film::Film;
use crate::sampler::{Family, Purpose, Sampler, Stream};
use crate::tally::{Clock, Tally};
use glam::DVec2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

const SIDE: u32 = 16;

/// Pixels of a tile, and what was seen there.
type Watched = Vec<(u32, u32, PixelSums)>;

/// One pixel in this many has its shadow rays and queries timed.
const TIMED: usize = 16;
/// How far these are shifted from row to row, so that they lie everywhere.
const SHIFT: u32 = 5;

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
    /// How often it counts as having played the roulette; 0: it does not play.
    pub plays: f64,
}

/// Takes a part of the samples of every pixel of a film, `samples` or what `adaptive` says, and adds what `radiance` makes
/// of them. The time less what `radiance` itself puts into `roulette_seconds` and `visibility` is `eye_trace`.
pub(super) fn sample_film(
    film: &Film,
    (seed, iteration, samples): (u64, u64, u32),
    part: Part,
    adaptive: Option<&mut Adaptive>,
    progress: &(dyn Fn(f64) + Sync),
    radiance: impl Fn(&Sample, Clock, &mut Tally) -> Seen + Sync,
) -> Tally {
    let (width, height) = (film.width(), film.height());
    let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
    let (tiles, done) = ((across * down) as usize, AtomicUsize::new(0));
    let plans = adaptive.as_deref();
    let parts: Vec<(Tally, Watched)> = (0..tiles)
        .into_par_iter()
        .map(|tile| {
            let (mut tally, mut watched) = (Tally::default(), Vec::new());
            let (left, top) = (tile as u32 % across * SIDE, tile as u32 / across * SIDE);
            let mut seconds = 0.0;
            Clock::sampled(0, 1).time(&mut seconds, || {
                for y in top..(top + SIDE).min(height) {
                    for x in left..(left + SIDE).min(width) {
                        let pixel = u64::from(y) * u64::from(width) + u64::from(x);
                        let clock = clock_of(x, y);
                        let plan = plans
                            .map_or(PixelPlan { samples, share: 1.0 }, |plans| plans.pixel(x, y, samples));
                        let taken = part.range(plan.samples);
                        // A pixel of fewer or more samples than it counts.
                        let scale = f64::from(samples) / f64::from(part.of) / taken.len() as f64;
                        let offset =
                            if plan.share < 1.0 { pixel_offset(seed, iteration, pixel) } else { 0.0 };
                        let family = Family::new(seed, iteration, Stream::Eye, pixel);
                        let mut sums = PixelSums::default();
                        tally.camera_rays += taken.len() as u64;
                        let values = taken.map(|n| {
                            let index = pixel * u64::from(samples) + u64::from(n);
                            let sampler = family.member(n);
                            let raster = DVec2::new(x.into(), y.into()) + sampler.u2(0, Purpose::Raster);
                            let plays = plan.plays(n, offset);
                            let sample = Sample { raster, index, sampler, plays };
                            let before = work(&tally);
                            let seen = radiance(&sample, clock, &mut tally);
                            if plans.is_some() {
                                sums.add(&seen, plan.share, work(&tally) - before);
                            }
                            (raster, seen.radiance * scale)
                        });
                        film.add_samples(x, y, values);
                        if plans.is_some() {
                            watched.push((x, y, sums));
                        }
                    }
                }
            });
            tally.eye_trace += seconds;
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / tiles as f64);
            (tally, watched)
        })
        .collect();
    let tally =
        parts.iter().fold(Tally::default(), |sum, (tally, _)| sum.plus(*tally)).less_parts_of_eye_trace();
    if let Some(adaptive) = adaptive {
        for (_, pixels) in &parts {
            adaptive.learn(pixels);
        }
    }
    tally
}

/// The clock of a pixel.
fn clock_of(x: u32, y: u32) -> Clock {
    Clock::sampled((x + SHIFT * y) as usize, TIMED)
}

/// Where a pixel begins to count which of its samples play the roulette.
fn pixel_offset(seed: u64, iteration: u64, pixel: u64) -> f64 {
    Sampler::new(seed, iteration, Stream::Pixel, pixel).u1(0, Purpose::Roulette)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However small a mirror is, its queries are timed: what they cost decides how often they are asked.
    #[test]
    fn timed_pixels_lie_everywhere() {
        let timed = |x: u32, y: u32| clock_of(x, y).count(1.0);
        for (left, top) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
            let sum: f64 = (0..16).flat_map(|x| (0..16).map(move |y| timed(left + x, top + y))).sum();
            assert_eq!(sum, 256.0);
            assert!((0..6).any(|x| (0..6).any(|y| timed(left + x, top + y) > 0.0)), "{left} {top}");
        }
    }
}
