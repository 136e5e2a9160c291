//! The walk down the tree: numbers, boxes, vertices.

use super::min_random::{Deal, Exact, Minimum, Nested, SemiStratified};
use super::plane::{Box8, FlatLobe, PAD, Vec8};
use super::precision::{NarrowLobe, narrow};
use super::{LobePrecision, MinimumRandom, Query, QueryCounters, probability};
use crate::vertex_bvh::{MAX_LEVELS, NodeId, VertexBvh, WIDTH};
use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};
use smallvec::SmallVec;
use std::cell::RefCell;

/// Lobes of a query that take part in culling; with more, every vertex is tested.
pub const MAX_LOBES: usize = 8;

/// For the roundings after the bound itself.
const SLACK: f32 = 1.00001;

/// Nodes of one level that are taken up together. They are independent work for the processor, which a chain of
/// single visits, each as long as its latencies, is not.
const CHUNK: usize = 8;

/// A chunk's children are done before its siblings, so each level has at most those waiting; stores write eight
/// entries at a time.
const STACK: usize = MAX_LEVELS * CHUNK * WIDTH + WIDTH;

/// Visits every accepted light vertex: its index into the positions given to [`VertexBvh::build`], and its
/// probability P. The set, the probabilities and their order (tree order, from the last block to the first) are the
/// same on every machine.
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
    mut cull: bool,
    stats: &mut QueryCounters,
    visit: &mut dyn FnMut(u32, f64),
) {
    stats.queries += 1;
    let Some(root) = bvh.root() else { return };
    if !(query.constant > 0.0) {
        return;
    }
    let high = query.position.as_vec3();
    let low = (query.position - high.as_dvec3()).as_vec3().to_array();
    let mut lobes = SmallVec::<[FlatLobe; MAX_LOBES]>::new();
    for lobe in query.lobes.iter().filter_map(|l| FlatLobe::new(l, query.constant)) {
        if lobes.len() == MAX_LOBES {
            cull = false;
            break;
        }
        lobes.push(lobe);
    }
    // Another tree's minima bound nothing here.
    cull &= query.pregenerated.is_none_or(|numbers| numbers.len() == bvh.len());
    let mut narrow = SmallVec::<[NarrowLobe; MAX_LOBES]>::new();
    if query.precision != LobePrecision::F64 {
        narrow.extend(query.lobes.iter().map(|lobe| NarrowLobe::new(lobe, query.constant)));
    }
    let (high, pad) = (high.to_array(), PAD * query.padding);
    let mut walk = Walk { bvh, query, high, low, lobes: &lobes, narrow: &narrow, pad, cull, stats, visit };
    if let Some(numbers) = query.pregenerated {
        return dispatch!(Level::new(), simd => walk.run(simd, root, numbers, &mut Waiting::new(())));
    }
    let (key, none) = (query.key, Minimum { xi: 0.0, base: 0.0 });
    match query.rule {
        MinimumRandom::Nested => WAITING.with(|kept| {
            let mut kept = kept.try_borrow_mut();
            let mut own;
            let waiting = match &mut kept {
                Ok(kept) => &mut **kept,
                // A query within another's visit.
                Err(_) => {
                    own = Waiting::new(0.0);
                    &mut own
                }
            };
            dispatch!(Level::new(), simd => walk.run(simd, root, Nested { key }, waiting));
        }),
        MinimumRandom::SemiStratified => {
            dispatch!(Level::new(), simd => walk.run(simd, root, SemiStratified { key }, &mut Waiting::new(none)))
        }
        MinimumRandom::Exact => {
            dispatch!(Level::new(), simd => walk.run(simd, root, Exact { key }, &mut Waiting::new(none)))
        }
    }
}

/// Nodes that wait to be looked into, and their numbers.
struct Waiting<N> {
    nodes: [u32; STACK],
    numbers: [N; STACK],
}

impl<N: Copy> Waiting<N> {
    const fn new(number: N) -> Self {
        Self { nodes: [0; STACK], numbers: [number; STACK] }
    }
}

thread_local! {
    /// Kept from query to query: to clear it takes as long as a visit.
    static WAITING: RefCell<Waiting<f32>> = const { RefCell::new(Waiting::new(0.0)) };
}

struct Walk<'a> {
    bvh: &'a VertexBvh,
    query: &'a Query<'a>,
    /// The query's position in two f32 parts.
    high: [f32; 3],
    low: [f32; 3],
    lobes: &'a [FlatLobe],
    /// For decisions in single precision.
    narrow: &'a [NarrowLobe],
    pad: f32,
    cull: bool,
    stats: &'a mut QueryCounters,
    visit: &'a mut dyn FnMut(u32, f64),
}

impl Walk<'_> {
    #[inline(always)]
    fn run<S: Simd, D: Deal>(&mut self, simd: S, root: NodeId, deal: D, waiting: &mut Waiting<D::Number>) {
        let number = deal.root(VertexBvh::capacity(root.level));
        let Waiting { nodes, numbers } = waiting;
        (nodes[0], numbers[0]) = (root.index, number);
        // Nodes of the current level wait at `first[level]..top`, those of higher levels below.
        let mut first = [0; MAX_LEVELS];
        let (mut level, mut top) = (root.level as usize, 1);
        loop {
            let count = (top - first[level]).min(CHUNK);
            if count == 0 {
                if level == root.level as usize {
                    return;
                }
                level += 1;
                continue;
            }
            top -= count;
            let mut chunk = [(0, number); CHUNK];
            let at = |index| NodeId { level: level as u32, index };
            for i in 0..count {
                chunk[i] = (nodes[top + i], numbers[top + i]);
                std::hint::black_box(self.bvh.touch(at(nodes[top + i])));
            }
            if level == 0 {
                // From the top of the stack: in falling order throughout, whatever was culled.
                for &(index, number) in chunk[..count].iter().rev() {
                    let dealt = deal.eight(simd, number, at(index));
                    let live = self.visit_block(simd, at(index), D::bounds(simd, &dealt));
                    self.decide(at(index), live, deal, &dealt);
                }
                continue;
            }
            first[level - 1] = top;
            for &(index, number) in &chunk[..count] {
                let dealt = deal.eight(simd, number, at(index));
                let live = self.visit_node(simd, at(index), D::bounds(simd, &dealt));
                push(simd, &mut nodes[top..top + WIDTH], index * WIDTH as u32, live);
                D::push(simd, &mut numbers[top..top + WIDTH], &dealt, live);
                top += live.count_ones() as usize;
            }
            level -= 1;
        }
    }

    /// The children of an inner node that the range may touch.
    #[inline(always)]
    fn visit_node<S: Simd>(&mut self, simd: S, node: NodeId, numbers: f32x8<S>) -> u32 {
        let live = self.unmasked(node);
        if !self.cull {
            return live;
        }
        let boxes = self.bvh.boxes(node);
        let center = Vec8::load(simd, &boxes.center).relative(self.high, self.low);
        live & self.touched::<S, false>(numbers, Box8::new(center, Vec8::load(simd, &boxes.half), self.pad))
    }

    /// The vertices of a block that the range may touch.
    #[inline(always)]
    fn visit_block<S: Simd>(&mut self, simd: S, node: NodeId, numbers: f32x8<S>) -> u32 {
        let live = self.unmasked(node);
        if !self.cull {
            return live;
        }
        let block = &self.bvh.blocks()[node.index as usize];
        let points = Vec8::load(simd, &block.position).relative(self.high, self.low);
        live & self.touched::<S, true>(numbers, Box8::around_points(points, self.pad))
    }

    /// The children of a node that exist and that the query's mask lets through.
    #[inline(always)]
    fn unmasked(&mut self, node: NodeId) -> u32 {
        let live = (1u32 << self.bvh.children(node)) - 1;
        let live = live & self.bvh.masks(node).map_or(!0, |masks| shared(masks, self.query.mask));
        self.stats.nodes += 1;
        self.stats.tests += u64::from(live.count_ones());
        live
    }

    /// The lanes whose boxes may hold a vertex with a probability above the numbers.
    #[inline(always)]
    fn touched<S: Simd, const POINTS: bool>(&self, numbers: f32x8<S>, boxes: Box8<S>) -> u32 {
        if let [lobe] = self.lobes {
            let b = boxes.bound::<POINTS>(lobe);
            return (b * b * numbers).simd_gt(SLACK).to_bitmask() as u32 ^ 0xff;
        }
        let mut sum = f32x8::splat(numbers.simd, 0.0);
        for lobe in self.lobes {
            let b = boxes.bound::<POINTS>(lobe);
            sum += SLACK / (b * b);
        }
        // What cannot be compared stays.
        numbers.simd_gt(sum).to_bitmask() as u32 ^ 0xff
    }

    /// The decision proper for the vertices of a block that may be near enough.
    #[inline(always)]
    fn decide<S: Simd, D: Deal>(&mut self, node: NodeId, live: u32, deal: D, dealt: &D::Eight<S>) {
        const F64: u8 = LobePrecision::F64 as u8;
        const REBASED: u8 = LobePrecision::Rebased as u8;
        const F32: u8 = LobePrecision::F32 as u8;
        match self.query.precision {
            LobePrecision::F64 => self.decide_in::<S, D, F64>(node, live, deal, dealt),
            LobePrecision::Rebased => self.decide_in::<S, D, REBASED>(node, live, deal, dealt),
            LobePrecision::F32 => self.decide_in::<S, D, F32>(node, live, deal, dealt),
        }
    }

    /// [`Walk::decide`] in one [`LobePrecision`].
    #[inline(always)]
    fn decide_in<S: Simd, D: Deal, const PRECISION: u8>(
        &mut self,
        node: NodeId,
        mut live: u32,
        deal: D,
        dealt: &D::Eight<S>,
    ) {
        let block = &self.bvh.blocks()[node.index as usize];
        while live != 0 {
            let lane = live.trailing_zeros() as usize;
            live &= live - 1;
            let point = block.point(lane);
            let p = if PRECISION == LobePrecision::F32 as u8 {
                narrow(self.narrow.iter().copied(), point - self.query.position.as_vec3())
            } else {
                let offset = point.as_dvec3() - self.query.position;
                if PRECISION == LobePrecision::Rebased as u8 {
                    narrow(self.narrow.iter().copied(), offset.as_vec3())
                } else {
                    probability(self.query.lobes, self.query.constant, offset)
                }
            };
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
