//! Whole integrators: what the roulette gains on a caustic seen in a mirror, how many rays per second the path tracer
//! keeps of what its ray queries alone would reach, and what points of lights as vertices gain and cost.
//!
//! `cargo bench --bench integrators -- caustic [scene] [seconds] [light subpaths] [samples]`
//! `cargo bench --bench integrators -- rays`
//! `cargo bench --bench integrators -- emitters [rounds]`
//! `cargo bench --bench integrators -- recipes [seconds] [runs] [scene]`: `auto` against fixed recipes
//! `cargo bench --bench integrators -- auto [pairs]`: `auto` against `pt` where all is diffuse

#[cfg(feature = "embree")]
#[path = "support/bare_embree.rs"]
mod bare_embree;
#[path = "support/emitters.rs"]
mod emitters;
#[path = "../tests/support/scenes.rs"]
#[expect(dead_code, reason = "only one is wanted")]
mod scenes;
#[path = "support/recipes.rs"]
mod recipes;
#[path = "support/workload.rs"]
#[expect(dead_code, reason = "only its clock is wanted")]
mod workload;

use hrr::film::Film;
use hrr::math::luminance;
use hrr::render::counters::processor_seconds;
use hrr::scene::Scene;
use hrr::settings::{AutoSwitch, Heuristic, Integrator, Settings};
use hrr::subpath::World;
use hrr::visibility::{Hit, Ray, Visibility};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Instant;
use workload::cpu_seconds;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let run = |name: &str| args.is_empty() || args[0] == name;
    let number = |i: usize, default: f64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    if run("caustic") {
        let scene = args.get(1).map_or("caustic_mirror", String::as_str);
        caustic(scene, number(2, 60.0), number(3, 1e6) as u64, number(4, 8.0) as u32);
    }
    if run("rays") {
        rays();
    }
    if run("emitters") {
        emitters::emitters(number(1, 12.0) as u64);
    }
    if run("recipes") {
        recipes::recipes(args.get(3).map(String::as_str), number(1, 4.0), number(2, 4.0) as u64);
    }
    if run("auto") {
        auto_where_all_is_diffuse(number(1, 15.0) as usize);
    }
}

/// Whole renders of `cornell` with a diffuse block, one thread: what the analysis and the choice cost.
fn auto_where_all_is_diffuse(pairs: usize) {
    let mut scene = load("cornell");
    for material in scene.materials.iter_mut().filter(|m| m.name == "metal") {
        *material = hrr::material::Material::diffuse("metal", hrr::math::Spectrum::splat(0.7));
    }
    let seconds = |integrator: Integrator| {
        let settings =
            Settings { integrator, threads: 1, iterations: 8, time: None, ..scene.settings.clone() };
        let start = processor_seconds();
        let outcome = hrr::render::render(&scene, &settings, &hrr::render::Silent).expect("an image");
        assert_eq!(outcome.stats.integrator, "pt");
        processor_seconds().zip(start).map_or(f64::NAN, |(now, start)| now - start)
    };
    let mut ratios: Vec<f64> = (0..pairs)
        .map(|i| match i % 2 {
            0 => seconds(Integrator::Auto) / seconds(Integrator::Pt),
            _ => 1.0 / (seconds(Integrator::Pt) / seconds(Integrator::Auto)),
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!(
        "diffuse cornell: time of auto over that of pt, {pairs} pairs in turns: median {:.4}, quartiles {:.4} and {:.4}",
        ratios[pairs / 2],
        ratios[pairs / 4],
        ratios[3 * pairs / 4]
    );
}

fn load(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
    Scene::load(&path, &[]).expect("a scene of the project")
}

/// An integrator and the film that it fills.
struct Contender<'a> {
    name: String,
    integrator: Box<dyn hrr::integrator::Integrator + 'a>,
    film: Film,
    iterations: u64,
    seconds: f64,
}

impl<'a> Contender<'a> {
    fn new(name: &str, world: &'a World<'a>, settings: &'a Settings) -> Self {
        let start = Instant::now();
        let integrator = hrr::integrator::new(world, settings).expect("a light pass");
        Self {
            name: format!("{name}, {} light subpaths, {} samples", settings.light_subpaths, settings.samples),
            integrator,
            film: Film::new(&world.scene.film),
            iterations: 0,
            // Pre-passes count.
            seconds: start.elapsed().as_secs_f64(),
        }
    }

    fn iterate(&mut self) {
        let start = Instant::now();
        self.integrator.iterate(self.iterations, &mut self.film, &|_| ()).expect("an iteration");
        self.seconds += start.elapsed().as_secs_f64();
        self.iterations += 1;
    }

    fn luminances(&self, pixels: &[(u32, u32)]) -> Vec<f64> {
        pixels.iter().map(|&(x, y)| luminance(self.film.mean(x, y))).collect()
    }
}

/// Square difference over the square of the reference: the mean over all pixels, the mean without the worst hundredth
/// of them, the median.
fn relative_mse(image: &[f64], reference: &[f64]) -> [f64; 3] {
    let error = |(a, r): (&f64, &f64)| (a - r) * (a - r) / (r * r + 1e-6);
    let mut squares: Vec<f64> = image.iter().zip(reference).map(error).collect();
    squares.sort_by(f64::total_cmp);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    [mean(&squares), mean(&squares[..squares.len() - squares.len() / 100]), squares[squares.len() / 2]]
}

/// Prints the errors of some runs in some pixels. The reference is the mean of the last two runs, whose own error, told
/// by their difference, is taken off.
fn report(region: &str, runs: &[Contender<'_>], pixels: &[(u32, u32)]) {
    let (runs, references) = runs.split_at(runs.len() - 2);
    let [a, b] = [0, 1].map(|i| references[i].luminances(pixels));
    let reference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a + b) / 2.0).collect();
    // Each lies from the mean by as much as the mean lies from the truth.
    let noise = relative_mse(&a, &reference);
    println!("{region}: {} pixels; reference's own relMSE {:.2e}, {:.2e}", pixels.len(), noise[0], noise[1]);
    let errors = |run: &Contender<'_>| {
        let measured = relative_mse(&run.luminances(pixels), &reference);
        [0, 1, 2].map(|k| measured[k] - noise[k])
    };
    let ours = errors(&runs[0]);
    for run in runs {
        let [all, trimmed, median] = errors(run);
        println!(
            "  {:62} {:4} iterations, {:5.1} s: relMSE {all:.3e} (x{:.2}), without the worst 1 % {trimmed:.3e} (x{:.2}), \
             median {median:.3e} (x{:.2})",
            run.name,
            run.iterations,
            run.seconds,
            all / ours[0],
            trimmed / ours[1],
            median / ours[2]
        );
    }
}

/// The error in the mirror's pixels at equal time: plain picks from the cache, with small and with large iterations,
/// against the roulette. The reference is two long renders with the roulette and other seeds. Iterations are run in turn.
fn caustic(name: &str, seconds: f64, light_subpaths: u64, samples: u32) {
    let scene = load(name);
    let roulette =
        Settings { integrator: Integrator::LvcHrr, light_subpaths, samples, ..scene.settings.clone() };
    let others = [
        ("lvc", Settings { integrator: Integrator::Lvc, light_subpaths: 0, samples: 1, ..roulette.clone() }),
        ("lvc", Settings { integrator: Integrator::Lvc, ..roulette.clone() }),
        ("lvc+hrr, power heuristic", Settings { mis: Heuristic::Power, ..roulette.clone() }),
        ("lvc+hrr, all light vertices stored", Settings { storing: 1.0, ..roulette.clone() }),
        ("lvc+hrr, unguided", Settings { guiding: AutoSwitch::Off, ..roulette.clone() }),
        ("lvc+hrr, neither", Settings { guiding: AutoSwitch::Off, storing: 1.0, ..roulette.clone() }),
    ];
    let seeds = [1, 2].map(|seed| Settings { seed, ..roulette.clone() });
    let world = World::new(&scene, &roulette).expect("a world");
    let camera = &world.camera;
    let pixels: Vec<(u32, u32)> = (0..scene.film.width * scene.film.height)
        .map(|i| (i % scene.film.width, i / scene.film.width))
        .filter(|&(x, y)| {
            let direction = camera.direction(glam::DVec2::new(x.into(), y.into()) + 0.5);
            let ray = hrr::visibility::offset::from_free_point(camera.position, direction);
            world.intersect(&ray, camera.position, direction).is_some_and(|p| {
                scene.materials[scene.mesh.materials[p.triangle as usize] as usize].name == "mirror"
            })
        })
        .collect();
    assert!(!pixels.is_empty(), "no pixel sees a material named 'mirror'");
    let mut runs = vec![Contender::new("lvc+hrr", &world, &roulette)];
    runs.extend(others.iter().map(|(name, settings)| Contender::new(name, &world, settings)));
    runs.extend(seeds.iter().map(|settings| Contender::new("reference", &world, settings)));
    // References get twice the time each.
    let last = runs.len() - 2;
    let share = |i: usize| if i < last { 1.0 } else { 2.0 };
    while let Some((_, next)) = runs
        .iter_mut()
        .enumerate()
        .filter(|(i, run)| run.seconds < seconds * share(*i))
        .min_by(|(i, a), (j, b)| (a.seconds / share(*i)).total_cmp(&(b.seconds / share(*j))))
    {
        next.iterate();
    }
    println!("{name}, {seconds} s each");
    report("the mirror", &runs, &pixels);
    // What plain picks all but miss.
    let [with, without] = [&runs[last], &runs[1]].map(|run| run.luminances(&pixels));
    let caustic: Vec<(u32, u32)> =
        (0..pixels.len()).filter(|&i| with[i] > 1.5 * without[i]).map(|i| pixels[i]).collect();
    if !caustic.is_empty() {
        report("the caustic in the mirror", &runs, &caustic);
    }
}

/// Passes rays on and remembers them.
struct Recorder {
    inner: Box<dyn Visibility>,
    rays: Arc<Mutex<Vec<(Ray, bool)>>>,
}

impl Visibility for Recorder {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.rays.lock().expect("no panics").push((*ray, false));
        self.inner.intersect(ray)
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.rays.lock().expect("no panics").push((*ray, true));
        self.inner.occluded(ray)
    }
}

/// The path tracer on `cornell` against its own rays alone, one thread: through the backend, and through nothing but
/// Embree's own calls.
fn rays() {
    let scene = load("cornell");
    let settings = Settings { integrator: Integrator::Pt, samples: 4, ..scene.settings.clone() };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    one.install(|| {
        let rays = Arc::new(Mutex::new(Vec::new()));
        let mut recorded = World::new(&scene, &settings).expect("a world");
        let inner = hrr::visibility::build(settings.visibility, &scene.mesh, 1).expect("a backend");
        recorded.visibility = Box::new(Recorder { inner, rays: rays.clone() });
        let mut film = Film::new(&scene.film);
        hrr::integrator::new(&recorded, &settings)
            .expect("pt")
            .iterate(0, &mut film, &|_| ())
            .expect("an iteration");
        drop(recorded);
        let rays = rays.lock().expect("no panics");

        let world = World::new(&scene, &settings).expect("a world");
        let mut tracer = hrr::integrator::new(&world, &settings).expect("pt");
        #[cfg(feature = "embree")]
        let bare = bare_embree::Bare::new(&scene.mesh);
        // This thread's processor time, so that other programs on the machine do not count.
        let seconds = |work: &mut dyn FnMut() -> usize| {
            const REPEATS: u32 = 5; // the clock may tick in milliseconds
            let start = cpu_seconds();
            for _ in 0..REPEATS {
                assert!(work() > 0);
            }
            (cpu_seconds() - start) / f64::from(REPEATS)
        };
        let mut ratios = [Vec::new(), Vec::new()];
        for round in 0..9 {
            let whole = seconds(&mut || {
                tracer.iterate(0, &mut Film::new(&scene.film), &|_| ()).expect("an iteration");
                1
            });
            let backend = seconds(&mut || {
                let free = |(ray, shadow): &&(Ray, bool)| match shadow {
                    true => world.visibility.occluded(ray),
                    false => world.visibility.intersect(ray).is_some(),
                };
                rays.iter().filter(free).count()
            });
            let rate = |s: f64| rays.len() as f64 / s * 1e-6;
            print!("  round {round}: {} rays; Mrays/s: path tracer {:.2}", rays.len(), rate(whole));
            print!(", backend alone {:.2} (ratio {:.3})", rate(backend), backend / whole);
            ratios[0].push(backend / whole);
            #[cfg(feature = "embree")]
            {
                let raw = seconds(&mut || {
                    let hit = |(ray, shadow): &&(Ray, bool)| match shadow {
                        true => bare.occluded(ray),
                        false => bare.intersect(ray),
                    };
                    rays.iter().filter(hit).count()
                });
                print!(", raw Embree calls {:.2} (ratio {:.3})", rate(raw), raw / whole);
                ratios[1].push(raw / whole);
            }
            println!();
        }
        for (name, mut ratios) in [settings.visibility.name(), "raw Embree calls"].into_iter().zip(ratios) {
            ratios.sort_by(f64::total_cmp);
            if let Some(median) = ratios.get(ratios.len() / 2) {
                println!("cornell: path tracer's rays per second over those of {name}, median {median:.3}");
            }
        }
    });
}
