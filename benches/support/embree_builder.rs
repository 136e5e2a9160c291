//! Embree's builder of hierarchies over anything, as its manual shows it: nodes as wide as ours, callbacks that keep
//! what they are given.

#![allow(unsafe_code)]

use embree4_sys as sys;
use glam::Vec3;
use std::ffi::{c_uint, c_void};
use std::{mem, ptr};

const WIDTH: usize = 8;

#[repr(C, align(16))]
struct Node {
    children: [*mut c_void; WIDTH],
    bounds: [sys::RTCBounds; WIDTH],
}

#[repr(C, align(16))]
struct Leaf {
    count: usize,
    vertices: [u32; WIDTH],
}

unsafe extern "C" fn create_node(
    allocator: sys::RTCThreadLocalAllocator,
    _: c_uint,
    _: *mut c_void,
) -> *mut c_void {
    // SAFETY: the allocator that Embree hands in for this.
    unsafe { sys::rtcThreadLocalAlloc(allocator, size_of::<Node>(), 16) }
}

unsafe extern "C" fn set_children(
    node: *mut c_void,
    children: *mut *mut c_void,
    count: c_uint,
    _: *mut c_void,
) {
    // SAFETY: a node of create_node's, `count` <= maxBranchingFactor = WIDTH children.
    unsafe {
        let to = (&raw mut (*node.cast::<Node>()).children).cast();
        ptr::copy_nonoverlapping(children, to, count as usize);
    }
}

unsafe extern "C" fn set_bounds(
    node: *mut c_void,
    bounds: *mut *const sys::RTCBounds,
    count: c_uint,
    _: *mut c_void,
) {
    // SAFETY: as above; each bound is live during the call.
    unsafe {
        let to = (&raw mut (*node.cast::<Node>()).bounds).cast::<sys::RTCBounds>();
        for i in 0..count as usize {
            to.add(i).write(**bounds.add(i));
        }
    }
}

unsafe extern "C" fn create_leaf(
    allocator: sys::RTCThreadLocalAllocator,
    primitives: *const sys::RTCBuildPrimitive,
    count: usize,
    _: *mut c_void,
) -> *mut c_void {
    // SAFETY: room for a leaf, of which `count` <= maxLeafSize = WIDTH entries are written.
    unsafe {
        let leaf = sys::rtcThreadLocalAlloc(allocator, size_of::<Leaf>(), 16).cast::<Leaf>();
        (&raw mut (*leaf).count).write(count);
        let to = (&raw mut (*leaf).vertices).cast::<u32>();
        for i in 0..count {
            to.add(i).write((*primitives.add(i)).primID);
        }
        leaf.cast()
    }
}

/// A device with as many threads as it likes, and a hierarchy whose memory is used again.
pub struct Builder {
    device: sys::RTCDevice,
    bvh: sys::RTCBVH,
}

/// What a build starts from, and may reorder.
pub type Primitives = Vec<sys::RTCBuildPrimitive>;

/// Points as Embree takes them.
pub fn primitives(points: &[Vec3]) -> Primitives {
    let primitive = |(i, p): (usize, &Vec3)| sys::RTCBuildPrimitive {
        lower_x: p.x,
        lower_y: p.y,
        lower_z: p.z,
        geomID: 0,
        upper_x: p.x,
        upper_y: p.y,
        upper_z: p.z,
        primID: i as u32,
    };
    points.iter().enumerate().map(primitive).collect()
}

impl Builder {
    pub fn new() -> Self {
        // SAFETY: no arguments but a device that is live.
        unsafe {
            let device = sys::rtcNewDevice(ptr::null());
            let bvh = sys::rtcNewBVH(device);
            assert_eq!(sys::rtcGetDeviceError(device), sys::RTC_ERROR_NONE);
            Self { device, bvh }
        }
    }

    /// The Morton builder.
    pub fn build(&mut self, primitives: &mut Primitives) {
        // SAFETY: zero is a value for every field; the callbacks are those above.
        unsafe {
            let mut arguments: sys::RTCBuildArguments = mem::zeroed();
            arguments.byteSize = size_of::<sys::RTCBuildArguments>();
            arguments.buildQuality = sys::RTC_BUILD_QUALITY_LOW;
            arguments.maxBranchingFactor = WIDTH as u32;
            arguments.maxDepth = 1024;
            arguments.minLeafSize = 1;
            arguments.maxLeafSize = WIDTH as u32;
            arguments.traversalCost = 1.0;
            arguments.intersectionCost = 1.0;
            arguments.bvh = self.bvh;
            arguments.primitives = primitives.as_mut_ptr();
            arguments.primitiveCount = primitives.len();
            arguments.primitiveArrayCapacity = primitives.capacity();
            arguments.createNode = Some(create_node);
            arguments.setNodeChildren = Some(set_children);
            arguments.setNodeBounds = Some(set_bounds);
            arguments.createLeaf = Some(create_leaf);
            let root = sys::rtcBuildBVH(&arguments);
            assert!(!root.is_null() && sys::rtcGetDeviceError(self.device) == sys::RTC_ERROR_NONE);
            std::hint::black_box(root);
        }
    }
}

impl Drop for Builder {
    fn drop(&mut self) {
        // SAFETY: the one reference to each.
        unsafe {
            sys::rtcReleaseBVH(self.bvh);
            sys::rtcReleaseDevice(self.device);
        }
    }
}
