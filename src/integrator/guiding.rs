//! The pre-pass that learns where light subpaths are worth sending: a small light and eye pass, and what the roulette's
//! connections of these bring to the image, by the direction in which their light left.

use super::bidirectional::Bidirectional;
use super::tile::Sample;
use super::watched::{Need, PixelSums, Seen, roulette_share};
use crate::error::Result;
use crate::light::EmissionGuide;
use crate::math::luminance;
use crate::sampler::{Family, Purpose, Sampler, Stream};
use crate::settings::AutoSwitch;
use crate::subpath::from_light;
use crate::tally::{Clock, Tally};
use glam::DVec2;
use rayon::prelude::*;
use std::sync::Arc;

/// Part of an iteration's subpaths that the pre-pass has, and where the one before found that guiding does not pay.
const PARTS: [u32; 2] = [8, 64];
/// Light subpaths of the pre-pass, and eye subpaths, at least and at most.
const LIGHT_SUBPATHS: (u64, u64) = (1 << 12, 1 << 18);
const EYE_SUBPATHS: (u64, u64) = (1 << 12, 1 << 17);
/// How much larger a pre-pass must be to be worth its while after another.
const GROWTH: u64 = 4;
/// Eye subpaths of one task.
const CHUNK: u64 = 1024;
/// Side of the squares of pixels that are looked at as a whole.
const REGION: u32 = 8;
/// The roulette's share of the noise, without guiding, below which nothing is guided: what is sent where the roulette finds it
/// is missing elsewhere (benches/record/integrators.md).
const WORTH: f64 = 0.02;
/// Light vertices among which what was found must be spread for that share to be believed: caustics that were hardly met yet
/// seem to be little.
const SPREAD: f64 = 100.0;

/// What eye subpaths of the pre-pass saw.
#[derive(Default)]
struct Observed {
    /// Light vertices that the roulette kept, and what they brought.
    found: Vec<(u32, f64)>,
    /// For each eye subpath the region, and what it saw.
    seen: Vec<(u32, Seen)>,
}

impl Bidirectional<'_> {
    /// Learns from a pre-pass, unless one of about the size that is due has been learned from before. It depends on the
    /// seed and the size alone, so that iterations of one size share its result and can be added up.
    pub(super) fn learn_guide(&mut self) -> Result<()> {
        let size = self.size;
        let film = &self.world.scene.film;
        let samples = u64::from(film.width) * u64::from(film.height) * u64::from(size.samples);
        let part = u64::from(PARTS[usize::from(!self.guiding_pays)]);
        let eye_subpaths = (samples / part).clamp(EYE_SUBPATHS.0, EYE_SUBPATHS.1);
        let light_subpaths = (size.light_subpaths / part).clamp(LIGHT_SUBPATHS.0, LIGHT_SUBPATHS.1);
        if light_subpaths < GROWTH * self.guided_by {
            return Ok(());
        }
        self.guided_by = light_subpaths;
        self.size.light_subpaths = light_subpaths;
        self.techniques.guide = None;
        self.plan();
        self.light_pass(Stream::GuideLight, 0, None, &|_| ());
        self.build_trees(Stream::GuideLight, 0)?;
        // Collected in order: sums must not depend on threads.
        let observed: Vec<Observed> = (0..eye_subpaths / CHUNK)
            .into_par_iter()
            .map(|chunk| {
                let mut observed = Observed::default();
                (chunk * CHUNK..(chunk + 1) * CHUNK).for_each(|index| self.observe(index, &mut observed));
                observed
            })
            .collect();
        self.guiding_pays = self.settings.guiding == AutoSwitch::On || self.does_guiding_pay(&observed);
        let (world, seed) = (self.world, self.settings.seed);
        let observations = observed.iter().flat_map(|o| &o.found).filter_map(|&(vertex, score)| {
            let subpath = self.cache.subpath_of(vertex as usize) as u64;
            let sampler = Family::new(seed, 0, Stream::GuideLight, subpath >> 32).member(subpath as u32);
            let (light, u) = from_light::start(world, None, &sampler)?;
            Some((light, u, score))
        });
        if self.guiding_pays {
            self.techniques.guide = EmissionGuide::learn(&world.lights, observations).map(Arc::new);
        }
        self.size = size;
        Ok(())
    }

    /// Squares of pixels that are looked at as a whole, across and down.
    fn regions(&self) -> [u32; 2] {
        let film = &self.world.scene.film;
        [film.width, film.height].map(|side| side.div_ceil(REGION))
    }

    /// Whether guiding gains more than it costs, as far as is known.
    fn does_guiding_pay(&self, observed: &[Observed]) -> bool {
        let found = observed.iter().flat_map(|o| &o.found).map(|(_, value)| value);
        let (sum, squares) = found.fold((0.0, 0.0), |(sum, squares), v| (sum + v, squares + v * v));
        if sum * sum < SPREAD * squares {
            return true;
        }
        let [across, down] = self.regions();
        let mut regions = vec![PixelSums::default(); (across * down) as usize];
        for (region, seen) in observed.iter().flat_map(|o| &o.seen) {
            regions[*region as usize].add(seen, 1.0, 0.0);
        }
        let needs: Vec<Need> = regions.iter().map(PixelSums::need).collect();
        roulette_share(&needs) >= WORTH
    }

    /// What light vertices give to an eye subpath through the roulette.
    fn observe(&self, index: u64, observed: &mut Observed) {
        let film = &self.world.scene.film;
        let sampler = Sampler::new(self.settings.seed, 0, Stream::GuideEye, index);
        let raster = sampler.u2(0, Purpose::Raster) * DVec2::new(film.width.into(), film.height.into());
        let region = raster.y as u32 / REGION * self.regions()[0] + raster.x as u32 / REGION;
        let sample = Sample { raster, index, sampler, plays: 1.0 };
        let seen = self.radiance_and(&sample, Clock::off(), &mut Tally::default(), &mut |light, value| {
            observed.found.push((light, luminance(value)));
        });
        observed.seen.push((region, seen));
    }
}
