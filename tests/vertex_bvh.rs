//! The tree over light vertices, as its callers see it.

use glam::{DVec3, Vec3};
use hrr::sampler::counter::{mix, unit};
use hrr::vertex_bvh::{Block, NodeId, VertexBvh};
use proptest::prelude::*;

fn points(n: usize, seed: u64) -> Vec<Vec3> {
    let u = |i: usize, k: u64| unit(mix(mix(i as u64 ^ seed) ^ k)) as f32;
    (0..n).map(|i| Vec3::new(u(i, 1), u(i, 2), u(i, 3))).collect()
}

/// The tree, flattened: positions and indices in order.
fn contents(bvh: &VertexBvh) -> Vec<(u32, [u32; 3])> {
    let lanes =
        |b: &Block| (0..8).map(|l| (b.index[l], b.point(l).to_array().map(f32::to_bits))).collect::<Vec<_>>();
    bvh.blocks().iter().flat_map(lanes).take(bvh.len()).collect()
}

#[test]
fn a_vertex_takes_less_than_48_bytes() {
    let mut bvh = VertexBvh::new();
    for n in [10_000, 100_000] {
        bvh.build(&points(n, 0)).unwrap();
        let bytes = bvh.bytes() as f64 / n as f64;
        assert!(bytes > 16.0 && bytes < 20.0, "{bytes}");
    }
}

#[test]
fn a_tree_does_not_remember_the_one_before() {
    let (large, small) = (points(5000, 1), points(60, 2));
    let mut fresh = VertexBvh::new();
    fresh.build(&small).unwrap();
    let mut used = VertexBvh::new();
    used.build_masked(&large, Some(&vec![3; 5000])).unwrap();
    used.build(&small).unwrap();
    assert_eq!(contents(&fresh), contents(&used));
    assert_eq!(used.root(), Some(NodeId { level: 1, index: 0 }));
    assert!(used.masks(used.root().unwrap()).is_none());
    assert_eq!(fresh.bytes(), used.bytes());
}

#[test]
fn bad_input_leaves_an_empty_tree() {
    let mut bvh = VertexBvh::new();
    bvh.build(&points(100, 0)).unwrap();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut p = points(100, 0);
        p[71].z = bad;
        let message = bvh.build(&p).unwrap_err().to_string();
        assert!(message.contains("light vertex 71"), "{message}");
        assert!(bvh.is_empty() && bvh.root().is_none());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any finite positions: every vertex once, every box around what is below it, the same tree again.
    #[test]
    fn every_vertex_is_below_every_box_on_its_way(
        raw in prop::collection::vec((any::<f32>(), any::<f32>(), any::<f32>()), 1..700),
        plane in any::<bool>(),
    ) {
        let keep = |x: f32| if x.is_finite() { x } else { 0.0 };
        let p: Vec<_> = raw.iter().map(|&(x, y, z)| Vec3::new(keep(x), keep(y), if plane { 1.0 } else { keep(z) })).collect();
        let mut bvh = VertexBvh::new();
        bvh.build(&p).unwrap();
        let found = contents(&bvh);
        let mut indices: Vec<_> = found.iter().map(|f| f.0).collect();
        indices.sort_unstable();
        prop_assert!(indices.iter().copied().eq(0..p.len() as u32));
        for (place, (index, bits)) in found.iter().enumerate() {
            let position = p[*index as usize];
            prop_assert_eq!(position.to_array().map(f32::to_bits), *bits);
            for level in 1..=bvh.root().unwrap().level {
                let child = place / 8usize.pow(level);
                let node = NodeId { level, index: (child / 8) as u32 };
                let (boxes, lane) = (bvh.boxes(node), child % 8);
                prop_assert!(lane < bvh.children(node));
                for axis in 0..3 {
                    let off = (f64::from(position[axis]) - f64::from(boxes.center[axis][lane])).abs();
                    prop_assert!(off <= f64::from(boxes.half[axis][lane]), "vertex {index} level {level}");
                }
            }
        }
        let mut again = VertexBvh::new();
        again.build(&p).unwrap();
        prop_assert_eq!(contents(&again), found);
    }
}

#[test]
fn a_ball_holds_what_testing_every_vertex_finds() {
    let mut bvh = VertexBvh::new();
    let mut found_in_all = 0;
    for (n, scale, shift) in
        [(1, 1.0, 0.0), (9, 1.0, 0.0), (700, 1e-4, 1.0), (20_000, 1.0, 50.0), (5000, 1e6, -3e5)]
    {
        let points: Vec<Vec3> =
            points(n, 5).iter().map(|p| (p.as_dvec3() * scale + shift).as_vec3()).collect();
        bvh.build(&points).unwrap();
        for i in 0..200u64 {
            let u = |k: u64| unit(mix(mix(i ^ 99) ^ k));
            let near = points[(u(1) * n as f64) as usize].as_dvec3();
            let radius = scale * 10f64.powf(-5.0 * u(2));
            let center = near + (DVec3::new(u(3), u(4), u(5)) - 0.5) * radius;
            let mut found = Vec::new();
            bvh.within(center, radius, &mut |index| found.push(index));
            found.sort_unstable();
            let expected: Vec<u32> = (0..n as u32)
                .filter(|&k| (points[k as usize].as_dvec3() - center).length_squared() <= radius * radius)
                .collect();
            assert_eq!(found, expected, "{n} vertices, radius {radius}");
            found_in_all += found.len();
        }
    }
    assert!(found_in_all > 1000, "{found_in_all}");
    VertexBvh::new().within(DVec3::ZERO, 1.0, &mut |_| panic!("an empty tree"));
}
