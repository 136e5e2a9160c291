//! From a scattering vertex to the lobe by which the roulette judges directions (docs/theory.md section 5).

use super::lobe::Lobe;
use crate::math::Frame;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// How much the range is widened at grazing angles: `cos` becomes `cos + k alpha sin` in the warp's Jacobian.
///
/// The mirrored lobe of a rough surface does not shrink with the cosine of the *mean* direction beyond what the
/// spread of its normals allows. Nothing is lost below 60 degrees; at 89 degrees and alpha 0.1 the variance falls
/// from 62 to 5.5.
pub const GRAZING_WIDENING: f64 = 1.5;

/// How much of the spread of refracted directions near the critical angle is allowed for, in units of the spread that
/// the normals cause at it.
pub const CRITICAL_WIDENING: f64 = 1.0;

/// Smallest GGX roughness that is told from a mirror.
const MIN_GGX_ALPHA: f64 = 1e-9;

impl Lobe {
    /// The lobe of GGX reflection at a vertex: where `wo` (unit, world space, on the side of `frame.z`) is mirrored,
    /// with the roughness that half vectors of `alpha_x`, `alpha_y` (along `frame.x`, `frame.y`) spread over
    /// directions [Xu et al. 2013; HRR19].
    ///
    /// The weight is f cos on the axis, `reflectance D G2 / (4 cos)`; `reflectance` is the Fresnel factor's size
    /// there (or any measure of how much of this lobe is wanted), 0..=1.
    pub fn from_ggx_reflection(
        frame: &Frame,
        wo: DVec3,
        alpha_x: f64,
        alpha_y: f64,
        reflectance: f64,
    ) -> Self {
        Self::from_ggx_reflection_widened(frame, wo, (alpha_x, alpha_y), reflectance, 1.0)
    }

    /// [`Lobe::from_ggx_reflection`] with another measure of widening: a factor on [`GRAZING_WIDENING`], at least 0.
    /// `alpha`: along `frame.x` and `frame.y`.
    pub fn from_ggx_reflection_widened(
        frame: &Frame,
        wo: DVec3,
        (alpha_x, alpha_y): (f64, f64),
        reflectance: f64,
        widening: f64,
    ) -> Self {
        let v = Vertex::new(frame, wo, alpha_x, alpha_y);
        let o = v.wo;
        let in_plane = DVec3::new(v.px * o.z, v.py * o.z, v.sin);
        let axis = DVec3::new(-o.x, -o.y, o.z);
        let widened = v.cos + widening * GRAZING_WIDENING * v.alpha_in * v.sin;
        let weight = reflectance * v.normals() * v.masking(v.cos, v.sin) / (4.0 * v.cos);
        v.lobe(frame, in_plane, axis, (0.5, 0.5 / widened), weight)
    }

    /// The lobe of GGX transmission at a vertex: where `wo` (unit, world space, on the side of `frame.z`) is
    /// refracted to; `eta` is the index of refraction behind the surface over that on the side of `wo`, > 0.
    ///
    /// The weight is f |cos| on the axis with respect to importance, `transmittance D G2 eta^2 cos_t / k^2`,
    /// k = eta cos_t - cos_o [Walter et al. 2007, eq. 21]; radiance sees 1/eta^2 of it. Beyond the critical angle,
    /// where only tilted normals transmit, the lobe lies along the horizon.
    pub fn from_ggx_transmission(
        frame: &Frame,
        wo: DVec3,
        alpha_x: f64,
        alpha_y: f64,
        eta: f64,
        transmittance: f64,
    ) -> Self {
        Self::from_ggx_transmission_widened(frame, wo, (alpha_x, alpha_y), eta, transmittance, 1.0)
    }

    /// [`Lobe::from_ggx_transmission`] with another measure of widening: a factor on [`CRITICAL_WIDENING`], at least 0.
    /// `alpha`: along `frame.x` and `frame.y`.
    pub fn from_ggx_transmission_widened(
        frame: &Frame,
        wo: DVec3,
        (alpha_x, alpha_y): (f64, f64),
        eta: f64,
        transmittance: f64,
        widening: f64,
    ) -> Self {
        let v = Vertex::new(frame, wo, alpha_x, alpha_y);
        let sin_t = (v.sin / eta).min(1.0);
        let cos_t = (1.0 - sin_t * sin_t).max(0.0).sqrt();
        // Equal indices refract nothing: the lobe would be infinitely narrow.
        let k = (eta * cos_t - v.cos).abs().max(1e-6);
        let axis = DVec3::new(-v.px * sin_t, -v.py * sin_t, -cos_t);
        let in_plane = DVec3::new(-v.px * cos_t, -v.py * cos_t, sin_t);
        // Near the critical angle cos_t spreads over its own square root: what the normals' spread leaves of it.
        let cos_t = (cos_t * cos_t + widening * CRITICAL_WIDENING * k * v.alpha_in / eta).sqrt().min(1.0);
        let weight = transmittance * v.normals() * v.masking(cos_t, sin_t) * eta * eta * cos_t / (k * k);
        v.lobe(frame, in_plane, axis, (eta * cos_t / k, -eta / k), weight)
    }
}

/// A scattering vertex as both kinds of lobes need it.
struct Vertex {
    /// Local.
    wo: DVec3,
    cos: f64,
    sin: f64,
    /// Direction of `wo` in the tangent plane; any when `wo` is the normal.
    px: f64,
    py: f64,
    alpha_x: f64,
    alpha_y: f64,
    /// Roughness in the plane of incidence.
    alpha_in: f64,
}

impl Vertex {
    fn new(frame: &Frame, wo: DVec3, alpha_x: f64, alpha_y: f64) -> Self {
        let bounded = |alpha: f64| if alpha > MIN_GGX_ALPHA { alpha.min(1.0) } else { MIN_GGX_ALPHA }; // NaN too
        let (alpha_x, alpha_y) = (bounded(alpha_x), bounded(alpha_y));
        let wo = frame.to_local(wo);
        let sin = DVec2::new(wo.x, wo.y).length();
        let (px, py) = if sin > 0.0 { (wo.x / sin, wo.y / sin) } else { (1.0, 0.0) };
        let alpha_in = DVec2::new(px * alpha_x, py * alpha_y).length();
        Self { wo, cos: wo.z.max(1e-12), sin, px, py, alpha_x, alpha_y, alpha_in }
    }

    /// D of the shading normal, 1/sr.
    fn normals(&self) -> f64 {
        1.0 / (PI * self.alpha_x * self.alpha_y)
    }

    /// Smith's height-correlated G2 between `wo` and a direction in its plane of incidence.
    fn masking(&self, cos_i: f64, sin_i: f64) -> f64 {
        let lambda = |cos: f64, sin: f64| 0.5 * ((1.0 + (self.alpha_in * sin / cos).powi(2)).sqrt() - 1.0);
        1.0 / (1.0 + lambda(self.cos, self.sin) + lambda(cos_i, sin_i))
    }

    /// The lobe around `axis` whose deviations (u along `in_plane`, v across) tilt the half vector by (j.0 u, j.1 v)
    /// in and across the plane of incidence. Vectors are local.
    fn lobe(&self, frame: &Frame, in_plane: DVec3, axis: DVec3, j: (f64, f64), weight: f64) -> Lobe {
        let (px, py) = (self.px, self.py);
        // The normal distribution is 1 / (1 + lx x^2 + ly y^2)^2; its quadratic form in the plane of incidence.
        let lx = 1.0 / (self.alpha_x * self.alpha_x) - 1.0;
        let ly = 1.0 / (self.alpha_y * self.alpha_y) - 1.0;
        let a = j.0 * j.0 * (lx * px * px + ly * py * py);
        let b = j.0 * j.1 * (ly - lx) * px * py;
        let d = j.1 * j.1 * (lx * py * py + ly * px * px);
        let (small, large, (c, s)) = eigen(a, b, d, j.0 * j.0 * j.1 * j.1 * lx * ly);
        let (u, v) = (frame.to_world(in_plane), frame.to_world(DVec3::new(-py, px, 0.0)));
        let lobe_frame = Frame { x: u * c + v * s, y: v * c - u * s, z: frame.to_world(axis) };
        let own = |l: f64| 0.5 / (1.0 + l).sqrt();
        Lobe::new(lobe_frame, own(small), own(large), weight)
    }
}

/// Eigenvalues of the symmetric matrix [[a, b], [b, d]] of determinant `det`, smaller first, and the unit
/// eigenvector (cos, sin) of the smaller one.
///
/// The smaller value comes from the determinant: at grazing angles it is up to 1e24 times less than the larger.
fn eigen(a: f64, b: f64, d: f64, det: f64) -> (f64, f64, (f64, f64)) {
    let half_gap = 0.5 * (a - d);
    let root = DVec2::new(half_gap, b).length();
    let large = 0.5 * (a + d) + root;
    let small = if large > 0.0 { (det / large).max(0.0) } else { 0.0 };
    // (a - large) v.x + b v.y = 0 for the larger one's vector; the smaller one's is perpendicular.
    let (x, y) = if half_gap >= 0.0 { (root + half_gap, b) } else { (b, root - half_gap) };
    let len = DVec2::new(x, y).length();
    let (c, s) = if len > 0.0 { (x / len, y / len) } else { (0.0, 1.0) };
    (small, large, (-s, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f cos of GGX reflection in the local frame with reflectance 1, in the vector form that stays accurate.
    fn f_cos(o: DVec3, i: DVec3, ax: f64, ay: f64) -> f64 {
        if i.z <= 0.0 {
            return 0.0;
        }
        let h = o + i;
        let q = (h.x / ax).powi(2) + (h.y / ay).powi(2) + h.z * h.z;
        let d = h.length_squared().powi(2) / (PI * ax * ay * q * q);
        let lambda =
            |v: DVec3| 0.5 * ((1.0 + ((ax * v.x).powi(2) + (ay * v.y).powi(2)) / (v.z * v.z)).sqrt() - 1.0);
        d / ((1.0 + lambda(o) + lambda(i)) * 4.0 * o.z)
    }

    fn view(theta: f64, phi: f64) -> DVec3 {
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    const LOCAL: Frame = Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z };

    #[test]
    fn the_lobe_has_the_value_of_f_cos_on_its_axis() {
        for (ax, ay) in [(1e-4, 1e-4), (1e-4, 1e-2), (0.1, 0.1), (1e-7, 1e-7)] {
            for theta in [0.0, 0.5, 1.2, 1.56] {
                let o = view(theta, 0.7);
                let lobe = Lobe::from_ggx_reflection(&LOCAL, o, ax, ay, 1.0);
                let axis = DVec3::new(-o.x, -o.y, o.z);
                assert!((lobe.frame().z - axis).length() < 1e-15);
                let expected = f_cos(o, axis, ax, ay);
                assert!(
                    (lobe.weight() / expected - 1.0).abs() < 1e-9,
                    "{ax} {theta} {expected} {}",
                    lobe.weight()
                );
            }
        }
    }

    #[test]
    fn the_lobe_fits_ggx_for_small_roughness() {
        // Relative difference within three widths of the axis, at 60 degrees: of the order of alpha.
        for (ax, ay, phi) in [(1e-4, 1e-4, 0.3), (1e-3, 1e-3, 2.0), (1e-4, 1e-3, 0.0), (1e-3, 1e-4, 0.0)] {
            let o = view(1.05, phi);
            let lobe = Lobe::from_ggx_reflection(&LOCAL, o, ax, ay, 1.0);
            let (lx, ly) = lobe.alpha();
            for k in 0..64 {
                let angle = f64::from(k) * 0.37;
                let r = f64::from(k % 8) * 0.4;
                let local =
                    DVec3::new(2.0 * lx * r * angle.cos(), 2.0 * ly * r * angle.sin(), 1.0).normalize();
                let w = lobe.frame().to_world(local);
                let fit = lobe.weight() * lobe.k(w) / f_cos(o, w, ax, ay);
                assert!((fit - 1.0).abs() < 30.0 * ax.max(ay), "{ax} {ay} {r} {angle}: {fit}");
            }
        }
    }

    /// f |cos| of GGX transmission in the local frame, transmittance 1 [Walter et al. 2007, eq. 21].
    fn f_cos_t(o: DVec3, i: DVec3, eta: f64, ax: f64, ay: f64) -> f64 {
        let h = -(o + i * eta);
        let h = if h.z < 0.0 { -h } else { h };
        let n = h.normalize();
        if i.z >= 0.0 || n.dot(o) <= 0.0 || n.dot(i) >= 0.0 {
            return 0.0;
        }
        let q = (h.x / ax).powi(2) + (h.y / ay).powi(2) + h.z * h.z;
        let d = h.length_squared().powi(2) / (PI * ax * ay * q * q);
        let lambda =
            |v: DVec3| 0.5 * ((1.0 + ((ax * v.x).powi(2) + (ay * v.y).powi(2)) / (v.z * v.z)).sqrt() - 1.0);
        let g2 = 1.0 / (1.0 + lambda(o) + lambda(i));
        let k = o.dot(n) + eta * i.dot(n);
        d * g2 * (o.dot(n) * i.dot(n)).abs() * eta * eta / (o.z * k * k)
    }

    #[test]
    fn the_transmission_lobe_fits_walters() {
        let cases = [
            (1.5, 0.0),
            (1.5, 0.9),
            (1.5, 1.5),
            (1.0 / 1.5, 0.3),
            (1.0 / 1.5, 0.65),
            (2.4, 1.2),
            (1.05, 0.8),
        ];
        for (eta, theta) in cases {
            for (ax, ay, phi) in [(1e-4, 1e-4, 0.3), (1e-4, 1e-3, 0.8), (1e-3, 1e-4, 2.5), (1e-5, 1e-5, -1.0)]
            {
                let o = view(theta, phi);
                let lobe = Lobe::from_ggx_transmission(&LOCAL, o, ax, ay, eta, 1.0);
                let f = lobe.frame();
                assert!((f.x.cross(f.y) - f.z).length() < 1e-12);
                let on_axis = f_cos_t(o, f.z, eta, ax, ay);
                assert!((lobe.weight() / on_axis - 1.0).abs() < 5.0 * ax.max(ay), "{eta} {theta} {ax}");
                let (lx, ly) = lobe.alpha();
                for k in 0..64 {
                    let angle = f64::from(k) * 0.37;
                    let r = f64::from(k % 8) * 0.4;
                    let local =
                        DVec3::new(2.0 * lx * r * angle.cos(), 2.0 * ly * r * angle.sin(), 1.0).normalize();
                    let w = f.to_world(local);
                    let fit = lobe.weight() * lobe.k(w) / f_cos_t(o, w, eta, ax, ay);
                    // What varies to first order beside D: |o.h| by alpha r tan(theta), cos_t by alpha r / cos_t.
                    let cos2_t = 1.0 - (theta.sin() / eta).powi(2);
                    let tolerance = 3.0 * ax.max(ay) * (1.0 + r * (theta.tan() + 1.0 / cos2_t));
                    assert!((fit - 1.0).abs() < tolerance, "{eta} {theta} {ax} {ay} {r} {angle}: {fit}");
                }
            }
        }
    }

    /// Relative variance of a roulette by the lobe, per unit of accepted vertices: (int F^2/q)(int q)/(int F)^2 - 1
    /// over directions, for F = f |cos| of the given kind.
    fn misfit(lobe: &Lobe, o: DVec3, alpha: f64, eta: Option<f64>) -> f64 {
        const N: u32 = 1 << 17;
        let golden = 0.618_033_988_749_894_9;
        let (mut f1, mut f2, mut q1) = (0.0, 0.0, 0.0);
        for n in 0..N {
            let (u, phi) = (
                (f64::from(n) + 0.5) / f64::from(N),
                std::f64::consts::TAU * (f64::from(n) * golden).fract(),
            );
            let r = (u / (1.0 - u)).sqrt();
            // A half vector of density D cos, and what it scatters to.
            let h = DVec3::new(alpha * r * phi.cos(), alpha * r * phi.sin(), 1.0).normalize();
            let t2 = (h.x * h.x + h.y * h.y) / (alpha * alpha) + h.z * h.z;
            let pdf_h = h.z / (PI * alpha * alpha * t2 * t2);
            let oh = o.dot(h);
            let scattered = match eta {
                _ if oh <= 0.0 => None,
                None => Some((h * (2.0 * oh) - o, 1.0 / (4.0 * oh))),
                Some(eta) => (1.0 - (1.0 - oh * oh) / (eta * eta) > 0.0).then(|| {
                    let ct = (1.0 - (1.0 - oh * oh) / (eta * eta)).sqrt();
                    let i = -o / eta + h * (oh / eta - ct);
                    (i, eta * eta * ct / (oh - eta * ct).powi(2))
                }),
            };
            if let Some((i, jacobian)) = scattered {
                let f = eta.map_or_else(|| f_cos(o, i, alpha, alpha), |eta| f_cos_t(o, i, eta, alpha, alpha));
                if f > 0.0 {
                    let pdf = pdf_h * jacobian;
                    f1 += f / pdf;
                    f2 += f * f / (lobe.weight() * lobe.k(i) * pdf);
                }
            }
            // A direction of the lobe, distributed as the GGX lobe of twice its roughness.
            let (lx, ly) = lobe.alpha();
            let w = DVec3::new(2.0 * lx * r * phi.cos(), 2.0 * ly * r * phi.sin(), 1.0).normalize();
            let t2 = (w.x / (2.0 * lx)).powi(2) + (w.y / (2.0 * ly)).powi(2) + w.z * w.z;
            let pdf = w.z / (PI * 4.0 * lx * ly * t2 * t2);
            q1 += lobe.weight() * lobe.k(lobe.frame().to_world(w)) / pdf;
        }
        f2 * q1 / (f1 * f1) - 1.0
    }

    #[test]
    fn reflection_fits_as_well_as_recorded() {
        // (alpha, degrees, bound): docs/theory.md section 5 has the table.
        let table = [
            (1e-4, 60.0, 1e-4),
            (1e-4, 85.0, 2e-4),
            (1e-2, 60.0, 0.003),
            (1e-2, 85.0, 0.14),
            (0.1, 60.0, 0.12),
            (0.1, 89.0, 5.0),
        ];
        for (alpha, degrees, bound) in table {
            let o = view(f64::to_radians(degrees), 0.4);
            let m = misfit(&Lobe::from_ggx_reflection(&LOCAL, o, alpha, alpha, 1.0), o, alpha, None);
            println!("reflection alpha {alpha} {degrees} deg: {m:.4}");
            assert!(m > -1e-3 && m < bound, "{alpha} {degrees}: {m}");
        }
    }

    #[test]
    fn transmission_fits_on_both_sides_of_the_critical_angle() {
        let table = [
            (1.5, 1e-2, 30.0, 2e-4),
            (1.5, 1e-2, 80.0, 0.015),
            (1.5, 0.1, 30.0, 0.015),
            (1.5, 0.1, 80.0, 0.75),
            (1.0 / 1.5, 1e-2, 30.0, 0.001),
            (1.0 / 1.5, 1e-2, 40.0, 0.025),
            (1.0 / 1.5, 1e-2, 41.5, 0.3),
            (1.0 / 1.5, 1e-2, 42.0, 2.6),
            (1.0 / 1.5, 1e-2, 45.0, 21.0),
            (1.0 / 1.5, 0.1, 40.0, 0.75),
            (1.0 / 1.5, 0.1, 50.0, 2.3),
        ];
        for (eta, alpha, degrees, bound) in table {
            let o = view(f64::to_radians(degrees), 0.4);
            let lobe = Lobe::from_ggx_transmission(&LOCAL, o, alpha, alpha, eta, 1.0);
            let m = misfit(&lobe, o, alpha, Some(eta));
            println!("transmission eta {eta:.3} alpha {alpha} {degrees} deg: {m:.4}");
            assert!(m > -1e-3 && m < bound, "{eta} {alpha} {degrees}: {m}");
        }
    }

    #[test]
    fn eigenvalues_keep_their_precision_apart() {
        let (small, large, (c, s)) = eigen(1.0, 0.0, 1e24, 1e24);
        assert_eq!((small, large, c.abs(), s.abs()), (1.0, 1e24, 1.0, 0.0));
        let (small, large, (c, s)) = eigen(2.0, 1.0, 2.0, 3.0);
        assert!((small - 1.0).abs() < 1e-15 && (large - 3.0).abs() < 1e-15 && (c + s).abs() < 1e-15);
    }
}
