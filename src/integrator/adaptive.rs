//! What an integrator that adapts remembers, and what it makes of that.

use super::spread::{PixelPlan, Spread};
use super::watched::{PixelSums, Watched, work};
use crate::film::FilmSettings;
use crate::tally::Tally;

/// Most light vertices that the query which kept one should keep, on average over all that are kept: the price of more is that
/// of a query, and what they bring ever less. Where vertices are dense, in a caustic that light is guided to, queries keep many
/// more than elsewhere.
const KEPT: f64 = 8.0;

/// What an integrator that adapts remembers.
#[derive(Debug)]
pub(super) struct Adaptive {
    watched: Watched,
    /// What the visit of a node costs, over all that a sample costs without the roulette.
    visit: f64,
    /// Factor on how many light vertices the roulette keeps.
    kept: f64,
    /// By what the last iteration would have that lowered.
    lower: f64,
    spread: Option<Spread>,
}

impl Adaptive {
    /// Nothing so far.
    pub fn new(film: &FilmSettings) -> Self {
        Self {
            watched: Watched::new(film.width, film.height),
            visit: 0.0,
            kept: 1.0,
            lower: 1.0,
            spread: None,
        }
    }

    /// What a pixel gets in an iteration of `samples`.
    pub fn pixel(&self, x: u32, y: u32, samples: u32) -> PixelPlan {
        self.spread.as_ref().map_or(PixelPlan { samples, share: 1.0 }, |spread| spread.pixel(x, y))
    }

    /// Factor on how many light vertices the roulette should keep.
    pub fn kept(&self) -> f64 {
        self.kept
    }

    /// Learns from a part of an iteration's eye samples.
    pub fn learn(&mut self, pixels: &[(u32, u32, PixelSums)]) {
        for (x, y, sums) in pixels {
            self.watched.add(*x, *y, sums);
        }
    }

    /// Learns what all parts cost.
    pub fn learn_costs(&mut self, tally: &Tally) {
        let all = tally.eye_trace + tally.roulette_seconds + tally.visibility;
        let visit = tally.playing / tally.played_work.max(1.0);
        // What is timed in some places only may seem to be more than all.
        let rest = (all - visit * work(tally)).max(0.1 * all).max(1e-9);
        self.visit = visit / rest * tally.camera_rays.max(1) as f64;
    }

    /// Learns how many light vertices the roulette kept.
    pub fn learn_kept(&mut self, tally: &Tally) {
        let [accepted, squares] = [tally.roulette.accepted, tally.kept_squares].map(|n| n as f64);
        self.lower = (KEPT * accepted / squares.max(1.0)).min(1.0);
    }

    /// Has the roulette keep fewer, where the last iteration kept many. For iterations that are larger than that: among those
    /// of one size the ones that followed kept too few in caustics (benches/record/integrators.md).
    pub fn moderate(&mut self) {
        self.kept *= self.lower;
        self.lower = 1.0;
    }

    /// Plans iterations to come.
    pub fn plan(&mut self, samples: u32) {
        self.spread = self.watched.plan(samples, self.visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Filter;
    use crate::roulette::QueryCounters;

    fn kept(beside: u64) -> Tally {
        let roulette = QueryCounters { accepted: 100, ..QueryCounters::default() };
        Tally { roulette, kept_squares: 100 * beside, ..Tally::default() }
    }

    #[test]
    fn fewer_are_kept_once_for_each_iteration_that_kept_many() {
        let mut adaptive = Adaptive::new(&FilmSettings { width: 4, height: 4, filter: Filter::Box });
        adaptive.learn_kept(&kept(32));
        assert_eq!(adaptive.kept(), 1.0);
        adaptive.moderate();
        adaptive.moderate();
        assert_eq!(adaptive.kept(), 0.25);
        adaptive.learn_kept(&kept(4));
        adaptive.moderate();
        assert_eq!(adaptive.kept(), 0.25, "few are no reason to keep more");
    }
}
