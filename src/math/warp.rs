//! Maps from the unit square to the shapes that are sampled, each with its density.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};

/// Uniform on the unit disc, keeping neighbours together [Shirley & Chiu 1997].
pub fn square_to_disc(u: DVec2) -> DVec2 {
    let p = u * 2.0 - 1.0;
    if p == DVec2::ZERO {
        return p;
    }
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = phi.sin_cos();
    DVec2::new(r * cos, r * sin)
}

/// Cosine-distributed on the hemisphere around +z; density [`cosine_hemisphere_pdf`].
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    let d = square_to_disc(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`square_to_cosine_hemisphere`], 1/sr; 0 below the horizon.
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
pub fn square_to_triangle(u: DVec2) -> DVec2 {
    let s = u.x.sqrt();
    DVec2::new(s * (1.0 - u.y), s * u.y)
}
