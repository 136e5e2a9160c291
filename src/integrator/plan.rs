//! `auto`: the least machinery that covers what a scene calls for.

use super::recipe::{Base, Merge, Recipe};
use crate::effects::paths::{Coverage, Vertex};
use crate::effects::{Effect, EffectSet, Effects, PathClass};
use crate::error::{Error, Place, Result};
use crate::scene::Scene;
use crate::settings::{Integrator, Settings};
use std::collections::BTreeSet;

/// What is switched on for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The algorithm; never `Auto`.
    pub integrator: Integrator,
    /// Names of the machinery that runs, sorted.
    pub machinery: Vec<&'static str>,
    /// Effects that the scene calls for and that were left out on demand: the image is biased.
    pub dropped: EffectSet,
    /// Kinds of paths, of effects that were left out, that nothing finds.
    pub uncovered: Vec<PathClass>,
}

impl Plan {
    /// Whether light is missing from the image.
    pub fn is_biased(&self) -> bool {
        !self.dropped.is_empty() || !self.uncovered.is_empty()
    }

    /// What is missing, in a sentence; `None` when nothing is.
    pub fn complaint(&self) -> Option<String> {
        let mut parts = Vec::new();
        if !self.dropped.is_empty() {
            parts.push(format!("left out: {}", self.dropped));
        }
        if !self.uncovered.is_empty() {
            let paths: Vec<_> = self.uncovered.iter().map(|class| class.to_string()).collect();
            parts.push(format!("{} does not find {}", self.integrator, paths.join(", ")));
        }
        (!parts.is_empty()).then(|| format!("the image is biased; {}", parts.join("; ")))
    }
}

/// Plans a render: what the settings name, or for `auto` what the effects call for.
///
/// # Errors
/// [`Error::Unsupported`], naming the kind of path, when nothing that runs finds it and its effect was not left out.
pub fn plan(scene: &Scene, settings: &Settings, effects: &Effects) -> Result<Plan> {
    let on = |effect: Effect| {
        (effects.wants(effect) || settings.with.contains(effect)) && !settings.without.contains(effect)
    };
    let by_name = settings.integrator != Integrator::Auto;
    let light_subpaths = !settings.without.contains(Effect::LightSubpaths);
    let integrator = if by_name {
        settings.integrator
    } else {
        match (on(Effect::Sds) && light_subpaths, on(Effect::Sdg) && light_subpaths) {
            (true, true) => Integrator::LvcHrrSds,
            (true, false) => Integrator::LvcSds,
            (false, true) => Integrator::LvcHrr,
            (false, false) if light_subpaths && (on(Effect::Caustics) || on(Effect::LightSubpaths)) => {
                Integrator::Lvc
            }
            (false, false) => Integrator::Pt,
        }
    };
    let recipe = Recipe::of(integrator);
    let uncovered: Vec<PathClass> =
        effects.classes.iter().filter(|class| !coverage(recipe.as_ref()).finds(class)).cloned().collect();
    // Without merging, what meets lights by chance may find all that it would.
    let lost = |e: Effect| e != Effect::Sds || uncovered.iter().any(|class| class.effect == e);
    let dropped: EffectSet = settings.without.iter().filter(|&e| effects.wants(e) && lost(e)).collect();
    let left_out = |effect: Effect| settings.without.contains(effect);
    let tolerated = |class: &PathClass| {
        let smooth = class.surfaces.contains(&Vertex::S);
        left_out(class.effect) || left_out(Effect::Specular) && smooth || !by_name && !light_subpaths
    };
    if let Some(class) = uncovered.iter().find(|class| !tolerated(class)) {
        return Err(Error::Unsupported {
            place: Place::file(&scene.path),
            message: format!(
                "paths {class}: {integrator} does not find them; choose another integrator, or render without {}",
                class.effect
            ),
        });
    }
    let mut machinery: BTreeSet<&'static str> = machinery(recipe.as_ref()).into_iter().collect();
    let of_the_scene = Effect::ALL.into_iter().filter(|&effect| effect >= Effect::Specular);
    for effect in of_the_scene.filter(|&e| effects.wants(e) && !settings.without.contains(e)) {
        machinery.extend(effects.of(effect).machinery);
    }
    Ok(Plan { integrator, machinery: machinery.into_iter().collect(), dropped, uncovered })
}

/// What an algorithm's techniques find; `None`: path tracing.
fn coverage(recipe: Option<&Recipe>) -> Coverage {
    recipe.map_or(Coverage { eye_hits: true, next_event: true, ..Coverage::default() }, |r| Coverage {
        eye_hits: r.eye_subpaths,
        next_event: r.next_event,
        light_image: r.light_image,
        connections: r.base != Base::Off,
        merging: r.merge == Merge::All,
        merging_shown: r.merge == Merge::Shown,
    })
}

fn machinery(recipe: Option<&Recipe>) -> Vec<&'static str> {
    let Some(r) = recipe else { return vec!["eye_subpaths", "next_event"] };
    [
        (true, "light_subpaths"),
        (r.eye_subpaths, "eye_subpaths"),
        (r.next_event, "next_event"),
        (r.light_image, "light_image"),
        (r.base != Base::Off, "connections"),
        (r.roulette || r.merges(), "vertex_bvh"),
        (r.roulette, "hrr"),
        (r.merges(), "merging"),
    ]
    .into_iter()
    .filter_map(|(on, name)| on.then_some(name))
    .collect()
}

/// A scene without the effects that are to be left out, as far as these are the scene's own and not a technique's.
///
/// # Errors
/// [`Error::Usage`] for an effect that cannot be left out.
pub fn without(scene: &Scene, settings: &Settings) -> Result<Option<(Scene, Settings)>> {
    use crate::light::LightSource;
    if settings.without.is_empty() {
        return Ok(None);
    }
    let (mut scene, mut settings) = (scene.clone(), settings.clone());
    for effect in settings.without.iter() {
        match effect {
            // What an algorithm that was asked for by name does not find.
            Effect::Direct | Effect::Specular if settings.integrator != Integrator::Auto => (),
            Effect::Interreflection => settings.max_depth = settings.max_depth.min(2),
            Effect::LightSubpaths | Effect::Caustics | Effect::Sdg | Effect::Sds => (),
            Effect::Environment => scene.lights.retain(|l| !matches!(l, LightSource::Environment { .. })),
            Effect::Lens => scene.camera.aperture_radius = 0.0,
            Effect::TwoSidedEmission => {
                scene.materials.iter_mut().for_each(|m| m.two_sided_emission = false);
            }
            Effect::Opacity => scene.materials.iter_mut().for_each(|m| {
                m.opacity = 1.0;
                m.set_maps(crate::material::Maps { opacity: None, ..m.maps().clone() });
            }),
            Effect::NormalMaps => scene.materials.iter_mut().for_each(|m| {
                m.set_maps(crate::material::Maps { normal: None, ..m.maps().clone() });
            }),
            Effect::EmissionTextures => scene.materials.iter_mut().for_each(|m| {
                m.set_maps(crate::material::Maps { emission: None, ..m.maps().clone() });
            }),
            Effect::Direct
            | Effect::Specular
            | Effect::Refraction
            | Effect::Textures
            | Effect::Anisotropy => {
                return Err(Error::Usage(format!("{effect} cannot be left out")));
            }
        }
    }
    Ok(Some((scene, settings)))
}
