//! Variance times time: of the rules for random numbers, and of the shapes of ranges.

use crate::workload::{EyeVertex, eye_vertex, light_vertices};
use crate::{best, row};
use glam::{DVec3, Vec3};
use hrr::roulette::{
    Lobe, MinimumRandom, Pregenerated, Query, QueryCounters, Range, constant_for, probability, query,
};
use hrr::sampler::counter::{mix, unit};
use hrr::vertex_bvh::VertexBvh;

/// Samples of a pixel: eye vertices side by side on the mirror.
const NEIGHBOURS: usize = 16;
/// Width of a pixel on the mirror.
const PIXEL: f64 = 1e-3;
const PIXELS: u64 = 32;
/// How often the queries are repeated within a measurement of time.
const REPEATS: usize = 8;
/// Iterations over which variance is taken.
const ITERATIONS: u64 = 256;

/// What a light vertex sends on through a lobe: any value that is not just the roulette's own measure.
fn value(lobe: &Lobe, index: usize, offset: DVec3) -> f64 {
    (0.2 + unit(mix(index as u64))) * lobe.weight() / lobe.h2(offset)
}

fn pixels(ax: f64, ay: f64) -> Vec<EyeVertex> {
    let u = |i: u64, k: u64| unit(mix(mix(i) ^ k));
    let within = |pixel: u64| {
        let (x, z) = (u(pixel, 1) * 1.6 - 0.8, u(pixel, 2) * 0.8 - 0.8);
        (0..NEIGHBOURS as u64).map(move |n| {
            let i = pixel * NEIGHBOURS as u64 + n;
            eye_vertex(DVec3::new(x + PIXEL * u(i, 3), 1.0, z + PIXEL * u(i, 4)), ax, ay, mix(i))
        })
    };
    (0..PIXELS).flat_map(within).collect()
}

/// (Variance with independent numbers, expected number of accepted vertices), sums over eye vertices whose range is
/// as `range` says.
fn independent(points: &[Vec3], eyes: &[EyeVertex], range: Range, constant: f64) -> (f64, f64) {
    let (mut variance, mut accepted) = (0.0, 0.0);
    for eye in eyes {
        let lobes = eye.lobes.map(|l| l.with_range(range));
        for (i, point) in points.iter().enumerate() {
            let offset = point.as_dvec3() - eye.position;
            let p = probability(&lobes, constant, offset);
            variance += value(&eye.lobes[0], i, offset).powi(2) * (1.0 / p - 1.0);
            accepted += p;
        }
    }
    (variance, accepted)
}

/// Variances of one query and of the mean over a pixel, added up over all of them.
fn sampled(
    bvh: &VertexBvh,
    points: &[Vec3],
    eyes: &[EyeVertex],
    constant: f64,
    rule: Option<MinimumRandom>,
) -> (f64, f64) {
    let mut one = vec![[0.0; 2]; eyes.len()];
    let mut mean = vec![[0.0; 2]; eyes.len() / NEIGHBOURS];
    for iteration in 0..ITERATIONS {
        let numbers = rule.is_none().then(|| Pregenerated::new(bvh, mix(iteration)));
        for (pixel, eyes) in eyes.chunks(NEIGHBOURS).enumerate() {
            let mut total = 0.0;
            for (n, eye) in eyes.iter().enumerate() {
                let q = Query::new(eye.position, &eye.lobes, constant, eye.key ^ mix(iteration));
                let q = Query { rule: rule.unwrap_or_default(), pregenerated: numbers.as_ref(), ..q };
                let mut sum = 0.0;
                query(bvh, &q, &mut QueryCounters::default(), &mut |i, p| {
                    let offset = points[i as usize].as_dvec3() - eye.position;
                    sum += value(&eye.lobes[0], i as usize, offset) / p;
                });
                let moments = &mut one[pixel * NEIGHBOURS + n];
                *moments = [moments[0] + sum, moments[1] + sum * sum];
                total += sum / NEIGHBOURS as f64;
            }
            mean[pixel] = [mean[pixel][0] + total, mean[pixel][1] + total * total];
        }
    }
    let n = ITERATIONS as f64;
    let variance = |m: &[[f64; 2]]| m.iter().map(|m| (m[1] - m[0] * m[0] / n) / (n - 1.0)).sum::<f64>();
    (variance(&one), variance(&mean))
}

const ALPHAS: [(f64, f64); 3] = [(1e-4, 1e-4), (1e-4, 1e-2), (1e-2, 1e-2)];

/// The four ways to random numbers, for one query and for the mean over the sixteen of a pixel.
pub fn rules() {
    println!(
        "-- rules: variance in units of independent roulettes; variance x time in units of nested (1e6 vertices)"
    );
    let points = light_vertices(1_000_000);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    let start = std::time::Instant::now();
    let shared = Pregenerated::new(&bvh, 1);
    println!(
        "pregenerating takes {:.1} ns a vertex, not counted below",
        start.elapsed().as_secs_f64() * 1e9 / points.len() as f64
    );
    for (ax, ay) in ALPHAS {
        println!("alpha ({ax:e}, {ay:e})");
        let eyes = pixels(ax, ay);
        let constant = constant_for(1.0, 24.0, points.len());
        let (expected, _) = independent(&points, &eyes, Range::Ellipsoid, constant);
        let mut nested = None;
        for rule in [
            Some(MinimumRandom::Nested),
            Some(MinimumRandom::SemiStratified),
            Some(MinimumRandom::Exact),
            None,
        ] {
            let (one, mean) = sampled(&bvh, &points, &eyes, constant, rule);
            let (one, mean) = (one / expected, mean * (NEIGHBOURS * NEIGHBOURS) as f64 / expected);
            let pregenerated = rule.is_none().then_some(&shared);
            let rule_or = rule.unwrap_or_default();
            let queries: Vec<_> = eyes
                .iter()
                .map(|e| Query {
                    rule: rule_or,
                    pregenerated,
                    ..Query::new(e.position, &e.lobes, constant, e.key)
                })
                .collect();
            let measured = best(&bvh, &queries.repeat(REPEATS));
            row(&rule.map_or("Pregenerated".into(), |r| format!("{r:?}")), measured);
            let t = measured.0;
            let (one0, mean0, t0) = *nested.get_or_insert((one, mean, t));
            println!(
                "    variance: one query {one:.3}, mean of a pixel's {NEIGHBOURS} {mean:.3}; x time {:.2} and {:.2}",
                one * t / (one0 * t0),
                mean * t / (mean0 * t0),
            );
        }
    }
}

/// The three shapes of ranges, with the constant at which each accepts as many vertices as the ellipsoid.
pub fn ranges() {
    println!(
        "-- ranges at an equal number of accepted vertices: variance x time in units of the ellipsoid (1e6 vertices)"
    );
    let points = light_vertices(1_000_000);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    for (ax, ay) in ALPHAS {
        println!("alpha ({ax:e}, {ay:e})");
        let eyes = pixels(ax, ay);
        let few: Vec<_> = eyes.iter().step_by(NEIGHBOURS).cloned().collect();
        let constant = constant_for(1.0, 24.0, points.len());
        let (variance0, wanted) = independent(&points, &few, Range::Ellipsoid, constant);
        let mut time0 = None;
        for range in [Range::Ellipsoid, Range::Spheroid, Range::Sphere] {
            let at_same_constant = independent(&points, &few, range, constant).1 / few.len() as f64;
            // More is accepted the greater the constant: bisection in its logarithm.
            let (mut lo, mut hi) = (constant.ln() - 40.0, constant.ln() + 1e-6);
            while hi - lo > 1e-3 {
                let middle = 0.5 * (lo + hi);
                if independent(&points, &few, range, middle.exp()).1 < wanted {
                    lo = middle
                } else {
                    hi = middle
                }
            }
            let constant = hi.exp();
            let (variance, _) = independent(&points, &few, range, constant);
            let lobes: Vec<_> = eyes.iter().map(|e| e.lobes.map(|l| l.with_range(range))).collect();
            let queries: Vec<_> =
                eyes.iter().zip(&lobes).map(|(e, l)| Query::new(e.position, l, constant, e.key)).collect();
            let measured = best(&bvh, &queries.repeat(REPEATS));
            row(&format!("{range:?}"), measured);
            let time0 = *time0.get_or_insert(measured.0);
            println!(
                "    variance {:.3}, x time {:.3}; at the ellipsoid's constant {at_same_constant:.1} would be accepted",
                variance / variance0,
                variance * measured.0 / (variance0 * time0),
            );
        }
    }
}
