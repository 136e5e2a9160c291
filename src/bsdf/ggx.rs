//! The GGX distribution of microfacet normals with Smith's masking, anisotropic [Walter et al. 2007; Heitz 2014].
//!
//! Everything is written so that it keeps its digits for alphas down to [`MIN_ALPHA`] and for grazing directions: the
//! distribution never sees a cosine of the half vector, which is 1 to rounding in every narrow lobe, and masking never
//! divides by the cosine of a direction (docs/theory.md section 3.6).

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, TAU};

/// The least roughness that is told from a perfectly smooth surface.
pub const MIN_ALPHA: f64 = 1e-7;

/// A rough surface around +z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ggx {
    alpha_x: f64,
    alpha_y: f64,
}

impl Ggx {
    /// Roughness along x and y (GGX alpha: slopes at half height, not squared). `None` when both are under
    /// [`MIN_ALPHA`]: a smooth surface. When only one is, it is raised to [`MIN_ALPHA`].
    pub fn new(alpha_x: f64, alpha_y: f64) -> Option<Self> {
        (alpha_x >= MIN_ALPHA || alpha_y >= MIN_ALPHA)
            .then(|| Self { alpha_x: alpha_x.max(MIN_ALPHA), alpha_y: alpha_y.max(MIN_ALPHA) })
    }

    /// Roughness along x.
    pub fn alpha_x(&self) -> f64 {
        self.alpha_x
    }

    /// Roughness along y.
    pub fn alpha_y(&self) -> f64 {
        self.alpha_y
    }

    /// Density of normals `D(h)` per solid angle and unit of area, 1/sr. `h` may have any length and either sign; a
    /// half vector is best given unnormalised.
    pub fn d(&self, h: DVec3) -> f64 {
        let len2 = h.length_squared();
        if len2 == 0.0 {
            return 0.0;
        }
        let q = DVec3::new(h.x / self.alpha_x, h.y / self.alpha_y, h.z).length_squared() / len2;
        FRAC_1_PI / (self.alpha_x * self.alpha_y * q * q)
    }

    /// |z| (1 + 2 Lambda) of a unit direction, above 0: its length in the space where the roughness is 1.
    fn stretched_length(&self, w: DVec3) -> f64 {
        DVec3::new(self.alpha_x * w.x, self.alpha_y * w.y, w.z).length()
    }

    /// Smith's masking: the share of facets seen from `w` that no other facet hides, 0..=1.
    pub fn g1(&self, w: DVec3) -> f64 {
        let z = w.z.abs();
        2.0 * z / (z + self.stretched_length(w))
    }

    /// Height-correlated masking and shadowing over both cosines, `G2 / (4 |a.z| |b.z|)` [Heitz 2014]. It
    /// grows without bound where both graze; directions nearer to the horizon than 1e-200 keep it finite.
    pub fn g2_over_4_cosines(&self, a: DVec3, b: DVec3) -> f64 {
        let cosines = self.stretched_length(a) * b.z.abs() + self.stretched_length(b) * a.z.abs();
        0.5 / cosines.max(1e-200)
    }

    /// `G2(wo, wi) / G1(wo)`, 0..=1: the weight of a direction found by way of [`Ggx::sample_visible`].
    pub fn g2_over_g1(&self, wo: DVec3, wi: DVec3) -> f64 {
        let (zo, zi) = (wo.z.abs(), wi.z.abs());
        let (ro, ri) = (self.stretched_length(wo), self.stretched_length(wi));
        zi * (zo + ro) / (ro * zi + ri * zo)
    }

    /// Masking over the cosine, `G1(wo) / (4 |wo.z|)`; finite for every direction. Times `D(m)` it is the density
    /// of the direction that a normal from [`Ggx::sample_visible`] reflects `wo` to, 1/sr; times `4 D(m) (wo . m)`
    /// that of the normal itself.
    pub fn g1_over_4_cosine(&self, wo: DVec3) -> f64 {
        0.5 / (wo.z.abs() + self.stretched_length(wo))
    }

    /// A normal, not normalised, with `z > 0`, distributed like those seen from `wo` (`wo.z > 0`): stretch the surface
    /// to roughness 1, draw from the cap of directions that a hemisphere reflects `wo` to, and shrink back
    /// [Dupuy & Benyoub 2023].
    pub fn sample_visible(&self, wo: DVec3, u: DVec2) -> DVec3 {
        let o = DVec3::new(self.alpha_x * wo.x, self.alpha_y * wo.y, wo.z).normalize();
        // The cap's height below its pole: 1 - z and z + o.z both come from it without cancelling.
        let depth = u.y * (1.0 + o.z);
        let r = (depth * (2.0 - depth)).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.x).sin_cos();
        let m = DVec3::new(r * cos + o.x, r * sin + o.y, (1.0 - u.y) * (1.0 + o.z));
        DVec3::new(self.alpha_x * m.x, self.alpha_y * m.y, m.z)
    }
}
