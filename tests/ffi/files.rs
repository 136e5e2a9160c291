//! Caches and captures in files: the same when read again, refused when damaged.

use super::support::*;
use hrr::ffi::*;
use std::ffi::CString;
use std::fs;
use std::path::Path;
use std::ptr::null_mut;

fn text(path: &Path) -> CString {
    CString::new(path.to_str().unwrap()).unwrap()
}

fn points(n: u32) -> Vec<[f32; 3]> {
    (0..n).map(|i| [(i * 31 % 997) as f32 * 1e-3, (i * 17 % 499) as f32 * 2e-3, 1.0]).collect()
}

fn load(context: &Context, path: &Path) -> Result<Cache, HrrStatus> {
    let mut cache = null_mut();
    // SAFETY: a text, and a local.
    match unsafe { hrr_cache_load(context.0, text(path).as_ptr(), &mut cache) } {
        HRR_OK => Ok(Cache(cache)),
        status => {
            assert!(cache.is_null());
            Err(status)
        }
    }
}

/// A cache with all there is: doubles, masks, ids.
fn rich(context: &Context, n: u32) -> Cache {
    let positions: Vec<[f64; 3]> =
        points(n).iter().map(|p| p.map(|x| 1e6 + f64::from(x) * std::f64::consts::PI)).collect();
    let masks: Vec<u32> = (0..n).map(|i| 1 << (i % 3)).collect();
    let ids: Vec<u64> = (0..n).map(|i| u64::from(i) << 33 | 5).collect();
    let mut segment = floats(&[]);
    (segment.position, segment.count) = (positions.as_ptr().cast(), n.into());
    (segment.mask, segment.id) = (masks.as_ptr(), ids.as_ptr());
    let segments = [segment];
    let desc = HrrBuildDesc { position_format: HRR_DOUBLE3, ..build_desc(&segments) };
    context.build(&desc).unwrap()
}

#[test]
fn saved_caches_are_loaded_as_they_were() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a cäche");
    let (one, other) = (Context::new(1), Context::new(2));
    for cache in [rich(&one, size(5000, 60)), one.floats(&points(size(777, 20))), one.floats(&[])] {
        // SAFETY: live, and a text.
        assert_eq!(unsafe { hrr_cache_save(cache.0, text(&path).as_ptr()) }, HRR_OK, "{}", last_error());
        let loaded = load(&other, &path).unwrap();
        let (a, b) = (cache.info(), loaded.info());
        assert_eq!(loaded.hash(), cache.hash());
        assert_eq!((a.vertex_count, a.origin, a.bounds_max), (b.vertex_count, b.origin, b.bounds_max));
        // SAFETY: live.
        assert_eq!(unsafe { hrr_cache_validate(loaded.0) }, HRR_OK);
        let lobe = [sphere(1.0)];
        let p = a.bounds_min.map(|x| x + 0.1);
        let mut found = 0;
        for (key, mask) in [(1, u32::MAX), (2, 2), (3, 5)] {
            let ask = HrrQuery { mask, ..query(p, &lobe, 1e-2, key) };
            assert_eq!(loaded.hits(&ask, None), cache.hits(&ask, None));
            found += cache.hits(&ask, None).len();
        }
        assert!(found > size(10, 1) || a.vertex_count == 0, "{found}");
    }
}

#[test]
fn damaged_files_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cache");
    let context = Context::new(1);
    let cache = rich(&context, size(60, 3));
    // SAFETY: live, and a text.
    assert_eq!(unsafe { hrr_cache_save(cache.0, text(&path).as_ptr()) }, HRR_OK);
    let good = fs::read(&path).unwrap();
    let mut refused = 0;
    let places = (0..good.len()).step_by(size(1, 25));
    for at in places.clone() {
        for flip in [1u8, 0x80] {
            let mut bad = good.clone();
            bad[at] ^= flip;
            fs::write(&path, &bad).unwrap();
            match load(&context, &path) {
                // The count of dropped vertices is not among what queries see.
                Ok(cache) => assert!((24..32).contains(&at) && cache.info().dropped_count > 0, "byte {at}"),
                Err(status) => {
                    assert_eq!(status, HRR_ERROR_IO, "byte {at}: {}", last_error());
                    assert!(last_error().contains("damaged"), "{}", last_error());
                    refused += 1;
                }
            }
        }
    }
    assert_eq!(refused, 2 * places.filter(|at| !(24..32).contains(at)).count());
    for length in [0, 7, 8, 40, good.len() - 1] {
        fs::write(&path, &good[..length]).unwrap();
        assert_eq!(load(&context, &path).unwrap_err(), HRR_ERROR_IO);
    }
    let longer = [&good[..], &[0; 24]].concat();
    fs::write(&path, longer).unwrap();
    assert_eq!(load(&context, &path).unwrap_err(), HRR_ERROR_IO);
    assert_eq!(load(&context, &directory.path().join("none")).unwrap_err(), HRR_ERROR_IO);
    let nowhere = text(&directory.path().join("none/there"));
    // SAFETY: live, and a text.
    assert_eq!(unsafe { hrr_cache_save(cache.0, nowhere.as_ptr()) }, HRR_ERROR_IO);
    let not_text = c"\xff".as_ptr();
    // SAFETY: as above.
    assert_eq!(unsafe { hrr_cache_save(cache.0, not_text) }, HRR_ERROR_INVALID_ARGUMENT);
}

fn capture() -> HrrCapture {
    HrrCapture { struct_size: size_of::<HrrCapture>() as u32, ..HrrCapture::default() }
}

fn end(context: &Context) -> Result<HrrCapture, HrrStatus> {
    let mut counts = capture();
    // SAFETY: locals.
    let status = unsafe { hrr_capture_end(context.0, &mut counts) };
    if status == HRR_OK { Ok(counts) } else { Err(status) }
}

fn begin(context: &Context, path: &Path, max_bytes: u64) -> HrrStatus {
    // SAFETY: live, and a text.
    unsafe { hrr_capture_begin(context.0, text(path).as_ptr(), max_bytes) }
}

fn replay(context: &Context, path: &Path) -> Result<HrrCapture, HrrStatus> {
    let mut counts = capture();
    // SAFETY: locals and a text.
    let status = unsafe { hrr_capture_replay(context.0, text(path).as_ptr(), &mut counts) };
    if status == HRR_OK { Ok(counts) } else { Err(status) }
}

#[test]
fn captures_hold_what_was_asked_and_found() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("capture");
    let (context, other) = (Context::new(2), Context::new(1));
    let (first, second) = (rich(&context, size(3000, 40)), context.floats(&points(size(2000, 30))));
    let foreign = other.floats(&points(10));
    let lobes = [sphere(1.0), HrrLobe { alpha_x: 0.01, alpha_y: 0.1, ..sphere(3.0) }];
    let near = |cache: &Cache, key| query(cache.info().bounds_min.map(|x| x + 0.01), &lobes, 1e-2, key);
    let ask_all = || {
        let mut found = 0;
        for key in 0..size(20, 1) {
            found += first.hits(&HrrQuery { mask: 3, ..near(&first, key) }, None).len();
            for (rule, brute) in [(0, true), (1, false), (2, false)] {
                found += second.hits(&near(&second, key), Some(&options(rule, brute))).len();
            }
        }
        let queries: Vec<_> = (0..size(30, 2)).map(|key| near(&second, key)).collect();
        second.batch(&context, &queries);
        // Of another context: not captured.
        foreign.hits(&near(&foreign, 1), None);
        found
    };
    let found = ask_all();
    assert_eq!(end(&context).unwrap_err(), HRR_ERROR_INVALID_STATE);
    assert_eq!(begin(&context, &path, 0), HRR_OK, "{}", last_error());
    assert_eq!(begin(&context, &path, 0), HRR_ERROR_INVALID_STATE);
    assert_eq!(ask_all(), found);
    let written = end(&context).unwrap();
    // A batch for its size, and one into the buffer.
    assert_eq!((written.caches, written.queries, written.left_out), (2, size(20 * 4 + 2 * 30, 4 + 2 * 2), 0));
    assert_eq!(written.bytes, fs::metadata(&path).unwrap().len());
    ask_all();
    assert_eq!(written.bytes, fs::metadata(&path).unwrap().len());
    let made = replay(&other, &path).unwrap();
    assert_eq!((made.caches, made.queries, made.differences), (2, written.queries, 0));
    assert!(found > size(500, 5), "{found}");

    // Another number of hits in the file is a difference, another anything in the cache is damage.
    let good = fs::read(&path).unwrap();
    let cache_end = 8 + 12 + u64::from_le_bytes(good[12..20].try_into().unwrap()) as usize;
    let mut bad = good.clone();
    bad[cache_end + 8 + 24] ^= 1;
    fs::write(&path, &bad).unwrap();
    assert_eq!(replay(&other, &path).unwrap().differences, 1);
    for at in (0..cache_end).step_by(size(97, 400)).chain([8, 12, cache_end, cache_end + 4]) {
        let mut bad = good.clone();
        bad[at] ^= 0x40;
        fs::write(&path, &bad).unwrap();
        let status = replay(&other, &path);
        assert!(status.is_err() || (20 + 24..20 + 32).contains(&at), "byte {at}");
    }
    for length in [0, 7, 30, cache_end + 3, cache_end + 40, good.len() - 1] {
        fs::write(&path, &good[..length]).unwrap();
        assert_eq!(replay(&other, &path).unwrap_err(), HRR_ERROR_IO, "{length}");
    }

    // With room for the first cache only.
    let room = cache_end as u64 + 2000;
    assert_eq!(begin(&context, &path, room), HRR_OK);
    ask_all();
    let short = end(&context).unwrap();
    assert!(short.left_out > size(60, 0) && short.queries >= size(3, 1) && short.bytes <= room, "{short:?}");
    assert_eq!(replay(&other, &path).unwrap().queries, short.queries);
    assert_eq!(begin(&context, directory.path(), 0), HRR_ERROR_IO);
    assert_eq!(end(&context).unwrap_err(), HRR_ERROR_INVALID_STATE);
}
