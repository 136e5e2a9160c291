//! `hrr render`: a scene to images.

use crate::args::RenderArgs;
use crate::log::{Log, Verbosity, duration, quantity};
use crate::progress::Reporter;
use hrr::effects;
use hrr::error::Place;
use hrr::file;
use hrr::image::{self, Attributes, Format};
use hrr::integrator::Size;
use hrr::integrator::{self, Plan};
use hrr::render::counters::{Stats, peak_rss_bytes};
use hrr::scene::Scene;
use hrr::settings::{Setting, SettingError, Settings};
use hrr::{Error, Result};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Exit code of a render that was stopped, as shells have it for SIGINT.
const INTERRUPTED: u8 = 130;

/// Does it; returns the exit code.
pub fn run(args: &RenderArgs, log: &Log) -> Result<u8> {
    let start = Instant::now();
    // What cannot succeed is said before any work is done.
    apply(&args.settings, &mut Settings::default())?;
    check_outputs(args)?;

    let scene = Scene::load(&args.scene, &args.overrides)?;
    for warning in &scene.warnings {
        log.warning(warning);
    }
    let mut settings = scene.settings.clone();
    apply(&args.settings, &mut settings)?;
    let load = start.elapsed().as_secs_f64();
    announce(&scene, &settings, load, log);

    let reporter = Arc::new(Reporter::new(*log));
    stop_on_interrupt(&reporter)?;
    let outcome = hrr::render::render(&scene, &settings, &*reporter);
    reporter.finish();
    let outcome = outcome?;

    let mut stats = outcome.stats;
    if stats.iterations == 0 {
        // A black image must not take the place of a good one.
        log.info("stopped before an iteration was finished: nothing was written");
        return Ok(INTERRUPTED);
    }
    stats.seconds.load = load;
    let image = outcome.film.image();
    let mut attributes = attributes(&scene, &settings, &stats, outcome.film.samples(), &outcome.plan);
    if !outcome.sizes.is_empty() {
        attributes.set("hrr:sizes", sizes(&outcome.sizes));
    }
    // One bad disk does not keep the image from the others.
    let written = args.outputs.iter().map(|path| match Format::of(path)? {
        Format::Exr => image::write(path, &image, &attributes),
        Format::Png => image::write(path, &image.exposed(args.exposure), &attributes),
    });
    let written: Vec<Result<()>> = written.collect();
    stats.memory.peak_rss_bytes = stats.memory.peak_rss_bytes.max(peak_rss_bytes());
    stats.seconds.total = start.elapsed().as_secs_f64();
    let reported = args.stats.as_deref().map_or(Ok(()), |path| write_stats(path, &stats));
    written.into_iter().chain([reported]).collect::<Result<()>>()?;

    details(&stats, log);
    if !outcome.sizes.is_empty() {
        log.detail(format_args!("{:>20}  {}", "sizes", sizes(&outcome.sizes)));
    }
    summary(args, &stats, outcome.interrupted, log);
    Ok(if outcome.interrupted { INTERRUPTED } else { 0 })
}

/// Gives the settings the values of the flags.
pub fn apply(given: &[(&'static Setting, String)], settings: &mut Settings) -> Result<()> {
    for (setting, value) in given {
        let flag = format!("--{}", setting.name.replace('_', "-"));
        setting.set(settings, value).map_err(|e| match e {
            SettingError::Invalid(message) => Error::Usage(format!("{flag}: {message}")),
            SettingError::NotYet(message) => Error::Unsupported { place: Place::file(flag), message },
        })?;
    }
    Ok(())
}

fn check_outputs(args: &RenderArgs) -> Result<()> {
    args.outputs.iter().try_for_each(|path| image::check_writable(path))?;
    match &args.stats {
        Some(path) if !is_stdout(path) => file::check_writable(path),
        _ => Ok(()),
    }
}

/// The first Ctrl-C lets the iteration be finished, the second one ends the program.
fn stop_on_interrupt(reporter: &Arc<Reporter>) -> Result<()> {
    let reporter = reporter.clone();
    let handler = move || {
        if !reporter.stop() {
            std::process::exit(INTERRUPTED.into());
        }
        reporter.say(|log| log.info("finishing the iteration; Ctrl-C again stops at once, without an image"));
    };
    ctrlc::set_handler(handler).map_err(|e| Error::Internal(format!("Ctrl-C cannot be caught: {e}")))
}

/// What an EXR file says about its making.
fn attributes(scene: &Scene, settings: &Settings, stats: &Stats, samples: u64, plan: &Plan) -> Attributes {
    let mut a = Attributes::new();
    a.set("samplesPerPixel", samples);
    a.set("renderTimeSeconds", stats.seconds.render as f32);
    a.set("hrr:version", stats.version.as_str());
    a.set("hrr:scene", stats.scene.as_str());
    a.set("hrr:sceneHash", format!("{:016x}", scene.hash));
    a.set("hrr:settings", settings.to_toml());
    a.set("hrr:integrator", stats.integrator.as_str());
    a.set("hrr:seed", stats.seed);
    a.set("hrr:iterations", stats.iterations);
    a.set("hrr:visibility", stats.visibility.as_str());
    a.set("hrr:threads", stats.threads as u64);
    let verdicts: Vec<_> = stats.effects.iter().map(|(id, verdict)| format!("{id}={verdict}")).collect();
    a.set("hrr:effects", verdicts.join(" "));
    a.set("hrr:machinery", plan.machinery.join(" "));
    a.set("hrr:biased", u64::from(plan.is_biased()));
    a
}

/// Samples x light subpaths of each iteration, and what it counts for.
fn sizes(sizes: &[(Size, u32)]) -> String {
    let words: Vec<String> =
        sizes.iter().map(|(s, weight)| format!("{}x{}*{weight}", s.samples, s.light_subpaths)).collect();
    words.join(" ")
}

fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

fn write_stats(path: &Path, stats: &Stats) -> Result<()> {
    let json = stats.to_json();
    if !is_stdout(path) {
        return file::replace(path, json.as_bytes());
    }
    let fail = |e: std::io::Error| Error::Output { path: path.to_owned(), message: e.to_string() };
    std::io::stdout().lock().write_all(json.as_bytes()).map_err(fail)
}

fn announce(scene: &Scene, settings: &Settings, load: f64, log: &Log) {
    let budget = match settings.time {
        Some(seconds) => duration(seconds),
        None => format!("{} iterations", settings.iterations),
    };
    log.info(format_args!(
        "rendering {}: {} triangles, {}x{} pixels, {budget}",
        scene.path.display(),
        scene.mesh.triangles.len(),
        scene.film.width,
        scene.film.height,
    ));
    let effects = effects::analyze(scene, settings);
    if let Ok(plan) = integrator::plan::plan(scene, settings, &effects) {
        let all = log.verbosity() == Verbosity::Verbose;
        for line in crate::effects::table(&effects, &plan, all, None) {
            log.info(line.trim_end());
        }
    }
    log.detail(format_args!("the scene was loaded in {}", duration(load)));
    for line in settings.to_toml().lines() {
        log.detail(line);
    }
}

fn details(stats: &Stats, log: &Log) {
    let c = &stats.counters;
    let s = &stats.seconds;
    log.detail(format_args!(
        "{} on {} threads, rays by {}",
        stats.integrator, stats.threads, stats.visibility
    ));
    for (name, count) in [
        ("camera rays", c.camera_rays),
        ("light subpaths", c.light_subpaths),
        ("light vertices", c.light_vertices),
        ("queries", c.queries),
        ("nodes visited", c.nodes_visited),
        ("accepted", c.accepted),
        ("connection rays", c.connection_rays),
        ("visible connections", c.visible_connections),
    ] {
        log.detail(format_args!("{name:>20}  {}", quantity(count as f64)));
    }
    for (name, seconds) in [
        ("accel build", s.accel_build),
        ("light trace", s.light_trace),
        ("vertex BVH build", s.vertex_bvh_build),
        ("eye trace", s.eye_trace),
        ("roulette", s.roulette),
        ("visibility", s.visibility),
        ("film", s.film),
    ] {
        log.detail(format_args!("{name:>20}  {} of all threads", duration(seconds)));
    }
}

/// The last line: where the image is.
fn summary(args: &RenderArgs, stats: &Stats, interrupted: bool, log: &Log) {
    let files: Vec<_> = args.outputs.iter().map(|p| p.display().to_string()).collect();
    let s = if stats.iterations == 1 { "" } else { "s" };
    log.info(format_args!(
        "{}{}: {} iteration{s} in {}",
        if interrupted { "stopped; " } else { "" },
        files.join(", "),
        stats.iterations,
        duration(stats.seconds.render),
    ));
}
