//! The recipes of the bidirectional machine, as a table: name -> switches.

use crate::settings::Integrator;

/// Which light-side vertices an eye vertex is connected to, where the roulette is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// None.
    Off,
    /// All of one light subpath that belongs to the eye sample alone.
    OwnPath,
    /// Uniform picks from the cache.
    Uniform,
    /// Picks from a few reused subpaths, in proportion to what they gave nearby.
    Probabilistic,
}

/// Which light vertices near an eye vertex count as if they were it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Merge {
    /// None.
    Off,
    /// Those of caustics, at eye vertices that perfectly smooth surfaces show to the camera: what connections cannot find.
    Shown,
    /// All, at all eye vertices.
    All,
}

/// What an algorithm switches on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recipe {
    /// Eye subpaths go on beyond what the camera sees, and may hit emitters (s = 0).
    pub eye_subpaths: bool,
    /// Next-event estimation (s = 1).
    pub next_event: bool,
    /// Light vertices seen by the camera (s = k-1).
    pub light_image: bool,
    /// Connections of surface vertices (2 <= s <= k-2).
    pub base: Base,
    /// Hierarchical Russian roulette over all light vertices at glossy eye vertices.
    pub roulette: bool,
    /// Light vertices near an eye vertex count as if they were it.
    pub merge: Merge,
}

impl Recipe {
    /// Whether any light vertices are merged with eye vertices, so that the image is blurred, by less and less.
    pub fn merges(&self) -> bool {
        self.merge != Merge::Off
    }

    /// The switches of an integrator; `None` for path tracing, which is code of its own. `Auto` means `lvc+hrr`.
    pub fn of(integrator: Integrator) -> Option<Self> {
        let all = Self {
            eye_subpaths: true,
            next_event: true,
            light_image: true,
            base: Base::Uniform,
            roulette: false,
            merge: Merge::Off,
        };
        match integrator {
            Integrator::Pt => None,
            Integrator::Lt => Some(Self { eye_subpaths: false, next_event: false, base: Base::Off, ..all }),
            Integrator::Bpt => Some(Self { base: Base::OwnPath, ..all }),
            Integrator::Lvc => Some(all),
            Integrator::LvcHrr | Integrator::Auto => Some(Self { roulette: true, ..all }),
            Integrator::LvcSds => Some(Self { merge: Merge::Shown, ..all }),
            Integrator::LvcHrrSds => Some(Self { roulette: true, merge: Merge::Shown, ..all }),
            Integrator::Pcbpt => Some(Self { base: Base::Probabilistic, ..all }),
            Integrator::PcbptHrr => Some(Self { base: Base::Probabilistic, roulette: true, ..all }),
            Integrator::Vcm => Some(Self { merge: Merge::All, ..all }),
            Integrator::VcmHrr => Some(Self { merge: Merge::All, roulette: true, ..all }),
            Integrator::Pcvcm => Some(Self { base: Base::Probabilistic, merge: Merge::All, ..all }),
            Integrator::PcvcmHrr => {
                Some(Self { base: Base::Probabilistic, merge: Merge::All, roulette: true, ..all })
            }
        }
    }
}
