//! `hrr predict`: how long a render to an error will take.

use crate::args::{EXIT_CODES, message_args, verbosity};
use crate::cost::{observed, runs_arg, seconds_arg};
use crate::log::{Log, Verbosity, duration, percent};
use crate::scene_args::{self, SceneArgs};
use clap::ArgMatches;
use hrr::integrator::{Recipe, Size};
use hrr::report::curve::curves;
use hrr::report::results::Results;
use hrr::report::study::{self, Contender};
use hrr::settings::Settings;
use hrr::{Error, Result};

/// The arguments of `hrr predict`.
#[derive(Debug)]
pub struct PredictArgs {
    scene: SceneArgs,
    runs: usize,
    seconds: f64,
    /// How much is said.
    pub verbosity: Verbosity,
}

const EXAMPLES: &str = "\
Example:
  hrr predict scene.toml --error 0.01
      how long 'hrr render scene.toml --error 0.01' will take, from half a minute of short renders

The longest of the short renders is held out: it must lie where the others predict it, or nothing is promised and the exit
code is 1. So it is when rare bright samples make the noise.";

impl PredictArgs {
    pub fn new(m: &ArgMatches) -> Self {
        Self {
            scene: SceneArgs::new(m),
            runs: m.get_one::<u32>("runs").copied().unwrap_or(16) as usize,
            seconds: m.get_one::<f64>("seconds").copied().unwrap_or(30.0),
            verbosity: verbosity(m),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    clap::Command::new("predict")
        .about("Predict how long a render to an error will take")
        .after_help("'hrr predict --help' tells more.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .arg(scene_args::scene())
        .arg(runs_arg())
        .arg(seconds_arg("Seconds for the short renders and for what they are compared with [default: 30]"))
        .arg(scene_args::size("Output"))
        .args(scene_args::changes(|s| !["time", "iterations", "first_iteration"].contains(&s.name)))
        .args(message_args())
}

/// Does it; returns the exit code.
pub fn run(args: &PredictArgs, log: &Log) -> Result<u8> {
    args.scene.check()?;
    let (scene, mut settings) = args.scene.load(|warning| log.warning(warning))?;
    let target = settings.error.ok_or_else(|| Error::Usage("--error: to which error?".into()))?;
    let size = Size::of(&settings, &scene.film);
    (settings.samples, settings.light_subpaths) = (size.samples, size.light_subpaths);
    settings.integrator = hrr::render::chosen(&scene, &settings)?;
    let name = settings.integrator.name();
    if Recipe::of(settings.integrator).is_some_and(|r| r.merges()) {
        return Err(Error::Usage(format!(
            "{name} blurs, and its error is not that of noise: nothing can be predicted; name an integrator that does not merge"
        )));
    }
    let contenders = [Contender { name: name.into(), settings: settings.clone(), biased: false }];
    let (study, tail) = observed(log, settings.threads, args.seconds, |tell| {
        let study = study::run(&scene, &contenders, args.runs, args.seconds, None, 0.0, tell)?;
        let iterations = study.longest[0].max(16);
        let probe = Settings { time: None, error: None, iterations, ..settings.clone() };
        let tail = hrr::render::render(&scene, &probe, &hrr::render::Silent)?.noise.error();
        Ok((study, tail))
    })?;
    let curves = curves(&Results { about: Vec::new(), rows: study.rows });
    let Some((curve, p)) = curves.first().and_then(|c| Some((c, c.prediction.as_ref()?))) else {
        return Err(Error::Usage("too few iterations fit --seconds to predict from".into()));
    };
    let last = &curve.rungs[curve.rungs.len() - 1];
    println!(
        "held out: {} iterations have the error {}, predicted {} ({} to {})",
        last.iterations,
        percent(p.measured),
        percent(p.error.value),
        percent(p.error.low),
        percent(p.error.high)
    );
    let unit = curve.unit;
    let to = |value: f64| duration(value / (target * target));
    println!(
        "{name}: an error of {} takes {} ({} to {} with 90 % confidence)",
        percent(target),
        to(unit.value),
        to(unit.low),
        to(unit.high)
    );
    let mut sure = true;
    if !p.error.holds(p.measured) {
        log.warning("no promise: the longest of the short renders does not lie where the others predict it");
        sure = false;
    }
    if let Some(e) = tail.filter(|e| !e.is_sure()) {
        log.warning(format_args!(
            "no promise: rare bright samples make the noise (Hill index {:.1})",
            e.hill
        ));
        sure = false;
    }
    Ok(u8::from(!sure))
}
