//! The eye pass: what an eye sample sees, by every technique that is on.

use super::bidirectional::Bidirectional;
use super::parts::{self, Part, Parts};
use super::recipe::Base;
use super::records::{self, Records};
use super::tile::{self, Sample};
use super::watched::{Seen, work};
use crate::connect::{EyeVertex, Onward};
use crate::film::Film;
use crate::math::Spectrum;
use crate::roulette::{self, MinimumRandom, Query};
use crate::sampler::{Purpose, Sampler};
use crate::subpath::Walk;
use crate::tally::{Clock, Tally};
use crate::visibility::Ray;

impl Bidirectional<'_> {
    /// The eye pass of an iteration, and what it needs to know of the light pass before; how many samples were planned over
    /// those that there was time for.
    pub(super) fn eye_pass(
        &mut self,
        iteration: u64,
        film: &Film,
        progress: &(dyn Fn(f64) + Sync),
        tally: &mut Tally,
    ) -> f64 {
        let key = (self.settings.seed, iteration, self.size.samples);
        let records = self.recipe.base == Base::Probabilistic;
        let of = match self.deadline {
            _ if records => self.size.samples.div_ceil(records::SAMPLES),
            Some(_) => (self.size.samples / parts::LEAST_SAMPLES).clamp(1, parts::PARTS),
            None => 1,
        };
        let mut parts = Parts::new(of);
        // How much the samples count for is known when all have been taken.
        let apart = self.deadline.map(|_| film.alike());
        let whole = apart.as_ref().unwrap_or(film);
        // Set aside, since the samples look at the rest of the machine.
        let mut adaptive = self.adaptive.take();
        while let Some(part) = parts.next(self.deadline) {
            let Part { index, .. } = part;
            if records {
                let cache = self.all().0;
                let part = (iteration, index);
                self.records = Records::new(self.world, self.settings, &self.techniques, cache, part, tally);
            }
            let on_part = |fraction: f64| progress((f64::from(index) + fraction) / f64::from(parts.end));
            tally.add(&tile::sample_film(
                whole,
                key,
                part,
                adaptive.as_mut(),
                &on_part,
                |sample, clock, tally| self.radiance(sample, clock, tally),
            ));
        }
        if let Some(adaptive) = &mut adaptive {
            adaptive.learn_costs(tally);
        }
        self.adaptive = adaptive;
        if let Some(apart) = &apart {
            film.add_scaled(apart, parts.scale());
        }
        parts.scale()
    }

    /// What an eye sample sees.
    pub(super) fn radiance(&self, sample: &Sample, clock: Clock, tally: &mut Tally) -> Seen {
        self.radiance_and(sample, clock, tally, &mut |_, _| ())
    }

    /// As [`Bidirectional::radiance`]; visits each light vertex that the roulette kept, with its value.
    #[inline(always)]
    pub(super) fn radiance_and(
        &self,
        sample: &Sample,
        clock: Clock,
        tally: &mut Tally,
        visit: &mut impl FnMut(u32, Spectrum),
    ) -> Seen {
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
                    rest += self.play_emitters(&vertex, &sample.sampler, clock, tally);
                    if sample.plays > 0.0 {
                        let (sampler, before, mut seconds) = (&sample.sampler, work(tally), 0.0);
                        clock.time(&mut seconds, || {
                            self.play_roulette(&vertex, sampler, clock, tally, &mut |light, value| {
                                kept += value;
                                visit(light, value);
                            });
                        });
                        tally.playing += seconds;
                        tally.played_work += clock.count(work(tally) - before);
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
    pub(super) fn if_visible(
        &self,
        connection: Option<(Spectrum, Ray)>,
        clock: Clock,
        tally: &mut Tally,
    ) -> Spectrum {
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
        let ((cache, subpaths), depth) = (self.all(), vertex.walk.depth);
        let stored = cache.len();
        let picks = f64::from(self.settings.connections);
        let mut sum = Spectrum::ZERO;
        for n in 0..self.settings.connections {
            let u = sample.sampler.nth(depth, Purpose::CachePick, n);
            if self.recipe.base == Base::Probabilistic {
                let kind = sample.sampler.nth(depth, Purpose::RecordPick, n);
                if let Some((light, tries)) = self.records.pick(vertex.walk.vertex.point.position, kind, u) {
                    sum += self.connect_base(vertex, light, picks * tries, clock, tally);
                }
            } else if stored > 0 {
                let place = ((u * stored as f64) as usize).min(stored - 1);
                let index = self.picks.get(place).map_or(place, |&index| index as usize);
                let light = cache.load(self.world, index);
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
        if vertex.eta(&self.techniques) == 0.0 {
            return Spectrum::ZERO;
        }
        let (depth, position) = (vertex.walk.depth, vertex.walk.vertex.point.position);
        let mut sum = Spectrum::ZERO;
        let (cache, tree) = self.merged();
        tree.within(position, merging.radius, &mut |index| {
            if depth + cache.depth(index as usize) <= self.settings.max_depth {
                let light = cache.load(self.world, index as usize);
                sum += vertex.merge(&self.techniques, &light);
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
        let query = Query {
            rule: MinimumRandom::of(self.settings.minimum).unwrap_or_default(),
            pregenerated: self.numbers.as_ref(),
            precision: roulette.numerics.precision,
            padding: self.settings.node_padding as f32,
            ..Query::new(position, &vertex.lobes, roulette.constant, key)
        };
        let mut kept = Vec::new();
        let Tally { roulette: counters, roulette_seconds, .. } = tally;
        clock.time(roulette_seconds, || {
            roulette::query(&self.bvh, &query, counters, &mut |index, p| kept.push((index, p)));
        });
        tally.kept_squares += (kept.len() as u64).pow(2);
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
