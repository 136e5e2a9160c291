//! Embree as its manual shows it: robust, high quality, nothing around the calls.

#![allow(unsafe_code)]

use embree4_sys as sys;
use hrr::geometry::Mesh;
use hrr::visibility::Ray;
use std::{mem, ptr};

/// A committed scene.
pub struct Bare {
    device: sys::RTCDevice,
    scene: sys::RTCScene,
}

impl Bare {
    /// Builds with one thread.
    pub fn new(mesh: &Mesh) -> Self {
        // SAFETY: every object is live when used; the buffers that Embree allocates have room for what is copied.
        unsafe {
            let device = sys::rtcNewDevice(c"threads=1".as_ptr());
            let scene = sys::rtcNewScene(device);
            sys::rtcSetSceneFlags(scene, sys::RTC_SCENE_FLAG_ROBUST);
            sys::rtcSetSceneBuildQuality(scene, sys::RTC_BUILD_QUALITY_HIGH);
            let geometry = sys::rtcNewGeometry(device, sys::RTC_GEOMETRY_TYPE_TRIANGLE);
            let buffer = |kind, format, count| {
                sys::rtcSetNewGeometryBuffer(geometry, kind, 0, format, 12, count).cast::<u8>()
            };
            let vertices = buffer(sys::RTC_BUFFER_TYPE_VERTEX, sys::RTC_FORMAT_FLOAT3, mesh.positions.len());
            ptr::copy_nonoverlapping(mesh.positions.as_ptr().cast(), vertices, 12 * mesh.positions.len());
            let corners = buffer(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT3, mesh.triangles.len());
            ptr::copy_nonoverlapping(mesh.triangles.as_ptr().cast(), corners, 12 * mesh.triangles.len());
            sys::rtcCommitGeometry(geometry);
            sys::rtcAttachGeometry(scene, geometry);
            sys::rtcReleaseGeometry(geometry);
            sys::rtcCommitScene(scene);
            assert_eq!(sys::rtcGetDeviceError(device), sys::RTC_ERROR_NONE);
            Self { device, scene }
        }
    }

    /// Whether the nearest hit exists.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> bool {
        // SAFETY: the scene is committed; null arguments are defaults; zero is a value for every field.
        unsafe {
            let mut query: sys::RTCRayHit = mem::zeroed();
            query.ray = raw(ray);
            query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
            sys::rtcIntersect1(self.scene, &mut query, ptr::null_mut());
            query.hit.geomID != sys::RTC_INVALID_GEOMETRY_ID
        }
    }

    /// Whether any hit exists.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut query = raw(ray);
        // SAFETY: as above.
        unsafe { sys::rtcOccluded1(self.scene, &mut query, ptr::null_mut()) };
        query.tfar < 0.0
    }
}

impl Drop for Bare {
    fn drop(&mut self) {
        // SAFETY: the one reference to each.
        unsafe {
            sys::rtcReleaseScene(self.scene);
            sys::rtcReleaseDevice(self.device);
        }
    }
}

fn raw(ray: &Ray) -> sys::RTCRay {
    let ([org_x, org_y, org_z], [dir_x, dir_y, dir_z]) = (ray.origin.to_array(), ray.direction.to_array());
    let (tnear, tfar) = (ray.t_min, ray.t_max);
    sys::RTCRay {
        org_x,
        org_y,
        org_z,
        tnear,
        dir_x,
        dir_y,
        dir_z,
        time: 0.0,
        tfar,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}
