//! Outliers are rejected: what that does to noise, to light, and to the plain image.

use crate::support::scenes;
use hrr::image::Image;
use hrr::math::luminance;
use hrr::render::{Outcome, Silent, render};
use hrr::scene::Scene;
use hrr::settings::{Integrator, Settings, Switch};

fn run(scene: &Scene, settings: Settings) -> Outcome {
    render(scene, &settings, &Silent).unwrap()
}

fn rejecting(integrator: Integrator, samples: u32, seed: u64) -> Settings {
    let outlier_rejection = Switch::On;
    Settings { integrator, samples, seed, iterations: 1, time: None, outlier_rejection, ..scenes::settings() }
}

fn mean(image: &Image) -> f64 {
    image.pixels.iter().map(|p| luminance(p.as_dvec3())).sum::<f64>() / image.pixels.len() as f64
}

/// Mean square difference of two images.
fn difference(a: &Image, b: &Image) -> f64 {
    let squares = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).length_squared());
    f64::from(squares.sum::<f32>()) / a.pixels.len() as f64
}

/// A path tracer meets the caustics of a glass ball in a few bright samples.
#[test]
fn images_of_two_seeds_differ_less_and_the_plain_one_is_what_it_was() {
    let scene = scenes::load("glass_caustic", &[("film.width", "64"), ("film.height", "48")]);
    // Bright samples are rare: one or two of eight renders have one.
    let runs = [1, 2, 3, 4, 5, 6, 7, 8].map(|seed| rejecting(Integrator::Pt, 32, seed)).map(|settings| {
        let with = run(&scene, settings.clone());
        let without = run(&scene, Settings { outlier_rejection: Switch::Off, ..settings });
        assert!(with.film.image() == without.film.image() && without.image() == without.film.image());
        assert!(with.stats.biased && !without.stats.biased);
        with
    });
    let of_pairs = |image: &dyn Fn(&Outcome) -> Image| -> f64 {
        runs.chunks(2).map(|pair| difference(&image(&pair[0]), &image(&pair[1]))).sum::<f64>() / 4.0
    };
    let (plain, rejected) = (of_pairs(&|run| run.film.image()), of_pairs(&Outcome::image));
    println!("mean square difference of two seeds: {plain}, without outliers {rejected}");
    assert!(rejected < 1e-3 * plain, "{rejected} {plain}");
}

/// The light that is left out goes to zero with the number of samples, and is little where there are no rare bright ones.
#[test]
fn less_is_left_out_of_more_samples() {
    let scene = scenes::box_of_everything();
    let lost = [4, 32, 256].map(|samples| {
        let outcome = run(&scene, rejecting(Integrator::Pt, samples, 1));
        1.0 - mean(&outcome.image()) / mean(&outcome.film.image())
    });
    println!("left out of 4, 32 and 256 samples: {lost:?}");
    assert!(lost[0] > lost[1] && lost[1] > lost[2] && lost[2] >= 0.0, "{lost:?}");
    assert!(lost[2] < 0.01, "{lost:?}");
}

#[test]
fn threads_and_parts_do_not_matter() {
    let scene = scenes::box_of_everything();
    let part = |threads, first_iteration, iterations| {
        let settings = rejecting(Integrator::LvcHrr, 4, 1);
        run(&scene, Settings { threads, first_iteration, iterations, ..settings })
    };
    let whole = part(1, 0, 4).image();
    assert!(whole != part(1, 0, 4).film.image(), "there are no outliers");
    assert!(whole == part(2, 0, 4).image());
    let (mut first, second) = (part(2, 2, 2).film, part(2, 0, 2).film);
    first.merge(&second).unwrap();
    assert!(Some(whole) == first.without_outliers());
}
