//! A study: several settings of one scene, each run many times, in turn, up a ladder of times or of iterations.

use super::results::Row;
use super::{flip, metric};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::image::Image;
use crate::integrator;
use crate::math::luminance;
use crate::math::relative::{Tiles, floor, local_square, trimmed_mean};
use crate::render::{self, counters::processor_seconds, noise::TRIMMED};
use crate::sampler::counter::combine;
use crate::scene::Scene;
use crate::settings::{Integrator, Settings, Switch};
use crate::subpath::World;
use glam::Vec3;
use rayon::prelude::*;
use std::time::Instant;

/// Most bytes of images that a study may keep.
const MOST_BYTES: usize = 2 << 30;
/// Independent renders that a reference is made of, and the share of a study's time that they take.
const REFERENCE: (u64, f64) = (4, 0.5);
/// Rungs of a ladder of renders by time.
const RUNGS: u32 = 5;
/// Iterations of the longest rung at most.
const MOST_ITERATIONS: u64 = 1 << 12;
/// A pixel this many times brighter than itself and its tile is a firefly.
const FIREFLY: f64 = 10.0;

/// A setting of a study.
#[derive(Debug, Clone)]
pub struct Contender {
    /// Name, without commas.
    pub name: String,
    /// Its settings; budgets are not looked at.
    pub settings: Settings,
    /// Whether it blurs, so that its mean is no reference.
    pub biased: bool,
}

/// What is compared with.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The mean.
    pub mean: Image,
    /// Variance of each pixel's mean.
    pub variance: Image,
}

/// A finished study.
#[derive(Debug)]
pub struct Study {
    /// By setting, run and iterations.
    pub rows: Vec<Row>,
    /// What errors were measured against.
    pub reference: Reference,
    /// The setting that it was made by; `None` when it was given.
    pub owner: Option<usize>,
    /// An image of each setting: the first run's longest.
    pub images: Vec<Image>,
    /// Iterations of each setting's longest rung.
    pub longest: Vec<u64>,
}

/// One run's images on the ladder, and what they cost.
struct Ladder {
    images: Vec<Image>,
    costs: Vec<Cost>,
}

/// What a run had cost at a rung.
#[derive(Debug, Clone, Copy)]
struct Cost {
    iterations: u64,
    seconds: f64,
    setup: f64,
    cpu: Option<f64>,
    stages: [f64; 5],
}

/// Runs it. Each run of each setting gets an equal share of `seconds`, or of half of that where no reference is `given`.
/// Where a setting leaves sizes of iterations open, rungs are renders by time, each as a user would have it; else all
/// iterations are alike, and are looked at after 1, 2, 4, ... of them, as many as the first run has time for. `runs` is at
/// least 2. `exposure`: stops by which images are brighter when FLIP judges them. `tell` is told the finished share; false
/// from it ends the study with an error.
///
/// # Errors
/// What rendering reports; [`Error::Memory`] when the images would not fit.
pub fn run(
    scene: &Scene,
    contenders: &[Contender],
    runs: usize,
    seconds: f64,
    given: Option<Reference>,
    exposure: f32,
    tell: &dyn Fn(f64) -> bool,
) -> Result<Study> {
    let (owner, reference, begun) = match given {
        Some(reference) => (None, reference, 0.0),
        None => {
            let owner = trusted(scene, contenders)?;
            let told = |done: f64| tell(REFERENCE.1 * done);
            let reference = make_reference(scene, &contenders[owner].settings, REFERENCE.1 * seconds, &told)?;
            (Some(owner), reference, REFERENCE.1)
        }
    };
    let all = (runs.max(2) * contenders.len()) as f64;
    let share = (1.0 - begun) * seconds / all;
    let mut ladders: Vec<Vec<Ladder>> = contenders.iter().map(|_| Vec::new()).collect();
    let mut longest = vec![None; contenders.len()];
    for run in 0..runs.max(2) {
        for (i, contender) in contenders.iter().enumerate() {
            if !tell(begun + (1.0 - begun) * (run * contenders.len() + i) as f64 / all) {
                return Err(stopped());
            }
            let settings = Settings {
                // Numbers of its own: settings shall not share their noise.
                seed: combine(combine(contender.settings.seed, run as u64), i as u64) >> 1,
                ..contender.settings.clone()
            };
            let ladder = match settings.samples == 0 || settings.light_subpaths == 0 {
                true => climb_by_time(scene, &settings, share)?,
                false => climb(scene, &settings, share, longest[i])?,
            };
            longest[i] = ladder.costs.last().map(|c| c.iterations);
            ladders[i].push(ladder);
        }
        let kept: usize =
            ladders.iter().flatten().flat_map(|l| &l.images).map(|i| size_of_val(&i.pixels[..])).sum();
        if kept / (run + 1) * runs > MOST_BYTES {
            return Err(Error::Memory(
                "the study keeps an image of each run and rung: choose a smaller --size".into(),
            ));
        }
    }
    let rows = measure(contenders, &ladders, &reference, exposure);
    Ok(Study {
        rows,
        reference,
        owner,
        images: ladders.iter().map(|runs| runs[0].images[runs[0].images.len() - 1].clone()).collect(),
        longest: longest.into_iter().map(|n| n.unwrap_or(0)).collect(),
    })
}

/// A render of so many seconds, independent of those with other numbers.
fn by_time(scene: &Scene, settings: &Settings, seconds: f64, number: u64) -> Result<render::Outcome> {
    let seed = combine(settings.seed, number) >> 1;
    let timed = Settings { time: Some(seconds), error: None, seed, ..settings.clone() };
    render::render(scene, &timed, &render::Silent)
}

/// Runs one ladder of renders by time, each twice as long as the one before.
fn climb_by_time(scene: &Scene, settings: &Settings, seconds: f64) -> Result<Ladder> {
    let first = seconds / f64::from((1u32 << RUNGS) - 1);
    let mut ladder = Ladder { images: Vec::new(), costs: Vec::new() };
    for rung in 0..RUNGS {
        let (start, cpu_before) = (Instant::now(), processor_seconds());
        let outcome = by_time(scene, settings, first * f64::from(1u32 << rung), rung.into())?;
        let (seconds, s) = (start.elapsed().as_secs_f64(), outcome.stats.seconds);
        ladder.images.push(outcome.image());
        ladder.costs.push(Cost {
            iterations: outcome.stats.iterations,
            seconds,
            setup: (seconds - s.render).max(0.0),
            cpu: processor_seconds().zip(cpu_before).map(|(now, before)| now - before),
            stages: [s.light_trace, s.vertex_bvh_build, s.eye_trace, s.roulette, s.visibility],
        });
    }
    Ok(ladder)
}

/// Runs one ladder of iterations that are alike: up to `longest` iterations, or until the time is up.
fn climb(scene: &Scene, settings: &Settings, seconds: f64, longest: Option<u64>) -> Result<Ladder> {
    let world = World::new(scene, settings)?;
    let (start, cpu_before) = (Instant::now(), processor_seconds());
    let mut machine = integrator::new(&world, settings)?;
    let setup = start.elapsed().as_secs_f64();
    let mut film = Film::watching(&scene.film, settings.outlier_rejection == Switch::On);
    let mut ladder = Ladder { images: Vec::new(), costs: Vec::new() };
    let mut stages = [0.0; 5];
    let mut elapsed = setup;
    for iteration in 0..MOST_ITERATIONS {
        let start = Instant::now();
        let tally = machine.iterate(iteration, &mut film, &|_| ())?;
        elapsed += start.elapsed().as_secs_f64();
        let more = [
            tally.light_trace,
            tally.vertex_bvh_build,
            tally.eye_trace,
            tally.roulette_seconds,
            tally.visibility,
        ];
        stages.iter_mut().zip(more).for_each(|(s, m)| *s += m);
        let done = iteration + 1;
        if done.is_power_of_two() {
            ladder.images.push(film.shown());
            let cpu = processor_seconds().zip(cpu_before).map(|(now, before)| now - before);
            ladder.costs.push(Cost { iterations: done, seconds: elapsed, setup, cpu, stages });
            // The next rung takes as long as all so far.
            let up = match longest {
                Some(longest) => done >= longest,
                None => done >= 4 && 2.0 * elapsed > seconds,
            };
            if up {
                break;
            }
        }
    }
    Ok(ladder)
}

fn stopped() -> Error {
    Error::Input("stopped: nothing was written".into())
}

/// The setting to make a reference by: the first that is what `auto` would choose, or that does not blur at least. What
/// merely has little noise may not have found all light.
fn trusted(scene: &Scene, contenders: &[Contender]) -> Result<usize> {
    let first = contenders.first().ok_or_else(|| Error::Input("a study of no settings".into()))?;
    let auto = render::chosen(scene, &Settings { integrator: Integrator::Auto, ..first.settings.clone() })?;
    let find = |accept: &dyn Fn(&Contender) -> bool| contenders.iter().position(|c| !c.biased && accept(c));
    Ok(find(&|c| c.settings.integrator == auto).or_else(|| find(&|_| true)).unwrap_or(0))
}

/// Independent renders by time.
fn make_reference(
    scene: &Scene,
    settings: &Settings,
    seconds: f64,
    tell: &dyn Fn(f64) -> bool,
) -> Result<Reference> {
    let mut images = Vec::new();
    for i in 0..REFERENCE.0 {
        if !tell(i as f64 / REFERENCE.0 as f64) {
            return Err(stopped());
        }
        images.push(by_time(scene, settings, seconds / REFERENCE.0 as f64, !i)?.film.image());
    }
    Ok(mean_and_variance(&images))
}

fn measure(
    contenders: &[Contender],
    ladders: &[Vec<Ladder>],
    reference: &Reference,
    exposure: f32,
) -> Vec<Row> {
    let yardstick = Yardstick::new(reference);
    let own_noise = yardstick.noise();
    let seen = reference.mean.exposed(exposure);
    let flip = |image: &Image| {
        let map = flip::map(&image.exposed(exposure), &seen, flip::PIXELS_PER_DEGREE);
        map.iter().sum::<f64>() / map.len() as f64
    };
    let mut rows = Vec::new();
    for (contender, runs) in contenders.iter().zip(ladders) {
        for (run, ladder) in runs.iter().enumerate() {
            let flips: Vec<f64> = ladder.images.par_iter().map(&flip).collect();
            for (rung, ((image, cost), flip)) in (0..).zip(ladder.images.iter().zip(&ladder.costs).zip(flips))
            {
                let Cost { iterations, seconds, setup, cpu, stages } = *cost;
                let measured = yardstick.squares(image);
                rows.push(Row {
                    setting: contender.name.clone(),
                    biased: contender.biased,
                    run,
                    rung,
                    iterations,
                    seconds,
                    setup,
                    cpu,
                    square: measured[0] - own_noise[0],
                    whole: measured[1] - own_noise[1],
                    flip,
                    fireflies: yardstick.fireflies(image),
                    stages,
                });
            }
        }
    }
    rows
}

/// Errors relative to a reference, as [`metric::Metrics::error`] has them, and the same with all pixels counted.
struct Yardstick<'a> {
    reference: &'a Reference,
    grid: Tiles,
    tiles: Vec<f64>,
    eps: f64,
}

impl<'a> Yardstick<'a> {
    fn new(reference: &'a Reference) -> Self {
        let mean = &reference.mean;
        let grid = Tiles::new(mean.width, mean.height);
        let tiles = grid.means(|x, y| luminance(mean.pixels[(y * mean.width + x) as usize].as_dvec3()));
        let all = mean.pixels.iter().map(|p| luminance(p.as_dvec3())).sum::<f64>();
        Self { reference, grid, tiles, eps: floor(all / mean.pixels.len() as f64) }
    }

    fn tile(&self, i: usize) -> f64 {
        let width = self.reference.mean.width;
        self.tiles[self.grid.of(i as u32 % width, i as u32 / width)]
    }

    fn means(&self, square: impl Fn(usize) -> glam::DVec3) -> [f64; 2] {
        let n = self.reference.mean.pixels.len();
        let mut values: Vec<f64> = (0..n).map(|i| local_square(square(i), self.tile(i), self.eps)).collect();
        let whole = values.iter().sum::<f64>() / n as f64;
        [trimmed_mean(&mut values, TRIMMED), whole]
    }

    fn squares(&self, image: &Image) -> [f64; 2] {
        self.means(|i| {
            let d = image.pixels[i].as_dvec3() - self.reference.mean.pixels[i].as_dvec3();
            d * d
        })
    }

    /// The same of the reference itself.
    fn noise(&self) -> [f64; 2] {
        self.means(|i| self.reference.variance.pixels[i].as_dvec3())
    }

    fn fireflies(&self, image: &Image) -> u64 {
        let bright = |i: usize| {
            let own = luminance(self.reference.mean.pixels[i].as_dvec3());
            luminance(image.pixels[i].as_dvec3()) > FIREFLY * own.max(self.tile(i)).max(self.eps)
        };
        (0..image.pixels.len()).filter(|&i| bright(i)).count() as u64
    }
}

/// Of independent images.
fn mean_and_variance(images: &[Image]) -> Reference {
    let n = images.len() as f32;
    let pixel = |i: usize| {
        let mean = images.iter().map(|image| image.pixels[i]).sum::<Vec3>() / n;
        let squares =
            images.iter().map(|image| (image.pixels[i] - mean) * (image.pixels[i] - mean)).sum::<Vec3>();
        (mean, squares / (n * (n - 1.0)))
    };
    let (mean, variance) = (0..images[0].pixels.len()).map(pixel).unzip();
    let (width, height) = (images[0].width, images[0].height);
    Reference {
        mean: Image { width, height, pixels: mean },
        variance: Image { width, height, pixels: variance },
    }
}

/// Where an image differs from the reference in a person's eye: dark to bright by LDR-FLIP.
///
/// # Errors
/// As [`metric::compare`].
pub fn deviation_map(image: &Image, reference: &Image, exposure: f32) -> Result<Image> {
    metric::compare(image, reference, None, exposure)?;
    let [a, b] = [image, reference].map(|i| i.exposed(exposure));
    let map = flip::map(&a, &b, flip::PIXELS_PER_DEGREE);
    // Black, violet, orange, white.
    let ramp =
        [Vec3::ZERO, Vec3::new(0.25, 0.02, 0.35), Vec3::new(0.95, 0.25, 0.08), Vec3::new(1.0, 0.95, 0.8)];
    let colour = |v: f64| {
        let at = (v.clamp(0.0, 1.0) as f32) * 3.0;
        let k = (at as usize).min(2);
        ramp[k].lerp(ramp[k + 1], at - k as f32)
    };
    Ok(Image { pixels: map.into_iter().map(colour).collect(), ..*image })
}
