//! Maps from the unit square to the shapes that are sampled, each with its density.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, PI};
use std::hint::select_unpredictable;

/// Uniform on the unit disc, keeping neighbours together [Shirley & Chiu 1997].
#[inline(always)]
pub fn square_to_disc(u: DVec2) -> DVec2 {
    let p = u * 2.0 - 1.0;
    // The wedge around the nearer axis: radius r, and an angle from it of at most pi/4. No processor guesses which.
    let wide = p.x.abs() > p.y.abs();
    let (r, across) = (select_unpredictable(wide, p.x, p.y), select_unpredictable(wide, p.y, p.x));
    if r == 0.0 {
        return DVec2::ZERO;
    }
    let (sin, cos) = sin_cos_eighth(across / r);
    r * DVec2::new(select_unpredictable(wide, cos, sin), select_unpredictable(wide, sin, cos))
}

/// The inverse of [`square_to_disc`]; points outside the disc are drawn to the square's border.
pub fn disc_to_square(p: DVec2) -> DVec2 {
    let r = p.length();
    if r == 0.0 {
        return DVec2::splat(0.5);
    }
    let across = |wide: f64, narrow: f64| r.copysign(wide) * ((narrow / wide).atan() / FRAC_PI_4);
    let square = if p.x.abs() > p.y.abs() {
        DVec2::new(r.copysign(p.x), across(p.x, p.y))
    } else {
        DVec2::new(across(p.y, p.x), r.copysign(p.y))
    };
    (0.5 * (square + 1.0)).clamp(DVec2::ZERO, DVec2::ONE)
}

/// Sine and cosine of x pi/4 for x in [-1,1], to 4e-16, by Taylor series: the standard library's pair, ready for any
/// angle, was a twentieth of a path tracer's work.
#[inline(always)]
fn sin_cos_eighth(x: f64) -> (f64, f64) {
    /// 1/1!, -1/3!, 1/5! ...
    const SIN: [f64; 8] = inverse_factorials(1);
    /// 1/0!, -1/2!, 1/4! ...
    const COS: [f64; 9] = inverse_factorials(0);
    let phi = x * FRAC_PI_4;
    let sin = SIN.into_iter().rev().fold(0.0, |sum, term| sum * (phi * phi) + term);
    let cos = COS.into_iter().rev().fold(0.0, |sum, term| sum * (phi * phi) + term);
    (phi * sin, cos)
}

/// 1/n!, -1/(n+2)!, 1/(n+4)! ... from n = 0 or 1.
const fn inverse_factorials<const TERMS: usize>(first: u32) -> [f64; TERMS] {
    let (mut terms, mut factorial, mut n, mut i) = ([0.0; TERMS], 1.0, first, 0);
    while i < TERMS {
        terms[i] = if i % 2 == 0 { 1.0 / factorial } else { -1.0 / factorial };
        factorial *= ((n + 1) * (n + 2)) as f64;
        n += 2;
        i += 1;
    }
    terms
}

/// Cosine-distributed on the hemisphere around +z; density [`cosine_hemisphere_pdf`].
#[inline(always)]
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    let d = square_to_disc(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`square_to_cosine_hemisphere`], 1/sr; 0 below the horizon.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Uniform on the unit sphere; density 1/(4 pi).
pub fn square_to_sphere(u: DVec2) -> DVec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * u.y).sin_cos();
    DVec3::new(r * cos, r * sin, z)
}

/// Barycentric coordinates (u, v) of a point uniform in a triangle; weights are (1-u-v, u, v).
#[inline(always)]
pub fn square_to_triangle(u: DVec2) -> DVec2 {
    let s = u.x.sqrt();
    DVec2::new(s * (1.0 - u.y), s * u.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disc_goes_back_to_the_square() {
        for i in 0..40 {
            for j in 0..40 {
                let u = DVec2::new(f64::from(i) / 39.0, f64::from(j) / 39.0);
                let back = disc_to_square(square_to_disc(u));
                assert!((back - u).length() < 1e-14, "{u} {back}");
            }
        }
    }

    #[test]
    fn sines_and_cosines_are_the_standard_librarys() {
        for i in -1000..=1000 {
            let x = f64::from(i) / 1000.0;
            let ((sin, cos), expected) = (sin_cos_eighth(x), (x * FRAC_PI_4).sin_cos());
            assert!((sin - expected.0).abs() < 4e-16 && (cos - expected.1).abs() < 4e-16, "{x}");
        }
    }
}
