//! Captures: builds and queries written to a file as they happen, to be made again elsewhere.

use super::cache::HrrCache;
use super::contents;
use super::context::{HrrContext, lock};
use super::pointer;
use super::query::HrrQuery;
use super::replay::HrrCapture;
use super::status::{Failure, HRR_ERROR_INVALID_STATE, HRR_ERROR_IO, HrrStatus, Outcome, guard};
use crate::roulette::{Lobe, MinimumRandom};
use crate::sampler::counter::combine;
use std::collections::HashMap;
use std::ffi::c_char;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// What a file of a capture begins with, and its records.
pub(super) const MAGIC: &[u8; 8] = b"HRRCAPT1";
pub(super) const CACHE: u32 = 1;
pub(super) const QUERY: u32 = 2;

/// A context's capture, when there is one.
#[derive(Debug, Default)]
pub(super) struct Capture {
    /// Whether queries are to be recorded: all that they look at when they are not.
    on: AtomicBool,
    recording: Mutex<Option<Recording>>,
    serial: AtomicU64,
}

#[derive(Debug)]
struct Recording {
    path: String,
    file: BufWriter<File>,
    /// Bytes that may be written yet.
    left: u64,
    /// Numbers in the file of the caches that are in it.
    caches: HashMap<u64, u32>,
    counts: HrrCapture,
    failure: Option<std::io::Error>,
}

/// The hits of a query, in one number.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Seen {
    pub count: u64,
    pub hash: u64,
}

impl Seen {
    pub fn add(&mut self, id: u64, probability: f64) {
        self.count += 1;
        self.hash = combine(combine(self.hash, id), probability.to_bits());
    }
}

/// A query that was made and checked.
pub(super) struct Made<'a> {
    pub cache: &'a HrrCache,
    pub ask: HrrQuery,
    pub lobes: &'a [Lobe],
    pub rule: MinimumRandom,
    pub brute_force: bool,
    pub seen: Seen,
}

impl Capture {
    pub fn next_serial(&self) -> u64 {
        self.serial.fetch_add(1, Ordering::Relaxed)
    }

    pub fn is_on(&self) -> bool {
        self.on.load(Ordering::Relaxed)
    }

    pub fn record(&self, made: &Made<'_>) {
        if let Some(recording) = &mut *lock(&self.recording) {
            recording.record(made);
        }
    }
}

impl Recording {
    fn record(&mut self, made: &Made<'_>) {
        let query = query_bytes(made);
        let known = self.caches.get(&made.cache.serial).copied();
        let cache = if known.is_none() { contents::write(made.cache) } else { Vec::new() };
        let header = if known.is_none() { 12 } else { 0 };
        let size = (query.len() + 8 + cache.len() + header) as u64;
        if self.failure.is_some() || size > self.left {
            self.counts.left_out += 1;
            return;
        }
        let written = (|| {
            let number = self.caches.len() as u32;
            if known.is_none() {
                self.file.write_all(&CACHE.to_le_bytes())?;
                self.file.write_all(&(cache.len() as u64).to_le_bytes())?;
                self.file.write_all(&cache)?;
            }
            self.file.write_all(&QUERY.to_le_bytes())?;
            self.file.write_all(&known.unwrap_or(number).to_le_bytes())?;
            self.file.write_all(&query)
        })();
        match written {
            Ok(()) => {
                let next = self.caches.len() as u32;
                self.caches.entry(made.cache.serial).or_insert(next);
                self.left -= size;
                self.counts.bytes += size;
                self.counts.queries += 1;
                self.counts.caches = self.caches.len() as u64;
            }
            Err(e) => {
                self.failure = Some(e);
                self.counts.left_out += 1;
            }
        }
    }
}

fn query_bytes(made: &Made<'_>) -> Vec<u8> {
    let ask = &made.ask;
    let mut bytes = Vec::with_capacity(64 + made.lobes.len() * 96);
    let mut numbers = |numbers: &[f64]| bytes.extend(numbers.iter().flat_map(|x| x.to_bits().to_le_bytes()));
    numbers(&ask.position);
    numbers(&[ask.constant]);
    for lobe in made.lobes.iter().copied().map(super::lobe::HrrLobe::from) {
        numbers(&[lobe.x, lobe.y, lobe.z].concat());
        numbers(&[lobe.alpha_x, lobe.alpha_y, lobe.weight]);
    }
    let rule = super::query::rule_number(made.rule) | u32::from(made.brute_force) << 8;
    let mut all = Vec::with_capacity(bytes.len() + 40);
    all.extend([made.lobes.len() as u32, ask.mask, rule, 0].iter().flat_map(|n| n.to_le_bytes()));
    all.extend([ask.key, made.seen.count, made.seen.hash].iter().flat_map(|n| n.to_le_bytes()));
    all.extend(bytes);
    all
}

/// Begins to write the context's caches and queries to a file (path in UTF-8): each cache once, when it is queried
/// first, and each query with a fingerprint of its hits. For reports of errors and for measuring: hrr_capture_replay
/// makes them again. max_bytes: queries that would make the file larger are left out; 0 = no limit. Queries take a lock
/// meanwhile. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INVALID_STATE (one goes on already), HRR_ERROR_IO.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_capture_begin(
    context: *const HrrContext,
    path: *const c_char,
    max_bytes: u64,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, path) = unsafe { (pointer::object(context, "context")?, pointer::text(path, "path")?) };
        let mut recording = lock(&context.capture.recording);
        if let Some(other) = &*recording {
            let message = format!("a capture goes on already, to {}", other.path);
            return Err(Failure::new(HRR_ERROR_INVALID_STATE, message));
        }
        let fail = |e| Failure::new(HRR_ERROR_IO, format!("{path}: {e}"));
        let mut file = BufWriter::new(File::create(path).map_err(fail)?);
        file.write_all(MAGIC).map_err(fail)?;
        *recording = Some(Recording {
            path: path.to_owned(),
            file,
            left: if max_bytes == 0 { u64::MAX } else { max_bytes.saturating_sub(8) },
            caches: HashMap::new(),
            counts: HrrCapture { bytes: 8, ..HrrCapture::default() },
            failure: None,
        });
        context.capture.on.store(true, Ordering::Relaxed);
        Ok(())
    })
}

/// Ends a capture. capture: what is in the file, NULL if not wanted; set its struct_size before. Queries that go on at
/// the same time are in the file or not. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI, HRR_ERROR_INVALID_STATE (none goes on), HRR_ERROR_IO (the file is
/// not complete; the capture has ended).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_capture_end(context: *const HrrContext, capture: *mut HrrCapture) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, out) = unsafe {
            let out = (!capture.is_null()).then(|| pointer::sized_out(capture, "capture")).transpose()?;
            (pointer::object(context, "context")?, out)
        };
        let recording = lock(&context.capture.recording).take();
        context.capture.on.store(false, Ordering::Relaxed);
        let Some(recording) = recording else {
            return Err(Failure::new(HRR_ERROR_INVALID_STATE, "no capture goes on"));
        };
        let counts = recording.counts;
        finish(recording)?;
        if let Some((out, struct_size)) = out {
            out.write(HrrCapture { struct_size, ..counts });
        }
        Ok(())
    })
}

fn finish(mut recording: Recording) -> Outcome {
    let end = recording.failure.take().map_or_else(|| recording.file.flush(), Err);
    end.map_err(|e| Failure::new(HRR_ERROR_IO, format!("{}: {e}", recording.path)))
}
