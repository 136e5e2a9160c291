//! `hrr effects`: what a scene calls for, why, and what that switches on.

use crate::args::{EXIT_CODES, message_args, verbosity};
use crate::log::{Log, Verbosity};
use crate::scene_args::{self, SceneArgs};
use clap::{Arg, ArgMatches};
use hrr::effects::{self, Effect, Effects, Verdict};
use hrr::integrator::Plan;
use hrr::integrator::plan::plan;
use hrr::render::{Silent, counters::Seconds, render};
use hrr::scene::Scene;
use hrr::settings::Settings;
use hrr::{Error, Result};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Size of the pilot's image and number of its light subpaths.
const PILOT: (u32, u32, u64) = (64, 48, 4096);

/// The arguments of `hrr effects`.
#[derive(Debug)]
pub struct EffectsArgs {
    /// The scene and its settings.
    scene: SceneArgs,
    /// The one effect whose evidence is wanted.
    why: Option<Effect>,
    /// For programs, not for people.
    json: bool,
    /// How much is said.
    pub verbosity: Verbosity,
}

impl EffectsArgs {
    pub fn new(m: &ArgMatches) -> Self {
        Self {
            scene: SceneArgs::new(m),
            why: m.get_one::<Effect>("why").copied(),
            json: m.get_one::<String>("format").is_some_and(|format| format == "json"),
            verbosity: verbosity(m),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    const OUTPUT: &str = "Output";
    clap::Command::new("effects")
        .about("Say what a scene calls for, why, and what that switches on")
        .after_help("'hrr effects --help' tells more.")
        .after_long_help(EXIT_CODES)
        .arg_required_else_help(true)
        .next_line_help(false)
        .arg(scene_args::scene())
        .arg(
            Arg::new("why")
                .long("why")
                .value_name("EFFECT")
                .help_heading(OUTPUT)
                .value_parser(|text: &str| text.parse::<Effect>())
                .help("Show the evidence for one verdict: materials, triangles, bounds of textures, paths"),
        )
        .arg(
            Arg::new("format")
                .long("format")
                .value_name("FORMAT")
                .help_heading(OUTPUT)
                .value_parser(["table", "json"])
                .help("How it is said [default: table]"),
        )
        .args(scene_args::changes(|_| true))
        .args(message_args())
}

/// The contract of `--format json`.
#[derive(Serialize)]
struct Report<'a> {
    effects: Vec<Row<'a>>,
    plan: PlanRow<'a>,
}

#[derive(Serialize)]
struct Row<'a> {
    id: &'a str,
    verdict: Verdict,
    why: &'a str,
    materials: Vec<&'a str>,
    machinery: &'a [&'a str],
    /// Share of a short pilot's time; `null` where it is not measured by itself.
    cost_percent: Option<f64>,
}

#[derive(Serialize)]
struct PlanRow<'a> {
    integrator: &'a str,
    machinery: &'a [&'a str],
    biased: bool,
}

/// Does it; returns the exit code.
pub fn run(args: &EffectsArgs, log: &Log) -> Result<u8> {
    args.scene.check()?;
    let (scene, settings) = args.scene.load(|warning| log.warning(warning))?;
    let effects = effects::analyze(&scene, &settings);
    let text = if let Some(effect) = args.why {
        why(&effects, effect)
    } else {
        let plan = plan(&scene, &settings, &effects)?;
        let cost = cost(&scene, &settings);
        if args.json {
            json(&effects, &plan, cost.as_ref())
        } else {
            table(&effects, &plan, true, cost.as_ref()).join("\n") + "\n"
        }
    };
    let fail = |e: std::io::Error| Error::Output { path: Path::new("-").to_owned(), message: e.to_string() };
    std::io::stdout().lock().write_all(text.as_bytes()).map_err(fail)?;
    Ok(0)
}

/// Where a short pilot spends its time; `None` when it cannot be rendered.
fn cost(scene: &Scene, settings: &Settings) -> Option<Seconds> {
    let (mut scene, mut settings) = (scene.clone(), settings.clone());
    (scene.film.width, scene.film.height, settings.light_subpaths) = PILOT;
    (settings.samples, settings.iterations, settings.time) = (1, 1, None);
    render(&scene, &settings, &Silent).ok().map(|outcome| outcome.stats.seconds)
}

/// An effect's share of a pilot's time, percent; `None` where it is not measured by itself.
fn percent(effect: Effect, verdict: Verdict, s: &Seconds) -> Option<f64> {
    let all = s.light_trace + s.vertex_bvh_build + s.eye_trace + s.roulette + s.visibility + s.film;
    let part = match effect {
        _ if verdict == Verdict::Absent => 0.0,
        Effect::Direct => s.visibility,
        Effect::Interreflection => s.eye_trace,
        Effect::LightSubpaths => s.light_trace,
        Effect::Sdg => s.vertex_bvh_build + s.roulette,
        _ => return None,
    };
    (all > 0.0).then(|| (1000.0 * part / all).round() / 10.0)
}

/// The table, line by line; without what is absent unless `all`.
pub fn table(effects: &Effects, plan: &Plan, all: bool, cost: Option<&Seconds>) -> Vec<String> {
    let mut lines = vec![format!(
        "{:<18} {:<11} {:<35} {:<46}{}",
        "effect",
        "verdict",
        "machinery",
        "why",
        if cost.is_some() { " cost here" } else { "" }
    )];
    for f in effects.findings.iter().filter(|f| all || f.verdict != Verdict::Absent) {
        let machinery = if f.verdict == Verdict::Wanted { f.machinery.join(" ") } else { String::from("-") };
        let mut why = f.why.clone();
        if !f.materials.is_empty() {
            let names: Vec<_> = f.materials.iter().map(|w| w.material.as_str()).collect();
            let _ = write!(why, " ({})", names.join(", "));
        }
        let cost = cost.map_or(String::new(), |seconds| match percent(f.effect, f.verdict, seconds) {
            Some(percent) => format!(" {percent} %"),
            None => " -".into(),
        });
        lines.push(format!("{:<18} {:<11} {machinery:<35} {why:<46}{cost}", f.effect.id(), f.verdict.name()));
    }
    lines.push(format!("plan: {}, {}", plan.integrator, plan.machinery.join(" ")));
    lines.extend(plan.complaint());
    lines
}

fn json(effects: &Effects, plan: &Plan, cost: Option<&Seconds>) -> String {
    let rows = effects.findings.iter().map(|f| Row {
        id: f.effect.id(),
        verdict: f.verdict,
        why: &f.why,
        materials: f.materials.iter().map(|w| w.material.as_str()).collect(),
        machinery: if f.verdict == Verdict::Wanted { f.machinery } else { &[] },
        cost_percent: cost.and_then(|seconds| percent(f.effect, f.verdict, seconds)),
    });
    let plan =
        PlanRow { integrator: plan.integrator.name(), machinery: &plan.machinery, biased: plan.is_biased() };
    let report = Report { effects: rows.collect(), plan };
    // Texts and finite numbers always serialise.
    serde_json::to_string_pretty(&report).unwrap_or_default() + "\n"
}

/// The evidence for one verdict.
fn why(effects: &Effects, effect: Effect) -> String {
    let f = effects.of(effect);
    let mut text = format!("{}: {}: {}\n", effect, f.verdict.name(), f.why);
    for w in &f.materials {
        let _ = writeln!(text, "  {}, first triangle {}: {}", w.material, w.triangle, w.evidence);
    }
    for class in effects.classes.iter().filter(|class| class.effect == effect) {
        let _ = writeln!(text, "  path {class}");
    }
    text
}
