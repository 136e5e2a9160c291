//! Time to a given error: `auto` against every fixed recipe that finds all of a scene's light.

use super::load;
use glam::Vec3;
use hrr::image::Image;
use hrr::render::{Silent, chosen, render};
use hrr::report::metric::compare;
use hrr::scene::Scene;
use hrr::settings::{Integrator, Settings};
use std::path::Path;

/// Pixels of an image.
const PIXELS: f64 = 7500.0;
/// The recipe that references are made by, how many runs of it, and how much longer each takes.
const REFERENCE: (Integrator, usize, f64) = (Integrator::Auto, 2, 6.0);
/// What is compared.
const RECIPES: [Integrator; 9] = [
    Integrator::Auto,
    Integrator::Pt,
    Integrator::Bpt,
    Integrator::Lvc,
    Integrator::LvcHrr,
    Integrator::Pcbpt,
    Integrator::PcbptHrr,
    Integrator::Vcm,
    Integrator::VcmHrr,
];

/// Names of all scenes of the project, in order.
fn scenes() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let entries = std::fs::read_dir(folder).expect("the scenes").filter_map(Result::ok);
    let mut names: Vec<String> = entries
        .filter(|e| e.path().join("scene.toml").is_file())
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// `runs` of `seconds` each for every recipe and scene, in turns.
pub fn recipes(only: Option<&str>, seconds: f64, runs: u64) {
    println!(
        "Squares of errors times seconds, over those of the best fixed recipe: how much longer to the same error. Left: all \
         pixels but the worst thousandth, relative to their tiles; right: all pixels, relative to themselves."
    );
    for name in scenes().iter().filter(|name| only.is_none_or(|only| only == *name)) {
        of_scene(name, seconds, runs);
    }
}

/// What a render of a time gives, and the seconds that it really took.
fn run(scene: &Scene, integrator: Integrator, seed: u64, seconds: f64) -> (Image, f64) {
    let settings = Settings { integrator, seed, time: Some(seconds), ..scene.settings.clone() };
    let start = std::time::Instant::now();
    let outcome = render(scene, &settings, &Silent).expect("an image");
    (outcome.film.image(), start.elapsed().as_secs_f64())
}

fn of_scene(name: &str, seconds: f64, runs: u64) {
    let mut scene = load(name);
    let shrink = (PIXELS / (f64::from(scene.film.width) * f64::from(scene.film.height))).sqrt();
    let side = |n: u32| (f64::from(n) * shrink).round() as u32;
    (scene.film.width, scene.film.height) = (side(scene.film.width), side(scene.film.height));
    let covers = |integrator: &Integrator| {
        chosen(&scene, &Settings { integrator: *integrator, ..scene.settings.clone() }).is_ok()
    };
    let recipes: Vec<Integrator> = RECIPES.into_iter().filter(covers).collect();
    let (by, count, longer) = REFERENCE;
    let parts: Vec<Image> =
        (0..count as u64).map(|seed| run(&scene, by, 1000 + seed, longer * seconds).0).collect();
    let pixels = 0..parts[0].pixels.len();
    let mean = |i: usize| parts.iter().map(|part| part.pixels[i]).sum::<Vec3>() / count as f32;
    let reference = Image { pixels: pixels.map(mean).collect(), ..parts[0].clone() };
    // What the reference's own noise adds: a part is as far from the mean of both as the mean is from the truth.
    let squares = |image: &Image| {
        let m = compare(image, &reference, None, 0.0).expect("images of one size");
        [m.error * m.error, m.relmse]
    };
    let own = squares(&parts[0]);
    // Sums of squares and seconds.
    let mut sums = vec![([0.0; 2], 0.0); recipes.len()];
    for seed in 1..=runs {
        for (sum, &recipe) in sums.iter_mut().zip(&recipes) {
            let (image, took) = run(&scene, recipe, seed, seconds);
            let squares = squares(&image);
            (0..2).for_each(|i| sum.0[i] += squares[i] - own[i]);
            sum.1 += took;
        }
    }
    let n = runs as f64;
    // Where only one run of one recipe is resolved from the reference's noise, its time is not known, but small.
    let work = |(squares, took): &([f64; 2], f64)| squares.map(|s| s.max(0.0) / n * took / n);
    let best = |i: usize| {
        let fixed = recipes.iter().zip(&sums).filter(|(r, _)| **r != Integrator::Auto);
        fixed.map(|(_, sum)| work(sum)[i]).fold(f64::INFINITY, f64::min)
    };
    let best = [best(0), best(1)];
    let plan = chosen(&scene, &Settings { integrator: Integrator::Auto, ..scene.settings.clone() });
    println!(
        "\n{name}, {}x{}, {runs} runs of {seconds} s; auto: {}; the reference's own error {:.4}, {:.4}\n\n\
         | recipe | seconds | error | root of relMSE | time to error, over the best | by relMSE |\n|---|---|---|---|---|---|",
        scene.film.width,
        scene.film.height,
        plan.expect("a plan"),
        own[0].sqrt(),
        own[1].sqrt(),
    );
    for (recipe, sum) in recipes.iter().zip(&sums) {
        let (work, [error, relmse]) = (work(sum), sum.0.map(|s| (s.max(0.0) / n).sqrt()));
        println!(
            "| `{recipe}` | {:.2} | {error:.4} | {relmse:.4} | {:.2} | {:.2} |",
            sum.1 / n,
            work[0] / best[0],
            work[1] / best[1]
        );
    }
}
