//! The command line. The flags of a render come from the settings table, so that none can be forgotten.

use crate::log::Verbosity;
use clap::builder::ValueHint;
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use hrr::settings::{Effect, Kind, Setting, SettingError, Settings, TABLE};
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

/// What the user wants done.
#[derive(Debug)]
pub enum Command {
    /// `hrr render`.
    Render(RenderArgs),
    /// `hrr effects`.
    Effects(EffectsArgs),
}

/// How `hrr effects` speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// For people.
    Table,
    /// For programs.
    Json,
}

/// The arguments of `hrr effects`.
#[derive(Debug)]
pub struct EffectsArgs {
    /// The `.toml` or `.obj` file.
    pub scene: PathBuf,
    /// The one effect whose evidence is wanted.
    pub why: Option<Effect>,
    /// Table or JSON.
    pub format: Format,
    /// Keys of the scene file that are overridden.
    pub overrides: Vec<(String, String)>,
    /// Settings that were given.
    pub settings: Vec<(&'static Setting, String)>,
    /// How much is said.
    pub verbosity: Verbosity,
}

/// The arguments of `hrr render`.
#[derive(Debug)]
pub struct RenderArgs {
    /// The `.toml` or `.obj` file.
    pub scene: PathBuf,
    /// Where the image goes; at least one file.
    pub outputs: Vec<PathBuf>,
    /// Where the statistics go; `-` is stdout.
    pub stats: Option<PathBuf>,
    /// Stops by which PNG files are brighter.
    pub exposure: f32,
    /// Keys of the scene file that are overridden.
    pub overrides: Vec<(String, String)>,
    /// Settings that were given, in the table's order; their values are in range.
    pub settings: Vec<(&'static Setting, String)>,
    /// How much is said.
    pub verbosity: Verbosity,
}

/// Largest side of an image, pixels; the scene file's own limit.
const LARGEST_SIDE: u32 = 65536;
const OUTPUT: &str = "Output";
const SCENE: &str = "Scene";
const MESSAGES: &str = "Messages";

const EXAMPLES: &str = "\
Examples:
  hrr render scene.toml -o out.exr
      the scene as its file says
  hrr render scene.toml -o out.exr -o out.png --exposure 1 --time 30
      30 seconds of rendering; an EXR file, and a PNG file one stop brighter
  hrr render model.obj -o quick.png --size 320x240 --iterations 4
      a first look at a bare OBJ file
  hrr render scene.toml -o a.exr -D camera.fov_y=30 -D material.mirror.alpha=\"[1e-3, 1e-3]\"
      with two keys of the scene file changed

What is given here wins over the scene file, which wins over the defaults.
Ctrl-C finishes the iteration and writes the image; a second one stops at once.";

const EXIT_CODES: &str = "\
Exit codes:
    0  done
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
        Some(("effects", matches)) => Ok(Command::Effects(EffectsArgs::new(matches))),
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

impl RenderArgs {
    fn new(m: &ArgMatches) -> Self {
        let size = m.get_one::<(u32, u32)>("size");
        let size = size.iter().flat_map(|(w, h)| {
            [("film.width".to_owned(), w.to_string()), ("film.height".to_owned(), h.to_string())]
        });
        Self {
            // clap has seen to it that there is one.
            scene: m.get_one::<PathBuf>("scene").cloned().unwrap_or_default(),
            outputs: m.get_many::<PathBuf>("output").into_iter().flatten().cloned().collect(),
            stats: m.get_one::<PathBuf>("stats").cloned(),
            exposure: m.get_one::<f32>("exposure").copied().unwrap_or(0.0),
            overrides: overrides(m).chain(size).collect(),
            settings: settings(m),
            verbosity: verbosity(m),
        }
    }
}

impl EffectsArgs {
    fn new(m: &ArgMatches) -> Self {
        let json = m.get_one::<String>("format").is_some_and(|format| format == "json");
        Self {
            scene: m.get_one::<PathBuf>("scene").cloned().unwrap_or_default(),
            why: m.get_one::<Effect>("why").copied(),
            format: if json { Format::Json } else { Format::Table },
            overrides: overrides(m).collect(),
            settings: settings(m),
            verbosity: verbosity(m),
        }
    }
}

fn overrides(m: &ArgMatches) -> impl Iterator<Item = (String, String)> {
    m.get_many::<(String, String)>("define").into_iter().flatten().cloned()
}

fn settings(m: &ArgMatches) -> Vec<(&'static Setting, String)> {
    TABLE.iter().filter_map(|s| Some((s, m.get_one::<String>(s.name)?.clone()))).collect()
}

fn verbosity(m: &ArgMatches) -> Verbosity {
    match (m.get_flag("quiet"), m.get_flag("verbose")) {
        (true, _) => Verbosity::Quiet,
        (false, false) => Verbosity::Normal,
        (false, true) => Verbosity::Verbose,
    }
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
        .subcommand(render())
        .subcommand(effects())
}

/// What this build was made with.
fn features() -> String {
    let rays = if cfg!(feature = "embree") { "Embree, obvhs" } else { "obvhs" };
    let images = if cfg!(feature = "oiio") { "OpenImageIO" } else { "EXR, PNG" };
    format!("rays: {rays}; images: {images}")
}

fn render() -> clap::Command {
    clap::Command::new("render")
        .about("Render a scene to an image")
        .after_help("'hrr render --help' tells more, with examples.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .next_line_help(false)
        .arg(scene_arg())
        .args(output_args())
        .args(common_args())
}

fn effects() -> clap::Command {
    clap::Command::new("effects")
        .about("Say what a scene calls for, why, and what that switches on")
        .after_help("'hrr effects --help' tells more.")
        .after_long_help(EXIT_CODES)
        .arg_required_else_help(true)
        .next_line_help(false)
        .arg(scene_arg())
        .arg(
            Arg::new("why")
                .long("why")
                .value_name("EFFECT")
                .help_heading(OUTPUT)
                .value_parser(|text: &str| text.parse::<Effect>())
                .help("Show the evidence for one verdict: materials, triangles, bounds of textures, paths"),
        )
        .arg(
            Arg::new("format")
                .long("format")
                .value_name("FORMAT")
                .help_heading(OUTPUT)
                .value_parser(["table", "json"])
                .help("How it is said [default: table]"),
        )
        .args(common_args())
}

fn scene_arg() -> Arg {
    Arg::new("scene")
        .value_name("SCENE")
        .required(true)
        .value_parser(value_parser!(PathBuf))
        .value_hint(ValueHint::FilePath)
        .help("Scene file: .toml, or a bare .obj")
}

/// What all commands that read a scene have in common.
fn common_args() -> Vec<Arg> {
    let define = Arg::new("define")
        .short('D')
        .long("define")
        .value_name("KEY=VALUE")
        .help_heading(SCENE)
        .action(ArgAction::Append)
        .value_parser(parse_define)
        .help("Override a key of the scene file, such as camera.fov_y=30; may be repeated");
    let quiet = Arg::new("quiet")
        .short('q')
        .long("quiet")
        .help_heading(MESSAGES)
        .action(ArgAction::SetTrue)
        .conflicts_with("verbose")
        .help("Print errors only");
    let verbose = Arg::new("verbose")
        .short('v')
        .long("verbose")
        .help_heading(MESSAGES)
        .action(ArgAction::SetTrue)
        .help("Print settings, times and counts as well");
    [define].into_iter().chain(TABLE.iter().map(setting_arg)).chain([quiet, verbose]).collect()
}

fn output_args() -> [Arg; 4] {
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
        Arg::new("stats")
            .long("stats")
            .value_name("FILE")
            .help_heading(OUTPUT)
            .value_parser(value_parser!(PathBuf))
            .value_hint(ValueHint::FilePath)
            .help("Where times and counts go, as JSON; '-' is stdout"),
        Arg::new("size")
            .long("size")
            .value_name("WxH")
            .help_heading(OUTPUT)
            .value_parser(parse_size)
            .help("Size of the image, pixels [default: the scene's]"),
        Arg::new("exposure")
            .long("exposure")
            .value_name("STOPS")
            .help_heading(OUTPUT)
            .allow_negative_numbers(true)
            .value_parser(parse_exposure)
            .help("Makes PNG files brighter, or darker when negative [default: 0]"),
    ]
}

fn setting_arg(setting: &'static Setting) -> Arg {
    let values = match setting.kind {
        Kind::Choice { names, .. } => format!(": {}", names.join(", ")),
        _ => String::new(),
    };
    let default = match setting.default {
        "" => String::new(),
        default => format!(" [default: {default}]"),
    };
    let help = format!("{}{values}{default}", setting.help);
    let doc = match setting.doc {
        "" => String::new(),
        doc => format!("\n{doc}"),
    };
    let arg = Arg::new(setting.name)
        .long(setting.name.replace('_', "-"))
        .alias(setting.name)
        .value_name(setting.value_name)
        .help_heading(setting.heading)
        // A negative number is out of range, which is better said by the setting itself.
        .allow_negative_numbers(true)
        .value_parser(move |text: &str| check(setting, text))
        .long_help(format!("{help}{doc}"))
        .help(help);
    if setting.name == "time" { arg.conflicts_with("iterations") } else { arg }
}

/// Passes on what the setting takes. A name that is not available yet is left to be refused with its own exit code.
fn check(setting: &Setting, text: &str) -> Result<String, SettingError> {
    match setting.set(&mut Settings::default(), text) {
        Ok(()) | Err(SettingError::NotYet(_)) => Ok(text.to_owned()),
        Err(e) => Err(e),
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|n| (1..=LARGEST_SIDE).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((side(w)?, side(h)?)))
        .ok_or_else(|| format!("a size is WIDTHxHEIGHT, such as 640x480, each from 1 to {LARGEST_SIDE}"))
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    let in_range = |x: &f32| (-100.0..=100.0).contains(x);
    text.parse()
        .ok()
        .filter(in_range)
        .ok_or_else(|| "an exposure is a number of stops from -100 to 100".to_owned())
}

fn parse_define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("write KEY=VALUE, such as camera.fov_y=30".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<RenderArgs, clap::Error> {
        match parse(line.split_whitespace().map(OsString::from))? {
            Command::Render(args) => Ok(args),
            Command::Effects(args) => panic!("{args:?}"),
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
        assert_eq!(args.scene, PathBuf::from("s.toml"));
        assert_eq!(args.outputs, [PathBuf::from("a.exr"), PathBuf::from("b.png")]);
        assert_eq!(args.stats, Some(PathBuf::from("s.json")));
        assert_eq!((args.exposure, args.verbosity), (-1.5, Verbosity::Verbose));
        let overrides: Vec<_> = args.overrides.iter().map(|(k, v)| format!("{k} {v}")).collect();
        assert_eq!(overrides, ["camera.fov_y 30", "a.b c=d", "film.width 32", "film.height 16"]);
        let settings: Vec<_> = args.settings.iter().map(|(s, v)| format!("{} {v}", s.name)).collect();
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
