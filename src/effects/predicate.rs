//! The predicates that verdicts rest on, by name: a test takes away one after another, and each must be missed.

macro_rules! predicates {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// A question about a scene on whose answer verdicts rest.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Predicate {
            $($(#[$doc])* $name,)*
        }

        impl Predicate {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];
        }
    };
}

predicates! {
    /// A triangle uses the material.
    Used,
    /// The material sends light on: its reflectance is not 0.
    Reflects,
    /// A lobe is, somewhere, as wide as a diffuse one.
    Broad,
    /// A lobe is, somewhere, narrower than that.
    Narrow,
    /// A narrow lobe is, somewhere, rougher than what is as good as smooth.
    Rough,
    /// A narrow lobe is, somewhere, as good as smooth.
    Smooth,
    /// A narrow lobe is, somewhere, no delta lobe.
    Open,
    /// A narrow lobe is, somewhere, a delta lobe.
    Delta,
    /// The lobe's roughness differs by direction.
    Anisotropic,
    /// Light passes through the material.
    Transmits,
    /// The material gives light.
    Emits,
    /// Its back face gives light as well.
    TwoSided,
    /// It stops every ray.
    Opaque,
    /// A texture is not the same everywhere.
    Varies,
    /// An even normal map counts.
    EvenNormals,
    /// A light without size gives light.
    LampGives,
    /// There is an environment that gives light.
    Sky,
    /// The camera's aperture is open.
    Aperture,
    /// A path is short enough to be looked for.
    ShortEnough,
    /// A light without size is seen by some surface of a path.
    LampSeen,
    /// The camera and all lamps are outside of a closed body.
    Outside,
    /// The mesh has no rim.
    Closed,
    /// No corner stands out before any face.
    Convex,
    /// All of the mesh is in one plane.
    Flat,
}

/// Answers to predicates: those that the scene gives, but for at most one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Judge {
    stuck: Option<(Predicate, bool)>,
}

impl Judge {
    /// A judge that gives one predicate the same answer whatever the scene.
    pub fn stuck(predicate: Predicate, answer: bool) -> Self {
        Self { stuck: Some((predicate, answer)) }
    }

    /// The answer to a predicate of which the scene says `truth`.
    pub(super) fn holds(self, predicate: Predicate, truth: bool) -> bool {
        match self.stuck {
            Some((stuck, answer)) if stuck == predicate => answer,
            _ => truth,
        }
    }
}
