//! Where single precision, or even double, runs out of digits: positions a billionth apart far from the origin, powers
//! that underflow or overflow; and the lobe itself against 256 bits.

use super::{LOCAL, accepted, tree};
use crate::roulette::{hits, random_frame, surface_points, u};
use dashu_float::{FBig, round::mode::HalfEven};
use glam::{DVec3, Vec3};
use hrr::roulette::{Lobe, MinimumRandom, Query, QueryCounters, probability, query};
use hrr::sampler::counter::mix;

/// 256 bits.
type Wide = FBig<HalfEven, 2>;

fn wide(x: f64) -> Wide {
    Wide::try_from(x).unwrap().with_precision(256).value()
}

/// `C c K / d^2` by the slides' formula, which cancels: up to 2 log2(1/alpha) bits of the 256.
fn slides(lobe: &Lobe, constant: f64, offset: DVec3) -> f64 {
    let f = lobe.frame();
    let dot = |axis: DVec3| {
        wide(axis.x) * wide(offset.x) + wide(axis.y) * wide(offset.y) + wide(axis.z) * wide(offset.z)
    };
    let (ax, ay) = lobe.alpha();
    let (a, z) = (wide(ax.max(ay)), dot(f.z));
    let (x, y) = (&a / wide(ax) * dot(f.x), &a / wide(ay) * dot(f.y));
    let long = (x.sqr() + y.sqr() + z.sqr()).sqrt();
    let a2 = a.sqr();
    let h2 = (&long - &z + &a2 * (&long + &z)).sqr();
    (wide(constant) * wide(lobe.weight()) * wide(4.0) * a2.sqr() / h2).to_f64().value()
}

#[test]
fn probabilities_agree_with_256_bits_at_every_roughness() {
    let mut worst = 0.0f64;
    for i in 0..4000 {
        let frame = random_frame(i);
        let (ax, ay) = (10f64.powf(-7.0 * u(i, 7)), 10f64.powf(-7.0 * u(i, 8)));
        let lobe = Lobe::new(frame, ax, ay, 1.0);
        // Within a few widths of the axis, or anywhere, or behind; far from the origin and near.
        let (s, t) = (6.0 * u(i, 9) - 3.0, 6.0 * u(i, 10) - 3.0);
        let local = match i % 3 {
            0 => DVec3::new(s * ax, t * ay, 1.0),
            1 => random_frame(i + 5000).z,
            _ => DVec3::new(s * ax, t * ay, -1.0),
        };
        let eye = random_frame(i + 9000).z * if i % 2 == 0 { 0.0 } else { 1e5 };
        let scale = 10f64.powf(12.0 * u(i, 11) - 6.0);
        let vertex = (frame.to_world(local) * scale + eye).as_vec3().as_dvec3();
        let offset = vertex - eye;
        let constant = 1e-3 * scale * scale * ax * ay;
        let (p, exact) = (probability(&[lobe], constant, offset), slides(&lobe, constant, offset));
        if exact >= 1.0 {
            assert!(p > 1.0 - 1e-8, "{p} for {exact}");
            continue;
        }
        // Only the products with the frame round: by parts in 1e16 of the offset, in units of the lobe's width.
        let error = (p / exact - 1.0).abs() * ax.min(ay);
        worst = worst.max(error);
        assert!(error < 4e-15, "query {i}, alpha ({ax:e}, {ay:e}): {p:e}, exactly {exact:e}");
    }
    assert!(worst > 1e-17, "something must round: {worst:e}");
}

#[test]
fn a_light_vertex_1e_minus_9_from_the_eye_vertex_far_from_the_origin() {
    // The eye's position lies within half a step of f32 of the vertex, which its two f32 parts must tell apart.
    let mut certain = [0, 0];
    for i in 0..4000u64 {
        let at = Vec3::new(1e5, -7e4, 3e4) * (0.5 + u(i, 1) as f32);
        let near = 10f64.powf(-8.0 - 4.0 * u(i, 2));
        let eye = at.as_dvec3() + random_frame(i).z * near;
        let alpha = 10f64.powf(-5.0 * u(i, 3));
        let lobe = [Lobe::new(random_frame(i + 7), alpha, alpha, 1.0)];
        // P in the middle of (0,1), whatever the direction.
        let h2 = lobe[0].h2(at.as_dvec3() - eye);
        let q = Query::new(eye, &lobe, h2 * (0.5 + 0.6 * u(i, 4)), mix(i));
        let points = [at, at + Vec3::X, at - Vec3::Y];
        certain[usize::from(accepted(&tree(&points), &q).iter().any(|hit| hit.0 == 0))] += 1;
    }
    assert!(certain[0] > 200 && certain[1] > 1000, "{certain:?}");
}

#[test]
pub fn eye_and_light_vertices_that_are_denormal() {
    let tiny = |k: i32| f32::from_bits(k as u32);
    let points: Vec<_> = (0..200).map(|i| Vec3::new(tiny(i), -tiny(3 * i), tiny(i * i))).collect();
    let bvh = tree(&points);
    let mut total = 0;
    for i in 0..400u64 {
        let eye = (random_frame(i).z * 100.0 * 10f64.powf(u(i, 1))) * f64::from(tiny(1));
        let alpha = 10f64.powf(-3.0 * u(i, 2));
        let lobe = [Lobe::new(random_frame(i + 7), alpha, alpha, 1.0)];
        for area in [1e-86, 1e-84, 1e-80] {
            total += accepted(&bvh, &Query::new(eye, &lobe, area, mix(i))).len();
        }
    }
    assert!(total > 1000, "{total}");
}

#[test]
fn powers_that_underflow_or_overflow() {
    // C times the weight, the square root of its inverse in f32, and the squares of both.
    let at = Vec3::new(0.25, -0.5, 0.125);
    let mut points = surface_points(500);
    points.push(at);
    points.extend(surface_points(40).iter().map(|p| *p * 1e30));
    let bvh = tree(&points);
    let mut found = 0;
    for (i, weight) in [1e-320, 1e-200, 1e-80, 1e-30, 1.0, 1e30, 1e80, 1e200, 1e300].into_iter().enumerate() {
        for constant in [1e-320, 1e-200, 1e-89, 1e-40, 1.0, 1e40, 1e60, 1e76, 1e84, 1e89, 1e200, 1e300] {
            for alpha in [1.0, 1e-3, 1e-7] {
                let frame = random_frame(i as u64);
                let one = Lobe::new(frame, alpha, alpha, weight);
                for lobes in [vec![one], vec![one, Lobe::new(frame, 0.5 * alpha, 1.0, 0.1 * weight)]] {
                    for eye in [at.as_dvec3(), DVec3::ZERO, DVec3::splat(1e-30), DVec3::splat(3e38)] {
                        for key in 0..4 {
                            found += accepted(&bvh, &Query::new(eye, &lobes, constant, mix(key))).len();
                        }
                    }
                    // On the eye vertex itself, however small C.
                    let on = accepted(&bvh, &Query::new(at.as_dvec3(), &lobes, constant, 7));
                    assert!(on.contains(&(500, 1.0)), "{weight:e} {constant:e} {alpha:e}");
                }
            }
        }
    }
    assert!(found > 10_000, "{found}");
}

#[test]
fn vertices_behind_a_narrow_lobe_at_the_end_of_single_precision() {
    // The range reaches 1e44 along the axis and 1e30 behind: the scale that makes it 1 is denormal in f32.
    let behind: Vec<_> = (0..400).map(|i| Vec3::new(0.0, 0.0, -1e29 * (1.0 + 0.05 * i as f32))).collect();
    let bvh = tree(&behind);
    let mut counts = [0; 2];
    for power in [83.0, 84.0, 85.0, 86.0, 87.0, 88.0, 89.0, 90.0] {
        let alpha = 10f64.powf(-0.25 * (power - 59.0));
        let lobe = [Lobe::new(LOCAL, alpha, alpha, 1.0)];
        for key in 0..40 {
            let found = accepted(&bvh, &Query::new(DVec3::ZERO, &lobe, 10f64.powf(power), mix(key))).len();
            counts[0] += found;
            counts[1] += bvh.len() - found;
        }
    }
    assert!(counts[0] > 1000 && counts[1] > 1000, "{counts:?}");
}

#[test]
fn a_query_within_anothers_visit() {
    let bvh = tree(&surface_points(3000));
    let (outer, inner) = ([Lobe::sphere(1.0)], [Lobe::new(random_frame(3), 0.1, 0.2, 20.0)]);
    for rule in [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact] {
        let first = Query { rule, ..Query::new(DVec3::ZERO, &outer, 0.01, 1) };
        let second = Query { rule, ..Query::new(DVec3::splat(0.1), &inner, 0.01, 2) };
        let (alone, _) = hits(&bvh, &first, false);
        let (within, _) = hits(&bvh, &second, false);
        assert!(alone.len() > 10 && within.len() > 5);
        let mut found = Vec::new();
        query(&bvh, &first, &mut QueryCounters::default(), &mut |i, p| {
            found.push((i, p));
            assert_eq!(hits(&bvh, &second, false).0, within);
        });
        assert_eq!(found, alone);
    }
}
