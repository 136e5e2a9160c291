//! Inputs at the edge of what numbers can hold: each must neither panic nor bias, and the tree must accept what
//! testing every vertex in f64 accepts.
//!
//! Elsewhere: leaves uniform with tails to 1e-7 (`roulette`), skinny triangles and coplanar duplicates (`visibility`,
//! `ray_offset`), the furnace at every roughness (`bsdf/energy`), any bytes (`fuzz`).

mod numbers;
mod precision;

use crate::roulette::{hits, lit_lobe, random_frame, surface_points, u};
use glam::{DVec3, Vec3};
use hrr::math::Frame;
use hrr::roulette::{Lobe, Query, QueryCounters, probability, query};
use hrr::sampler::counter::mix;
use hrr::vertex_bvh::VertexBvh;

const LOCAL: Frame = Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z };

fn tree(points: &[Vec3]) -> VertexBvh {
    let mut bvh = VertexBvh::new();
    bvh.build(points).unwrap();
    bvh
}

/// The accepted set, found to be the same by the tree and by testing all.
fn accepted(bvh: &VertexBvh, q: &Query<'_>) -> Vec<(u32, f64)> {
    let (found, _) = hits(bvh, q, false);
    let (all, stats) = hits(bvh, q, true);
    assert_eq!(found, all);
    assert!(!(q.constant > 0.0) || stats.leaves as usize == bvh.len());
    found
}

#[test]
fn roughness_from_1_to_1e_minus_7() {
    let alphas = [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
    let mut total = 0;
    for (case, (ax, ay)) in alphas.iter().flat_map(|&a| [(a, a), (a, 1e-2), (1e-4, a)]).enumerate() {
        let (points, z, lobe) = lit_lobe(3000, ax, ay, case as u64);
        let bvh = tree(&points);
        for key in 0..40 {
            total += accepted(&bvh, &Query::new(z, &[lobe], 0.02 * ax * ay, mix(key))).len();
        }
    }
    assert!(total > 10_000, "{total}");
}

#[test]
fn grazing_view_down_to_a_cosine_of_1e_minus_6() {
    let mut total = 0;
    for cos in [1e-2, 1e-4, 1e-6, 1e-9, 0.0] {
        let sin = (1.0f64 - cos * cos).sqrt();
        let wo = DVec3::new(sin * 0.6, sin * 0.8, cos);
        for (ax, ay) in [(1e-4, 1e-4), (1e-7, 1e-2), (0.3, 0.3)] {
            let reflected = Lobe::from_ggx_reflection(&LOCAL, wo, ax, ay, 1.0);
            let transmitted = Lobe::from_ggx_transmission(&LOCAL, wo, ax, ay, 1.5, 1.0);
            let inward = Lobe::from_ggx_transmission(&LOCAL, wo, ax, ay, 1.0 / 1.5, 1.0);
            for lobe in [reflected, transmitted, inward] {
                let f = lobe.frame();
                assert!((f.x.cross(f.y) - f.z).length() < 1e-9, "{cos} {ax}: {f:?}");
                assert!(lobe.weight() > 0.0 && lobe.weight().is_finite(), "{cos} {ax}: {}", lobe.weight());
                assert!(lobe.alpha().0 > 0.0 && lobe.alpha().1 > 0.0);
                // Vertices strewn along the lobe.
                let points: Vec<_> = (0..500)
                    .map(|i| {
                        let s = DVec3::new(u(i, 1) - 0.5, u(i, 2) - 0.5, u(i, 3));
                        f.to_world(DVec3::new(s.x * 8.0 * lobe.alpha().0, s.y * 8.0 * lobe.alpha().1, s.z))
                            .as_vec3()
                    })
                    .collect();
                let bvh = tree(&points);
                let constant = 0.1 / lobe.weight();
                for key in 0..10 {
                    total += accepted(&bvh, &Query::new(DVec3::ZERO, &[lobe], constant, key)).len();
                }
            }
        }
    }
    // Lobes narrower than f32 resolves at distance 1 accept next to nothing.
    assert!(total > 2000, "{total}");
}

#[test]
fn light_vertex_on_behind_and_near_the_eye_vertex() {
    let z = Vec3::new(0.25, 0.5, -0.75);
    let points = [z, z - Vec3::Z, z - Vec3::Z * 1e-7, z + Vec3::Z * 1e-7, z + Vec3::X * 1e-7];
    for alpha in [1.0, 1e-4, 1e-7] {
        let lobe = [Lobe::new(LOCAL, alpha, alpha, 1.0)];
        let found = accepted(&tree(&points), &Query::new(z.as_dvec3(), &lobe, 1.0, 1));
        assert!(found.contains(&(0, 1.0)), "a vertex on the eye vertex is certain: {found:?}");
        assert!(found.iter().all(|f| f.1 > 0.0 && f.1 <= 1.0));
        // An eye vertex 1e-9 beside a light vertex, which f32 cannot tell from it.
        let beside = z.as_dvec3() + DVec3::new(0.0, 0.0, -1e-9);
        assert!(accepted(&tree(&points), &Query::new(beside, &lobe, 1.0, 1)).contains(&(0, 1.0)));
        let p = probability(&lobe, 1e-18, z.as_dvec3() - beside);
        assert!((p - 1.0).abs() < 1e-6, "1e-9 ahead on the axis: {p}");
    }
}

#[test]
fn constants_from_nothing_to_infinity() {
    let bvh = tree(&surface_points(100));
    let lobe = [Lobe::new(random_frame(1), 1e-3, 1e-2, 1.0)];
    let count = |c| accepted(&bvh, &Query::new(DVec3::ZERO, &lobe, c, 3)).len();
    assert_eq!(count(0.0), 0);
    assert_eq!(count(-1.0), 0);
    assert_eq!(count(f64::NAN), 0);
    assert_eq!(count(5e-324), 0);
    assert_eq!(count(1e-300), 0);
    assert_eq!(count(1e300), 100);
    assert_eq!(count(f64::INFINITY), 100);
    let dark = [Lobe::sphere(0.0)];
    assert_eq!(accepted(&bvh, &Query::new(DVec3::ZERO, &dark, f64::INFINITY, 3)).len(), 0);
    assert_eq!(accepted(&bvh, &Query::new(DVec3::ZERO, &[], 1.0, 3)).len(), 0);
    let nowhere = Query::new(DVec3::new(f64::NAN, 0.0, 0.0), &lobe, 1.0, 3);
    assert_eq!(accepted(&bvh, &nowhere).len(), 0);
    accepted(&bvh, &Query::new(DVec3::new(f64::INFINITY, 0.0, 0.0), &lobe, 1.0, 3));
    accepted(&bvh, &Query::new(DVec3::splat(1e300), &lobe, f64::INFINITY, 3));
}

#[test]
fn many_lobes_and_none() {
    let bvh = tree(&surface_points(500));
    let lobes: Vec<_> = (0..12).map(|i| Lobe::new(random_frame(i), 0.05, 0.2, 1.0)).collect();
    for count in [0, 1, 2, 7, 8, 9, 12] {
        for key in 0..20 {
            accepted(&bvh, &Query::new(DVec3::ZERO, &lobes[..count], 0.01, key));
        }
    }
}

fn identical(n: usize) {
    let points = vec![Vec3::new(0.3, -7.0, 2.0); n];
    let bvh = tree(&points);
    let lobe = [Lobe::sphere(1.0)];
    let p = 5000.0 / n as f64;
    let constant = p * (points[0].as_dvec3()).length_squared();
    let count = accepted(&bvh, &Query::new(DVec3::ZERO, &lobe, constant, 3)).len();
    assert!((count as f64 - 5000.0).abs() < 5.0 * 5000f64.sqrt(), "{count}");
}

#[test]
fn identical_positions() {
    identical(20_000);
}

#[test]
#[ignore = "1e7 vertices"]
fn ten_million_identical_positions() {
    identical(10_000_000);
}

#[test]
fn all_vertices_on_a_line_or_in_a_plane() {
    for axis in 0..3 {
        let mut line = vec![Vec3::ZERO; 2000];
        let mut plane = vec![Vec3::splat(0.5); 2000];
        for i in 0..2000 {
            line[i][axis] = u(i as u64, 1) as f32;
            plane[i][axis] = u(i as u64, 2) as f32;
            plane[i][(axis + 1) % 3] = u(i as u64, 3) as f32;
        }
        for points in [line, plane] {
            let bvh = tree(&points);
            let mut total = 0;
            // Along the axis, from a place on the line: in the plane, and grazing it.
            for alpha in [1e-1, 1e-4, 1e-6] {
                let mut direction = DVec3::ZERO;
                direction[axis] = 1.0;
                let lobe = [Lobe::new(Frame::from_z(direction), alpha, alpha, 1.0)];
                for (key, z) in [DVec3::ZERO, DVec3::splat(0.5), direction * -1.0, direction * 0.37]
                    .into_iter()
                    .enumerate()
                {
                    for constant in [1e-3, 1.0 / (alpha * alpha)] {
                        total += accepted(&bvh, &Query::new(z, &lobe, constant, key as u64)).len();
                    }
                }
            }
            assert!(total > 1000, "{total}");
        }
    }
}

#[test]
fn one_and_two_vertices() {
    let lobe = [Lobe::sphere(1.0)];
    for n in [1, 2] {
        let points: Vec<_> = (0..n).map(|i| Vec3::X * (1.0 + i as f32)).collect();
        let bvh = tree(&points);
        let mut count = [0.0; 2];
        for key in 0..4000 {
            for (i, _) in accepted(&bvh, &Query::new(DVec3::ZERO, &lobe, 0.5, mix(key))) {
                count[i as usize] += 1.0 / 4000.0;
            }
        }
        assert!(
            (count[0] - 0.5f64).abs() < 0.04 && (n == 1 || (count[1] - 0.125f64).abs() < 0.03),
            "{count:?}"
        );
    }
}

#[test]
fn scaled_scenes_accept_the_same() {
    // Powers of two scale without rounding: the same sets to the bit. 1e6 and 1e-6: the same but for roundings.
    let (points, z, lobe) = lit_lobe(2000, 1e-4, 1e-3, 5);
    let constant = 0.05 * 1e-7;
    let sets = |scale: f64| {
        let scaled: Vec<_> = points.iter().map(|p| (p.as_dvec3() * scale).as_vec3()).collect();
        let bvh = tree(&scaled);
        (0..30)
            .map(|key| accepted(&bvh, &Query::new(z * scale, &[lobe], constant * scale * scale, key)))
            .collect::<Vec<_>>()
    };
    let one = sets(1.0);
    assert!(one.iter().map(Vec::len).sum::<usize>() > 300);
    assert_eq!(sets(2f64.powi(20)), one);
    assert_eq!(sets(2f64.powi(-20)), one);
    for scale in [1e6, 1e-6] {
        let other = sets(scale);
        let count = |s: &[Vec<(u32, f64)>]| s.iter().map(Vec::len).sum::<usize>() as f64;
        assert!((count(&other) / count(&one) - 1.0).abs() < 0.1);
    }
}

#[test]
fn far_from_the_origin() {
    // f32 positions keep 0.008 at 1e5: the sets agree, and eye positions keep all their bits.
    for scale in [1e-6, 1.0, 1e6] {
        let offset = DVec3::new(1e5, -1e5, 1e5) * scale;
        let (points, z, _) = lit_lobe(1500, 0.1, 0.1, 8);
        let moved: Vec<_> = points.iter().map(|p| (p.as_dvec3() * scale + offset).as_vec3()).collect();
        let bvh = tree(&moved);
        let eye = z * scale + offset;
        let mut total = 0;
        for (key, target) in moved.iter().step_by(31).enumerate() {
            let axis = (target.as_dvec3() - eye).normalize();
            for alpha in [1e-2, 1e-5, 1e-7] {
                let lobe = Lobe::new(Frame::from_z(axis), alpha, alpha, 1.0);
                total += accepted(&bvh, &Query::new(eye, &[lobe], 0.1 * scale * scale, key as u64)).len();
            }
        }
        assert!(total > 10, "{total}");
    }
}

#[test]
fn a_vertex_that_is_not_a_number() {
    let mut points = surface_points(10);
    points[3].y = f32::NAN;
    let message = VertexBvh::new().build(&points).unwrap_err().to_string();
    assert!(message.contains("light vertex 3"), "{message}");
}

#[test]
fn denormal_and_huge_coordinates() {
    let tiny = f32::from_bits(1);
    let points: Vec<_> = (0..300)
        .map(|i| match i % 3 {
            0 => Vec3::new(tiny * i as f32, -tiny, 0.0),
            1 => Vec3::new(f32::MAX, -f32::MAX, i as f32),
            _ => Vec3::new(1e-20 * i as f32, 1e20, -1e-38),
        })
        .collect();
    let bvh = tree(&points);
    for alpha in [1.0, 1e-3, 1e-7] {
        let lobe = [Lobe::new(random_frame(2), alpha, alpha, 1.0)];
        for (key, constant) in [1e-80, 1e-30, 1.0, 1e30, 1e60, 1e80].into_iter().enumerate() {
            accepted(&bvh, &Query::new(DVec3::ZERO, &lobe, constant, key as u64));
            accepted(&bvh, &Query::new(DVec3::new(1e-40, 0.0, 1e10), &lobe, constant, key as u64));
        }
    }
}

/// Denormals are zero and results flushed to zero while this runs, as hosts with the like of Embree's settings do.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
fn flushing_to_zero(work: impl FnOnce()) {
    let set = |bits: u32| {
        // SAFETY: loads the control register of this thread's SSE unit from a valid address; the reserved bits stay
        // zero.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &bits, options(nostack, readonly)) }
    };
    set(0x9fc0);
    work();
    set(0x1f80);
}

#[test]
#[cfg(target_arch = "x86_64")]
fn flush_to_zero_changes_nothing() {
    let (points, z, lobe) = lit_lobe(2000, 1e-4, 1e-4, 5);
    let bvh = tree(&points);
    let sets = || (0..50).map(|key| accepted(&bvh, &Query::new(z, &[lobe], 1e-9, key))).collect::<Vec<_>>();
    let plain = sets();
    assert!(plain.iter().map(Vec::len).sum::<usize>() > 50);
    flushing_to_zero(|| {
        assert_eq!(sets(), plain);
        denormal_and_huge_coordinates();
        precision::eye_and_light_vertices_that_are_denormal();
    });
}

#[test]
fn any_bits_as_a_query() {
    let bvh = tree(&surface_points(300));
    let any = |i: u64, k: u64| f64::from_bits(mix(mix(i) ^ k));
    for i in 0..3000 {
        let v = |k: u64| DVec3::new(any(i, k), any(i, k + 1), any(i, k + 2));
        let frame = Frame { x: v(1), y: v(4), z: v(7) };
        let lobes = [Lobe::new(frame, any(i, 10), any(i, 11), any(i, 12)), Lobe::sphere(any(i, 13))];
        let q = Query::new(v(14), &lobes[..1 + (i as usize & 1)], any(i, 17), i);
        query(&bvh, &q, &mut QueryCounters::default(), &mut |_, p| assert!(p > 0.0 && p <= 1.0));
        Lobe::from_ggx_reflection(&frame, v(1), any(i, 10), any(i, 11), any(i, 12));
        Lobe::from_ggx_transmission(&frame, v(1), any(i, 10), any(i, 11), any(i, 13), any(i, 12));
    }
}
