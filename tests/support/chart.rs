//! Charts: coordinates in the unit square for the things that are sampled, with the area a step in them covers. Bins of
//! a chi^2 test and quadrature both live there, so that a lobe 1e-7 wide fills as many bins as a diffuse one.
//!
//! None of this uses the code under test.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Coordinates for points of type `P`.
pub trait Chart<P> {
    /// The point at `s` in the unit square and its measure (solid angle, area) per unit of `s`; `None` where the chart
    /// has no point.
    fn point(&self, s: DVec2) -> Option<(P, f64)>;

    /// The coordinates of a point; `None` for points that are not on this chart.
    fn locate(&self, p: &P) -> Option<DVec2>;
}

/// Angle of (x, y) over a full turn, 0..=1.
fn turn(x: f64, y: f64) -> f64 {
    (y.atan2(x) / TAU).rem_euclid(1.0)
}

/// The whole sphere, equal areas: (z, azimuth).
pub struct Sphere;

impl Chart<DVec3> for Sphere {
    fn point(&self, s: DVec2) -> Option<(DVec3, f64)> {
        let z = 2.0 * s.x - 1.0;
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (TAU * s.y).sin_cos();
        Some((DVec3::new(r * cos, r * sin, z), 4.0 * PI))
    }

    fn locate(&self, w: &DVec3) -> Option<DVec2> {
        Some(DVec2::new(0.5 + 0.5 * w.z, turn(w.x, w.y)))
    }
}

/// The unit disc, equal areas: (radius^2, azimuth).
pub struct Disc;

impl Chart<DVec2> for Disc {
    fn point(&self, s: DVec2) -> Option<(DVec2, f64)> {
        let (sin, cos) = (TAU * s.y).sin_cos();
        Some((DVec2::new(cos, sin) * s.x.sqrt(), PI))
    }

    fn locate(&self, p: &DVec2) -> Option<DVec2> {
        Some(DVec2::new(p.length_squared(), turn(p.x, p.y)))
    }
}

/// The triangle u, v, u + v <= 1: (u, v / (1 - u)).
pub struct Triangle;

impl Chart<DVec2> for Triangle {
    fn point(&self, s: DVec2) -> Option<(DVec2, f64)> {
        Some((DVec2::new(s.x, s.y * (1.0 - s.x)), 1.0 - s.x))
    }

    fn locate(&self, p: &DVec2) -> Option<DVec2> {
        Some(DVec2::new(p.x, p.y / (1.0 - p.x)))
    }
}

/// Normals of the hemisphere around +z by their slopes: with (p, q) the slopes over (alpha_x, alpha_y) and r their
/// length, (1 - 1 / sqrt(1 + r^2), azimuth). For alpha = 1 that is 1 - cos, equal areas; narrow lobes spread over about
/// as much of the chart, and their tails stay visible.
#[derive(Debug, Clone, Copy)]
pub struct Slopes {
    /// Unit of slopes along x.
    pub alpha_x: f64,
    /// Unit of slopes along y.
    pub alpha_y: f64,
}

impl Chart<DVec3> for Slopes {
    fn point(&self, s: DVec2) -> Option<(DVec3, f64)> {
        let c = 1.0 - s.x;
        let r2 = s.x * (1.0 + c) / (c * c);
        let (sin, cos) = (TAU * s.y).sin_cos();
        let (x, y) = (self.alpha_x * r2.sqrt() * cos, self.alpha_y * r2.sqrt() * sin);
        let m = DVec3::new(x, y, 1.0) / (1.0 + x * x + y * y).sqrt();
        // dm = cos^3 dx dy, dx dy = ax ay r dr d(azimuth), r dr = ds / c^3.
        let area = (m.z / c).powi(3) * self.alpha_x * self.alpha_y * TAU;
        (area > 0.0).then_some((m, area))
    }

    fn locate(&self, m: &DVec3) -> Option<DVec2> {
        if m.z <= 0.0 {
            return None;
        }
        let (x, y) = (m.x / m.z / self.alpha_x, m.y / m.z / self.alpha_y);
        let r2 = x * x + y * y;
        Some(DVec2::new(r2 / (1.0 + r2 + (1.0 + r2).sqrt()), turn(x, y)))
    }
}

/// Directions on the side of `wo`, by the slopes of the normal that reflects `wo` to them.
pub struct Reflected {
    /// The direction seen from, unit.
    pub wo: DVec3,
    /// Coordinates of normals.
    pub slopes: Slopes,
}

impl Chart<DVec3> for Reflected {
    fn point(&self, s: DVec2) -> Option<(DVec3, f64)> {
        let (m, area) = self.slopes.point(s)?;
        let m = m * self.wo.z.signum();
        let cos = self.wo.dot(m);
        let wi = 2.0 * cos * m - self.wo;
        // A turn of the mirror turns the image by twice the angle in the plane of incidence, by 2 cos across it.
        (cos > 0.0 && wi.z * self.wo.z > 0.0).then_some((wi, 4.0 * cos * area))
    }

    fn locate(&self, wi: &DVec3) -> Option<DVec2> {
        if wi.z * self.wo.z <= 0.0 {
            return None;
        }
        self.slopes.locate(&((*wi + self.wo) * self.wo.z.signum()))
    }
}

/// Directions on the other side from `wo`, by the slopes of the normal that refracts `wo` to them.
pub struct Refracted {
    /// The direction seen from, unit.
    pub wo: DVec3,
    /// Index of refraction inside (-z) over outside.
    pub ior: f64,
    /// Coordinates of normals.
    pub slopes: Slopes,
}

impl Refracted {
    /// Index on the other side over that on the side of `wo`.
    fn eta(&self) -> f64 {
        if self.wo.z > 0.0 { self.ior } else { 1.0 / self.ior }
    }
}

impl Chart<DVec3> for Refracted {
    fn point(&self, s: DVec2) -> Option<(DVec3, f64)> {
        let (m, area) = self.slopes.point(s)?;
        let (m, eta) = (m * self.wo.z.signum(), self.eta());
        let cos_o = self.wo.dot(m);
        let tangent = self.wo - cos_o * m;
        let cos2_i = 1.0 - tangent.length_squared() / (eta * eta);
        if cos_o <= 0.0 || cos2_i <= 0.0 {
            return None;
        }
        let cos_i = cos2_i.sqrt();
        let wi = -tangent / eta - cos_i * m;
        // Snell's law sin o = eta sin i for a normal turned by e: in the plane of incidence wi turns by
        // e (1 - cos o / (eta cos i)), across it by e (cos i - cos o / eta).
        let stretch = (cos_o / eta - cos_i).powi(2) / cos_i;
        (wi.z * self.wo.z < 0.0).then_some((wi, stretch * area))
    }

    fn locate(&self, wi: &DVec3) -> Option<DVec2> {
        if wi.z * self.wo.z >= 0.0 {
            return None;
        }
        // Snell: wo + eta wi has no part along the surface of the facet.
        let m = self.wo + self.eta() * *wi;
        self.slopes.locate(&(m * m.z.signum()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::Random;

    /// `point` and `locate` invert each other, and the measure is that of a small step.
    fn check(name: &str, chart: &dyn Chart<DVec3>, scale: f64) {
        let (mut rng, mut seen) = (Random::new(3), 0);
        while seen < 200 {
            let s = rng.u2() * 0.9 + 0.05;
            let step = 1e-5;
            let at = |dx, dy| chart.point(s + DVec2::new(dx, dy) * step);
            let (Some(p), Some(a), Some(b), Some(c), Some(d)) =
                (at(0.0, 0.0), at(1.0, 0.0), at(-1.0, 0.0), at(0.0, 1.0), at(0.0, -1.0))
            else {
                continue;
            };
            seen += 1;
            assert!((p.0.length() - 1.0).abs() < 1e-12);
            let back = chart.locate(&p.0).unwrap();
            assert!((back - s).length() < 1e-6 * scale, "{name} {s} {back}");
            let area = (a.0 - b.0).cross(c.0 - d.0).length() / (4.0 * step * step);
            assert!((area / p.1 - 1.0).abs() < 1e-3, "{name} at {s}: {area} is not {}", p.1);
        }
    }

    #[test]
    fn charts_invert_and_know_their_measure() {
        check("sphere", &Sphere, 1.0);
        for (alpha_x, alpha_y) in [(1.0, 1.0), (0.3, 0.05), (1e-3, 1e-2)] {
            let slopes = Slopes { alpha_x, alpha_y };
            check("slopes", &slopes, 1.0);
            for wo in [DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.6, 0.3, 0.5), DVec3::new(-0.5, 0.2, -0.8)] {
                let wo = wo.normalize();
                check("reflected", &Reflected { wo, slopes }, 1.0);
                check("refracted", &Refracted { wo, ior: 1.5, slopes }, 1.0);
            }
        }
    }

    #[test]
    fn flat_charts_invert() {
        let mut rng = Random::new(4);
        for chart in [&Disc as &dyn Chart<DVec2>, &Triangle] {
            for _ in 0..100 {
                let s = rng.u2();
                assert!((chart.locate(&chart.point(s).unwrap().0).unwrap() - s).length() < 1e-12);
            }
        }
    }
}
