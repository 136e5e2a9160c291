//! Triangle meshes that rays are cast at, for hosts that have no rays of their own.

use super::context::HrrContext;
use super::log::HRR_LOG_INFO;
use super::pointer::{self, Out, Strided};
use super::points::Points;
use super::status::{Failure, HrrStatus, Outcome, guard};
use crate::geometry::{Mesh, SurfacePoint};
use crate::settings::Backend;
use crate::visibility::{self, Visibility};
use glam::{DVec2, DVec3};
use std::ffi::c_void;
use std::fmt;

/// Embree where the library was built with it, else obvhs.
pub const HRR_BACKEND_DEFAULT: u32 = 0;
/// Intel Embree.
pub const HRR_BACKEND_EMBREE: u32 = 1;
/// The tree of the Rust crate obvhs.
pub const HRR_BACKEND_OBVHS: u32 = 2;
/// Every triangle for every ray: for comparison.
pub const HRR_BACKEND_BRUTE: u32 = 3;

/// A triangle mesh in a host's memory. Nothing needs to be aligned; nothing is referred to after the build.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrMesh {
    /// The first vertex' position: three floats or three doubles (HrrGeometryDesc), in the host's unit of length.
    pub position: *const c_void,
    /// Bytes from one position to the next; 0 = packed.
    pub position_stride: usize,
    /// Number of vertices.
    pub vertex_count: u64,
    /// The first triangle's three vertices.
    pub index: *const u32,
    /// Bytes from one triangle to the next; 0 = packed, 12.
    pub index_stride: usize,
    /// Number of triangles.
    pub triangle_count: u64,
}

/// What to build geometry from. Zero it, then set struct_size and what is wanted.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrGeometryDesc {
    /// sizeof(HrrGeometryDesc).
    pub struct_size: u32,
    /// HRR_FLOAT3 or HRR_DOUBLE3 (stored as floats relative to the centre of the box around all meshes).
    pub position_format: u32,
    /// The meshes. All backends keep the triangles in an order and scale of their own: they are copied.
    pub meshes: *const HrrMesh,
    /// Number of meshes.
    pub mesh_count: u32,
    /// HRR_BACKEND_*.
    pub backend: u32,
}

/// Triangles in a tree. Immutable: any number of threads may cast rays at once. Opaque; see hrr_geometry_build.
pub struct HrrGeometry {
    visibility: Box<dyn Visibility>,
    origin: DVec3,
    /// The first triangle of each mesh.
    first: Vec<u32>,
    /// What single precision can do to a point ([`SurfacePoint::error`]), for all triangles.
    error: f64,
}

impl fmt::Debug for HrrGeometry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("HrrGeometry").field("origin", &self.origin).field("first", &self.first).finish()
    }
}

/// Most vertices and triangles of all meshes.
const MAX_COUNT: u64 = 1 << 31;

/// A mesh whose numbers make sense.
struct Checked {
    positions: Points,
    triangles: Strided<[u32; 3]>,
    counts: [usize; 2],
}

impl Checked {
    unsafe fn new(mesh: &HrrMesh, number: usize, format: u32) -> Outcome<Self> {
        let name = |field: &str| format!("meshes[{number}].{field}");
        let [vertices, triangles] = [mesh.vertex_count, mesh.triangle_count];
        if vertices.max(triangles) > MAX_COUNT {
            let message =
                format!("meshes[{number}]: {vertices} vertices, {triangles} triangles: at most 2^31");
            return Err(Failure::argument(message));
        }
        let counts = [vertices as usize, triangles as usize];
        // SAFETY: the caller passes on its own caller's word for the arrays.
        unsafe {
            let (at, stride) = (mesh.position, mesh.position_stride);
            let positions = Points::new(at, stride, counts[0], format, &name("position"))?;
            let triangles = Strided::new(mesh.index.cast(), mesh.index_stride, counts[1], &name("index"))?;
            Ok(Self { positions, triangles, counts })
        }
    }
}

impl HrrGeometry {
    unsafe fn build(context: &HrrContext, desc: &HrrGeometryDesc) -> Outcome<Self> {
        let backend = match desc.backend {
            HRR_BACKEND_DEFAULT if cfg!(feature = "embree") => Backend::Embree,
            HRR_BACKEND_DEFAULT | HRR_BACKEND_OBVHS => Backend::Obvhs,
            HRR_BACKEND_EMBREE => Backend::Embree,
            HRR_BACKEND_BRUTE => Backend::Brute,
            other => return Err(Failure::argument(format!("desc->backend is {other}: no HRR_BACKEND_*"))),
        };
        let count = desc.mesh_count as usize;
        // SAFETY: the caller passes on its own caller's word; `get` stays below the count.
        let meshes: Vec<Checked> = unsafe {
            let meshes = Strided::new(desc.meshes, 0, count, "desc->meshes")?;
            (0..count)
                .map(|i| Checked::new(&meshes.get(i), i, desc.position_format))
                .collect::<Outcome<_>>()?
        };
        let total = |k: usize| meshes.iter().map(|m| m.counts[k] as u64).sum::<u64>();
        if total(0).max(total(1)) > MAX_COUNT {
            return Err(Failure::argument(format!(
                "{} vertices, {} triangles: at most 2^31",
                total(0),
                total(1)
            )));
        }
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (number, mesh) in meshes.iter().enumerate() {
            for i in 0..mesh.counts[0] {
                // SAFETY: below the count.
                let p = unsafe { mesh.positions.get(i) }
                    .map_err(|p| Failure::non_finite(format!("meshes[{number}].position {i} is {p}")))?;
                (low, high) = (low.min(p), high.max(p));
            }
        }
        let rebased = desc.position_format == super::segment::HRR_DOUBLE3 && low.is_finite();
        let origin = if rebased { 0.5 * low + 0.5 * high } else { DVec3::ZERO };
        let mut mesh = Mesh { origin, ..Mesh::default() };
        let mut first = Vec::with_capacity(count);
        for (number, from) in meshes.iter().enumerate() {
            let base = mesh.positions.len() as u32;
            first.push(mesh.triangles.len() as u32);
            for i in 0..from.counts[0] {
                // SAFETY: below the count. The error was found above.
                let p = unsafe { from.positions.get(i) }.unwrap_or(origin);
                mesh.positions.push((p - origin).as_vec3());
            }
            for i in 0..from.counts[1] {
                // SAFETY: below the count.
                let corners = unsafe { from.triangles.get(i) };
                if corners.iter().any(|&v| v as usize >= from.counts[0]) {
                    let message =
                        format!("meshes[{number}].index {i} is {corners:?}, of {} vertices", from.counts[0]);
                    return Err(Failure::argument(message));
                }
                mesh.triangles.push(corners.map(|v| base + v));
            }
        }
        mesh.materials = vec![0; mesh.triangles.len()];
        let visibility = visibility::build(backend, &mesh, context.pool.threads())?;
        let bounds = mesh.bounds();
        let extremes = [bounds.min.as_dvec3(), bounds.max.as_dvec3(), bounds.center()];
        let error = if bounds.is_empty() { 0.0 } else { SurfacePoint::error_on(&extremes) };
        let triangles = mesh.triangles.len();
        context.log.say(HRR_LOG_INFO, || format!("{triangles} triangles committed, {}", backend.name()));
        Ok(Self { visibility, origin, first, error })
    }

    pub(super) fn visibility(&self) -> &dyn Visibility {
        &*self.visibility
    }

    pub(super) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The mesh that a triangle of all belongs to, and its number there.
    pub(super) fn place(&self, triangle: u32) -> (u32, u32) {
        let mesh = self.first.partition_point(|&first| first <= triangle).saturating_sub(1);
        (mesh as u32, triangle - self.first.get(mesh).copied().unwrap_or(0))
    }

    /// A host's point on a surface with the given normal (of any length but 0).
    pub(super) fn surface_point(&self, position: DVec3, normal: DVec3) -> SurfacePoint {
        let (position, ng) = (position - self.origin, normal.normalize_or_zero());
        SurfacePoint { position, ng, barycentric: DVec2::ZERO, triangle: 0, error: self.error }
    }
}

/// Builds geometry with one reference, which hrr_geometry_release gives up. Blocks until the tree is built. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT (also for a backend that the library was built without), HRR_ERROR_NON_FINITE,
/// HRR_ERROR_OUT_OF_MEMORY, HRR_ERROR_ABI, HRR_ERROR_INTERNAL (Embree failed).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_geometry_build(
    context: *const HrrContext,
    desc: *const HrrGeometryDesc,
    out_geometry: *mut *mut HrrGeometry,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let context = pointer::object(context, "context")?;
            let desc = pointer::sized(desc, "desc")?;
            let out = Out::new(out_geometry, "out_geometry")?;
            out.write(pointer::handle(HrrGeometry::build(context, &desc)?));
        }
        Ok(())
    })
}

/// Adds a reference; NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_geometry_retain(geometry: *mut HrrGeometry) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::retain(geometry) };
        Ok(())
    });
}

/// Gives up a reference; the last one frees the geometry. NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_geometry_release(geometry: *mut HrrGeometry) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::release(geometry) };
        Ok(())
    });
}
