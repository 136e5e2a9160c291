//! Queries: an eye vertex and its lobes in, accepted light vertices out.

use super::cache::HrrCache;
use super::capture::{Made, Seen};
use super::lobe::{HrrLobe, Lobes, constant};
use super::pointer::{self, Out};
use super::status::{Failure, HRR_ERROR_BUFFER_TOO_SMALL, HRR_ERROR_CALLBACK, HrrStatus, Outcome, guard};
use crate::roulette::{self, MinimumRandom, Query, QueryCounters, query_brute_force};
use crate::sampler::counter::combine;
use glam::DVec3;
use std::ffi::c_void;

/// What is asked at an eye vertex.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrQuery {
    /// The eye vertex, in the coordinates of the light vertices.
    pub position: [f64; 3],
    /// The lobes whose sum judges directions.
    pub lobes: *const HrrLobe,
    /// Their number, at most HRR_MAX_LOBES; with none nothing is accepted.
    pub lobe_count: u32,
    /// Only light vertices that share a bit with it are looked at; 0xffffffff = all; not 0. Moves no random number.
    pub mask: u32,
    /// C, an area in the host's unit of length squared: see hrr_constant_for.
    pub constant: f64,
    /// Key of the random numbers: different for each eye vertex and iteration; see hrr_key.
    pub key: u64,
}

/// An accepted light vertex.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HrrHit {
    /// The light vertex' id.
    pub id: u64,
    /// The probability P with which it was accepted, in (0,1]: divide by it.
    pub probability: f64,
}

/// What queries did. Calls add to it: zero it first.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HrrCounters {
    /// Queries.
    pub queries: u64,
    /// Nodes visited, each of up to eight boxes or vertices.
    pub nodes: u64,
    /// Boxes and vertices tested against a range.
    pub tests: u64,
    /// Light vertices whose probability was computed.
    pub leaves: u64,
    /// Light vertices accepted.
    pub accepted: u64,
    /// Sum of the probabilities of those `leaves`: a lower bound of the expected number of accepted vertices, equal
    /// to it with brute_force.
    pub expected: f64,
}

/// Children of equal size get one stratum each: the default, and the fastest.
pub const HRR_RULE_NESTED: u32 = 0;
/// The rule of the paper.
pub const HRR_RULE_SEMI_STRATIFIED: u32 = 1;
/// The true minimum of independent numbers: independent roulettes. Slower; for comparison.
pub const HRR_RULE_EXACT: u32 = 2;

/// How to query. Zero it, then set struct_size and what is wanted; NULL in its place means the defaults.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrQueryOptions {
    /// sizeof(HrrQueryOptions).
    pub struct_size: u32,
    /// HRR_RULE_*: how the random numbers of a subtree are dealt. All are unbiased.
    pub rule: u32,
    /// 1: test every vertex. The same hits as with the tree, to the last bit, in the same order.
    pub brute_force: u32,
    /// 0.
    pub reserved: u32,
}

/// Called for each accepted vertex; anything but 0 makes it the last. Must not throw.
pub type HrrHitFn = Option<unsafe extern "C" fn(user: *mut c_void, hit: *const HrrHit) -> i32>;

/// Adds to a host's counters, where it wants them.
pub(super) fn add(counters: Option<Out<HrrCounters>>, new: &QueryCounters) {
    let Some(out) = counters else { return };
    // A host that forgot to zero them is not to be stopped by that.
    let old = out.read();
    out.write(HrrCounters {
        queries: old.queries.wrapping_add(new.queries),
        nodes: old.nodes.wrapping_add(new.nodes),
        tests: old.tests.wrapping_add(new.tests),
        leaves: old.leaves.wrapping_add(new.leaves),
        accepted: old.accepted.wrapping_add(new.accepted),
        expected: old.expected + new.expected,
    });
}

/// Options that make sense.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Options {
    rule: MinimumRandom,
    brute_force: bool,
}

impl Options {
    #[inline(always)]
    pub unsafe fn read(options: *const HrrQueryOptions) -> Outcome<Self> {
        // SAFETY: passed on.
        if options.is_null() { Ok(Self::default()) } else { unsafe { Self::read_given(options) } }
    }

    unsafe fn read_given(options: *const HrrQueryOptions) -> Outcome<Self> {
        // SAFETY: passed on.
        let o = unsafe { pointer::sized(options, "options") }?;
        if o.reserved != 0 {
            return Err(Failure::argument(format!("options->reserved is {}, not 0", o.reserved)));
        }
        Self::new(o.rule, o.brute_force)
    }

    pub fn new(rule: u32, brute_force: u32) -> Outcome<Self> {
        let rule = match rule {
            HRR_RULE_NESTED => MinimumRandom::Nested,
            HRR_RULE_SEMI_STRATIFIED => MinimumRandom::SemiStratified,
            HRR_RULE_EXACT => MinimumRandom::Exact,
            rule => return Err(Failure::argument(format!("options->rule is {rule}: no HRR_RULE_*"))),
        };
        if brute_force > 1 {
            return Err(Failure::argument(format!("options->brute_force is {brute_force}: it is 0 or 1")));
        }
        Ok(Self { rule, brute_force: brute_force == 1 })
    }
}

/// HRR_RULE_* of a rule.
pub(super) fn rule_number(rule: MinimumRandom) -> u32 {
    match rule {
        MinimumRandom::Nested => HRR_RULE_NESTED,
        MinimumRandom::SemiStratified => HRR_RULE_SEMI_STRATIFIED,
        MinimumRandom::Exact => HRR_RULE_EXACT,
    }
}

/// What makes no query of a host's.
#[cold]
fn wrong(position: DVec3, mask: u32) -> Failure {
    if mask == 0 {
        return Failure::argument("query->mask is 0: no light vertex shares a bit with it");
    }
    Failure::non_finite(format!("query->position is {position}"))
}

impl HrrQuery {
    /// A host's query, which need not be aligned, read as it was written: a whole that is read just after its parts were
    /// written waits until they are in the memory.
    #[inline(always)]
    unsafe fn read(query: *const Self) -> Self {
        macro_rules! part {
            ($($part:tt)*) => {
                // SAFETY: part of what the caller vouches for.
                unsafe { (&raw const (*query).$($part)*).read_unaligned() }
            };
        }
        Self {
            position: [part!(position[0]), part!(position[1]), part!(position[2])],
            lobes: part!(lobes),
            lobe_count: part!(lobe_count),
            mask: part!(mask),
            constant: part!(constant),
            key: part!(key),
        }
    }
}

/// Answers a query, which is not NULL; `visit` gets every hit.
///
/// Part of the functions that call it, so that the query stays in their registers.
#[inline(always)]
pub(super) unsafe fn run(
    cache: &HrrCache,
    query: *const HrrQuery,
    options: Options,
    counters: &mut QueryCounters,
    mut visit: impl FnMut(HrrHit),
) -> Outcome {
    // SAFETY: passed on.
    let ask = unsafe { HrrQuery::read(query) };
    let position = DVec3::from_array(ask.position);
    // 0 times what is not finite is NaN.
    if position * 0.0 != DVec3::ZERO || ask.mask == 0 {
        return Err(wrong(position, ask.mask));
    }
    let mut read = Lobes::new();
    // SAFETY: passed on.
    let lobes = unsafe { read.read(ask.lobes, ask.lobe_count) }?;
    let constant = constant(ask.constant)?;
    let Options { rule, brute_force } = options;
    let mut inner = Query::new(cache.relative(position), lobes, constant, ask.key);
    (inner.mask, inner.rule) = (ask.mask, rule);
    let bvh = &cache.storage.bvh;
    let make = || Made { cache, ask, lobes, rule, brute_force, seen: Seen::default() };
    let mut captured = cache.capture.is_on().then(make);
    let mut found = |index: u32, probability| {
        let id = cache.storage.id(index);
        if let Some(made) = &mut captured {
            made.seen.add(id, probability);
        }
        visit(HrrHit { id, probability });
    };
    if brute_force {
        query_brute_force(bvh, &inner, counters, &mut found);
    } else {
        roulette::query(bvh, &inner, counters, &mut found);
    }
    if let Some(made) = &captured {
        cache.capture.record(made);
    }
    Ok(())
}

/// What the calls for one query have in common.
pub(super) struct Asked<'a> {
    pub cache: &'a HrrCache,
    pub query: *const HrrQuery,
    pub options: Options,
    pub counters: Option<Out<HrrCounters>>,
}

impl Asked<'_> {
    #[inline(always)]
    pub unsafe fn read(
        cache: *const HrrCache,
        query: *const HrrQuery,
        options: *const HrrQueryOptions,
        counters: *mut HrrCounters,
    ) -> Outcome<Self> {
        // SAFETY: passed on.
        unsafe {
            Ok(Self {
                cache: pointer::object(cache, "cache")?,
                query: pointer::given(query, "query")?,
                options: Options::read(options)?,
                counters: Out::optional(counters, "counters")?,
            })
        }
    }
}

/// The room that a host has for hits, how many there are, and where that is to be said.
pub(super) struct Hits {
    room: Out<HrrHit>,
    capacity: u64,
    count: u64,
    out_count: Out<u64>,
}

impl Hits {
    #[inline(always)]
    pub unsafe fn new(hits: *mut HrrHit, capacity: u64, out_count: *mut u64) -> Outcome<Self> {
        // SAFETY: passed on.
        unsafe {
            let room = Out::array(hits, usize::try_from(capacity).unwrap_or(usize::MAX), "hits")?;
            Ok(Self { room, capacity, count: 0, out_count: Out::new(out_count, "out_count")? })
        }
    }

    /// Writes a hit where there is room for it.
    #[inline(always)]
    pub fn push(&mut self, hit: HrrHit) {
        if self.count < self.capacity {
            // SAFETY: below the capacity, which the caller of `new` vouches for.
            unsafe { self.room.write_at(self.count as usize, hit) };
        }
        self.count += 1;
    }

    /// Says how many there are; fails when there is no room for them.
    #[inline(always)]
    pub fn finish(self) -> Outcome {
        #[cold]
        fn too_many(count: u64, capacity: u64) -> Failure {
            Failure::new(HRR_ERROR_BUFFER_TOO_SMALL, format!("{count} hits, capacity is {capacity}"))
        }
        self.out_count.write(self.count);
        if self.count > self.capacity { Err(too_many(self.count, self.capacity)) } else { Ok(()) }
    }
}

/// Key of a query's random numbers, well mixed, for a seed, an iteration (or sample), a pixel and a depth (with which
/// of several queries there, if there are several). Any numbers will do that no two queries share. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_key(seed: u64, iteration: u64, pixel: u64, depth: u64) -> u64 {
    [iteration, pixel, depth].into_iter().fold(seed, combine)
}

/// Writes the accepted light vertices to hits (room for capacity) and their number to *out_count, which may be more:
/// then the first `capacity` are there and the status is HRR_ERROR_BUFFER_TOO_SMALL. hits may be NULL when capacity is
/// 0. options, counters: NULL if not wanted.
///
/// The same key and cache give the same hits in the same order, on any thread and machine. Any thread; takes no lock,
/// and allocates nothing unless it fails (or is captured: hrr_capture_begin).
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_query(
    cache: *const HrrCache,
    query: *const HrrQuery,
    options: *const HrrQueryOptions,
    hits: *mut HrrHit,
    capacity: u64,
    out_count: *mut u64,
    counters: *mut HrrCounters,
) -> HrrStatus {
    guard(|| {
        let mut did = QueryCounters::default();
        // SAFETY: this module's contract.
        unsafe {
            let Asked { cache, query, options, counters } = Asked::read(cache, query, options, counters)?;
            let mut hits = Hits::new(hits, capacity, out_count)?;
            run(cache, query, options, &mut did, |hit| hits.push(hit))?;
            add(counters, &did);
            hits.finish()
        }
    })
}

/// Calls a function with each accepted light vertex, on this thread, in the order of hrr_query. options, counters: NULL
/// if not wanted. Any thread; takes no lock, and allocates nothing unless it fails.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_CALLBACK (visit returned
/// something but 0; counters are left alone).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_query_visit(
    cache: *const HrrCache,
    query: *const HrrQuery,
    options: *const HrrQueryOptions,
    visit: HrrHitFn,
    user: *mut c_void,
    counters: *mut HrrCounters,
) -> HrrStatus {
    guard(|| {
        let mut did = QueryCounters::default();
        // SAFETY: this module's contract.
        unsafe {
            let Asked { cache, query, options, counters } = Asked::read(cache, query, options, counters)?;
            let visit = visit.ok_or_else(|| Failure::argument("visit is NULL"))?;
            let mut answer = 0;
            run(cache, query, options, &mut did, |hit| {
                if answer == 0 {
                    answer = visit(user, &hit);
                }
            })?;
            if answer != 0 {
                let message = format!("visit returned {answer}");
                return Err(Failure::new(HRR_ERROR_CALLBACK, message));
            }
            add(counters, &did);
        }
        Ok(())
    })
}
