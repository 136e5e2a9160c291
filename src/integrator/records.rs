//! Probabilistic connections [Popov et al. 2015]: an eye vertex picks one of a few reused light vertices in proportion to
//! what these gave to eye vertices nearby.
//!
//! A *record* is an eye vertex, one of some spread over the image, for which the full contribution of every reused light
//! vertex is computed, both BSDFs, the geometry, the weight and a shadow ray included. An eye vertex picks from the mean
//! of its nearest records' distributions, and now and then uniformly, which keeps it unbiased wherever they are wrong.
//! So few light subpaths serve few eye samples well: in a large iteration, records are made again from others.
//!
//! Memory: 4 bytes for each pair of a record and a reused light vertex, some 1.5 vertices a subpath; time: a shadow ray
//! for each pair.

use super::tile;
use crate::connect::EyeVertex;
use crate::light_cache::LightCache;
use crate::math::luminance;
use crate::sampler::{Purpose, Sampler, Stream};
use crate::settings::Settings;
use crate::subpath::{Walk, World};
use crate::tally::Tally;
use crate::techniques::Techniques;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Records whose distributions an eye vertex mixes.
const NEAREST: usize = 3;
/// Share of picks that are uniform.
const UNIFORM: f64 = 0.2;
/// Samples of a pixel that share their reused light subpaths. What they have in common does not average out between
/// them; with fewer, records take most of the time.
pub(super) const SAMPLES: u32 = 8;

/// The records of one iteration.
#[derive(Debug, Default)]
pub(super) struct Records {
    /// The reused light vertices, ready to be connected to.
    lights: Vec<Walk>,
    /// How many subpaths left them.
    subpaths: u64,
    /// Where the records are, with their numbers.
    places: RTree<GeomWithData<[f64; 3], usize>>,
    /// Running sums of each record's distribution, record by record; the last of each is 1.
    cdfs: Vec<f32>,
}

/// An eye vertex of a record, and what the light vertices gave to it.
struct Record {
    position: DVec3,
    contributions: Vec<f64>,
}

impl Records {
    /// Makes the records of an iteration's `part`, which has its own of the cache's subpaths as long as there are enough.
    pub(super) fn new(
        world: &World<'_>,
        settings: &Settings,
        techniques: &Techniques,
        cache: &LightCache,
        (iteration, part): (u64, u32),
        tally: &mut Tally,
    ) -> Self {
        let subpaths = settings.reused_subpaths.min(cache.subpaths());
        let first = u64::from(part) % (cache.subpaths() / subpaths.max(1)).max(1) * subpaths;
        let reused = cache.end_of(first)..cache.end_of(first + subpaths);
        let lights: Vec<Walk> = reused.map(|index| cache.load(world, index)).collect();
        if lights.is_empty() {
            return Self::default();
        }
        let (width, height) = (world.scene.film.width, world.scene.film.height);
        let spacing = settings.record_spacing;
        let (across, down) = (width.div_ceil(spacing), height.div_ceil(spacing));
        let (records, rays): (Vec<Vec<Record>>, Vec<u64>) = (0..across * down)
            .into_par_iter()
            .map(|cell| {
                let index = u64::from(part) * u64::from(across * down) + u64::from(cell);
                let sampler = Sampler::new(settings.seed, iteration, Stream::Records, index);
                let corner = DVec2::new((cell % across).into(), (cell / across).into());
                let raster = (corner + sampler.u2(0, Purpose::Raster)) * f64::from(spacing);
                let size = DVec2::new(width.into(), height.into());
                trace(world, settings, techniques, &lights, &sampler, raster.min(size * tile::INSIDE))
            })
            .unzip();
        tally.connection_rays += rays.iter().sum::<u64>();
        let (mut places, mut cdfs) = (Vec::new(), Vec::new());
        for record in records.iter().flatten() {
            let total: f64 = record.contributions.iter().sum();
            places.push(GeomWithData::new(record.position.to_array(), places.len()));
            let mut sum = 0.0;
            cdfs.extend(record.contributions.iter().map(|c| {
                sum += c;
                (sum / total) as f32
            }));
            // Whatever the roundings, every number in [0,1) falls on a vertex.
            *cdfs.last_mut().expect("there are lights") = 1.0;
        }
        Self { lights, subpaths, places: RTree::bulk_load(places), cdfs }
    }

    /// Picks a light vertex for an eye vertex at `position`, with the expected number of picks of a vertex like it for each
    /// light subpath: `kind` chooses the distribution, `u` the vertex, both uniform in 0 <= u < 1. `None` when there is no
    /// light vertex.
    pub(super) fn pick(&self, position: DVec3, kind: f64, u: f64) -> Option<(&Walk, f64)> {
        let n = self.lights.len();
        if n == 0 {
            return None;
        }
        let mut nearest = [&self.cdfs[..0]; NEAREST];
        let mut found = 0;
        for place in self.places.nearest_neighbor_iter(position.to_array()).take(NEAREST) {
            nearest[found] = &self.cdfs[place.data * n..][..n];
            found += 1;
        }
        let uniform = if found == 0 { 1.0 } else { UNIFORM };
        let index = if kind < uniform {
            ((u * n as f64) as usize).min(n - 1)
        } else {
            let which = ((kind - uniform) / (1.0 - uniform) * found as f64) as usize;
            nearest[which.min(found - 1)].partition_point(|&sum| f64::from(sum) <= u).min(n - 1)
        };
        let sum_of_records: f64 = nearest[..found].iter().map(|cdf| probability(cdf, index)).sum();
        let probability = uniform / n as f64 + (1.0 - uniform) * sum_of_records / found.max(1) as f64;
        Some((&self.lights[index], self.subpaths as f64 * probability))
    }

    /// Bytes of all records and light vertices.
    pub(super) fn bytes(&self) -> usize {
        self.lights.len() * size_of::<Walk>() + self.cdfs.len() * size_of::<f32>() + self.places.size() * 64
    }
}

/// The probability that [`Records::pick`] finds in a record's running sums.
fn probability(cdf: &[f32], index: usize) -> f64 {
    let below = if index == 0 { 0.0 } else { cdf[index - 1] };
    f64::from(cdf[index]) - f64::from(below)
}

/// The records along one eye subpath, and the shadow rays that they took.
fn trace(
    world: &World<'_>,
    settings: &Settings,
    techniques: &Techniques,
    lights: &[Walk],
    sampler: &Sampler,
    raster: DVec2,
) -> (Vec<Record>, u64) {
    let (mut records, mut rays) = (Vec::new(), 0);
    let mut eye = EyeVertex::first(world, techniques, raster, sampler).vertex();
    while let Some(vertex) = eye.filter(|v| v.walk.depth < settings.max_depth) {
        if !vertex.walk.vertex.bsdf.is_delta() && vertex.lobes.is_empty() {
            let contributions: Vec<f64> = lights
                .iter()
                .map(|light| match vertex.connect(techniques, light, techniques.base, 1.0) {
                    Some((value, ray)) => {
                        rays += 1;
                        let free = !world.visibility.occluded(&ray);
                        if free { luminance(value) } else { 0.0 }
                    }
                    None => 0.0,
                })
                .collect();
            // Where nothing arrives, neighbours may know better.
            if contributions.iter().sum::<f64>() > 0.0 {
                records.push(Record { position: vertex.walk.vertex.point.position, contributions });
            }
        }
        eye = vertex.next(world, techniques, sampler).vertex();
    }
    (records, rays)
}
