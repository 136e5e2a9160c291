//! The walk of `hrr::roulette::query` down a [`Tree`] of any width: registers of eight lanes throughout, of which a node
//! of 16 takes two, and which two nodes of 4 share.

use super::tree::{Block, Boxes, Tree};
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x8, i32x8, mask32x8, prelude::*, u32x4, u32x8};
use hrr::roulette::min_random::node_bits;
use hrr::roulette::{Box8, FlatLobe, MinimumRandom, PAD, Query, QueryCounters, Vec8, probability};
use hrr::sampler::counter::{mix, unit};
use hrr::vertex_bvh::NodeId;

const LANES: usize = 8;
const SLACK: f32 = 1.00001;
const MAX_LEVELS: usize = 16;
/// As in the library: nodes of one level that are taken up together. Of nodes of 4 twice as many, for as many registers.
const fn taken(width: usize) -> usize {
    if width < LANES { 16 } else { 8 }
}
const MOST: usize = 16;

/// Nodes that wait to be looked into, and their numbers.
pub struct Waiting {
    nodes: Vec<u32>,
    numbers: Vec<f32>,
}

impl Waiting {
    pub fn new() -> Self {
        let room = MAX_LEVELS * MOST * MOST + 2 * LANES;
        Self { nodes: vec![0; room], numbers: vec![0.0; room] }
    }
}

/// `N` things side by side: children or vertices.
struct Lanes<const N: usize>;

impl<const N: usize> Lanes<N> {
    /// Registers that they take.
    const REGISTERS: usize = N.div_ceil(LANES);
    /// Nodes that share a register.
    const TOGETHER: usize = LANES.div_ceil(N);
    const BITS: u32 = N.ilog2();
    /// What tells the lanes' draws apart.
    const OFFSETS: &'static [u32; N] = &{
        let (mut offsets, mut i) = ([0; N], 0);
        while i < N {
            offsets[i] = (i as u32 + 1).wrapping_mul(0x9e37_79b9);
            i += 1;
        }
        offsets
    };
    /// Products in the field of N elements: x -> a x + b deals strata, pairwise uniform.
    const PRODUCTS: &'static [[u32; N]; N] = &{
        let (mut products, mut a) = ([[0; N]; N], 0);
        while a < N {
            let mut x = 0;
            while x < N {
                products[a][x] = times::<N>(a as u32, x as u32);
                x += 1;
            }
            a += 1;
        }
        products
    };
}

/// Product in GF(N).
const fn times<const N: usize>(a: u32, b: u32) -> u32 {
    let polynomial = match N {
        4 => 0b111,
        8 => 0b1011,
        16 => 0b1_0011,
        _ => 0b10_0101,
    };
    let bits = N.ilog2();
    let (mut product, mut i) = (0, 0);
    while i < bits {
        product ^= (a << i) * (b >> i & 1);
        i += 1;
    }
    let mut i = 2 * bits - 1;
    while i >= bits {
        if product >> i & 1 != 0 {
            product ^= polynomial << (i - bits);
        }
        i -= 1;
    }
    product
}

/// Lanes 8 r.. of the first array; of arrays of four, all of both.
#[inline(always)]
fn floats<S: Simd, const N: usize>(simd: S, [a, b]: [&[f32; N]; 2], r: usize) -> f32x8<S> {
    if N < LANES {
        simd.combine_f32x4(f32x4::from_slice(simd, a), f32x4::from_slice(simd, b))
    } else {
        f32x8::from_slice(simd, &a[r * LANES..(r + 1) * LANES])
    }
}

/// [`floats`] of integers.
#[inline(always)]
fn integers<S: Simd, const N: usize>(simd: S, [a, b]: [&[u32; N]; 2], r: usize) -> u32x8<S> {
    if N < LANES {
        simd.combine_u32x4(u32x4::from_slice(simd, a), u32x4::from_slice(simd, b))
    } else {
        u32x8::from_slice(simd, &a[r * LANES..(r + 1) * LANES])
    }
}

/// One number for all lanes; for nodes of four, one for each of two.
#[inline(always)]
fn splat<S: Simd, const N: usize>(simd: S, [a, b]: [u32; 2]) -> u32x8<S> {
    if N < LANES {
        simd.combine_u32x4(u32x4::splat(simd, a), u32x4::splat(simd, b))
    } else {
        u32x8::splat(simd, a)
    }
}

#[inline(always)]
fn vectors<S: Simd, const N: usize>(simd: S, [a, b]: [&[[f32; N]; 3]; 2], r: usize) -> Vec8<S> {
    Vec8 {
        x: floats(simd, [&a[0], &b[0]], r),
        y: floats(simd, [&a[1], &b[1]], r),
        z: floats(simd, [&a[2], &b[2]], r),
    }
}

/// The numbers of a register's lanes (`MinimumRandom::Nested`): of node `i`, `bits[i]` and the number `parent[i]`.
#[inline(always)]
fn deal<S: Simd, const N: usize>(
    simd: S,
    bits: [u64; 2],
    parent: [f32; 2],
    capacity: u64,
    r: usize,
) -> f32x8<S> {
    let (lo, hi) = (bits.map(|b| b as u32), bits.map(|b| (b >> 32) as u32));
    let map = hi.map(|hi| ((u64::from(hi) * (N * (N - 1)) as u64) >> 32) as usize);
    let products = map.map(|map| &Lanes::<N>::PRODUCTS[map / N + 1]);
    let stratum = integers(simd, products, r) ^ splat::<S, N>(simd, map.map(|map| (map % N) as u32));
    let offsets = Lanes::<N>::OFFSETS;
    let mut x = integers(simd, [offsets, offsets], r) + splat::<S, N>(simd, lo);
    x = ((x ^ (x >> 16)) * 0x7feb_352d) ^ splat::<S, N>(simd, hi);
    x = (x ^ (x >> 15)) * 0x846c_a68b;
    x = x ^ (x >> 16);
    let below = 24 - Lanes::<N>::BITS;
    let number: f32x8<S> = ((stratum << below) | (x >> (32 - below))).bitcast::<i32x8<S>>().to_float();
    let scale = (1.0 / (1u64 << below) as f64 / capacity as f64) as f32;
    let parent = splat::<S, N>(simd, parent.map(f32::to_bits)).bitcast::<f32x8<S>>();
    stratum.simd_eq(0).select(parent, number * scale)
}

struct Walk<'a, const W: usize, const B: usize> {
    tree: &'a Tree<W, B>,
    query: &'a Query<'a>,
    high: [f32; 3],
    low: [f32; 3],
    lobe: FlatLobe,
    cull: bool,
    stats: &'a mut QueryCounters,
    visit: &'a mut dyn FnMut(u32, f64),
}

impl<const W: usize, const B: usize> Tree<W, B> {
    /// As `hrr::roulette::query`, for one lobe and no masks; without `cull` every vertex is tested.
    pub fn query(
        &self,
        waiting: &mut Waiting,
        query: &Query<'_>,
        cull: bool,
        stats: &mut QueryCounters,
        visit: &mut dyn FnMut(u32, f64),
    ) {
        stats.queries += 1;
        let [lobe] = query.lobes else { panic!("one lobe") };
        let Some(lobe) = FlatLobe::new(lobe, query.constant) else { return };
        let high = query.position.as_vec3();
        let low = (query.position - high.as_dvec3()).as_vec3().to_array();
        let mut walk = Walk { tree: self, query, high: high.to_array(), low, lobe, cull, stats, visit };
        dispatch!(Level::new(), simd => walk.run(simd, waiting));
    }
}

/// The grid that a number lies on: numbers of a subtree of n leaves, below 1/n, are multiples of 2^-24/n.
#[inline(always)]
fn cell<const W: usize, const B: usize>(exponent: i32) -> f64 {
    let below = (-1 - exponent) as u32;
    let leaves = match below.checked_sub(B.ilog2()) {
        None => 0,
        Some(rest) => B.ilog2() + rest / W.ilog2() * W.ilog2(),
    };
    f64::from_bits(u64::from(1023 - 24 - leaves) << 52)
}

impl<const W: usize, const B: usize> Walk<'_, W, B> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, waiting: &mut Waiting) {
        let Waiting { nodes, numbers } = waiting;
        let root = self.tree.root();
        let u = MinimumRandom::Nested.root(self.query.key, 1.0).xi.min(1f64.next_down());
        let grid = cell::<W, B>((u.to_bits() >> 52) as i32 - 1023);
        nodes[0] = 0;
        numbers[0] = ((u / grid).floor() * grid / Tree::<W, B>::capacity(root) as f64) as f32;
        let mut first = [0; MAX_LEVELS];
        let (mut level, mut top) = (root, 1);
        loop {
            let most = if level == 0 { taken(B) } else { taken(W) };
            let count = (top - first[level]).min(most);
            if count == 0 {
                if level == root {
                    return;
                }
                level += 1;
                continue;
            }
            top -= count;
            let mut chunk = [(0, 0.0); MOST];
            for i in 0..count {
                chunk[i] = (nodes[top + i], numbers[top + i]);
                std::hint::black_box(self.tree.touch(level, nodes[top + i]));
            }
            if level == 0 {
                for group in chunk[..count].rchunks(Lanes::<B>::TOGETHER).rev() {
                    self.blocks(simd, group);
                }
                continue;
            }
            first[level - 1] = top;
            for group in chunk[..count].chunks(Lanes::<W>::TOGETHER) {
                let [(a, _), (b, _)] = pair(group);
                let bits = self.bits(level, [a, b]);
                let boxes: [&Boxes<W>; 2] = [self.tree.boxes(level, a), self.tree.boxes(level, b)];
                for r in 0..Lanes::<W>::REGISTERS {
                    let parent = pair(group).map(|(_, number)| number);
                    let dealt = deal::<S, W>(simd, bits, parent, Tree::<W, B>::capacity(level), r);
                    let mut live = self.exist::<W>(level, group, r);
                    if self.cull {
                        let center = vectors(simd, boxes.map(|b| &b.center), r);
                        let half = vectors(simd, boxes.map(|b| &b.half), r);
                        let boxes = Box8::new(center.relative(self.high, self.low), half, PAD);
                        live &= self.touched::<S, false>(dealt, boxes);
                    }
                    let lanes = u32x8::load_array_ref(simd, if W < LANES { &FOURS } else { &EIGHT });
                    let children = lanes + (splat::<S, W>(simd, [a, b]) * W as u32 + (r * LANES) as u32);
                    let mask = mask32x8::from_bitmask(simd, live.into());
                    children.compress(mask).store_slice(&mut nodes[top..top + LANES]);
                    dealt.compress(mask).store_slice(&mut numbers[top..top + LANES]);
                    top += live.count_ones() as usize;
                }
                self.stats.nodes += group.len() as u64;
            }
            level -= 1;
        }
    }

    #[inline(always)]
    fn bits(&self, level: usize, nodes: [u32; 2]) -> [u64; 2] {
        nodes.map(|index| node_bits(self.query.key, NodeId { level: level as u32, index }))
    }

    /// Lanes of a register that there is something in.
    #[inline(always)]
    fn exist<const N: usize>(&mut self, level: usize, group: &[(u32, f32)], r: usize) -> u32 {
        let there = |i: usize| {
            let count = self.tree.children(level, group[i].0);
            (1u32 << count.saturating_sub(r * LANES).min(LANES)) - 1
        };
        let live = if N < LANES && group.len() == 2 { there(0) | there(1) << N } else { there(0) };
        self.stats.tests += u64::from(live.count_ones());
        live
    }

    #[inline(always)]
    fn touched<S: Simd, const POINTS: bool>(&self, numbers: f32x8<S>, boxes: Box8<S>) -> u32 {
        let b = boxes.bound::<POINTS>(&self.lobe);
        (b * b * numbers).simd_gt(SLACK).to_bitmask() as u32 ^ 0xff
    }

    #[inline(always)]
    fn blocks<S: Simd>(&mut self, simd: S, group: &[(u32, f32)]) {
        let [(a, _), (b, _)] = pair(group);
        let bits = self.bits(0, [a, b]);
        let blocks: [&Block<B>; 2] = [a, b].map(|i| &self.tree.blocks[i as usize]);
        for r in 0..Lanes::<B>::REGISTERS {
            let parent = pair(group).map(|(_, number)| number);
            let dealt = deal::<S, B>(simd, bits, parent, B as u64, r);
            let mut live = self.exist::<B>(0, group, r);
            if self.cull {
                let points = vectors(simd, blocks.map(|b| &b.position), r).relative(self.high, self.low);
                live &= self.touched::<S, true>(dealt, Box8::around_points(points, PAD));
            }
            while live != 0 {
                let lane = live.trailing_zeros() as usize;
                live &= live - 1;
                let (which, place) = if B < LANES { (lane / B, lane % B) } else { (0, r * LANES + lane) };
                self.decide(blocks[which], place, bits[which], dealt.as_array()[lane]);
            }
        }
        self.stats.nodes += group.len() as u64;
    }

    #[inline(always)]
    fn decide(&mut self, block: &Block<B>, lane: usize, bits: u64, number: f32) {
        let point = glam::Vec3::from_array(block.position.map(|p| p[lane])).as_dvec3();
        let p = probability(self.query.lobes, self.query.constant, point - self.query.position);
        self.stats.leaves += 1;
        self.stats.expected += p;
        let rest = mix(bits ^ (lane as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let exponent = (number.to_bits() >> 23) as i32 - 127;
        if p >= 1.0 || f64::from(number) + unit(rest) * cell::<W, B>(exponent) < p {
            self.stats.accepted += 1;
            (self.visit)(block.index[lane], p);
        }
    }
}

static EIGHT: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7];
static FOURS: [u32; LANES] = [0, 1, 2, 3, 0, 1, 2, 3];

/// The nodes of a register: the one twice, when it has no other with it.
#[inline(always)]
fn pair(group: &[(u32, f32)]) -> [(u32, f32); 2] {
    [group[0], group[group.len() - 1]]
}
