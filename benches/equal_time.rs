//! Recipes against each other at equal time, as the slides compare them: each is run several times with different seeds,
//! in turn with the others, and every run's errors are written down.
//!
//! `cargo bench --bench equal_time -- STUDY DIRECTORY [seconds] [runs] [size] [threads] [scenes] [recipes]`
//!
//! STUDY: `mirror`, `brushed`, `ranges`, `merging`, `graceful`, `graceful_pc`, `convergence`, `additions`, `energy` (see [`study::of`]). Writes DIRECTORY/STUDY.csv, a picture of each
//! recipe's first run and one of where its runs differ; benches/record/equal_time.md tells what came of it.

#[path = "support/equal_time/measure.rs"]
mod measure;
#[path = "support/equal_time/study.rs"]
mod study;

use hrr::image::{self, Image};
use hrr::render::counters::processor_seconds;
use hrr::render::{Silent, render};
use hrr::settings::Settings;
use measure::{Cost, Errors, Run, Yardstick};
use std::path::Path;
use std::time::Instant;
use study::{Recipe, Variant};

/// Added to the seeds of what errors are measured against.
const REFERENCE_SEED: u64 = 1000;
/// Runs of the reference, and how many times longer than the others they are.
const REFERENCE: (u64, f64) = (2, 2.0);

/// How much is run.
struct Budget {
    seconds: f64,
    runs: u64,
    threads: usize,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let [name, directory] = [0, 1].map(|i| args.get(i).map(String::as_str));
    let (Some(name), Some(directory)) = (name, directory) else {
        println!(
            "equal_time: STUDY DIRECTORY [seconds] [runs] [size] [threads] [scene,scene...] [recipe,recipe...]"
        );
        return;
    };
    let number = |i: usize, default: f64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let size = args.get(4).map_or("400x300", String::as_str);
    let size: Vec<u32> = size.split('x').map(|n| n.parse().expect("WIDTHxHEIGHT")).collect();
    let budget =
        Budget { seconds: number(2, 60.0), runs: number(3, 8.0) as u64, threads: number(5, 0.0) as usize };
    let (mut variants, mut recipes) = study::of(name, [size[0], size[1]]).expect("one of the studies");
    let among = |i: usize, name: &str| args.get(i).is_none_or(|list| list.split(',').any(|n| n == name));
    variants.retain(|variant| among(6, variant.name.split(' ').next().unwrap_or_default()));
    recipes.retain(|recipe| among(7, recipe.name));
    let mut table = String::from(measure::HEADER);
    for variant in &variants {
        table += &compare(variant, &recipes, &budget, Path::new(directory));
        hrr::file::replace(&Path::new(directory).join(format!("{name}.csv")), table.as_bytes())
            .expect("a file");
    }
}

/// Runs the recipes on a scene; the rows of the table.
fn compare(variant: &Variant, recipes: &[Recipe], budget: &Budget, directory: &Path) -> String {
    let settings = |recipe: &Recipe, seed: u64, seconds: f64| {
        let threads = budget.threads;
        let time = Some(seconds * variant.time);
        (recipe.set)(Settings { seed, time, threads, ..variant.scene.settings.clone() })
    };
    let reference = variant.referee.as_ref().map(|referee| {
        let seconds = budget.seconds * REFERENCE.1;
        let runs =
            (0..REFERENCE.0).map(|i| run(variant, &settings(referee, REFERENCE_SEED + i, seconds)).image);
        runs.collect::<Vec<_>>()
    });
    let mut runs: Vec<Vec<Run>> = recipes.iter().map(|_| Vec::new()).collect();
    for seed in 0..budget.runs {
        for (recipe, runs) in recipes.iter().zip(&mut runs) {
            runs.push(run(variant, &settings(recipe, seed, budget.seconds)));
        }
    }
    let mut rows = String::new();
    let mut first: Option<Vec<Errors>> = None;
    for (recipe, runs) in recipes.iter().zip(&runs) {
        let yardstick = Yardstick::new(&variant.region, reference.as_deref(), runs);
        let mut sums = Vec::new();
        for (seed, run) in runs.iter().enumerate() {
            let errors = yardstick.errors(&run.image);
            rows += &measure::row(variant, recipe, seed, &run.cost, &errors);
            sums.push(errors);
        }
        println!("{:24} {:22} {}", variant.name, recipe.name, measure::summary(runs, &sums));
        match &first {
            Some(first) => println!("{:24} over the first{:8} {}", "", "", measure::ratios(first, &sums)),
            None => first = Some(sums),
        }
        picture(directory, &format!("{}_{}", variant.name, recipe.name), &runs[0].image);
        picture(
            directory,
            &format!("{}_{}_error", variant.name, recipe.name),
            &yardstick.map(&runs[0].image),
        );
    }
    if let Some(images) = &reference {
        picture(directory, &format!("{}_reference", variant.name), &measure::mean(images.iter()));
    }
    rows
}

fn run(variant: &Variant, settings: &Settings) -> Run {
    let (start, cpu) = (Instant::now(), processor_seconds());
    let outcome = render(&variant.scene, settings, &Silent).expect("a render");
    let cost = Cost {
        seconds: start.elapsed().as_secs_f64(),
        cpu: processor_seconds().zip(cpu).map_or(f64::NAN, |(now, start)| now - start),
        iterations: outcome.stats.iterations,
    };
    Run { image: outcome.film.image(), cost }
}

fn picture(directory: &Path, name: &str, picture: &Image) {
    let name = name.replace([' ', '+'], "_");
    std::fs::create_dir_all(directory).expect("a directory");
    for end in ["png", "exr"] {
        let path = directory.join(format!("{name}.{end}"));
        image::write(&path, picture, &Default::default()).expect("a picture");
    }
}
