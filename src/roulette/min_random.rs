//! Minimum random numbers, dealt top-down [HRR19; docs/theory.md section 2].
//!
//! Every leaf of a tree is to receive a number uniform in [0,1), and every node must know a lower bound of the
//! numbers below it *before* they exist, so that whole subtrees can be refused. Each rule deals a node of `n` leaves
//! a number uniform in [0,1/n) (or distributed as the minimum of n uniforms), hands it on to one child, chosen in
//! proportion to leaf counts, and deals the other children numbers from further up. All three give leaves that are
//! exactly uniform; the covariance of the numbers of two leaves is zero for [`MinimumRandom::Exact`] and never
//! positive for the others, so sums of non-negative terms have at most the variance of independent roulettes.
//!
//! A number is a pure function of (query key, node): neither the order of traversal nor what else was culled moves
//! it.

use crate::sampler::counter::{mix, unit};
use crate::vertex_bvh::{NodeId, VertexBvh, WIDTH};
use fearless_simd::{Simd, f32x8, i32x8, mask32x8, prelude::*, u32x8};

/// How siblings get their numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MinimumRandom {
    /// A node's number is uniform in its stratum [0,1/n); children of equal size get one stratum each.
    #[default]
    Nested,
    /// The paper's rule: siblings share out the range above the parent's stratum \[HRR19\].
    SemiStratified,
    /// The true minimum of independent uniforms: independent leaves, for comparison.
    Exact,
}

/// A node's number, in the rules that need more than [`MinimumRandom::Nested`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// Not above any leaf's number; for a leaf the number itself, in `[0,1]`.
    pub xi: f64,
    /// Upper end of the stratum that `xi` was drawn from ([`MinimumRandom::SemiStratified`] only).
    pub base: f64,
}

/// The key of a node's draw.
#[inline(always)]
pub fn node_bits(key: u64, node: NodeId) -> u64 {
    mix(key ^ u64::from(node.pack()).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Eight 32-bit draws out of one of 64 bits.
#[inline(always)]
pub fn lane_bits(bits: u64) -> [u32; WIDTH] {
    let (lo, hi) = (bits as u32, (bits >> 32) as u32);
    LANES.map(|lane| {
        let mut x = lo.wrapping_add(lane);
        x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d) ^ hi;
        x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
        x ^ (x >> 16)
    })
}

/// [`lane_bits`] in a register.
#[inline(always)]
fn lane_bits_simd<S: Simd>(simd: S, lo: u32, hi: u32) -> u32x8<S> {
    let mut x = u32x8::load_array_ref(simd, &LANES) + lo;
    x = ((x ^ (x >> 16)) * 0x7feb_352d) ^ hi;
    x = (x ^ (x >> 15)) * 0x846c_a68b;
    x ^ (x >> 16)
}

/// Offsets that tell the lanes apart: multiples of 2^32 over the golden ratio.
const LANES: [u32; WIDTH] = {
    let mut lanes = [0; WIDTH];
    let mut i = 0;
    while i < WIDTH {
        lanes[i] = (i as u32 + 1).wrapping_mul(0x9e37_79b9);
        i += 1;
    }
    lanes
};

/// What makes the root's draw another than every node's.
const ROOT: u64 = 0xd6e8_feb8_6659_fd93;

/// Uniform in (0,1] with full relative precision down to 2^-128: a number below 1e-16 is as likely as it should be.
fn fine_unit(bits: u64) -> f64 {
    const STEP: f64 = 1.0 / (1u128 << 64) as f64;
    (bits as f64 + (mix(bits ^ 0x5851_f42d_4c95_7f2d) as f64 + 0.5) * STEP) * STEP
}

/// One of the 56 maps x -> a x + b, a != 0, of the field of eight elements: lane i's stratum in bits 4 i ...
///
/// Two lanes see every ordered pair of distinct strata equally often, which is all that a covariance can notice of
/// a permutation.
#[inline(always)]
fn strata_map(bits: u32) -> u32 {
    STRATA[((u64::from(bits) * STRATA.len() as u64) >> 32) as usize]
}

/// The maps of [`strata_map`].
static STRATA: [u32; 56] = affine_maps();

const fn affine_maps() -> [u32; 56] {
    let mut maps = [0; 56];
    let mut i = 0;
    while i < maps.len() {
        let (a, b) = (i as u32 / 8 + 1, i as u32 % 8);
        let mut lane = 0;
        while lane < 8 {
            maps[i] |= (times(a, lane) ^ b) << (4 * lane);
            lane += 1;
        }
        i += 1;
    }
    maps
}

/// Product in GF(8) = GF(2)[x] / (x^3 + x + 1).
const fn times(a: u32, b: u32) -> u32 {
    let mut p = (a * (b & 1)) ^ ((a << 1) * (b >> 1 & 1)) ^ ((a << 2) * (b >> 2));
    if p & 16 != 0 {
        p ^= 0b10110;
    }
    if p & 8 != 0 {
        p ^= 0b1011;
    }
    p
}

impl MinimumRandom {
    /// The root's number; `leaves` at least 1.
    pub fn root(self, key: u64, leaves: f64) -> Minimum {
        let u = fine_unit(mix(key ^ ROOT));
        match self {
            Self::Nested | Self::SemiStratified => Minimum { xi: u / leaves, base: 1.0 / leaves },
            Self::Exact => Minimum { xi: exact_minimum(u, leaves), base: 0.0 },
        }
    }

    /// The numbers of any children: `counts` are their leaves (at least 1 each), `bits` the node's draw. Child 0 of
    /// two is chosen when `(low 32 bits * (n_0 + n_1)) >> 32 < n_0`, and so on for more.
    pub fn split(self, parent: Minimum, bits: u64, counts: &[u32], out: &mut [Minimum]) {
        let total: u64 = counts.iter().map(|&n| u64::from(n)).sum();
        let mut ticket = ((u128::from(bits) * u128::from(total)) >> 64) as u64;
        let mut chosen = false;
        for (child, (&count, out)) in counts.iter().zip(out).enumerate() {
            if !chosen && ticket < u64::from(count) {
                chosen = true;
                *out = parent;
                continue;
            }
            ticket = ticket.wrapping_sub(u64::from(count));
            let u = (mix(bits ^ (child as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 11) as f64;
            *out = self.sibling(parent, u * (1.0 / (1u64 << 53) as f64), total as f64, f64::from(count));
        }
    }

    /// The number of a child of `count` leaves that was not chosen below a node of `total`; `u` in [0,1).
    #[inline(always)]
    fn sibling(self, parent: Minimum, u: f64, total: f64, count: f64) -> Minimum {
        match self {
            // Uniform in [1/total, 1/count): with the chosen child's [0,1/total) that makes [0,1/count).
            Self::Nested => {
                let below = 1.0 / total;
                Minimum { xi: below + u * (1.0 / count - below), base: 0.0 }
            }
            // The range above the parent's stratum, cut into `count` parts; the first holds the minimum.
            Self::SemiStratified => {
                let part = (1.0 - parent.base) / count;
                Minimum { xi: parent.base + u * part, base: parent.base + part }
            }
            Self::Exact => {
                Minimum { xi: parent.xi + (1.0 - parent.xi) * exact_minimum(1.0 - u, count), base: 0.0 }
            }
        }
    }
}

/// Minimum of `count` uniforms from one `v` in (0,1], `1 - v^(1/count)` without its cancellation.
#[inline(always)]
fn exact_minimum(v: f64, count: f64) -> f64 {
    -(v.ln() / count).exp_m1()
}

/// How the walk deals numbers to eight children of equal size.
pub(super) trait Deal: Copy {
    /// A node's number as it waits on the stack.
    type Number: Copy;
    /// Eight of them, and what the leaves need.
    type Eight<S: Simd>;

    /// The root's number.
    fn root(self, capacity: f64) -> Self::Number;
    /// The numbers of a node's children.
    fn eight<S: Simd>(self, simd: S, parent: Self::Number, node: NodeId) -> Self::Eight<S>;
    /// Lower bounds of the numbers, for culling.
    fn bounds<S: Simd>(simd: S, eight: &Self::Eight<S>) -> f32x8<S>;
    /// Writes the numbers of the live lanes, packed to the front of eight places.
    fn push<S: Simd>(simd: S, out: &mut [Self::Number], eight: &Self::Eight<S>, live: u32);
    /// The number of a vertex, in [0,1].
    fn leaf<S: Simd>(self, eight: &Self::Eight<S>, node: NodeId, lane: usize) -> f64;
}

/// [`MinimumRandom::Nested`]. Children of equal size take the eight strata of their parent in random order; the
/// child in the lowest inherits the number, which lies there.
///
/// Numbers travel in f32 without rounding: those between 8^-j/8 and 8^-j are multiples of 2^-24 8^-j, and dealing
/// scales by powers of eight. A leaf adds a uniform offset within that cell, so that it is uniform in all its bits.
#[derive(Clone, Copy)]
pub(super) struct Nested {
    pub key: u64,
}

/// The cell of the grid that a number in (0,1) lies on, from the power of eight above it.
#[inline(always)]
fn cell(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent.div_euclid(3) * 3 - 21) as u64) << 52)
}

impl Deal for Nested {
    type Number = f32;
    type Eight<S: Simd> = f32x8<S>;

    fn root(self, capacity: f64) -> f32 {
        let u = fine_unit(mix(self.key ^ ROOT)).min(1f64.next_down());
        let cell = cell((u.to_bits() >> 52) as i32 - 1023);
        ((u / cell).floor() * cell / capacity) as f32
    }

    #[inline(always)]
    fn eight<S: Simd>(self, simd: S, parent: f32, node: NodeId) -> f32x8<S> {
        let bits = node_bits(self.key, node);
        let (lo, hi) = (bits as u32, (bits >> 32) as u32);
        let shifts = u32x8::load_array_ref(simd, &[0, 4, 8, 12, 16, 20, 24, 28]);
        let stratum = (u32x8::splat(simd, strata_map(hi)) >> shifts) & 7;
        let draws = lane_bits_simd(simd, lo, hi);
        let number: f32x8<S> = ((stratum << 21) | (draws >> 11)).bitcast::<i32x8<S>>().to_float();
        let scale = (1.0 / (1u64 << 21) as f64 / VertexBvh::capacity(node.level)) as f32;
        stratum.simd_eq(0).select(f32x8::splat(simd, parent), number * scale)
    }

    #[inline(always)]
    fn bounds<S: Simd>(_: S, eight: &f32x8<S>) -> f32x8<S> {
        *eight
    }

    #[inline(always)]
    fn push<S: Simd>(simd: S, out: &mut [f32], eight: &f32x8<S>, live: u32) {
        eight.compress(mask32x8::from_bitmask(simd, live.into())).store_slice(out);
    }

    #[inline(always)]
    fn leaf<S: Simd>(self, eight: &f32x8<S>, node: NodeId, lane: usize) -> f64 {
        let number = eight.as_array()[lane];
        let rest = mix(node_bits(self.key, node) ^ (lane as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        f64::from(number) + unit(rest) * cell((number.to_bits() >> 23) as i32 - 127)
    }
}

/// A rule that carries [`Minimum`]s, dealt one by one.
macro_rules! carried {
    ($name:ident) => {
        /// The rule of the same name in [`MinimumRandom`].
        #[derive(Clone, Copy)]
        pub(super) struct $name {
            pub key: u64,
        }

        impl Deal for $name {
            type Number = Minimum;
            type Eight<S: Simd> = [Minimum; WIDTH];

            fn root(self, capacity: f64) -> Minimum {
                MinimumRandom::$name.root(self.key, capacity)
            }

            #[inline(always)]
            fn eight<S: Simd>(self, _: S, parent: Minimum, node: NodeId) -> [Minimum; WIDTH] {
                let bits = node_bits(self.key, node);
                let chosen = (bits >> 61) as usize;
                let draws = lane_bits(bits);
                let capacity = VertexBvh::capacity(node.level);
                let mut eight = draws.map(|draw| {
                    let u = (f64::from(draw) + 0.5) * (1.0 / (1u64 << 32) as f64);
                    MinimumRandom::$name.sibling(parent, u, capacity, capacity * 0.125)
                });
                eight[chosen] = parent;
                eight
            }

            #[inline(always)]
            fn bounds<S: Simd>(simd: S, eight: &[Minimum; WIDTH]) -> f32x8<S> {
                f32x8::load_array(simd, eight.map(|m| m.xi as f32))
            }

            #[inline(always)]
            fn push<S: Simd>(_: S, out: &mut [Minimum], eight: &[Minimum; WIDTH], mut live: u32) {
                for out in out {
                    if live == 0 {
                        break;
                    }
                    *out = eight[live.trailing_zeros() as usize];
                    live &= live - 1;
                }
            }

            #[inline(always)]
            fn leaf<S: Simd>(self, eight: &[Minimum; WIDTH], _: NodeId, lane: usize) -> f64 {
                eight[lane].xi
            }
        }
    };
}

carried!(SemiStratified);
carried!(Exact);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_are_permutations_and_pairs_are_uniform() {
        let mut pairs = [[0; 64]; 64];
        for map in STRATA {
            let at = |lane: usize| (map >> (4 * lane) & 7) as usize;
            for i in 0..WIDTH {
                for j in (0..WIDTH).filter(|&j| j != i) {
                    assert_ne!(at(i), at(j));
                    pairs[i * 8 + j][at(i) * 8 + at(j)] += 1;
                }
            }
        }
        for lanes in (0..64).filter(|l| l / 8 != l % 8) {
            assert!((0..64).all(|s| pairs[lanes][s] == u32::from(s / 8 != s % 8)));
        }
    }

    #[test]
    fn exact_minimum_has_no_cancellation() {
        // u / n to first order; the naive 1 - (1 - u)^(1/n) has nothing but zeros here.
        let n = 2f64.powi(50);
        let v = 1.0 - 2f64.powi(-20);
        assert!((exact_minimum(v, n) * n * 2f64.powi(20) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn root_numbers_reach_far_below_machine_epsilon() {
        assert!(fine_unit(0) > 0.0 && fine_unit(0) < 1e-19);
        assert!(fine_unit(u64::MAX) <= 1.0);
    }

    /// The numbers of all leaves below a node of the perfect tree, in order, as the walk deals them.
    fn leaves<D: Deal>(deal: D, node: NodeId, number: D::Number, out: &mut Vec<f64>) {
        let mut children = [number; WIDTH];
        let (first, mut least) = (out.len(), [0.0; WIDTH]);
        fearless_simd::dispatch!(fearless_simd::Level::new(), simd => {
            let eight = deal.eight(simd, number, node);
            D::push(simd, &mut children, &eight, 0xff);
            D::bounds(simd, &eight).store_slice(&mut least);
            if node.level == 0 {
                out.extend((0..WIDTH).map(|lane| deal.leaf(&eight, node, lane)));
            }
        });
        if node.level > 0 {
            for lane in 0..WIDTH {
                let before = out.len();
                leaves(deal, node.child(lane as u32), children[lane], out);
                let bound = f64::from(least[lane]) * (1.0 - 1e-7);
                assert!(out[before..].iter().all(|&x| x >= bound), "a node's number is below its leaves'");
            }
        } else {
            assert!((first..out.len()).all(|i| out[i] >= f64::from(least[i - first]) * (1.0 - 1e-7)));
        }
    }

    #[test]
    fn the_perfect_tree_deals_uniform_leaves() {
        fn check<D: Deal>(deal: impl Fn(u64) -> D) {
            let node = NodeId { level: 1, index: 0 };
            let (mut all, mut out) = (vec![Vec::new(); 64], Vec::new());
            let mut pairs = [0.0; 3];
            let n = 20_000;
            for key in 0..n {
                let deal = deal(mix(key));
                out.clear();
                leaves(deal, node, deal.root(64.0), &mut out);
                for (all, &x) in all.iter_mut().zip(&out) {
                    all.push(x);
                }
                // Sisters, cousins, and a far threshold: below 1/2 together, below 1/10 together.
                pairs[0] += (out[0] - 0.5) * (out[1] - 0.5);
                pairs[1] += (out[0] - 0.5) * (out[9] - 0.5);
                pairs[2] += f64::from(out[0] < 0.1 && out[63] < 0.1) - 0.01;
            }
            for x in &mut all {
                x.sort_unstable_by(f64::total_cmp);
                let n = x.len() as f64;
                let d =
                    x.iter().enumerate().map(|(i, x)| (x - (i as f64 + 0.5) / n).abs()).fold(0.0, f64::max);
                assert!(d * n.sqrt() < 2.5, "sqrt(n) D = {}", d * n.sqrt());
            }
            // No positive covariance: 4.5 standard errors of independent numbers at most.
            let n = n as f64;
            assert!(pairs[0] / n < 4.5 / 12.0 / n.sqrt() && pairs[1] / n < 4.5 / 12.0 / n.sqrt());
            assert!(pairs[2] / n < 4.5 * 0.1 / n.sqrt());
        }
        check(|key| Nested { key });
        check(|key| SemiStratified { key });
        check(|key| Exact { key });
    }

    #[test]
    fn nested_numbers_lie_on_their_grid_to_the_ends_of_the_strata() {
        // The greatest number a lane can be dealt stays below 1 in f32, and its cell ends at 1.
        let greatest = ((7 << 21) | ((1 << 21) - 1)) as f32 * (1.0 / (1u64 << 24) as f32);
        assert!(greatest < 1.0 && f64::from(greatest) + cell(-1) == 1.0);
        for (number, exponent) in [(0.125f32, -3), (0.99, -1), (1.0 / 64.0, -6), (0.1, -4)] {
            assert_eq!((number.to_bits() >> 23) as i32 - 127, exponent);
            let below = 8f64.powi(-(-exponent - 1) / 3);
            assert_eq!(cell(exponent), below * 2f64.powi(-24), "{number}");
        }
        for key in 0..1000 {
            let x = f64::from(Nested { key }.root(1.0));
            assert_eq!((x / cell((x.to_bits() >> 52) as i32 - 1023)).fract(), 0.0);
        }
    }

    #[test]
    fn dealing_is_the_same_with_and_without_vector_instructions() {
        for bits in [0, u64::MAX, 0x0123_4567_89ab_cdef] {
            let mut lanes = [0; WIDTH];
            fearless_simd::dispatch!(fearless_simd::Level::new(), simd => {
                lane_bits_simd(simd, bits as u32, (bits >> 32) as u32).store_slice(&mut lanes);
            });
            assert_eq!(lanes, lane_bits(bits));
        }
    }
}
