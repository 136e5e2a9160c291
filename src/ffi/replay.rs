//! Captures made again.

use super::cache::HrrCache;
use super::capture::{CACHE, MAGIC, QUERY, Seen};
use super::contents::{self, Reader, damaged};
use super::context::HrrContext;
use super::lobe::{HRR_MAX_LOBES, HrrLobe};
use super::pointer;
use super::query::{HrrQuery, Options, run};
use super::status::{Failure, HRR_ERROR_IO, HRR_ERROR_OUT_OF_MEMORY, HrrStatus, Outcome, guard};
use crate::roulette::QueryCounters;
use std::ffi::c_char;

/// What is in the file of a capture. Set struct_size before the call.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HrrCapture {
    /// sizeof(HrrCapture).
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Caches.
    pub caches: u64,
    /// Queries.
    pub queries: u64,
    /// Queries that were left out for want of room, or after an error.
    pub left_out: u64,
    /// Size of the file.
    pub bytes: u64,
    /// Queries whose hits were others when they were made again.
    pub differences: u64,
    /// Time that these queries took, in seconds.
    pub seconds: f64,
}

/// Makes a capture's caches and queries again, on one of the context's threads, and compares the hits. path: in UTF-8.
/// The file is not trusted. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI, HRR_ERROR_IO, HRR_ERROR_OUT_OF_MEMORY. That hits differ is none:
/// see `differences`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_capture_replay(
    context: *const HrrContext,
    path: *const c_char,
    capture: *mut HrrCapture,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, path, (out, struct_size)) = unsafe {
            let out = pointer::sized_out(capture, "capture")?;
            (pointer::object(context, "context")?, pointer::text(path, "path")?, out)
        };
        let io = |what: &dyn std::fmt::Display| Failure::new(HRR_ERROR_IO, format!("{path}: {what}"));
        let bytes = std::fs::read(path).map_err(|e| io(&e))?;
        let counts = replay(context, &bytes)
            .map_err(|f| if f.status == HRR_ERROR_OUT_OF_MEMORY { f } else { io(&f.message) })?;
        out.write(HrrCapture { struct_size, ..counts });
        Ok(())
    })
}

fn replay(context: &HrrContext, bytes: &[u8]) -> Outcome<HrrCapture> {
    let mut from = Reader(bytes);
    if from.take(MAGIC.len())? != MAGIC {
        return Err(damaged("it does not begin as it should"));
    }
    let mut counts = HrrCapture { bytes: bytes.len() as u64, ..HrrCapture::default() };
    let mut caches: Vec<HrrCache> = Vec::new();
    while !from.0.is_empty() {
        match from.u32()? {
            CACHE => {
                let size = usize::try_from(from.u64()?).unwrap_or(usize::MAX);
                caches.push(contents::read(context, from.take(size)?)?);
                counts.caches += 1;
            }
            QUERY => {
                let number = from.u32()? as usize;
                let cache = caches.get(number).ok_or_else(|| damaged("a query of no cache"))?;
                query(cache, &mut from, &mut counts)?;
            }
            _ => return Err(damaged("a record of no known kind")),
        }
    }
    Ok(counts)
}

fn query(cache: &HrrCache, from: &mut Reader<'_>, counts: &mut HrrCapture) -> Outcome {
    let (lobe_count, mask, rule, _) = (from.u32()?, from.u32()?, from.u32()?, from.u32()?);
    let (key, expected) = (from.u64()?, Seen { count: from.u64()?, hash: from.u64()? });
    let (position, constant) = (from.f64s()?, from.f64()?);
    if lobe_count > HRR_MAX_LOBES {
        return Err(damaged("a query with too many lobes"));
    }
    let mut lobes = Vec::new();
    for _ in 0..lobe_count {
        let (x, y, z) = (from.f64s()?, from.f64s()?, from.f64s()?);
        lobes.push(HrrLobe { x, y, z, alpha_x: from.f64()?, alpha_y: from.f64()?, weight: from.f64()? });
    }
    let ask = HrrQuery { position, lobes: lobes.as_ptr(), lobe_count, mask, constant, key };
    let options = Options::new(rule & 0xff, rule >> 8)?;
    let (mut seen, mut did) = (Seen::default(), QueryCounters::default());
    let start = std::time::Instant::now();
    // SAFETY: the lobes live until the end.
    unsafe { run(cache, &ask, options, &mut did, |hit| seen.add(hit.id, hit.probability)) }?;
    counts.seconds += start.elapsed().as_secs_f64();
    counts.queries += 1;
    counts.differences += u64::from(seen != expected);
    Ok(())
}
