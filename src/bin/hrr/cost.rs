//! `hrr cost`: what accuracy costs in time, as a page that a person can read.

use crate::args::{EXIT_CODES, exposure_arg, message_args, verbosity};
use crate::log::{Log, Verbosity, duration};
use crate::progress::Reporter;
use crate::reference::{directory, make};
use crate::render::stop_on_interrupt;
use crate::scene_args::{self, SceneArgs};
use crate::sweep::{Sweep, contenders, sweep_arg};
use clap::builder::ValueHint;
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use hrr::effects::Verdict;
use hrr::image::{self, Attributes};
use hrr::render::{Observer, Progress};
use hrr::report::chart;
use hrr::report::curve::curves;
use hrr::report::markdown::markdown;
use hrr::report::page::{Pictures, figures, page, sentences};
use hrr::report::results::Results;
use hrr::report::study::{self, Contender, Reference, deviation_map};
use hrr::scene::Scene;
use hrr::settings::Settings;
use hrr::{Error, Result, file};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The arguments of `hrr cost`.
#[derive(Debug)]
pub struct CostArgs {
    scene: Option<SceneArgs>,
    directory: PathBuf,
    replot: Option<PathBuf>,
    reference: Option<PathBuf>,
    quick: bool,
    sweeps: Vec<Sweep>,
    runs: usize,
    seconds: f64,
    exposure: f32,
    /// How much is said.
    pub verbosity: Verbosity,
}

/// Pixels of a quick study's image at most.
const QUICK_PIXELS: f64 = 8000.0;
const QUICK_SECONDS: f64 = 90.0;
const SECONDS: f64 = 900.0;

const EXAMPLES: &str = "\
Examples:
  hrr cost scene.toml -o study --quick
      the main integrators at a small size, in about two minutes
  hrr cost scene.toml -o study --seconds 3600 --reference reference
      integrators and knobs, measured against what 'hrr reference' made
  hrr cost scene.toml -o study --sweep range=spheroid,sphere --sweep expected=0.1,10
      integrators, and these values of two settings
  hrr cost --replot study/results.csv -o study
      draws the page again

Writes report.html (self-contained), report.md with its figures beside it, results.csv (every number) and the images. Each setting is run --runs times with
different seeds, in turn with the others: renders of five times, each twice as long as the one before, as --time would make
them. With --samples and --light-subpaths, iterations of these sizes are looked at after 1, 2, 4, ... of them. Without
--reference, half of the time goes into one, made by the integrator that finds all of the scene's light with least machinery.";

impl CostArgs {
    pub fn new(m: &ArgMatches) -> Self {
        let path = |name: &str| m.get_one::<PathBuf>(name).cloned();
        let quick = m.get_flag("quick");
        let seconds = if quick { QUICK_SECONDS } else { SECONDS };
        Self {
            scene: path("scene").map(|_| SceneArgs::new(m)),
            directory: path("output").unwrap_or_default(),
            replot: path("replot"),
            reference: path("reference"),
            quick,
            sweeps: m.get_many::<Sweep>("sweep").into_iter().flatten().cloned().collect(),
            runs: m.get_one::<u32>("runs").copied().unwrap_or(16) as usize,
            seconds: m.get_one::<f64>("seconds").copied().unwrap_or(seconds),
            exposure: m.get_one::<f32>("exposure").copied().unwrap_or(0.0),
            verbosity: verbosity(m),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    let place = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name)
            .long(name)
            .value_name(value)
            .value_parser(value_parser!(PathBuf))
            .value_hint(ValueHint::AnyPath)
            .help(help)
    };
    clap::Command::new("cost")
        .about("Measure what accuracy costs in time, and write a report")
        .after_help("'hrr cost --help' tells more, with examples.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .arg(scene_args::scene().required(false).required_unless_present("replot"))
        .arg(directory())
        .arg(
            Arg::new("quick")
                .long("quick")
                .action(ArgAction::SetTrue)
                .help("Only the main integrators, small, in about two minutes"),
        )
        .arg(
            place("replot", "CSV", "Draw the report of these results again")
                .conflicts_with_all(["scene", "quick"]),
        )
        .arg(place("reference", "DIR", "Measure against mean.exr and variance.exr in it"))
        .arg(sweep_arg())
        .arg(runs_arg())
        .arg(seconds_arg("Seconds for all runs [default: 900; 90 with --quick]"))
        .arg(exposure_arg("Output", "Stops by which the images are brighter"))
        .arg(scene_args::size("Output"))
        .args(scene_args::changes(|s| !["time", "iterations", "error", "first_iteration"].contains(&s.name)))
        .args(message_args())
}

/// `--runs`.
pub fn runs_arg() -> Arg {
    Arg::new("runs")
        .long("runs")
        .value_name("N")
        .value_parser(value_parser!(u32).range(4..=1000))
        .help("Independent runs of each setting [default: 16]")
}

/// `--seconds`.
pub fn seconds_arg(help: &'static str) -> Arg {
    let parse = |text: &str| {
        text.parse().ok().filter(|s| (1e-3..1e9).contains(s)).ok_or("a number of seconds, above 0")
    };
    Arg::new("seconds").long("seconds").value_name("SECONDS").value_parser(parse).help(help)
}

/// Does it; returns the exit code.
pub fn run(args: &CostArgs, log: &Log) -> Result<u8> {
    make(&args.directory)?;
    file::check_writable(&args.directory.join("report.html"))?;
    if let Some(csv) = &args.replot {
        return report(args, &Results::read(csv)?, log);
    }
    let Some(scene_args) = &args.scene else { return Err(Error::Usage("which scene?".into())) };
    scene_args.check()?;
    let (mut scene, settings) = scene_args.load(|warning| log.warning(warning))?;
    if args.quick {
        shrink(&mut scene, scene_args);
    }
    let contenders = contenders(&scene, &settings, args.quick, &args.sweeps)?;
    log.info(format_args!(
        "{}: {} settings, {} runs of each, {}x{} pixels, about {}",
        scene.path.display(),
        contenders.len(),
        args.runs,
        scene.film.width,
        scene.film.height,
        duration(args.seconds)
    ));
    let given = match &args.reference {
        None => None,
        Some(directory) => Some(Reference {
            mean: image::read(&directory.join("mean.exr"))?,
            variance: image::read(&directory.join("variance.exr"))?,
        }),
    };
    if let Some(Reference { mean, .. }) = &given
        && (mean.width, mean.height) != (scene.film.width, scene.film.height)
    {
        return Err(Error::Input(format!(
            "--reference: its images have {}x{} pixels, the study's {}x{}",
            mean.width, mean.height, scene.film.width, scene.film.height
        )));
    }
    let study = observed(log, settings.threads, args.seconds, |tell| {
        study::run(&scene, &contenders, args.runs, args.seconds, given, args.exposure, tell)
    })?;
    let results = Results { about: about(&scene, &settings, &contenders, study.owner), rows: study.rows };
    let put = |name: String, picture: &image::Image| {
        image::write(&args.directory.join(name), picture, &Attributes::new())
    };
    put("reference.png".into(), &study.reference.mean.exposed(args.exposure))?;
    put("reference.exr".into(), &study.reference.mean)?;
    for (contender, picture) in contenders.iter().zip(&study.images) {
        let name = slug(&contender.name);
        put(format!("{name}.png"), &picture.exposed(args.exposure))?;
        put(format!("{name}_map.png"), &deviation_map(picture, &study.reference.mean, args.exposure)?)?;
    }
    file::replace(&args.directory.join("results.csv"), results.to_csv().as_bytes())?;
    report(args, &results, log)
}

/// Works on a pool of threads, with a bar; Ctrl-C stops it.
pub fn observed<T: Send>(
    log: &Log,
    threads: usize,
    seconds: f64,
    work: impl FnOnce(&dyn Fn(f64) -> bool) -> Result<T> + Send,
) -> Result<T> {
    let reporter = Arc::new(Reporter::new(*log));
    stop_on_interrupt(&reporter)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Internal(format!("cannot start {threads} threads: {e}")))?;
    let start = std::time::Instant::now();
    let watch = reporter.clone();
    let result = pool.install(move || {
        work(&|done| {
            let elapsed = start.elapsed().as_secs_f64();
            let iteration = (done * 1000.0) as u64;
            watch.progress(&Progress {
                iteration,
                iterations: Some(1000),
                elapsed,
                time_limit: Some(seconds.max(elapsed)),
                ..Progress::default()
            });
            !watch.should_stop()
        })
    });
    reporter.finish();
    result
}

/// A small image, where the user did not say otherwise.
fn shrink(scene: &mut Scene, args: &SceneArgs) {
    let sized = args.overrides.iter().any(|(key, _)| key.starts_with("film."));
    let pixels = f64::from(scene.film.width) * f64::from(scene.film.height);
    let scale = (QUICK_PIXELS / pixels).sqrt().min(1.0);
    if !sized {
        let side = |n: u32| ((f64::from(n) * scale) as u32).max(1);
        (scene.film.width, scene.film.height) = (side(scene.film.width), side(scene.film.height));
    }
}

fn about(
    scene: &Scene,
    settings: &Settings,
    contenders: &[Contender],
    owner: Option<usize>,
) -> Vec<(String, String)> {
    let line = |name: &str, value: String| (name.to_owned(), value);
    let cpu = std::fs::read_to_string("/proc/cpuinfo").ok();
    let model =
        cpu.as_deref().and_then(|t| t.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": ")));
    // The program's name only: where it stands tells nothing.
    let command: Vec<String> = std::env::args().skip(1).collect();
    vec![
        line("scene", scene.path.file_name().map_or_else(String::new, |_| scene.path.display().to_string())),
        line("scene hash", format!("{:016x}", scene.hash)),
        line("size", format!("{}x{}", scene.film.width, scene.film.height)),
        line("hrr", env!("CARGO_PKG_VERSION").into()),
        line("command", format!("hrr {}", command.join(" "))),
        line("processor", model.map_or("unknown", |(_, m)| m).into()),
        line("threads", rayon_threads(settings).to_string()),
        line(
            "load average before",
            std::fs::read_to_string("/proc/loadavg")
                .map_or("unknown".into(), |t| t.split(' ').take(3).collect::<Vec<_>>().join(" ")),
        ),
        line("reference", owner.map_or("given".into(), |i| format!("renders by {}", contenders[i].name))),
        line("effects", effects(scene, settings)),
        line("settings", settings.to_toml().trim().replace('\n', "; ")),
    ]
}

/// What the scene calls for, and what the least machinery for it is.
fn effects(scene: &Scene, settings: &Settings) -> String {
    let effects = hrr::effects::analyze(scene, settings);
    let present = effects.findings.iter().filter(|f| f.verdict != Verdict::Absent);
    let mut words: Vec<_> = present.map(|f| format!("{} {}", f.id, f.verdict.name())).collect();
    if let Ok(plan) = hrr::integrator::plan::plan(scene, settings, &effects) {
        words.push(format!("plan: {}, {}", plan.integrator, plan.machinery.join(" ")));
    }
    words.join("; ")
}

fn rayon_threads(settings: &Settings) -> usize {
    if settings.threads == 0 { rayon::current_num_threads() } else { settings.threads }
}

/// A name as a file's.
fn slug(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || ".+-".contains(c) { c } else { '_' }).collect()
}

/// Writes the page; its sentences go to stdout.
fn report(args: &CostArgs, results: &Results, log: &Log) -> Result<u8> {
    let curves = curves(results);
    let folder: &Path = args.replot.as_deref().and_then(Path::parent).unwrap_or(&args.directory);
    let read = |name: String| std::fs::read(folder.join(name)).ok();
    let pictures = read("reference.png".into()).map(|reference| Pictures {
        reference,
        settings: curves
            .iter()
            .filter_map(|c| {
                let name = slug(&c.name);
                Some((c.name.clone(), read(format!("{name}.png"))?, read(format!("{name}_map.png"))?))
            })
            .collect(),
    });
    let pictures = pictures.filter(|p| !p.settings.is_empty());
    let beside = |name: &str| folder == args.directory && folder.join(name).is_file();
    let images: Vec<(String, String)> = std::iter::once("reference")
        .chain(curves.iter().map(|c| c.name.as_str()))
        .map(|name| (name.to_owned(), format!("{}.png", slug(name))))
        .filter(|(_, file)| beside(file))
        .collect();
    for figure in figures(&curves) {
        let path = args.directory.join(format!("{}.svg", figure.name));
        file::replace(&path, chart::file(&figure.svg).as_bytes())?;
    }
    file::replace(&args.directory.join("report.md"), markdown(results, &curves, &images).as_bytes())?;
    let path = args.directory.join("report.html");
    file::replace(&path, page(results, &curves, pictures.as_ref()).as_bytes())?;
    for sentence in sentences(&curves) {
        println!("{sentence}");
    }
    log.info(format_args!("{}", path.display()));
    Ok(0)
}
