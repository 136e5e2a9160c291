//! [`MinimumRandom::Nested`](super::MinimumRandom::Nested) as the walk deals it: in f32, eight at a time.

use super::{Deal, ROOT, fine_unit, lane_bits_simd, node_bits};
use crate::sampler::counter::{mix, unit};
use crate::vertex_bvh::{NodeId, VertexBvh};
use fearless_simd::{Simd, f32x8, i32x8, mask32x8, prelude::*, u32x8};

/// Children of equal size take the eight strata of their parent in random order; the child in the lowest inherits the number, which lies there.
///
/// Numbers travel in f32 without rounding: those between 8^-j/8 and 8^-j are multiples of 2^-24 8^-j, and dealing
/// scales by powers of eight. A leaf adds a uniform offset within that cell, so that it is uniform in all its bits.
#[derive(Clone, Copy)]
pub(in crate::roulette) struct Nested {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vertex_bvh::WIDTH;

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
}
