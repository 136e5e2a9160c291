//! For integrators: does the lobe fit, does the library work here.

use super::context::HrrContext;
use super::lobe::HrrLobe;
use super::pointer::{self, Out, Strided};
use super::status::{Failure, HRR_ERROR_INTERNAL, HrrStatus, guard};
use crate::math::Frame;
use crate::roulette::{Lobe, MinimumRandom, Query, QueryCounters, probability, query, query_brute_force};
use crate::sampler::counter::{combine, unit};
use crate::vertex_bvh::VertexBvh;
use glam::{DVec3, Vec3};

/// How a host's BSDF compares with a lobe: ratios of f |cos| to weight * K. A wrong convention of roughness or a wrong
/// frame shows in them at once.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HrrLobeFit {
    /// Directions compared: those with a lobe above 0.
    pub count: u64,
    /// Mean ratio.
    pub mean: f64,
    /// Least ratio.
    pub min: f64,
    /// Greatest ratio. Where it is large, connections are rarely tried that matter: fireflies.
    pub max: f64,
    /// The direction of the greatest ratio, an index.
    pub worst: u64,
}

/// Compares a lobe with a host's BSDF at some directions. directions: 3 numbers each, packed, of any length but 0.
/// f_cos: BSDF times |cos| for each, 1/sr, at least 0. count: at least 1. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT (also when the lobe is 0 in all directions), HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_check_lobe_fit(
    lobe: *const HrrLobe,
    directions: *const f64,
    f_cos: *const f64,
    count: u64,
    out_fit: *mut HrrLobeFit,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (out, lobe, directions, f_cos) = unsafe {
            let n = usize::try_from(count).unwrap_or(usize::MAX);
            (
                Out::new(out_fit, "out_fit")?,
                pointer::copy(lobe, "lobe")?.check(|| "lobe".into())?,
                Strided::new(directions.cast::<[f64; 3]>(), 0, n, "directions")?,
                Strided::new(f_cos, 0, n, "f_cos")?,
            )
        };
        let mut fit = HrrLobeFit { count: 0, mean: 0.0, min: f64::INFINITY, max: -1.0, worst: 0 };
        for i in 0..count as usize {
            // SAFETY: below the count.
            let (w, f) = unsafe { (DVec3::from_array(directions.get(i)), f_cos.get(i)) };
            if !(w.is_finite() && f.is_finite()) {
                return Err(Failure::non_finite(format!("direction {i} is {w}, f_cos {f}")));
            }
            if w == DVec3::ZERO || f < 0.0 {
                return Err(Failure::argument(format!("direction {i} is {w}, f_cos {f}")));
            }
            let own = lobe.weight() * lobe.k(w);
            if !(own > 0.0) {
                continue;
            }
            let ratio = f / own;
            fit.count += 1;
            fit.mean += ratio;
            fit.min = fit.min.min(ratio);
            if ratio > fit.max {
                (fit.max, fit.worst) = (ratio, i as u64);
            }
        }
        if fit.count == 0 {
            return Err(Failure::argument(format!("the lobe is 0 in all of {count} directions")));
        }
        fit.mean /= fit.count as f64;
        out.write(fit);
        Ok(())
    })
}

/// Builds a cache and queries it, in all modes, against brute force: shows that the library does on this machine what
/// it does elsewhere. Some 10 milliseconds. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INTERNAL (a difference; the message says where).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_self_test(context: *const HrrContext, seed: u64) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let context = unsafe { pointer::object(context, "context") }?;
        let u = |i: u64, k: u64| unit(combine(combine(seed, i), k));
        let random = |i: u64| DVec3::new(u(i, 1), u(i, 2), u(i, 3));
        let points: Vec<Vec3> = (0..3000).map(|i| random(i).as_vec3()).collect();
        let mut bvh = VertexBvh::new();
        context.pool.install(|| bvh.build(&points))?;
        let mut accepted = 0;
        for i in 0..40 {
            let eye = random(i + 10_000);
            let toward = (points[i as usize * 7].as_dvec3() - eye).normalize_or(DVec3::Z);
            let (ax, ay) = (10f64.powf(-3.0 * u(i, 4)), 10f64.powf(-3.0 * u(i, 5)));
            let lobe = [Lobe::new(Frame::from_z_tangent(toward, random(i + 20_000)), ax, ay, 1.0)];
            for rule in [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact] {
                let ask = Query { rule, ..Query::new(eye, &lobe, 0.01, combine(seed, i)) };
                let (mut tree, mut brute) = (Vec::new(), Vec::new());
                let mut counters = QueryCounters::default();
                query(&bvh, &ask, &mut counters, &mut |i, p| tree.push((i, p)));
                query_brute_force(&bvh, &ask, &mut counters, &mut |i, p| brute.push((i, p)));
                let exact = tree.iter().all(|&(index, p)| {
                    probability(&lobe, 0.01, points[index as usize].as_dvec3() - eye) == p
                });
                if tree != brute || !exact {
                    let message = format!("query {i}, {rule:?}: the tree and brute force differ");
                    return Err(Failure::new(HRR_ERROR_INTERNAL, message));
                }
                accepted += tree.len();
            }
        }
        if accepted == 0 {
            return Err(Failure::new(HRR_ERROR_INTERNAL, "nothing was accepted in 120 queries"));
        }
        Ok(())
    })
}
