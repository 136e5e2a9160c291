//! Integrators that share little code must see the same scene.

use crate::support::estimate::{Estimate, estimate};
use hrr::scene::Scene;
use hrr::settings::{Backend, Integrator, Settings};
use std::path::Path;

/// A scene of the project at another size.
fn scene(name: &str, width: u32, height: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
    let size = |key: &str, n: u32| (format!("film.{key}"), n.to_string());
    Scene::load(&path, &[size("width", width), size("height", height)]).unwrap()
}

fn run(scene: &Scene, integrator: Integrator, iterations: u64, samples: u32) -> Estimate {
    let visibility = Backend::Obvhs;
    let settings =
        Settings { integrator, visibility, iterations, samples, max_depth: 8, ..Settings::default() };
    estimate(scene, &settings, 8)
}

#[test]
fn all_integrators_agree_on_cornell() {
    let scene = scene("cornell", 32, 32);
    let pt = run(&scene, Integrator::Pt, 64, 16);
    for integrator in [Integrator::Lt, Integrator::Bpt, Integrator::Lvc, Integrator::LvcHrr] {
        let start = std::time::Instant::now();
        run(&scene, integrator, 64, 16).assert_agrees(&pt, 0.005, integrator.name());
        println!("{:?}", start.elapsed());
    }
}
