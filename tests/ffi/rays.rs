//! Rays through the C interface: the same as in Rust, for every backend; and what is asked of them.

use super::support::*;
use crate::roulette::u;
use glam::{DVec3, Vec3};
use hrr::ffi::*;
use hrr::geometry::Mesh;
use hrr::settings::Backend;
use hrr::visibility::{self, Ray};
use std::ptr::{null, null_mut};

/// Geometry that is released in the end.
#[derive(Debug)]
struct Geometry(*mut HrrGeometry);

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: the one reference.
        unsafe { hrr_geometry_release(self.0) };
    }
}

/// A bunch of random triangles.
fn triangles(n: u32, seed: u64) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let near = |i: u64, k: u64| [10, 11, 12].map(|axis| (u(i, axis) + 0.3 * u(i * 3 + k, axis + 5)) as f32);
    let positions = (0..3 * u64::from(n)).map(|i| near(i / 3 + seed * 1000, i % 3)).collect();
    (positions, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

fn mesh(positions: &[[f32; 3]], indices: &[[u32; 3]]) -> HrrMesh {
    HrrMesh {
        position: positions.as_ptr().cast(),
        position_stride: 0,
        vertex_count: positions.len() as u64,
        index: indices.as_ptr().cast(),
        index_stride: 0,
        triangle_count: indices.len() as u64,
    }
}

fn desc(meshes: &[HrrMesh]) -> HrrGeometryDesc {
    let mut desc: HrrGeometryDesc = zeroed();
    desc.struct_size = size_of::<HrrGeometryDesc>() as u32;
    (desc.meshes, desc.mesh_count) = (meshes.as_ptr(), meshes.len() as u32);
    desc
}

fn build(context: &Context, desc: &HrrGeometryDesc) -> Result<Geometry, HrrStatus> {
    let mut geometry = null_mut();
    // SAFETY: the description's arrays are the caller's.
    match unsafe { hrr_geometry_build(context.0, desc, &mut geometry) } {
        HRR_OK => Ok(Geometry(geometry)),
        status => Err(status),
    }
}

fn rays(n: u64) -> Vec<HrrRay> {
    (0..n)
        .map(|i| {
            let v = |k: u64| [u(i, k), u(i, k + 1), u(i, k + 2)];
            let direction = v(30).map(|x| x - 0.5);
            HrrRay {
                origin: v(20),
                direction,
                t_min: 0.0,
                t_max: if i % 3 == 0 { 0.5 } else { f64::INFINITY },
            }
        })
        .collect()
}

#[test]
fn rays_hit_what_they_hit_in_rust() {
    let context = Context::new(2);
    let parts = [triangles(100, 1), (vec![], vec![]), triangles(57, 2), triangles(1, 3)];
    let meshes: Vec<_> = parts.iter().map(|(p, t)| mesh(p, t)).collect();
    let mut whole = Mesh::default();
    for (positions, indices) in &parts {
        let base = whole.positions.len() as u32;
        whole.positions.extend(positions.iter().map(|&p| Vec3::from_array(p)));
        whole.triangles.extend(indices.iter().map(|t| t.map(|v| base + v)));
    }
    whole.materials = vec![0; whole.triangles.len()];
    let mut backends = vec![(HRR_BACKEND_BRUTE, Backend::Brute), (HRR_BACKEND_OBVHS, Backend::Obvhs)];
    if cfg!(feature = "embree") {
        backends.push((HRR_BACKEND_EMBREE, Backend::Embree));
    }
    let rays = rays(size(2000, 20));
    for (number, backend) in backends {
        let geometry = build(&context, &HrrGeometryDesc { backend: number, ..desc(&meshes) }).unwrap();
        let own = visibility::build(backend, &whole, 1).unwrap();
        let mut hits = vec![HrrRayHit { mesh: 9, triangle: 9, u: 0.0, v: 0.0, t: 0.0 }; rays.len()];
        let (mut occluded, n, g) = (vec![9; rays.len()], rays.len() as u64, geometry.0);
        // SAFETY: arrays of the sizes given.
        unsafe {
            assert_eq!(hrr_intersect(g, rays.as_ptr(), 0, n, hits.as_mut_ptr()), HRR_OK, "{}", last_error());
            assert_eq!(hrr_occluded(g, rays.as_ptr(), 0, n, occluded.as_mut_ptr()), HRR_OK);
        }
        let (mut met, mut meshes_met) = (0, [0; 4]);
        for (i, ray) in rays.iter().enumerate() {
            let [origin, direction] = [ray.origin, ray.direction].map(|v| DVec3::from_array(v).as_vec3());
            let ray = Ray { origin, direction, t_min: 0.0, t_max: ray.t_max as f32 };
            assert_eq!(occluded[i], u8::from(own.occluded(&ray)));
            match own.intersect(&ray) {
                None => assert_eq!(hits[i].mesh, HRR_NO_HIT),
                Some(hit) => {
                    let first = [0, 100, 100, 157][hits[i].mesh as usize];
                    assert_eq!(first + hits[i].triangle, hit.triangle);
                    assert_eq!((hits[i].u, hits[i].v, hits[i].t), (hit.u, hit.v, hit.t));
                    meshes_met[hits[i].mesh as usize] += 1;
                    met += 1;
                }
            }
        }
        assert!(met > size(300, 2) && met < size(1990, 20), "{met}");
        assert!(meshes_met[1] == 0 && meshes_met[3] >= size(1, 0), "{meshes_met:?}");
    }
}

/// A square with a corner at `at`, seen from above and below.
fn square(at: DVec3) -> Vec<[f64; 3]> {
    [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
        .map(|(x, y)| (at + DVec3::new(x, y, 0.0)).to_array())
        .to_vec()
}

#[test]
fn hits_are_seen_or_not_far_from_the_origin() {
    // Doubles a million units away, where floats are a sixteenth of a unit apart: the floor at 0, light vertices on the
    // floor's other side, on a ceiling, and on the obstacle's two sides.
    let far = DVec3::new(1e6, -2e6, 3e6);
    let context = Context::new(1);
    let [floor, obstacle] = [square(far), square(far + DVec3::new(0.5, 0.0, 0.5))];
    let indices = [[0u32, 1, 2], [0, 2, 3]];
    let double =
        |p: &[[f64; 3]]| HrrMesh { position: p.as_ptr().cast(), vertex_count: 4, ..mesh(&[], &indices) };
    let meshes = [double(&floor), double(&obstacle)];
    let geometry =
        build(&context, &HrrGeometryDesc { position_format: HRR_DOUBLE3, ..desc(&meshes) }).unwrap();
    // x above 0.5 is behind the obstacle, seen from (x, 0.5, 0) on the floor.
    let lights: Vec<[f64; 3]> =
        (0..40).map(|i| (far + DVec3::new(f64::from(i) / 40.0, 0.5, 1.0)).to_array()).collect();
    let normals = vec![[0.0, 0.0, -2.0]; 40];
    let mut view: HrrLights = zeroed();
    view.struct_size = size_of::<HrrLights>() as u32;
    view.format = HRR_DOUBLE3;
    (view.position, view.normal) = (lights.as_ptr().cast(), normals.as_ptr().cast());
    (view.count, view.first_id) = (40, 100);
    let mut segment = floats(&[]);
    (segment.position, segment.count, segment.first_id) = (lights.as_ptr().cast(), 40, 100);
    let segments = [segment];
    let cache =
        context.build(&HrrBuildDesc { position_format: HRR_DOUBLE3, ..build_desc(&segments) }).unwrap();
    let lobe = [sphere(1.0)];
    let up = [0.0, 0.0, 1.0];
    for (x, seen) in [(0.125, 20..40), (0.875, 0..21)] {
        let eye = (far + DVec3::new(x, 0.5, 0.0)).to_array();
        let ask = query(eye, &lobe, 100.0, 1);
        let hits = cache.hits(&ask, None);
        assert_eq!(hits.len(), 40);
        let (mut occluded, mut visible, mut count) = ([9u8; 40], hits.clone(), 0);
        let (n, g) = (40, geometry.0);
        // SAFETY: arrays of the sizes given.
        unsafe {
            let status = hrr_occluded_hits(
                g,
                eye.as_ptr(),
                up.as_ptr(),
                &view,
                hits.as_ptr(),
                n,
                occluded.as_mut_ptr(),
            );
            assert_eq!(status, HRR_OK, "{}", last_error());
            let to = visible.as_mut_ptr();
            let status = hrr_query_visible(
                cache.0,
                g,
                &ask,
                null(),
                up.as_ptr(),
                &view,
                to,
                40,
                &mut count,
                null_mut(),
            );
            assert_eq!(status, HRR_OK, "{}", last_error());
        }
        let free: Vec<_> = hits.iter().zip(occluded).filter(|(_, o)| *o == 0).map(|(h, _)| *h).collect();
        assert_eq!(visible[..count as usize], free);
        assert!(seen.contains(&free.len()), "{}", free.len());
        // Nothing but the obstacle stands in the way: half-way up, the line is at x > 0.5 where it is met.
        for (hit, o) in hits.iter().zip(occluded) {
            let middle = 0.5 * (x + (hit.id - 100) as f64 / 40.0);
            assert!((middle - 0.5).abs() < 1e-3 || (o == 1) == (middle > 0.5), "{} {o}", hit.id);
        }
        // A ray that leaves the floor misses it.
        let mut ray: HrrRay = zeroed();
        let mut hit = [HrrRayHit { mesh: 0, triangle: 0, u: 0.0, v: 0.0, t: 0.0 }];
        // SAFETY: arrays of three and locals.
        unsafe {
            let status = hrr_ray_leave(g, eye.as_ptr(), up.as_ptr(), up.as_ptr(), &mut ray);
            assert_eq!(status, HRR_OK);
            assert_eq!(hrr_intersect(g, &ray, 0, 1, hit.as_mut_ptr()), HRR_OK);
        }
        assert_eq!(hit[0].mesh, if x > 0.5 { 1 } else { HRR_NO_HIT });
        assert!(x < 0.5 || (hit[0].t - 0.5).abs() < 1e-3);
    }
}

/// Asserts a status and a word of the message.
fn fails(status: HrrStatus, expected: HrrStatus, word: &str) {
    assert_eq!(status, expected, "{}", last_error());
    assert!(last_error().contains(word), "{:?} does not name {word:?}", last_error());
}

#[test]
fn bad_geometry_is_refused() {
    let context = Context::new(1);
    let (positions, indices) = triangles(4, 1);
    let good = mesh(&positions, &indices);
    let bad = HRR_ERROR_INVALID_ARGUMENT;
    let refuse = |change: &dyn Fn(&mut HrrMesh, &mut HrrGeometryDesc)| {
        // In two steps: a pointer to the meshes does not outlive their change.
        let (mut meshes, mut scratch) = ([good, good], desc(&[]));
        change(&mut meshes[1], &mut scratch);
        let mut description = desc(&meshes);
        change(&mut { good }, &mut description);
        build(&context, &description).map(|_| ()).err().unwrap_or(HRR_OK)
    };
    assert_eq!(refuse(&|_, _| ()), HRR_OK);
    assert_eq!(refuse(&|_, d| d.mesh_count = 0), HRR_OK);
    fails(refuse(&|_, d| d.struct_size = 8), HRR_ERROR_ABI, "struct_size");
    fails(refuse(&|_, d| d.backend = 4), bad, "backend");
    fails(refuse(&|_, d| d.position_format = 2), bad, "position_format");
    fails(refuse(&|_, d| d.meshes = null()), bad, "meshes");
    fails(refuse(&|m, _| m.position = null()), bad, "meshes[1].position");
    fails(refuse(&|m, _| m.index = null()), bad, "meshes[1].index");
    fails(refuse(&|m, _| m.index_stride = 8), bad, "meshes[1].index");
    fails(refuse(&|m, _| m.position_stride = usize::MAX), bad, "meshes[1].position");
    fails(refuse(&|m, _| m.vertex_count = u64::MAX), bad, "meshes[1]");
    fails(refuse(&|m, _| m.triangle_count = u64::MAX), bad, "meshes[1]");
    fails(refuse(&|m, _| m.vertex_count = 11), bad, "meshes[1].index 3");
    let mut holes = positions.clone();
    holes[5][1] = f32::NAN;
    fails(refuse(&|m, _| m.position = holes.as_ptr().cast()), HRR_ERROR_NON_FINITE, "meshes[1].position 5");
    if !cfg!(feature = "embree") {
        fails(refuse(&|_, d| d.backend = HRR_BACKEND_EMBREE), bad, "Embree");
    }
}

#[test]
fn bad_rays_are_refused() {
    let context = Context::new(1);
    let (positions, indices) = triangles(4, 1);
    let meshes = [mesh(&positions, &indices)];
    let geometry = build(&context, &desc(&meshes)).unwrap();
    let cache = context.floats(&positions);
    let (g, good) = (geometry.0, rays(2)[1]);
    let ray = |change: &dyn Fn(&mut HrrRay)| {
        let mut two = [good, good];
        change(&mut two[1]);
        let mut occluded = [9; 2];
        // SAFETY: arrays of two.
        let status = unsafe { hrr_occluded(g, two.as_ptr(), 0, 2, occluded.as_mut_ptr()) };
        assert!(status == HRR_OK || occluded[1] == 9);
        status
    };
    assert_eq!(ray(&|_| ()), HRR_OK);
    assert_eq!(ray(&|r| r.direction = [0.0; 3]), HRR_OK);
    fails(ray(&|r| r.origin[0] = f64::NAN), HRR_ERROR_NON_FINITE, "rays[1]");
    fails(ray(&|r| r.origin[0] = 1e300), HRR_ERROR_NON_FINITE, "rays[1]");
    fails(ray(&|r| r.direction[2] = f64::INFINITY), HRR_ERROR_NON_FINITE, "rays[1]");
    fails(ray(&|r| r.t_max = f64::NAN), HRR_ERROR_NON_FINITE, "rays[1]");
    fails(ray(&|r| r.t_min = f64::INFINITY), HRR_ERROR_NON_FINITE, "rays[1]");
    fails(ray(&|r| r.t_min = -1.0), HRR_ERROR_INVALID_ARGUMENT, "rays[1]");
    let lobe = [sphere(1.0)];
    let ask = query([0.0; 3], &lobe, 100.0, 1);
    let (mut view, n): (HrrLights, _) = (zeroed(), [0.0, 0.0, 1.0]);
    view.struct_size = size_of::<HrrLights>() as u32;
    (view.position, view.count) = (positions.as_ptr().cast(), positions.len() as u64);
    let visible = |view: &HrrLights, ask: &HrrQuery| {
        let (mut hits, mut count) = ([HrrHit { id: 0, probability: 0.0 }; 12], 77);
        let to = hits.as_mut_ptr();
        // SAFETY: arrays of the sizes given.
        let status = unsafe {
            hrr_query_visible(cache.0, g, ask, null(), n.as_ptr(), view, to, 12, &mut count, null_mut())
        };
        assert!(status == HRR_OK || count == 77);
        status
    };
    let bad = HRR_ERROR_INVALID_ARGUMENT;
    assert_eq!(visible(&view, &ask), HRR_OK);
    fails(visible(&HrrLights { count: 3, ..view }, &ask), bad, "lights has no id");
    fails(visible(&HrrLights { first_id: 1, ..view }, &ask), bad, "lights has no id 0");
    fails(visible(&HrrLights { struct_size: 0, ..view }, &ask), HRR_ERROR_ABI, "lights");
    fails(visible(&HrrLights { format: 7, ..view }, &ask), bad, "format");
    fails(visible(&HrrLights { position: null(), ..view }, &ask), bad, "lights->position");
    fails(visible(&HrrLights { count: u64::MAX, ..view }, &ask), bad, "lights->position");
    fails(visible(&view, &HrrQuery { position: [f64::NAN; 3], ..ask }), HRR_ERROR_NON_FINITE, "position");
    let (mut out, mut hits) = ([0u8; 2], [HrrRayHit { mesh: 0, triangle: 0, u: 0.0, v: 0.0, t: 0.0 }; 2]);
    let mut kept = good;
    // SAFETY: refused before anything is read or written, or nothing is.
    unsafe {
        let (r, v) = (&raw const good, n.as_ptr());
        fails(hrr_intersect(null(), r, 0, 1, hits.as_mut_ptr()), bad, "geometry");
        fails(hrr_intersect(g, null(), 0, 1, hits.as_mut_ptr()), bad, "rays");
        fails(hrr_intersect(g, r, 0, 1, null_mut()), bad, "hits");
        fails(hrr_intersect(g, r, 8, 1, hits.as_mut_ptr()), bad, "rays");
        fails(hrr_intersect(g, r, 0, u64::MAX, hits.as_mut_ptr()), bad, "rays");
        assert_eq!(hrr_intersect(g, null(), 0, 0, null_mut()), HRR_OK);
        fails(hrr_occluded(null(), r, 0, 1, out.as_mut_ptr()), bad, "geometry");
        fails(hrr_occluded(g, r, 0, 1, null_mut()), bad, "out_occluded");
        fails(hrr_ray_leave(null(), v, v, v, &mut kept), bad, "geometry");
        fails(hrr_ray_leave(g, null(), v, v, &mut kept), bad, "position");
        fails(hrr_ray_leave(g, v, null(), v, &mut kept), bad, "normal");
        fails(hrr_ray_leave(g, v, v, null(), &mut kept), bad, "direction");
        fails(hrr_ray_leave(g, v, v, v, null_mut()), bad, "out_ray");
        let h = [HrrHit { id: 0, probability: 1.0 }];
        let (h, o) = (h.as_ptr(), out.as_mut_ptr());
        fails(hrr_occluded_hits(null(), v, v, &view, h, 1, o), bad, "geometry");
        fails(hrr_occluded_hits(g, null(), v, &view, h, 1, o), bad, "eye");
        fails(hrr_occluded_hits(g, v, v, null(), h, 1, o), bad, "lights");
        fails(hrr_occluded_hits(g, v, v, &view, null(), 1, o), bad, "hits");
        fails(hrr_occluded_hits(g, v, v, &view, h, 1, null_mut()), bad, "out_occluded");
        assert_eq!(hrr_occluded_hits(g, v, null(), &view, h, 1, o), HRR_OK);
        let mut none = null_mut();
        fails(hrr_geometry_build(null(), &desc(&meshes), &mut none), bad, "context");
        fails(hrr_geometry_build(context.0, null(), &mut none), bad, "desc");
        fails(hrr_geometry_build(context.0, &desc(&meshes), null_mut()), bad, "out_geometry");
        hrr_geometry_retain(null_mut());
        hrr_geometry_release(null_mut());
        hrr_geometry_retain(g);
        hrr_geometry_release(g);
    }
    assert_eq!(kept, good);
}
