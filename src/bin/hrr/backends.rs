//! `hrr backends`: Embree against the pure-Rust tree, on a scene's own rays.

use crate::args::{EXIT_CODES, message_args, verbosity};
use crate::log::{Log, Verbosity, quantity};
use crate::scene_args::{self, SceneArgs};
use clap::{Arg, ArgMatches, value_parser};
use hrr::film::Film;
use hrr::integrator;
use hrr::render::Noise;
use hrr::report::backends::{Workload, disagreements, time, workloads};
use hrr::report::bootstrap::Interval;
use hrr::scene::Scene;
use hrr::settings::{Backend, Settings};
use hrr::subpath::World;
use hrr::visibility::{Visibility, build};
use hrr::{Error, Result};
use std::time::Instant;

/// The arguments of `hrr backends`.
#[derive(Debug)]
pub struct BackendsArgs {
    scene: SceneArgs,
    rays: usize,
    seconds: f64,
    /// How much is said.
    pub verbosity: Verbosity,
}

/// Rounds of each timing.
const ROUNDS: usize = 7;
/// Unexplained differences that are printed.
const SHOWN: usize = 5;

const EXAMPLES: &str = "\
Prints how long each backend takes to build, what it holds in memory, and millions of rays per second of one thread and of
all: camera rays, diffuse bounces (nearest hit) and connections between eye and light vertices (any hit). Rounds alternate
between the backends; figures are medians, ratios have 90 % intervals. Each difference between answers is explained: the
same place on two triangles that touch or coincide there, or an edge that is passed by less than rounding. Exit code 1
if a difference remains. At last the scene is rendered with both, in turn, and the time to equal error compared.";

impl BackendsArgs {
    pub fn new(m: &ArgMatches) -> Self {
        Self {
            scene: SceneArgs::new(m),
            rays: m.get_one::<u32>("rays").copied().unwrap_or(200_000) as usize,
            seconds: m.get_one::<f64>("seconds").copied().unwrap_or(10.0),
            verbosity: verbosity(m),
        }
    }
}

/// The sub-command.
pub fn command() -> clap::Command {
    clap::Command::new("backends")
        .about("Compare the speed and the answers of the ray query backends")
        .after_help("'hrr backends --help' tells more.")
        .after_long_help(format!("{EXAMPLES}\n\n{EXIT_CODES}"))
        .arg_required_else_help(true)
        .arg(scene_args::scene())
        .arg(
            Arg::new("rays")
                .long("rays")
                .value_name("N")
                .value_parser(value_parser!(u32).range(100..))
                .help("Rays of each kind [default: 200000]"),
        )
        .arg(
            Arg::new("seconds")
                .long("seconds")
                .value_name("SECONDS")
                .value_parser(|text: &str| {
                    text.parse()
                        .ok()
                        .filter(|s| (0.0..1e6).contains(s))
                        .ok_or("a number of seconds, at least 0")
                })
                .help("Seconds for rendering with both; 0: do not [default: 10]"),
        )
        .arg(scene_args::size("Options"))
        .args(scene_args::changes(|s| !["visibility", "time", "iterations", "error"].contains(&s.name)))
        .args(message_args())
}

/// Does it; returns the exit code.
pub fn run(args: &BackendsArgs, log: &Log) -> Result<u8> {
    args.scene.check()?;
    let (scene, settings) = args.scene.load(|warning| log.warning(warning))?;
    let backends: &[Backend] = if cfg!(feature = "embree") {
        &[Backend::Embree, Backend::Obvhs]
    } else {
        &[Backend::Obvhs, Backend::Brute]
    };
    let threads = if settings.threads == 0 { rayon::current_num_threads() } else { settings.threads };
    println!("{}: {} triangles, {threads} threads", scene.path.display(), scene.mesh.triangles.len());
    let mut built: Vec<Box<dyn Visibility>> = Vec::new();
    for &backend in backends {
        let mut seconds = Vec::new();
        for _ in 0..ROUNDS {
            let start = Instant::now();
            built.push(build(backend, &scene.mesh, settings.threads)?);
            seconds.push(start.elapsed().as_secs_f64());
            if seconds.len() < ROUNDS {
                built.pop();
            }
        }
        let bytes = built.last().and_then(|b| b.bytes());
        println!(
            "{:8} built in {:.4} s, holds {}B",
            backend.name(),
            median(&mut seconds),
            bytes.map_or("? ".to_owned(), |b| quantity(b as f64) + if b < 1000 { " " } else { "" })
        );
    }
    let settings = Settings { visibility: backends[0], ..settings };
    let world = World::new(&scene, &settings)?;
    let workloads = workloads(&world, args.rays);
    let mut counts: Vec<usize> = vec![1, threads];
    counts.dedup();
    for &n in &counts {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .map_err(|e| Error::Internal(format!("cannot start {n} threads: {e}")))?;
        pool.install(|| workloads.iter().for_each(|w| speed(w, backends, &built, n)));
    }
    let mut unexplained = 0;
    for workload in &workloads {
        let d = disagreements(&scene.mesh, workload, &*built[0], &*built[1]);
        println!(
            "{:17} {} of {} rays answered differently: {} meet the same place on two triangles, {} pass an edge by less \
             than rounding, {} unexplained",
            workload.name,
            d.same_place + d.at_an_edge + d.unexplained.len(),
            d.rays,
            d.same_place,
            d.at_an_edge,
            d.unexplained.len()
        );
        for (ray, a, b) in d.unexplained.iter().take(SHOWN) {
            println!("    {ray:?}: {a:?} against {b:?}");
        }
        unexplained += d.unexplained.len();
    }
    if args.seconds > 0.0 {
        time_to_error(&scene, &settings, backends, args.seconds)?;
    }
    Ok(u8::from(unexplained > 0))
}

/// Rays per second of both, in turn.
fn speed(workload: &Workload, backends: &[Backend], built: &[Box<dyn Visibility>], threads: usize) {
    if workload.rays.is_empty() {
        return;
    }
    let mut seconds = [const { Vec::new() }; 2];
    let mut found = [0; 2];
    for round in 0..ROUNDS {
        for turn in 0..2 {
            let i = (round + turn) % 2;
            let (s, hits) = time(&*built[i], workload);
            seconds[i].push(s);
            found[i] = hits;
        }
    }
    let n = workload.rays.len() as f64;
    let sum = |i: usize, runs: &[usize]| runs.iter().map(|&r| seconds[i][r]).sum::<f64>();
    let ratio = Interval::new(ROUNDS, |runs| sum(1, runs) / sum(0, runs));
    let rate = |i: usize| n / median(&mut seconds[i].clone()) / 1e6;
    println!(
        "{:17} {threads} thread{}: {} {:.2} Mrays/s, {} {:.2} Mrays/s; {} is {:.2} times as fast ({:.2} to {:.2}); {:.1} % meet something",
        workload.name,
        if threads == 1 { "" } else { "s" },
        backends[0].name(),
        rate(0),
        backends[1].name(),
        rate(1),
        backends[0].name(),
        ratio.value,
        ratio.low,
        ratio.high,
        100.0 * found[0] as f64 / n,
    );
}

/// Renders with both in turn, the same iterations: the errors are the same but for edges, the times differ.
fn time_to_error(scene: &Scene, settings: &Settings, backends: &[Backend], seconds: f64) -> Result<()> {
    let integrator = hrr::render::chosen(scene, settings)?;
    let both =
        [0, 1].map(|i| Settings { visibility: backends[i], integrator, time: None, ..settings.clone() });
    let worlds = [World::new(scene, &both[0])?, World::new(scene, &both[1])?];
    let mut machines = [integrator::new(&worlds[0], &both[0])?, integrator::new(&worlds[1], &both[1])?];
    let mut films = [Film::new(&scene.film), Film::new(&scene.film)];
    let mut noises = [0, 1].map(|_| Noise::new(scene.film.width, scene.film.height));
    let mut times = [const { Vec::new() }; 2];
    let start = Instant::now();
    let mut iteration = 0;
    while iteration < 8 || start.elapsed().as_secs_f64() < seconds {
        for turn in 0..2 {
            let i = (iteration as usize + turn) % 2;
            let start = Instant::now();
            machines[i].iterate(iteration, &mut films[i], &|_| ())?;
            times[i].push(start.elapsed().as_secs_f64());
            noises[i].update(&films[i], iteration + 1, false);
        }
        iteration += 1;
    }
    noises.iter_mut().zip(&films).for_each(|(noise, film)| noise.update(film, iteration, true));
    let (Some(a), Some(b)) = (noises[0].error(), noises[1].error()) else { return Ok(()) };
    let cost =
        |i: usize, runs: &[usize], error: f64| runs.iter().map(|&r| times[i][r]).sum::<f64>() * error * error;
    let ratio = Interval::new(times[0].len(), |runs| cost(1, runs, b.expected) / cost(0, runs, a.expected));
    let all: Vec<usize> = (0..times[0].len()).collect();
    println!(
        "a render ({}): error 1 % after {:.1} s with {}, {:.1} s with {}: {:.2} times as long ({:.2} to {:.2}); {} iterations \
         of each, errors {:.4} and {:.4}",
        integrator.name(),
        cost(0, &all, a.expected) / 1e-4,
        backends[0].name(),
        cost(1, &all, b.expected) / 1e-4,
        backends[1].name(),
        ratio.value,
        ratio.low,
        ratio.high,
        times[0].len(),
        a.expected,
        b.expected,
    );
    Ok(())
}

fn median(values: &mut [f64]) -> f64 {
    hrr::math::relative::median(values)
}
