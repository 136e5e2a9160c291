//! The effects that a scene may call for, by name.

use super::{SettingError, nearest};
use std::fmt;

macro_rules! effects {
    ($($(#[$doc:meta])* $variant:ident = $id:literal,)*) => {
        /// Something that a scene may call for and that takes machinery to simulate.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Effect {
            $($(#[$doc])* $variant,)*
        }

        impl Effect {
            /// All of them, in the order of tables.
            pub const ALL: [Self; [$($id),*].len()] = [$(Self::$variant),*];

            /// Its name.
            pub fn id(self) -> &'static str {
                [$($id),*][self as usize]
            }
        }
    };
}

effects! {
    /// Light straight from lights.
    Direct = "direct",
    /// Light that surfaces pass on to each other.
    Interreflection = "interreflection",
    /// Paths that start at the lights, at all.
    LightSubpaths = "light_subpaths",
    /// Light that glossy or smooth surfaces throw on diffuse ones.
    Caustics = "caustics",
    /// What is lit by light subpaths, seen in glossy surfaces: paths S D G and G D G.
    Sdg = "sdg",
    /// Caustics seen through smooth surfaces: paths S D S.
    Sds = "sds",
    /// Perfectly smooth reflection.
    Specular = "specular",
    /// Light that passes through surfaces.
    Refraction = "refraction",
    /// Surfaces that are not everywhere there.
    Opacity = "opacity",
    /// Textures of reflectance and roughness.
    Textures = "textures",
    /// Textures of emission.
    EmissionTextures = "emission_textures",
    /// Normal maps.
    NormalMaps = "normal_maps",
    /// Roughness that differs by direction.
    Anisotropy = "anisotropy",
    /// Light from all sides.
    Environment = "environment",
    /// Depth of field.
    Lens = "lens",
    /// Emission from back faces.
    TwoSidedEmission = "two_sided_emission",
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.id())
    }
}

impl std::str::FromStr for Effect {
    type Err = SettingError;

    fn from_str(id: &str) -> Result<Self, SettingError> {
        Self::ALL.into_iter().find(|effect| effect.id() == id).ok_or_else(|| {
            let hint = match nearest(id, Self::ALL.map(Self::id)) {
                Some(near) => format!("did you mean '{near}'?"),
                None => format!("there are {}", Self::ALL.map(Self::id).join(", ")),
            };
            SettingError::Invalid(format!("unknown effect '{id}'; {hint}"))
        })
    }
}

/// A set of effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EffectSet(u32);

impl EffectSet {
    /// Whether it has an effect.
    pub fn contains(self, effect: Effect) -> bool {
        self.0 & 1 << effect as u32 != 0
    }

    /// True when it has none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Its effects.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |&effect| self.contains(effect))
    }
}

impl FromIterator<Effect> for EffectSet {
    fn from_iter<T: IntoIterator<Item = Effect>>(effects: T) -> Self {
        Self(effects.into_iter().fold(0, |set, effect| set | 1 << effect as u32))
    }
}

/// Names with commas between them.
impl std::str::FromStr for EffectSet {
    type Err = SettingError;

    fn from_str(list: &str) -> Result<Self, SettingError> {
        list.split(',').map(str::trim).filter(|id| !id.is_empty()).map(str::parse).collect()
    }
}

impl fmt::Display for EffectSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.iter().map(Effect::id).collect::<Vec<_>>().join(","))
    }
}
