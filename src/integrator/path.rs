//! Path tracing with next-event estimation: code of its own, so that it can bear witness against the bidirectional
//! machine.

use super::adaptive::Adaptive;
use super::parts::Part;
use super::tile::{self, Sample};
use super::{Integrator, Size};
use crate::bsdf::Transport;
use crate::error::Result;
use crate::film::Film;
use crate::light::{LightPoint, Place};
use crate::math::Spectrum;
use crate::mis::EYE_HITS;
use crate::sampler::{Purpose, Sampler};
use crate::settings::Settings;
use crate::subpath::{Vertex, World};
use crate::tally::{Clock, Tally};
use crate::visibility::{Ray, offset};
use std::time::Instant;

/// The path tracer.
pub struct PathTracer<'a> {
    world: &'a World<'a>,
    settings: &'a Settings,
    samples: u32,
    adaptive: Option<Adaptive>,
}

impl<'a> PathTracer<'a> {
    /// A path tracer for a world.
    pub fn new(world: &'a World<'a>, settings: &'a Settings) -> Self {
        Self { world, settings, samples: Size::of(settings, &world.scene.film).samples, adaptive: None }
    }

    /// `LIGHTS`: whether there are lights beside emitting triangles.
    fn radiance<const LIGHTS: bool>(&self, sample: &Sample, clock: Clock, tally: &mut Tally) -> Spectrum {
        let world = self.world;
        let mut origin = world.camera.lens_point(|| sample.sampler.u2(0, Purpose::Lens));
        let mut direction = world.camera.direction_from(origin, sample.raster);
        let mut ray = offset::from_free_point(origin, direction);
        let (mut sum, mut throughput) = (Spectrum::ZERO, Spectrum::ONE);
        // Density of the last direction, as it counts for weights, and where it came from; `None` when next-event estimation could
        // not have found what it hits.
        let mut scattered_at: Option<(f64, Place)> = None;
        for depth in 1..=self.settings.max_depth {
            let Some(point) = world.intersect(&ray, origin, direction) else {
                if LIGHTS && let Some(sky) = world.lights.sky(direction) {
                    let number = LightPoint::Distant(sky).number();
                    let weight = scattered_at.map_or(1.0, |(hits, place)| {
                        hits / (hits + sky.pdf * world.lights.preference(|| place, number))
                    });
                    sum += throughput * sky.radiance * weight;
                }
                break;
            };
            if let Some(emitter) = world.lights.at(&point) {
                let weight = scattered_at.map_or(1.0, |(hits, place)| {
                    let distance2 = (point.position - origin).length_squared();
                    let pdf_a = emitter.pdf_a * world.lights.preference(|| place, emitter.emitter);
                    let pdf_light = pdf_a * distance2 / point.ng.dot(direction).abs();
                    hits / (hits + pdf_light)
                });
                sum += throughput * emitter.radiance(-direction) * weight;
            }
            if depth == self.settings.max_depth {
                break;
            }
            let vertex = Vertex::new(world, point, -direction);
            // Both rays are made before either is traced: the processor then works on them side by side.
            let scattered = vertex.sample(Transport::Radiance, &sample.sampler, depth);
            let next = scattered.map(|s| (offset::leave(&point, s.wi), s));
            let light = if vertex.bsdf.is_delta() {
                None
            } else if LIGHTS {
                self.direct_of_any(&vertex, &sample.sampler, depth)
            } else {
                self.direct(&vertex, &sample.sampler, depth)
            };
            if let Some((value, shadow_ray)) = light {
                let visibility = &world.visibility;
                let free = clock.time(&mut tally.visibility, || !visibility.occluded(&shadow_ray));
                if tally.connection(free) {
                    sum += throughput * value;
                }
            }
            let Some((next_ray, s)) = next else { break };
            throughput *= s.weight;
            scattered_at = (!s.delta).then(|| (EYE_HITS * s.pdf, vertex.place()));
            (ray, origin, direction) = (next_ray, point.position, s.wi);
        }
        sum
    }

    /// Light straight from an emitter, weighted against hitting the same point by scattering; it counts if the ray is
    /// free.
    fn direct(&self, vertex: &Vertex, sampler: &Sampler, depth: u32) -> Option<(Spectrum, Ray)> {
        let (pick, u) = (sampler.u1(depth, Purpose::LightPick), sampler.u2(depth, Purpose::LightPoint));
        let lights = &self.world.lights;
        let (number, preference) = lights.choose_for(|| vertex.place(), pick)?;
        let emitter = lights.area.point_on(number, u);
        let to = emitter.point.position - vertex.point.position;
        let distance2 = to.length_squared();
        let wi = to * (1.0 / distance2.sqrt());
        let radiance = emitter.radiance(-wi);
        if radiance == Spectrum::ZERO || distance2 == 0.0 {
            return None;
        }
        let (scattered, pdf_w) = vertex.toward_light(wi);
        if scattered == Spectrum::ZERO {
            return None;
        }
        // Over the sum of both densities, as they count; that of the emitter, seen from here, is pdf_a distance^2 / cos.
        let cos = emitter.point.ng.dot(wi).abs();
        let pdf_a = emitter.pdf_a * preference;
        let value = scattered * radiance * (cos / (pdf_a * distance2 + EYE_HITS * pdf_w * cos));
        Some((value, offset::between(&vertex.point, &emitter.point)))
    }

    /// As [`PathTracer::direct`], from lights of all kinds.
    fn direct_of_any(&self, vertex: &Vertex, sampler: &Sampler, depth: u32) -> Option<(Spectrum, Ray)> {
        let (pick, u) = (sampler.u1(depth, Purpose::LightPick), sampler.u2(depth, Purpose::LightPoint));
        let (number, preference) = self.world.lights.choose_for(|| vertex.place(), pick)?;
        let light = self.world.lights.point_on(number, u);
        let to = light.toward(vertex.point.position)?;
        let (scattered, pdf_w) = vertex.toward_light(to.w);
        // Scattering by chance meets surfaces and the sky only.
        let hits = if light.is_delta() { 0.0 } else { EYE_HITS * pdf_w };
        let value =
            scattered * to.radiance * (to.cos / (preference * light.pdf() * to.distance2 + hits * to.cos));
        (value != Spectrum::ZERO).then(|| (value, offset::to_light(&vertex.point, &light)))
    }
}

impl Integrator for PathTracer<'_> {
    fn resize(&mut self, size: Size) -> Result<()> {
        self.samples = size.samples;
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.plan(size.samples);
        }
        Ok(())
    }

    fn adapt(&mut self) {
        self.adaptive = Some(Adaptive::new(&self.world.scene.film));
    }

    fn iterate(&mut self, iteration: u64, film: &mut Film, progress: &(dyn Fn(f64) + Sync)) -> Result<Tally> {
        let key = (self.settings.seed, iteration, self.samples);
        let start = Instant::now();
        // Set aside, since the samples look at the rest of the path tracer.
        let mut adaptive = self.adaptive.take();
        let spread = adaptive.as_mut();
        let mut tally = if self.world.lights.only_area() {
            tile::sample_film(film, key, Part::ALL, spread, progress, |sample, clock, tally| {
                self.radiance::<false>(sample, clock, tally).into()
            })
        } else {
            tile::sample_film(film, key, Part::ALL, spread, progress, |sample, clock, tally| {
                self.radiance::<true>(sample, clock, tally).into()
            })
        };
        self.adaptive = adaptive;
        tally.sides[1] = start.elapsed().as_secs_f64();
        film.count_samples(u64::from(self.samples));
        Ok(tally)
    }
}
