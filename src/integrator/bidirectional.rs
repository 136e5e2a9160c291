//! The bidirectional machine: light pass, vertex BVH, eye pass. What it does in each is a [`Recipe`].

use super::merging;
use super::recipe::{Base, Recipe};
use super::records::Records;
use super::spread::{Adaptive, Seen};
use super::tile::{self, Sample};
use super::{Integrator, Size};
use crate::connect::{self, EyeVertex, Onward};
use crate::error::Result;
use crate::film::Film;
use crate::light_cache::LightCache;
use crate::material::Material;
use crate::math::Spectrum;
use crate::roulette::{self, Query};
use crate::sampler::{Family, Purpose, Sampler, Stream};
use crate::settings::{Settings, Switch};
use crate::subpath::{Origin, Storing, Walk, World};
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
/// Light subpaths whose vertices all are kept for uniform picks: enough for eye samples not to share many.
const PICKED: u64 = 256 * CHUNK;
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
    /// Light vertices for the roulette and for merging.
    pub(super) cache: LightCache,
    /// All vertices of the first light subpaths, for uniform picks, where `cache` has not got them all.
    picks: LightCache,
    pub(super) bvh: VertexBvh,
    records: Records,
    adaptive: Option<Adaptive>,
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
            picks: LightCache::default(),
            bvh: VertexBvh::new(),
            records: Records::default(),
            adaptive: None,
        };
        machine.resize(Size::of(settings, &world.scene.film))?;
        Ok(machine)
    }

    /// Whether no material has lobes for the roulette.
    fn nothing_glossy(&self) -> bool {
        let rule = Storing { max_alpha: self.settings.hrr_alpha, ..Storing::ALL };
        let glossy = |m: &Material| {
            let bsdf = m.bsdf(DVec2::ZERO);
            !bsdf.is_delta() && rule.origin(&bsdf) == Origin::Narrow
        };
        !self.world.scene.materials.iter().any(glossy)
    }

    /// Sets how often each technique tries, per eye sample.
    pub(super) fn plan(&mut self) {
        // Merging wants all light vertices.
        let thin = self.recipe.roulette && !self.recipe.merging;
        self.techniques.storing = Storing {
            share: if thin { self.settings.storing } else { 1.0 },
            max_alpha: self.settings.hrr_alpha,
            lamps: !self.recipe.next_event,
        };
        let (recipe, n_l) = (&self.recipe, self.size.light_subpaths as f64);
        let eye_samples = f64::from(self.size.samples);
        // The weights must not depend on an iteration's own number of vertices, hence a pre-pass of its own numbers.
        let [stored, all] = self.vertices_per_subpath();
        let vertices = (n_l * stored).max(1.0);
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
                Base::Uniform | Base::Probabilistic => {
                    f64::from(self.settings.connections) / all.max(1.0 / n_l)
                }
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

    /// How many vertices a light subpath leaves in the roulette's cache, and in that for uniform picks.
    fn vertices_per_subpath(&self) -> [f64; 2] {
        if !self.keeps_vertices() {
            return [0.0; 2];
        }
        let caches: Vec<[LightCache; 2]> = (0..PILOT / CHUNK)
            .into_par_iter()
            .map(|chunk| self.trace_light(Stream::Pilot, 0, chunk * CHUNK..(chunk + 1) * CHUNK, None).0)
            .collect();
        let mean = |which: usize| caches.iter().map(|c| c[which].len()).sum::<usize>() as f64 / PILOT as f64;
        [mean(0), if self.picks_apart() { mean(1) } else { mean(0) }]
    }

    fn keeps_vertices(&self) -> bool {
        self.recipe.base != Base::Off || self.recipe.roulette || self.recipe.merging
    }

    /// Whether the cache has all light vertices, for want of any other use than picks.
    fn stores_all(&self) -> bool {
        !self.recipe.roulette && !self.recipe.merging
    }

    /// Whether uniform picks have a cache of their own.
    fn picks_apart(&self) -> bool {
        !self.stores_all() && matches!(self.recipe.base, Base::Uniform | Base::Probabilistic)
    }

    /// The light vertices to pick from where the roulette is off, and how many subpaths left them.
    pub(super) fn picks(&self) -> (&LightCache, u64) {
        if self.picks_apart() {
            (&self.picks, self.size.light_subpaths.min(PICKED))
        } else {
            (&self.cache, self.size.light_subpaths)
        }
    }

    /// Traces light subpaths, storing their vertices and connecting them to the camera. Gives the roulette's cache and
    /// that for uniform picks.
    fn trace_light(
        &self,
        stream: Stream,
        iteration: u64,
        subpaths: std::ops::Range<u64>,
        film: Option<&Film>,
    ) -> ([LightCache; 2], Tally) {
        let (world, start) = (self.world, Instant::now());
        // A path has one segment more when it is connected than when it is merged.
        let more = if self.recipe.merging { 1 } else { 2 };
        let mut tally = Tally { light_subpaths: subpaths.end - subpaths.start, ..Tally::default() };
        let [mut cache, mut picks] = [(); 2].map(|()| LightCache::default());
        for index in subpaths {
            let sampler =
                Family::new(self.settings.seed, iteration, stream, index >> 32).member(index as u32);
            let picked = self.picks_apart() && index < PICKED;
            let mut walk = self.techniques.emit(world, &sampler);
            while let Some(light) = walk.filter(|light| light.depth < self.settings.max_depth) {
                if !light.vertex.bsdf.is_delta() {
                    if self.keeps_vertices() && light.depth + more <= self.settings.max_depth {
                        let stored = if self.stores_all() { 1.0 } else { self.techniques.stored(&light) };
                        if stored == 1.0 || sampler.u1(light.depth, Purpose::Storing) < stored {
                            cache.push(&light);
                        }
                        if picked {
                            picks.push(&light);
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
            if picked {
                picks.end_subpath();
            }
        }
        tally.light_vertices = cache.len() as u64;
        tally.light_trace = start.elapsed().as_secs_f64();
        ([cache, picks], tally)
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
        self.picks.clear();
        let mut tally = Tally::default();
        for ([cache, picks], part_tally) in &parts {
            self.cache.append(cache);
            self.picks.append(picks);
            tally.add(part_tally);
        }
        tally
    }

    /// What an eye sample sees.
    fn radiance(&self, sample: &Sample, clock: Clock, tally: &mut Tally) -> Seen {
        let (world, techniques) = (self.world, &self.techniques);
        let (mut rest, mut kept) = (Spectrum::ZERO, Spectrum::ZERO);
        let mut eye = EyeVertex::first(world, techniques, sample.raster, &sample.sampler);
        while let Onward::Vertex(vertex) = eye {
            rest += vertex.emitted(world, techniques);
            if !self.recipe.eye_subpaths || vertex.walk.depth == self.settings.max_depth {
                break;
            }
            if !vertex.walk.vertex.bsdf.is_delta() {
                rest += self.next_event(&vertex, sample, clock, tally);
                if !vertex.lobes.is_empty() {
                    if sample.plays > 0.0 {
                        let sampler = &sample.sampler;
                        self.play_roulette(&vertex, sampler, clock, tally, &mut |_, value| kept += value);
                    }
                } else {
                    rest += match self.recipe.base {
                        Base::Off => Spectrum::ZERO,
                        Base::OwnPath => self.connect_own_path(&vertex, sample, clock, tally),
                        Base::Uniform | Base::Probabilistic => {
                            self.connect_picks(&vertex, sample, clock, tally)
                        }
                    };
                }
                rest += self.merge(&vertex, tally);
            }
            eye = vertex.next(world, techniques, &sample.sampler);
        }
        if let Onward::Sky(light) = eye {
            rest += light;
        }
        let roulette = kept * sample.plays;
        Seen { radiance: rest + roulette, roulette }
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
        let ((cache, subpaths), depth) = (self.picks(), vertex.walk.depth);
        let stored = cache.len();
        let picks = f64::from(self.settings.connections);
        let mut sum = Spectrum::ZERO;
        for n in 0..self.settings.connections {
            let u = sample.sampler.nth(depth, Purpose::CachePick, n);
            if self.recipe.base == Base::Probabilistic {
                let kind = sample.sampler.nth(depth, Purpose::RecordPick, n);
                if let Some((light, probability)) =
                    self.records.pick(vertex.walk.vertex.point.position, kind, u)
                {
                    let reused = self.settings.reused_subpaths.min(subpaths) as f64;
                    sum += self.connect_base(vertex, light, picks * reused * probability, clock, tally);
                }
            } else if stored > 0 {
                let light = cache.load(self.world, ((u * stored as f64) as usize).min(stored - 1));
                let tries = picks * subpaths as f64 / stored as f64;
                sum += self.connect_base(vertex, &light, tries, clock, tally);
            }
        }
        sum
    }

    /// A connection where the roulette is off, tried as often as `tries` says.
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
        let connection = vertex.connect(&self.techniques, light, self.techniques.base, tries);
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
        if self.recipe.roulette && self.settings.guiding == Switch::On && !self.nothing_glossy() {
            self.learn_guide()?;
        }
        self.plan();
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.plan(size.samples);
        }
        Ok(())
    }

    fn adapt(&mut self) {
        // Eye samples that have a light subpath of their own are as many as these.
        if self.recipe.base != Base::OwnPath && self.recipe.eye_subpaths {
            self.adaptive = Some(Adaptive::new(&self.world.scene.film));
        }
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
            let (world, cache) = (self.world, self.picks().0);
            self.records = Records::new(world, self.settings, &self.techniques, cache, iteration, &mut tally);
        }
        tally.sides[0] = start.elapsed().as_secs_f64();
        let (start, key) = (Instant::now(), (self.settings.seed, iteration, self.size.samples));
        let on_eye_side = |fraction| progress(LIGHT_SHARE + (1.0 - LIGHT_SHARE) * fraction);
        // Set aside, since the samples look at the rest of the machine.
        let mut adaptive = self.adaptive.take();
        tally.add(&tile::sample_film(film, key, adaptive.as_mut(), &on_eye_side, |sample, clock, tally| {
            self.radiance(sample, clock, tally)
        }));
        self.adaptive = adaptive;
        tally.sides[1] = start.elapsed().as_secs_f64();
        film.count_samples(u64::from(self.size.samples));
        Ok(tally)
    }

    fn bytes(&self) -> (usize, usize) {
        (self.cache.bytes() + self.picks.bytes() + self.records.bytes(), self.bvh.bytes())
    }
}
