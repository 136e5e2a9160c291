//! The settings of a render as one table: name, kind, default, doc. The `[render]` section of scene files, the flags
//! of the program and the setters of the C interface are all fed from [`TABLE`].

mod choices;
mod effects;
mod table;

pub use choices::{
    AutoSwitch, Backend, EmbreeBuild, Heuristic, Integrator, LightChoice, LobePrecision, MinimumRule, Range,
    Switch,
};
pub use effects::{Effect, EffectSet};
pub use table::TABLE;

use crate::error::{Error, Place};

/// Everything a render can be told; [`TABLE`] gives each field's range and meaning in full.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Transport algorithm.
    pub integrator: Integrator,
    /// Effects whose machinery runs though the scene does not call for it.
    pub with: EffectSet,
    /// Effects that are left out.
    pub without: EffectSet,
    /// Longest path, in segments: 1 = emitters seen directly, 2 = direct light.
    pub max_depth: u32,
    /// Ray query backend.
    pub visibility: Backend,
    /// Whether no ray slips between two triangles that share an edge (Embree).
    pub embree_robust: Switch,
    /// How much time Embree takes to build its tree.
    pub embree_build: EmbreeBuild,
    /// Iterations to run (each `samples` eye samples per pixel).
    pub iterations: u64,
    /// Most memory for light vertices where they are not set, 1e9 bytes; 0 = half of the machine's.
    pub memory: f64,
    /// First iteration's number, so that a render can be split and added up.
    pub first_iteration: u64,
    /// Seconds of rendering instead of a number of iterations.
    pub time: Option<f64>,
    /// Relative error to reach, with 90 % confidence, instead of a number of iterations; see
    /// [`ErrorEstimate`](crate::render::ErrorEstimate).
    pub error: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Threads; 0 = all.
    pub threads: usize,
    /// Eye samples per pixel and iteration; 0 = what suits the time, else 1.
    pub samples: u32,
    /// Light subpaths per iteration; 0 = what suits time and memory, else as many as eye samples.
    pub light_subpaths: u64,
    /// Connections that the uniform picks (`lvc`) try at each eye vertex.
    pub connections: u32,
    /// Expected number of light vertices that the roulette keeps where its probabilities stay below 1 (k).
    pub expected: f64,
    /// Most that the acceptance probability may be on the axis of a lobe at the distance sqrt(A / 4 pi), A the scene's
    /// surface area (X).
    pub axis_probability: Option<f64>,
    /// Largest GGX roughness at which the roulette is used.
    pub hrr_alpha: f64,
    /// Shape of the roulette's ranges.
    pub range: Range,
    /// Where the roulette's random numbers come from.
    pub minimum: MinimumRule,
    /// Arithmetic of the roulette's probabilities.
    pub lobe_precision: LobePrecision,
    /// How much the roulette's lobes are widened where the mirrored lobe is not that of one normal; 1: as suits.
    pub lobe_widening: f64,
    /// Weight of an even lobe under the roulette's lobe of reflection, as a share of it.
    pub lobe_floor: f64,
    /// How far the roulette's boxes are grown, over what covers the roundings of their tests.
    pub node_padding: f64,
    /// Probability of storing a light vertex whose predecessor does not scatter narrowly, where the roulette plays.
    pub storing: f64,
    /// Whether the roulette judges points of lights as well.
    pub emitters: AutoSwitch,
    /// How next-event estimation chooses among lights.
    pub light_choice: LightChoice,
    /// Whether light subpaths are sent where earlier ones proved useful to the roulette.
    pub guiding: AutoSwitch,
    /// Whether eye samples go to the pixels that need them, where the renderer chooses their number.
    pub adaptive: Switch,
    /// Whether bright contributions that no others confirm count for less, which is biased.
    pub outlier_rejection: Switch,
    /// How techniques that find the same path share its weight.
    pub mis: Heuristic,
    /// Light subpaths that probabilistic connections (`pcbpt`) choose from.
    pub reused_subpaths: u64,
    /// Pixels between the eye subpaths that importance records are made along.
    pub record_spacing: u32,
    /// Radius of vertex merging in the first iteration, world units; 0 = by `merge_pixels`.
    pub merge_radius: f64,
    /// The same in pixels, at the median distance of what the camera sees.
    pub merge_pixels: f64,
    /// How fast the radius shrinks: r_i = r_0 (i + 1)^((this - 1) / 2).
    pub merge_shrink: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Auto,
            with: EffectSet::default(),
            without: EffectSet::default(),
            max_depth: 24,
            visibility: Backend::BEST,
            embree_robust: Switch::On,
            embree_build: EmbreeBuild::High,
            iterations: 64,
            memory: 0.0,
            first_iteration: 0,
            time: None,
            error: None,
            seed: 0,
            threads: 0,
            samples: 0,
            light_subpaths: 0,
            connections: 1,
            expected: 1.0,
            axis_probability: None,
            hrr_alpha: 0.1,
            range: Range::Ellipsoid,
            minimum: MinimumRule::Nested,
            lobe_precision: LobePrecision::F64,
            lobe_widening: 1.0,
            lobe_floor: 0.0,
            node_padding: 1.0,
            storing: 0.05,
            emitters: AutoSwitch::Auto,
            light_choice: LightChoice::Auto,
            guiding: AutoSwitch::Auto,
            adaptive: Switch::On,
            outlier_rejection: Switch::Off,
            mis: Heuristic::Balance,
            reused_subpaths: 100,
            record_spacing: 8,
            merge_radius: 0.0,
            merge_pixels: 1.0,
            merge_shrink: 0.75,
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
    /// Names of effects with commas between them.
    Effects {
        /// Reads the field.
        get: fn(&Settings) -> EffectSet,
        /// Writes the field.
        set: fn(&mut Settings, EffectSet),
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
            Self::Effects { .. } => format!("some of {}", Effect::ALL.map(Effect::id).join(", ")),
        }
    }

    /// Whether values are words (quoted in TOML) and not numbers.
    pub fn is_text(&self) -> bool {
        matches!(self, Self::Choice { .. } | Self::Effects { .. })
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
            Kind::Effects { set, .. } => set(settings, value.parse()?),
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
            Kind::Effects { get, .. } => {
                Some(get(settings)).filter(|set| !set.is_empty()).map(|set| set.to_string())
            }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn message(name: &str, value: &str) -> String {
        Settings::default().set(name, value).unwrap_err().to_string()
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
        assert!(message("zzz", "3").contains("there are integrator, with, without, max_depth"));
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
        for (name, value) in [("max_depth", "x"), ("integrator", "bpt+hrr"), ("time", "-1"), ("nope", "1")] {
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
