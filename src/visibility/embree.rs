//! Intel Embree behind the [`Visibility`] trait.
//!
//! Embree's `f32` arithmetic finds candidates; whether one lies within the ray's interval is decided in `f64`
//! (`Triangles::meets`). So no ray is stopped by the surface that it leaves or ends at, however thin, distant or large
//! Embree's own rounding makes that surface.
//!
//! Embree takes numbers below 1e-18 for 0 and drops triangles beyond 1.8e18. So it is given meshes of size 1 and
//! directions of moderate length, by powers of two, which change no digit of any number.

// One of the crate's two doors to C.
#![allow(unsafe_code)]

use super::{Cutouts, Hit, Options, Ray, Visibility, cutouts};
use crate::error::{Error, Result};
use crate::geometry::Mesh;
use crate::settings::EmbreeBuild;
use embree4_sys as sys;
use glam::{Vec3, Vec4};
use std::ffi::{CString, c_void};
use std::sync::atomic::{AtomicI64, Ordering};
use std::{mem, ptr};

/// A committed Embree scene of one triangle mesh.
#[derive(Debug)]
pub struct Embree {
    /// Embree's coordinates per unit of the mesh's, a power of two, and the inverse.
    scale: f32,
    inverse_scale: f32,
    // Released before the triangles that it refers to.
    scene: Scene,
    triangles: Box<Triangles>,
    /// Bytes that Embree holds; it counts them itself, until its scene is released.
    bytes: Box<AtomicI64>,
}

/// What Embree reads, and what its answers are checked with.
#[derive(Debug)]
struct Triangles {
    /// One more than there are: Embree reads 16 bytes at a time.
    positions: Vec<Vec3>,
    corners: Vec<[u32; 3]>,
    cutouts: Option<Cutouts>,
}

/// What [`confirm`] is told of a query, behind what Embree itself wants to know.
#[repr(C)]
struct Context {
    base: sys::RTCRayQueryContext,
    /// Of the ray as it was asked, for [`Cutouts`].
    key: u64,
}

impl Context {
    fn new(ray: &Ray) -> Self {
        // SAFETY: all fields are numbers. All bits set is what `rtcInitRayQueryContext` makes of instance numbers: there
        // are no instances.
        let base = unsafe {
            let mut base = mem::MaybeUninit::<sys::RTCRayQueryContext>::uninit();
            base.as_mut_ptr().write_bytes(0xff, 1);
            base.assume_init()
        };
        Self { base, key: cutouts::key(ray) }
    }
}

impl Embree {
    /// Builds the acceleration structure. The mesh is copied.
    pub fn new(mesh: &Mesh, cutouts: Option<Cutouts>, options: Options) -> Result<Self> {
        mesh.validate()?;
        let scale =
            inverse_power(mesh.positions.iter().fold(0.0, |size: f32, p| size.max(p.abs().max_element())));
        let mut positions = Vec::with_capacity(mesh.positions.len() + 1);
        positions.extend(mesh.positions.iter().map(|&p| p * scale));
        positions.push(Vec3::ZERO);
        let triangles = Box::new(Triangles { positions, corners: mesh.triangles.clone(), cutouts });
        // Before the device, so that it outlives it on the way out of an error, too.
        let bytes = Box::new(AtomicI64::new(0));
        let device = Device::new(options.threads)?;
        let counter: *const AtomicI64 = &*bytes;
        // SAFETY: the device is live; the counter outlives it, since `Embree` drops it after the scene, which holds the
        // last reference to the device.
        unsafe {
            sys::rtcSetDeviceMemoryMonitorFunction(device.0, Some(count_bytes), counter.cast_mut().cast());
        }
        let scene = Scene::new(&device, options)?;
        if !triangles.corners.is_empty() {
            let geometry = Geometry::new(&device, &triangles)?;
            // SAFETY: geometry and scene are live and of the same device; the scene takes its own reference.
            unsafe { sys::rtcAttachGeometry(scene.0, geometry.0) };
            device.check("attaching the triangles")?;
        }
        // SAFETY: the scene is live and no other thread knows it.
        unsafe { sys::rtcCommitScene(scene.0) };
        // A failed commit leaves an empty scene behind and says so nowhere else.
        device.check("building the acceleration structure")?;
        Ok(Self { scale, inverse_scale: 1.0 / scale, scene, triangles, bytes })
    }

    /// A ray as Embree gets it, and what its distances are multiplied with to be the given one's.
    #[inline]
    fn scaled(&self, ray: &Ray) -> (RawRay, f32) {
        // Most directions are about unit and can stay as they are: nothing then waits for this to be found out.
        let size = ray.direction.abs().max_element();
        let length = if (1e-6..1e6).contains(&size) { 1.0 } else { inverse_power(size) };
        let (origin, direction) = (ray.origin * self.scale, ray.direction * length);
        let (to_embree, from_embree) = (self.scale / length, self.inverse_scale * length);
        let t_max = ray.t_max * to_embree;
        let raw = RawRay {
            origin: origin.extend(ray.t_min * to_embree),
            direction: direction.extend(0.0),
            t_max,
            mask: u32::MAX,
            // Embree overwrites `t_max` with candidates; `Triangles::meets` needs the limit that was asked for.
            id: t_max.to_bits(),
            flags: 0,
        };
        (raw, from_embree)
    }
}

/// Embree's `RTCRay`, with four numbers as one where Embree reads them as one: reading together what was written apart
/// makes the processor wait.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
struct RawRay {
    /// w: nearest distance.
    origin: Vec4,
    /// w: time.
    direction: Vec4,
    t_max: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// Embree's `RTCRayHit`.
#[repr(C)]
struct RawRayHit {
    ray: RawRay,
    hit: sys::RTCHit,
}

const _: () = {
    assert!(
        size_of::<RawRay>() == size_of::<sys::RTCRay>() && align_of::<RawRay>() >= align_of::<sys::RTCRay>()
    );
    assert!(mem::offset_of!(RawRay, direction) == mem::offset_of!(sys::RTCRay, dir_x));
    assert!(mem::offset_of!(RawRay, t_max) == mem::offset_of!(sys::RTCRay, tfar));
    assert!(mem::offset_of!(RawRay, id) == mem::offset_of!(sys::RTCRay, id));
    assert!(size_of::<RawRayHit>() == size_of::<sys::RTCRayHit>());
    assert!(mem::offset_of!(RawRayHit, hit) == mem::offset_of!(sys::RTCRayHit, hit));
};

/// The power of two that takes a positive number into [1,2); the largest for 0.
#[inline]
fn inverse_power(x: f32) -> f32 {
    let exponent = (x.to_bits() >> 23).clamp(1, 253);
    f32::from_bits((254 - exponent) << 23)
}

impl Visibility for Embree {
    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let (scaled, unit) = self.scaled(ray);
        // SAFETY: all fields are numbers.
        let mut query = RawRayHit { ray: scaled, hit: unsafe { mem::zeroed() } };
        query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
        // Embree is slower when it has to make default arguments itself.
        // SAFETY: all fields are numbers or nullable pointers; null means default.
        let mut arguments: sys::RTCIntersectArguments = unsafe { mem::zeroed() };
        arguments.flags = sys::RTC_RAY_QUERY_FLAG_INCOHERENT;
        arguments.feature_mask = sys::RTC_FEATURE_FLAG_ALL;
        let mut context = self.triangles.cutouts.is_some().then(|| Context::new(ray));
        if let Some(context) = &mut context {
            arguments.context = &raw mut context.base;
        }
        loop {
            // SAFETY: the scene is committed and never changed again, so any thread may ask; `query` and `arguments`
            // have the layout of the headers, which the library understands (`Device::new` compares versions).
            unsafe { sys::rtcIntersect1(self.scene.0, (&raw mut query).cast(), &mut arguments) };
            if query.hit.geomID == sys::RTC_INVALID_GEOMETRY_ID {
                return None;
            }
            let (triangle, t) = (query.hit.primID, query.ray.t_max);
            if self.triangles.meets(triangle, &scaled) {
                return Some(Hit { triangle, u: query.hit.u, v: query.hit.v, t: t * unit });
            }
            // On to what Embree has seen behind it.
            query.ray.origin.w = t.next_up();
            query.ray.t_max = scaled.t_max;
            query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
        }
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        let (mut query, _) = self.scaled(ray);
        // SAFETY: all fields are numbers or nullable pointers; null means default.
        let mut arguments: sys::RTCOccludedArguments = unsafe { mem::zeroed() };
        arguments.flags = sys::RTC_RAY_QUERY_FLAG_INCOHERENT;
        arguments.feature_mask = sys::RTC_FEATURE_FLAG_ALL;
        let mut context = self.triangles.cutouts.is_some().then(|| Context::new(ray));
        if let Some(context) = &mut context {
            arguments.context = &raw mut context.base;
        }
        // SAFETY: as in `intersect`.
        unsafe { sys::rtcOccluded1(self.scene.0, (&raw mut query).cast(), &mut arguments) };
        // A hit is told by a distance of -inf.
        query.t_max < 0.0
    }

    fn bytes(&self) -> Option<u64> {
        let own = size_of_val(&self.triangles.positions[..]) + size_of_val(&self.triangles.corners[..]);
        Some(self.bytes.load(Ordering::Relaxed).max(0) as u64 + own as u64)
    }
}

/// Embree's news that it takes memory, or gives some back.
///
/// # Safety
/// To be called by Embree only, for a device whose monitor was set with a live [`AtomicI64`].
unsafe extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _: bool) -> bool {
    // SAFETY: set by `Embree::new` to what outlives the device; only ever shared.
    let counter = unsafe { &*counter.cast_const().cast::<AtomicI64>() };
    counter.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

impl Triangles {
    /// Whether, seen in double precision, a ray crosses a triangle's plane within its interval. That it does so inside
    /// the triangle is left to Embree: its answers for neighbours fit together, with no gap along their edge.
    #[inline]
    fn meets(&self, triangle: u32, ray: &RawRay) -> bool {
        let [a, b, c] = self.corners[triangle as usize].map(|v| self.positions[v as usize].as_dvec3());
        let (origin, direction) = (ray.origin.truncate().as_dvec3(), ray.direction.truncate().as_dvec3());
        let normal = (b - a).cross(c - a);
        let (height, speed) = (normal.dot(a - origin), normal.dot(direction));
        // The distance is height / speed. Both are 0 for a triangle without area, which is not met.
        let height = height * 1f64.copysign(speed);
        let speed = speed.abs();
        let (t_min, t_max) = (f64::from(ray.origin.w), f64::from(f32::from_bits(ray.id)));
        t_min * speed < height && height < t_max * speed
    }
}

/// Embree's question whether an obstacle that it found counts: for shadow rays, and for all rays where there are
/// [`Cutouts`].
///
/// # Safety
/// To be called by Embree only, for a geometry whose user data is a live [`Triangles`]; where that has cutouts, the query's
/// context is a [`Context`].
unsafe extern "C" fn confirm(arguments: *const sys::RTCFilterFunctionNArguments) {
    // SAFETY: Embree passes a valid pointer for the time of the call.
    let arguments = unsafe { &*arguments };
    debug_assert_eq!(arguments.N, 1, "only single rays are asked for");
    // SAFETY: set by `Geometry::new` to what outlives the scene; only ever read.
    let triangles = unsafe { &*arguments.geometryUserPtr.cast::<Triangles>() };
    // SAFETY: for one ray the layouts are those of `RTCRay` and `RTCHit`; nothing is assumed of their alignment.
    let (ray, triangle, u, v) = unsafe {
        let hit = arguments.hit.cast::<sys::RTCHit>();
        (
            arguments.ray.cast::<RawRay>().read_unaligned(),
            ptr::addr_of!((*hit).primID).read_unaligned(),
            ptr::addr_of!((*hit).u).read_unaligned(),
            ptr::addr_of!((*hit).v).read_unaligned(),
        )
    };
    let counts = triangles.meets(triangle, &ray)
        && triangles.cutouts.as_ref().is_none_or(|cutouts| {
            // SAFETY: with cutouts, every query has a `Context` (`intersect`, `occluded`), alive during the query.
            let key = unsafe { (*arguments.context.cast::<Context>()).key };
            cutouts.stops(key, triangle, u.into(), v.into())
        });
    if !counts {
        // SAFETY: one flag for the one ray; 0 rejects.
        unsafe { *arguments.valid = 0 };
    }
}

/// An Embree device; scenes and geometries hold references of their own to it.
struct Device(sys::RTCDevice);

impl Device {
    fn new(threads: usize) -> Result<Self> {
        let config = CString::new(format!("threads={threads}")).expect("no zero byte inside");
        // SAFETY: `config` lives across the call.
        let device = Self(unsafe { sys::rtcNewDevice(config.as_ptr()) });
        if device.0.is_null() {
            // SAFETY: a null device asks for the error of the failed creation.
            let code = unsafe { sys::rtcGetDeviceError(ptr::null_mut()) };
            return Err(failure("starting", code));
        }
        // SAFETY: the device is live.
        let loaded = unsafe { sys::rtcGetDeviceProperty(device.0, sys::RTC_DEVICE_PROPERTY_VERSION) };
        check_version(loaded as i64)?;
        Ok(device)
    }

    /// The error of this thread's calls since the last check; Embree reports it nowhere else.
    fn check(&self, what: &str) -> Result<()> {
        // SAFETY: the device is live.
        match unsafe { sys::rtcGetDeviceError(self.0) } {
            sys::RTC_ERROR_NONE => Ok(()),
            code => Err(failure(what, code)),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if !self.0.is_null() {
            // SAFETY: the one reference that `rtcNewDevice` returned.
            unsafe { sys::rtcReleaseDevice(self.0) };
        }
    }
}

/// An Embree geometry.
struct Geometry(sys::RTCGeometry);

impl Geometry {
    /// The triangles, which must outlive every scene that the geometry is attached to.
    fn new(device: &Device, triangles: &Triangles) -> Result<Self> {
        // SAFETY: the device is live.
        let geometry = Self(unsafe { sys::rtcNewGeometry(device.0, sys::RTC_GEOMETRY_TYPE_TRIANGLE) });
        device.check("making a geometry")?;
        let share = |kind, format, data: *const c_void, count| {
            // SAFETY: the geometry is live; `data` holds `count` items of three 4-byte numbers, the vertices with the
            // padding that Embree asks for, and stays where it is (the caller's promise).
            unsafe { sys::rtcSetSharedGeometryBuffer(geometry.0, kind, 0, format, data, 0, 12, count) };
            device.check("sharing a buffer")
        };
        let (positions, corners) = (&triangles.positions, &triangles.corners);
        share(
            sys::RTC_BUFFER_TYPE_VERTEX,
            sys::RTC_FORMAT_FLOAT3,
            positions.as_ptr().cast(),
            positions.len() - 1,
        )?;
        share(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT3, corners.as_ptr().cast(), corners.len())?;
        // SAFETY: the geometry is live; `confirm` takes the user data for what it is.
        unsafe {
            sys::rtcSetGeometryUserData(geometry.0, ptr::from_ref(triangles).cast_mut().cast());
            sys::rtcSetGeometryOccludedFilterFunction(geometry.0, Some(confirm));
            if triangles.cutouts.is_some() {
                sys::rtcSetGeometryIntersectFilterFunction(geometry.0, Some(confirm));
            }
            sys::rtcCommitGeometry(geometry.0);
        }
        device.check("reading the triangles")?;
        Ok(geometry)
    }
}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: the one reference that `rtcNewGeometry` returned (null is refused by Embree with an error only).
        unsafe { sys::rtcReleaseGeometry(self.0) };
    }
}

/// An Embree scene.
#[derive(Debug)]
struct Scene(sys::RTCScene);

// SAFETY: a committed scene may be asked and released from any thread; nothing changes it after `Embree::new`.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Scene {
    fn new(device: &Device, options: Options) -> Result<Self> {
        // SAFETY: the device is live.
        let scene = Self(unsafe { sys::rtcNewScene(device.0) });
        device.check("making a scene")?;
        let flags = if options.embree_robust { sys::RTC_SCENE_FLAG_ROBUST } else { sys::RTC_SCENE_FLAG_NONE };
        // SAFETY: both are live. Robust: no ray slips between two triangles that share an edge.
        unsafe { sys::rtcSetSceneFlags(scene.0, flags) };
        let quality = match options.embree_build {
            EmbreeBuild::High => sys::RTC_BUILD_QUALITY_HIGH,
            EmbreeBuild::Medium => sys::RTC_BUILD_QUALITY_MEDIUM,
            EmbreeBuild::Low => sys::RTC_BUILD_QUALITY_LOW,
        };
        // SAFETY: as above.
        unsafe { sys::rtcSetSceneBuildQuality(scene.0, quality) };
        device.check("setting up the scene")?;
        Ok(scene)
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the one reference that `rtcNewScene` returned.
        unsafe { sys::rtcReleaseScene(self.0) };
    }
}

/// Refuses a library older than the headers that the layout of rays and hits was taken from.
fn check_version(loaded: i64) -> Result<()> {
    let headers = i64::from(sys::RTC_VERSION);
    let text = |v: i64| format!("{}.{}.{}", v / 10000, v / 100 % 100, v % 100);
    if loaded >= headers && loaded / 10000 == headers / 10000 {
        return Ok(());
    }
    Err(Error::Internal(format!(
        "the loaded Embree library is {}, but hrr was built with the headers of {}: build again, or let the loader find \
         the right library",
        text(loaded),
        text(headers)
    )))
}

fn failure(what: &str, code: sys::RTCError) -> Error {
    let reason = match code {
        sys::RTC_ERROR_INVALID_ARGUMENT => "invalid argument",
        sys::RTC_ERROR_INVALID_OPERATION => "invalid operation",
        sys::RTC_ERROR_OUT_OF_MEMORY => return Error::Memory(format!("Embree: {what}")),
        sys::RTC_ERROR_UNSUPPORTED_CPU => "this processor is not supported",
        sys::RTC_ERROR_CANCELLED => "cancelled",
        _ => "unknown error",
    };
    Error::Internal(format!("Embree: {what}: {reason} (code {code})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_older_than_the_headers_is_refused() {
        let headers = i64::from(sys::RTC_VERSION);
        assert!(check_version(headers).is_ok());
        assert!(check_version(headers + 1).is_ok());
        for loaded in [headers - 1, 31300, 50000] {
            let message = check_version(loaded).unwrap_err().to_string();
            assert!(message.contains(&format!("{}.", loaded / 10000)), "{message}");
        }
    }

    #[test]
    fn a_failed_call_is_seen_by_check() {
        let device = Device::new(1).unwrap();
        // SAFETY: a null scene is refused with an error.
        unsafe { sys::rtcCommitScene(ptr::null_mut()) };
        // The error of a call without a device belongs to none; one on a real device is kept for `check`.
        // SAFETY: the device is live; the geometry type is invalid.
        let geometry = unsafe { sys::rtcNewGeometry(device.0, 0x7fff) };
        assert!(geometry.is_null());
        assert!(matches!(device.check("test"), Err(Error::Internal(_))));
        assert!(device.check("test").is_ok());
    }

    #[test]
    fn powers_of_two_are_exact_inverses() {
        for (x, y) in [
            (1.0, 1.0),
            (1.99, 1.0),
            (2.0, 0.5),
            (3.0e38, 2f32.powi(-126)),
            (0.3, 4.0),
            (0.0, 2f32.powi(126)),
        ] {
            assert_eq!(inverse_power(x), y, "{x}");
        }
    }

    #[test]
    fn sizes_beyond_embrees_own_range_are_fine() {
        for scale in [1e-30, 1e-12, 1e12, 1e30] {
            let positions = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * scale).to_vec();
            let mesh = Mesh { positions, triangles: vec![[0, 1, 2]], materials: vec![0], ..Mesh::default() };
            let embree = Embree::new(&mesh, None, Options::threads(1)).unwrap();
            for length in [scale, 1.0] {
                let origin = Vec3::new(0.25, 0.5, 4.0) * scale;
                let ray = Ray { origin, direction: -Vec3::Z * length, t_min: 0.0, t_max: f32::INFINITY };
                let hit = embree.intersect(&ray).unwrap();
                for (value, expected) in [(hit.u, 0.25), (hit.v, 0.5), (hit.t, 4.0 * scale / length)] {
                    assert!((value / expected - 1.0).abs() < 1e-6, "{scale} {length} {hit:?}");
                }
            }
        }
    }
}
