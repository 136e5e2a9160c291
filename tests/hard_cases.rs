//! Inputs at the edge of what numbers can hold: each must neither panic nor bias.

use crate::roulette::{hits, random_frame, surface_points};
use glam::{DVec3, Vec3};
use hrr::roulette::{Lobe, Query};
use hrr::vertex_bvh::VertexBvh;

fn tree(points: &[Vec3]) -> VertexBvh {
    let mut bvh = VertexBvh::new();
    bvh.build(points).unwrap();
    bvh
}

fn same_both_ways(bvh: &VertexBvh, q: &Query<'_>) -> usize {
    let (found, _) = hits(bvh, q, false);
    assert_eq!(found, hits(bvh, q, true).0);
    found.len()
}

#[test]
fn light_vertex_on_behind_and_near_the_eye_vertex() {
    let z = Vec3::new(0.25, 0.5, -0.75);
    let points = [z, z - Vec3::Z, z + Vec3::Z * 1e-7];
    let lobe = [Lobe::new(hrr::math::Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z }, 1e-4, 1e-4, 1e8)];
    let (found, _) = hits(&tree(&points), &Query::new(z.as_dvec3(), &lobe, 1.0, 1), false);
    assert!(found.contains(&(0, 1.0)), "a vertex on the eye vertex is certain: {found:?}");
    assert!(found.iter().all(|f| f.1 > 0.0));
}

#[test]
fn constants_from_nothing_to_infinity() {
    let bvh = tree(&surface_points(100));
    let lobe = [Lobe::new(random_frame(1), 1e-3, 1e-2, 1.0)];
    let count = |c| same_both_ways(&bvh, &Query::new(DVec3::ZERO, &lobe, c, 3));
    assert_eq!(count(0.0), 0);
    assert_eq!(count(-1.0), 0);
    assert_eq!(count(f64::NAN), 0);
    assert_eq!(count(1e-300), 0);
    assert_eq!(count(f64::INFINITY), 100);
    let dark = [Lobe::sphere(0.0)];
    assert_eq!(same_both_ways(&bvh, &Query::new(DVec3::ZERO, &dark, f64::INFINITY, 3)), 0);
    assert_eq!(same_both_ways(&bvh, &Query::new(DVec3::ZERO, &[], 1.0, 3)), 0);
}

#[test]
fn identical_positions() {
    let points = vec![Vec3::new(0.3, -7.0, 2.0); 10_000];
    let lobe = [Lobe::sphere(1.0)];
    let n = same_both_ways(&tree(&points), &Query::new(DVec3::ZERO, &lobe, 0.5, 3));
    let expected = 1e4 * 0.5 / (0.09 + 49.0 + 4.0);
    assert!((n as f64 - expected).abs() < 5.0 * expected.sqrt(), "{n} {expected}");
}
