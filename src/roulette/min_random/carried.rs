//! The rules that carry more than a number from node to node, dealt lane by lane.

use super::{Deal, Minimum, MinimumRandom, lane_bits, node_bits};
use crate::vertex_bvh::{NodeId, VertexBvh, WIDTH};
use fearless_simd::{Simd, f32x8, prelude::*};

/// A rule that carries [`Minimum`]s, dealt one by one.
macro_rules! carried {
    ($name:ident) => {
        /// The rule of the same name in [`MinimumRandom`].
        #[derive(Clone, Copy)]
        pub(in crate::roulette) struct $name {
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
