//! `hrr compare`: how far an image is from another.

use crate::args::{EXIT_CODES, exposure_arg};
use clap::builder::ValueHint;
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use hrr::image;
use hrr::report::metric::{self, Metrics, NAMES};
use hrr::settings::nearest;
use hrr::{Error, Result};
use std::fmt::Write;
use std::path::PathBuf;

/// The arguments of `hrr compare`.
#[derive(Debug)]
pub struct CompareArgs {
    image: PathBuf,
    reference: PathBuf,
    /// Variances of the image's and the reference's pixels.
    variances: Option<(PathBuf, PathBuf)>,
    /// Metrics and what they may be at most.
    limits: Vec<(&'static str, f64)>,
    json: bool,
    exposure: f32,
}

const EXAMPLES: &str = "\
Examples:
  hrr compare a.exr reference.exr
      all metrics of a.exr
  hrr compare a.exr reference.exr --max flip=0.05 --max relmse_trim01=1e-3
      exit code 1 if one of them is larger
  hrr compare a.exr mean.exr --variance a_variance.exr --reference-variance variance.exr --max tile_z=5
      a test: is the difference more than noise?

Metrics, all 0 for equal images:
  error          what 'hrr render --error' estimates: without the worst thousandth of the pixels, the root of the mean
                 of d^2 / (t^2 + eps^2), t the mean luminance of the 16 x 16 pixels around, eps a hundredth of the image's
  mse            mean square difference
  relmse         mean of (a - r)^2 / (r^2 + eps^2), eps a hundredth of the reference's mean luminance
  relmse_trim01  the same without the worst thousandth of the pixels
  relmse_trim1   the same without the worst hundredth
  median_nrmse   root of the median pixel's relative square difference
  smape          mean of |a - r| / (|a| + |r|), from 0 to 1
  flip           LDR-FLIP, from 0 to 1: what a person sees who flips between the images, 67 pixels a degree
  tile_z         with variances: largest deviation of a 16 x 16 tile's mean, in standard deviations
  pixels_2sigma  with variances: share of pixels that deviate by more than two; by chance 0.0455
Tiles add up their pixels' variances. Where pixels share light subpaths (all integrators but pt) their errors are not
independent, and tile_z is larger by chance than for independent ones.";

impl CompareArgs {
    pub fn new(m: &ArgMatches) -> Self {
        let path = |name: &str| m.get_one::<PathBuf>(name).cloned();
        Self {
            image: path("image").unwrap_or_default(),
            reference: path("reference").unwrap_or_default(),
            variances: path("variance").zip(path("reference-variance")),
            limits: m.get_many::<(&'static str, f64)>("max").into_iter().flatten().copied().collect(),
            json: m.get_one::<String>("format").is_some_and(|f| f == "json"),
            exposure: m.get_one::<f32>("exposure").copied().unwrap_or(0.0),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    let file = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name)
            .value_name(value)
            .value_parser(value_parser!(PathBuf))
            .value_hint(ValueHint::FilePath)
            .help(help)
    };
    clap::Command::new("compare")
        .about("Tell how far an image is from another")
        .after_help("'hrr compare --help' tells more, with examples.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .arg(file("image", "A", "The image").required(true))
        .arg(file("reference", "B", "What it is compared with").required(true))
        .arg(
            file("variance", "FILE", "Variance of each pixel of A")
                .long("variance")
                .requires("reference-variance"),
        )
        .arg(
            file("reference-variance", "FILE", "Variance of each pixel of B")
                .long("reference-variance")
                .requires("variance"),
        )
        .arg(
            Arg::new("max")
                .long("max")
                .value_name("METRIC=VALUE")
                .action(ArgAction::Append)
                .value_parser(parse_limit)
                .help("Exit with 1 if the metric is larger; may be repeated"),
        )
        .arg(
            Arg::new("format")
                .long("format")
                .value_name("FORMAT")
                .value_parser(["text", "json"])
                .help("How the metrics are printed [default: text]"),
        )
        .arg(exposure_arg("Options", "Stops by which FLIP sees both images brighter"))
}

/// Does it; returns the exit code.
pub fn run(args: &CompareArgs) -> Result<u8> {
    if args.variances.is_none()
        && let Some((name, _)) = args.limits.iter().find(|(name, _)| NAMES[8..].contains(name))
    {
        return Err(Error::Usage(format!("--max {name}: needs --variance and --reference-variance")));
    }
    let (a, b) = (image::read(&args.image)?, image::read(&args.reference)?);
    let variances = match &args.variances {
        Some((a, b)) => Some((image::read(a)?, image::read(b)?)),
        None => None,
    };
    let metrics = metric::compare(&a, &b, variances.as_ref().map(|(a, b)| (a, b)), args.exposure)?;
    let over: Vec<&(&str, f64)> =
        args.limits.iter().filter(|(name, limit)| !metrics.get(name).is_some_and(|v| v <= *limit)).collect();
    let failed = !over.is_empty() || (metrics.nonfinite > 0 && !args.limits.is_empty());
    let text = if args.json { json(&metrics, &over, failed)? } else { text(&metrics, &args.limits) };
    // A closed pipe is no reason to complain.
    let _ = std::io::Write::write_all(&mut std::io::stdout().lock(), text.as_bytes());
    Ok(u8::from(failed))
}

fn text(metrics: &Metrics, limits: &[(&str, f64)]) -> String {
    let mut text = String::new();
    for name in NAMES {
        let Some(value) = metrics.get(name) else { continue };
        let _ = write!(text, "{name:<14} {value:.6e}");
        for (_, limit) in limits.iter().filter(|(n, _)| *n == name) {
            let _ = write!(text, "  {} {limit:e}", if value <= *limit { "<=" } else { "OVER" });
        }
        text.push('\n');
    }
    if let Some(d) = &metrics.deviation {
        let [x, y] = d.tile_at;
        let _ = writeln!(text, "the worst tile is at {x},{y}; by chance p = {:.2e}", d.tile_p);
    }
    if metrics.nonfinite > 0 {
        let _ = writeln!(text, "{} pixels are not finite and were left out", metrics.nonfinite);
    }
    text
}

fn json(metrics: &Metrics, over: &[&(&str, f64)], failed: bool) -> Result<String> {
    let internal = |e: serde_json::Error| Error::Internal(format!("writing JSON: {e}"));
    let mut value = serde_json::to_value(metrics).map_err(internal)?;
    value["over"] = over.iter().map(|(name, _)| *name).collect();
    value["failed"] = failed.into();
    Ok(serde_json::to_string_pretty(&value).map_err(internal)? + "\n")
}

fn parse_limit(text: &str) -> std::result::Result<(&'static str, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write METRIC=VALUE, such as flip=0.05")?;
    let known = NAMES.iter().find(|n| **n == name.trim()).ok_or_else(|| match nearest(name, NAMES) {
        Some(near) => format!("there is no metric '{name}'; did you mean '{near}'?"),
        None => format!("there is no metric '{name}'; there are {}", NAMES.join(", ")),
    })?;
    let value = value.trim().parse().ok().filter(|v: &f64| *v >= 0.0);
    Ok((known, value.ok_or_else(|| format!("{name}: the limit is a number, at least 0"))?))
}
