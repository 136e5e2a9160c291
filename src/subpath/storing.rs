//! Which light vertices are worth keeping.
//!
//! What comes from a diffuse surface or straight from a lamp, eye subpaths and next-event estimation find as well; what
//! a glossy or perfectly smooth surface has thrown is a caustic. So the roulette's cache has a light vertex always when its
//! predecessor scatters narrowly, and else with a small probability. Vertices straight from a lamp, which next-event
//! estimation sees without noise, are left to it: the camera is not connected to them, and they are neither kept nor merged.
//! All of this is part of every weight.

use crate::bsdf::Bsdf;
use crate::mis::Heuristic;

/// What threw light on a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// An emitter.
    Lamp,
    /// A surface that scatters narrowly.
    Narrow,
    /// Any other surface.
    Broad,
}

/// What a light vertex is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Judged by the roulette of all eye vertices.
    Stored,
    /// Connected to the camera.
    Seen,
    /// Merged with eye vertices.
    Merged,
}

/// The rule by which light vertices are used.
#[derive(Debug, Clone, Copy)]
pub struct Storing {
    /// Probability of storing a vertex whose predecessor does not scatter narrowly, in (0,1].
    pub share: f64,
    /// GGX roughness up to which scattering is narrow.
    pub max_alpha: f64,
    /// Whether vertices straight from a lamp have any role.
    pub lamps: bool,
    /// Whether merging is for caustics that perfectly smooth surfaces show to the camera, and for nothing else.
    pub shown_only: bool,
}

impl Storing {
    /// All of them.
    pub const ALL: Self = Self { share: 1.0, max_alpha: 1.0, lamps: true, shown_only: false };

    /// What a surface is to the vertex that it throws light on.
    #[inline]
    pub fn origin(&self, bsdf: &Bsdf) -> Origin {
        let narrow = bsdf.narrowest().is_some_and(|alpha| alpha <= self.max_alpha);
        if narrow { Origin::Narrow } else { Origin::Broad }
    }

    /// The probability with which a vertex has a role.
    #[inline]
    pub fn probability(&self, role: Role, origin: Origin) -> f64 {
        match (role, origin) {
            (_, Origin::Lamp) if !self.lamps => 0.0,
            (Role::Stored, Origin::Lamp | Origin::Broad) => self.share,
            (Role::Merged, Origin::Lamp | Origin::Broad) if self.shown_only => 0.0,
            _ => 1.0,
        }
    }
}

/// A sum over the techniques of an eye subpath, of which some need its last vertex as a light vertex in a role. With what
/// probability it would have that, only the next vertex tells, which would throw the light.
#[derive(Debug, Clone, Copy, Default)]
pub struct Total {
    /// Of techniques that do not need it.
    pub known: f64,
    /// Of those that need it stored, over the probability of that.
    pub stored: f64,
    /// Of those that need it seen, over the probability of that.
    pub seen: f64,
    /// Of those that need it merged, over the probability of that.
    pub merged: f64,
}

impl Total {
    /// A sum without unknowns.
    pub fn known(known: f64) -> Self {
        Self { known, ..Self::default() }
    }

    /// The sum, once it is known what throws the light.
    #[inline]
    pub fn given(&self, heuristic: Heuristic, storing: &Storing, origin: Origin) -> f64 {
        let share = |role, sum: f64| match sum {
            0.0 => 0.0,
            sum => heuristic.raise(storing.probability(role, origin)) * sum,
        };
        let stored = self.known + share(Role::Stored, self.stored);
        stored + share(Role::Seen, self.seen) + share(Role::Merged, self.merged)
    }
}
