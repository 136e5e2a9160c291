//! Algorithms that turn a world into samples on a film, one iteration at a time. They touch no file and no thread
//! pool of their own: work is spread over the rayon pool that they are called in.

pub mod recipe;
pub mod plan;
pub mod path;
pub mod bidirectional;
mod guiding;
mod merging;
mod records;
mod tile;

pub use plan::Plan;
pub use recipe::Recipe;

use crate::error::Result;
use crate::film::Film;
use crate::settings::Settings;
use crate::subpath::World;
use crate::tally::Tally;

/// An algorithm with the memory that it keeps between iterations.
pub trait Integrator {
    /// Runs one iteration and adds it to the film, its samples counted. The result depends on the seed and the
    /// iteration's number alone. `progress` is told the finished fraction now and then, from any thread.
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
