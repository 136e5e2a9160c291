//! The eye pass: what an eye sample sees, by every technique that is on.

use super::bidirectional::Bidirectional;
use super::recipe::Base;
use super::spread::Seen;
use super::tile::Sample;
use crate::connect::{EyeVertex, Onward};
use crate::math::Spectrum;
use crate::roulette::{self, Query};
use crate::sampler::{Purpose, Sampler};
use crate::subpath::Walk;
use crate::tally::{Clock, Tally};
use crate::visibility::Ray;

impl Bidirectional<'_> {
    /// What an eye sample sees.
    pub(super) fn radiance(&self, sample: &Sample, clock: Clock, tally: &mut Tally) -> Seen {
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
