//! Whole integrators: what the roulette gains on a caustic seen in a mirror, and how many rays per second the path
//! tracer keeps of what its ray queries alone would reach.
//!
//! `cargo bench --bench integrators -- caustic [scene] [seconds] [light subpaths] [samples]`
//! `cargo bench --bench integrators -- rays`

#[path = "support/workload.rs"]
#[expect(dead_code, reason = "only its clock is wanted")]
mod workload;

use hrr::film::Film;
use hrr::math::luminance;
use hrr::scene::Scene;
use hrr::settings::{Integrator, Settings};
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
}

fn load(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
    Scene::load(&path, &[]).expect("a scene of the project")
}

/// Sums over iterations, for the variance of each pixel.
struct Contender<'a> {
    name: String,
    integrator: Box<dyn hrr::integrator::Integrator + 'a>,
    sum: Vec<f64>,
    square: Vec<f64>,
    iterations: u64,
    seconds: f64,
}

impl Contender<'_> {
    fn iterate(&mut self, scene: &Scene) {
        let mut film = Film::new(&scene.film);
        let start = Instant::now();
        self.integrator.iterate(self.iterations, &mut film, &|_| ()).expect("an iteration");
        self.seconds += start.elapsed().as_secs_f64();
        self.iterations += 1;
        for (i, (sum, square)) in self.sum.iter_mut().zip(&mut self.square).enumerate() {
            let (x, y) = (i as u32 % film.width(), i as u32 / film.width());
            let v = luminance(film.mean(x, y));
            *sum += v;
            *square += v * v;
        }
    }

    /// The mean over pixels of the variance that one second leaves, all pixels and without the worst hundredth.
    fn variance_seconds(&self, pixels: &[usize]) -> (f64, f64) {
        let n = self.iterations as f64;
        let mut v: Vec<f64> = pixels
            .iter()
            .map(|&i| (self.square[i] / n - (self.sum[i] / n).powi(2)) * n / (n - 1.0) * self.seconds / n)
            .collect();
        v.sort_by(f64::total_cmp);
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        (mean(&v), mean(&v[..v.len() - v.len() / 100]))
    }

    fn mean(&self, pixels: &[usize]) -> f64 {
        pixels.iter().map(|&i| self.sum[i]).sum::<f64>() / (self.iterations as f64 * pixels.len() as f64)
    }
}

/// Variance in the mirror's pixels at equal time: plain picks from the cache against the roulette. Iterations are run
/// in turn, each side getting the same time.
fn caustic(name: &str, seconds: f64, light_subpaths: u64, samples: u32) {
    let scene = load(name);
    let plain = Settings { integrator: Integrator::Lvc, ..scene.settings.clone() };
    let many = Settings { integrator: Integrator::Lvc, light_subpaths, samples, ..plain.clone() };
    let roulette = Settings { integrator: Integrator::LvcHrr, ..many.clone() };
    let world = World::new(&scene, &plain).expect("a world");
    let camera = &world.camera;
    let pixels: Vec<usize> = (0..scene.film.width * scene.film.height)
        .filter(|i| {
            let at = glam::DVec2::new((i % scene.film.width).into(), (i / scene.film.width).into()) + 0.5;
            let direction = camera.direction(at);
            let ray = hrr::visibility::offset::from_free_point(camera.position, direction);
            world.intersect(&ray, camera.position, direction).is_some_and(|p| {
                scene.materials[scene.mesh.materials[p.triangle as usize] as usize].name == "mirror"
            })
        })
        .map(|i| i as usize)
        .collect();
    assert!(!pixels.is_empty(), "no pixel sees a material named 'mirror'");
    let size = (scene.film.width * scene.film.height) as usize;
    let contender = |name: String, settings| Contender {
        name,
        integrator: hrr::integrator::new(&world, settings),
        sum: vec![0.0; size],
        square: vec![0.0; size],
        iterations: 0,
        seconds: 0.0,
    };
    let sizes = format!("{light_subpaths} light subpaths, {samples} samples");
    let mut contenders = [
        contender("lvc, a subpath and a sample per pixel".into(), &plain),
        contender(format!("lvc, {sizes}"), &many),
        contender(format!("lvc+hrr, {sizes}"), &roulette),
    ];
    while contenders.iter().any(|c| c.seconds < seconds || c.iterations < 4) {
        let next = contenders.iter_mut().min_by(|a, b| a.seconds.total_cmp(&b.seconds));
        next.expect("three of them").iterate(&scene);
    }
    println!("{name}: {} pixels of the mirror, {seconds} s each", pixels.len());
    let (all, trimmed) = contenders[2].variance_seconds(&pixels);
    for c in &contenders {
        let (v, t) = c.variance_seconds(&pixels);
        println!(
            "  {:44} {:4} iterations  mean {:.5}  variance x s {v:.4e} (x{:.2})  without the worst 1 % {t:.4e} (x{:.2})",
            c.name,
            c.iterations,
            c.mean(&pixels),
            v / all,
            t / trimmed
        );
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

/// The path tracer on `cornell` against its own rays alone, one thread.
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
        hrr::integrator::new(&recorded, &settings).iterate(0, &mut film, &|_| ()).expect("an iteration");
        drop(recorded);
        let rays = rays.lock().expect("no panics");

        let world = World::new(&scene, &settings).expect("a world");
        let mut tracer = hrr::integrator::new(&world, &settings);
        let mut ratios = Vec::new();
        for round in 0..9 {
            // This thread's processor time, so that other programs on the machine do not count.
            let start = cpu_seconds();
            tracer.iterate(0, &mut Film::new(&scene.film), &|_| ()).expect("an iteration");
            let whole = cpu_seconds() - start;
            let start = cpu_seconds();
            let hits = rays
                .iter()
                .filter(|(ray, shadow)| {
                    if *shadow {
                        world.visibility.occluded(ray)
                    } else {
                        world.visibility.intersect(ray).is_some()
                    }
                })
                .count();
            let raw = cpu_seconds() - start;
            assert!(hits > 0);
            let rate = |s: f64| rays.len() as f64 / s * 1e-6;
            println!(
                "  round {round}: {} rays; path tracer {:.2} Mrays/s, rays alone {:.2} Mrays/s, ratio {:.3}",
                rays.len(),
                rate(whole),
                rate(raw),
                raw / whole
            );
            ratios.push(raw / whole);
        }
        ratios.sort_by(f64::total_cmp);
        println!("cornell, {}: median ratio {:.3}", settings.visibility.name(), ratios[ratios.len() / 2]);
    });
}
