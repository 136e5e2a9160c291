//! Settings that are one of a few names.

use super::{SettingError, Settings};
use std::fmt;
use std::str::FromStr;

/// An enumeration with a name for each variant; `$setting` is its row in the table of settings.
macro_rules! choice {
    (
        $(#[$doc:meta])*
        $name:ident, $setting:literal, $field:ident {
            $($(#[$variant_doc:meta])* $variant:ident = $text:literal,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$variant_doc])* $variant,)*
        }

        impl $name {
            /// Every variant, in the order of `NAMES`.
            pub const ALL: [Self; [$($text),*].len()] = [$(Self::$variant),*];
            /// The names in scene files and flags.
            pub const NAMES: [&'static str; Self::ALL.len()] = [$($text),*];

            /// The name in scene files and flags.
            pub fn name(self) -> &'static str {
                Self::NAMES[self as usize]
            }
        }

        impl FromStr for $name {
            type Err = SettingError;
            fn from_str(name: &str) -> Result<Self, SettingError> {
                let mut settings = Settings::default();
                settings.set($setting, name)?;
                Ok(settings.$field)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.name())
            }
        }
    };
}

choice! {
    /// How light is transported.
    Integrator, "integrator", integrator {
        /// Chosen from what the scene contains.
        Auto = "auto",
        /// Path tracing with next-event estimation.
        Pt = "pt",
        /// Light tracing.
        Lt = "lt",
        /// Bidirectional path tracing, one light subpath for each eye subpath.
        Bpt = "bpt",
        /// Connections to uniform picks from the light-vertex cache.
        Lvc = "lvc",
        /// As `Lvc`, with hierarchical Russian roulette at glossy eye vertices.
        LvcHrr = "lvc+hrr",
        /// As `Lvc`, and caustics that smooth surfaces show are merged, as by `Vcm`.
        LvcSds = "lvc+sds",
        /// As `LvcHrr`, and caustics that smooth surfaces show are merged, as by `Vcm`.
        LvcHrrSds = "lvc+hrr+sds",
        /// Connections to picks from a few reused light subpaths, in proportion to what they gave nearby.
        Pcbpt = "pcbpt",
        /// As `Pcbpt`, with hierarchical Russian roulette at glossy eye vertices.
        PcbptHrr = "pcbpt+hrr",
        /// As `Lvc`, with vertex merging as well.
        Vcm = "vcm",
        /// As `Vcm`, with hierarchical Russian roulette at glossy eye vertices.
        VcmHrr = "vcm+hrr",
        /// As `Pcbpt`, with vertex merging as well.
        Pcvcm = "pcvcm",
        /// As `Pcvcm`, with hierarchical Russian roulette at glossy eye vertices.
        PcvcmHrr = "pcvcm+hrr",
    }
}

impl Integrator {
    /// Names that are reserved for integrators to come.
    pub const PLANNED: [&'static str; 1] = ["bpt+hrr"];
}

choice! {
    /// What answers ray queries.
    Backend, "visibility", visibility {
        /// Intel Embree.
        Embree = "embree",
        /// obvhs, pure Rust.
        Obvhs = "obvhs",
        /// Every triangle; for tests.
        Brute = "brute",
    }
}

impl Backend {
    /// The fastest backend of this build.
    pub const BEST: Self = if cfg!(feature = "embree") { Self::Embree } else { Self::Obvhs };
}

choice! {
    /// How techniques that find the same path share its weight [Veach 1997, section 9.2].
    Heuristic, "mis", mis {
        /// In proportion to their densities.
        Balance = "balance",
        /// In proportion to the squares of their densities.
        Power = "power",
    }
}

choice! {
    /// The shape of the range in which a lobe of the roulette accepts light vertices.
    #[derive(Default)]
    Range, "range", range {
        /// As the lobe is.
        #[default]
        Ellipsoid = "ellipsoid",
        /// Round about the axis, as wide as the lobe's wider side [Tokuyoshi & Harada 2017].
        Spheroid = "spheroid",
        /// The same in all directions: knows nothing of the lobe but its size [Tokuyoshi & Harada 2016].
        Sphere = "sphere",
    }
}

choice! {
    /// Where the roulette's random numbers come from, of which it knows the minimum below every node.
    MinimumRule, "minimum", minimum {
        /// Dealt on the way down; children of equal size get one stratum each.
        Nested = "nested",
        /// Dealt on the way down; siblings share out the range above the parent's stratum \[HRR19\].
        SemiStratified = "semi-stratified",
        /// Dealt on the way down: the true minimum of independent uniforms.
        Exact = "exact",
        /// One for each light vertex, shared by all queries of an iteration [Tokuyoshi & Harada 2016].
        Pregenerated = "pregenerated",
    }
}

choice! {
    /// How next-event estimation chooses among lights.
    LightChoice, "light_choice", light_choice {
        /// Whichever has less noise for the time, by how unevenly lights are spread.
        Auto = "auto",
        /// By about how much light each may throw on the place that asks, where there are few.
        Place = "place",
        /// By power.
        Power = "power",
    }
}

choice! {
    /// The arithmetic in which the roulette computes the probability of a light vertex.
    #[derive(Default)]
    LobePrecision, "lobe_precision", lobe_precision {
        /// Double precision throughout.
        #[default]
        F64 = "f64",
        /// The offset from eye to light vertex in double precision, all after that in single.
        Rebased = "rebased",
        /// Single precision throughout, the eye vertex's position included.
        F32 = "f32",
    }
}

choice! {
    /// How much time Embree takes to build its tree.
    EmbreeBuild, "embree_build", embree_build {
        /// With the surface area heuristic, and triangles that are cut where that helps.
        High = "high",
        /// With the surface area heuristic.
        Medium = "medium",
        /// By the order of a space-filling curve.
        Low = "low",
    }
}

choice! {
    /// Whether something is done.
    Switch, "adaptive", adaptive {
        /// It is not.
        Off = "off",
        /// It is.
        On = "on",
    }
}

choice! {
    /// Whether something is done, or done where it is known to help.
    AutoSwitch, "emitters", emitters {
        /// It is not.
        Off = "off",
        /// It is.
        On = "on",
        /// Where it helps.
        Auto = "auto",
    }
}

impl AutoSwitch {
    /// Whether it is done, where `helps` tells whether it is known to help.
    pub fn is_on(self, helps: impl FnOnce() -> bool) -> bool {
        match self {
            Self::Off => false,
            Self::On => true,
            Self::Auto => helps(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        assert!(Integrator::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(Backend::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(Switch::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(AutoSwitch::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(Heuristic::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(Range::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(LobePrecision::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(EmbreeBuild::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert!(MinimumRule::ALL.iter().all(|v| v.to_string().parse() == Ok(*v)));
        assert_eq!("lvc+hrr".parse(), Ok(Integrator::LvcHrr));
        assert_eq!("brute".parse(), Ok(Backend::Brute));
    }
}
