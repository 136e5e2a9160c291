//! Rays: what they hit, and whether light vertices are seen from an eye vertex.

use super::cache::HrrCache;
use super::geometry::HrrGeometry;
use super::pointer::{self, Out, Strided};
use super::points::Points;
use super::query::{Asked, Hits, HrrCounters, HrrHit, HrrQuery, HrrQueryOptions, add, run};
use super::status::{Failure, HrrStatus, Outcome, guard};
use crate::geometry::SurfacePoint;
use crate::roulette::QueryCounters;
use crate::visibility::{Ray, offset};
use glam::DVec3;
use std::ffi::c_void;

/// `mesh` of an HrrRayHit where a ray hits nothing.
pub const HRR_NO_HIT: u32 = 0xffff_ffff;

/// A ray. Hits lie in t_min < t < t_max. Numbers are rounded to single precision, the origin relative to the geometry's.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HrrRay {
    /// Start.
    pub origin: [f64; 3],
    /// Direction, of any length; distances are in units of it.
    pub direction: [f64; 3],
    /// Nearest distance that counts, at least 0.
    pub t_min: f64,
    /// Farthest distance that counts; may be infinite.
    pub t_max: f64,
}

/// What a ray hits first.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HrrRayHit {
    /// Mesh, HRR_NO_HIT when there is none: the other fields are 0 then.
    pub mesh: u32,
    /// Triangle of the mesh.
    pub triangle: u32,
    /// Weight of the triangle's second corner.
    pub u: f32,
    /// Weight of the triangle's third corner.
    pub v: f32,
    /// Distance in units of the ray's direction.
    pub t: f32,
}

/// Light vertices as rays see them. Nothing needs to be aligned.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrLights {
    /// sizeof(HrrLights).
    pub struct_size: u32,
    /// HRR_FLOAT3 or HRR_DOUBLE3: of positions and of normals.
    pub format: u32,
    /// Position of the light vertex with id first_id.
    pub position: *const c_void,
    /// Bytes from one position to the next; 0 = packed.
    pub position_stride: usize,
    /// Its geometric normal, of any length and either side, 0 for a vertex on no surface; NULL = all on none.
    pub normal: *const c_void,
    /// Bytes from one normal to the next; 0 = packed.
    pub normal_stride: usize,
    /// Number of light vertices.
    pub count: u64,
    /// Id of the first one; that of light vertex i is first_id + i.
    pub first_id: u64,
}

fn ray(geometry: &HrrGeometry, ray: &HrrRay, name: impl Fn() -> String) -> Outcome<Ray> {
    let origin = (DVec3::from_array(ray.origin) - geometry.origin()).as_vec3();
    let direction = DVec3::from_array(ray.direction).as_vec3();
    let (t_min, t_max) = (ray.t_min as f32, ray.t_max as f32);
    if !(origin.is_finite() && direction.is_finite() && t_min.is_finite()) || t_max.is_nan() {
        return Err(Failure::non_finite(format!("{} is not finite: {ray:?}", name())));
    }
    if t_min < 0.0 {
        return Err(Failure::argument(format!("{}: t_min is {t_min}: at least 0", name())));
    }
    Ok(Ray { origin, direction, t_min, t_max })
}

/// Does something with each of a host's things and writes what comes of it.
unsafe fn each<T: Copy, U>(
    (things, stride, name): (*const T, usize, &str),
    count: u64,
    (out, out_name): (*mut U, &str),
    make: impl Fn(usize, T) -> Outcome<U>,
) -> Outcome {
    // SAFETY: the caller vouches for `count` of both.
    unsafe {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let things = Strided::new(things, stride, count, name)?;
        let out = Out::array(out, count, out_name)?;
        for i in 0..count {
            out.write_at(i, make(i, things.get(i))?);
        }
    }
    Ok(())
}

/// Does something with each ray.
unsafe fn each_ray<T>(
    geometry: *const HrrGeometry,
    rays: *const HrrRay,
    ray_stride: usize,
    ray_count: u64,
    out: (*mut T, &str),
    trace: impl Fn(&HrrGeometry, &Ray) -> T,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract, which the callers pass on.
        unsafe {
            let geometry = pointer::object(geometry, "geometry")?;
            each((rays, ray_stride, "rays"), ray_count, out, |i, given| {
                Ok(trace(geometry, &ray(geometry, &given, || format!("rays[{i}]"))?))
            })
        }
    })
}

/// Finds what rays hit first. rays: ray_count of them, ray_stride bytes apart (0 = packed). hits: room for ray_count.
/// Any thread, this one only; takes no lock.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE; hits before the ray that is named are written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_intersect(
    geometry: *const HrrGeometry,
    rays: *const HrrRay,
    ray_stride: usize,
    ray_count: u64,
    hits: *mut HrrRayHit,
) -> HrrStatus {
    let trace = |geometry: &HrrGeometry, ray: &Ray| match geometry.visibility().intersect(ray) {
        None => HrrRayHit { mesh: HRR_NO_HIT, triangle: 0, u: 0.0, v: 0.0, t: 0.0 },
        Some(hit) => {
            let (mesh, triangle) = geometry.place(hit.triangle);
            HrrRayHit { mesh, triangle, u: hit.u, v: hit.v, t: hit.t }
        }
    };
    // SAFETY: this module's contract.
    unsafe { each_ray(geometry, rays, ray_stride, ray_count, (hits, "hits"), trace) }
}

/// Finds which rays hit anything: 1, or 0 where the way is free. As hrr_intersect, and out_occluded: room for ray_count.
/// Any thread, this one only; takes no lock.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE; what is before the ray that is named is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_occluded(
    geometry: *const HrrGeometry,
    rays: *const HrrRay,
    ray_stride: usize,
    ray_count: u64,
    out_occluded: *mut u8,
) -> HrrStatus {
    let trace = |geometry: &HrrGeometry, ray: &Ray| u8::from(geometry.visibility().occluded(ray));
    // SAFETY: this module's contract.
    unsafe { each_ray(geometry, rays, ray_stride, ray_count, (out_occluded, "out_occluded"), trace) }
}

/// The ray that leaves a surface in a direction, to infinity: it starts off the surface by what single precision needs,
/// so that it does not hit the surface again. position, normal (geometric, of any length, either side), direction: 3
/// numbers each. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_ray_leave(
    geometry: *const HrrGeometry,
    position: *const f64,
    normal: *const f64,
    direction: *const f64,
    out_ray: *mut HrrRay,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let geometry = pointer::object(geometry, "geometry")?;
            let position = pointer::vector(position, "position")?;
            let normal = pointer::vector(normal, "normal")?;
            let direction = pointer::vector(direction, "direction")?;
            let out = Out::new(out_ray, "out_ray")?;
            let ray = offset::leave(&geometry.surface_point(position, normal), direction);
            out.write(HrrRay {
                origin: (ray.origin.as_dvec3() + geometry.origin()).to_array(),
                direction: ray.direction.as_dvec3().to_array(),
                t_min: f64::from(ray.t_min),
                t_max: f64::from(ray.t_max),
            });
        }
        Ok(())
    })
}

/// An eye vertex and the light vertices that it may see.
struct Scenery<'a> {
    geometry: &'a HrrGeometry,
    eye: SurfacePoint,
    positions: Points,
    normals: Option<Points>,
    count: u64,
    first_id: u64,
}

impl<'a> Scenery<'a> {
    unsafe fn new(
        geometry: *const HrrGeometry,
        eye: DVec3,
        eye_normal: *const f64,
        lights: *const HrrLights,
    ) -> Outcome<Self> {
        // SAFETY: passed on.
        unsafe {
            let geometry: &'a HrrGeometry = pointer::object(geometry, "geometry")?;
            let lights = pointer::sized(lights, "lights")?;
            let count = usize::try_from(lights.count).unwrap_or(usize::MAX);
            let points = |at, stride, name: &str| Points::new(at, stride, count, lights.format, name);
            let positions = points(lights.position, lights.position_stride, "lights->position")?;
            let normals = (!lights.normal.is_null())
                .then(|| points(lights.normal, lights.normal_stride, "lights->normal"))
                .transpose()?;
            let normal =
                if eye_normal.is_null() { DVec3::ZERO } else { pointer::vector(eye_normal, "eye_normal")? };
            let eye = geometry.surface_point(eye, normal);
            let (count, first_id) = (lights.count, lights.first_id);
            Ok(Self { geometry, eye, positions, normals, count, first_id })
        }
    }

    /// Whether something stands between the eye vertex and the light vertex with an id.
    unsafe fn occluded(&self, id: u64) -> Outcome<bool> {
        let index = id.wrapping_sub(self.first_id);
        if index >= self.count {
            let (first, count) = (self.first_id, self.count);
            return Err(Failure::argument(format!("lights has no id {id}: {count} of them from {first}")));
        }
        let bad = |p: DVec3| Failure::non_finite(format!("lights: light vertex {id}: {p}"));
        // SAFETY: below the count; the caller passes on its own caller's word for the arrays.
        let (position, normal) = unsafe {
            let normal = self.normals.map_or(Ok(DVec3::ZERO), |n| n.get(index as usize));
            (self.positions.get(index as usize).map_err(bad)?, normal.map_err(bad)?)
        };
        let light = self.geometry.surface_point(position, normal);
        Ok(self.geometry.visibility().occluded(&offset::between(&self.eye, &light)))
    }
}

/// Finds which of a query's hits are not seen from its eye vertex: 1, or 0 where the way is free. eye: position; 3
/// numbers. eye_normal: the geometric normal there, NULL when it is on no surface. Rays start and end off the surfaces by
/// what single precision needs. out_occluded: room for hit_count. Any thread, this one only; takes no lock.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT (also an id that `lights` does not have), HRR_ERROR_NON_FINITE, HRR_ERROR_ABI.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_occluded_hits(
    geometry: *const HrrGeometry,
    eye: *const f64,
    eye_normal: *const f64,
    lights: *const HrrLights,
    hits: *const HrrHit,
    hit_count: u64,
    out_occluded: *mut u8,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let scenery = Scenery::new(geometry, pointer::vector(eye, "eye")?, eye_normal, lights)?;
            let out = (out_occluded, "out_occluded");
            each((hits, 0, "hits"), hit_count, out, |_, hit| Ok(u8::from(scenery.occluded(hit.id)?)))
        }
    })
}

/// hrr_query and hrr_occluded_hits in one: writes those accepted light vertices that the eye vertex sees, in the order of
/// hrr_query. eye_normal: the geometric normal at the eye vertex, NULL when it is on no surface. All else as hrr_query;
/// counters count hits that are seen or not. Any thread; takes no lock, and allocates nothing unless it fails.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_query_visible(
    cache: *const HrrCache,
    geometry: *const HrrGeometry,
    query: *const HrrQuery,
    options: *const HrrQueryOptions,
    eye_normal: *const f64,
    lights: *const HrrLights,
    hits: *mut HrrHit,
    capacity: u64,
    out_count: *mut u64,
    counters: *mut HrrCounters,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let Asked { cache, query, options, counters } = Asked::read(cache, query, options, counters)?;
            let eye = DVec3::from_array((&raw const (*query).position).read_unaligned());
            let scenery = Scenery::new(geometry, eye, eye_normal, lights)?;
            let mut hits = Hits::new(hits, capacity, out_count)?;
            let (mut did, mut failure) = (QueryCounters::default(), None);
            run(cache, query, options, &mut did, |hit| match scenery.occluded(hit.id) {
                Ok(true) => {}
                Ok(false) => hits.push(hit),
                Err(e) => failure = failure.take().or(Some(e)),
            })?;
            if let Some(failure) = failure {
                return Err(failure);
            }
            add(counters, &did);
            hits.finish()
        }
    })
}
