//! Hierarchical Russian roulette \[HRR19\] on one page: an eye vertex and a tree over light vertices in, accepted light
//! vertices and their probabilities out.
//!
//! Each light vertex `y` is kept with probability `P = min(1, C q(w) / d^2)`, where `q` ([`Lobe`]s) stands for the
//! scattering lobe at the eye vertex and `C` ([`Query::constant`], an area) says how many survive. A kept connection
//! is divided by `P`. "`y` is kept" means that it lies within an ellipsoid around the eye vertex whose size follows
//! from its random number; the smallest number of a subtree ([`MinimumRandom`]) gives the ellipsoid that its box must
//! touch to be looked into.
//!
//! Decisions fall in f64, by [`probability`], on offsets between stored f32 positions and the f64 eye position;
//! culling may err on the safe side only. So the accepted set depends on (positions, query) and on nothing else, and
//! [`query_brute_force`] finds the same.

pub mod approximate;
mod cull;
pub mod lobe;
pub mod min_random;
mod plane;
mod precision;

pub use cull::{MAX_LOBES, query, query_brute_force};
pub use lobe::{Lobe, Range};
pub use min_random::{MinimumRandom, Pregenerated};
/// The node test, for trees of other widths to be measured with (`benches/support/widths`).
#[doc(hidden)]
pub use plane::{Box8, FlatLobe, PAD, Vec8};
pub use precision::{LobePrecision, probability_in};

use glam::DVec3;

/// What is asked at an eye vertex.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// The eye vertex, in the coordinates of the light vertices.
    pub position: DVec3,
    /// The lobes whose sum is `q`.
    pub lobes: &'a [Lobe],
    /// C, an area: see [`constant_for`].
    pub constant: f64,
    /// Key of the random numbers; different for every eye vertex and iteration.
    pub key: u64,
    /// Only light vertices that share a bit with it are looked at. Does not move random numbers.
    pub mask: u32,
    /// The rule for minimum random numbers.
    pub rule: MinimumRandom,
    /// Numbers shared with other queries, in place of those that `key` and `rule` would deal: for comparison. Without
    /// use for culling, but still unbiased, when made for a tree of another size.
    pub pregenerated: Option<&'a Pregenerated>,
    /// Arithmetic of the probabilities. With any but [`LobePrecision::F64`], [`query()`] and [`query_brute_force`] may
    /// differ by what rounding does to these.
    pub precision: LobePrecision,
    /// How far boxes are grown, over what covers the roundings of their tests; at least 0. Below 1, vertices may be
    /// missed.
    pub padding: f32,
}

impl<'a> Query<'a> {
    /// A query over all vertices with the default rule.
    pub fn new(position: DVec3, lobes: &'a [Lobe], constant: f64, key: u64) -> Self {
        Self {
            position,
            lobes,
            constant,
            key,
            mask: u32::MAX,
            rule: MinimumRandom::default(),
            pregenerated: None,
            precision: LobePrecision::default(),
            padding: 1.0,
        }
    }
}

/// What queries did; add them up with [`QueryCounters::add`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct QueryCounters {
    /// Queries.
    pub queries: u64,
    /// Nodes visited, inner ones and blocks of vertices: each tests up to eight things at a time.
    pub nodes: u64,
    /// Boxes and vertices tested against a range.
    pub tests: u64,
    /// Light vertices whose probability was computed.
    pub leaves: u64,
    /// Light vertices accepted.
    pub accepted: u64,
    /// Sum of the probabilities of those `leaves`: a lower bound of the expected number of accepted vertices, equal
    /// to it in brute force.
    pub expected: f64,
}

impl QueryCounters {
    /// Adds another's counts.
    pub fn add(&mut self, other: &Self) {
        self.queries += other.queries;
        self.nodes += other.nodes;
        self.tests += other.tests;
        self.leaves += other.leaves;
        self.accepted += other.accepted;
        self.expected += other.expected;
    }
}

/// `P = min(1, C sum c_i / h_i^2)` of a light vertex at `offset` (light - eye) from the eye vertex.
///
/// To the last bit the number that a query tests and divides by, when `offset` is the stored f32 position widened to
/// f64 minus the query's position. 0 when C or all weights are 0; 1 for a vertex on the eye vertex.
#[inline(always)]
pub fn probability(lobes: &[Lobe], constant: f64, offset: DVec3) -> f64 {
    let p = constant * q_over_d2(lobes, offset);
    if p >= 1.0 {
        1.0
    } else if p > 0.0 {
        p
    } else {
        0.0 // also for NaN: 0/0 of a weightless lobe at its own vertex, 0 * inf of C = 0 there
    }
}

/// `q / d^2 = sum c_i / h_i^2` at `offset`, 1/(world unit)^2: what [`probability`] has of the lobes.
#[inline(always)]
pub fn q_over_d2(lobes: &[Lobe], offset: DVec3) -> f64 {
    let mut sum = 0.0;
    for lobe in lobes {
        sum += lobe.weight() / lobe.h2(offset);
    }
    sum
}

/// The constant C with which a query accepts about `wanted` vertices while its probabilities stay below 1:
/// `C = wanted * area / vertices`, `area` the scene's surface (its unit squared), `vertices` in the tree.
pub fn constant_for(wanted: f64, area: f64, vertices: usize) -> f64 {
    if vertices == 0 { 0.0 } else { wanted * area / vertices as f64 }
}
