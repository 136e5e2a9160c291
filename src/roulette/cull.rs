//! The walk down the tree: numbers, boxes, vertices.

use super::min_random::{Deal, Exact, Nested, SemiStratified};
use super::plane::{Box8, FlatLobe, Vec8};
use super::{MinimumRandom, Query, QueryCounters, probability};
use crate::vertex_bvh::{MAX_LEVELS, NodeId, VertexBvh, WIDTH};
use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};

/// Lobes of a query that take part in culling; with more, every vertex is tested.
pub const MAX_LOBES: usize = 8;

/// A depth-first walk keeps at most seven siblings waiting on each level and the last node's children; stores write
/// eight entries at a time.
const STACK: usize = MAX_LEVELS * WIDTH + WIDTH;

/// Visits every accepted light vertex: its index into the positions given to [`VertexBvh::build`], and its
/// probability P. The set, the probabilities and their order are the same on every machine and thread.
pub fn query(
    bvh: &VertexBvh,
    query: &Query<'_>,
    stats: &mut QueryCounters,
    visit: &mut impl FnMut(u32, f64),
) {
    start(bvh, query, true, stats, visit);
}

/// As [`query()`], testing every vertex: the same numbers, the same vertices, in the same order.
pub fn query_brute_force(
    bvh: &VertexBvh,
    query: &Query<'_>,
    stats: &mut QueryCounters,
    visit: &mut impl FnMut(u32, f64),
) {
    start(bvh, query, false, stats, visit);
}

fn start(
    bvh: &VertexBvh,
    query: &Query<'_>,
    cull: bool,
    stats: &mut QueryCounters,
    visit: &mut dyn FnMut(u32, f64),
) {
    stats.queries += 1;
    let Some(root) = bvh.root() else { return };
    if !(query.constant > 0.0) {
        return;
    }
    let mut walk = Walk { bvh, query, lobes: [FlatLobe::NONE; MAX_LOBES], count: 0, cull, stats, visit };
    for lobe in query.lobes.iter().filter_map(|l| FlatLobe::new(l, query.constant)) {
        if walk.count == MAX_LOBES {
            walk.cull = false;
            break;
        }
        walk.lobes[walk.count] = lobe;
        walk.count += 1;
    }
    let key = query.key;
    match query.rule {
        MinimumRandom::Nested => dispatch!(Level::new(), simd => walk.run(simd, root, Nested { key })),
        MinimumRandom::SemiStratified => {
            dispatch!(Level::new(), simd => walk.run(simd, root, SemiStratified { key }))
        }
        MinimumRandom::Exact => dispatch!(Level::new(), simd => walk.run(simd, root, Exact { key })),
    }
}

struct Walk<'a> {
    bvh: &'a VertexBvh,
    query: &'a Query<'a>,
    lobes: [FlatLobe; MAX_LOBES],
    count: usize,
    cull: bool,
    stats: &'a mut QueryCounters,
    visit: &'a mut dyn FnMut(u32, f64),
}

impl Walk<'_> {
    #[inline(always)]
    fn run<S: Simd, D: Deal>(&mut self, simd: S, root: NodeId, deal: D) {
        let high = self.query.position.as_vec3();
        let low = (self.query.position - high.as_dvec3()).as_vec3();
        let (high, low) = (high.to_array(), low.to_array());
        let mut nodes = [0; STACK];
        let mut numbers = [deal.root(VertexBvh::capacity(root.level)); STACK];
        nodes[0] = root.pack();
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let node = NodeId::unpack(nodes[top]);
            let dealt = deal.eight(simd, numbers[top], node);
            let mut live = (1u32 << self.bvh.children(node)) - 1;
            if let Some(masks) = self.bvh.masks(node) {
                live &= shared(masks, self.query.mask);
            }
            self.stats.nodes += 1;
            self.stats.tests += u64::from(live.count_ones());
            if node.level == 0 {
                let points = &self.bvh.blocks()[node.index as usize];
                if self.cull {
                    let at = Box8::around_points(Vec8::relative(simd, &points.position, high, low));
                    live &= self.touched::<S, true>(D::bounds(simd, &dealt), at);
                }
                self.block(node, live, deal, &dealt);
                continue;
            }
            if self.cull {
                let boxes = self.bvh.boxes(node);
                let center = Vec8::relative(simd, &boxes.center, high, low);
                let boxes = Box8::new(simd, center, &boxes.half);
                live &= self.touched::<S, false>(D::bounds(simd, &dealt), boxes);
            }
            push(simd, &mut nodes[top..top + WIDTH], node.child(0).pack(), live);
            D::push(simd, &mut numbers[top..top + WIDTH], &dealt, live);
            top += live.count_ones() as usize;
        }
    }

    /// The lanes whose boxes may hold a vertex with a probability above the numbers.
    #[inline(always)]
    fn touched<S: Simd, const POINTS: bool>(&self, numbers: f32x8<S>, boxes: Box8<S>) -> u32 {
        /// For the roundings after the bound itself.
        const SLACK: f32 = 1.00001;
        let lobes = &self.lobes[..self.count];
        if let [lobe] = lobes {
            let b = boxes.bound::<POINTS>(lobe);
            return (b * b * numbers).simd_gt(SLACK).to_bitmask() as u32 ^ 0xff;
        }
        let mut sum = f32x8::splat(numbers.simd, 0.0);
        for lobe in lobes {
            let b = boxes.bound::<POINTS>(lobe);
            sum += SLACK / (b * b);
        }
        numbers.simd_le(sum).to_bitmask() as u32
    }

    /// The decision proper, in f64, for the vertices of a block that may be near enough.
    #[inline(always)]
    fn block<S: Simd, D: Deal>(&mut self, node: NodeId, mut live: u32, deal: D, dealt: &D::Eight<S>) {
        let block = &self.bvh.blocks()[node.index as usize];
        while live != 0 {
            let lane = live.trailing_zeros() as usize;
            live &= live - 1;
            let offset = block.point(lane).as_dvec3() - self.query.position;
            let p = probability(self.query.lobes, self.query.constant, offset);
            self.stats.leaves += 1;
            self.stats.expected += p;
            // A number rounded up to 1 must not refuse what is certain.
            if p >= 1.0 || deal.leaf(dealt, node, lane) < p {
                self.stats.accepted += 1;
                (self.visit)(block.index[lane], p);
            }
        }
    }
}

/// Lanes that share a bit with a mask.
#[inline(always)]
fn shared(masks: &[u32; WIDTH], mask: u32) -> u32 {
    masks.iter().enumerate().fold(0, |live, (lane, m)| live | u32::from(m & mask != 0) << lane)
}

/// Writes `first + lane` for the live lanes, packed to the front.
#[inline(always)]
fn push<S: Simd>(simd: S, out: &mut [u32], first: u32, live: u32) {
    let lanes = fearless_simd::u32x8::load_array_ref(simd, &[0, 1, 2, 3, 4, 5, 6, 7]) + first;
    lanes.compress(fearless_simd::mask32x8::from_bitmask(simd, live.into())).store_slice(out);
}
