//! What a study compares: integrators, and settings of one of them.

use clap::{Arg, ArgAction};
use hrr::integrator::{Recipe, Size};
use hrr::report::study::Contender;
use hrr::scene::Scene;
use hrr::settings::{Integrator, Setting, Settings};
use hrr::{Error, Result};

/// Values of one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The setting.
    pub name: &'static str,
    /// Its values as text.
    pub values: Vec<String>,
}

/// What a study sweeps when it is not told: settings of light subpaths, of the roulette, and of ray queries.
const LIGHT: [(&str, &str); 1] = [("mis", "power")];
const ROULETTE: [(&str, &str); 11] = [
    ("expected", "0.1,10,100"),
    ("range", "spheroid,sphere"),
    ("minimum", "semi-stratified,exact,pregenerated"),
    ("lobe_precision", "rebased,f32"),
    ("lobe_widening", "0"),
    ("lobe_floor", "0.1"),
    ("node_padding", "0,100"),
    ("guiding", "off"),
    ("storing", "1"),
    ("hrr_alpha", "0.05"),
    ("connections", "4"),
];
/// Without Embree there is one way to trace rays.
const RAYS: &[(&str, &str)] = if cfg!(feature = "embree") {
    &[("visibility", "obvhs"), ("embree_robust", "off"), ("embree_build", "medium,low")]
} else {
    &[]
};

/// `--sweep`.
pub fn sweep_arg() -> Arg {
    Arg::new("sweep")
        .long("sweep")
        .value_name("NAME=VALUE,...")
        .action(ArgAction::Append)
        .conflicts_with("replot")
        .value_parser(parse)
        .help("Compare these values of a setting, in place of the usual ones; may be given several times")
}

/// `name=value,value`, with values that the setting takes.
fn parse(text: &str) -> std::result::Result<Sweep, String> {
    let (name, values) = text.split_once('=').ok_or("write it as NAME=VALUE,VALUE")?;
    let setting = Setting::find_or_explain(name)?;
    if ["time", "iterations", "error", "first_iteration", "seed", "threads"].contains(&setting.name) {
        return Err(format!("'{}' is not a setting that a study can compare", setting.name));
    }
    let values: Vec<String> = values.split(',').map(|v| v.trim().to_owned()).collect();
    for value in &values {
        Settings::default().set(setting.name, value)?;
    }
    Ok(Sweep { name: setting.name, values })
}

/// The scene's own integrator first, then others that find all of its light, then settings of its own: those of `sweeps`,
/// else the usual ones, or none when `quick`.
///
/// # Errors
/// What the choice of the scene's integrator reports, and a setting's value.
pub fn contenders(
    scene: &Scene,
    settings: &Settings,
    quick: bool,
    sweeps: &[Sweep],
) -> Result<Vec<Contender>> {
    let base = Settings { integrator: hrr::render::chosen(scene, settings)?, ..settings.clone() };
    let biased = |s: &Settings| Recipe::of(s.integrator).is_some_and(|r| r.merges());
    let mut list: Vec<Contender> = Vec::new();
    let mut add = |name: String, settings: Settings| {
        if list.iter().all(|c| c.settings != settings) && hrr::render::chosen(scene, &settings).is_ok() {
            list.push(Contender { name, biased: biased(&settings), settings });
        }
    };
    add(base.integrator.name().into(), base.clone());
    let main = [Integrator::Pt, Integrator::Bpt, Integrator::Lvc, Integrator::LvcHrr, Integrator::PcbptHrr];
    let more = [Integrator::Pcbpt, Integrator::VcmHrr];
    for integrator in main.into_iter().chain(more.into_iter().filter(|_| !quick)) {
        add(integrator.name().into(), Settings { integrator, ..base.clone() });
    }
    let sweeps = if sweeps.is_empty() && !quick { usual(&base, scene) } else { sweeps.to_vec() };
    for Sweep { name, values } in sweeps {
        for value in values {
            let mut changed = base.clone();
            changed.set(name, &value).map_err(|e| Error::Usage(format!("--sweep: {e}")))?;
            add(format!("{name}={value}"), changed);
        }
    }
    Ok(list)
}

/// What is worth comparing for an integrator.
fn usual(base: &Settings, scene: &Scene) -> Vec<Sweep> {
    let recipe = Recipe::of(base.integrator);
    let mut sweeps: Vec<Sweep> = Vec::new();
    let mut add =
        |list: &[(&'static str, &str)]| {
            sweeps.extend(list.iter().map(|&(name, values)| Sweep {
                name,
                values: values.split(',').map(str::to_owned).collect(),
            }));
        };
    if recipe.is_some_and(|r| r.roulette) {
        add(&ROULETTE);
    }
    if recipe.is_some() {
        add(&LIGHT);
    }
    add(RAYS);
    if recipe.is_some() {
        let pixels = Size::of(base, &scene.film).light_subpaths;
        let values = [1, 10].map(|n| (n * pixels).to_string()).to_vec();
        sweeps.push(Sweep { name: "light_subpaths", values });
    }
    sweeps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_are_read_and_checked() {
        let sweep = parse("range=spheroid, sphere").unwrap();
        assert_eq!((sweep.name, sweep.values.len()), ("range", 2));
        assert_eq!(parse("hrr-alpha=0.1").unwrap().name, "hrr_alpha");
        assert!(parse("range").unwrap_err().contains("NAME=VALUE"));
        assert!(parse("range=cube").unwrap_err().contains("one of ellipsoid"));
        assert!(parse("rang=sphere").unwrap_err().contains("did you mean 'range'"));
        assert!(parse("seed=3").unwrap_err().contains("not a setting that a study"));
    }

    #[test]
    fn the_usual_values_are_values() {
        for (name, values) in LIGHT.iter().chain(&ROULETTE).chain(RAYS) {
            let sweep = parse(&format!("{name}={values}")).unwrap();
            for value in sweep.values {
                let mut changed = Settings::default();
                changed.set(name, &value).unwrap();
                assert_ne!(changed, Settings::default(), "{name}={value} is the default");
            }
        }
    }
}
