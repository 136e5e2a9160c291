//! Caches: light vertices in a tree. Made by a build, and immutable from then on.

use super::capture::Capture;
use super::contents;
use super::context::{HrrContext, Spare};
use super::log::{HRR_LOG_INFO, HRR_LOG_WARNING};
use super::memory::Held;
use super::pointer::{self, Out, Strided};
use super::progress::{HrrProgressFn, Progress};
use super::segment::{Gathered, HRR_DOUBLE3, HRR_FLOAT3, HrrSegment, Rules};
use super::status::{
    Failure, HRR_ERROR_INTERNAL, HRR_ERROR_IO, HRR_ERROR_OUT_OF_MEMORY, HrrStatus, Outcome, guard,
};
use crate::file;
use crate::vertex_bvh::{MAX_VERTICES, NodeId, VertexBvh};
use glam::DVec3;
use std::ffi::{c_char, c_void};
use std::path::Path;
use std::sync::{Arc, Weak};
use std::time::Instant;
use xxhash_rust::xxh3::Xxh3;

/// A position that is NaN, infinite or (double) beyond 1e38 is an error.
pub const HRR_INVALID_ERROR: u32 = 0;
/// Vertices with such a position are left out, and counted in HrrCacheInfo.
pub const HRR_INVALID_DROP: u32 = 1;

/// Vertices are taken in the order of the segments: the tree depends on it.
pub const HRR_ORDER_AS_GIVEN: u32 = 0;
/// Vertices are sorted by id first, so that segments may be filled by threads in any order; ids must differ.
pub const HRR_ORDER_BY_ID: u32 = 1;

/// What to build a cache from. Zero it, then set struct_size and what is wanted.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrBuildDesc {
    /// sizeof(HrrBuildDesc).
    pub struct_size: u32,
    /// HRR_FLOAT3 or HRR_DOUBLE3.
    pub position_format: u32,
    /// The light vertices.
    pub segments: *const HrrSegment,
    /// Number of segments; 0 makes an empty cache.
    pub segment_count: u32,
    /// HRR_INVALID_ERROR or HRR_INVALID_DROP.
    pub invalid: u32,
    /// HRR_ORDER_AS_GIVEN or HRR_ORDER_BY_ID.
    pub order: u32,
    /// 0.
    pub reserved: u32,
    /// Fail rather than need more memory than this, in bytes, by hrr_cache_estimate_bytes; 0 = no limit.
    pub max_bytes: u64,
    /// Told how far the build is; NULL = nobody is. What it returns ends the build with HRR_ERROR_CANCELLED, before the
    /// tree is begun or after; gathering looks often, the tree itself not.
    pub progress: HrrProgressFn,
    /// Passed to progress.
    pub progress_user: *mut c_void,
}

/// Light vertices in a tree. Immutable: any number of threads may query it at once. Opaque; see hrr_cache_build.
#[derive(Debug)]
pub struct HrrCache {
    pub(super) storage: Storage,
    pub(super) capture: Arc<Capture>,
    /// Tells caches of a capture apart.
    pub(super) serial: u64,
    dropped: u64,
    build_seconds: f64,
    spare: Weak<Spare>,
}

/// A cache's buffers.
#[derive(Debug, Default)]
pub(super) struct Storage {
    pub bvh: VertexBvh,
    /// Empty where every id is the vertex' index: a look-up less for each hit.
    pub ids: Vec<u64>,
    pub origin: DVec3,
    pub held: Option<Held>,
}

impl Storage {
    fn bytes(&self) -> u64 {
        (self.bvh.bytes() + self.bvh.build_bytes() + size_of_val(&self.ids[..])) as u64
    }

    /// The id of the vertex with an index.
    #[inline(always)]
    pub fn id(&self, index: u32) -> u64 {
        if self.ids.is_empty() { index.into() } else { self.ids[index as usize] }
    }
}

/// Where a cache's light vertices come from.
pub(super) struct Source<F> {
    /// At most so many.
    pub count: u64,
    pub masked: bool,
    /// Puts them into the empty buffers that it is given.
    pub fill: F,
    pub progress: Progress,
}

impl HrrCache {
    unsafe fn build(context: &HrrContext, desc: &HrrBuildDesc) -> Outcome<Self> {
        let choice = |value: u32, name: &str| match value {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Failure::argument(format!("desc->{name} is {value}: it is 0 or 1"))),
        };
        const { assert!(HRR_FLOAT3 == 0 && HRR_DOUBLE3 == 1) };
        let rules = Rules {
            double: choice(desc.position_format, "position_format")?,
            drop: choice(desc.invalid, "invalid")?,
            sort: choice(desc.order, "order")?,
        };
        if desc.reserved != 0 {
            return Err(Failure::argument("desc->reserved is not 0"));
        }
        let count = desc.segment_count as usize;
        // SAFETY: the caller passes on its own caller's word.
        let segments = unsafe { Strided::new(desc.segments, 0, count, "desc->segments") }?;
        // SAFETY: below the count.
        let segment = |i| unsafe { segments.get(i) };
        let total = (0..count).fold(0u64, |sum, i| sum.saturating_add(segment(i).count));
        let masked = (0..count).any(|i| !segment(i).mask.is_null());
        let needed = estimate(total, masked);
        if desc.max_bytes > 0 && needed > desc.max_bytes {
            let message = format!("{total} light vertices take {needed} bytes, {} allowed", desc.max_bytes);
            return Err(Failure::new(HRR_ERROR_OUT_OF_MEMORY, message));
        }
        // Nobody is asked for memory because of a count that cannot be meant.
        if total > MAX_VERTICES as u64 && desc.invalid == HRR_INVALID_ERROR {
            let message = format!("the count of all segments is {total}: at most 2^31 fit a cache");
            return Err(Failure::argument(message));
        }
        let progress = Progress::new(desc.progress, desc.progress_user);
        // SAFETY: `count` segments, as above.
        let fill = |gathered: &mut Gathered| unsafe { gathered.fill(segments, count, rules, progress) };
        let cache = Self::new(context, Source { count: total, masked, fill, progress })?;
        if cache.dropped > 0 {
            context.log.say(HRR_LOG_WARNING, || {
                format!("{} of {total} light vertices are not finite and were left out", cache.dropped)
            });
        }
        Ok(cache)
    }

    /// Builds a cache with the context's threads and memory.
    pub(super) fn new<F: FnOnce(&mut Gathered) -> Outcome + Send>(
        context: &HrrContext,
        source: Source<F>,
    ) -> Outcome<Self> {
        let start = Instant::now();
        source.progress.at(0.0)?;
        let (mut storage, mut gathered) = context.spare.take();
        let old = [storage.held.take(), gathered.held.take()];
        let held = Held::at_least(&context.account, old, estimate(source.count, source.masked))?;
        gathered.clear();
        let mut fill = Some(source.fill);
        let mut build = || -> Outcome {
            if let Some(fill) = fill.take() {
                fill(&mut gathered)?;
            }
            source.progress.at(GATHERED)?;
            let Gathered { positions, masks, ids, .. } = &mut gathered;
            let masks = (!masks.is_empty()).then_some(&masks[..]);
            storage.bvh.build_masked(positions, masks)?;
            if (0..).zip(&ids[..]).all(|(index, &id): (u64, _)| index == id) {
                ids.clear();
            }
            std::mem::swap(&mut storage.ids, ids);
            source.progress.at(1.0)
        };
        context.pool.install(&mut build)?;
        storage.origin = gathered.origin;
        let dropped = gathered.dropped;
        let (own, spare) = held.split(storage.bytes(), gathered.bytes());
        (storage.held, gathered.held) = (Some(own), Some(spare));
        context.spare.give_gathered(gathered);
        let build_seconds = start.elapsed().as_secs_f64();
        context.log.say(HRR_LOG_INFO, || {
            let (n, bytes) = (storage.bvh.len(), storage.bytes());
            format!("cache of {n} light vertices, {bytes} bytes, built in {build_seconds:.4} s")
        });
        let (capture, serial) = (context.capture.clone(), context.capture.next_serial());
        let spare = Arc::downgrade(&context.spare);
        Ok(Self { storage, capture, serial, dropped, build_seconds, spare })
    }

    /// What becomes of a position in the cache's coordinates.
    pub(super) fn relative(&self, position: DVec3) -> DVec3 {
        position - self.storage.origin
    }

    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Whether there are masks.
    pub(super) fn masked(&self) -> bool {
        self.storage.bvh.root().is_some_and(|root| self.storage.bvh.masks(root).is_some())
    }

    /// What queries can see, in one number.
    pub(super) fn fingerprint(&self) -> u64 {
        let Storage { bvh, origin, .. } = &self.storage;
        let mut hash = Xxh3::new();
        origin.to_array().iter().for_each(|x| hash.update(&x.to_bits().to_le_bytes()));
        for (i, block) in bvh.blocks().iter().enumerate() {
            let node = NodeId { level: 0, index: i as u32 };
            for lane in 0..bvh.children(node) {
                for axis in block.position {
                    hash.update(&axis[lane].to_bits().to_le_bytes());
                }
                hash.update(&self.storage.id(block.index[lane]).to_le_bytes());
                hash.update(&bvh.masks(node).map_or(u32::MAX, |masks| masks[lane]).to_le_bytes());
            }
        }
        hash.digest()
    }
}

impl Drop for HrrCache {
    fn drop(&mut self) {
        if let Some(spare) = self.spare.upgrade() {
            spare.give_storage(std::mem::take(&mut self.storage));
        }
    }
}

/// How much of a build is done when all vertices are gathered, about.
const GATHERED: f64 = 0.3;

/// Bytes at the height of a build: gathered positions and ids (old and new), the order, blocks, boxes; masks.
fn estimate(count: u64, masked: bool) -> u64 {
    let each = 12 + 16 + 16 + 16 + 4 + if masked { 9 } else { 0 };
    count.saturating_mul(each).saturating_add(4096)
}

/// An upper bound of the bytes that building and keeping a cache of so many vertices takes, beside the host's own.
/// masked: whether there are masks. A pure function; any thread.
#[unsafe(no_mangle)]
pub extern "C" fn hrr_cache_estimate_bytes(vertex_count: u64, masked: u32) -> u64 {
    estimate(vertex_count, masked != 0)
}

/// Builds a cache with one reference, which hrr_cache_release gives up. Blocks until the tree is built, by the
/// context's pool; the tree is the same for any number of threads. Memory of a cache released before is used again.
/// Afterwards nothing of the host's is referred to. Any thread; other caches may be built and queried meanwhile.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_OUT_OF_MEMORY, HRR_ERROR_ABI,
/// HRR_ERROR_CANCELLED; *out_cache is then as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_build(
    context: *const HrrContext,
    desc: *const HrrBuildDesc,
    out_cache: *mut *mut HrrCache,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let context = pointer::object(context, "context")?;
            let desc = pointer::sized(desc, "desc")?;
            let out = Out::new(out_cache, "out_cache")?;
            out.write(pointer::handle(HrrCache::build(context, &desc)?));
        }
        Ok(())
    })
}

/// Adds a reference; NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_retain(cache: *mut HrrCache) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::retain(cache) };
        Ok(())
    });
}

/// Gives up a reference; the last one frees the cache, or leaves its memory to the context's next build. NULL is
/// allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_release(cache: *mut HrrCache) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::release(cache) };
        Ok(())
    });
}

/// What there is to know about a cache. Set struct_size before the call.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrCacheInfo {
    /// sizeof(HrrCacheInfo).
    pub struct_size: u32,
    /// Levels of the tree, whose nodes have eight children; 0 when it is empty.
    pub levels: u32,
    /// Light vertices in the tree.
    pub vertex_count: u64,
    /// Light vertices left out by HRR_INVALID_DROP.
    pub dropped_count: u64,
    /// Memory of the cache in bytes, buffers for the next build included.
    pub bytes: u64,
    /// What stored positions are relative to: 0 for HRR_FLOAT3, the centre of the box for HRR_DOUBLE3.
    pub origin: [f64; 3],
    /// Lower corner of the box around the stored positions, in the host's coordinates; 0 when empty.
    pub bounds_min: [f64; 3],
    /// Upper corner.
    pub bounds_max: [f64; 3],
    /// Time that the build took, in seconds.
    pub build_seconds: f64,
}

/// Describes a cache. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_info(cache: *const HrrCache, info: *mut HrrCacheInfo) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let cache = unsafe { pointer::object(cache, "cache") }?;
        // SAFETY: this module's contract.
        let (out, struct_size) = unsafe { pointer::sized_out(info, "info") }?;
        let Storage { bvh, origin, .. } = &cache.storage;
        let corner = |c: Option<glam::Vec3>| c.map_or(DVec3::ZERO, |c| c.as_dvec3() + origin).to_array();
        out.write(HrrCacheInfo {
            struct_size,
            levels: bvh.root().map_or(0, |root| root.level + 1),
            vertex_count: bvh.len() as u64,
            dropped_count: cache.dropped,
            bytes: cache.storage.bytes(),
            origin: origin.to_array(),
            bounds_min: corner(bvh.bounds().map(|b| b.min)),
            bounds_max: corner(bvh.bounds().map(|b| b.max)),
            build_seconds: cache.build_seconds,
        });
        Ok(())
    })
}

/// A fingerprint of what queries can see: positions, ids and masks in tree order. Equal builds have equal ones, on
/// every machine. Reads the whole cache. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_hash(cache: *const HrrCache, out_hash: *mut u64) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (cache, out) = unsafe { (pointer::object(cache, "cache")?, Out::new(out_hash, "out_hash")?) };
        out.write(cache.fingerprint());
        Ok(())
    })
}

/// Checks a cache: every vertex once, every box around what is below it, every mask the union of those below. For memory
/// that something else has written to. Reads the whole cache, in some 20 ns for each vertex. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INTERNAL (the message says what is wrong).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_validate(cache: *const HrrCache) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let cache = unsafe { pointer::object(cache, "cache") }?;
        cache.storage.bvh.validate()?;
        let (ids, vertices) = (cache.storage.ids.len(), cache.storage.bvh.len());
        if ids != 0 && ids != vertices {
            return Err(Failure::new(HRR_ERROR_INTERNAL, format!("{ids} ids for {vertices} light vertices")));
        }
        Ok(())
    })
}

/// Writes a cache's light vertices to a file (path in UTF-8), whole or not at all; what was there is replaced. About 20
/// bytes for each vertex, the same on every machine. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_IO.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_save(cache: *const HrrCache, path: *const c_char) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (cache, path) = unsafe { (pointer::object(cache, "cache")?, pointer::text(path, "path")?) };
        Ok(file::replace(Path::new(path), &contents::write(cache))?)
    })
}

/// Makes the cache that hrr_cache_save wrote: the same hits for the same queries. The file is not trusted: one that is
/// damaged is refused. The tree is built anew. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_IO, HRR_ERROR_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_load(
    context: *const HrrContext,
    path: *const c_char,
    out_cache: *mut *mut HrrCache,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, path, out) = unsafe {
            let out = Out::new(out_cache, "out_cache")?;
            (pointer::object(context, "context")?, pointer::text(path, "path")?, out)
        };
        let io = |what: &dyn std::fmt::Display| Failure::new(HRR_ERROR_IO, format!("{path}: {what}"));
        let bytes = std::fs::read(path).map_err(|e| io(&e))?;
        let cache = contents::read(context, &bytes)
            .map_err(|f| if f.status == HRR_ERROR_OUT_OF_MEMORY { f } else { io(&f.message) })?;
        out.write(pointer::handle(cache));
        Ok(())
    })
}

/// The offset (light - eye) by which queries at `eye` judge a light vertex at `light`: the light's position rounded as
/// this cache stores it. What hrr_probability makes of it is, to the last bit, what such a query would divide by; for
/// the weights of edges that no query was made for. light, eye, out_offset: 3 numbers each. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_cache_offset(
    cache: *const HrrCache,
    light: *const f64,
    eye: *const f64,
    out_offset: *mut f64,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let cache = pointer::object(cache, "cache")?;
            let (light, eye) = (pointer::vector(light, "light")?, pointer::vector(eye, "eye")?);
            let out = Out::new(out_offset.cast::<[f64; 3]>(), "out_offset")?;
            let stored = cache.relative(light).as_vec3();
            if !stored.is_finite() {
                return Err(Failure::non_finite(format!("light is {light}: beyond single precision")));
            }
            out.write((stored.as_dvec3() - cache.relative(eye)).to_array());
        }
        Ok(())
    })
}
