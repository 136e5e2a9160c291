//! Lobes, and what they make of an edge.

use super::pointer::{self, Out};
use super::status::{Failure, HrrStatus, Outcome, guard};
use crate::math::Frame;
use crate::roulette::lobe::MIN_ALPHA;
use crate::roulette::{self, Lobe, MAX_LOBES};
use glam::DVec3;
use std::mem::MaybeUninit;

/// Most lobes of one query.
pub const HRR_MAX_LOBES: u32 = 8;

const _: () = assert!(HRR_MAX_LOBES as usize == MAX_LOBES);

/// A squared ellipsoidal lobe, `weight` times K, by which light vertices are judged: plain data, made by hrr_lobe_* or
/// by the host. K is 1 on the axis z.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HrrLobe {
    /// First tangent; unit length, perpendicular to y and z (1e-3 is forgiven).
    pub x: [f64; 3],
    /// Second tangent.
    pub y: [f64; 3],
    /// The lobe's axis, in the host's world space.
    pub z: [f64; 3],
    /// The lobe's own roughness along x, in (0,1]: about half the GGX roughness whose reflection it stands for. 1 on
    /// both axes makes a sphere.
    pub alpha_x: f64,
    /// The same along y.
    pub alpha_y: f64,
    /// BSDF times |cos| on the axis, 1/sr, at least 0.
    pub weight: f64,
}

/// How far from orthonormal a frame is taken as it stands, and is taken at all.
const EXACT: f64 = 1e-12;
const FORGIVEN: f64 = 1e-3;

impl From<Lobe> for HrrLobe {
    fn from(lobe: Lobe) -> Self {
        let (frame, (alpha_x, alpha_y)) = (lobe.frame(), lobe.alpha());
        let [x, y, z] = [frame.x, frame.y, frame.z].map(|v| v.to_array());
        Self { x, y, z, alpha_x, alpha_y, weight: lobe.weight() }
    }
}

impl HrrLobe {
    /// The library's lobe; `name` for the message.
    #[inline(always)]
    pub(super) fn check(&self, name: impl Fn() -> String) -> Outcome<Lobe> {
        // A copy, so that the numbers of a sound lobe need not lie in memory for the sake of the message.
        if self.is_exact() { Ok(self.lobe()) } else { (*self).check_closely(name()) }
    }

    /// Whether there is nothing to say against a lobe and nothing to make good. No number that is not finite passes.
    #[inline(always)]
    fn is_exact(&self) -> bool {
        let [x, y, z] = [self.x, self.y, self.z].map(DVec3::from_array);
        let lengths = DVec3::new(x.length_squared(), y.length_squared(), z.length_squared()) - 1.0;
        let angles = DVec3::new(x.dot(y), y.dot(z), z.dot(x));
        // One comparison for all six, which a NaN among them fails.
        lengths.length_squared() + angles.length_squared() <= EXACT * EXACT
            && (MIN_ALPHA..=1.0).contains(&self.alpha_x)
            && (MIN_ALPHA..=1.0).contains(&self.alpha_y)
            && (0.0..=f64::MAX).contains(&self.weight)
    }

    /// The library's lobe, of one that [`HrrLobe::is_exact`].
    #[inline(always)]
    fn lobe(&self) -> Lobe {
        let [x, y, z] = [self.x, self.y, self.z].map(DVec3::from_array);
        Lobe::within_bounds(Frame { x, y, z }, self.alpha_x, self.alpha_y, self.weight)
    }

    /// What is wrong with a lobe, or the lobe with its frame made good.
    #[cold]
    fn check_closely(self, name: String) -> Outcome<Lobe> {
        let [x, y, z] = [self.x, self.y, self.z].map(DVec3::from_array);
        let numbers = [self.alpha_x, self.alpha_y, self.weight];
        if !(x.is_finite() && y.is_finite() && z.is_finite() && numbers.iter().all(|n| n.is_finite())) {
            return Err(Failure::non_finite(format!("{name} is not finite: {self:?}")));
        }
        let lengths = [x, y, z].map(|v| (v.length_squared() - 1.0).abs());
        let angles = [x.dot(y), y.dot(z), z.dot(x)].map(f64::abs);
        let off = lengths.into_iter().chain(angles).fold(0.0, f64::max);
        if !(off <= FORGIVEN) {
            return Err(Failure::argument(format!("{name}: x, y, z are not orthonormal: {self:?}")));
        }
        let alphas = self.alpha_x.min(self.alpha_y) > 0.0 && self.alpha_x.max(self.alpha_y) <= 1.0;
        if !alphas || self.weight < 0.0 {
            let message = format!("{name}: alpha_x, alpha_y must be in (0,1], weight at least 0: {self:?}");
            return Err(Failure::argument(message));
        }
        // Culling counts on an exact frame; the lobe does not tell y from -y.
        let frame = if off <= EXACT { Frame { x, y, z } } else { Frame::from_z_tangent(z.normalize(), x) };
        Ok(Lobe::new(frame, self.alpha_x, self.alpha_y, self.weight))
    }
}

/// Room for the lobes of a query, which are made in their place and not moved about.
pub(super) struct Lobes([MaybeUninit<Lobe>; MAX_LOBES]);

impl Lobes {
    #[inline(always)]
    pub fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; MAX_LOBES])
    }

    #[inline(always)]
    pub unsafe fn read(&mut self, lobes: *const HrrLobe, count: u32) -> Outcome<&[Lobe]> {
        #[cold]
        fn too_many(count: u32) -> Failure {
            Failure::argument(format!("{count} lobes: at most {HRR_MAX_LOBES}"))
        }
        /// Reads it again, lest it be kept in memory for this.
        #[cold]
        unsafe fn closely(lobe: *const HrrLobe, index: usize) -> Outcome<Lobe> {
            // SAFETY: passed on.
            unsafe { lobe.read_unaligned() }.check_closely(format!("lobes[{index}]"))
        }
        let Some(places) = self.0.get_mut(..count as usize) else { return Err(too_many(count)) };
        if count > 0 {
            pointer::given(lobes, "lobes")?;
        }
        for (i, place) in places.iter_mut().enumerate() {
            // SAFETY: below `count`, which the caller vouches for.
            unsafe {
                let (at, lobe) = (lobes.add(i), lobes.add(i).read_unaligned());
                // Not by way of a result, which is a lobe more to be carried about.
                if lobe.is_exact() {
                    place.write(lobe.lobe());
                } else {
                    place.write(closely(at, i)?);
                }
            }
        }
        // SAFETY: all of them were written just now.
        Ok(unsafe { places.assume_init_ref() })
    }
}

/// The C of a query: finite, at least 0.
#[inline(always)]
pub(super) fn constant(c: f64) -> Outcome<f64> {
    #[cold]
    fn wrong(c: f64) -> Failure {
        if c.is_finite() {
            Failure::argument(format!("constant is {c}: it is an area"))
        } else {
            Failure::non_finite(format!("constant is {c}"))
        }
    }
    if (0.0..=f64::MAX).contains(&c) { Ok(c) } else { Err(wrong(c)) }
}

/// A direction of about unit length.
unsafe fn direction(pointer: *const f64, name: &str) -> Outcome<DVec3> {
    // SAFETY: passed on.
    let v = unsafe { pointer::vector(pointer, name) }?;
    let length2 = v.length_squared();
    match (length2 - 1.0).abs() {
        off if off <= EXACT => Ok(v),
        off if off <= FORGIVEN => Ok(v * (1.0 / length2.sqrt())),
        _ => Err(Failure::argument(format!("{name} is {v}, of length {}: not a direction", length2.sqrt()))),
    }
}

/// The shading frame with its normal on wo's side, and wo.
unsafe fn vertex(n: *const f64, t: *const f64, wo: *const f64) -> Outcome<(Frame, DVec3)> {
    // SAFETY: passed on.
    unsafe {
        let (n, wo) = (direction(n, "normal")?, direction(wo, "wo")?);
        let t = if t.is_null() { DVec3::ZERO } else { pointer::vector(t, "tangent")? };
        let frame = Frame::from_z_tangent(n, t);
        let outside = frame.z.dot(wo) >= 0.0;
        let frame = if outside { frame } else { Frame { x: -frame.x, y: frame.y, z: -frame.z } };
        Ok((frame, wo))
    }
}

fn in_range(value: f64, name: &str, range: std::ops::RangeInclusive<f64>) -> Outcome<f64> {
    match value {
        _ if !value.is_finite() => Err(Failure::non_finite(format!("{name} is {value}"))),
        _ if range.contains(&value) => Ok(value),
        _ => Err(Failure::argument(format!(
            "{name} is {value}: it lies in [{}, {}]",
            range.start(),
            range.end()
        ))),
    }
}

fn roughness(alpha_x: f64, alpha_y: f64) -> Outcome<(f64, f64)> {
    Ok((in_range(alpha_x, "alpha_x", 0.0..=1.0)?, in_range(alpha_y, "alpha_y", 0.0..=1.0)?))
}

/// The lobe of GGX reflection at an eye vertex: around the direction that wo is mirrored to.
///
/// normal: shading normal, either side. tangent: the direction that alpha_x goes along; NULL where the roughness is the
/// same all round. wo: towards the previous eye vertex. 3 numbers each, of unit length, world space. alpha_x, alpha_y:
/// GGX roughness alpha (not its root), from 0 to 1. reflectance: Fresnel factor, or how much of this lobe is wanted,
/// from 0 to 1; the lobe's weight is proportional to it and may be replaced. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_lobe_reflection(
    normal: *const f64,
    tangent: *const f64,
    wo: *const f64,
    alpha_x: f64,
    alpha_y: f64,
    reflectance: f64,
    out_lobe: *mut HrrLobe,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (out, (frame, wo)) = unsafe { (Out::new(out_lobe, "out_lobe")?, vertex(normal, tangent, wo)?) };
        let (alpha_x, alpha_y) = roughness(alpha_x, alpha_y)?;
        let size = in_range(reflectance, "reflectance", 0.0..=1.0)?;
        out.write(Lobe::from_ggx_reflection(&frame, wo, alpha_x, alpha_y, size).into());
        Ok(())
    })
}

/// The lobe of GGX transmission at an eye vertex: around the direction that wo is refracted to. As
/// hrr_lobe_reflection, and eta: index of refraction behind the surface over that on wo's side, in [1e-3, 1e3]. The
/// weight is that of importance; radiance sees 1 / eta^2 of it, which the host may put in its place. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_lobe_transmission(
    normal: *const f64,
    tangent: *const f64,
    wo: *const f64,
    alpha_x: f64,
    alpha_y: f64,
    eta: f64,
    transmittance: f64,
    out_lobe: *mut HrrLobe,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (out, (frame, wo)) = unsafe { (Out::new(out_lobe, "out_lobe")?, vertex(normal, tangent, wo)?) };
        let (alpha_x, alpha_y) = roughness(alpha_x, alpha_y)?;
        let eta = in_range(eta, "eta", 1e-3..=1e3)?;
        let size = in_range(transmittance, "transmittance", 0.0..=1.0)?;
        out.write(Lobe::from_ggx_transmission(&frame, wo, alpha_x, alpha_y, eta, size).into());
        Ok(())
    })
}

/// The lobe that is the same in all directions, of the given weight (1/sr, at least 0): for diffuse reflection, and as
/// a floor under another lobe. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_lobe_sphere(weight: f64, out_lobe: *mut HrrLobe) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let out = unsafe { Out::new(out_lobe, "out_lobe") }?;
        out.write(Lobe::sphere(in_range(weight, "weight", 0.0..=f64::MAX)?).into());
        Ok(())
    })
}

/// K of a lobe in a direction (3 numbers, of any length but 0), without the weight: in (0,1], 1 on the axis. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_lobe_eval(
    lobe: *const HrrLobe,
    direction: *const f64,
    out_k: *mut f64,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let out = Out::new(out_k, "out_k")?;
            let lobe = pointer::copy(lobe, "lobe")?.check(|| "lobe".into())?;
            out.write(lobe.k(pointer::vector(direction, "direction")?));
        }
        Ok(())
    })
}

/// P = min(1, constant * sum of weight_i K_i(w) / d^2) of a light vertex at an offset (light - eye, 3 numbers, the
/// host's unit of length) from an eye vertex. A pure function: for weights of any edge, whether or not a query was made.
/// To the last bit what a query divides by, given an offset from hrr_cache_offset. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_probability(
    lobes: *const HrrLobe,
    lobe_count: u32,
    constant: f64,
    offset: *const f64,
    out_probability: *mut f64,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe {
            let out = Out::new(out_probability, "out_probability")?;
            let mut read = Lobes::new();
            let lobes = read.read(lobes, lobe_count)?;
            let constant = self::constant(constant)?;
            let offset = pointer::vector(offset, "offset")?;
            out.write(roulette::probability(lobes, constant, offset));
        }
        Ok(())
    })
}

/// The constant C with which a query accepts about `wanted` light vertices while its probabilities stay below 1:
/// wanted * area / vertex_count, an area. area: the scene's surface (or what of it light reaches), in the host's unit of
/// length squared. vertex_count: of the cache; an estimate that is the same for all iterations keeps iterations
/// independent. 0 when it is 0. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_constant_for(
    wanted: f64,
    area: f64,
    vertex_count: u64,
    out_constant: *mut f64,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let out = unsafe { Out::new(out_constant, "out_constant") }?;
        let wanted = in_range(wanted, "wanted", 0.0..=f64::MAX)?;
        let area = in_range(area, "area", 0.0..=f64::MAX)?;
        out.write(constant(roulette::constant_for(wanted, area, vertex_count as usize))?);
        Ok(())
    })
}
