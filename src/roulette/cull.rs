//! The walk down the tree: numbers, boxes, vertices.

use super::min_random::{Minimum, node_bits};
use super::{Query, QueryCounters, probability};
use crate::vertex_bvh::{MAX_LEVELS, NodeId, VertexBvh, WIDTH};
use glam::DVec3;

/// A depth-first walk keeps at most seven siblings waiting on each level, and the last node's children.
const STACK: usize = MAX_LEVELS * (WIDTH - 1) + 1;

/// Visits every accepted light vertex: its index into the positions given to [`VertexBvh::build`], and its
/// probability P. In tree order of nodes, the same for every machine and thread.
pub fn query(
    bvh: &VertexBvh,
    query: &Query<'_>,
    stats: &mut QueryCounters,
    visit: &mut impl FnMut(u32, f64),
) {
    walk::<true>(bvh, query, stats, visit);
}

/// As [`query()`], testing every vertex: the same numbers, the same vertices, in the same order.
pub fn query_brute_force(
    bvh: &VertexBvh,
    query: &Query<'_>,
    stats: &mut QueryCounters,
    visit: &mut impl FnMut(u32, f64),
) {
    walk::<false>(bvh, query, stats, visit);
}

fn walk<const CULL: bool>(
    bvh: &VertexBvh,
    query: &Query<'_>,
    stats: &mut QueryCounters,
    visit: &mut impl FnMut(u32, f64),
) {
    stats.queries += 1;
    let Some(root) = bvh.root() else { return };
    let start = (root, query.rule.root(query.key, VertexBvh::capacity(root.level)));
    let mut stack = [start; STACK];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let (node, number) = stack[top];
        let count = bvh.children(node);
        let numbers = query.rule.eight(number, node_bits(query.key, node), VertexBvh::capacity(node.level));
        let masks = bvh.masks(node);
        if node.level == 0 {
            let block = &bvh.blocks()[node.index as usize];
            for lane in 0..count {
                if masks.is_some_and(|m| m[lane] & query.mask == 0) {
                    continue;
                }
                let p =
                    probability(query.lobes, query.constant, block.point(lane).as_dvec3() - query.position);
                stats.leaves += 1;
                stats.expected += p;
                // A number rounded up to 1 must not refuse what is certain.
                if numbers[lane].xi < p || p >= 1.0 {
                    stats.accepted += 1;
                    visit(block.index[lane], p);
                }
            }
            continue;
        }
        let boxes = bvh.boxes(node);
        stats.nodes += 1;
        for lane in (0..count).rev() {
            if masks.is_some_and(|m| m[lane] & query.mask == 0) {
                continue;
            }
            if CULL {
                stats.tests += 1;
                let at = |v: &[[f32; WIDTH]; 3]| {
                    DVec3::new(v[0][lane].into(), v[1][lane].into(), v[2][lane].into())
                };
                if !touches(query, numbers[lane], at(&boxes.center) - query.position, at(&boxes.half)) {
                    continue;
                }
            }
            stack[top] = (child(node, lane), numbers[lane]);
            top += 1;
        }
    }
}

fn child(node: NodeId, lane: usize) -> NodeId {
    node.child(lane as u32)
}

/// False only when no vertex in the box can have a probability above the number.
fn touches(query: &Query<'_>, number: Minimum, center: DVec3, half: DVec3) -> bool {
    let mut sum = 0.0;
    for lobe in query.lobes {
        let bound = lobe.lower_bound(center, half);
        sum += lobe.weight() / (bound * bound);
    }
    // Some slack for the roundings of the bound itself. NaN (0/0: no bound, no weight) touches.
    let refused = number.xi > query.constant * sum * (1.0 + 1e-12);
    !refused && query.constant > 0.0
}
