//! Points of lights that the roulette judges at glossy eye vertices, beside next-event estimation (s = 1).
//!
//! Next-event estimation tries one light, by power alone; where many are seen by a narrow lobe, it is seldom the right one.
//! Here every glossy eye vertex judges a set of points that an iteration has in common, drawn with the density of next-event
//! estimation. Their C keeps `expected` of them for each eye vertex, on average over those of a small pre-pass: the lights'
//! area says little of that, as lights may be points, or few and far between.

use super::bidirectional::Bidirectional;
use crate::connect::EyeVertex;
use crate::error::Result;
use crate::light::LightPoint;
use crate::math::Spectrum;
use crate::roulette::{self, Query};
use crate::sampler::{Family, Purpose, Sampler, Stream};
use crate::subpath::World;
use crate::tally::{Clock, Tally};
use crate::techniques::EmitterRoulette;
use crate::vertex_bvh::VertexBvh;
use glam::{DVec2, Vec3};
use rayon::prelude::*;

/// Most points of an iteration.
const MOST: u64 = 1 << 14;
/// Lights, of equal power, from which on the points pay by themselves.
const MANY: f64 = 16.0;
/// Eye subpaths and points of the pre-pass.
const PILOT: (u64, u32) = (512, 256);
/// Steps towards C; each is exact while no probability reaches 1, and none goes beyond.
const STEPS: usize = 16;

/// The points of one iteration. Buffers are kept between iterations.
#[derive(Debug, Default)]
pub(super) struct EmitterPoints {
    lights: Vec<LightPoint>,
    positions: Vec<Vec3>,
    bvh: VertexBvh,
}

impl EmitterPoints {
    /// Bytes of points and tree.
    pub(super) fn bytes(&self) -> (usize, usize) {
        let points = self.lights.capacity() * size_of::<LightPoint>();
        (points + self.positions.capacity() * size_of::<Vec3>(), self.bvh.bytes())
    }
}

/// The light point of some numbers.
fn draw(world: &World<'_>, sampler: &Sampler) -> Option<LightPoint> {
    world.lights.sample(sampler.u1(0, Purpose::LightPick), sampler.u2(0, Purpose::LightPoint))
}

impl Bidirectional<'_> {
    /// How the roulette judges points of lights; `None` where it does not.
    pub(super) fn plan_emitters(&self) -> Option<EmitterRoulette> {
        let wanted = self.settings.emitters.is_on(|| self.world.lights.near_count() >= MANY);
        if !(wanted && self.recipe.roulette && self.recipe.next_event) {
            return None;
        }
        let points = self.size.light_subpaths.min(MOST) as f64;
        let constant = self.emitter_constant(points);
        let samples = f64::from(self.size.samples);
        (constant > 0.0).then_some(EmitterRoulette { points, samples, constant })
    }

    /// C with which an eye vertex keeps `expected` of so many points on average, or fewer where all probabilities are 1.
    fn emitter_constant(&self, points: f64) -> f64 {
        let (world, seed) = (self.world, self.settings.seed);
        let family = Family::new(seed, 0, Stream::EmitterPilot, 0);
        let lights: Vec<LightPoint> = (0..PILOT.1).filter_map(|i| draw(world, &family.member(i))).collect();
        let film = &world.scene.film;
        let size = DVec2::new(film.width.into(), film.height.into());
        // Collected in order: sums must not depend on threads.
        let found: Vec<(u32, Vec<f64>)> = (0..PILOT.0)
            .into_par_iter()
            .map(|index| {
                let (mut vertices, mut judged) = (0, Vec::new());
                let sampler = Sampler::new(seed, 0, Stream::EmitterPilot, 1 + index);
                let raster = sampler.u2(0, Purpose::Raster) * size;
                let mut eye = EyeVertex::first(world, &self.techniques, raster, &sampler).vertex();
                while let Some(vertex) = eye.filter(|v| v.walk.depth < self.settings.max_depth) {
                    if !vertex.lobes.is_empty() {
                        let from = vertex.walk.vertex.point.position;
                        vertices += 1;
                        judged.extend(lights.iter().filter_map(|light| {
                            let shines = light.toward(from)?.radiance != Spectrum::ZERO;
                            let value = roulette::q_over_d2(&vertex.lobes, light.position()? - from);
                            (shines && value.is_finite()).then_some(value)
                        }));
                    }
                    eye = vertex.next(world, &self.techniques, &sampler).vertex();
                }
                (vertices, judged)
            })
            .collect();
        let vertices: u32 = found.iter().map(|(vertices, _)| vertices).sum();
        let target = self.settings.expected * f64::from(vertices) * f64::from(PILOT.1) / points;
        let kept =
            |c: f64| found.iter().flat_map(|(_, judged)| judged).map(|g| (c * g).min(1.0)).sum::<f64>();
        let all: f64 = found.iter().flat_map(|(_, judged)| judged).sum();
        if !(all > 0.0) {
            return 0.0;
        }
        // The sum is concave in C, so that no step goes beyond the target.
        (0..STEPS).fold(target / all, |c, _| c * (target / kept(c)))
    }

    /// Draws an iteration's points.
    pub(super) fn draw_emitters(&mut self, iteration: u64) -> Result<()> {
        let Some(emitters) = &self.techniques.emitters else { return Ok(()) };
        let (world, count) = (self.world, emitters.points as u32);
        let family = Family::new(self.settings.seed, iteration, Stream::Emitters, 0);
        let EmitterPoints { lights, positions, bvh } = &mut self.emitters;
        let near = (0..count).filter_map(|i| {
            let light = draw(world, &family.member(i))?;
            Some((light, light.position()?.as_vec3()))
        });
        lights.clear();
        positions.clear();
        near.for_each(|(light, position)| {
            lights.push(light);
            positions.push(position);
        });
        bvh.build(positions)
    }

    /// Light straight from what the roulette keeps of an iteration's points.
    pub(super) fn play_emitters(
        &self,
        vertex: &EyeVertex,
        sampler: &Sampler,
        clock: Clock,
        tally: &mut Tally,
    ) -> Spectrum {
        let Some(emitters) = &self.techniques.emitters else { return Spectrum::ZERO };
        let (depth, position) = (vertex.walk.depth, vertex.walk.vertex.point.position);
        let key = sampler.bits(depth, Purpose::EmitterRoulette);
        let query = Query::new(position, &vertex.lobes, emitters.constant, key);
        let mut kept = Vec::new();
        roulette::query(&self.emitters.bvh, &query, &mut tally.emitters, &mut |index, p| {
            kept.push((index, p))
        });
        let mut sum = Spectrum::ZERO;
        for (index, p) in kept {
            let (light, tries) = (&self.emitters.lights[index as usize], emitters.points * p);
            let connection = vertex.emitter_point(self.world, &self.techniques, light, tries);
            sum += self.if_visible(connection, clock, tally);
        }
        sum
    }
}
