//! The same bits, whoever computes them and in how many parts.

use crate::support::scenes;
use hrr::film::Film;
use hrr::render::{Silent, render};
use hrr::settings::{Backend, Integrator, Settings};

fn bits(film: &Film) -> Vec<[u64; 3]> {
    let pixels = (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| film.mean(x, y).to_array().map(f64::to_bits)).collect()
}

fn run(settings: &Settings, threads: usize, first_iteration: u64, iterations: u64) -> Film {
    let scene = scenes::box_of_everything();
    let settings = Settings {
        threads,
        first_iteration,
        iterations,
        visibility: Backend::Obvhs,
        // Light tracing sees no mirrors.
        without: "specular".parse().unwrap(),
        ..settings.clone()
    };
    render(&scene, &settings, &Silent).unwrap().film
}

#[test]
fn threads_and_parts_do_not_matter() {
    for integrator in [Integrator::Pt, Integrator::Lt, Integrator::Bpt, Integrator::Lvc, Integrator::LvcHrr] {
        check(&Settings { integrator, ..scenes::settings() }, integrator.name());
    }
}

/// Returns the image.
fn check(settings: &Settings, name: &str) -> Vec<[u64; 3]> {
    let whole = run(settings, 1, 0, 8);
    assert_eq!(bits(&whole), bits(&run(settings, 2, 0, 8)), "{name}: 1 and 2 threads");
    let mut sum = run(settings, 2, 4, 4);
    assert_ne!(bits(&whole), bits(&sum));
    sum.merge(&run(settings, 2, 0, 4)).unwrap();
    assert_eq!(bits(&whole), bits(&sum), "{name}: 0..4 and 4..8");
    bits(&whole)
}

#[test]
fn threads_and_parts_do_not_matter_to_the_numerics_of_the_roulette() {
    let changes = [
        ("range", "ellipsoid"),
        ("range", "spheroid"),
        ("range", "sphere"),
        ("minimum", "semi-stratified"),
        ("minimum", "exact"),
        ("minimum", "pregenerated"),
        ("lobe_precision", "rebased"),
        ("lobe_precision", "f32"),
        ("lobe_widening", "0"),
        ("lobe_floor", "0.1"),
    ];
    let mut images = Vec::new();
    for (name, value) in changes {
        let mut settings = Settings { integrator: Integrator::LvcHrr, ..scenes::settings() };
        settings.set(name, value).unwrap();
        images.push(check(&settings, value));
        let last = images.len() - 1;
        assert!(!images[..last].contains(&images[last]), "{name} = {value} changes nothing");
    }
}
