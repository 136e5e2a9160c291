//! From a scattering vertex to the lobe by which the roulette judges directions (docs/theory.md section 5).

use super::lobe::Lobe;
use crate::math::Frame;
use glam::DVec3;
use std::f64::consts::PI;

/// How much the range is widened at grazing angles: `cos` becomes `cos + k alpha sin` in the warp's Jacobian.
///
/// The mirrored lobe of a rough surface does not shrink with the cosine of the *mean* direction beyond what the
/// spread of its normals allows. Nothing is lost below 60 degrees; at 89 degrees and alpha 0.1 the variance falls
/// from 62 to 5.5.
pub const GRAZING_WIDENING: f64 = 1.5;

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
        let bounded = |alpha: f64| if alpha > MIN_GGX_ALPHA { alpha.min(1.0) } else { MIN_GGX_ALPHA }; // NaN too
        let (ax, ay) = (bounded(alpha_x), bounded(alpha_y));
        let o = frame.to_local(wo);
        let cos = o.z.max(1e-12);
        let sin = o.x.hypot(o.y);
        let (px, py) = if sin > 0.0 { (o.x / sin, o.y / sin) } else { (1.0, 0.0) };
        let in_plane = frame.to_world(DVec3::new(px * o.z, py * o.z, sin));
        let out_of_plane = frame.to_world(DVec3::new(-py, px, 0.0));
        let axis = frame.to_world(DVec3::new(-o.x, -o.y, o.z));

        // The normal distribution's quadratic form in the plane of incidence, carried over by the Jacobian of the
        // mirror direction: 1/2 in the plane, 1/(2 cos) across.
        let (lx, ly) = (1.0 / (ax * ax) - 1.0, 1.0 / (ay * ay) - 1.0);
        let widened = cos + GRAZING_WIDENING * (px * ax).hypot(py * ay) * sin;
        let (jx, jy) = (0.5, 0.5 / widened);
        let a = jx * jx * (lx * px * px + ly * py * py);
        let b = jx * jy * (ly - lx) * px * py;
        let d = jy * jy * (lx * py * py + ly * px * px);
        let (small, large, (c, s)) = eigen(a, b, d, jx * jx * jy * jy * lx * ly);
        let lobe_frame =
            Frame { x: in_plane * c + out_of_plane * s, y: out_of_plane * c - in_plane * s, z: axis };
        let own = |l: f64| 0.5 / (1.0 + l).sqrt();

        let (sx, sy) = (ax * o.x, ay * o.y);
        let lambda2 = (1.0 + (sx * sx + sy * sy) / (cos * cos)).sqrt(); // 1 + 2 Lambda, the same both ways
        let weight = reflectance / (4.0 * PI * ax * ay * cos * lambda2);
        Self::new(lobe_frame, own(small), own(large), weight)
    }
}

/// Eigenvalues of the symmetric matrix [[a, b], [b, d]] of determinant `det`, smaller first, and the unit
/// eigenvector (cos, sin) of the smaller one.
///
/// The smaller value comes from the determinant: at grazing angles it is up to 1e24 times less than the larger.
fn eigen(a: f64, b: f64, d: f64, det: f64) -> (f64, f64, (f64, f64)) {
    let half_gap = 0.5 * (a - d);
    let root = half_gap.hypot(b);
    let large = 0.5 * (a + d) + root;
    let small = if large > 0.0 { (det / large).max(0.0) } else { 0.0 };
    // (a - large) v.x + b v.y = 0 for the larger one's vector; the smaller one's is perpendicular.
    let (x, y) = if half_gap >= 0.0 { (root + half_gap, b) } else { (b, root - half_gap) };
    let len = x.hypot(y);
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

    #[test]
    fn eigenvalues_keep_their_precision_apart() {
        let (small, large, (c, s)) = eigen(1.0, 0.0, 1e24, 1e24);
        assert_eq!((small, large, c.abs(), s.abs()), (1.0, 1e24, 1.0, 0.0));
        let (small, large, (c, s)) = eigen(2.0, 1.0, 2.0, 3.0);
        assert!((small - 1.0).abs() < 1e-15 && (large - 3.0).abs() < 1e-15 && (c + s).abs() < 1e-15);
    }
}
