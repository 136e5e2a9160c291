//! The flags of every sub-command that renders: the scene, what is changed in it, and all settings.

use clap::builder::ValueHint;
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use hrr::error::Place;
use hrr::scene::Scene;
use hrr::settings::{Kind, Setting, SettingError, Settings, TABLE};
use hrr::{Error, Result};
use std::path::PathBuf;

/// Largest side of an image, pixels; the scene file's own limit.
const LARGEST_SIDE: u32 = 65536;
const SCENE: &str = "Scene";

/// A scene and what is changed in it.
#[derive(Debug)]
pub struct SceneArgs {
    /// The `.toml` or `.obj` file.
    pub scene: PathBuf,
    /// Keys of the scene file that are overridden.
    pub overrides: Vec<(String, String)>,
    /// Settings that were given, in the table's order; their values are in range.
    pub settings: Vec<(&'static Setting, String)>,
}

impl SceneArgs {
    pub fn new(m: &ArgMatches) -> Self {
        let size = m.try_get_one::<(u32, u32)>("size").ok().flatten();
        let size = size.iter().flat_map(|(w, h)| {
            [("film.width".to_owned(), w.to_string()), ("film.height".to_owned(), h.to_string())]
        });
        let given = m.get_many::<(String, String)>("define").into_iter().flatten().cloned();
        let given_setting =
            |s: &'static Setting| Some((s, m.try_get_one::<String>(s.name).ok().flatten()?.clone()));
        Self {
            // clap has seen to it that there is one.
            scene: m.get_one::<PathBuf>("scene").cloned().unwrap_or_default(),
            overrides: given.chain(size).collect(),
            settings: TABLE.iter().filter_map(given_setting).collect(),
        }
    }

    /// Refuses settings before any work is done.
    pub fn check(&self) -> Result<()> {
        self.apply(&mut Settings::default())
    }

    /// Reads the scene; the settings are the flags', else the file's, else the defaults.
    pub fn load(&self, warn: impl Fn(&str)) -> Result<(Scene, Settings)> {
        let scene = Scene::load(&self.scene, &self.overrides)?;
        scene.warnings.iter().for_each(|w| warn(w));
        let mut settings = scene.settings.clone();
        self.apply(&mut settings)?;
        Ok((scene, settings))
    }

    /// Gives the settings the values of the flags.
    fn apply(&self, settings: &mut Settings) -> Result<()> {
        for (setting, value) in &self.settings {
            let flag = format!("--{}", setting.name.replace('_', "-"));
            setting.set(settings, value).map_err(|e| match e {
                SettingError::Invalid(message) => Error::Usage(format!("{flag}: {message}")),
                SettingError::NotYet(message) => Error::Unsupported { place: Place::file(flag), message },
            })?;
        }
        Ok(())
    }
}

/// The scene file.
pub fn scene() -> Arg {
    Arg::new("scene")
        .value_name("SCENE")
        .required(true)
        .value_parser(value_parser!(PathBuf))
        .value_hint(ValueHint::FilePath)
        .help("Scene file: .toml, or a bare .obj")
}

/// `--size`.
pub fn size(heading: &'static str) -> Arg {
    Arg::new("size")
        .long("size")
        .value_name("WxH")
        .help_heading(heading)
        .value_parser(parse_size)
        .help("Size of the image, pixels [default: the scene's]")
}

/// `-D`, and one flag for each setting that `wanted` takes.
pub fn changes(wanted: impl Fn(&Setting) -> bool) -> Vec<Arg> {
    let define = Arg::new("define")
        .short('D')
        .long("define")
        .value_name("KEY=VALUE")
        .help_heading(SCENE)
        .action(ArgAction::Append)
        .value_parser(parse_define)
        .help("Override a key of the scene file, such as camera.fov_y=30; may be repeated");
    let iterations = TABLE.iter().any(|s| s.name == "iterations" && wanted(s));
    let settings = TABLE.iter().filter(|s| wanted(s)).map(|setting| {
        let arg = setting_arg(setting);
        let instead = iterations && ["time", "error"].contains(&setting.name);
        if instead { arg.conflicts_with("iterations") } else { arg }
    });
    std::iter::once(define).chain(settings).collect()
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
    Arg::new(setting.name)
        .long(setting.name.replace('_', "-"))
        .alias(setting.name)
        .value_name(setting.value_name)
        .help_heading(setting.heading)
        // A negative number is out of range, which is better said by the setting itself.
        .allow_negative_numbers(true)
        .value_parser(move |text: &str| check(setting, text))
        .long_help(format!("{help}{doc}"))
        .help(help)
}

/// Passes on what the setting takes. A name that is not available yet is left to be refused with its own exit code.
fn check(setting: &Setting, text: &str) -> std::result::Result<String, SettingError> {
    match setting.set(&mut Settings::default(), text) {
        Ok(()) | Err(SettingError::NotYet(_)) => Ok(text.to_owned()),
        Err(e) => Err(e),
    }
}

fn parse_size(text: &str) -> std::result::Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|n| (1..=LARGEST_SIDE).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((side(w)?, side(h)?)))
        .ok_or_else(|| format!("a size is WIDTHxHEIGHT, such as 640x480, each from 1 to {LARGEST_SIDE}"))
}

fn parse_define(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("write KEY=VALUE, such as camera.fov_y=30".to_owned()),
    }
}
