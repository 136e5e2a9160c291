//! The roulette: its numbers, its accepted sets, its sums.

mod pregenerated;

use glam::{DVec3, Vec3};
use hrr::math::Frame;
use hrr::roulette::min_random::Minimum;
use hrr::roulette::{
    Lobe, MinimumRandom, Query, QueryCounters, constant_for, probability, query, query_brute_force,
};
use hrr::sampler::counter::{mix, unit};
use hrr::vertex_bvh::VertexBvh;

const RULES: [MinimumRandom; 3] =
    [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact];

pub fn u(i: u64, k: u64) -> f64 {
    unit(mix(mix(i ^ 0x1234_5678) ^ k))
}

/// Points on the faces of a box, as light vertices lie on surfaces.
pub fn surface_points(n: usize) -> Vec<Vec3> {
    (0..n as u64)
        .map(|i| {
            let mut p = [u(i, 1) as f32 * 2.0 - 1.0, u(i, 2) as f32 * 2.0 - 1.0, 0.0];
            p[2] = if u(i, 3) < 0.5 { -1.0 } else { 1.0 };
            p.rotate_right((u(i, 4) * 3.0) as usize);
            Vec3::from_array(p)
        })
        .collect()
}

pub fn random_frame(i: u64) -> Frame {
    let v = DVec3::new(u(i, 11), u(i, 12), u(i, 13)) * 2.0 - 1.0;
    Frame::from_z_tangent(v.normalize(), DVec3::new(u(i, 14), u(i, 15), u(i, 16)) * 2.0 - 1.0)
}

pub fn hits(bvh: &VertexBvh, q: &Query<'_>, brute: bool) -> (Vec<(u32, f64)>, QueryCounters) {
    let (mut found, mut stats) = (Vec::new(), QueryCounters::default());
    if brute {
        query_brute_force(bvh, q, &mut stats, &mut |i, p| found.push((i, p)));
    } else {
        query(bvh, q, &mut stats, &mut |i, p| found.push((i, p)));
    }
    (found, stats)
}

#[test]
fn tree_and_brute_force_accept_the_same() {
    let mut bvh = VertexBvh::new();
    let mut accepted = 0;
    for n in [1usize, 5, 64, 1000, 9000] {
        let points = surface_points(n);
        bvh.build(&points).unwrap();
        for i in 0..60 {
            let f = random_frame(i);
            let (ax, ay) = (10f64.powf(-7.0 * u(i, 7)), 10f64.powf(-7.0 * u(i, 8)));
            // Lobes that point at a vertex, so that narrow ones accept something.
            let z = DVec3::new(u(i, 9), u(i, 10), u(i, 11)) - 0.5;
            let target = points[(u(i, 17) * n as f64) as usize].as_dvec3();
            let aimed = Frame::from_z_tangent((target - z).normalize(), f.x);
            let lobes =
                [Lobe::new(aimed, ax, ay, 1.0 / (ax * ay)), Lobe::sphere(0.1), Lobe::new(f, 0.3, 0.1, 1.0)];
            for count in 1..=3 {
                for rule in RULES {
                    let constant = constant_for(0.3, 24.0, n);
                    let q = Query { rule, ..Query::new(z, &lobes[..count], constant, i) };
                    let (tree, stats) = hits(&bvh, &q, false);
                    let (brute, all) = hits(&bvh, &q, true);
                    assert_eq!(tree, brute, "n {n} query {i} lobes {count} {rule:?}");
                    assert_eq!(all.leaves as usize, n);
                    assert_eq!(stats.accepted as usize, tree.len());
                    accepted += tree.len();
                    for (index, p) in tree {
                        let offset = points[index as usize].as_dvec3() - z;
                        assert_eq!(probability(q.lobes, q.constant, offset).to_bits(), p.to_bits());
                    }
                }
            }
        }
    }
    assert!(accepted > 4000, "{accepted}");
}

#[test]
fn masks_hide_vertices_and_move_nothing() {
    let points = surface_points(3000);
    let masks: Vec<u32> = (0..3000).map(|i| if i % 5 == 0 { 1 } else { 2 }).collect();
    let (mut plain, mut masked) = (VertexBvh::new(), VertexBvh::new());
    plain.build(&points).unwrap();
    masked.build_masked(&points, Some(&masks)).unwrap();
    let lobes = [Lobe::sphere(1.0)];
    for key in 0..20 {
        let q = Query::new(DVec3::ZERO, &lobes, 0.05, key);
        let (all, _) = hits(&plain, &q, false);
        assert_eq!(all, hits(&masked, &q, false).0);
        let (one, stats) = hits(&masked, &Query { mask: 1, ..q }, false);
        assert_eq!(one, all.into_iter().filter(|h| h.0 % 5 == 0).collect::<Vec<_>>());
        assert!(stats.leaves > 0);
    }
}

/// Deals numbers over a whole tree given as nested counts and returns the leaves', in order.
enum Shape {
    Balanced,
    Random,
    Chain,
}

fn deal(rule: MinimumRandom, shape: &Shape, key: u64, leaves: u32, out: &mut Vec<f64>) {
    fn below(
        rule: MinimumRandom,
        shape: &Shape,
        id: u64,
        n: u32,
        number: Minimum,
        key: u64,
        out: &mut Vec<f64>,
    ) {
        if n == 1 {
            out.push(number.xi);
            return;
        }
        let left = match shape {
            Shape::Balanced => n / 2,
            Shape::Chain => 1,
            Shape::Random => 1 + (u(id, 77) * f64::from(n - 1)) as u32,
        };
        let mut children = [number; 2];
        rule.split(number, mix(key ^ mix(id)), &[left, n - left], &mut children);
        let first = out.len();
        below(rule, shape, 2 * id, left, children[0], key, out);
        below(rule, shape, 2 * id + 1, n - left, children[1], key, out);
        assert!(out[first..].iter().all(|&x| x >= number.xi), "a node's number is below all its leaves'");
    }
    out.clear();
    below(rule, shape, 1, leaves, rule.root(key, f64::from(leaves)), key, out);
}

/// Greatest distance between the empirical distribution of `x` (sorted here) and the uniform one, times sqrt(n).
fn kolmogorov(x: &mut [f64]) -> f64 {
    x.sort_unstable_by(f64::total_cmp);
    let n = x.len() as f64;
    let gap = |(i, &x): (usize, &f64)| (x - i as f64 / n).abs().max(((i + 1) as f64 / n - x).abs());
    x.iter().enumerate().map(gap).fold(0.0, f64::max) * n.sqrt()
}

#[test]
fn leaves_are_uniform_in_every_tree_shape() {
    let mut numbers = Vec::new();
    for rule in RULES {
        for (shape, leaves) in [(Shape::Balanced, 16), (Shape::Random, 23), (Shape::Chain, 13)] {
            let mut samples = vec![Vec::new(); leaves as usize];
            for key in 0..20_000u64 {
                deal(rule, &shape, mix(key), leaves, &mut numbers);
                for (s, &x) in samples.iter_mut().zip(&numbers) {
                    s.push(x);
                }
            }
            for (leaf, s) in samples.iter_mut().enumerate() {
                let k = kolmogorov(s);
                assert!(k < 2.3, "{rule:?} leaf {leaf}: sqrt(n) D = {k}"); // p = 5e-5
            }
        }
    }
}

#[test]
fn acceptance_frequencies_are_the_probabilities() {
    let points = surface_points(300);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    let z = DVec3::new(0.1, -0.2, 0.3);
    let lobes = [Lobe::new(random_frame(4), 0.2, 0.05, 3.0), Lobe::sphere(0.05)];
    for rule in RULES {
        let (constant, queries) = (0.5, 40_000u64);
        let mut count = vec![0u64; points.len()];
        for key in 0..queries {
            let q = Query { rule, ..Query::new(z, &lobes, constant, mix(key)) };
            query(&bvh, &q, &mut QueryCounters::default(), &mut |i, _| count[i as usize] += 1);
        }
        let mut chi2 = 0.0;
        let mut cells = 0.0;
        for (i, &c) in count.iter().enumerate() {
            let p = probability(&lobes, constant, points[i].as_dvec3() - z);
            let n = queries as f64;
            if p == 1.0 {
                assert_eq!(c, queries);
            } else if n * p > 5.0 {
                chi2 += (c as f64 - n * p).powi(2) / (n * p * (1.0 - p));
                cells += 1.0;
            }
        }
        let z = (chi2 - cells) / (2.0f64 * cells).sqrt();
        assert!(cells > 100.0 && z.abs() < 4.5, "{rule:?}: chi^2 {chi2} over {cells}");
    }
}

/// A cluster of light vertices that a lobe of roughness `alpha` sees at distance 1, and the lobe.
pub fn lit_lobe(n: usize, ax: f64, ay: f64, seed: u64) -> (Vec<Vec3>, DVec3, Lobe) {
    let frame = random_frame(seed);
    let lobe = Lobe::new(frame, ax, ay, 1.0 / (ax * ay));
    // Positions near the origin, where f32 resolves the lobe; the eye vertex a unit away.
    let z = frame.z * -1.0;
    let points = (0..n as u64)
        .map(|i| {
            let (r, phi) = (6.0 * u(i, seed ^ 21), 6.3 * u(i, seed ^ 22));
            let p =
                frame.to_world(DVec3::new(r * ax * phi.cos(), r * ay * phi.sin(), 0.05 * u(i, seed ^ 23)));
            p.as_vec3()
        })
        .collect();
    (points, z, lobe)
}

#[test]
fn sums_are_unbiased_at_every_roughness_and_rule() {
    let mut bvh = VertexBvh::new();
    let mut worst = 0.0f64;
    let alphas = [
        (1.0, 1.0),
        (0.1, 0.1),
        (1e-2, 1e-2),
        (1e-4, 1e-4),
        (1e-4, 1e-2),
        (1e-5, 1e-5),
        (1e-6, 1e-3),
        (1e-7, 1e-7),
    ];
    for (case, (ax, ay)) in alphas.into_iter().enumerate() {
        let (points, z, lobe) = lit_lobe(700, ax, ay, case as u64);
        bvh.build(&points).unwrap();
        for lobes in [
            vec![lobe],
            vec![lobe, Lobe::sphere(0.3 * lobe.weight()), Lobe::new(random_frame(9), 0.2, 0.4, 1.0)],
        ] {
            let constant = 0.1 * ax * ay;
            // What the sum adds up need not be like P: any positive function of the vertex.
            let value = |i: usize| 0.2 + u(i as u64, 31);
            let p: Vec<_> = points.iter().map(|x| probability(&lobes, constant, x.as_dvec3() - z)).collect();
            let truth: f64 = (0..points.len()).map(value).sum();
            let independent: f64 = (0..points.len()).map(|i| value(i).powi(2) * (1.0 / p[i] - 1.0)).sum();
            for rule in RULES {
                let n = 1500;
                let sums: Vec<f64> = (0..n)
                    .map(|key| {
                        let q =
                            Query { rule, ..Query::new(z, &lobes, constant, mix(key ^ 0xabc) ^ case as u64) };
                        let mut sum = 0.0;
                        query(&bvh, &q, &mut QueryCounters::default(), &mut |i, p| {
                            sum += value(i as usize) / p
                        });
                        sum
                    })
                    .collect();
                let mean = sums.iter().sum::<f64>() / n as f64;
                // The known variance is at least the true one.
                let z = (mean - truth) / (independent / n as f64).sqrt();
                worst = worst.max(z.abs());
                assert!(z.abs() < 4.5, "alpha ({ax}, {ay}) {rule:?} lobes {}: z = {z}", lobes.len());
            }
        }
    }
    assert!(worst > 0.5, "the test must see some noise: {worst}");
}

#[test]
fn variance_is_never_above_independent_roulettes() {
    let mut bvh = VertexBvh::new();
    let mut ratios = Vec::new();
    for case in 0..3u64 {
        let (points, z, lobe) = lit_lobe(1500, 1e-3, 3e-3, case);
        bvh.build(&points).unwrap();
        let lobes = [lobe];
        let constant = 0.15 * 3e-6;
        let p: Vec<_> = points.iter().map(|x| probability(&lobes, constant, x.as_dvec3() - z)).collect();
        let values = [
            ("even", (|_| 1.0) as fn(u64) -> f64),
            ("spread", |i| 0.1 + u(i, 41)),
            ("sparse", |i| f64::from(u(i, 42) < 0.05)),
        ];
        for (name, value) in values {
            let independent: f64 =
                (0..points.len()).map(|i| value(i as u64).powi(2) * (1.0 / p[i] - 1.0)).sum();
            for rule in RULES {
                let n = 3000u64;
                let sums: Vec<f64> = (0..n)
                    .map(|key| {
                        let q = Query { rule, ..Query::new(z, &lobes, constant, mix(key ^ 0x77)) };
                        let mut sum = 0.0;
                        query(&bvh, &q, &mut QueryCounters::default(), &mut |i, p| {
                            sum += value(u64::from(i)) / p
                        });
                        sum
                    })
                    .collect();
                let variance = |pick: &dyn Fn(usize) -> usize| {
                    let mean = (0..sums.len()).map(|k| sums[pick(k)]).sum::<f64>() / n as f64;
                    (0..sums.len()).map(|k| (sums[pick(k)] - mean).powi(2)).sum::<f64>() / (n - 1) as f64
                };
                // The lower end of a bootstrap interval (1 in 1000) must lie below the independent variance.
                let mut resampled: Vec<f64> = (0..1000u64)
                    .map(|b| variance(&|k| (u(b, 50 + k as u64) * n as f64) as usize) / independent)
                    .collect();
                resampled.sort_by(f64::total_cmp);
                let ratio = variance(&|k| k) / independent;
                println!("case {case} {name} {rule:?}: {ratio:.3}");
                assert!(resampled[1] < 1.0, "case {case} {name} {rule:?}: {ratio}");
                ratios.push((rule, name, ratio));
            }
        }
    }
    let mean = |rule, name| {
        let (n, sum) = ratios
            .iter()
            .filter(|r| r.0 == rule && r.1 == name)
            .fold((0.0, 0.0), |a, r| (a.0 + 1.0, a.1 + r.2));
        sum / n
    };
    let (nested, semi, exact) = (
        mean(MinimumRandom::Nested, "even"),
        mean(MinimumRandom::SemiStratified, "even"),
        mean(MinimumRandom::Exact, "even"),
    );
    assert!(nested < 0.9 * exact && semi < exact && nested < semi, "{nested} {semi} {exact}");
}

#[test]
fn rare_acceptance_is_as_rare_as_it_should_be() {
    // P = 1e-7 everywhere: only numbers far below what 24 bits resolve are accepted.
    let points = surface_points(200_000);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    for rule in RULES {
        let lobes = [Lobe::sphere(1.0)];
        let constant = 1e-7;
        let expected: f64 = points.iter().map(|x| probability(&lobes, constant, x.as_dvec3())).sum();
        let queries = 60_000u64;
        let mut octant = [0.0f64; 8];
        let mut total = 0.0;
        for key in 0..queries {
            let q = Query { rule, ..Query::new(DVec3::ZERO, &lobes, constant, mix(key ^ 0x1e7)) };
            query(&bvh, &q, &mut QueryCounters::default(), &mut |i, _| {
                let x = points[i as usize];
                octant[usize::from(x.x > 0.0) | usize::from(x.y > 0.0) << 1 | usize::from(x.z > 0.0) << 2] +=
                    1.0;
                total += 1.0;
            });
        }
        let mean = expected * queries as f64;
        assert!(mean > 500.0);
        assert!((total - mean).abs() < 4.5 * mean.sqrt(), "{rule:?}: {total} for {mean}");
        let chi2: f64 = octant.iter().map(|o| (o - total / 8.0).powi(2) / (total / 8.0)).sum();
        assert!(chi2 < 35.0, "{rule:?}: chi^2 {chi2} over 7 degrees of freedom"); // p = 1e-5
    }
}

/// Long: 1e8 numbers for each rule and shape, by a histogram of 2^16 bins.
#[test]
#[ignore = "three minutes"]
fn leaves_are_uniform_over_1e8_draws() {
    const BINS: usize = 1 << 16;
    let mut numbers = Vec::new();
    for rule in RULES {
        for (shape, leaves) in [(Shape::Balanced, 64), (Shape::Random, 61), (Shape::Chain, 40)] {
            let mut histogram = vec![0u64; BINS];
            let mut low = [0u64; 8];
            let trees = 100_000_000 / u64::from(leaves) + 1;
            for key in 0..trees {
                deal(rule, &shape, mix(key ^ 0x55aa), leaves, &mut numbers);
                for &x in &numbers {
                    histogram[((x * BINS as f64) as usize).min(BINS - 1)] += 1;
                    for (decade, count) in low.iter_mut().enumerate() {
                        *count += u64::from(x < 10f64.powi(-(decade as i32)));
                    }
                }
            }
            let n = (trees * u64::from(leaves)) as f64;
            let (mut below, mut gap) = (0.0, 0.0f64);
            for (bin, &count) in histogram.iter().enumerate() {
                below += count as f64;
                gap = gap.max((below / n - (bin + 1) as f64 / BINS as f64).abs());
            }
            let k = gap * n.sqrt();
            println!("{rule:?} {leaves} leaves: sqrt(n) D = {k:.3} over {n:.0}, below 1e-0..1e-7: {low:?}");
            assert!(k < 2.3, "{rule:?}: sqrt(n) D = {k}");
            for (decade, &count) in low.iter().enumerate() {
                let mean = n * 10f64.powi(-(decade as i32));
                assert!(
                    (count as f64 - mean).abs() < 4.5 * mean.sqrt() + 1.0,
                    "{rule:?} below 1e-{decade}: {count}"
                );
            }
        }
    }
}
