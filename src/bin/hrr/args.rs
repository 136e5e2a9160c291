//! The command line: one sub-command a file, and what they share.

use crate::log::Verbosity;
use crate::render::RenderArgs;
use crate::{backends, compare, cost, effects, predict, reference, render};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches};
use std::ffi::OsString;
use std::io::Write;

/// What the user wants done.
#[derive(Debug)]
pub enum Command {
    /// `hrr render`.
    Render(RenderArgs),
    /// `hrr effects`.
    Effects(effects::EffectsArgs),
    /// `hrr compare`.
    Compare(compare::CompareArgs),
    /// `hrr reference`.
    Reference(reference::ReferenceArgs),
    /// `hrr backends`.
    Backends(backends::BackendsArgs),
    /// `hrr cost`.
    Cost(cost::CostArgs),
    /// `hrr predict`.
    Predict(predict::PredictArgs),
}

const MESSAGES: &str = "Messages";

/// What programs that call hrr may rely on.
pub const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  a comparison failed, or a target was missed
    2  the command line is wrong
    3  the scene or another input is missing or broken
    4  an output cannot be written
    5  the scene asks for what hrr does not support
    6  not enough memory
   70  a fault of hrr itself
  130  stopped by Ctrl-C; the image so far was written";

/// Reads the command line. Help and version are `Err`s too: [`explain`] prints them.
pub fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Command, clap::Error> {
    let matches = command().try_get_matches_from(args)?;
    match matches.subcommand() {
        Some(("render", matches)) => Ok(Command::Render(RenderArgs::new(matches))),
        Some(("effects", matches)) => Ok(Command::Effects(effects::EffectsArgs::new(matches))),
        Some(("compare", matches)) => Ok(Command::Compare(compare::CompareArgs::new(matches))),
        Some(("reference", matches)) => Ok(Command::Reference(reference::ReferenceArgs::new(matches))),
        Some(("backends", matches)) => Ok(Command::Backends(backends::BackendsArgs::new(matches))),
        Some(("cost", matches)) => Ok(Command::Cost(cost::CostArgs::new(matches))),
        Some(("predict", matches)) => Ok(Command::Predict(predict::PredictArgs::new(matches))),
        // clap knows no other sub-commands, and wants one.
        _ => Err(command().error(ErrorKind::MissingSubcommand, "say what to do, such as 'hrr render'")),
    }
}

/// Prints what clap has to say; returns the exit code.
pub fn explain(error: &clap::Error) -> u8 {
    if error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let text = error.render().to_string();
        let text = text.strip_prefix("error: ").unwrap_or(&text);
        let _ = write!(std::io::stderr().lock(), "hrr: {text}");
    } else {
        // A closed pipe is no reason to complain.
        let _ = error.print();
    }
    u8::try_from(error.exit_code()).unwrap_or(2)
}

/// How much is said: `--quiet`, `--verbose`.
pub fn verbosity(m: &ArgMatches) -> Verbosity {
    match (m.get_flag("quiet"), m.get_flag("verbose")) {
        (true, _) => Verbosity::Quiet,
        (false, false) => Verbosity::Normal,
        (false, true) => Verbosity::Verbose,
    }
}

/// The flags for [`verbosity`].
pub fn message_args() -> [Arg; 2] {
    [
        Arg::new("quiet")
            .short('q')
            .long("quiet")
            .help_heading(MESSAGES)
            .action(ArgAction::SetTrue)
            .conflicts_with("verbose")
            .help("Print errors only"),
        Arg::new("verbose")
            .short('v')
            .long("verbose")
            .help_heading(MESSAGES)
            .action(ArgAction::SetTrue)
            .help("Print settings, times and counts as well"),
    ]
}

/// `--exposure`, for `what`.
pub fn exposure_arg(heading: &'static str, what: &str) -> Arg {
    Arg::new("exposure")
        .long("exposure")
        .value_name("STOPS")
        .help_heading(heading)
        .allow_negative_numbers(true)
        .value_parser(parse_exposure)
        .help(format!("{what} [default: 0]"))
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    let in_range = |x: &f32| (-100.0..=100.0).contains(x);
    text.parse()
        .ok()
        .filter(in_range)
        .ok_or_else(|| "an exposure is a number of stops from -100 to 100".to_owned())
}

fn command() -> clap::Command {
    clap::Command::new("hrr")
        .about("Renders caustics in extremely glossy mirrors, without bias")
        .version(env!("CARGO_PKG_VERSION"))
        .long_version(concat!(env!("CARGO_PKG_VERSION"), "\n").to_owned() + &features())
        .subcommand_required(true)
        .arg_required_else_help(true)
        .disable_help_subcommand(true)
        .after_help("'hrr render --help' explains a command.")
        .subcommands([
            render::command(),
            effects::command(),
            compare::command(),
            reference::command(),
            backends::command(),
            predict::command(),
            cost::command(),
        ])
}

/// What this build was made with.
fn features() -> String {
    let rays = if cfg!(feature = "embree") { "Embree, obvhs" } else { "obvhs" };
    let images = if cfg!(feature = "oiio") { "OpenImageIO" } else { "EXR, PNG" };
    format!("rays: {rays}; images: {images}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn parsed(line: &str) -> Result<RenderArgs, clap::Error> {
        match parse(line.split_whitespace().map(OsString::from))? {
            Command::Render(args) => Ok(args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_command_is_sound() {
        command().debug_assert();
    }

    #[test]
    fn everything_arrives() {
        let line = "hrr render s.toml -o a.exr -o b.png --stats s.json --size 32x16 --exposure -1.5 \
                    --max-depth 3 --hrr_alpha 0.5 -D camera.fov_y=30 -D a.b=c=d -v";
        let args = parsed(line).unwrap();
        assert_eq!(args.scene.scene, PathBuf::from("s.toml"));
        assert_eq!(args.outputs, [PathBuf::from("a.exr"), PathBuf::from("b.png")]);
        assert_eq!(args.stats, Some(PathBuf::from("s.json")));
        assert_eq!((args.exposure, args.verbosity), (-1.5, Verbosity::Verbose));
        let overrides: Vec<_> = args.scene.overrides.iter().map(|(k, v)| format!("{k} {v}")).collect();
        assert_eq!(overrides, ["camera.fov_y 30", "a.b c=d", "film.width 32", "film.height 16"]);
        let settings: Vec<_> = args.scene.settings.iter().map(|(s, v)| format!("{} {v}", s.name)).collect();
        assert_eq!(settings, ["max_depth 3", "hrr_alpha 0.5"]);
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for flags in [
            "",
            "-o a.exr -q -v",
            "-o a.exr --size 0x10",
            "-o a.exr --size 10",
            "-o a.exr --size 10x10x10",
            "-o a.exr --size 65537x1",
            "-o a.exr --exposure bright",
            "-o a.exr --exposure nan",
            "-o a.exr -D camera.fov_y",
            "-o a.exr -D =3",
            "-o a.exr --iterations 3 --time 2",
            "-o a.exr --samples -1",
            "-o a.exr extra",
        ] {
            let error = parsed(&format!("hrr render s.toml {flags}")).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{flags}");
        }
    }
}
