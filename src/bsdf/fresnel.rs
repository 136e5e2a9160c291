//! Fresnel's equations: how much of the light a smooth interface reflects.

use crate::math::Spectrum;

/// Reflectance of an interface between two dielectrics for unpolarised light, 0..=1, and the cosine of the refracted
/// direction, `None` at total reflection. `cos_i` in 0..=1 is on the side the light comes from; `eta` is the index of
/// the other side over that of this one.
pub fn dielectric(cos_i: f64, eta: f64) -> (f64, Option<f64>) {
    // Not by way of the sine: this keeps its digits for grazing light and for indices that nearly match.
    let cos2_t = (cos_i * cos_i + (eta - 1.0) * (eta + 1.0)) / (eta * eta);
    if cos2_t <= 0.0 {
        return (1.0, None);
    }
    let cos_t = cos2_t.sqrt();
    (dielectric_from_cosines(cos_i, cos_t, eta), Some(cos_t))
}

/// [`dielectric`] where both cosines are known: the same value seen from either side, and no critical angle to round
/// across. 1 when both are 0.
pub fn dielectric_from_cosines(cos_i: f64, cos_t: f64, eta: f64) -> f64 {
    let (s, s_sum) = (cos_i - eta * cos_t, cos_i + eta * cos_t);
    let (p, p_sum) = (eta * cos_i - cos_t, eta * cos_i + cos_t);
    if s_sum <= 0.0 || p_sum <= 0.0 {
        return 1.0;
    }
    0.5 * ((s / s_sum).powi(2) + (p / p_sum).powi(2))
}

/// 1 - [`dielectric_from_cosines`] without cancelling: the share that is refracted. The cosines may both be scaled by
/// the same factor above 0.
pub fn transmittance_from_cosines(cos_i: f64, cos_t: f64, eta: f64) -> f64 {
    let (s, p) = (cos_i + eta * cos_t, eta * cos_i + cos_t);
    if s <= 0.0 || p <= 0.0 {
        return 0.0;
    }
    2.0 * eta * ((cos_i / s) * (cos_t / s) + (cos_i / p) * (cos_t / p))
}

/// Reflectance of a metal of complex index `eta + i k` (relative to the medium outside) for unpolarised light, 0..=1;
/// `cos_i` in 0..=1.
pub fn conductor(cos_i: f64, eta: f64, k: f64) -> f64 {
    let sin2 = (1.0 - cos_i) * (1.0 + cos_i);
    // g = a + ib = sqrt(N^2 - sin^2) for N = eta + ik, with the root taken where it does not cancel: a b = eta k.
    let (re, im) = ((eta - k) * (eta + k) - sin2, eta * k);
    let modulus = length(re, 2.0 * im);
    let large = (0.5 * (modulus + re.abs())).sqrt();
    let small = if large > 0.0 { im / large } else { 0.0 };
    let (a, b) = if re >= 0.0 { (large, small) } else { (small, large) };
    let s = ratio((cos_i - a).powi(2) + b * b, (cos_i + a).powi(2) + b * b);
    // p-polarised: (N^2 cos - g) / (N^2 cos + g).
    let (c, d) = ((eta - k) * (eta + k) * cos_i, 2.0 * im * cos_i);
    let p = ratio((c - a).powi(2) + (d - b).powi(2), (c + a).powi(2) + (d + b).powi(2));
    (0.5 * (s + p)).min(1.0)
}

/// Reflectance `f0` at normal incidence raised to 1 at grazing [Schlick 1994, eq. 15]; `cos_i` in 0..=1.
pub fn schlick(cos_i: f64, f0: Spectrum) -> Spectrum {
    let m = (1.0 - cos_i).max(0.0);
    f0 + (Spectrum::ONE - f0) * (m * m * (m * m) * m)
}

/// sqrt(x^2 + y^2), without the call where squares stay in range.
#[inline(always)]
fn length(x: f64, y: f64) -> f64 {
    let square = x * x + y * y;
    if square > 1e-280 && square < 1e300 { square.sqrt() } else { x.hypot(y) }
}

fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 1.0 }
}

/// What a smooth metal reflects, by direction and channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reflectance {
    /// Fresnel's equations with complex indices.
    Complex {
        /// Real part of the index, at least 0.
        eta: Spectrum,
        /// Imaginary part (extinction), at least 0.
        k: Spectrum,
    },
    /// Schlick's approximation.
    Schlick {
        /// Reflectance at normal incidence, 0..=1.
        f0: Spectrum,
    },
}

impl Reflectance {
    /// Reflectance at an angle of incidence, per channel, 0..=1; `cos_i` in 0..=1.
    pub fn at(&self, cos_i: f64) -> Spectrum {
        let cos_i = cos_i.clamp(0.0, 1.0);
        match *self {
            // Grey metals, mirrors among them, are many.
            Self::Complex { eta, k } if eta == Spectrum::splat(eta.x) && k == Spectrum::splat(k.x) => {
                Spectrum::splat(conductor(cos_i, eta.x, k.x))
            }
            Self::Complex { eta, k } => Spectrum::new(
                conductor(cos_i, eta.x, k.x),
                conductor(cos_i, eta.y, k.y),
                conductor(cos_i, eta.z, k.z),
            ),
            Self::Schlick { f0 } => schlick(cos_i, f0),
        }
    }

    /// About what is reflected of light from all sides, per channel, 0..=1: the cosine-weighted mean of
    /// [`schlick`] with this reflectance at normal incidence. Above 0 for every metal.
    pub fn mean(&self) -> Spectrum {
        let f0 = self.at(1.0);
        f0 + (Spectrum::ONE - f0) / 21.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cosines() -> impl Iterator<Item = f64> {
        (0..=200).map(|i| f64::from(i) / 200.0).chain([1e-3, 1e-6, 1e-9, 1e-12, 1.0 - 1e-12])
    }

    #[test]
    fn glass_has_its_known_values() {
        let (f, cos_t) = dielectric(1.0, 1.5);
        assert!((f - 0.04).abs() < 1e-15 && cos_t == Some(1.0));
        // Brewster's angle: only the s-polarised half is left, ((1 - n^2) / (1 + n^2))^2 / 2.
        let brewster = 1.5f64.atan().cos();
        assert!((dielectric(brewster, 1.5).0 - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-15);
        assert_eq!(dielectric(0.0, 1.5).0, 1.0);
        assert_eq!(dielectric(0.3, 1.0), (0.0, Some(0.3)));
        // Beyond the critical angle asin(1/1.5) everything comes back.
        let critical = (1.0f64 / 1.5).asin();
        assert_eq!(dielectric((critical + 1e-6).cos(), 1.0 / 1.5), (1.0, None));
        assert!(dielectric((critical - 1e-6).cos(), 1.0 / 1.5).1.is_some());
    }

    #[test]
    fn both_sides_of_an_interface_agree() {
        for eta in [1.000001, 1.1, 1.5, 2.4] {
            for c in cosines() {
                let (f, cos_t) = dielectric(c, eta);
                let (back, cos_i) = dielectric(cos_t.unwrap(), 1.0 / eta);
                assert!((0.0..=1.0).contains(&f));
                // Going back, grazing light meets the critical angle, where a cosine c is only known to eps / c and
                // the reflectance falls as 1 - 4 c / sqrt(eta^2 - 1).
                let error = 1e-15 / c.max(1e-8);
                assert!((cos_i.unwrap_or(0.0) - c).abs() < error, "{eta} {c} {cos_i:?}");
                assert!((f - back).abs() < error * 10.0 / (eta - 1.0).sqrt(), "{eta} {c} {f} {back}");
                let refracted = transmittance_from_cosines(2.0 * c, 2.0 * cos_t.unwrap(), eta);
                assert!((f + refracted - 1.0).abs() < 1e-15, "{eta} {c} {f} {refracted}");
                let same = dielectric_from_cosines(cos_t.unwrap(), c, 1.0 / eta);
                assert!((f - same).abs() < 1e-15 * (1.0 + 1.0 / (eta - 1.0)), "{eta} {c} {f} {same}");
            }
        }
    }

    #[test]
    fn a_conductor_without_extinction_is_a_dielectric() {
        for eta in [0.4, 1.5, 2.4] {
            for c in cosines() {
                let (want, got) = (dielectric(c, eta).0, conductor(c, eta, 0.0));
                assert!((want - got).abs() < 1e-12, "{eta} {c}: {want} {got}");
            }
        }
    }

    #[test]
    fn conductors_have_their_known_values() {
        // ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2) at normal incidence; 1 at grazing.
        for (n, k) in [(0.2, 3.9), (1.5, 7.6), (2.9, 3.1), (0.0, 4.0), (1e-9, 1e4)] {
            let normal = ((n - 1.0f64).powi(2) + k * k) / ((n + 1.0f64).powi(2) + k * k);
            assert!((conductor(1.0, n, k) - normal).abs() < 1e-14, "{n} {k}");
            assert!((conductor(0.0, n, k) - 1.0).abs() < 1e-14, "{n} {k}");
            assert!(cosines().all(|c| (0.0..=1.0).contains(&conductor(c, n, k))));
        }
        // At 45 degrees R_p = R_s^2 for every index.
        let (n, k, c) = (0.2, 3.9, 0.5f64.sqrt());
        let f = conductor(c, n, k);
        let rs = ((1.0 + 8.0 * f).sqrt() - 1.0) / 2.0; // solves (rs + rs^2) / 2 = f
        let (re, im): (f64, f64) = (n * n - k * k - 0.5, 2.0 * n * k);
        let (m, phase) = (re.hypot(im).sqrt(), im.atan2(re) / 2.0);
        let (a, b) = (m * phase.cos(), m * phase.sin());
        assert!((rs - ((c - a).powi(2) + b * b) / ((c + a).powi(2) + b * b)).abs() < 1e-14);
    }

    #[test]
    fn schlick_meets_its_ends_and_mean() {
        let f0 = Spectrum::new(0.0, 0.5, 1.0);
        let r = Reflectance::Schlick { f0 };
        assert_eq!((r.at(1.0), r.at(0.0)), (f0, Spectrum::ONE));
        let n = 100_000;
        let sum: Spectrum = (0..n)
            .map(|i| (f64::from(i) + 0.5) / f64::from(n))
            .map(|c| r.at(c) * (2.0 * c / f64::from(n)))
            .sum();
        assert!((sum - r.mean()).abs().max_element() < 1e-9);
    }

    #[test]
    fn senseless_indices_do_not_make_nan() {
        for (eta, k) in [(0.0, 0.0), (1e300, 0.0), (0.0, 1e150)] {
            assert!(cosines().all(|c| conductor(c, eta, k).is_finite()), "{eta} {k}");
        }
    }
}
