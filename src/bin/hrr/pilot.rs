//! What effects cost: a short pilot, and pilots without one effect or another.

use hrr::effects::{Effect, Effects, Finding, Verdict};
use hrr::render::{Silent, counters::Seconds, render};
use hrr::scene::Scene;
use hrr::settings::Settings;

/// Size of a pilot's image and number of its light subpaths.
const SIZE: (u32, u32, u64) = (64, 48, 4096);
/// Pilots of which the fastest counts, where times are compared.
const RUNS: usize = 3;

/// A pilot, and what is known of others.
#[derive(Debug)]
pub struct Pilot {
    seconds: Seconds,
    /// Effects, and the time that pilots without them saved, percent.
    saved: Vec<(Effect, f64)>,
}

/// What an effect costs, percent of a pilot's time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cost {
    /// By the clocks of a pilot's stages.
    Measured(f64),
    /// By pilots with and without it, which may trace other paths.
    Estimated(f64),
    /// Not to be told, and why.
    Unknown(&'static str),
}

impl Pilot {
    /// Renders pilots; `None` when that is not possible.
    pub fn new(scene: &Scene, settings: &Settings, effects: &Effects) -> Option<Self> {
        let (mut scene, mut settings) = (scene.clone(), settings.clone());
        (scene.film.width, scene.film.height, settings.light_subpaths) = SIZE;
        (settings.samples, settings.iterations, settings.time, settings.error) = (1, 1, None, None);
        let run = |settings: &Settings| render(&scene, settings, &Silent).ok().map(|o| o.stats.seconds);
        let fastest = |settings: &Settings| {
            (0..RUNS).filter_map(|_| run(settings)).min_by(|a, b| sum(a).total_cmp(&sum(b)))
        };
        let seconds = fastest(&settings)?;
        let compared = |&effect: &Effect| can_be_compared(effect) && effects.wants(effect);
        let saved = Effect::ALL.into_iter().filter(compared).filter_map(|effect| {
            let without = settings.without.iter().chain([effect]).collect();
            let less = fastest(&Settings { without, ..settings.clone() })?;
            Some((effect, percent(1.0 - sum(&less) / sum(&seconds))))
        });
        Some(Self { saved: saved.collect(), seconds })
    }

    /// What a finding's effect costs.
    pub fn cost(&self, finding: &Finding) -> Cost {
        let s = &self.seconds;
        let effect = finding.id.parse::<Effect>();
        let part = match (effect, finding.verdict) {
            (_, Verdict::Absent | Verdict::Unsupported) => 0.0,
            (Ok(Effect::Direct), _) => s.visibility,
            (Ok(Effect::Interreflection), _) => s.eye_trace,
            (Ok(Effect::LightSubpaths), _) => s.light_trace,
            (Ok(Effect::Sdg), _) => s.vertex_bvh_build + s.roulette,
            (_, Verdict::Inert) => 0.0,
            (Ok(Effect::Caustics), _) => return Cost::Unknown("in the costs of light_subpaths and direct"),
            (Ok(effect), _) => {
                let saved = self.saved.iter().find(|(e, _)| *e == effect);
                let reason = "in every step of a path";
                return saved.map_or(Cost::Unknown(reason), |(_, percent)| Cost::Estimated(*percent));
            }
            (Err(_), _) => return Cost::Unknown("unknown"),
        };
        Cost::Measured(percent(part / sum(s).max(f64::MIN_POSITIVE)))
    }
}

/// Whether a pilot without it tells its cost: it can be left out, and is a matter of the scene, or nobody else's.
fn can_be_compared(effect: Effect) -> bool {
    use Effect::{EmissionTextures, Environment, Lens, NormalMaps, Opacity, Sds, TwoSidedEmission};
    matches!(effect, Sds | Opacity | EmissionTextures | NormalMaps | Environment | Lens | TwoSidedEmission)
}

/// Of all stages and threads.
fn sum(s: &Seconds) -> f64 {
    s.light_trace + s.vertex_bvh_build + s.eye_trace + s.roulette + s.visibility + s.film
}

/// A share in percent, rounded to a tenth; what chance makes negative is 0.
fn percent(share: f64) -> f64 {
    (1000.0 * share.max(0.0)).round() / 10.0
}
