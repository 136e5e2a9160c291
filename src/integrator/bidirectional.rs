//! The bidirectional machine: light pass, vertex BVH, eye pass. What it does in each is a [`Recipe`].

use super::adaptive::Adaptive;
use super::emitters::EmitterPoints;
use super::merging;
use super::recipe::{Base, Merge, Recipe};
use super::records::Records;
use super::{Integrator, Size};
use crate::effects::Lobes;
use crate::error::Result;
use crate::film::Film;
use crate::light_cache::LightCache;
use crate::mis::EYE_HITS;
use crate::roulette::Pregenerated;
use crate::sampler::Stream;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::subpath::{Storing, World};
use crate::tally::Tally;
use crate::techniques::{Merging, Numerics, Roulette, Techniques};
use crate::vertex_bvh::VertexBvh;
use std::f64::consts::PI;
use std::time::Instant;

/// Samples of a pixel that the roulette's pairs count for as if each had light vertices of its own. More of them share the
/// vertices, though not the pairs; measured in benches/record/integrators.md.
const SHARERS: f64 = 8.0;
/// How many times the pairs of the last iteration one has that the roulette keeps fewer light vertices in, if that kept many.
const LARGER: u64 = 2;
/// Share of an iteration's time that the light side should have, and of its progress that it stands for
/// (benches/record/integrators.md).
pub(crate) const LIGHT_SHARE: f64 = 0.2;

/// The machine, and the memory that it keeps between iterations.
pub struct Bidirectional<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) settings: &'a Settings,
    pub(super) recipe: Recipe,
    pub(super) techniques: Techniques,
    pub(super) size: Size,
    /// Light subpaths that the emission guide was learned from; 0 before.
    pub(super) guided_by: u64,
    /// Whether guiding gains more than it costs, as far as the last pre-pass knew.
    pub(super) guiding_pays: bool,
    /// Radius of merging in the first iteration, world units.
    first_radius: f64,
    /// Light vertices for the roulette, or all where it is off.
    pub(super) cache: LightCache,
    /// Over `cache`.
    pub(super) bvh: VertexBvh,
    /// All vertices of the first light subpaths, for picks, or of all subpaths, for merging, where `cache` has not got them.
    pub(super) all: LightCache,
    /// Over `all`, for merging.
    pub(super) all_bvh: VertexBvh,
    /// Numbers of the vertices to pick from, those near each other side by side; empty: as they lie.
    pub(super) picks: Vec<u32>,
    pub(super) emitters: EmitterPoints,
    /// The roulette's numbers for `bvh`, where all queries share them.
    pub(super) numbers: Option<Pregenerated>,
    pub(super) records: Records,
    pub(super) adaptive: Option<Adaptive>,
    /// When iterations should be over.
    pub(super) deadline: Option<Instant>,
}

impl<'a> Bidirectional<'a> {
    /// Prepares a recipe: a pre-pass over light subpaths sets the constants of roulette and weights.
    pub fn new(world: &'a World<'a>, settings: &'a Settings, recipe: Recipe) -> Result<Self> {
        // Without a surface to play at, the roulette is not there at all; nor merging without one that shows anything.
        let any = |has: fn(&Lobes) -> bool| somewhere(world.scene, settings, has);
        let nothing_shown = recipe.merge == Merge::Shown && !any(|lobes| lobes.delta);
        let recipe = Recipe {
            roulette: recipe.roulette && any(|lobes| lobes.open),
            merge: if nothing_shown { Merge::Off } else { recipe.merge },
            ..recipe
        };
        let mut machine = Self {
            world,
            settings,
            recipe,
            techniques: Techniques::none(settings.mis),
            size: Size { samples: 0, light_subpaths: 0 },
            guided_by: 0,
            guiding_pays: true,
            first_radius: if recipe.merges() { merging::first_radius(world, settings) } else { 0.0 },
            cache: LightCache::default(),
            bvh: VertexBvh::new(),
            all: LightCache::default(),
            all_bvh: VertexBvh::new(),
            picks: Vec::new(),
            emitters: EmitterPoints::default(),
            numbers: None,
            records: Records::default(),
            adaptive: None,
            deadline: None,
        };
        machine.resize(Size::of(settings, &world.scene.film))?;
        Ok(machine)
    }

    /// Whether light subpaths follow what a pre-pass found useful, if that says that it pays. What merging finds is on all surfaces, and noisier where
    /// fewer of them go.
    fn is_guided(&self) -> bool {
        self.recipe.roulette && self.settings.guiding.is_on(|| self.recipe.merge != Merge::All)
    }

    /// Sets how often each technique tries, per eye sample.
    pub(super) fn plan(&mut self) {
        self.techniques.storing = Storing {
            share: if self.recipe.roulette { self.settings.storing } else { 1.0 },
            max_alpha: self.settings.hrr_alpha,
            lamps: !self.recipe.next_event,
            shown_only: self.recipe.merge == Merge::Shown,
        };
        let (recipe, n_l) = (&self.recipe, self.size.light_subpaths as f64);
        let (eye_samples, area) = (f64::from(self.size.samples), self.world.scene.mesh.total_area());
        // The weights must not depend on an iteration's own number of vertices, hence a pre-pass of its own numbers.
        let [stored, all] = self.vertices_per_subpath();
        let vertices = (n_l * stored).max(1.0);
        let expected = self.settings.expected * self.adaptive.as_ref().map_or(1.0, Adaptive::kept);
        let on = |switch: bool, m: f64| if switch { m } else { 0.0 };
        self.techniques = Techniques {
            heuristic: self.settings.mis,
            eye_hits: on(recipe.eye_subpaths, EYE_HITS),
            next_event: on(recipe.next_event, 1.0),
            // Planned below, by what is planned here.
            emitters: None,
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
                light_subpaths: n_l / eye_samples * SHARERS.min(eye_samples),
                constant: expected * area / vertices,
                // On the axis of lobes of weight c, C c / d^2 is then at most X at d^2 = A / 4 pi.
                most: self.settings.axis_probability.map_or(f64::INFINITY, |x| x * area / (4.0 * PI)),
                max_alpha: self.settings.hrr_alpha,
                numerics: Numerics::of(self.settings),
            }),
        };
        self.techniques.emitters = self.plan_emitters();
    }
}

/// Whether any surface has such lobes, anywhere on it.
fn somewhere(scene: &Scene, settings: &Settings, has: fn(&Lobes) -> bool) -> bool {
    let has: Vec<bool> = scene.materials.iter().map(|m| has(&Lobes::of(m, settings.hrr_alpha))).collect();
    scene.mesh.materials.iter().any(|&m| has[m as usize])
}

impl Integrator for Bidirectional<'_> {
    fn resize(&mut self, size: Size) -> Result<()> {
        let film = &self.world.scene.film;
        let all = u64::from(film.width) * u64::from(film.height) * u64::from(size.samples);
        let pairs = |size: &Size| u64::from(size.samples) * size.light_subpaths;
        if let Some(adaptive) = self.adaptive.as_mut().filter(|_| pairs(&size) > LARGER * pairs(&self.size)) {
            adaptive.moderate();
        }
        self.size = Size {
            light_subpaths: if self.recipe.base == Base::OwnPath { all } else { size.light_subpaths },
            ..size
        };
        if self.is_guided() {
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

    fn finish_by(&mut self, deadline: Instant) {
        // Each eye sample has a light subpath of its own: there are no more of them than planned.
        self.deadline = (self.recipe.base != Base::OwnPath).then_some(deadline);
    }

    fn iterate(&mut self, iteration: u64, film: &mut Film, progress: &(dyn Fn(f64) + Sync)) -> Result<Tally> {
        let start = Instant::now();
        // The discs around the samples of a pixel, together, are what one around its only sample would be.
        let samples = if self.recipe.merge == Merge::Shown { self.size.samples } else { 1 };
        let radius = merging::radius(self.first_radius, self.settings.merge_shrink, iteration);
        self.techniques.merging = (self.first_radius > 0.0).then(|| Merging {
            light_subpaths: self.size.light_subpaths as f64,
            radius: radius / f64::from(samples).sqrt(),
        });
        let on_light_side = |fraction| progress(LIGHT_SHARE * fraction);
        let mut tally = self.light_pass(Stream::Light, iteration, Some(film), &on_light_side);
        self.order_picks();
        if self.recipe.roulette || self.recipe.merges() {
            let build = Instant::now();
            self.build_trees(Stream::Light, iteration)?;
            tally.vertex_bvh_build += build.elapsed().as_secs_f64();
        }
        self.draw_emitters(iteration)?;
        tally.sides[0] = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let on_eye_side = |fraction| progress(LIGHT_SHARE + (1.0 - LIGHT_SHARE) * fraction);
        let whole = self.eye_pass(iteration, film, &on_eye_side, &mut tally);
        tally.sides[1] = start.elapsed().as_secs_f64() * whole;
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.learn_kept(&tally);
        }
        film.count_samples(u64::from(self.size.samples));
        Ok(tally)
    }

    fn bytes(&self) -> (usize, usize) {
        let (points, tree) = self.emitters.bytes();
        let caches = self.cache.bytes() + self.all.bytes() + self.records.bytes();
        let numbers = self.numbers.as_ref().map_or(0, Pregenerated::bytes);
        let picks = self.picks.capacity() * size_of::<u32>();
        (caches + picks + points, self.bvh.bytes() + self.all_bvh.bytes() + numbers + tree)
    }
}
