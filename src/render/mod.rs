//! A whole render: iterations until their number, the time or the observer says enough.

pub mod counters;
pub mod noise;
pub mod observer;
mod sizing;

pub use counters::{Counters, Memory, Seconds, Stats};
pub use noise::{ErrorEstimate, Noise};
pub use observer::{Observer, Progress, Silent};

use crate::effects;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::image::Image;
use crate::integrator::{self, Plan, Size};
use crate::scene::Scene;
use crate::settings::{Integrator, Settings, Switch};
use crate::subpath::World;
use crate::tally::Tally;
use sizing::{Measured, Sizing};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What a render leaves.
#[derive(Debug)]
pub struct Outcome {
    /// The samples; [`Film::image`] makes the image.
    pub film: Film,
    /// What was done and what it cost. `seconds.load` and `seconds.total` are for the caller to fill in.
    pub stats: Stats,
    /// What the iterations' scatter tells of the error.
    pub noise: Noise,
    /// Sizes that were chosen for iterations, with what each counts for; empty where the settings say them.
    pub sizes: Vec<(Size, u32)>,
    /// What was switched on, and what is missing from the image.
    pub plan: Plan,
    /// Whether the observer ended it.
    pub interrupted: bool,
}

impl Outcome {
    /// The image, without outliers where the settings say so.
    pub fn image(&self) -> Image {
        self.film.shown()
    }
}

/// Renders a scene. The film depends on the scene, the settings' seed and the range of iterations only: not on
/// threads, and films of consecutive ranges add up to that of the whole range, bit for bit.
///
/// # Errors
/// An unusable scene or setting, and what the libraries below report.
pub fn render(scene: &Scene, settings: &Settings, observer: &dyn Observer) -> Result<Outcome> {
    let threads = rayon::ThreadPoolBuilder::new()
        .num_threads(settings.threads)
        .build()
        .map_err(|e| Error::Internal(format!("cannot start {} threads: {e}", settings.threads)))?;
    threads.install(|| run(scene, settings, observer))
}

fn run(scene: &Scene, settings: &Settings, observer: &dyn Observer) -> Result<Outcome> {
    let effects = effects::analyze(scene, settings);
    let plan = integrator::plan::plan(scene, settings, &effects)?;
    if let Some(complaint) = plan.complaint() {
        observer.warn(&complaint);
    }
    let reduced = integrator::plan::without(scene, settings)?;
    let (scene, settings) = reduced.as_ref().map_or((scene, settings), |(scene, settings)| (scene, settings));
    let mut settings = settings.clone();
    settings.integrator = plan.integrator;
    let start = Instant::now();
    let world = World::new(scene, &settings)?;
    let accel_build = start.elapsed().as_secs_f64();
    if world.lights.is_empty() {
        observer.warn("nothing in the scene emits light: the image is black");
    }
    let mut size = Size::of(&settings, &scene.film);
    let sizing = Sizing::new(&settings, &scene.film);
    let mut sizes: Vec<(Size, u32)> = sizing.iter().map(|_| (size, 1)).collect();
    let mut integrator = integrator::new(&world, &settings)?;
    if sizing.is_some() && settings.adaptive == Switch::On {
        integrator.adapt();
    }
    let rejects = settings.outlier_rejection == Switch::On;
    let mut film = Film::watching(&scene.film, rejects);
    let mut tally = Tally::default();
    let mut bytes = (0, 0);

    let start = Instant::now();
    let open_ended = settings.time.is_some() || settings.error.is_some();
    let iterations = (!open_ended).then_some(settings.iterations);
    let mut noise = Noise::new(film.width(), film.height());
    let accepted = AtomicU64::new(0);
    let mut finished = 0;
    let mut interrupted = false;
    loop {
        let elapsed = start.elapsed().as_secs_f64();
        if iterations.is_some_and(|n| finished >= n) || settings.time.is_some_and(|t| elapsed >= t) {
            break;
        }
        let error = noise.error().map(|e| e.bound);
        if error.zip(settings.error).is_some_and(|(error, target)| error <= target) {
            break;
        }
        if observer.should_stop() {
            interrupted = true;
            break;
        }
        let progress = |fraction: f64| {
            observer.progress(&Progress {
                iteration: finished,
                iterations,
                fraction,
                elapsed: start.elapsed().as_secs_f64(),
                time_limit: settings.time,
                error,
                target: settings.error,
                accepted: accepted.load(Ordering::Relaxed),
            });
        };
        progress(0.0);
        let done = integrator.iterate(settings.first_iteration + finished, &mut film, &progress)?;
        tally.add(&done);
        finished += 1;
        noise.update(&film, finished, false);
        accepted.store(tally.roulette.accepted, Ordering::Relaxed);
        let (cache, tree) = integrator.bytes();
        bytes = (bytes.0.max(cache), bytes.1.max(tree));
        if let Some(sizing) = &sizing {
            let measured = Measured { size, tally: done, bytes: cache + tree };
            let Some(next) = sizing.next(start.elapsed().as_secs_f64(), &measured) else { break };
            integrator.finish_by(Instant::now() + Duration::from_secs_f64(next.seconds));
            size = next.size;
            integrator.resize(size)?;
            film.set_weight(next.weight);
            sizes.push((size, next.weight));
        }
    }
    noise.update(&film, finished, true);
    let render = start.elapsed().as_secs_f64();
    if film.dropped() > 0 {
        observer.warn(&format!(
            "{} samples were not finite and were left out: please report this",
            film.dropped()
        ));
    }
    let stats = Stats {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: scene.path.display().to_string(),
        integrator: settings.integrator.name().into(),
        visibility: settings.visibility.name().into(),
        threads: rayon::current_num_threads(),
        seed: settings.seed,
        width: film.width(),
        height: film.height(),
        iterations: finished,
        effects: effects.findings.iter().map(|f| (f.id.clone(), f.verdict.name().to_owned())).collect(),
        machinery: plan.machinery.iter().map(|&name| name.to_owned()).collect(),
        biased: plan.is_biased() || rejects,
        seconds: Seconds {
            load: 0.0,
            accel_build,
            light_trace: tally.light_trace,
            vertex_bvh_build: tally.vertex_bvh_build,
            eye_trace: tally.eye_trace,
            roulette: tally.roulette_seconds,
            visibility: tally.visibility,
            film: tally.film,
            render,
            total: 0.0,
        },
        counters: Counters {
            camera_rays: tally.camera_rays,
            light_subpaths: tally.light_subpaths,
            light_vertices: tally.light_vertices,
            queries: tally.roulette.queries,
            nodes_visited: tally.roulette.nodes,
            accepted: tally.roulette.accepted,
            connection_rays: tally.connection_rays,
            visible_connections: tally.visible_connections,
        },
        memory: Memory {
            peak_rss_bytes: counters::peak_rss_bytes(),
            light_cache_bytes: bytes.0 as u64,
            vertex_bvh_bytes: bytes.1 as u64,
        },
    };
    sizes.truncate(usize::try_from(finished).unwrap_or(usize::MAX));
    Ok(Outcome { film, stats, noise, sizes, plan, interrupted })
}

/// The integrator that is set, or what `auto` stands for: the least machinery that finds all of the scene's light.
///
/// # Errors
/// As [`render`], where no integrator finds all of it.
pub fn chosen(scene: &Scene, settings: &Settings) -> Result<Integrator> {
    Ok(integrator::plan::plan(scene, settings, &effects::analyze(scene, settings))?.integrator)
}
