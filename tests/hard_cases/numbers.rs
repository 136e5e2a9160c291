//! Random numbers of deep trees, of huge ones, and where one stratum ends and the next begins.

use super::{accepted, tree};
use crate::roulette::surface_points;
use glam::DVec3;
use hrr::roulette::min_random::Minimum;
use hrr::roulette::{Lobe, MinimumRandom, Query};
use hrr::sampler::counter::mix;

#[test]
fn depth_60_trees_and_counts_to_2_to_the_31() {
    // A chain that hands one leaf aside and keeps the rest, 60 deep, over 2^31 leaves and more.
    for rule in [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact] {
        let (n, mut seen) = (1u64 << 31, [0u64; 4]);
        for key in 0..20_000u64 {
            let mut node = rule.root(mix(key), n as f64);
            assert!(node.xi > 0.0 && node.xi < 1e-7);
            let mut left = n as u32;
            for depth in 0..60u64 {
                let counts = if depth % 2 == 0 { [1, left - 1] } else { [left / 2, left - left / 2] };
                let mut children = [node; 2];
                rule.split(node, mix(key ^ mix(depth)), &counts, &mut children);
                for child in children {
                    assert!(
                        child.xi >= node.xi && child.xi <= 1.0,
                        "{rule:?} depth {depth}: {child:?} below {node:?}"
                    );
                }
                if counts[0] == 1 {
                    for (decade, seen) in seen.iter_mut().enumerate() {
                        *seen += u64::from(children[0].xi < 10f64.powi(-(decade as i32) - 1));
                    }
                }
                node = children[1];
                left = counts[1];
                if left < 4 {
                    break;
                }
            }
        }
        // Leaves aside at even depths, 20 000 keys: a tenth below 0.1, and so on.
        let leaves = seen[0] as f64 * 10.0;
        for (decade, &count) in seen.iter().enumerate() {
            let mean = leaves * 0.1f64.powi(decade as i32 + 1);
            assert!(
                (count as f64 - mean).abs() < 5.0 * mean.sqrt() + 0.05 * mean,
                "{rule:?} {decade}: {seen:?}"
            );
        }
    }
}

/// The bits that [`mix`] makes `y` of.
fn unmix(mut y: u64) -> u64 {
    y ^= y >> 31 ^ y >> 62;
    y = y.wrapping_mul(0x3196_42b2_d24d_8ec3);
    y ^= y >> 27 ^ y >> 54;
    y = y.wrapping_mul(0x96de_1b17_3f11_9089);
    y ^ y >> 30 ^ y >> 60
}

#[test]
fn numbers_at_the_ends_of_their_strata() {
    for y in [0, 1, u64::MAX, 1 << 63, 0x0123_4567_89ab_cdef] {
        assert_eq!(mix(unmix(y)), y);
    }
    // The draw of either child is the least or the greatest there is; so is the number of the node above.
    let draws =
        [0u64, u64::MAX].map(|y| [1, 2].map(|c: u64| unmix(y) ^ c.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    for rule in [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact] {
        for counts in [[1u32, 1], [1, u32::MAX], [7, 3], [1 << 30, 1 << 30]] {
            let total = f64::from(counts[0]) + f64::from(counts[1]);
            let root = rule.root(1, total);
            for xi in [0.0, f64::MIN_POSITIVE, root.xi, root.base.max(root.xi).next_down()] {
                let parent = Minimum { xi, ..root };
                for bits in draws.into_iter().flatten() {
                    let mut children = [parent; 2];
                    rule.split(parent, bits, &counts, &mut children);
                    assert!(children.contains(&parent), "{rule:?} {counts:?}: one child inherits");
                    for (child, count) in children.iter().zip(counts) {
                        assert!(child.xi >= parent.xi && child.xi <= 1.0, "{rule:?} {counts:?}: {child:?}");
                        let greatest = match rule {
                            MinimumRandom::Nested => 1.0 / f64::from(count),
                            _ => 1.0,
                        };
                        assert!(child.xi <= greatest, "{rule:?} {counts:?}: {child:?} of {parent:?}");
                    }
                }
            }
        }
    }
    // What is certain is accepted, though its number may have been rounded up to 1.
    let (bvh, lobe) = (tree(&surface_points(65)), [Lobe::sphere(1.0)]);
    for rule in [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact] {
        for key in 0..200 {
            let q = Query { rule, ..Query::new(DVec3::ZERO, &lobe, 3.0, mix(key)) };
            assert_eq!(accepted(&bvh, &q).len(), 65);
        }
    }
}
