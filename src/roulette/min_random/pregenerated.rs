//! One number per light vertex, shared by all queries: what stochastic light culling does [Tokuyoshi & Harada 2016].

use super::{Deal, fine_unit};
use crate::sampler::counter::combine;
use crate::vertex_bvh::{MAX_LEVELS, NodeId, VertexBvh, WIDTH};
use fearless_simd::{Simd, f32x8, prelude::*};
use rayon::prelude::*;

/// Numbers of the leaves of a tree that do not depend on the query, and their minima over every node.
///
/// Each query by itself is as good as with [`MinimumRandom::Exact`](super::MinimumRandom::Exact), unbiased and with
/// the variance of independent roulettes. But queries that share the numbers of an iteration err together: averaging
/// over neighbours, as a pixel does, helps little. That, and 4.6 bytes a vertex, is what numbers dealt on the way
/// down spare.
#[derive(Debug, Clone)]
pub struct Pregenerated {
    seed: u64,
    /// Leaves of the tree; its shape follows from it.
    len: usize,
    /// Lower bounds of the numbers below each child of a node, or of a block's vertices; blocks first, then level 1...
    minima: Vec<[f32; WIDTH]>,
    /// Where each level begins in `minima`.
    start: [usize; MAX_LEVELS],
}

/// Leaves that one task handles at a time.
const GRAIN: usize = 4096;

impl Pregenerated {
    /// The numbers of an iteration, on the current rayon pool: independent, uniform in (0,1], a function of seed and
    /// place in the tree. They serve every tree over as many vertices as `bvh` has.
    pub fn new(bvh: &VertexBvh, seed: u64) -> Self {
        let mut numbers = Self { seed, len: bvh.len(), minima: Vec::new(), start: [0; MAX_LEVELS] };
        let blocks = numbers.len.div_ceil(WIDTH);
        let block = |block: usize| std::array::from_fn(|lane| below(numbers.number(block * WIDTH + lane)));
        let mut minima: Vec<[f32; WIDTH]> =
            (0..blocks).into_par_iter().with_min_len(GRAIN / WIDTH).map(block).collect();
        let (mut first, mut children) = (0, numbers.len);
        for level in 1..MAX_LEVELS {
            // What there is below the children of this level's nodes; the last of them may not be full.
            let under = std::mem::replace(&mut children, minima.len() - first);
            if children <= 1 {
                break;
            }
            let child = |i: usize| {
                let exist = under.saturating_sub(i * WIDTH).min(WIDTH);
                minima.get(first + i).map_or(1.0, |m| m[..exist].iter().copied().fold(1.0, f32::min))
            };
            let node = |i: usize| std::array::from_fn(|lane| child(i * WIDTH + lane));
            let here: Vec<_> = (0..children.div_ceil(WIDTH)).map(node).collect();
            first = minima.len();
            numbers.start[level] = first;
            minima.extend(here);
        }
        numbers.minima = minima;
        numbers
    }

    /// Number of light vertices of the trees that the numbers are for.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True when they are for a tree over nothing.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes of the minima.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.minima[..])
    }

    /// The number of the light vertex in a place of the tree (block times eight plus lane).
    #[inline]
    pub fn number(&self, place: usize) -> f64 {
        fine_unit(combine(self.seed, place as u64))
    }
}

/// Not above `x`.
#[inline]
fn below(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

impl Deal for &Pregenerated {
    /// Nothing waits on the stack: the place says all.
    type Number = ();
    type Eight<S: Simd> = f32x8<S>;

    fn root(self, _: f64) {}

    #[inline(always)]
    fn eight<S: Simd>(self, simd: S, (): (), node: NodeId) -> f32x8<S> {
        const NONE: [f32; WIDTH] = [0.0; WIDTH];
        let at = self.start[node.level as usize] + node.index as usize;
        f32x8::load_array_ref(simd, self.minima.get(at).unwrap_or(&NONE))
    }

    #[inline(always)]
    fn bounds<S: Simd>(_: S, eight: &f32x8<S>) -> f32x8<S> {
        *eight
    }

    #[inline(always)]
    fn push<S: Simd>(_: S, _: &mut [()], _: &f32x8<S>, _: u32) {}

    #[inline(always)]
    fn leaf<S: Simd>(self, _: &f32x8<S>, node: NodeId, lane: usize) -> f64 {
        self.number(node.index as usize * WIDTH + lane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn minima_are_those_of_the_numbers_below() {
        for n in [0, 1, 7, 8, 9, 64, 65, 1000, 5000] {
            let mut bvh = VertexBvh::new();
            bvh.build(&vec![Vec3::ONE; n]).unwrap();
            let numbers = Pregenerated::new(&bvh, 5);
            assert_eq!((numbers.len(), numbers.is_empty()), (n, n == 0));
            let mut stack: Vec<_> = bvh.root().into_iter().collect();
            while let Some(node) = stack.pop() {
                let minima = numbers.minima[numbers.start[node.level as usize] + node.index as usize];
                for lane in 0..bvh.children(node) {
                    let leaves = WIDTH.pow(node.level);
                    let first = (node.index as usize * WIDTH + lane) * leaves;
                    let least =
                        (first..(first + leaves).min(n)).map(|i| numbers.number(i)).fold(2.0, f64::min);
                    assert!(f64::from(minima[lane]) <= least && least <= f64::from(minima[lane].next_up()));
                    if node.level > 0 {
                        stack.push(node.child(lane as u32));
                    }
                }
            }
        }
    }
}
