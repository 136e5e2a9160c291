//! Caches: light vertices in a tree. Made by a build, and immutable from then on.

use super::context::{HrrContext, Spare};
use super::pointer::{self, Out, Strided};
use super::segment::{Gathered, HRR_DOUBLE3, HRR_FLOAT3, HrrSegment, Rules};
use super::status::{Failure, HRR_ERROR_OUT_OF_MEMORY, HrrStatus, Outcome, guard};
use crate::vertex_bvh::VertexBvh;
use glam::DVec3;
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
}

/// Light vertices in a tree. Immutable: any number of threads may query it at once. Opaque; see hrr_cache_build.
#[derive(Debug)]
pub struct HrrCache {
    pub(super) storage: Storage,
    dropped: u64,
    build_seconds: f64,
    spare: Weak<Spare>,
}

/// A cache's buffers.
#[derive(Debug, Default)]
pub(super) struct Storage {
    pub bvh: VertexBvh,
    pub ids: Vec<u64>,
    pub origin: DVec3,
}

impl HrrCache {
    unsafe fn build(context: &HrrContext, desc: &HrrBuildDesc) -> Outcome<Self> {
        let start = Instant::now();
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
        if desc.max_bytes > 0 {
            // SAFETY: below the count.
            let segment = |i| unsafe { segments.get(i) };
            let total = (0..count).fold(0u64, |sum, i| sum.saturating_add(segment(i).count));
            let needed = estimate(total, (0..count).any(|i| !segment(i).mask.is_null()));
            if needed > desc.max_bytes {
                let message =
                    format!("{total} light vertices take {needed} bytes, {} allowed", desc.max_bytes);
                return Err(Failure::new(HRR_ERROR_OUT_OF_MEMORY, message));
            }
        }
        let (mut storage, mut gathered) = context.spare.take();
        let mut build = || -> Outcome {
            // SAFETY: `count` segments, as above.
            unsafe { gathered.fill(segments, count, rules) }?;
            let Gathered { positions, masks, ids, .. } = &mut gathered;
            let masks = (!masks.is_empty()).then_some(&masks[..]);
            storage.bvh.build_masked(positions, masks)?;
            std::mem::swap(&mut storage.ids, ids);
            Ok(())
        };
        context.pool.install(&mut build)?;
        storage.origin = gathered.origin;
        let dropped = gathered.dropped;
        context.spare.give_gathered(gathered);
        let (build_seconds, spare) = (start.elapsed().as_secs_f64(), Arc::downgrade(&context.spare));
        Ok(Self { storage, dropped, build_seconds, spare })
    }

    /// What becomes of a position in the cache's coordinates.
    pub(super) fn relative(&self, position: DVec3) -> DVec3 {
        position - self.storage.origin
    }
}

impl Drop for HrrCache {
    fn drop(&mut self) {
        if let Some(spare) = self.spare.upgrade() {
            spare.give_storage(std::mem::take(&mut self.storage));
        }
    }
}

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
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_OUT_OF_MEMORY, HRR_ERROR_ABI; *out_cache is
/// then as it was.
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
        let out = unsafe { Out::new(info, "info") }?;
        // SAFETY: this module's contract; not NULL.
        let struct_size = unsafe { pointer::struct_size(info, "info") }? as u32;
        let Storage { bvh, ids, origin } = &cache.storage;
        let corner = |c: Option<glam::Vec3>| c.map_or(DVec3::ZERO, |c| c.as_dvec3() + origin).to_array();
        out.write(HrrCacheInfo {
            struct_size,
            levels: bvh.root().map_or(0, |root| root.level + 1),
            vertex_count: bvh.len() as u64,
            dropped_count: cache.dropped,
            bytes: (bvh.bytes() + bvh.build_bytes() + size_of_val(&ids[..])) as u64,
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
        let Storage { bvh, ids, origin } = &cache.storage;
        let mut hash = Xxh3::new();
        origin.to_array().iter().for_each(|x| hash.update(&x.to_bits().to_le_bytes()));
        for (i, block) in bvh.blocks().iter().enumerate() {
            let node = crate::vertex_bvh::NodeId { level: 0, index: i as u32 };
            for lane in 0..bvh.children(node) {
                for axis in block.position {
                    hash.update(&axis[lane].to_bits().to_le_bytes());
                }
                hash.update(&ids[block.index[lane] as usize].to_le_bytes());
                hash.update(&bvh.masks(node).map_or(u32::MAX, |masks| masks[lane]).to_le_bytes());
            }
        }
        out.write(hash.digest());
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
