//! What a scene calls for: each effect with a verdict, and the evidence for it.
//!
//! Everything is read off the scene, before any ray is traced: the lobes of the materials that triangles use, textures by
//! the bounds of their pixels, lights and camera. A verdict of *absent* is a proof: what is switched off for it cannot
//! change a pixel.

mod analysis;
mod convexity;
mod material;
pub mod paths;
pub mod predicate;

pub use crate::settings::{Effect, EffectSet};
pub use analysis::{analyze, analyze_as};
pub use material::Lobes;
pub use paths::PathClass;

use serde::Serialize;

/// What the analysis says of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The scene has nothing of it: the image is the same without.
    Absent,
    /// The scene has it, but what it would switch on cannot change the expected image, only noise and time.
    Inert,
    /// The scene calls for it.
    Wanted,
    /// The scene calls for it, and hrr has not got it.
    Unsupported,
}

impl Verdict {
    /// Its name.
    pub fn name(self) -> &'static str {
        ["absent", "inert", "wanted", "unsupported"][self as usize]
    }
}

/// An effect and what the analysis found.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The name of an [`Effect`], or of what hrr has not got: the MTL key that asks for it.
    pub id: String,
    /// The verdict.
    pub verdict: Verdict,
    /// Why, in half a sentence.
    pub why: String,
    /// The materials that it rests on.
    pub materials: Vec<Witness>,
    /// What it switches on where it is wanted.
    pub machinery: &'static [&'static str],
}

/// A material that a verdict rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// Its name.
    pub material: String,
    /// The first triangle that uses it.
    pub triangle: u32,
    /// What makes it count: lobes and bounds of its textures, or the line that asks for what hrr has not got.
    pub evidence: String,
}

/// All effects of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Effects {
    /// In the order of [`Effect::ALL`], and then what is unsupported.
    pub findings: Vec<Finding>,
    /// The kinds of paths that bring light to the camera.
    pub classes: Vec<PathClass>,
}

impl Effects {
    /// What was found of an effect.
    pub fn of(&self, effect: Effect) -> &Finding {
        &self.findings[effect as usize]
    }

    /// What was found under a name; `None` where hrr has no such effect and the scene does not ask for it.
    pub fn named(&self, id: &str) -> Option<&Finding> {
        self.findings.iter().find(|f| f.id == id)
    }

    /// Whether an effect is wanted.
    pub fn wants(&self, effect: Effect) -> bool {
        self.of(effect).verdict == Verdict::Wanted
    }
}
