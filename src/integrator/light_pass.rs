//! The light pass: light subpaths, the caches that they fill, and what of them the camera sees.

use super::bidirectional::Bidirectional;
use super::recipe::{Base, Merge};
use crate::connect;
use crate::error::Result;
use crate::film::Film;
use crate::light_cache::LightCache;
use crate::math::Aabb;
use crate::roulette::{MinimumRandom, Pregenerated};
use crate::sampler::{Family, Purpose, Sampler, Stream};
use crate::tally::Tally;
use crate::vertex_bvh::VertexBvh;
use glam::Vec3;
use obvhs::ploc::morton::morton_encode_u32;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Light subpaths traced by one task.
const CHUNK: u64 = 1024;
/// Light subpaths of the pre-pass that estimates how many vertices one leaves.
const PILOT: u64 = 16 * CHUNK;
/// Light subpaths whose vertices all are kept to pick from: at most, and of uniform picks at least and for each sample of a pixel,
/// so that these do not share many, and what is picked is near at hand in the processor's cache.
const PICKED: u64 = 64 * CHUNK;
const LEAST_PICKED: u64 = 8 * CHUNK;
const PICKED_EACH: u64 = 64;
/// Samples of a pixel from which on it pays to sort what they pick from.
const SORTED: u32 = 4;
/// Cells along each axis of the curve that they are sorted along.
const CURVE: u16 = 1024;
impl Bidirectional<'_> {
    /// How many vertices a light subpath leaves in the roulette's cache, and in that of all.
    pub(super) fn vertices_per_subpath(&self) -> [f64; 2] {
        if !self.keeps_vertices() {
            return [0.0; 2];
        }
        let caches: Vec<[LightCache; 2]> = (0..PILOT / CHUNK)
            .into_par_iter()
            .map(|chunk| self.trace_light(Stream::Pilot, 0, chunk * CHUNK..(chunk + 1) * CHUNK, None).0)
            .collect();
        let mean = |which: usize| caches.iter().map(|c| c[which].len()).sum::<usize>() as f64 / PILOT as f64;
        [mean(0), if self.all_apart() { mean(1) } else { mean(0) }]
    }

    fn keeps_vertices(&self) -> bool {
        self.recipe.base != Base::Off || self.recipe.roulette || self.recipe.merges()
    }

    /// Whether picks and merging have a cache of their own, since the roulette leaves out most of what they want.
    fn all_apart(&self) -> bool {
        self.recipe.roulette && matches!(self.recipe.base, Base::Uniform | Base::Probabilistic)
    }

    /// Subpaths of which that cache has the vertices.
    fn kept_apart(&self) -> u64 {
        match (self.all_apart(), self.recipe.merge) {
            (false, _) => 0,
            (true, Merge::All) => self.size.light_subpaths,
            (true, _) => {
                let wanted = match self.recipe.base {
                    Base::Uniform => PICKED_EACH * u64::from(self.size.samples),
                    _ => PICKED,
                };
                self.size.light_subpaths.min(wanted.clamp(LEAST_PICKED, PICKED))
            }
        }
    }

    /// Whether light vertices to merge with lie apart from the roulette's, which has all caustics, but little else.
    fn merged_apart(&self) -> bool {
        self.recipe.merge == Merge::All && self.all_apart()
    }

    /// The light vertices to merge with.
    pub(super) fn merged(&self) -> (&LightCache, &VertexBvh) {
        if self.merged_apart() { (&self.all, &self.all_bvh) } else { (&self.cache, &self.bvh) }
    }

    /// The light vertices to pick from where the roulette is off; and how many subpaths left them.
    pub(super) fn all(&self) -> (&LightCache, u64) {
        if self.all_apart() {
            (&self.all, self.kept_apart())
        } else {
            (&self.cache, self.size.light_subpaths)
        }
    }

    /// Sorts the vertices to pick from along a curve through space, so that the picks of a pixel's samples, which are spread
    /// evenly over them, are spread evenly over the surfaces.
    pub(super) fn order_picks(&mut self) {
        if self.recipe.base != Base::Uniform || self.size.samples < SORTED {
            return;
        }
        let positions = self.all().0.positions();
        let bounds = Aabb::around(positions.iter().copied());
        let scale = f32::from(CURVE) / (bounds.max - bounds.min).max(Vec3::splat(1e-30));
        // The number below its place on the curve: one word sorts faster than two.
        let word = |(p, index): (&Vec3, u32)| {
            let [x, y, z] = ((*p - bounds.min) * scale).to_array().map(|v| (v as u16).min(CURVE - 1));
            u64::from(morton_encode_u32(x, y, z)) << 32 | u64::from(index)
        };
        let mut words: Vec<u64> = positions.par_iter().zip(0..positions.len() as u32).map(word).collect();
        words.par_sort_unstable();
        self.picks.extend(words.iter().map(|&word| word as u32));
    }

    /// Makes the trees over an iteration's light vertices, and the numbers that queries share.
    pub(super) fn build_trees(&mut self, stream: Stream, iteration: u64) -> Result<()> {
        self.bvh.build(self.cache.positions())?;
        if self.merged_apart() {
            self.all_bvh.build(self.all.positions())?;
        }
        let shared = self.recipe.roulette && MinimumRandom::of(self.settings.minimum).is_none();
        self.numbers = shared.then(|| {
            let sampler = Sampler::new(self.settings.seed, iteration, stream, 0);
            Pregenerated::new(&self.bvh, sampler.bits(0, Purpose::Roulette))
        });
        Ok(())
    }

    /// Traces light subpaths, storing their vertices and connecting them to the camera. Gives the roulette's cache and
    /// that of all.
    fn trace_light(
        &self,
        stream: Stream,
        iteration: u64,
        subpaths: std::ops::Range<u64>,
        film: Option<&Film>,
    ) -> ([LightCache; 2], Tally) {
        let (world, start) = (self.world, Instant::now());
        // A path has one segment more when it is connected than when it is merged.
        let more = if self.recipe.merges() { 1 } else { 2 };
        let mut tally = Tally { light_subpaths: subpaths.end - subpaths.start, ..Tally::default() };
        let (thin, kept_apart) = (self.recipe.roulette, self.kept_apart());
        let [mut cache, mut all] = [(); 2].map(|()| LightCache::default());
        for index in subpaths {
            let sampler =
                Family::new(self.settings.seed, iteration, stream, index >> 32).member(index as u32);
            let apart = index < kept_apart;
            let mut walk = self.techniques.emit(world, &sampler);
            while let Some(light) = walk.filter(|light| light.depth < self.settings.max_depth) {
                if !light.vertex.bsdf.is_delta() {
                    if self.keeps_vertices() && light.depth + more <= self.settings.max_depth {
                        let stored = if thin { self.techniques.stored(&light) } else { 1.0 };
                        if stored == 1.0 || sampler.u1(light.depth, Purpose::Storing) < stored {
                            cache.push(&light);
                        }
                        if apart {
                            all.push(&light);
                        }
                    }
                    if let Some(film) = film.filter(|_| self.recipe.light_image)
                        && let Some((raster, value, ray)) =
                            connect::connect_camera(world, &self.techniques, &light, &sampler)
                        && tally.connection(!world.visibility.occluded(&ray))
                    {
                        film.add(raster, value);
                    }
                }
                walk = self.techniques.next_light(world, &light, &sampler);
            }
            cache.end_subpath();
            if apart {
                all.end_subpath();
            }
        }
        tally.light_vertices = cache.len() as u64;
        tally.light_trace = start.elapsed().as_secs_f64();
        ([cache, all], tally)
    }

    /// The light pass of an iteration: fills the caches, in the order of the subpaths.
    pub(super) fn light_pass(
        &mut self,
        stream: Stream,
        iteration: u64,
        film: Option<&Film>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Tally {
        let (done, all) = (AtomicU64::new(0), self.size.light_subpaths);
        let parts: Vec<([LightCache; 2], Tally)> = (0..all.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(all);
                let part = self.trace_light(stream, iteration, range, film);
                let traced = done.fetch_add(part.1.light_subpaths, Ordering::Relaxed) + part.1.light_subpaths;
                progress(traced as f64 / all as f64);
                part
            })
            .collect();
        self.cache.clear();
        self.all.clear();
        self.picks.clear();
        let mut tally = Tally::default();
        for ([cache, all], part_tally) in &parts {
            self.cache.append(cache);
            self.all.append(all);
            tally.add(part_tally);
        }
        tally
    }
}
