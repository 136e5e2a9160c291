//! Many queries at once.

use super::cache::HrrCache;
use super::context::HrrContext;
use super::pointer::{self, Out, Strided};
use super::query::{HrrCounters, HrrHit, HrrQuery, HrrQueryOptions, Options, add, run};
use super::status::{Failure, HRR_ERROR_BUFFER_TOO_SMALL, HrrStatus, Outcome, guard};
use super::tasks;
use crate::roulette::QueryCounters;
use std::sync::OnceLock;

/// Queries of one task. Few under Miri, which is slow, and should see several tasks.
const GRAIN: usize = if cfg!(miri) { 2 } else { 256 };

/// Most queries of one call.
const MAX_QUERIES: u64 = 1 << 36;

/// What a task found.
#[derive(Default)]
struct Part {
    hits: Vec<HrrHit>,
    /// Hits up to the end of each query.
    ends: Vec<u64>,
    counters: QueryCounters,
}

/// The queries of one task.
unsafe fn part(
    cache: &HrrCache,
    queries: Strided<HrrQuery>,
    range: std::ops::Range<usize>,
    options: Options,
) -> Outcome<Part> {
    let mut part = Part { ends: Vec::with_capacity(range.len()), ..Part::default() };
    for i in range {
        let Part { hits, counters, .. } = &mut part;
        // SAFETY: below the number of queries; the caller passes on its own caller's word.
        let outcome = unsafe { run(cache, queries.at(i), options, counters, |hit| hits.push(hit)) };
        outcome.map_err(|f| Failure { message: format!("queries[{i}]: {}", f.message), ..f })?;
        part.ends.push(part.hits.len() as u64);
    }
    Ok(part)
}

/// Answers query_count queries, which lie query_stride bytes apart (0 = packed), on the threads of the context or of
/// its parallel_for. The hits of query i, as hrr_query would write them, lie from entry i of offsets up to entry i + 1.
/// hits: room for hit_capacity, NULL when that is 0. offsets: room for query_count + 1.
///
/// When there are more hits than fit, hits is left alone, offsets is written, its last entry says how many there are,
/// and the status is HRR_ERROR_BUFFER_TOO_SMALL. options, counters: NULL if not wanted. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_BUFFER_TOO_SMALL,
/// HRR_ERROR_CALLBACK (parallel_for did not run all tasks). Of several queries at fault the first is named.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_query_batch(
    context: *const HrrContext,
    cache: *const HrrCache,
    queries: *const HrrQuery,
    query_stride: usize,
    query_count: u64,
    options: *const HrrQueryOptions,
    hits: *mut HrrHit,
    hit_capacity: u64,
    offsets: *mut u64,
    counters: *mut HrrCounters,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let context = pointer::object(context, "context")?;
            let cache = pointer::object(cache, "cache")?;
            if query_count > MAX_QUERIES {
                return Err(Failure::argument(format!("query_count is {query_count}: at most 2^36")));
            }
            let count = query_count as usize;
            let queries = Strided::new(queries, query_stride, count, "queries")?;
            let options = Options::read(options)?;
            let hits = if hit_capacity == 0 { None } else { Some(Out::new(hits, "hits")?) };
            let offsets = Out::new(offsets, "offsets")?;
            let counters = Out::optional(counters, "counters")?;

            let parts: Vec<OnceLock<Outcome<Part>>> =
                (0..count.div_ceil(GRAIN)).map(|_| OnceLock::new()).collect();
            tasks::run(context, parts.len(), &|task| {
                let range = task * GRAIN..((task + 1) * GRAIN).min(count);
                // SAFETY: the range lies within the queries.
                let _ = parts[task].set(part(cache, queries, range, options));
            })?;

            let mut done = Vec::with_capacity(parts.len());
            for part in parts {
                let missing = || Err(Failure::argument("a task did not run"));
                done.push(part.into_inner().unwrap_or_else(missing)?);
            }
            let mut did = QueryCounters::default();
            let (mut query, mut first) = (0, 0);
            offsets.write(0);
            for part in &done {
                did.add(&part.counters);
                for end in &part.ends {
                    query += 1;
                    // SAFETY: there is one more offset than there are queries.
                    offsets.write_at(query, first + end);
                }
                first += part.hits.len() as u64;
            }
            add(counters, &did);
            if first > hit_capacity {
                let message = format!("{first} hits, hit_capacity is {hit_capacity}");
                return Err(Failure::new(HRR_ERROR_BUFFER_TOO_SMALL, message));
            }
            if let Some(out) = hits {
                for (i, hit) in done.iter().flat_map(|part| &part.hits).enumerate() {
                    // SAFETY: there are no more than the capacity.
                    out.write_at(i, *hit);
                }
            }
        }
        Ok(())
    })
}
