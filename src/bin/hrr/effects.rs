//! `hrr effects`: what a scene calls for, why, and what that switches on.

use crate::args::{EXIT_CODES, message_args, verbosity};
use crate::log::{Log, Verbosity};
use crate::pilot::{Cost, Pilot};
use crate::scene_args::{self, SceneArgs};
use clap::{Arg, ArgMatches};
use hrr::effects::{self, Effect, Effects, Finding, Verdict};
use hrr::integrator::Plan;
use hrr::integrator::plan::plan;
use hrr::{Error, Result};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// The arguments of `hrr effects`.
#[derive(Debug)]
pub struct EffectsArgs {
    /// The scene and its settings.
    scene: SceneArgs,
    /// The name of the one effect whose evidence is wanted.
    why: Option<String>,
    /// For programs, not for people.
    json: bool,
    /// How much is said.
    pub verbosity: Verbosity,
}

impl EffectsArgs {
    pub fn new(m: &ArgMatches) -> Self {
        Self {
            scene: SceneArgs::new(m),
            why: m.get_one::<String>("why").cloned(),
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
    /// Share of a short pilot's time; `null` where it cannot be told.
    cost_percent: Option<f64>,
    /// How that is known, or why not.
    cost_basis: &'a str,
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
    let text = if let Some(id) = &args.why {
        why(&effects, named(&effects, id)?)
    } else {
        let plan = plan(&scene, &settings, &effects)?;
        let pilot = Pilot::new(&scene, &settings, &effects);
        if args.json {
            json(&effects, &plan, pilot.as_ref())
        } else {
            table(&effects, &plan, true, pilot.as_ref()).join("\n") + "\n"
        }
    };
    let fail = |e: std::io::Error| Error::Output { path: Path::new("-").to_owned(), message: e.to_string() };
    std::io::stdout().lock().write_all(text.as_bytes()).map_err(fail)?;
    Ok(0)
}

/// The finding of a name, be it that of an effect or of what the scene asks for and hrr has not got.
fn named<'a>(effects: &'a Effects, id: &str) -> Result<&'a Finding> {
    if let Some(finding) = effects.named(id) {
        return Ok(finding);
    }
    let effect = id.parse::<Effect>().map_err(|e| Error::Usage(format!("--why: {e}")))?;
    Ok(effects.of(effect))
}

/// The table, line by line; without what is absent unless `all`.
pub fn table(effects: &Effects, plan: &Plan, all: bool, pilot: Option<&Pilot>) -> Vec<String> {
    let mut lines = vec![format!(
        "{:<18} {:<11} {:<35} {:<46}{}",
        "effect",
        "verdict",
        "machinery",
        "why",
        if pilot.is_some() { " cost here" } else { "" }
    )];
    for f in effects.findings.iter().filter(|f| all || f.verdict != Verdict::Absent) {
        let machinery = if f.verdict == Verdict::Wanted { f.machinery.join(" ") } else { String::from("-") };
        let mut why = f.why.clone();
        if !f.materials.is_empty() {
            let names: Vec<_> = f.materials.iter().map(|w| w.material.as_str()).collect();
            let _ = write!(why, " ({})", names.join(", "));
        }
        let cost = pilot.map_or(String::new(), |pilot| match pilot.cost(f) {
            Cost::Measured(percent) => format!(" {percent} %"),
            Cost::Estimated(percent) => format!(" est. {percent} %"),
            Cost::Unknown(reason) => format!(" - ({reason})"),
        });
        lines.push(format!("{:<18} {:<11} {machinery:<35} {why:<46}{cost}", f.id, f.verdict.name()));
    }
    lines.push(format!("plan: {}, {}", plan.integrator, plan.machinery.join(" ")));
    lines.extend(plan.complaint());
    lines
}

fn json(effects: &Effects, plan: &Plan, pilot: Option<&Pilot>) -> String {
    let rows = effects.findings.iter().map(|f| {
        let (cost_percent, cost_basis) = match pilot.map(|pilot| pilot.cost(f)) {
            Some(Cost::Measured(percent)) => (Some(percent), "measured"),
            Some(Cost::Estimated(percent)) => (Some(percent), "estimated: pilots with it and without"),
            Some(Cost::Unknown(reason)) => (None, reason),
            None => (None, "no pilot could be rendered"),
        };
        Row {
            id: &f.id,
            verdict: f.verdict,
            why: &f.why,
            materials: f.materials.iter().map(|w| w.material.as_str()).collect(),
            machinery: if f.verdict == Verdict::Wanted { f.machinery } else { &[] },
            cost_percent,
            cost_basis,
        }
    });
    let plan =
        PlanRow { integrator: plan.integrator.name(), machinery: &plan.machinery, biased: plan.is_biased() };
    let report = Report { effects: rows.collect(), plan };
    // Texts and finite numbers always serialise.
    serde_json::to_string_pretty(&report).unwrap_or_default() + "\n"
}

/// The evidence for one verdict.
fn why(effects: &Effects, f: &Finding) -> String {
    let mut text = format!("{}: {}: {}\n", f.id, f.verdict.name(), f.why);
    for w in &f.materials {
        let _ = writeln!(text, "  {}, first triangle {}: {}", w.material, w.triangle, w.evidence);
    }
    for class in effects.classes.iter().filter(|class| class.effect.id() == f.id) {
        let _ = writeln!(text, "  path {class}");
    }
    text
}
