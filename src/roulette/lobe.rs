//! The squared ellipsoidal lobe \[HRR19\], in a form that stays accurate at every roughness (docs/theory.md section 3).

use crate::math::Frame;
pub use crate::settings::Range;
use glam::DVec3;

/// A weighted squared ellipsoidal lobe `c K(w)`, by which the roulette judges directions.
///
/// It is kept through the distance function `h(x) = |x| / sqrt(K)`, which is convex and 1-homogeneous; the vectors
/// with `h(x) <= r` fill an ellipsoid. `alpha = 1` on both axes makes `K = 1`: a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    frame: Frame,
    alpha_x: f64,
    alpha_y: f64,
    /// max(alpha_x, alpha_y)^2.
    a2: f64,
    inv_x: f64,
    inv_y: f64,
    weight: f64,
}

/// Smallest roughness of a lobe; a GGX roughness of 1e-7 seen at a cosine of 1e-6 needs less than 1e-13.
pub const MIN_ALPHA: f64 = 1e-14;

impl Lobe {
    /// A lobe around `frame.z`. `alpha_x` and `alpha_y` are the lobe's own roughness, which is about half of the GGX
    /// roughness whose reflection it stands for; they are brought into [`MIN_ALPHA`]..=1. `weight` is the value on
    /// the axis (scattering times cosine, 1/sr), at least 0; one that is not a finite number counts as 0.
    pub fn new(frame: Frame, alpha_x: f64, alpha_y: f64, weight: f64) -> Self {
        let bounded = |alpha: f64| if alpha > MIN_ALPHA { alpha.min(1.0) } else { MIN_ALPHA }; // NaN too
        let (alpha_x, alpha_y) = (bounded(alpha_x), bounded(alpha_y));
        let weight = if weight.is_finite() { weight.max(0.0) } else { 0.0 };
        Self::within_bounds(frame, alpha_x, alpha_y, weight)
    }

    /// [`Lobe::new`] of numbers that are known to be within their bounds.
    #[inline(always)]
    pub(crate) fn within_bounds(frame: Frame, alpha_x: f64, alpha_y: f64, weight: f64) -> Self {
        let a = if alpha_x > alpha_y { alpha_x } else { alpha_y };
        Self { frame, alpha_x, alpha_y, a2: a * a, inv_x: 1.0 / alpha_x, inv_y: 1.0 / alpha_y, weight }
    }

    /// What stands where there is no lobe: it accepts nothing.
    pub const NONE: Self = Self {
        frame: Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z },
        alpha_x: 1.0,
        alpha_y: 1.0,
        a2: 1.0,
        inv_x: 1.0,
        inv_y: 1.0,
        weight: 0.0,
    };

    /// The lobe that is the same in all directions: for diffuse reflection, and as a floor under another lobe.
    pub fn sphere(weight: f64) -> Self {
        Self::new(Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z }, 1.0, 1.0, weight)
    }

    /// Axis is z.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The lobe's own roughness along x and y, in (0,1].
    pub fn alpha(&self) -> (f64, f64) {
        (self.alpha_x, self.alpha_y)
    }

    /// Value on the axis, 1/sr.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// The same lobe with another weight.
    pub fn with_weight(self, weight: f64) -> Self {
        Self::new(self.frame, self.alpha_x, self.alpha_y, weight)
    }

    /// The same lobe with a simpler range around it: for comparison with the ellipsoid, which needs fewer vertices for
    /// the same image.
    pub fn with_range(self, range: Range) -> Self {
        let widest = self.alpha_x.max(self.alpha_y);
        match range {
            Range::Ellipsoid => self,
            Range::Spheroid => Self::new(self.frame, widest, widest, self.weight),
            Range::Sphere => Self::new(self.frame, 1.0, 1.0, self.weight),
        }
    }

    /// As [`Lobe::with_range`], with the weight lowered as the range is widened: about as many vertices are accepted as
    /// by the ellipsoid, since `alpha_x alpha_y` times the weight, to which the integral of the lobe over directions is
    /// proportional, stays the same.
    pub fn with_equal_range(self, range: Range) -> Self {
        if range == Range::Ellipsoid {
            return self;
        }
        let wider = self.with_range(range);
        wider.with_weight(self.weight * (self.alpha_x / wider.alpha_x) * (self.alpha_y / wider.alpha_y))
    }

    /// K in a direction (unit or not), in (0,1]; 1 on the axis. Without the weight.
    pub fn k(&self, direction: DVec3) -> f64 {
        // Of any length: none overflows.
        let size = direction.abs().max_element();
        if !(size > 0.0) {
            return 1.0;
        }
        let direction = direction / size;
        let h = self.h(direction);
        (direction.length_squared() / (h * h)).min(1.0)
    }

    /// `h(x)` of an offset from the eye vertex, in its unit; 0 for the zero vector only.
    #[inline(always)]
    pub fn h(&self, offset: DVec3) -> f64 {
        let p = self.to_lobe(offset);
        self.h_lobe(p)
    }

    /// `h^2`, the number that an accepted vertex keeps at or below `C c / xi`.
    #[inline(always)]
    pub fn h2(&self, offset: DVec3) -> f64 {
        let h = self.h(offset);
        h * h
    }

    /// Lobe space: components along the frame, x and y in units of their roughness.
    #[inline(always)]
    pub(super) fn to_lobe(self, v: DVec3) -> DVec3 {
        DVec3::new(self.frame.x.dot(v) * self.inv_x, self.frame.y.dot(v) * self.inv_y, self.frame.z.dot(v))
    }

    /// `h` in lobe space. The slides' `U - z` cancels for `z > 0`, `U + z` for `z < 0`; their product is `a^2 t^2`.
    #[inline(always)]
    fn h_lobe(&self, p: DVec3) -> f64 {
        let t2 = p.x * p.x + p.y * p.y;
        let z = p.z;
        let u = (self.a2 * t2 + z * z).sqrt();
        if z > 0.0 {
            let w = u + z;
            0.5 * (t2 / w + w)
        } else if u > 0.0 {
            let w = u - z;
            0.5 * (w / self.a2 + self.a2 * t2 / w)
        } else {
            u // 0 at the eye vertex itself; NaN stays NaN
        }
    }

    /// Gradient of `h` in lobe space at a point that is not the origin: the normal of a plane that supports the
    /// ellipsoid.
    #[inline(always)]
    fn gradient_lobe(&self, p: DVec3) -> DVec3 {
        let t2 = p.x * p.x + p.y * p.y;
        let u = (self.a2 * t2 + p.z * p.z).sqrt();
        let side = 0.5 * (1.0 + self.a2) / u;
        let s = if p.z >= 0.0 { -t2 / (u * (u + p.z)) } else { (p.z / u - 1.0) / self.a2 };
        DVec3::new(side * p.x, side * p.y, 0.5 * (s + p.z / u + 1.0))
    }

    /// A lower bound of `h` over a box of offsets `center +- half`, from supporting planes; 0 when none is found.
    ///
    /// `h` is convex and 1-homogeneous, so `h(x) >= grad h(x0) . x` for every x0 [docs/theory.md section 4].
    pub fn lower_bound(&self, center: DVec3, half: DVec3) -> f64 {
        /// Roundings of the box and of the plane, as a fraction of the box's reach.
        const PAD: f64 = 4e-15;
        let reach = (center.abs() + half).element_sum();
        let half = half + DVec3::splat(PAD * reach);
        let along = self.frame.z.dot(center).max(0.0);
        let near_axis = center + (self.frame.z * along - center).clamp(-half, half);
        let thin = if self.alpha_x < self.alpha_y { self.frame.x } else { self.frame.y };
        let slope = half * half * thin;
        let near_thin = center + (-thin.dot(center) / thin.dot(slope) * slope).clamp(-half, half);
        let mut bound = 0f64;
        for x0 in [center, near_axis, near_thin] {
            let g = self.gradient_lobe(self.to_lobe(x0));
            let world =
                self.frame.x * (g.x * self.inv_x) + self.frame.y * (g.y * self.inv_y) + self.frame.z * g.z;
            let b = world.dot(center) - world.abs().dot(half);
            bound = bound.max(b); // keeps the old bound when b is NaN
        }
        bound
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::counter::{mix, unit};

    fn u(i: u64, k: u64) -> f64 {
        unit(mix(mix(i) ^ k))
    }

    fn frame(i: u64) -> Frame {
        let v = DVec3::new(u(i, 1), u(i, 2), u(i, 3)) * 2.0 - 1.0;
        let t = DVec3::new(u(i, 4), u(i, 5), u(i, 6)) * 2.0 - 1.0;
        Frame::from_z_tangent(v.normalize(), t)
    }

    /// The slides' formula, accurate where alpha is large.
    fn slides(frame: &Frame, ax: f64, ay: f64, w: DVec3) -> f64 {
        let v = frame.to_local(w);
        let a = ax.max(ay);
        let u = ((a / ax * v.x).powi(2) + (a / ay * v.y).powi(2) + v.z * v.z).sqrt();
        4.0 * a.powi(4) / (u - v.z + a * a * (u + v.z)).powi(2)
    }

    #[test]
    fn k_is_the_slides_formula() {
        for i in 0..2000 {
            let f = frame(i);
            let (ax, ay) = (0.1 + 0.9 * u(i, 7), 0.1 + 0.9 * u(i, 8));
            let w = frame(i + 5000).z;
            let k = Lobe::new(f, ax, ay, 1.0).k(w);
            assert!((k / slides(&f, ax, ay, w) - 1.0).abs() < 1e-11, "{ax} {ay} {k}");
        }
    }

    #[test]
    fn h_fills_an_ellipsoid() {
        // On the surface of the ellipsoid of size r, h = r: centre r (1-a^2)/2, semi-axes r ax, r ay, r (1+a^2)/2.
        for i in 0..2000 {
            let f = frame(i);
            let (ax, ay) = (10f64.powf(-7.0 * u(i, 7)), 10f64.powf(-7.0 * u(i, 8)));
            let lobe = Lobe::new(f, ax, ay, 1.0);
            let (r, a2) = (10f64.powf(6.0 * u(i, 9) - 3.0), ax.max(ay).powi(2));
            let s = frame(i + 5000).z;
            let local = DVec3::new(r * ax * s.x, r * ay * s.y, 0.5 * r * (1.0 - a2 + (1.0 + a2) * s.z));
            let p = DVec3::new(local.x / ax, local.y / ay, local.z);
            // Close to the origin end (s.z = -1) the point itself is known to r epsilon only.
            assert!((lobe.h_lobe(p) / r - 1.0).abs() < 1e-14 / (a2 + (1.0 + s.z)), "{ax} {ay} {s}");
        }
    }

    #[test]
    fn gradient_is_the_derivative_and_h_is_homogeneous() {
        for i in 0..500 {
            let (ax, ay) = (10f64.powf(-4.0 * u(i, 7)), 10f64.powf(-4.0 * u(i, 8)));
            let lobe = Lobe::new(frame(i), ax, ay, 1.0);
            let p = frame(i + 5000).z * (0.1 + u(i, 9));
            let g = lobe.gradient_lobe(p);
            assert!((g.dot(p) / lobe.h_lobe(p) - 1.0).abs() < 1e-12, "Euler's identity");
            let step = 1e-6;
            for (axis, d) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                let slope = (lobe.h_lobe(p + d * step) - lobe.h_lobe(p - d * step)) / (2.0 * step);
                assert!((slope - g[axis]).abs() <= 1e-5 * g.length(), "{slope} {}", g[axis]);
            }
        }
    }

    #[test]
    fn the_integral_over_the_sphere_is_four_pi_a_squared() {
        for a in [1.0, 0.3, 0.05] {
            let lobe = Lobe::new(frame(3), a, a, 1.0);
            // Midpoint rule in log-spaced angles from the axis.
            let (n, f) = (20_000, frame(3));
            let mut sum = 0.0;
            let lo = 1e-6f64.ln();
            let width = (std::f64::consts::PI.ln() - lo) / f64::from(n);
            for i in 0..n {
                let theta = (lo + (f64::from(i) + 0.5) * width).exp();
                let w = f.to_world(DVec3::new(theta.sin(), 0.0, theta.cos()));
                sum += lobe.k(w) * theta.sin() * theta * width * std::f64::consts::TAU;
            }
            let expected = 4.0 * std::f64::consts::PI * a * a;
            assert!((sum / expected - 1.0).abs() < 1e-5, "{a}: {sum}");
        }
    }

    #[test]
    fn equal_ranges_have_equal_integrals() {
        // Of the lobe's value over all directions, with offsets of length 1: what is accepted of vertices all around.
        let integral = |lobe: &Lobe| {
            let (rings, sectors) = (2000, 720);
            let lo = 1e-6f64.ln();
            let width = (std::f64::consts::PI.ln() - lo) / f64::from(rings);
            let mut sum = 0.0;
            for i in 0..rings {
                let theta = (lo + (f64::from(i) + 0.5) * width).exp();
                let ring = (0..sectors).map(|j| {
                    let phi = (f64::from(j) + 0.5) / f64::from(sectors) * std::f64::consts::TAU;
                    let local = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                    lobe.weight() / lobe.h2(lobe.frame().to_world(local))
                });
                let mean = ring.sum::<f64>() / f64::from(sectors);
                sum += mean * theta.sin() * theta * width * std::f64::consts::TAU;
            }
            sum
        };
        for (ax, ay, within) in
            [(1e-3, 1e-3, 1e-4), (1e-3, 1e-2, 0.01), (0.02, 0.002, 0.01), (0.1, 0.1, 1e-4), (0.3, 0.1, 0.2)]
        {
            let lobe = Lobe::new(frame(5), ax, ay, 3.0);
            let truth = integral(&lobe);
            for range in Range::ALL {
                let ratio = integral(&lobe.with_equal_range(range)) / truth;
                assert!((ratio - 1.0).abs() < within, "{range} {ax} {ay}: {ratio}");
            }
        }
        let lobe = Lobe::new(frame(5), 0.1, 0.01, 3.0);
        assert_eq!(lobe.with_equal_range(Range::Ellipsoid), lobe);
    }

    #[test]
    fn bound_is_below_every_point_and_tight_for_points() {
        for i in 0..3000 {
            let (ax, ay) = (10f64.powf(-7.0 * u(i, 7)), 10f64.powf(-7.0 * u(i, 8)));
            let lobe = Lobe::new(frame(i), ax, ay, 1.0);
            let center = frame(i + 5000).z * (0.1 + u(i, 9));
            let half = DVec3::new(u(i, 10), u(i, 11), u(i, 12)) * 10f64.powf(-6.0 * u(i, 13));
            let bound = lobe.lower_bound(center, half);
            for k in 20..60 {
                let s = DVec3::new(u(i, 3 * k), u(i, 3 * k + 1), u(i, 3 * k + 2)) * 2.0 - 1.0;
                assert!(lobe.h(center + half * s) >= bound);
            }
            let point = lobe.lower_bound(center, DVec3::ZERO);
            assert!((point / lobe.h(center) - 1.0).abs() < 1e-13 / ax.min(ay), "{ax} {ay}");
        }
    }

    #[test]
    fn bad_parameters_make_harmless_lobes() {
        let l = Lobe::new(frame(0), f64::NAN, -1.0, f64::NAN);
        assert_eq!(l.weight(), 0.0);
        assert_eq!(l.alpha(), (MIN_ALPHA, MIN_ALPHA));
        assert_eq!(Lobe::sphere(2.0).h(DVec3::new(3.0, 0.0, -4.0)), 5.0);
        assert_eq!(Lobe::sphere(2.0).h(DVec3::ZERO), 0.0);
    }
}
