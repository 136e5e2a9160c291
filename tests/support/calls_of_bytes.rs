//! Bytes to a sequence of calls of the C interface, and what must hold whatever they say. The fuzzer and the test suite
//! share it. Pointers are good ones, as the interface asks; all else may be anything.

#![allow(unsafe_code)]

use super::bytes::Bytes;
use hrr::ffi::*;
use std::ffi::{CStr, c_void};
use std::{mem, ptr};

impl Bytes<'_> {
    /// Mostly the first of a field's values; now and then any of all.
    fn mostly(&mut self, usual: u32) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(self.take()),
            254 => u32::from(self.byte()),
            _ => usual,
        }
    }

    /// Mostly a number below a limit, now and then any.
    fn mostly_below(&mut self, limit: u32) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(self.take()),
            254 => u32::from(self.byte()),
            byte => u32::from(byte) % limit,
        }
    }

    /// A number of everyday size, seldom any bits at all.
    fn number(&mut self) -> f64 {
        if self.byte() > 250 { f64::from_le_bytes(self.take()) } else { f64::from(self.byte()) / 64.0 - 2.0 }
    }

    fn three(&mut self) -> [f64; 3] {
        [self.number(), self.number(), self.number()]
    }
}

fn zeroed<T: Copy>() -> T {
    // SAFETY: used for the interface's plain structs of integers, floats and nullable pointers.
    unsafe { mem::zeroed() }
}

/// No call may end in these; those that fail say why.
fn sane(status: HrrStatus) -> HrrStatus {
    if status != HRR_OK {
        // SAFETY: this thread's text, copied at once.
        let text = unsafe { CStr::from_ptr(hrr_last_error()) }.to_string_lossy().into_owned();
        assert!(!text.is_empty() && status != HRR_ERROR_PANIC && status != HRR_ERROR_INTERNAL, "{text}");
    }
    status
}

/// What a host holds. Released in the end.
struct Host {
    context: *mut HrrContext,
    caches: [*mut HrrCache; 3],
    geometry: *mut HrrGeometry,
    lobes: Vec<HrrLobe>,
    found: usize,
}

/// Most vertices of a cache.
const MOST: usize = 64;

/// Calls what the bytes say. Panics if anything is amiss; says how many light vertices were accepted.
pub fn check(bytes: &[u8]) -> usize {
    let mut bytes = Bytes(bytes);
    let mut desc: HrrContextDesc = zeroed();
    (desc.struct_size, desc.threads) = (size_of::<HrrContextDesc>() as u32, 1);
    let mut context = ptr::null_mut();
    // SAFETY: locals.
    assert_eq!(sane(unsafe { hrr_context_new(&desc, &mut context) }), HRR_OK);
    let mut host =
        Host { context, caches: [ptr::null_mut(); 3], geometry: ptr::null_mut(), lobes: vec![], found: 0 };
    let mut calls = 0;
    while !bytes.0.is_empty() && calls < 200 {
        calls += 1;
        let slot = usize::from(bytes.byte() % 3);
        match bytes.byte() % 8 {
            0 | 1 => host.build(slot, &mut bytes),
            2 => host.lobe(&mut bytes),
            3 | 4 => host.query(slot, &mut bytes),
            5 => host.look(slot, &mut bytes),
            6 => host.rays(&mut bytes),
            _ => host.release(slot, &mut bytes),
        }
    }
    // SAFETY: each handle's one reference; NULL is fine.
    unsafe {
        host.caches.iter().for_each(|&cache| hrr_cache_release(cache));
        hrr_geometry_release(host.geometry);
        hrr_context_release(host.context);
    }
    host.found
}

impl Host {
    fn build(&mut self, slot: usize, bytes: &mut Bytes<'_>) {
        let mut memory = [0u8; MOST * 40];
        let count = usize::from(bytes.byte()) % (MOST + 1);
        let format = bytes.mostly(0);
        let (size, stride) =
            (if format == HRR_DOUBLE3 { 24 } else { 12 }, 24 + usize::from(bytes.byte() % 16));
        for i in 0..count {
            let p = bytes.three();
            let at = &mut memory[i * stride..];
            for axis in 0..3 {
                if size == 24 {
                    at[axis * 8..][..8].copy_from_slice(&p[axis].to_le_bytes());
                } else {
                    at[axis * 4..][..4].copy_from_slice(&(p[axis] as f32).to_le_bytes());
                }
            }
        }
        let mut segments: [HrrSegment; 2] = zeroed();
        let half = count / 2;
        for (segment, first, n) in [(0, 0, half), (1, half, count - half)] {
            let segment = &mut segments[segment];
            segment.position = memory[first * stride..].as_ptr().cast();
            // A stride that is too small is refused; one that is not given means packed, which is inside, too.
            segment.position_stride =
                if bytes.byte() > 250 { usize::from(bytes.byte() % 24) } else { stride };
            (segment.count, segment.first_id) = (n as u64, first as u64);
            if bytes.byte() > 200 {
                (segment.mask, segment.mask_stride) = (segment.position.cast(), stride);
            }
            if bytes.byte() > 230 {
                (segment.id, segment.id_stride) = (segment.position.cast(), stride);
            }
        }
        let mut desc: HrrBuildDesc = zeroed();
        desc.struct_size =
            bytes.mostly(size_of::<HrrBuildDesc>() as u32).min(size_of::<HrrBuildDesc>() as u32);
        (desc.position_format, desc.segments, desc.segment_count) = (format, segments.as_ptr(), 2);
        (desc.invalid, desc.order) = (bytes.mostly_below(2), bytes.mostly(0));
        desc.reserved = bytes.mostly(0);
        desc.max_bytes = if bytes.byte() > 250 { bytes.byte().into() } else { 0 };
        let mut cache = ptr::null_mut();
        // SAFETY: the arrays are as long as they are said to be, or the call is refused before it reads them.
        if sane(unsafe { hrr_cache_build(self.context, &desc, &mut cache) }) == HRR_OK {
            // SAFETY: the slot's one reference.
            unsafe { hrr_cache_release(self.caches[slot]) };
            self.caches[slot] = cache;
        } else {
            assert!(cache.is_null());
        }
    }

    fn lobe(&mut self, bytes: &mut Bytes<'_>) {
        let mut lobe: HrrLobe = zeroed();
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if divides(length) { v.map(|x| x / length) } else { v }
        };
        let (n, t, wo) = (unit(bytes.three()), bytes.three(), unit(bytes.three()));
        let alpha = |bytes: &mut Bytes<'_>| {
            if bytes.byte() > 250 {
                bytes.number()
            } else {
                10f64.powf(-6.0 * f64::from(bytes.byte()) / 255.0)
            }
        };
        let (ax, ay, size) = (alpha(bytes), alpha(bytes), alpha(bytes));
        let t = if bytes.byte() > 128 { t.as_ptr() } else { ptr::null() };
        // SAFETY: arrays of three, and a local.
        let status = unsafe {
            match bytes.byte() % 4 {
                0 => hrr_lobe_sphere(size, &mut lobe),
                1 => hrr_lobe_transmission(n.as_ptr(), t, wo.as_ptr(), ax, ay, 1.0 + size, size, &mut lobe),
                2 => {
                    lobe = HrrLobe { x: bytes.three(), y: n, z: wo, alpha_x: ax, alpha_y: ay, weight: size };
                    HRR_OK
                }
                _ => hrr_lobe_reflection(n.as_ptr(), t, wo.as_ptr(), ax, ay, size, &mut lobe),
            }
        };
        if sane(status) == HRR_OK {
            let mut k = -1.0;
            // SAFETY: locals.
            if sane(unsafe { hrr_lobe_eval(&lobe, wo.as_ptr(), &mut k) }) == HRR_OK {
                assert!((0.0..=1.0).contains(&k), "{k} {lobe:?} {wo:?}");
            }
            if self.lobes.len() == 10 {
                self.lobes.clear();
            }
            self.lobes.push(lobe);
        }
    }

    fn query(&mut self, slot: usize, bytes: &mut Bytes<'_>) {
        let mut options: HrrQueryOptions = zeroed();
        options.struct_size = size_of::<HrrQueryOptions>() as u32;
        (options.rule, options.reserved) = (bytes.mostly_below(3), bytes.mostly(0));
        let ask = HrrQuery {
            position: bytes.three(),
            lobes: self.lobes.as_ptr(),
            lobe_count: self.lobes.len() as u32,
            mask: if bytes.byte() > 200 { u32::from_le_bytes(bytes.take()) } else { u32::MAX },
            constant: if bytes.byte() > 240 { bytes.number() } else { f64::from(bytes.byte()) / 16.0 },
            key: bytes.byte().into(),
        };
        let cache = self.caches[slot];
        let none = HrrHit { id: 0, probability: 0.0 };
        let (mut hits, mut brute, mut count, mut brute_count) = ([none; MOST], [none; MOST], 0, 0);
        let capacity = if bytes.byte() > 200 { u64::from(bytes.byte() % 4) } else { MOST as u64 };
        let mut counters = HrrCounters::default();
        // SAFETY: arrays of the sizes given; the lobes live on.
        let status = unsafe {
            hrr_query(cache, &ask, &options, hits.as_mut_ptr(), capacity, &mut count, &mut counters)
        };
        match sane(status) {
            HRR_OK => assert!(count <= capacity),
            HRR_ERROR_BUFFER_TOO_SMALL => assert!(count > capacity),
            _ => return assert!(count == 0 && counters == HrrCounters::default()),
        }
        assert!(counters.accepted == count && count <= MOST as u64);
        let written = &hits[..count.min(capacity) as usize];
        assert!(written.iter().all(|hit| hit.probability > 0.0 && hit.probability <= 1.0), "{written:?}");
        options.brute_force = 1;
        // SAFETY: as above.
        let status = unsafe {
            let room = MOST as u64;
            hrr_query(cache, &ask, &options, brute.as_mut_ptr(), room, &mut brute_count, ptr::null_mut())
        };
        assert_eq!((status, brute_count), (HRR_OK, count), "{ask:?} {:?}", self.lobes);
        assert_eq!(&brute[..written.len()], written);
        options.brute_force = 0;
        let (mut visited, mut offsets, mut all) = (0u64, [9; 3], [none; 2 * MOST]);
        unsafe extern "C" fn visit(user: *mut c_void, _: *const HrrHit) -> i32 {
            // SAFETY: the count below.
            unsafe { *user.cast::<u64>() += 1 };
            0
        }
        // SAFETY: as above.
        unsafe {
            let user = (&raw mut visited).cast();
            let status = hrr_query_visit(cache, &ask, &options, Some(visit), user, ptr::null_mut());
            assert_eq!((status, visited), (HRR_OK, count));
            let (two, to, o) = ([ask; 2], all.as_mut_ptr(), offsets.as_mut_ptr());
            let (room, none) = (2 * MOST as u64, ptr::null_mut());
            let c = self.context;
            assert_eq!(hrr_query_batch(c, cache, two.as_ptr(), 0, 2, &options, to, room, o, none), HRR_OK);
        }
        assert_eq!(offsets, [0, count, 2 * count]);
        assert_eq!(&all[count as usize..][..written.len()], written);
        self.found += count as usize;
    }

    fn look(&mut self, slot: usize, bytes: &mut Bytes<'_>) {
        let cache = self.caches[slot];
        let (mut info, mut hash): (HrrCacheInfo, _) = (zeroed(), 0);
        info.struct_size = bytes.mostly(size_of::<HrrCacheInfo>() as u32);
        let (light, eye) = (bytes.three(), bytes.three());
        let (mut offset, mut p) = ([0.0; 3], -1.0);
        // SAFETY: locals; NULL is refused.
        unsafe {
            sane(hrr_cache_info(cache, &mut info));
            sane(hrr_cache_validate(cache));
            sane(hrr_cache_hash(cache, &mut hash));
            if sane(hrr_cache_offset(cache, light.as_ptr(), eye.as_ptr(), offset.as_mut_ptr())) == HRR_OK {
                let (lobes, n) = (self.lobes.as_ptr(), self.lobes.len() as u32);
                if sane(hrr_probability(lobes, n, bytes.number(), offset.as_ptr(), &mut p)) == HRR_OK {
                    assert!((0.0..=1.0).contains(&p), "{p}");
                }
            }
            sane(hrr_constant_for(bytes.number(), bytes.number(), info.vertex_count, &mut p));
        }
    }

    fn rays(&mut self, bytes: &mut Bytes<'_>) {
        let positions: Vec<f64> = (0..12).flat_map(|_| bytes.three()).collect();
        let indices: Vec<u32> = (0..12).map(|_| bytes.mostly_below(12)).collect();
        let meshes = [HrrMesh {
            position: positions.as_ptr().cast(),
            position_stride: 0,
            vertex_count: 12,
            index: indices.as_ptr(),
            index_stride: 0,
            triangle_count: 4,
        }];
        let mut desc: HrrGeometryDesc = zeroed();
        desc.struct_size = size_of::<HrrGeometryDesc>() as u32;
        (desc.meshes, desc.mesh_count) = (meshes.as_ptr(), 1);
        (desc.backend, desc.position_format) = (HRR_BACKEND_BRUTE, HRR_DOUBLE3);
        let mut geometry = ptr::null_mut();
        // SAFETY: arrays of the sizes given.
        if sane(unsafe { hrr_geometry_build(self.context, &desc, &mut geometry) }) == HRR_OK {
            // SAFETY: the one reference.
            unsafe { hrr_geometry_release(self.geometry) };
            self.geometry = geometry;
        }
        let t_max = if bytes.byte() > 128 { f64::INFINITY } else { bytes.number() };
        let ray = HrrRay { origin: bytes.three(), direction: bytes.three(), t_min: 0.0, t_max };
        let (mut hit, mut occluded) = (HrrRayHit { mesh: 7, triangle: 0, u: 0.0, v: 0.0, t: 0.0 }, 9u8);
        // SAFETY: locals; NULL is refused.
        unsafe {
            let status = sane(hrr_intersect(self.geometry, &ray, 0, 1, &mut hit));
            assert_eq!(sane(hrr_occluded(self.geometry, &ray, 0, 1, &mut occluded)), status);
            if status == HRR_OK {
                assert_eq!(occluded == 1, hit.mesh != HRR_NO_HIT);
                assert!(hit.mesh == HRR_NO_HIT || (hit.mesh == 0 && hit.triangle < 4));
            }
        }
    }

    fn release(&mut self, slot: usize, bytes: &mut Bytes<'_>) {
        // SAFETY: the slot's one reference, or one more and one less.
        unsafe {
            if bytes.byte() > 128 {
                hrr_cache_release(self.caches[slot]);
                self.caches[slot] = ptr::null_mut();
            } else {
                hrr_cache_retain(self.caches[slot]);
                hrr_cache_release(self.caches[slot]);
            }
            sane(hrr_context_trim(self.context));
        }
    }
}

/// Whether a length can be divided by.
fn divides(length: f64) -> bool {
    length > 1e-9 && length < 1e9
}
