//! The bidirectional machine: light pass, vertex BVH, eye pass. What it does in each is a [`Recipe`].

use super::merging;
use super::recipe::{Base, Recipe};
use super::records::Records;
use super::tile::{self, Sample};
use super::{Integrator, Size};
use crate::connect::{self, EyeVertex};
use crate::error::Result;
use crate::film::Film;
use crate::light_cache::LightCache;
use crate::material::Material;
use crate::math::Spectrum;
use crate::roulette::{self, Query};
use crate::sampler::{Purpose, Sampler, Stream};
use crate::settings::{Guiding, Settings};
use crate::subpath::{Storing, Walk, World};
use crate::tally::{Clock, Tally};
use crate::techniques::{Merging, Roulette, Techniques};
use crate::vertex_bvh::VertexBvh;
use crate::visibility::Ray;
use glam::DVec2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Light subpaths traced by one task.
const CHUNK: u64 = 1024;
/// Light subpaths of the pre-pass that estimates how many vertices one leaves.
const PILOT: u64 = 16 * CHUNK;
/// Share of an iteration's progress that the light side stands for.
const LIGHT_SHARE: f64 = 0.3;

/// The machine, and the memory that it keeps between iterations.
pub struct Bidirectional<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) settings: &'a Settings,
    recipe: Recipe,
    pub(super) techniques: Techniques,
    pub(super) size: Size,
    /// Light subpaths that the emission guide was learned from; 0 before.
    pub(super) guided_by: u64,
    /// Radius of merging in the first iteration, world units.
    first_radius: f64,
    pub(super) cache: LightCache,
    pub(super) bvh: VertexBvh,
    records: Records,
}

impl<'a> Bidirectional<'a> {
    /// Prepares a recipe: a pre-pass over light subpaths sets the constants of roulette and weights.
    pub fn new(world: &'a World<'a>, settings: &'a Settings, recipe: Recipe) -> Result<Self> {
        let mut machine = Self {
            world,
            settings,
            recipe,
            techniques: Techniques::none(settings.mis),
            size: Size { samples: 0, light_subpaths: 0 },
            guided_by: 0,
            first_radius: if recipe.merging { merging::first_radius(world, settings) } else { 0.0 },
            cache: LightCache::default(),
            bvh: VertexBvh::new(),
            records: Records::default(),
        };
        machine.resize(Size::of(settings, &world.scene.film))?;
        Ok(machine)
    }

    /// Whether no material has lobes for the roulette.
    fn nothing_glossy(&self) -> bool {
        let narrow = Storing { share: 1.0, max_alpha: self.settings.hrr_alpha };
        let glossy = |m: &Material| {
            let bsdf = m.bsdf(DVec2::ZERO);
            !bsdf.is_delta() && narrow.is_narrow(&bsdf)
        };
        !self.world.scene.materials.iter().any(glossy)
    }

    /// Sets how often each technique tries, per eye sample.
    pub(super) fn plan(&mut self) {
        // Other uses of light vertices than the roulette want all of them.
        self.techniques.storing = if self.recipe.roulette && !self.recipe.merging {
            Storing { share: self.settings.storing, max_alpha: self.settings.hrr_alpha }
        } else {
            Storing::ALL
        };
        let (recipe, n_l) = (&self.recipe, self.size.light_subpaths as f64);
        let eye_samples = f64::from(self.size.samples);
        // The weights must not depend on an iteration's own number of vertices, hence a pre-pass of its own numbers.
        let vertices = (n_l * self.vertices_per_subpath()).max(1.0);
        let on = |switch: bool, m: f64| if switch { m } else { 0.0 };
        self.techniques = Techniques {
            heuristic: self.settings.mis,
            eye_hits: on(recipe.eye_subpaths, 1.0),
            next_event: on(recipe.next_event, 1.0),
            light_image: on(recipe.light_image, n_l / eye_samples),
            base: match recipe.base {
                Base::Off => 0.0,
                Base::OwnPath => 1.0,
                // Any function of the path would do; of uniform picks from any number of subpaths, this is the true one.
                Base::Uniform | Base::Probabilistic => f64::from(self.settings.connections) * n_l / vertices,
            },
            // Of each iteration its own.
            merging: None,
            storing: self.techniques.storing,
            guide: self.techniques.guide.clone(),
            roulette: recipe.roulette.then(|| Roulette {
                light_subpaths: n_l / eye_samples,
                constant: self.settings.expected * self.world.scene.mesh.total_area() / vertices,
                max_alpha: self.settings.hrr_alpha,
            }),
        };
    }

    fn vertices_per_subpath(&self) -> f64 {
        if !self.keeps_vertices() {
            return 0.0;
        }
        let stored: usize = (0..PILOT / CHUNK)
            .into_par_iter()
            .map(|chunk| {
                let mut cache = LightCache::default();
                self.trace_light(Stream::Pilot, 0, chunk * CHUNK..(chunk + 1) * CHUNK, &mut cache, None);
                cache.len()
            })
            .sum();
        stored as f64 / PILOT as f64
    }

    fn keeps_vertices(&self) -> bool {
        self.recipe.base != Base::Off || self.recipe.roulette || self.recipe.merging
    }

    /// Traces light subpaths, storing their vertices and connecting them to the camera.
    fn trace_light(
        &self,
        stream: Stream,
        iteration: u64,
        subpaths: std::ops::Range<u64>,
        cache: &mut LightCache,
        film: Option<&Film>,
    ) -> Tally {
        let (world, start) = (self.world, Instant::now());
        // A path has one segment more when it is connected than when it is merged.
        let more = if self.recipe.merging { 1 } else { 2 };
        let mut tally = Tally { light_subpaths: subpaths.end - subpaths.start, ..Tally::default() };
        cache.clear();
        for index in subpaths {
            let sampler =
                Sampler::in_family(self.settings.seed, iteration, stream, index >> 32, index as u32);
            let mut walk = self.techniques.emit(world, &sampler);
            while let Some(light) = walk.filter(|light| light.depth < self.settings.max_depth) {
                if !light.vertex.bsdf.is_delta() {
                    let stored = self.techniques.stored(&light);
                    let kept = stored == 1.0 || sampler.u1(light.depth, Purpose::Storing) < stored;
                    if kept && self.keeps_vertices() && light.depth + more <= self.settings.max_depth {
                        cache.push(&light);
                    }
                    if let Some(film) = film.filter(|_| kept && self.recipe.light_image)
                        && let Some((raster, value, ray)) =
                            connect::connect_camera(world, &self.techniques, &light)
                        && tally.connection(!world.visibility.occluded(&ray))
                    {
                        film.add(raster, value);
                    }
                }
                walk = self.techniques.next_light(world, &light, &sampler);
            }
            cache.end_subpath();
        }
        tally.light_vertices = cache.len() as u64;
        tally.light_trace = start.elapsed().as_secs_f64();
        tally
    }

    /// The light pass of an iteration: fills the cache, in the order of the subpaths.
    pub(super) fn light_pass(
        &mut self,
        stream: Stream,
        iteration: u64,
        film: Option<&Film>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Tally {
        let done = AtomicU64::new(0);
        let parts: Vec<(LightCache, Tally)> = (0..self.size.light_subpaths.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut cache = LightCache::default();
                let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(self.size.light_subpaths);
                let tally = self.trace_light(stream, iteration, range, &mut cache, film);
                let traced = done.fetch_add(tally.light_subpaths, Ordering::Relaxed) + tally.light_subpaths;
                progress(traced as f64 / self.size.light_subpaths as f64);
                (cache, tally)
            })
            .collect();
        self.cache.clear();
        let mut tally = Tally::default();
        for (part, part_tally) in &parts {
            self.cache.append(part);
            tally.add(part_tally);
        }
        tally
    }

    /// What an eye sample sees.
    fn radiance(&self, sample: &Sample, clock: Clock, tally: &mut Tally) -> Spectrum {
        let (world, techniques) = (self.world, &self.techniques);
        let mut sum = Spectrum::ZERO;
        let mut eye = EyeVertex::first(world, techniques, sample.raster);
        while let Some(vertex) = eye {
            sum += vertex.emitted(world, techniques);
            if !self.recipe.eye_subpaths || vertex.walk.depth == self.settings.max_depth {
                break;
            }
            if !vertex.walk.vertex.bsdf.is_delta() {
                sum += self.next_event(&vertex, sample, clock, tally);
                sum += if !vertex.lobes.is_empty() {
                    let mut kept = Spectrum::ZERO;
                    self.play_roulette(&vertex, &sample.sampler, clock, tally, &mut |_, value| kept += value);
                    kept
                } else {
                    match self.recipe.base {
                        Base::Off => Spectrum::ZERO,
                        Base::OwnPath => self.connect_own_path(&vertex, sample, clock, tally),
                        Base::Uniform | Base::Probabilistic => {
                            self.connect_picks(&vertex, sample, clock, tally)
                        }
                    }
                };
                sum += self.merge(&vertex, tally);
            }
            eye = vertex.next(world, techniques, &sample.sampler);
        }
        sum
    }

    /// Counts a connection's value if its ray is free.
    fn if_visible(&self, connection: Option<(Spectrum, Ray)>, clock: Clock, tally: &mut Tally) -> Spectrum {
        let Some((value, ray)) = connection else { return Spectrum::ZERO };
        let free = clock.time(&mut tally.visibility, || !self.world.visibility.occluded(&ray));
        if tally.connection(free) { value } else { Spectrum::ZERO }
    }

    fn next_event(&self, vertex: &EyeVertex, sample: &Sample, clock: Clock, tally: &mut Tally) -> Spectrum {
        self.if_visible(vertex.next_event(self.world, &self.techniques, &sample.sampler), clock, tally)
    }

    /// Connections to the sample's own light subpath.
    fn connect_own_path(
        &self,
        vertex: &EyeVertex,
        sample: &Sample,
        clock: Clock,
        tally: &mut Tally,
    ) -> Spectrum {
        let lights = self.cache.subpath(sample.index as usize);
        lights
            .map(|index| self.connect_base(vertex, &self.cache.load(self.world, index), 1.0, clock, tally))
            .sum()
    }

    /// Connections to picks from the cache.
    fn connect_picks(
        &self,
        vertex: &EyeVertex,
        sample: &Sample,
        clock: Clock,
        tally: &mut Tally,
    ) -> Spectrum {
        let (stored, depth) = (self.cache.len(), vertex.walk.depth);
        let picks = f64::from(self.settings.connections);
        let mut sum = Spectrum::ZERO;
        for n in 0..self.settings.connections {
            let u = sample.sampler.nth(depth, Purpose::CachePick, n);
            if self.recipe.base == Base::Probabilistic {
                let kind = sample.sampler.nth(depth, Purpose::RecordPick, n);
                if let Some((light, probability)) =
                    self.records.pick(vertex.walk.vertex.point.position, kind, u)
                {
                    let subpaths = self.settings.reused_subpaths.min(self.size.light_subpaths) as f64;
                    sum += self.connect_base(vertex, light, picks * subpaths * probability, clock, tally);
                }
            } else if stored > 0 {
                let light = self.cache.load(self.world, ((u * stored as f64) as usize).min(stored - 1));
                let tries = picks * self.size.light_subpaths as f64 / stored as f64;
                sum += self.connect_base(vertex, &light, tries, clock, tally);
            }
        }
        sum
    }

    /// A connection where the roulette is off, tried as often as `tries` says over the probability of storing.
    fn connect_base(
        &self,
        vertex: &EyeVertex,
        light: &Walk,
        tries: f64,
        clock: Clock,
        tally: &mut Tally,
    ) -> Spectrum {
        if vertex.walk.depth + 1 + light.depth > self.settings.max_depth {
            return Spectrum::ZERO;
        }
        let stored = self.techniques.stored(light);
        let (m, tries) = (self.techniques.base * stored, tries * stored);
        let connection = vertex.connect(&self.techniques, light, m, tries);
        self.if_visible(connection, clock, tally)
    }

    /// Merging with all light vertices within the radius.
    fn merge(&self, vertex: &EyeVertex, tally: &mut Tally) -> Spectrum {
        let Some(merging) = &self.techniques.merging else { return Spectrum::ZERO };
        let (depth, position) = (vertex.walk.depth, vertex.walk.vertex.point.position);
        let mut sum = Spectrum::ZERO;
        self.bvh.within(position, merging.radius, &mut |index| {
            if depth + self.cache.depth(index as usize) <= self.settings.max_depth {
                let light = self.cache.load(self.world, index as usize);
                sum += vertex.merge(&self.techniques, merging, &light);
                tally.merged += 1;
            }
        });
        sum
    }

    /// Connections to what the roulette keeps of all light vertices: visits each that counts, with its value.
    pub(super) fn play_roulette(
        &self,
        vertex: &EyeVertex,
        sampler: &Sampler,
        clock: Clock,
        tally: &mut Tally,
        visit: &mut impl FnMut(u32, Spectrum),
    ) {
        let Some(roulette) = &self.techniques.roulette else { return };
        let depth = vertex.walk.depth;
        let position = vertex.walk.vertex.point.position;
        let key = sampler.bits(depth, Purpose::Roulette);
        let query = Query::new(position, &vertex.lobes, roulette.constant, key);
        let mut kept = Vec::new();
        let Tally { roulette: counters, roulette_seconds, .. } = tally;
        clock.time(roulette_seconds, || {
            roulette::query(&self.bvh, &query, counters, &mut |index, p| kept.push((index, p)));
        });
        for (index, p) in kept {
            if depth + 1 + self.cache.depth(index as usize) <= self.settings.max_depth {
                let light = self.cache.load(self.world, index as usize);
                let p = p * self.techniques.stored(&light);
                let (m, tries) = (roulette.light_subpaths * p, self.size.light_subpaths as f64 * p);
                let connection = vertex.connect(&self.techniques, &light, m, tries);
                visit(index, self.if_visible(connection, clock, tally));
            }
        }
    }
}

impl Integrator for Bidirectional<'_> {
    fn resize(&mut self, size: Size) -> Result<()> {
        let film = &self.world.scene.film;
        let all = u64::from(film.width) * u64::from(film.height) * u64::from(size.samples);
        self.size = Size {
            light_subpaths: if self.recipe.base == Base::OwnPath { all } else { size.light_subpaths },
            ..size
        };
        if self.recipe.roulette && self.settings.guiding == Guiding::On && !self.nothing_glossy() {
            self.learn_guide()?;
        }
        self.plan();
        Ok(())
    }

    fn iterate(&mut self, iteration: u64, film: &mut Film, progress: &(dyn Fn(f64) + Sync)) -> Result<Tally> {
        let start = Instant::now();
        self.techniques.merging = (self.first_radius > 0.0).then(|| Merging {
            light_subpaths: self.size.light_subpaths as f64,
            radius: merging::radius(self.first_radius, self.settings.merge_shrink, iteration),
        });
        let on_light_side = |fraction| progress(LIGHT_SHARE * fraction);
        let mut tally = self.light_pass(Stream::Light, iteration, Some(film), &on_light_side);
        if self.recipe.roulette || self.recipe.merging {
            let build = Instant::now();
            self.bvh.build(self.cache.positions())?;
            tally.vertex_bvh_build += build.elapsed().as_secs_f64();
        }
        if self.recipe.base == Base::Probabilistic {
            let (world, cache) = (self.world, &self.cache);
            self.records = Records::new(world, self.settings, &self.techniques, cache, iteration, &mut tally);
        }
        tally.sides[0] = start.elapsed().as_secs_f64();
        let (start, key) = (Instant::now(), (self.settings.seed, iteration, self.size.samples));
        let on_eye_side = |fraction| progress(LIGHT_SHARE + (1.0 - LIGHT_SHARE) * fraction);
        tally.add(&tile::sample_film(film, key, &on_eye_side, |sample, clock, tally| {
            self.radiance(sample, clock, tally)
        }));
        tally.sides[1] = start.elapsed().as_secs_f64();
        film.count_samples(u64::from(self.size.samples));
        Ok(tally)
    }

    fn bytes(&self) -> (usize, usize) {
        (self.cache.bytes() + self.records.bytes(), self.bvh.bytes())
    }
}
