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

use crate::sampler::counter::mix;
use crate::vertex_bvh::{NodeId, WIDTH};

/// How siblings get their numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MinimumRandom {
    /// A node's number is uniform in its stratum [0,1/n); children of equal size get one stratum each.
    #[default]
    Nested,
    /// The paper's rule: siblings share out the range above the parent's stratum [HRR19].
    SemiStratified,
    /// The true minimum of independent uniforms: independent leaves, for comparison.
    Exact,
}

/// A node's number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// Not above any leaf's number; for a leaf the number itself, in [0,1].
    pub xi: f64,
    /// Upper end of the stratum that `xi` was drawn from ([`MinimumRandom::SemiStratified`] only).
    pub base: f64,
}

/// The key of a node's draw.
#[inline(always)]
pub fn node_bits(key: u64, node: NodeId) -> u64 {
    mix(key ^ node.word().wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Eight 32-bit draws out of one of 64 bits.
#[inline(always)]
pub fn lane_bits(bits: u64) -> [u32; WIDTH] {
    let (lo, hi) = (bits as u32, (bits >> 32) as u32);
    std::array::from_fn(|lane| {
        let mut x = lo.wrapping_add((lane as u32 + 1).wrapping_mul(0x9e37_79b9));
        x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d) ^ hi;
        x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
        x ^ (x >> 16)
    })
}

/// Uniform in (0,1] with full relative precision down to 2^-128: a number below 1e-16 is as likely as it should be.
fn fine_unit(bits: u64) -> f64 {
    const STEP: f64 = 1.0 / (1u128 << 64) as f64;
    (bits as f64 + (mix(bits ^ 0x5851_f42d_4c95_7f2d) as f64 + 0.5) * STEP) * STEP
}

/// The strata of eight equal children: `order(r)[lane]` runs through the 56 maps x -> a x + b, a != 0, of the field
/// of eight elements. Two lanes see every ordered pair of distinct strata equally often, which is all that a
/// covariance can notice of a permutation.
#[inline(always)]
pub fn strata(bits: u32) -> [u32; WIDTH] {
    let packed = STRATA[((u64::from(bits) * STRATA.len() as u64) >> 32) as usize];
    std::array::from_fn(|lane| packed >> (4 * lane) & 7)
}

/// The maps of [`strata`], four bits for each lane.
pub(super) static STRATA: [u32; 56] = affine_maps();

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
        let u = fine_unit(mix(key ^ 0xd6e8_feb8_6659_fd93));
        match self {
            Self::Nested | Self::SemiStratified => Minimum { xi: u / leaves, base: 1.0 / leaves },
            Self::Exact => Minimum { xi: exact_minimum(u, leaves), base: 0.0 },
        }
    }

    /// The numbers of eight children of `capacity / 8` leaves each.
    #[inline(always)]
    pub fn eight(self, parent: Minimum, bits: u64, capacity: f64) -> [Minimum; WIDTH] {
        let stratum = strata((bits >> 32) as u32);
        let draws = lane_bits(bits);
        let step = 1.0 / capacity;
        std::array::from_fn(|lane| {
            if stratum[lane] == 0 {
                return parent;
            }
            let u = f64::from(draws[lane]) * (1.0 / (1u64 << 32) as f64);
            match self {
                Self::Nested => Minimum { xi: (f64::from(stratum[lane]) + u) * step, base: 0.0 },
                _ => self.sibling(parent, u, capacity, capacity * (1.0 / WIDTH as f64)),
            }
        })
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
}
