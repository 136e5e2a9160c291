//! The settings of a render as one table: name, kind, default, doc. The `[render]` section of scene files, the flags
//! of the program and the setters of the C interface are all fed from [`TABLE`].

use crate::error::{Error, Place};
use std::fmt;
use std::str::FromStr;

/// How light is transported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Integrator {
    /// Chosen from what the scene contains.
    Auto,
    /// Path tracing with next-event estimation.
    Pt,
    /// Light tracing.
    Lt,
    /// Bidirectional path tracing, one light subpath for each eye subpath.
    Bpt,
    /// Connections to uniform picks from the light-vertex cache.
    Lvc,
    /// As `Lvc`, with hierarchical Russian roulette at glossy eye vertices.
    LvcHrr,
}

impl Integrator {
    /// Every integrator, in the order of [`Integrator::NAMES`].
    pub const ALL: [Self; 6] = [Self::Auto, Self::Pt, Self::Lt, Self::Bpt, Self::Lvc, Self::LvcHrr];
    /// The names in scene files and flags.
    pub const NAMES: [&'static str; 6] = ["auto", "pt", "lt", "bpt", "lvc", "lvc+hrr"];
    /// Names that are reserved for integrators to come.
    pub const PLANNED: [&'static str; 7] =
        ["bpt+hrr", "pcbpt", "pcbpt+hrr", "vcm", "vcm+hrr", "pcvcm", "pcvcm+hrr"];

    /// The name in scene files and flags.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// What answers ray queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Backend {
    /// Intel Embree.
    Embree,
    /// obvhs, pure Rust.
    Obvhs,
    /// Every triangle; for tests.
    Brute,
}

impl Backend {
    /// Every backend, in the order of [`Backend::NAMES`].
    pub const ALL: [Self; 3] = [Self::Embree, Self::Obvhs, Self::Brute];
    /// The names in scene files and flags.
    pub const NAMES: [&'static str; 3] = ["embree", "obvhs", "brute"];
    /// The fastest backend of this build.
    pub const BEST: Self = if cfg!(feature = "embree") { Self::Embree } else { Self::Obvhs };

    /// The name in scene files and flags.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// Everything a render can be told; [`TABLE`] gives each field's range and meaning in full.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Transport algorithm.
    pub integrator: Integrator,
    /// Longest path, in segments: 1 = emitters seen directly, 2 = direct light.
    pub max_depth: u32,
    /// Ray query backend.
    pub visibility: Backend,
    /// Iterations to run (each `samples` eye samples per pixel).
    pub iterations: u64,
    /// First iteration's number, so that a render can be split and added up.
    pub first_iteration: u64,
    /// Seconds of rendering instead of a number of iterations.
    pub time: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Threads; 0 = all.
    pub threads: usize,
    /// Eye samples per pixel and iteration.
    pub samples: u32,
    /// Light subpaths per iteration; 0 = as many as pixels.
    pub light_subpaths: u64,
    /// Connections that the uniform picks (`lvc`) try at each eye vertex.
    pub connections: u32,
    /// Expected number of light vertices that the roulette keeps where its probabilities stay below 1 (k).
    pub expected: f64,
    /// Largest GGX roughness at which the roulette is used.
    pub hrr_alpha: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Auto,
            max_depth: 24,
            visibility: Backend::BEST,
            iterations: 64,
            first_iteration: 0,
            time: None,
            seed: 0,
            threads: 0,
            samples: 1,
            light_subpaths: 0,
            connections: 1,
            expected: 1.0,
            hrr_alpha: 0.3,
        }
    }
}

/// What values a setting takes, with the way to it in [`Settings`]. All bounds are inclusive.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// A whole number.
    Integer {
        /// Least value.
        min: u64,
        /// Greatest value; at most 2^63 - 1, TOML's limit.
        max: u64,
        /// Reads the field.
        get: fn(&Settings) -> u64,
        /// Writes the field; the value is in range.
        set: fn(&mut Settings, u64),
    },
    /// A finite number.
    Real {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
        /// Reads the field; `None` when it is not in force.
        get: fn(&Settings) -> Option<f64>,
        /// Writes the field; the value is in range.
        set: fn(&mut Settings, f64),
    },
    /// One of a few names.
    Choice {
        /// The names.
        names: &'static [&'static str],
        /// Names that are understood, but refused as not available yet.
        planned: &'static [&'static str],
        /// Index of the present name.
        get: fn(&Settings) -> usize,
        /// Takes the name of an index below `names.len()`.
        set: fn(&mut Settings, usize),
    },
}

/// One row of [`TABLE`].
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// Name, as in `[render]`; the flag has dashes for the underscores.
    pub name: &'static str,
    /// Type, range and access.
    pub kind: Kind,
    /// Default as text; empty when the setting is not in force by default.
    pub default: &'static str,
    /// What a value stands for, in a usage line.
    pub value_name: &'static str,
    /// The section of `--help` it stands in.
    pub heading: &'static str,
    /// One line.
    pub help: &'static str,
    /// What else there is to know; may be empty.
    pub doc: &'static str,
}

const TRANSPORT: &str = "Light transport";
const BUDGET: &str = "Budget and randomness";
const MACHINE: &str = "Machine";

/// All settings. Of `iterations` and `time`, the one that is set last is in force.
pub const TABLE: &[Setting] = &[
    Setting {
        name: "integrator",
        kind: Kind::Choice {
            names: &Integrator::NAMES,
            planned: &Integrator::PLANNED,
            get: |s| s.integrator as usize,
            set: |s, i| s.integrator = Integrator::ALL[i],
        },
        default: "auto",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "How light is transported",
        doc: "pt: path tracing with next-event estimation. lt: light tracing. bpt: bidirectional path tracing. \
              lvc: eye subpaths connected to uniform picks from a cache of light vertices. lvc+hrr: as lvc, with \
              hierarchical Russian roulette at glossy eye vertices. auto: chosen from what the scene contains.",
    },
    Setting {
        name: "max_depth",
        kind: Kind::Integer {
            min: 1,
            max: 65535,
            get: |s| s.max_depth.into(),
            set: |s, v| s.max_depth = v as u32,
        },
        default: "24",
        value_name: "N",
        heading: TRANSPORT,
        help: "Longest path, in segments",
        doc: "1: only emitters seen directly; 2: direct light as well; and so on.",
    },
    Setting {
        name: "samples",
        kind: Kind::Integer {
            min: 1,
            max: 65535,
            get: |s| s.samples.into(),
            set: |s, v| s.samples = v as u32,
        },
        default: "1",
        value_name: "N",
        heading: TRANSPORT,
        help: "Eye samples per pixel in each iteration",
        doc: "",
    },
    Setting {
        name: "light_subpaths",
        kind: Kind::Integer {
            min: 0,
            max: u32::MAX as u64,
            get: |s| s.light_subpaths,
            set: |s, v| s.light_subpaths = v,
        },
        default: "0",
        value_name: "N",
        heading: TRANSPORT,
        help: "Light subpaths in each iteration; 0: as many as pixels",
        doc: "",
    },
    Setting {
        name: "connections",
        kind: Kind::Integer {
            min: 1,
            max: 65535,
            get: |s| s.connections.into(),
            set: |s, v| s.connections = v as u32,
        },
        default: "1",
        value_name: "N",
        heading: TRANSPORT,
        help: "Connections that uniform picks (lvc) try at each eye vertex",
        doc: "",
    },
    Setting {
        name: "expected",
        kind: Kind::Real { min: 1e-6, max: 1e6, get: |s| Some(s.expected), set: |s, v| s.expected = v },
        default: "1.0",
        value_name: "K",
        heading: TRANSPORT,
        help: "Light vertices that the roulette (+hrr) keeps on average",
        doc: "The expected number of accepted light vertices at an eye vertex where no acceptance probability \
              reaches 1. More of them lower the noise of each iteration and make it slower.",
    },
    Setting {
        name: "hrr_alpha",
        kind: Kind::Real { min: 0.0, max: 1.0, get: |s| Some(s.hrr_alpha), set: |s, v| s.hrr_alpha = v },
        default: "0.3",
        value_name: "ALPHA",
        heading: TRANSPORT,
        help: "Largest GGX roughness at which the roulette is used",
        doc: "",
    },
    Setting {
        name: "iterations",
        kind: Kind::Integer {
            min: 1,
            max: i64::MAX as u64,
            get: |s| s.iterations,
            set: |s, v| {
                s.iterations = v;
                s.time = None;
            },
        },
        default: "64",
        value_name: "N",
        heading: BUDGET,
        help: "Iterations to run",
        doc: "",
    },
    Setting {
        name: "time",
        kind: Kind::Real { min: 1e-3, max: 1e9, get: |s| s.time, set: |s, v| s.time = Some(v) },
        default: "",
        value_name: "SECONDS",
        heading: BUDGET,
        help: "Seconds of rendering, instead of a number of iterations",
        doc: "The iteration that is under way when the time is up is finished.",
    },
    Setting {
        name: "first_iteration",
        kind: Kind::Integer {
            min: 0,
            max: i64::MAX as u64,
            get: |s| s.first_iteration,
            set: |s, v| s.first_iteration = v,
        },
        default: "0",
        value_name: "N",
        heading: BUDGET,
        help: "Number of the first iteration",
        doc: "Each iteration has its own random numbers: iterations 0..4 and 4..8 add up to 0..8.",
    },
    Setting {
        name: "seed",
        kind: Kind::Integer { min: 0, max: i64::MAX as u64, get: |s| s.seed, set: |s, v| s.seed = v },
        default: "0",
        value_name: "N",
        heading: BUDGET,
        help: "Seed of all random numbers",
        doc: "",
    },
    Setting {
        name: "visibility",
        kind: Kind::Choice {
            names: &Backend::NAMES,
            planned: &[],
            get: |s| s.visibility as usize,
            set: |s, i| s.visibility = Backend::ALL[i],
        },
        default: if cfg!(feature = "embree") { "embree" } else { "obvhs" },
        value_name: "NAME",
        heading: MACHINE,
        help: "What answers ray queries",
        doc: "embree: Intel Embree. obvhs: pure Rust. brute: every triangle, for tests.",
    },
    Setting {
        name: "threads",
        kind: Kind::Integer {
            min: 0,
            max: 1024,
            get: |s| s.threads as u64,
            set: |s, v| s.threads = v as usize,
        },
        default: "0",
        value_name: "N",
        heading: MACHINE,
        help: "Threads; 0: all",
        doc: "The image does not depend on it.",
    },
];

/// Why a setting was refused. The text names the setting, and what would be taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// No such name, or a value out of range or of the wrong kind.
    #[error("{0}")]
    Invalid(String),
    /// A name that is reserved for something to come.
    #[error("{0}")]
    NotYet(String),
}

impl SettingError {
    /// The library's error, for a setting found at a place of a scene file.
    pub fn at(self, place: Place) -> Error {
        match self {
            Self::Invalid(message) => Error::Scene { place, message },
            Self::NotYet(message) => Error::Unsupported { place, message },
        }
    }
}

impl From<SettingError> for String {
    fn from(e: SettingError) -> Self {
        e.to_string()
    }
}

impl Kind {
    /// What is taken, in words: `24` or `0.5` style ranges, or the names.
    pub fn allowed(&self) -> String {
        match self {
            Self::Integer { min, max, .. } if *max == i64::MAX as u64 => {
                format!("a whole number, at least {min}")
            }
            Self::Integer { min, max, .. } => format!("a whole number from {min} to {max}"),
            Self::Real { min, max, .. } => format!("a number from {min:?} to {max:?}"),
            Self::Choice { names, .. } => format!("one of {}", names.join(", ")),
        }
    }

    /// Whether values are words (quoted in TOML) and not numbers.
    pub fn is_text(&self) -> bool {
        matches!(self, Self::Choice { .. })
    }
}

impl Setting {
    /// The row of a name; dashes count as underscores.
    pub fn find(name: &str) -> Option<&'static Self> {
        let name = name.replace('-', "_");
        TABLE.iter().find(|s| s.name == name)
    }

    /// As [`Setting::find`], with an error that names the nearest setting.
    pub fn find_or_explain(name: &str) -> Result<&'static Self, SettingError> {
        Self::find(name).ok_or_else(|| {
            let hint = match nearest(&name.replace('-', "_"), TABLE.iter().map(|s| s.name)) {
                Some(near) => format!("did you mean '{near}'?"),
                None => {
                    let names: Vec<_> = TABLE.iter().map(|s| s.name).collect();
                    format!("there are {}", names.join(", "))
                }
            };
            SettingError::Invalid(format!("unknown setting '{name}'; {hint}"))
        })
    }

    /// Parses a value, checks its range and stores it.
    pub fn set(&self, settings: &mut Settings, value: &str) -> Result<(), SettingError> {
        let value = value.trim();
        let refuse =
            || SettingError::Invalid(format!("{} must be {}, not '{value}'", self.name, self.kind.allowed()));
        match self.kind {
            Kind::Integer { min, max, set, .. } => {
                let number = parse_integer(value).filter(|n| (min..=max).contains(n)).ok_or_else(refuse)?;
                set(settings, number);
            }
            Kind::Real { min, max, set, .. } => {
                // A NaN lies in no range.
                let number = value.parse().ok().filter(|x| (min..=max).contains(x)).ok_or_else(refuse)?;
                set(settings, number);
            }
            Kind::Choice { names, planned, set, .. } => match names.iter().position(|n| *n == value) {
                Some(index) => set(settings, index),
                None if planned.contains(&value) => {
                    return Err(SettingError::NotYet(format!(
                        "{} '{value}' is not available yet; there are {}",
                        self.name,
                        names.join(", ")
                    )));
                }
                None => {
                    let all = names.iter().chain(planned).copied();
                    return Err(match nearest(value, all) {
                        Some(near) => SettingError::Invalid(format!("{}; did you mean '{near}'?", refuse())),
                        None => refuse(),
                    });
                }
            },
        }
        Ok(())
    }

    /// The present value as text; `None` when the setting is not in force.
    pub fn get(&self, settings: &Settings) -> Option<String> {
        match self.kind {
            Kind::Integer { get, .. } => Some(get(settings).to_string()),
            Kind::Real { get, .. } => get(settings).map(|x| format!("{x:?}")),
            Kind::Choice { names, get, .. } => Some(names[get(settings)].to_owned()),
        }
    }
}

impl Settings {
    /// Sets one setting from text, as the flags and scene files do. Dashes in the name count as underscores.
    ///
    /// # Errors
    /// An unknown name (with the nearest one), a value out of range (with the range), or a name that is not available
    /// yet. The settings are then unchanged.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), SettingError> {
        Setting::find_or_explain(name)?.set(self, value)
    }

    /// One setting as text; `None` for an unknown name or a setting that is not in force.
    pub fn get(&self, name: &str) -> Option<String> {
        Setting::find(name)?.get(self)
    }

    /// All settings as lines of TOML, as an image file keeps them: the body of a `[render]` section.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        for setting in TABLE {
            if let Some(value) = setting.get(self) {
                let quote = if setting.kind.is_text() { "\"" } else { "" };
                text += &format!("{} = {quote}{value}{quote}\n", setting.name);
            }
        }
        text
    }
}

/// The candidate that a misspelt name most likely means, or `None` when none is near.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Digits with TOML's optional underscores between them.
fn parse_integer(text: &str) -> Option<u64> {
    if text.starts_with('_') || text.ends_with('_') || text.contains("__") {
        return None;
    }
    text.replace('_', "").parse().ok()
}

impl FromStr for Integrator {
    type Err = SettingError;
    fn from_str(name: &str) -> Result<Self, SettingError> {
        let mut settings = Settings::default();
        settings.set("integrator", name)?;
        Ok(settings.integrator)
    }
}

impl FromStr for Backend {
    type Err = SettingError;
    fn from_str(name: &str) -> Result<Self, SettingError> {
        let mut settings = Settings::default();
        settings.set("visibility", name)?;
        Ok(settings.visibility)
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(name: &str, value: &str) -> String {
        Settings::default().set(name, value).unwrap_err().to_string()
    }

    #[test]
    fn names_and_variants_are_in_the_same_order() {
        assert!(Integrator::ALL.iter().enumerate().all(|(i, v)| *v as usize == i));
        assert!(Backend::ALL.iter().enumerate().all(|(i, v)| *v as usize == i));
        assert_eq!("lvc+hrr".parse(), Ok(Integrator::LvcHrr));
        assert_eq!("brute".parse(), Ok(Backend::Brute));
    }

    #[test]
    fn the_table_tells_the_true_defaults() {
        for setting in TABLE {
            assert_eq!(
                setting.get(&Settings::default()).unwrap_or_default(),
                setting.default,
                "{}",
                setting.name
            );
        }
    }

    #[test]
    fn both_ends_of_a_range_are_taken_and_nothing_beyond() {
        assert!(message("max_depth", "0").contains("from 1 to 65535"));
        assert!(message("max_depth", "65536").contains("from 1 to 65535"));
        assert!(message("samples", "-1").contains("not '-1'"));
        assert!(message("hrr_alpha", "1.01").contains("from 0.0 to 1.0"));
        assert!(message("time", "nan").contains("must be a number"));
        assert!(message("time", "inf").contains("must be a number"));
        assert!(message("seed", "9223372036854775808").contains("at least 0"));
        let mut s = Settings::default();
        s.set("max-depth", "65535").unwrap();
        s.set("hrr-alpha", "0").unwrap();
        s.set("light_subpaths", "1_000_000").unwrap();
        assert_eq!((s.max_depth, s.hrr_alpha, s.light_subpaths), (65535, 0.0, 1_000_000));
    }

    #[test]
    fn a_slip_is_told_what_was_meant() {
        assert!(message("max_dept", "3").contains("did you mean 'max_depth'?"));
        assert!(message("zzz", "3").contains("there are integrator, max_depth"));
        assert!(message("integrator", "lvc-hrr").contains("did you mean 'lvc+hrr'?"));
        assert!(message("visibility", "9").contains("one of embree, obvhs, brute"));
    }

    #[test]
    fn what_is_to_come_is_known_but_refused() {
        for name in Integrator::PLANNED {
            let error = Settings::default().set("integrator", name).unwrap_err();
            assert!(matches!(error, SettingError::NotYet(_)), "{name}");
        }
    }

    #[test]
    fn a_refused_value_changes_nothing() {
        let mut s = Settings::default();
        for (name, value) in [("max_depth", "x"), ("integrator", "vcm"), ("time", "-1"), ("nope", "1")] {
            s.set(name, value).unwrap_err();
        }
        assert_eq!(s, Settings::default());
    }

    #[test]
    fn of_iterations_and_time_the_last_counts() {
        let mut s = Settings::default();
        s.set("time", "2.5").unwrap();
        assert_eq!(s.time, Some(2.5));
        s.set("iterations", "8").unwrap();
        assert_eq!((s.iterations, s.time), (8, None));
    }
}
