//! The same bits, whoever computes them and in how many parts.

use crate::support::scenes;
use hrr::film::Film;
use hrr::render::{Silent, render};
use hrr::settings::{Backend, Integrator, Settings};

fn bits(film: &Film) -> Vec<[u64; 3]> {
    let pixels = (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| film.mean(x, y).to_array().map(f64::to_bits)).collect()
}

fn run(integrator: Integrator, threads: usize, first_iteration: u64, iterations: u64) -> Film {
    let scene = scenes::box_of_everything();
    let settings = Settings {
        integrator,
        threads,
        first_iteration,
        iterations,
        visibility: Backend::Obvhs,
        // Light tracing sees no mirrors.
        without: "specular".parse().unwrap(),
        ..Settings::default()
    };
    render(&scene, &settings, &Silent).unwrap().film
}

#[test]
fn threads_and_parts_do_not_matter() {
    for integrator in [Integrator::Pt, Integrator::Lt, Integrator::Bpt, Integrator::Lvc, Integrator::LvcHrr] {
        let whole = run(integrator, 1, 0, 8);
        assert_eq!(bits(&whole), bits(&run(integrator, 2, 0, 8)), "{integrator:?}: 1 and 2 threads");
        let mut sum = run(integrator, 2, 4, 4);
        assert_ne!(bits(&whole), bits(&sum));
        sum.merge(&run(integrator, 2, 0, 4)).unwrap();
        assert_eq!(bits(&whole), bits(&sum), "{integrator:?}: 0..4 and 4..8");
    }
}
