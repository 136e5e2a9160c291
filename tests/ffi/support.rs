//! Hosts' side of the interface.

use hrr::ffi::*;
use std::ffi::{CStr, c_void};
use std::path::Path;
use std::process::Command;
use std::{mem, ptr};

/// The project's directory.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a program, which must succeed, and gives what it wrote.
pub fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{text}{errors}", output.status);
    text
}

/// Whether a program is installed; says so when it is not.
pub fn there(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok();
    if !there {
        eprintln!("skipped: there is no {program}");
    }
    there
}

/// A size, or the one that Miri gets through, which is some thousand times slower.
pub fn size<T>(full: T, under_miri: T) -> T {
    if cfg!(miri) { under_miri } else { full }
}

/// A struct as hosts make it: zeroed, with its size where it has one.
pub fn zeroed<T: Copy>() -> T {
    // SAFETY: used for the interface's plain structs of integers, floats and nullable pointers.
    unsafe { mem::zeroed() }
}

pub fn last_error() -> String {
    // SAFETY: the text is this thread's and copied at once.
    unsafe { CStr::from_ptr(hrr_last_error()) }.to_str().unwrap().to_owned()
}

/// A context that is released in the end.
pub struct Context(pub *mut HrrContext);

impl Context {
    pub fn new(threads: u32) -> Self {
        Self::with(|desc| desc.threads = threads)
    }

    pub fn with(set: impl FnOnce(&mut HrrContextDesc)) -> Self {
        let mut desc: HrrContextDesc = zeroed();
        desc.struct_size = size_of::<HrrContextDesc>() as u32;
        set(&mut desc);
        let mut context = ptr::null_mut();
        // SAFETY: all pointers are to locals.
        assert_eq!(unsafe { hrr_context_new(&desc, &mut context) }, HRR_OK, "{}", last_error());
        Self(context)
    }

    /// A cache of packed floats with ids from 0.
    pub fn floats(&self, points: &[[f32; 3]]) -> Cache {
        let segment = floats(points);
        self.build(&build_desc(&[segment])).unwrap()
    }

    pub fn build(&self, desc: &HrrBuildDesc) -> Result<Cache, HrrStatus> {
        let mut cache = ptr::null_mut();
        // SAFETY: the description's arrays are the caller's.
        match unsafe { hrr_cache_build(self.0, desc, &mut cache) } {
            HRR_OK => Ok(Cache(cache)),
            status => {
                assert!(cache.is_null());
                Err(status)
            }
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: the one reference.
        unsafe { hrr_context_release(self.0) };
    }
}

/// A cache that is released in the end.
#[derive(Debug)]
pub struct Cache(pub *mut HrrCache);

// SAFETY: caches may be used from any thread.
unsafe impl Send for Cache {}
// SAFETY: as above.
unsafe impl Sync for Cache {}
// SAFETY: contexts may be used from any thread.
unsafe impl Sync for Context {}

impl Drop for Cache {
    fn drop(&mut self) {
        // SAFETY: the one reference.
        unsafe { hrr_cache_release(self.0) };
    }
}

impl Cache {
    pub fn info(&self) -> HrrCacheInfo {
        let mut info: HrrCacheInfo = zeroed();
        info.struct_size = size_of::<HrrCacheInfo>() as u32;
        // SAFETY: both are live.
        assert_eq!(unsafe { hrr_cache_info(self.0, &mut info) }, HRR_OK);
        info
    }

    pub fn hash(&self) -> u64 {
        let mut hash = 0;
        // SAFETY: both are live.
        assert_eq!(unsafe { hrr_cache_hash(self.0, &mut hash) }, HRR_OK);
        hash
    }

    pub fn hits(&self, query: &HrrQuery, options: Option<&HrrQueryOptions>) -> Vec<HrrHit> {
        let mut hits = vec![HrrHit { id: 0, probability: 0.0 }; size(100_000, 1000)];
        let mut count = 0;
        let options = options.map_or(ptr::null(), ptr::from_ref);
        let (at, room) = (hits.as_mut_ptr(), hits.len() as u64);
        // SAFETY: all pointers are to locals of the sizes given.
        let status = unsafe { hrr_query(self.0, query, options, at, room, &mut count, ptr::null_mut()) };
        assert_eq!(status, HRR_OK, "{}", last_error());
        hits.truncate(count as usize);
        hits
    }

    pub fn batch(&self, context: &Context, queries: &[HrrQuery]) -> (Vec<HrrHit>, Vec<u64>) {
        let (n, mut offsets) = (queries.len() as u64, vec![0; queries.len() + 1]);
        let none = (ptr::null(), ptr::null_mut());
        let call = |hits: *mut HrrHit, capacity, offsets: &mut Vec<u64>| {
            let at = offsets.as_mut_ptr();
            // SAFETY: all pointers are to locals of the sizes given.
            unsafe {
                hrr_query_batch(context.0, self.0, queries.as_ptr(), 0, n, none.0, hits, capacity, at, none.1)
            }
        };
        let status = call(ptr::null_mut(), 0, &mut offsets);
        let total = offsets[queries.len()];
        assert_eq!(status, if total > 0 { HRR_ERROR_BUFFER_TOO_SMALL } else { HRR_OK }, "{}", last_error());
        let mut hits = vec![HrrHit { id: 0, probability: 0.0 }; total as usize];
        assert_eq!(call(hits.as_mut_ptr(), total, &mut offsets), HRR_OK, "{}", last_error());
        (hits, offsets)
    }
}

pub fn floats(points: &[[f32; 3]]) -> HrrSegment {
    let mut segment: HrrSegment = zeroed();
    segment.position = points.as_ptr().cast::<c_void>();
    segment.count = points.len() as u64;
    segment
}

pub fn build_desc(segments: &[HrrSegment]) -> HrrBuildDesc {
    let mut desc: HrrBuildDesc = zeroed();
    desc.struct_size = size_of::<HrrBuildDesc>() as u32;
    desc.segments = segments.as_ptr();
    desc.segment_count = segments.len() as u32;
    desc
}

pub fn options(rule: u32, brute_force: bool) -> HrrQueryOptions {
    let struct_size = size_of::<HrrQueryOptions>() as u32;
    HrrQueryOptions { struct_size, rule, brute_force: brute_force.into(), reserved: 0 }
}

pub fn query(position: [f64; 3], lobes: &[HrrLobe], constant: f64, key: u64) -> HrrQuery {
    let (lobe_count, lobes) = (lobes.len() as u32, lobes.as_ptr());
    HrrQuery { position, lobes, lobe_count, mask: u32::MAX, constant, key }
}

pub fn sphere(weight: f64) -> HrrLobe {
    let mut lobe: HrrLobe = zeroed();
    // SAFETY: a local.
    assert_eq!(unsafe { hrr_lobe_sphere(weight, &mut lobe) }, HRR_OK);
    lobe
}
