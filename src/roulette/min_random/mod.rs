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
//! it. [`Pregenerated`] numbers, the same for all queries, are there to show what that spares.

mod carried;
mod nested;
mod pregenerated;

pub(super) use carried::{Exact, SemiStratified};
pub(super) use nested::Nested;
pub use pregenerated::Pregenerated;

use crate::sampler::counter::mix;
use crate::settings::MinimumRule;
use crate::vertex_bvh::{NodeId, WIDTH};
use fearless_simd::{Simd, f32x8, prelude::*, u32x8};

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

impl MinimumRandom {
    /// The rule that a setting names; `None` for [`Pregenerated`] numbers.
    pub fn of(rule: MinimumRule) -> Option<Self> {
        match rule {
            MinimumRule::Nested => Some(Self::Nested),
            MinimumRule::SemiStratified => Some(Self::SemiStratified),
            MinimumRule::Exact => Some(Self::Exact),
            MinimumRule::Pregenerated => None,
        }
    }

    /// The root's number; `leaves` at least 1.
    pub fn root(self, key: u64, leaves: f64) -> Minimum {
        let u = fine_unit(mix(key ^ ROOT));
        match self {
            Self::Nested | Self::SemiStratified => Minimum { xi: u / leaves, base: 1.0 / leaves },
            Self::Exact => Minimum { xi: exact_minimum((-u).ln_1p(), leaves), base: 0.0 },
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
            // Draws of 53 bits or fewer, as here, subtract exactly.
            Self::Exact => {
                let least = exact_minimum((1.0 - u).ln(), count);
                Minimum { xi: parent.xi + (1.0 - parent.xi) * least, base: 0.0 }
            }
        }
    }
}

/// Minimum of `count` uniforms from one u in [0,1], `1 - (1 - u)^(1/count)` without its cancellations; `ln` is
/// ln(1 - u), through `ln_1p` where u has digits far below 1.
#[inline(always)]
fn exact_minimum(ln: f64, count: f64) -> f64 {
    -(ln / count).exp_m1()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vertex_bvh::VertexBvh;

    #[test]
    fn exact_minimum_has_no_cancellation() {
        // u / n to first order; the naive 1 - (1 - u)^(1/n) has nothing but zeros here.
        let n = 2f64.powi(50);
        for u in [2f64.powi(-20), 1e-16, 1e-25, 2f64.powi(-128)] {
            assert!((exact_minimum((-u).ln_1p(), n) * n / u - 1.0).abs() < 1e-6, "{u:e}");
        }
        assert_eq!(exact_minimum(0.0, n), 0.0);
        assert_eq!(MinimumRandom::Exact.sibling(Minimum { xi: 0.0, base: 0.0 }, 0.5, 8.0, 1.0).xi, 0.5);
        // Of all keys, the one with the least draw: below 2^-64, where 1 - u is 1.
        let key = ROOT;
        assert_eq!(mix(key ^ ROOT), 0);
        let least = MinimumRandom::Exact.root(key, 2f64.powi(20)).xi;
        assert!(least > 0.0 && least < 2f64.powi(-80), "{least:e}");
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

    /// As [`leaves`], but only the leaves whose number is below a threshold, found as the walk finds them: their
    /// numbers over the threshold, and their places.
    fn tail<D: Deal>(deal: D, node: NodeId, number: D::Number, below: f64, out: &mut Vec<(f64, usize)>) {
        let (mut children, mut least) = ([number; WIDTH], [0.0; WIDTH]);
        fearless_simd::dispatch!(fearless_simd::Level::new(), simd => {
            let eight = deal.eight(simd, number, node);
            D::push(simd, &mut children, &eight, 0xff);
            D::bounds(simd, &eight).store_slice(&mut least);
            if node.level == 0 {
                let place = |lane| node.index as usize * WIDTH + lane;
                let leaf = |lane| (deal.leaf(&eight, node, lane) / below, place(lane));
                out.extend((0..WIDTH).map(leaf).filter(|leaf| leaf.0 < 1.0));
            }
        });
        for lane in (0..WIDTH).filter(|&lane| node.level > 0 && f64::from(least[lane]) <= below * 1.000_001) {
            tail(deal, node.child(lane as u32), children[lane], below, out);
        }
    }

    #[test]
    fn tails_are_uniform_down_to_1e_minus_11() {
        fn check<D: Deal>(deal: impl Fn(u64) -> D) {
            for (level, below, keys) in
                [(2, 1e-3, 8000), (4, 1e-5, 12_000), (6, 1e-7, 20_000), (9, 1e-11, 300_000)]
            {
                let (root, capacity) = (NodeId { level, index: 0 }, VertexBvh::capacity(level));
                let mut out = Vec::new();
                for key in 0..keys {
                    let deal = deal(mix(key ^ 0x7a11));
                    let number = deal.root(capacity);
                    tail(deal, root, number, below, &mut out);
                }
                // As many as there should be, in all places alike, uniform below the threshold.
                let (n, mean) = (out.len() as f64, capacity * below * keys as f64);
                assert!(
                    (n - mean).abs() < 4.5 * mean.sqrt() && n > 2000.0,
                    "below {below:e}: {n} for {mean}"
                );
                for digit in 0..=level {
                    let mut lanes = [0.0; WIDTH];
                    out.iter().for_each(|leaf| lanes[leaf.1 >> (3 * digit) & 7] += 1.0);
                    let chi2: f64 = lanes.iter().map(|l| (l - n / 8.0).powi(2) / (n / 8.0)).sum();
                    assert!(chi2 < 36.0, "below {below:e}, level {digit}: chi^2 {chi2} of 7"); // p = 7e-6
                }
                out.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                let gap = |(i, x): (usize, &(f64, usize))| (x.0 - (i as f64 + 0.5) / n).abs();
                let d = out.iter().enumerate().map(gap).fold(0.0, f64::max) * n.sqrt();
                assert!(d < 2.3, "below {below:e}: sqrt(n) D = {d}"); // p = 5e-5
            }
        }
        check(|key| Nested { key });
        check(|key| SemiStratified { key });
        check(|key| Exact { key });
    }

    #[test]
    #[ignore = "ten seconds: 1e8 numbers for each rule"]
    fn the_perfect_tree_deals_uniform_leaves_over_1e8_draws() {
        const BINS: usize = 1 << 16;
        fn check<D: Deal>(name: &str, deal: impl Fn(u64) -> D) {
            let (node, mut out, mut bins) = (NodeId { level: 3, index: 0 }, Vec::new(), vec![0u64; BINS]);
            let trees = 100_000_000 / 4096 + 1;
            for key in 0..trees {
                let deal = deal(mix(key ^ 0x1e8));
                out.clear();
                leaves(deal, node, deal.root(4096.0), &mut out);
                out.iter().for_each(|x| bins[((x * BINS as f64) as usize).min(BINS - 1)] += 1);
            }
            let (n, mut below, mut gap) = ((trees * 4096) as f64, 0.0, 0.0f64);
            for (bin, &count) in bins.iter().enumerate() {
                below += count as f64;
                gap = gap.max((below / n - (bin + 1) as f64 / BINS as f64).abs());
            }
            println!("{name}: sqrt(n) D = {:.3} over {n:.0}", gap * n.sqrt());
            assert!(gap * n.sqrt() < 2.3);
        }
        check("nested", |key| Nested { key });
        check("semi-stratified", |key| SemiStratified { key });
        check("exact", |key| Exact { key });
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
