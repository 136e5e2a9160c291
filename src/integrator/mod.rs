//! Algorithms that turn a world into samples on a film, one iteration at a time. They touch no file and no thread
//! pool of their own: work is spread over the rayon pool that they are called in.

pub mod recipe;
pub mod plan;
pub mod path;
pub mod bidirectional;
mod adaptive;
mod emitters;
mod eye_pass;
mod guiding;
mod light_pass;
mod merging;
mod parts;
mod records;
mod spread;
mod tile;
mod watched;

pub(crate) use bidirectional::LIGHT_SHARE;
pub use plan::Plan;
pub use recipe::{Merge, Recipe};

use crate::error::Result;
use crate::film::{Film, FilmSettings};
use crate::settings::Settings;
use crate::subpath::World;
use crate::tally::Tally;
use std::time::Instant;

/// How large an iteration is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Eye samples of each pixel, at least 1.
    pub samples: u32,
    /// Light subpaths; without meaning to integrators that have none.
    pub light_subpaths: u64,
}

impl Size {
    /// What the settings say; where they leave it open, one sample, and as many light subpaths as eye samples.
    pub fn of(settings: &Settings, film: &FilmSettings) -> Self {
        let samples = settings.samples.max(1);
        let all = u64::from(film.width) * u64::from(film.height) * u64::from(samples);
        Self {
            samples,
            light_subpaths: if settings.light_subpaths == 0 { all } else { settings.light_subpaths },
        }
    }
}

/// An algorithm with the memory that it keeps between iterations.
pub trait Integrator {
    /// Makes iterations to come of this size, instead of [`Size::of`] the settings.
    ///
    /// # Errors
    /// As [`new`].
    fn resize(&mut self, size: Size) -> Result<()>;

    /// From now on, eye samples of an iteration go to the pixels that need them, as those before showed. Iterations then
    /// depend on those before.
    fn adapt(&mut self) {}

    /// The next iteration should be over by then, with fewer or more eye samples than its size says, if need be; what it
    /// counts for stays as it is. Iterations then depend on the clock.
    fn finish_by(&mut self, _deadline: Instant) {}

    /// Runs one iteration and adds it to the film, its samples counted. The result depends on the seed and the
    /// iteration's number alone, unless it adapts. `progress` is told the finished fraction now and then, from any thread.
    fn iterate(&mut self, iteration: u64, film: &mut Film, progress: &(dyn Fn(f64) + Sync)) -> Result<Tally>;

    /// Bytes held in the light-vertex cache and in its tree.
    fn bytes(&self) -> (usize, usize) {
        (0, 0)
    }
}

/// The integrator that the settings name, its pre-passes done.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) when light vertices do not fit a tree.
pub fn new<'a>(world: &'a World<'a>, settings: &'a Settings) -> Result<Box<dyn Integrator + 'a>> {
    Ok(match Recipe::of(settings.integrator) {
        None => Box::new(path::PathTracer::new(world, settings)),
        Some(recipe) => Box::new(bidirectional::Bidirectional::new(world, settings, recipe)?),
    })
}
