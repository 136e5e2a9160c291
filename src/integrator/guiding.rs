//! The pre-pass that learns where light subpaths are worth sending: a small light and eye pass, and what the roulette's
//! connections of these bring to the image, by the direction in which their light left.

use super::bidirectional::Bidirectional;
use crate::connect::EyeVertex;
use crate::error::Result;
use crate::light::EmissionGuide;
use crate::math::luminance;
use crate::sampler::{Family, Purpose, Sampler, Stream};
use crate::subpath::from_light;
use crate::tally::{Clock, Tally};
use glam::DVec2;
use rayon::prelude::*;
use std::sync::Arc;

/// Light subpaths of the pre-pass, and eye subpaths: an eighth of an iteration's, within these bounds.
const LIGHT_SUBPATHS: (u64, u64) = (1 << 12, 1 << 18);
const EYE_SUBPATHS: (u64, u64) = (1 << 12, 1 << 17);
/// How much larger a pre-pass must be to be worth its while after another.
const GROWTH: u64 = 4;
/// Eye subpaths of one task.
const CHUNK: u64 = 1024;

impl Bidirectional<'_> {
    /// Learns from a pre-pass, unless one of about the size that is due has been learned from before. It depends on the
    /// seed and the size alone, so that iterations of one size share its result and can be added up.
    pub(super) fn learn_guide(&mut self) -> Result<()> {
        let size = self.size;
        let film = &self.world.scene.film;
        let samples = u64::from(film.width) * u64::from(film.height) * u64::from(size.samples);
        let eye_subpaths = (samples / 8).clamp(EYE_SUBPATHS.0, EYE_SUBPATHS.1);
        let light_subpaths = (size.light_subpaths / 8).clamp(LIGHT_SUBPATHS.0, LIGHT_SUBPATHS.1);
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
        let found: Vec<Vec<(u32, f64)>> = (0..eye_subpaths / CHUNK)
            .into_par_iter()
            .map(|chunk| {
                let mut found = Vec::new();
                (chunk * CHUNK..(chunk + 1) * CHUNK).for_each(|index| self.observe(index, &mut found));
                found
            })
            .collect();
        let (world, seed) = (self.world, self.settings.seed);
        let observations = found.into_iter().flatten().filter_map(|(vertex, score)| {
            let subpath = self.cache.subpath_of(vertex as usize) as u64;
            let sampler = Family::new(seed, 0, Stream::GuideLight, subpath >> 32).member(subpath as u32);
            let (light, u) = from_light::start(world, None, &sampler)?;
            Some((light, u, score))
        });
        self.techniques.guide = EmissionGuide::learn(&world.lights, observations).map(Arc::new);
        self.size = size;
        Ok(())
    }

    /// What light vertices give to an eye subpath through the roulette.
    fn observe(&self, index: u64, found: &mut Vec<(u32, f64)>) {
        let (world, film) = (self.world, &self.world.scene.film);
        let sampler = Sampler::new(self.settings.seed, 0, Stream::GuideEye, index);
        let raster = sampler.u2(0, Purpose::Raster) * DVec2::new(film.width.into(), film.height.into());
        let mut eye = EyeVertex::first(world, &self.techniques, raster, &sampler).vertex();
        let mut tally = Tally::default();
        while let Some(vertex) = eye.filter(|v| v.walk.depth < self.settings.max_depth) {
            if !vertex.lobes.is_empty() {
                self.play_roulette(&vertex, &sampler, Clock::off(), &mut tally, &mut |light, value| {
                    found.push((light, luminance(value)));
                });
            }
            eye = vertex.next(world, &self.techniques, &sampler).vertex();
        }
    }
}
