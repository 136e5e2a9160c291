//! `hrr render`: a scene to images.

use crate::args::{EXIT_CODES, exposure_arg, message_args, verbosity};
use crate::log::{Log, Verbosity, duration, percent, quantity};
use crate::progress::Reporter;
use crate::scene_args::{self, SceneArgs};
use clap::builder::ValueHint;
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use hrr::effects;
use hrr::file;
use hrr::image::{self, Attributes, Format, Image};
use hrr::integrator;
use hrr::integrator::Size;
use hrr::render::counters::{Stats, peak_rss_bytes};
use hrr::render::noise::LEAST_HILL;
use hrr::render::{ErrorEstimate, Noise, Outcome};
use hrr::scene::Scene;
use hrr::settings::{Settings, Switch};
use hrr::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// The arguments of `hrr render`.
#[derive(Debug)]
pub struct RenderArgs {
    /// The scene and its settings.
    pub scene: SceneArgs,
    /// Where the image goes; at least one file.
    pub outputs: Vec<PathBuf>,
    /// Where the variances of the pixels go.
    pub variance: Option<PathBuf>,
    /// Where the statistics go; `-` is stdout.
    pub stats: Option<PathBuf>,
    /// Stops by which PNG files are brighter.
    pub exposure: f32,
    /// How much is said.
    pub verbosity: Verbosity,
}

const OUTPUT: &str = "Output";

const EXAMPLES: &str = "\
Examples:
  hrr render scene.toml -o out.exr
      the scene as its file says
  hrr render scene.toml -o out.exr -o out.png --exposure 1 --time 30
      30 seconds of rendering; an EXR file, and a PNG file one stop brighter
  hrr render scene.toml -o out.exr --error 0.02 --time 600
      until the relative error is below 2 % with 90 % confidence; exit code 1 if that takes longer than 10 minutes
  hrr render model.obj -o quick.png --size 320x240 --iterations 4
      a first look at a bare OBJ file
  hrr render scene.toml -o a.exr -D camera.fov_y=30 -D material.mirror.alpha=\"[1e-3, 1e-3]\"
      with two keys of the scene file changed

What is given here wins over the scene file, which wins over the defaults.
Ctrl-C finishes the iteration and writes the image; a second one stops at once.";

impl RenderArgs {
    pub fn new(m: &ArgMatches) -> Self {
        Self {
            scene: SceneArgs::new(m),
            outputs: m.get_many::<PathBuf>("output").into_iter().flatten().cloned().collect(),
            variance: m.get_one::<PathBuf>("variance").cloned(),
            stats: m.get_one::<PathBuf>("stats").cloned(),
            exposure: m.get_one::<f32>("exposure").copied().unwrap_or(0.0),
            verbosity: verbosity(m),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    clap::Command::new("render")
        .about("Render a scene to an image")
        .after_help("'hrr render --help' tells more, with examples.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .next_line_help(false)
        .arg(scene_args::scene())
        .args(output_args())
        .args(scene_args::changes(|_| true))
        .args(message_args())
}

fn output_args() -> [Arg; 5] {
    [
        Arg::new("output")
            .short('o')
            .long("output")
            .value_name("FILE")
            .help_heading(OUTPUT)
            .required(true)
            .action(ArgAction::Append)
            .value_parser(value_parser!(PathBuf))
            .value_hint(ValueHint::FilePath)
            .help("Where the image goes: .exr (linear) or .png (sRGB); may be repeated"),
        Arg::new("variance")
            .long("variance")
            .value_name("FILE")
            .help_heading(OUTPUT)
            .value_parser(value_parser!(PathBuf))
            .value_hint(ValueHint::FilePath)
            .help("Where the variance of each pixel goes: .exr, squares of the image's unit")
            .long_help(
                "Where the variance of each pixel goes: .exr, squares of the image's unit\nIt is told from how the \
                 iterations differ; 'hrr compare' takes it.",
            ),
        Arg::new("stats")
            .long("stats")
            .value_name("FILE")
            .help_heading(OUTPUT)
            .value_parser(value_parser!(PathBuf))
            .value_hint(ValueHint::FilePath)
            .help("Where times and counts go, as JSON; '-' is stdout"),
        scene_args::size(OUTPUT),
        exposure_arg(OUTPUT, "Makes PNG files brighter, or darker when negative"),
    ]
}

/// Exit code of a render that was stopped, as shells have it for SIGINT.
pub const INTERRUPTED: u8 = 130;

/// Does it; returns the exit code.
pub fn run(args: &RenderArgs, log: &Log) -> Result<u8> {
    let start = Instant::now();
    // What cannot succeed is said before any work is done.
    args.scene.check()?;
    check_outputs(args)?;

    let (scene, settings) = args.scene.load(|warning| log.warning(warning))?;
    if settings.outlier_rejection == Switch::On {
        args.outputs.iter().try_for_each(|path| image::check_writable(&plain_beside(path)))?;
    }
    let load = start.elapsed().as_secs_f64();
    announce(&scene, &settings, load, log);

    let reporter = Arc::new(Reporter::new(*log));
    stop_on_interrupt(&reporter)?;
    let outcome = hrr::render::render(&scene, &settings, &*reporter);
    reporter.finish();
    let outcome = outcome?;

    let mut stats = outcome.stats.clone();
    if stats.iterations == 0 {
        // A black image must not take the place of a good one.
        log.info("stopped before an iteration was finished: nothing was written");
        return Ok(INTERRUPTED);
    }
    stats.seconds.load = load;
    let image = outcome.image();
    let rejects = settings.outlier_rejection == Switch::On;
    let error = outcome.noise.error();
    let mut attributes = attributes(&scene, &settings, &outcome, &stats);
    if !outcome.sizes.is_empty() {
        attributes.set("hrr:sizes", sizes(&outcome.sizes));
    }
    let write = |path: &Path, image: &Image, attributes: &Attributes| match Format::of(path)? {
        Format::Exr => image::write(path, image, attributes),
        Format::Png => image::write(path, &image.exposed(args.exposure), attributes),
    };
    // One bad disk does not keep the image from the others.
    let mut written: Vec<Result<()>> =
        args.outputs.iter().map(|path| write(path, &image, &attributes)).collect();
    if rejects {
        let plain = outcome.film.image();
        attributes.set("hrr:biased", u64::from(outcome.plan.is_biased()));
        written.extend(args.outputs.iter().map(|path| write(&plain_beside(path), &plain, &attributes)));
    }
    let variance =
        args.variance.as_deref().map_or(Ok(()), |path| write_variance(path, &outcome.noise, &attributes));
    stats.memory.peak_rss_bytes = stats.memory.peak_rss_bytes.max(peak_rss_bytes());
    stats.seconds.total = start.elapsed().as_secs_f64();
    let reported = args.stats.as_deref().map_or(Ok(()), |path| write_stats(path, &stats));
    written.into_iter().chain([variance, reported]).collect::<Result<()>>()?;

    details(&stats, log);
    if !outcome.sizes.is_empty() {
        log.detail(format_args!("{:>20}  {}", "sizes", sizes(&outcome.sizes)));
    }
    summary(args, &stats, error, outcome.interrupted, log);
    if rejects {
        let plain: Vec<_> =
            args.outputs.iter().map(|path| plain_beside(path).display().to_string()).collect();
        log.info(format_args!("outliers are rejected, which is biased; with them: {}", plain.join(", ")));
    }
    let missed = judge(&settings, error, &stats.integrator, log);
    Ok(match (outcome.interrupted, missed) {
        (true, _) => INTERRUPTED,
        (false, missed) => u8::from(missed),
    })
}

/// Says how far the error can be trusted; returns whether a target was missed.
fn judge(settings: &Settings, error: Option<ErrorEstimate>, integrator: &str, log: &Log) -> bool {
    if settings.error.is_some() && (integrator.starts_with("vcm") || integrator.starts_with("pcvcm")) {
        log.warning("vertex merging blurs; the error tells noise only, not the blur");
    }
    if let Some(e) = error.filter(|e| !e.is_sure()) {
        let message = format_args!(
            "no promise: rare bright samples make the noise (Hill index {:.1}; below {LEAST_HILL} its square is not known, \
             below 2 it has no mean), and rarer and brighter ones may not have been found yet",
            e.hill
        );
        if settings.error.is_some() { log.warning(message) } else { log.detail(message) }
    }
    let Some(target) = settings.error else { return false };
    let missed = error.is_none_or(|e| e.bound > target);
    if missed {
        let reached = error.map_or("not known yet".to_owned(), |e| percent(e.bound));
        log.warning(format_args!("the error of {} was not reached: it is {reached}", percent(target)));
    }
    missed
}

fn check_outputs(args: &RenderArgs) -> Result<()> {
    if let Some(path) = &args.variance {
        if Format::of(path)? != Format::Exr {
            return Err(Error::Output {
                path: path.clone(),
                message: "variances are written as .exr".into(),
            });
        }
        image::check_writable(path)?;
    }
    args.outputs.iter().try_for_each(|path| image::check_writable(path))?;
    match &args.stats {
        Some(path) if !is_stdout(path) => file::check_writable(path),
        _ => Ok(()),
    }
}

/// The first Ctrl-C lets the iteration be finished, the second one ends the program.
pub fn stop_on_interrupt(reporter: &Arc<Reporter>) -> Result<()> {
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
fn attributes(scene: &Scene, settings: &Settings, outcome: &Outcome, stats: &Stats) -> Attributes {
    let (samples, plan) = (outcome.film.samples(), &outcome.plan);
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
    a.set("hrr:biased", u64::from(stats.biased));
    if let Some(error) = outcome.noise.error() {
        a.set("hrr:error", error.expected as f32);
        a.set("hrr:errorBound90", error.bound as f32);
        a.set("hrr:hillIndex", error.hill as f32);
    }
    a
}

/// Where the image with its outliers goes, beside the one without: `out.exr` -> `out.plain.exr`.
fn plain_beside(path: &Path) -> PathBuf {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_extension(format!("plain.{extension}"))
}

fn write_variance(path: &Path, noise: &Noise, attributes: &Attributes) -> Result<()> {
    let variance = noise.variance().ok_or_else(|| Error::Output {
        path: path.to_owned(),
        message: "one iteration tells no variance; run at least two".into(),
    })?;
    image::write(path, &variance, attributes)
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
    let budget = match (settings.error, settings.time) {
        (Some(error), None) => format!("to an error of {}", percent(error)),
        (Some(error), Some(seconds)) => {
            format!("to an error of {}, {} at most", percent(error), duration(seconds))
        }
        (None, Some(seconds)) => duration(seconds),
        (None, None) => format!("{} iterations", settings.iterations),
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
fn summary(args: &RenderArgs, stats: &Stats, error: Option<ErrorEstimate>, interrupted: bool, log: &Log) {
    let files: Vec<_> = args.outputs.iter().map(|p| p.display().to_string()).collect();
    let s = if stats.iterations == 1 { "" } else { "s" };
    let error = error.map_or(String::new(), |e| {
        format!(", error {} (below {} with 90 % confidence)", percent(e.expected), percent(e.bound))
    });
    log.info(format_args!(
        "{}{}: {} iteration{s} in {}{error}",
        if interrupted { "stopped; " } else { "" },
        files.join(", "),
        stats.iterations,
        duration(stats.seconds.render),
    ));
}
