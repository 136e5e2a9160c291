//! Raw bindings to Intel Embree 4, generated from the installed headers. See Embree's manual for what each item does.
//!
//! `RTC_VERSION` is the version of the *headers*. `RTCHit` has grown between versions, so a library older than the
//! headers, or built against newer ones in an incompatible way, must not be used: compare with the loaded library's
//! `RTC_DEVICE_PROPERTY_VERSION` before the first query.

#![allow(non_camel_case_types, non_snake_case, non_upper_case_globals, missing_docs, clippy::all)]

include!(concat!(env!("OUT_DIR"), "/bindings.rs"));

/// The geometry number of a query that hit nothing (a macro with a cast, which bindgen leaves out).
pub const RTC_INVALID_GEOMETRY_ID: u32 = u32::MAX;

/// What queries rely on. A header that is too old or a layout that bindgen got wrong stops the build here.
const _: () = {
    assert!(
        RTC_VERSION >= 40300 && RTC_VERSION < 50000,
        "Embree's headers must be of version 4.3 or a later 4"
    );
    assert!(size_of::<RTCRay>() == 48 && align_of::<RTCRay>() == 16);
    let levels = RTC_MAX_INSTANCE_LEVEL_COUNT as usize;
    // Ng, u, v, primID, geomID, instID[levels] and, where instance arrays are on, instPrimID[levels].
    let without_arrays = (28 + 4 * levels).next_multiple_of(16);
    let with_arrays = (28 + 8 * levels).next_multiple_of(16);
    assert!(size_of::<RTCHit>() == without_arrays || size_of::<RTCHit>() == with_arrays);
    assert!(align_of::<RTCHit>() == 16);
    assert!(size_of::<RTCRayHit>() == size_of::<RTCRay>() + size_of::<RTCHit>());
    assert!(std::mem::offset_of!(RTCRay, tfar) == 32);
    assert!(std::mem::offset_of!(RTCHit, instID) == 28);
    assert!(std::mem::offset_of!(RTCRayHit, hit) == 48);
};
