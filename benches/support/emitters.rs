//! What points of lights as vertices gain where lamps are many, and what they cost elsewhere.

use crate::workload::cpu_seconds;
use crate::{load, scenes};
use hrr::film::{Film, FilmSettings};
use hrr::math::luminance;
use hrr::scene::Scene;
use hrr::settings::{AutoSwitch, Integrator, Settings};
use hrr::subpath::World;

/// Mean and square of each pixel over iterations, and the time.
struct Sums {
    pixels: Vec<[f64; 2]>,
    seconds: f64,
    accepted: u64,
    queries: u64,
}

impl Sums {
    /// Each pixel's variance over the image's mean square, sorted.
    fn variances(&self, rounds: u64) -> Vec<f64> {
        let n = rounds as f64;
        let scale = self.pixels.iter().map(|p| (p[0] / n).powi(2)).sum::<f64>() / self.pixels.len() as f64;
        let variance = |p: &[f64; 2]| (p[1] / n - (p[0] / n).powi(2)) * n / (n - 1.0) / scale;
        let mut all: Vec<f64> = self.pixels.iter().map(variance).collect();
        all.sort_by(f64::total_cmp);
        all
    }
}

/// Iterations with and without, in turn; variance of a pixel over them times seconds.
fn compare(name: &str, scene: &Scene, settings: &Settings, rounds: u64) {
    let variants = [AutoSwitch::Off, AutoSwitch::On].map(|emitters| Settings {
        integrator: Integrator::LvcHrr,
        emitters,
        ..settings.clone()
    });
    let world = World::new(scene, &variants[0]).expect("a world");
    let mut machines =
        variants.each_ref().map(|settings| hrr::integrator::new(&world, settings).expect("a light pass"));
    let count = (scene.film.width * scene.film.height) as usize;
    let mut sums =
        [(); 2].map(|()| Sums { pixels: vec![[0.0; 2]; count], seconds: 0.0, accepted: 0, queries: 0 });
    for round in 0..rounds {
        // Neither is always the first.
        for which in [round as usize % 2, 1 - round as usize % 2] {
            let (machine, sums) = (&mut machines[which], &mut sums[which]);
            let mut film = Film::new(&scene.film);
            let start = cpu_seconds();
            let tally = machine.iterate(round, &mut film, &|_| ()).expect("an iteration");
            sums.seconds += cpu_seconds() - start;
            sums.accepted += tally.emitters.accepted;
            sums.queries += tally.emitters.queries;
            for (i, sum) in sums.pixels.iter_mut().enumerate() {
                let y = luminance(film.mean(i as u32 % scene.film.width, i as u32 / scene.film.width));
                (sum[0], sum[1]) = (sum[0] + y, sum[1] + y * y);
            }
        }
    }
    let [off, on] = &sums;
    let time = on.seconds / off.seconds;
    let [a, b] = [off, on].map(|sums| sums.variances(rounds));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let trimmed = |v: &[f64]| mean(&v[..v.len() - v.len() / 100]);
    let ratios = [mean(&b) / mean(&a), trimmed(&b) / trimmed(&a), b[b.len() / 2] / a[a.len() / 2]];
    let [all, less, median] = ratios.map(|r| r * time);
    println!(
        "{name}, {} samples: kept {:.2} a query; on over off: time {time:.3}; variance x time {all:.3}, without the worst \
         1 % {less:.3}, median {median:.3}",
        settings.samples,
        on.accepted as f64 / on.queries.max(1) as f64
    );
}

/// Variance times time, on over off: the lamps' scene, and scenes of one lamp. One thread and its processor time, so that
/// other programs on the machine do not count.
pub fn emitters(rounds: u64) {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    one.install(|| compare_all(rounds));
}

fn compare_all(rounds: u64) {
    let film = FilmSettings { width: 128, height: 96, ..FilmSettings::default() };
    let mut lamps = scenes::lamps_over_a_glossy_floor(14);
    lamps.film = film.clone();
    for samples in [1, 16] {
        for expected in [0.25, 1.0, 4.0] {
            let settings = Settings { samples, expected, ..Settings::default() };
            compare(&format!("196 lamps, expected {expected}"), &lamps, &settings, 4 * rounds);
        }
    }
    let mut few = scenes::lamps_over_a_glossy_floor(4);
    few.film = film;
    compare("16 lamps", &few, &Settings { samples: 4, ..Settings::default() }, rounds);
    for name in ["caustic_mirror", "cornell", "mirror_room"] {
        let scene = load(name);
        compare(name, &scene, &Settings { samples: 4, ..scene.settings.clone() }, rounds);
    }
}
