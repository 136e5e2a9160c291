//! `hrr reference`: a long render by two independent recipes, with its variance.

use crate::args::{EXIT_CODES, message_args, verbosity};
use crate::log::{Log, Verbosity, percent};
use crate::progress::Reporter;
use crate::render::{INTERRUPTED, stop_on_interrupt};
use crate::scene_args::{self, SceneArgs};
use clap::builder::ValueHint;
use clap::{Arg, ArgMatches, value_parser};
use hrr::image::{self, Attributes, Image};
use hrr::integrator::Size;
use hrr::render::Outcome;
use hrr::report::agreement::{Agreement, agreement};
use hrr::settings::{Integrator, Settings};
use hrr::{Error, Result, file};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The arguments of `hrr reference`.
#[derive(Debug)]
pub struct ReferenceArgs {
    scene: SceneArgs,
    directory: PathBuf,
    witness: Option<Integrator>,
    /// How much is said.
    pub verbosity: Verbosity,
}

const EXAMPLES: &str = "\
Examples:
  hrr reference scene.toml -o reference --time 3600
      half an hour by the scene's integrator, half an hour by another
  hrr reference scene.toml -o reference --integrator lvc+hrr --witness lvc --error 0.01
      both to an error of 1 %

Writes mean.exr and variance.exr (of each pixel's mean, in squares of its unit), the same of each integrator by itself,
and reference.json. The mean weighs the two by their errors. Where both are sure (to 10 % of a tile of 16 x 16 pixels), they
must agree: exit code 1 if the largest deviation is one that comes about by chance less than once in 100 times. An integrator that
has not found some light yet is surer than it should be: then run longer, or choose a witness that finds it.";

impl ReferenceArgs {
    pub fn new(m: &ArgMatches) -> Self {
        let name = m.get_one::<String>("witness");
        let index = name.and_then(|name| Integrator::NAMES.iter().position(|n| n == name));
        Self {
            scene: SceneArgs::new(m),
            directory: m.get_one::<PathBuf>("output").cloned().unwrap_or_default(),
            witness: index.map(|i| Integrator::ALL[i]),
            verbosity: verbosity(m),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    clap::Command::new("reference")
        .about("Render a scene long, in two independent ways, with variances")
        .after_help("'hrr reference --help' tells more, with examples.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .arg(scene_args::scene())
        .arg(directory())
        .arg(
            Arg::new("witness")
                .long("witness")
                .value_name("NAME")
                .help_heading("Output")
                .value_parser(Integrator::NAMES[1..].to_vec())
                .help("The second integrator [default: bpt; lvc beside bpt]"),
        )
        .arg(scene_args::size("Output"))
        .args(scene_args::changes(|_| true))
        .args(message_args())
}

/// `-o DIR`.
pub fn directory() -> Arg {
    Arg::new("output")
        .short('o')
        .long("output")
        .value_name("DIR")
        .help_heading("Output")
        .required(true)
        .value_parser(value_parser!(PathBuf))
        .value_hint(ValueHint::DirPath)
        .help("Where the files go; made when missing")
}

/// Makes a directory for results.
pub fn make(directory: &Path) -> Result<()> {
    std::fs::create_dir_all(directory)
        .map_err(|e| Error::Output { path: directory.to_owned(), message: format!("cannot be made: {e}") })
}

/// Does it; returns the exit code.
pub fn run(args: &ReferenceArgs, log: &Log) -> Result<u8> {
    args.scene.check()?;
    make(&args.directory)?;
    file::check_writable(&args.directory.join("reference.json"))?;
    let (scene, mut settings) = args.scene.load(|warning| log.warning(warning))?;
    let size = Size::of(&settings, &scene.film);
    // Iterations of one size, so that their scatter tells the variance.
    (settings.samples, settings.light_subpaths) = (size.samples, size.light_subpaths);
    settings.integrator = hrr::render::chosen(&scene, &settings)?;
    settings.time = settings.time.map(|t| t / 2.0);
    let other = if settings.integrator == Integrator::Bpt { Integrator::Lvc } else { Integrator::Bpt };
    let witness = Settings {
        integrator: args.witness.unwrap_or(other),
        // Of its own numbers.
        seed: settings.seed ^ (1 << 62),
        ..settings.clone()
    };
    if witness.integrator == settings.integrator {
        return Err(Error::Usage("--witness: must differ from the integrator".into()));
    }
    let reporter = Arc::new(Reporter::new(*log));
    stop_on_interrupt(&reporter)?;
    let mut runs: Vec<Outcome> = Vec::new();
    for settings in [&settings, &witness] {
        reporter.say(|log| log.info(format_args!("reference by {}", settings.integrator.name())));
        let outcome = hrr::render::render(&scene, settings, &*reporter)?;
        if outcome.interrupted {
            reporter.finish();
            log.info("stopped: nothing was written");
            return Ok(INTERRUPTED);
        }
        runs.push(outcome);
    }
    reporter.finish();
    let mut attributes = Attributes::new();
    attributes.set("hrr:version", env!("CARGO_PKG_VERSION"));
    attributes.set("hrr:sceneHash", format!("{:016x}", scene.hash));
    attributes.set("hrr:settings", settings.to_toml());
    attributes.set("hrr:witness", witness.integrator.name());
    write(args, &runs, &attributes, log)
}

fn write(args: &ReferenceArgs, runs: &[Outcome], attributes: &Attributes, log: &Log) -> Result<u8> {
    let short =
        || Error::Usage("a reference needs at least 8 iterations of each: give it more --time".into());
    let mut parts: Vec<(Image, Image, f64)> = Vec::new();
    let mut summaries = Vec::new();
    for run in runs {
        let error = run.noise.error().ok_or_else(short)?;
        let variance = run.noise.variance().ok_or_else(short)?;
        let name = &run.stats.integrator;
        for (file, picture) in
            [(format!("{name}.exr"), &run.film.image()), (format!("{name}_variance.exr"), &variance)]
        {
            image::write(&args.directory.join(file), picture, attributes)?;
        }
        log.info(format_args!(
            "{name}: {} iterations, error {} (below {} with 90 % confidence){}",
            run.stats.iterations,
            percent(error.expected),
            percent(error.bound),
            if error.is_sure() { "" } else { "; no promise: rare bright samples make the noise" },
        ));
        summaries.push(serde_json::json!({
            "integrator": name, "iterations": run.stats.iterations, "seconds": run.stats.seconds.render,
            "error": error.expected, "error_bound90": error.bound, "hill_index": error.hill,
        }));
        parts.push((run.film.image(), variance, error.expected * error.expected));
    }
    let total: f64 = parts.iter().map(|p| 1.0 / p.2.max(1e-300)).sum();
    let weights: Vec<f32> = parts.iter().map(|p| (1.0 / p.2.max(1e-300) / total) as f32).collect();
    let sum = |pick: &dyn Fn(&(Image, Image, f64)) -> &Image, power: i32| {
        let mut image = pick(&parts[0]).exposed(0.0);
        image.pixels.iter_mut().for_each(|p| *p *= weights[0].powi(power));
        for (p, q) in image.pixels.iter_mut().zip(&pick(&parts[1]).pixels) {
            *p += *q * weights[1].powi(power);
        }
        image
    };
    image::write(&args.directory.join("mean.exr"), &sum(&|p| &p.0, 1), attributes)?;
    image::write(&args.directory.join("variance.exr"), &sum(&|p| &p.1, 2), attributes)?;
    let agreement = agreement(&runs[0].noise, &runs[1].noise).ok_or_else(short)?;
    let json = serde_json::json!({ "runs": summaries, "weights": weights, "agreement": agreement, "agrees": agreement.holds() });
    let text = serde_json::to_string_pretty(&json).map_err(|e| Error::Internal(e.to_string()))? + "\n";
    file::replace(&args.directory.join("reference.json"), text.as_bytes())?;
    Ok(verdict(&agreement, args, log))
}

fn verdict(a: &Agreement, args: &ReferenceArgs, log: &Log) -> u8 {
    let place = args.directory.join("mean.exr");
    if a.compared == 0 {
        log.warning(format_args!(
            "{}: no tile is known well enough to compare the two: run longer",
            place.display()
        ));
        return 1;
    }
    let what = format!(
        "{} of {} tiles are known well enough to be compared; their means' ratio is {:.4}, the largest deviation {:.1} \
         standard deviations (by chance p = {:.2})",
        a.compared, a.tiles, a.ratio, a.z, a.p
    );
    if a.holds() {
        log.info(format_args!("{}: the two agree: {what}", place.display()));
    } else {
        log.warning(format_args!("{}: the two DISAGREE: {what}", place.display()));
        if let Some((tile, [first, second])) = a.worst {
            log.warning(format_args!(
                "tile {tile} has the luminance {first:.4e} by the one and {second:.4e} by the other; who has not found some light \
                 yet is darker, and surer than it should be"
            ));
        }
    }
    u8::from(!a.holds())
}
