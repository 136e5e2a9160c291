//! Numbers shared by all queries of an iteration.

use super::{hits, kolmogorov, lit_lobe, random_frame, surface_points, u};
use glam::DVec3;
use hrr::roulette::{Lobe, Pregenerated, Query, QueryCounters, constant_for, probability, query};
use hrr::sampler::counter::mix;
use hrr::vertex_bvh::VertexBvh;

#[test]
fn tree_and_brute_force_accept_the_same() {
    let mut bvh = VertexBvh::new();
    bvh.build(&surface_points(777)).unwrap();
    let elsewhere = Pregenerated::new(&bvh, 4);
    let (mut accepted, mut culled) = (0, 0);
    for n in [1usize, 8, 9, 65, 1000, 9000] {
        let points = surface_points(n);
        bvh.build(&points).unwrap();
        let own = Pregenerated::new(&bvh, n as u64);
        for i in 0..60 {
            let z = DVec3::new(u(i, 9), u(i, 10), u(i, 11)) - 0.5;
            let target = points[(u(i, 17) * n as f64) as usize].as_dvec3();
            let alpha = 10f64.powf(-7.0 * u(i, 7));
            let aimed = hrr::math::Frame::from_z_tangent((target - z).normalize(), random_frame(i).x);
            let lobes = [Lobe::new(aimed, alpha, 0.3 * alpha, alpha.powi(-2)), Lobe::sphere(0.1)];
            for count in 1..=2 {
                // Those of another tree: no use for culling, and no harm.
                for (numbers, fits) in [(&own, true), (&elsewhere, false)] {
                    let q = Query::new(z, &lobes[..count], constant_for(0.5, 24.0, n), i);
                    let q = Query { pregenerated: Some(numbers), ..q };
                    let (tree, stats) = hits(&bvh, &q, false);
                    let (brute, all) = hits(&bvh, &q, true);
                    assert_eq!(tree, brute, "n {n} query {i} lobes {count}");
                    assert_eq!(all.leaves as usize, n);
                    assert_eq!(tree, hits(&bvh, &Query { key: !i, ..q }, false).0, "the key plays no part");
                    accepted += tree.len();
                    culled += usize::from(fits && stats.leaves < all.leaves);
                }
            }
        }
    }
    assert!(accepted > 1000 && culled > 400, "{accepted} {culled}");
}

#[test]
fn numbers_are_uniform_over_places_and_over_seeds() {
    let mut bvh = VertexBvh::new();
    bvh.build(&surface_points(20)).unwrap();
    let of = |seed| Pregenerated::new(&bvh, seed);
    for seed in 0..4 {
        let numbers = of(seed);
        let k = kolmogorov(&mut (0..100_000).map(|i| numbers.number(i)).collect::<Vec<_>>());
        assert!(k < 2.3, "seed {seed}: sqrt(n) D = {k}"); // p = 5e-5
    }
    for place in [0, 1, 7, 8, 1 << 20] {
        let k = kolmogorov(&mut (0..20_000).map(|seed| of(seed).number(place)).collect::<Vec<_>>());
        assert!(k < 2.3, "place {place}: sqrt(n) D = {k}");
    }
}

#[test]
fn sums_are_unbiased_over_seeds() {
    let mut bvh = VertexBvh::new();
    for (case, (ax, ay)) in [(1.0, 1.0), (1e-2, 1e-2), (1e-4, 1e-2), (1e-7, 1e-7)].into_iter().enumerate() {
        let (points, z, lobe) = lit_lobe(700, ax, ay, case as u64);
        bvh.build(&points).unwrap();
        let (lobes, constant) = ([lobe], 0.1 * ax * ay);
        let value = |i: usize| 0.2 + u(i as u64, 31);
        let p: Vec<_> = points.iter().map(|x| probability(&lobes, constant, x.as_dvec3() - z)).collect();
        let truth: f64 = (0..points.len()).map(value).sum();
        let variance: f64 = (0..points.len()).map(|i| value(i).powi(2) * (1.0 / p[i] - 1.0)).sum();
        let (n, mut total) = (4000, 0.0);
        for seed in 0..n {
            let numbers = Pregenerated::new(&bvh, mix(seed ^ 0xabc));
            let q = Query { pregenerated: Some(&numbers), ..Query::new(z, &lobes, constant, 0) };
            query(&bvh, &q, &mut QueryCounters::default(), &mut |i, p| total += value(i as usize) / p);
        }
        let z = (total / n as f64 - truth) / (variance / n as f64).sqrt();
        assert!(z.abs() < 4.0 && z != 0.0, "alpha ({ax}, {ay}): z = {z}");
    }
}

#[test]
fn neighbours_err_together_with_shared_numbers_and_apart_with_their_own() {
    const EYES: usize = 16;
    let alpha = 1e-3;
    let (points, z, lobe) = lit_lobe(400, alpha, alpha, 3);
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    let (lobes, constant) = ([lobe], 0.15 * alpha * alpha);
    // Eye vertices within a tenth of the lobe's width: samples of one pixel.
    let frame = *lobe.frame();
    let eyes: Vec<_> = (0..EYES as u64)
        .map(|i| z + (frame.x * (u(i, 61) - 0.5) + frame.y * (u(i, 62) - 0.5)) * (0.1 * alpha))
        .collect();
    let p = |x: &glam::Vec3, z: DVec3| probability(&lobes, constant, x.as_dvec3() - z);
    let independent: f64 = points.iter().map(|x| 1.0 / p(x, eyes[0]) - 1.0).sum();
    // Variance, in units of independent roulettes, of one query and of the mean of all, over many iterations.
    let measure = |shared: bool| {
        let n = 4000u64;
        let (mut one, mut mean) = ([0.0; 2], [0.0; 2]);
        for iteration in 0..n {
            let numbers = Pregenerated::new(&bvh, mix(iteration));
            let mut sums = [0.0; EYES];
            for (k, &eye) in eyes.iter().enumerate() {
                let q = Query::new(eye, &lobes, constant, mix(mix(iteration) ^ k as u64));
                let q = Query { pregenerated: shared.then_some(&numbers), ..q };
                query(&bvh, &q, &mut QueryCounters::default(), &mut |_, p| sums[k] += 1.0 / p);
            }
            // Relative to the truth, so that the differences do not cancel.
            let off = |x: f64| x - points.len() as f64;
            for (moments, x) in
                [(&mut one, off(sums[0])), (&mut mean, off(sums.iter().sum::<f64>() / EYES as f64))]
            {
                moments[0] += x;
                moments[1] += x * x;
            }
        }
        [one, mean].map(|[a, b]| (b / n as f64 - (a / n as f64).powi(2)) / independent)
    };
    let ([one, mean], [own_one, own_mean]) = (measure(true), measure(false));
    println!("shared: one {one:.3} mean {mean:.3}; own: one {own_one:.3} mean {own_mean:.4}");
    assert!((one - 1.0).abs() < 0.1, "a single query is like independent roulettes: {one}");
    assert!(own_one < 1.0 && own_mean < 1.3 * own_one / EYES as f64, "fresh numbers average out: {own_mean}");
    assert!(mean > 0.5 * one, "shared ones hardly do: {mean}");
}
